"""The sine and cosine kernel against mpmath at 200 bits, all lanes of this processor's registers."""

import shutil
import subprocess
from pathlib import Path

import mpmath
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]

PROGRAM = r"""
#include "ksl/engine/sine_cosine.hpp"
#include <cstdio>

template <class S> void run(int n) {
  using P = ksl::native_pack<S>;
  constexpr int lanes = ksl::native_lanes<S>;
  for (int i = 0; i < n; i += lanes) {
    P x, result[2];
    if (std::fread(&x, sizeof x, 1, stdin) != 1)
      return;
    ksl::sine_cosine(x, result[0], result[1]);
    for (int lane = 0; lane < lanes; ++lane) {
      const S pair[2] = {result[0][lane], result[1][lane]};
      std::fwrite(pair, sizeof pair, 1, stdout);
    }
  }
}
int main(int, char **argv) { argv[1][0] == 'd' ? run<double>(1 << 20) : run<float>(1 << 20); }
"""


@pytest.fixture(scope="module")
def kernel(tmp_path_factory):
    compiler = shutil.which("g++") or shutil.which("c++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    folder = tmp_path_factory.mktemp("sines")
    (folder / "sines.cpp").write_text(PROGRAM)
    flags = ["-std=c++20", "-O2", "-march=native", "-ffp-contract=off", "-DKSL_ISA=native", "-I", ROOT / "include"]
    subprocess.run([compiler, *flags, folder / "sines.cpp", "-o", folder / "sines"], check=True)
    return folder / "sines"


def angles(dtype, count=8000):
    """Of every magnitude up to a million; a third as near to multiples of π/2 as numbers come."""
    random = np.random.default_rng(17)
    x = np.exp(random.uniform(np.log(1e-6), np.log(1e6), count)) * random.choice([-1, 1], count)
    x[::3] = np.rint(x[::3] / (np.pi / 2)) * (np.pi / 2)
    return np.concatenate([[0.0, np.pi, -np.pi / 2, 1e6, -1e6], x])[: count // 16 * 16].astype(dtype)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_errs_by_less_than_a_unit_in_the_last_place(kernel, dtype):
    x = angles(dtype)
    raw = subprocess.run([kernel, "d" if dtype is np.float64 else "f"], input=x.tobytes(), capture_output=True, check=True).stdout
    found = np.frombuffer(raw, dtype).reshape(-1, 2)
    assert len(found) == len(x)
    worst = 0.0
    with mpmath.workprec(200):
        for angle, pair in zip(x, found, strict=True):
            for function, number in zip((mpmath.sin, mpmath.cos), pair, strict=True):
                exact = function(mpmath.mpf(float(angle)))
                if exact == 0:
                    assert number == 0
                    continue
                unit = mpmath.ldexp(1, mpmath.frexp(exact)[1] - (53 if dtype is np.float64 else 24))
                worst = max(worst, float(abs(mpmath.mpf(float(number)) - exact) / unit))
    assert 0.5 < worst < 1
