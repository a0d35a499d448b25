"""The engine on an Arm processor, cross-compiled and emulated: the bits of this machine."""

import os
import platform
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "scripts"))
from engine_sources import engine_sources

ALGORITHMS = sorted((ROOT / "src/engine/kernels/algorithms").glob("*.cpp"))
SOURCES: dict[str, list[str]] = {
    **{f.relative_to(ROOT / "src").as_posix(): ["-DKSL_ISA=neon"] for f in ALGORITHMS},
    "engine/kernels/finite.cpp": ["-DKSL_ISA=neon", "-DKSL_TABLE=ksl_finite_neon"],
    "engine/kernels/array_kernels.cpp": ["-DKSL_ISA=neon", "-DKSL_TABLE=ksl_array_kernels_neon", "-fno-math-errno"],
    **{source: ["-DKSL_HAS_neon"] if source == "engine/kernels/dispatch.cpp" else [] for source in engine_sources()},
}
FLAGS = ["-std=c++20", "-ffp-contract=off", "-DNDEBUG", "-I", str(ROOT / "include"), "-I", str(ROOT / "src"), "-I", str(ROOT / "test/engine")]

PROGRAM = r"""
#include "robots.hpp"
#include "ksl/batch.hpp"
#include <cstdio>
#include <vector>

ksl::model tree() { // of eleven bodies on a base that floats
  ksl::robot_description r;
  r.name = "tree";
  r.links.push_back(robots::link("base", robots::solid(5, {0.1, 0.2, 0.3}, 0.4, 0.5, 0.6)));
  for (int i = 1; i < 12; ++i) {
    r.links.push_back(robots::link(("link" + std::to_string(i)).c_str(), robots::solid(1.0 / i, {0.1, -0.02 * i, 0.05}, 0.03, 0.02, 0.04)));
    r.joints.push_back(robots::joint(("joint" + std::to_string(i)).c_str(), i % 4 == 3 ? ksl::joint_kind::prismatic : ksl::joint_kind::revolute,
                                     i < 6 ? i - 1 : i / 3, i, {0.1 * i, 0.3, -0.2}, i % 2 ? ksl::vec3<double>{0, 0.6, 0.8} : ksl::vec3<double>{0, 0, 1}));
  }
  ksl::model_options options;
  options.floating_base = true;
  return ksl::model(r, options);
}

int main() {
  const ksl::model m = tree();
  ksl::data d(m);
  const std::size_t n = 9, nq = static_cast<std::size_t>(m.nq()), nv = static_cast<std::size_t>(m.nv());
  std::vector<double> q(n * nq), v(n * nv), a(n * nv), tau(nv), one(nv * nv), all(n * nv * nv);
  for (std::size_t i = 0; i < q.size(); ++i)
    q[i] = 0.37 * static_cast<double>(i % 29) - 4.1;
  for (std::size_t i = 0; i < v.size(); ++i)
    v[i] = 0.11 * static_cast<double>(i % 31) - 1.7, a[i] = 2.3 - 0.19 * static_cast<double>(i % 23);
  ksl::batch_view<double> b;
  b.n = n, b.q = {q.data(), m.nq()}, b.v = {v.data(), m.nv()}, b.a = b.tau = {a.data(), m.nv()};
  const auto show = [&](const char *what, std::size_t width, auto state, auto batch) {
    b.result[0] = {all.data(), static_cast<std::ptrdiff_t>(width)};
    batch();
    for (std::size_t k = 0; k < n; ++k) {
      state(k);
      for (std::size_t i = 0; i < width; ++i) {
        std::printf("%s %a\n", what, one[i]);
        if (!(one[i] == all[k * width + i]))
          std::printf("a batch differs: %s, state %zu, number %zu\n", what, k, i);
      }
    }
  };
  show("efforts", nv, [&](std::size_t k) { ksl::inverse_dynamics(m, d, &q[k * nq], &v[k * nv], &a[k * nv], one.data()); },
       [&] { ksl::inverse_dynamics_batch(m, b, 2); });
  show("accelerations", nv, [&](std::size_t k) { ksl::forward_dynamics(m, d, &q[k * nq], &v[k * nv], &a[k * nv], one.data()); },
       [&] { ksl::forward_dynamics_batch(m, b, 2); });
  show("masses", nv * nv, [&](std::size_t k) { ksl::mass_matrix(m, d, &q[k * nq], one.data()); }, [&] { ksl::mass_matrix_batch(m, b, 2); });
  const int links[4] = {11, 3, 0, 7};
  show("poses", 64, [&](std::size_t k) { ksl::frame_poses(m, d, &q[k * nq], 4, links, one.data()); }, [&] { b.links = {4, links}, ksl::frame_poses_batch(m, b, 2); });
  show("energies", 2, [&](std::size_t k) { ksl::energy(m, d, &q[k * nq], &v[k * nv], &one[0], &one[1]); },
       [&] { b.result[1] = {b.result[0].first + 1, 2}, ksl::energy_batch(m, b, 2); });
  std::vector<double> by_v(nv * nv), by_a(nv * nv);
  show("derivatives", nv * nv,
       [&](std::size_t k) {
         ksl::inverse_dynamics_derivatives(m, d, &q[k * nq], &v[k * nv], &a[k * nv], one.data(), by_v.data(), by_a.data());
       },
       [&] {
         b.result[1] = b.result[2] = {};
         ksl::inverse_dynamics_derivatives_batch(m, b, 2);
       });
  std::fprintf(stderr, "%s\n", ksl::instruction_set());
}
"""


def run(*command: object) -> subprocess.CompletedProcess[str]:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.long
@pytest.mark.skipif(platform.machine() == "aarch64", reason="every other test runs on Arm here")
def test_arm_gives_the_same_bits(tmp_path):
    """Optimised, so that a compiler that fuses multiplications and additions is seen."""
    for tool, package in (("aarch64-linux-gnu-g++", "g++-aarch64-linux-gnu"), ("qemu-aarch64", "qemu-user")):
        assert shutil.which(tool), f"{tool} is not there; on Debian and Ubuntu: apt install {package}"
    (tmp_path / "program.cpp").write_text(PROGRAM)

    def compiled(source: str) -> Path:
        out = tmp_path / (source.replace("/", "_") + ".o")
        run("aarch64-linux-gnu-g++", "-O3", *FLAGS, *SOURCES[source], "-c", ROOT / "src" / source, "-o", out)
        return out

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        objects = list(pool.map(compiled, SOURCES))
    # the reader of robot files is left out: pugixml is not there for that processor
    run(
        "aarch64-linux-gnu-g++",
        *FLAGS,
        tmp_path / "program.cpp",
        *objects,
        "-static",
        "-pthread",
        "-Wl,--unresolved-symbols=ignore-all",
        "-o",
        tmp_path / "arm",
    )
    arm = run("qemu-aarch64", tmp_path / "arm")

    library = os.environ.get("KSL_LIBRARY")
    assert library, "KSL_LIBRARY names the library that make test builds"
    run("g++", *FLAGS, tmp_path / "program.cpp", Path(library).parent / "libksl.a", "-lpugixml", "-pthread", "-o", tmp_path / "here")
    here = run(tmp_path / "here")
    assert arm.stderr.strip() == "neon" and here.stderr.strip() != "neon"
    assert "differs" not in arm.stdout and "nan" not in arm.stdout and len(arm.stdout.splitlines()) == 9 * (17 + 17 + 2 * 17 * 17 + 64 + 2)
    assert arm.stdout == here.stdout
