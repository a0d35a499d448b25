"""The sine and cosine kernel against MPFR and mpmath, over the whole range of angles, in every form that it is compiled in."""

import functools
import platform
import shutil
import subprocess
from pathlib import Path

import gmpy2
import mpmath
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
COMPILERS = ("g++", "clang++")
LEVELS = ("x86-64-v2", "x86-64-v3", "native") if platform.machine() == "x86_64" else ("native",)
BITS = 1300
"""Of mpmath: the largest double has 1024 before the point, and what is left of it must keep more than it can lose."""

PROGRAM = r"""
#include "ksl/engine/lanes/sine_cosine.hpp"
#include <cstdio>
#include <cstring>

template <class S> void run() { // sine and cosine of each angle; 1 if lanes differ from a single number
  using P = ksl::native_pack<S>;
  constexpr int lanes = ksl::native_lanes<S>;
  P x, sine, cosine;
  while (std::fread(&x, sizeof x, 1, stdin) == 1) {
    ksl::sine_cosine(x, sine, cosine);
    for (int lane = 0; lane < lanes; ++lane) {
      const S pair[2] = {sine[lane], cosine[lane]};
      S one[2];
      ksl::sine_cosine(x[lane], one[0], one[1]);
      if (std::memcmp(pair, one, sizeof pair) && !(x[lane] - x[lane] != 0))
        std::exit(1);
      std::fwrite(pair, sizeof pair, 1, stdout);
    }
  }
}
int main(int, char **argv) { argv[1][0] == 'd' ? run<double>() : run<float>(); }
"""


@pytest.fixture(scope="module")
def kernels(tmp_path_factory):
    """The program, built by each compiler for each instruction set; the first one leads."""
    folder = tmp_path_factory.mktemp("sines")
    (folder / "sines.cpp").write_text("#include <cstdlib>\n" + PROGRAM)
    found = []
    for compiler in filter(shutil.which, COMPILERS):
        for level in LEVELS:
            program = folder / f"sines-{compiler}-{level}"
            flags = ["-std=c++20", "-O2", f"-march={level}", "-ffp-contract=off", "-I", ROOT / "include"]
            subprocess.run([compiler, *flags, folder / "sines.cpp", "-o", program], check=True)
            found.append(program)
    assert found, "no C++ compiler"
    return found


def results(program, x) -> np.ndarray:
    done = subprocess.run([program, "d" if x.dtype == np.float64 else "f"], input=x.tobytes(), capture_output=True)
    assert done.returncode == 0, f"{program.name}: lanes differ from single numbers"
    return np.frombuffer(done.stdout, x.dtype).reshape(-1, 2)


def near_multiples(dtype, random, count):
    """Numbers next to multiples of π/2, of every magnitude."""
    top = 1023 if dtype is np.float64 else 127
    with mpmath.workprec(BITS):
        found = []
        for exponent in random.uniform(0, top, count):
            k = mpmath.nint(mpmath.mpf(2) ** mpmath.mpf(exponent) * 2 / mpmath.pi)
            found.append(float(k * mpmath.pi / 2))
    return found


def hardest(dtype, per_binade=2):
    """Of each binade the numbers nearest to multiples of π/2: m 2ᵉ 2/π is then near an integer, and such m are among the
    denominators of the continued fraction of 2ᵉ 2/π, and between two of them.  Fractions are integers, in units of 2⁻ᵖ."""
    digits, exponents = (53, range(-53, 971)) if dtype is np.float64 else (24, range(-24, 104))
    found, least, most, p = [], 2 ** (digits - 1), 2**digits, 2 * BITS
    with mpmath.workprec(p + 4):
        two_over_pi = int(mpmath.floor(mpmath.ldexp(2 / mpmath.pi, p)))
    for e in exponents:
        fraction = (two_over_pi << e if e >= 0 else two_over_pi >> -e) % 2**p
        before, last, above, below, candidates = 0, 1, 2**p, fraction, {1}
        while last < most:
            a, rest = divmod(above, below)
            above, below = below, rest
            fits = min(a, (most - 1 - before) // last)
            candidates |= {before + t * last for t in {*range(1, min(fits, 20) + 1), *range(max(1, fits - 3), fits + 1)}}
            before, last = last, before + a * last
        for c in tuple(candidates):
            if c < least:
                candidates |= {c * -(-least // c), c * (-(-least // c) + 1)}
        off = lambda m, fraction=fraction: min(m * fraction % 2**p, -m * fraction % 2**p)
        within = sorted((m for m in candidates if least <= m < most), key=off)
        found += [float(np.ldexp(float(m), e)) for m in within[:per_binade]]
    return found


@functools.cache
def angles(dtype) -> np.ndarray:
    random = np.random.default_rng(17)
    usual = np.exp(random.uniform(np.log(1e-6), np.log(1e6), 4000))
    usual[::3] = np.rint(usual[::3] / (np.pi / 2)) * (np.pi / 2)
    low, high = (-1074, 1024) if dtype is np.float64 else (-149, 128)
    whole = np.ldexp(random.uniform(0.5, 1, 3000), random.integers(low, high + 1, 3000))
    whole = np.concatenate([whole, np.ldexp(random.uniform(0.5, 1, 3000), random.integers(17, high + 1, 3000))])
    edges = [0.0, np.pi, np.pi / 2, 2.0**18, np.nextafter(dtype(2.0**18), dtype(np.inf)), 1e16, np.finfo(dtype).max]
    x = np.concatenate([edges, usual, whole, near_multiples(dtype, random, 1000), hardest(dtype)])
    x = random.permutation(x * random.choice([-1, 1], len(x)))  # large ones and small ones in a register
    return x[: len(x) // 16 * 16].astype(dtype)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_errs_by_less_than_a_unit_in_the_last_place_over_the_whole_range(kernels, dtype):
    x = angles(dtype)
    assert len(x) > 10000 and np.isfinite(x).all()
    found = results(kernels[0], x)
    assert len(found) == len(x)
    digits, tiniest = (53, -1074) if dtype is np.float64 else (24, -149)
    worst = {"up to fast_range": 0.0, "beyond": 0.0}
    with gmpy2.context(precision=120):  # MPFR reduces an angle with all the bits that it needs
        for angle, pair in zip(x.tolist(), found.tolist(), strict=True):
            where = "up to fast_range" if abs(angle) <= 2.0**18 else "beyond"
            for exact, number in zip(gmpy2.sin_cos(gmpy2.mpfr(angle)), pair, strict=True):
                if exact == 0:
                    assert number == 0
                    continue
                unit = max(gmpy2.frexp(exact)[0] - digits, tiniest)
                worst[where] = max(worst[where], float(abs(number - exact) * gmpy2.mpfr(2) ** -unit))
    assert all(0.5 < error < 1 for error in worst.values()), worst


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_every_compiler_and_instruction_set_gives_the_same_bits(kernels, dtype):
    x = angles(dtype)
    expected = results(kernels[0], x).tobytes()
    for program in kernels[1:]:
        assert results(program, x).tobytes() == expected, program.name


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_what_is_no_number_gives_nan_and_leaves_the_other_lanes_alone(kernels, dtype):
    x = np.tile(np.array([np.inf, 0.5, -np.inf, 1e30, np.nan, -0.5, 3.0, 2e6], dtype), 2)
    for program in kernels:
        found = results(program, x)
        assert np.isnan(found[~np.isfinite(x)]).all()
        sound = x[np.isfinite(x)].astype(float)
        with mpmath.workprec(BITS):
            exact = [[float(mpmath.sin(mpmath.mpf(a))), float(mpmath.cos(mpmath.mpf(a)))] for a in sound]
        assert np.allclose(found[np.isfinite(x)], exact, rtol=1e-15 if dtype is np.float64 else 3e-7, atol=0)
