"""CONTRIBUTING.md and ARCHITECTURE.md name files that exist, and the steps of the first lead to what they promise."""

import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")

FALL = r"""
// A mass on an XY table that stands upright falls, and needs its weight to be held.
#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"
#include <cmath>
#include <cstdio>

int main() {
  using namespace ksl;
  static_assert(row_of(joint_kind::xy_table).nv == 2);
  SE3<double> turned = {{0, 1, 0, -1, 0, 0, 0, 0, 1}, {1, 2, 3}};
  body<double> bodies[2] = {};
  for (body<double> &b : bodies) {
    b.placement = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    b.offset = b.alpha = b.theta0 = no_rotation;
    b.angle_index = -1, b.no_offset = true;
  }
  bodies[0].kind = joint_kind::fixed, bodies[0].parent = -1, bodies[0].is_base = bodies[0].has_children = true;
  bodies[0].v_end = 2;
  bodies[1].kind = joint_kind::xy_table, bodies[1].placement = turned;
  bodies[1].nv = bodies[1].v_end = 2, bodies[1].chain_start = bodies[1].line_start = 1;
  double inertia[16 * 10] = {};
  const spatial_inertia<double> augmented[2] = {{}, {2, {0, 0, 0}, 1, 1, 1, 0, 0, 0}};
  body_at<double>(1).put<spatial_inertia>(augmented[1], inertia);
  const double none[32] = {};
  const model_view<double> model = {.bodies = 2, .nq = 2, .nv = 2, .pose_numbers = 3, .longest_path = 2, .tree_elements = 3,
                                    .gravity = {0, -9.81, 0}, .body = bodies, .inertia = inertia, .augmented = augmented,
                                    .theta0_sine = none, .theta0_cosine = none, .first_angle = 2, .angles_end = 0};
  const double q[2] = {4, 5}, v[2] = {1, 2}, rest[2] = {0, 0};
  double tau[2], a[2], M[4];
  inverse_dynamics<double>(model, *owned_workspace<inverse_dynamics_workspace<double>>(model), q, v, rest, {}, tau);
  forward_dynamics<double>(model, *owned_workspace<forward_dynamics_workspace<double>>(model), q, v, rest, {}, a);
  mass_matrix<double>(model, *owned_workspace<mass_matrix_workspace<double>>(model), q, M);
  // the joint's x lies along the world's y
  const double expected_tau[2] = {2 * 9.81, 0}, expected_a[2] = {-9.81, 0}, expected_M[4] = {2, 0, 0, 2};
  bool well = true;
  for (int i = 0; i < 4; ++i)
    well = well && std::fabs(M[i] - expected_M[i]) < 1e-14;
  for (int i = 0; i < 2; ++i)
    well = well && std::fabs(tau[i] - expected_tau[i]) < 1e-14 && std::fabs(a[i] - expected_a[i]) < 1e-14;
  std::puts(well ? "as expected" : "wrong");
  return !well;
}
"""

CLOSES = r"""
// An XY table that closes a loop: what is left of a displacement is that across the table, and every turn.
#include "engine/loops/joint_position.hpp"
#include <cstdio>

int main() {
  using namespace ksl;
  loops::loop l{};
  l.kind = joint_kind::xy_table, l.canonical = {1, 0, 0, 0, 1, 0, 0, 0, 1}, l.axis = {0, 0, 1};
  for (const screw<double> &twist : loops::unit_twists(l.kind, l.axis, 0)) {
    l.turns += twist.ang.x != 0 || twist.ang.y != 0 || twist.ang.z != 0;
    l.slides[0] |= twist.lin.x != 0, l.slides[1] |= twist.lin.y != 0, l.slides[2] |= twist.lin.z != 0;
  }
  const screw<double> left = loops::displacement_left(l, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.3, 0.4, 0.5}});
  const bool well = l.turns == 0 && l.slides[0] && l.slides[1] && !l.slides[2] && left.lin.x == 0 && left.lin.y == 0 && left.lin.z == 0.5;
  std::puts(well ? "as expected" : "wrong");
  return !well;
}
"""


SWING = r"""
// A point mass of 2 kg on a massless arm of 0.5 m.
#include "ksl/engine/algorithms/energy/momentum.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"
#include <cmath>
#include <cstdio>

int main() {
  using namespace ksl;
  body<double> bodies[2] = {};
  for (body<double> &b : bodies) {
    b.placement = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    b.offset = b.alpha = b.theta0 = no_rotation;
    b.no_offset = true;
  }
  bodies[0].kind = joint_kind::fixed, bodies[0].parent = -1, bodies[0].angle_index = -1;
  bodies[1].kind = joint_kind::revolute, bodies[1].nv = 1, bodies[1].chain_start = bodies[1].line_start = 1;
  double inertia[16 * 10] = {};
  body_at<double>(1).put<spatial_inertia>({2, {1, 0, 0}, 0, 0.5, 0.5, 0, 0, 0}, inertia); // m, m c, m (c·c 1 − c cᵀ)
  double sine[32] = {}, cosine[32];
  for (double &c : cosine)
    c = 1;
  const model_view<double> view = {.bodies = 2, .nq = 1, .nv = 1, .longest_path = 1, .tree_elements = 1, .body = bodies,
                                   .inertia = inertia, .theta0_sine = sine, .theta0_cosine = cosine, .first_angle = 0, .angles_end = 1};
  const double q = 0.3, v = 4;
  double p[6];
  momentum<double>(view, *owned_workspace<momentum_workspace<double>>(view), &q, &v, p);
  const double expected[6] = {-4 * std::sin(q), 4 * std::cos(q), 0, 0, 0, 2}; // m v r across the arm, m v r² about z
  bool well = true;
  for (int i = 0; i < 6; ++i)
    well = well && std::fabs(p[i] - expected[i]) < 1e-14;
  std::puts(well ? "as expected" : "wrong");
  return !well;
}
"""


def blocks(heading: str) -> list[str]:
    """The code blocks of a section, in its order."""
    section = TEXT.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return [textwrap.dedent(code) for code in re.findall(r"^ *```\w+\n(.*?)^ *```$", section, re.MULTILINE | re.DOTALL)]


def insert_before(path: Path, like: str, line: str) -> None:
    """Adds a line before the first one that contains `like`."""
    text = path.read_text(encoding="utf-8")
    assert like in text, f"{path.name} has no {like!r}"
    start = text.rfind("\n", 0, text.index(like)) + 1
    path.write_text(text[:start] + line + "\n" + text[start:])


def compiles(folder: Path, compiler: str, *options: str) -> subprocess.CompletedProcess:
    (folder / "fall.cpp").write_text(FALL)
    return subprocess.run([compiler, "-std=c++20", "-I", folder / "include", "fall.cpp", *options], cwd=folder, capture_output=True, text=True)


def named_files(text: str) -> set[str]:
    return set(re.findall(r"`((?:include|src|test|api|docs|scripts|python)/[\w./]*)`", text))


def test_the_files_of_the_architecture_exist():
    named = named_files((ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8"))
    assert len(named) > 20
    assert not [name for name in sorted(named) if not (ROOT / name).exists()], "ARCHITECTURE.md names files that don't exist"


def test_the_files_it_names_exist():
    named = named_files(TEXT)
    missing = sorted(name for name in named if not (ROOT / name).exists())
    assert len(named) > 8
    examples = ["include/ksl/engine/algorithms/energy/momentum.hpp", "include/ksl/engine/model/joints/xy_table.hpp"]
    assert missing == examples, "CONTRIBUTING.md names files that don't exist"


def test_the_files_that_comments_name_exist():
    """Of comments, docstrings and includes: from the root, from where includes begin, or from the file's own folder."""
    named = re.compile(r"(?<![\w./{<\"'-])((?:[a-z_0-9]+/)+\w+\.(?:hpp|cpp|h|inc|py|md|mk))(?![\w(])")
    of_others = {"platformio/package/manifest/schema.py"}
    roots = [ROOT / folder for folder in ("", "src", "include", "include/ksl", "python", "python/ksl", "test", "scripts")]
    files = [
        path
        for folder in ("api", "include", "python", "src")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".hpp", ".cpp", ".h", ".inc", ".md")
    ]
    found = [(path, name) for path in files for name in named.findall(path.read_text(encoding="utf-8")) if name not in of_others]
    assert len(found) > 100
    missing = [f"{path.relative_to(ROOT)}: {name}" for path, name in found if not any((at / name).exists() for at in (*roots, path.parent, path.parent.parent))]
    assert not missing, f"files that don't exist: {missing}"


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_a_new_kind_of_joint(tmp_path, compiler):
    shutil.copytree(ROOT / "include", tmp_path / "include")
    model = tmp_path / "include/ksl/engine/model"
    struct, value, lines = blocks("A new kind of joint")
    include, general, with_joint, listed = lines.splitlines()
    (model / "joints" / "xy_table.hpp").write_text(struct)
    insert_before(model / "joint.hpp", "continuous = ", value.rstrip())
    joints = model / "joints.hpp"
    insert_before(joints, "<concepts>", include)

    forgotten = compiles(tmp_path, compiler, "-fsyntax-only")
    assert forgotten.returncode != 0 and "xy_table" in forgotten.stderr, "the compiler doesn't name the switch that lacks the kind"

    insert_before(joints, "    joint_kind::helical,\n", general)
    insert_before(joints, "case joint_kind::floating: return step(", with_joint)
    insert_before(joints, "    joint_kind::floating};", listed)
    done = compiles(tmp_path, compiler, "-o", "fall")
    assert done.returncode == 0, done.stderr
    assert subprocess.run([tmp_path / "fall"], capture_output=True, text=True).stdout == "as expected\n"

    if compiler == "clang++":  # no list of kinds outside their structs is to be found in the solver of loops
        shutil.copytree(ROOT / "src", tmp_path / "src")
        (tmp_path / "closes.cpp").write_text(CLOSES)
        sources = ["src/engine/loops/joint_position.cpp", "src/engine/loops/tables.cpp", "src/engine/model/canonical_axes.cpp", "closes.cpp"]
        flags = ["-std=c++20", "-O0", "-Wall", "-Werror", "-Wno-unused-function", "-ffunction-sections", "-Wl,--gc-sections", "-I", "include", "-I", "src"]
        closes = subprocess.run([compiler, *flags, *sources, "-o", "closes"], cwd=tmp_path, capture_output=True, text=True)
        assert closes.returncode == 0, closes.stderr
        assert subprocess.run([tmp_path / "closes"], capture_output=True, text=True).stdout == "as expected\n"

    # a kind that lacks something is named, and what it lacks
    path = model / "joints" / "xy_table.hpp"
    path.write_text(path.read_text().replace("integrate(", "integrated("))
    lacking = compiles(tmp_path, compiler, "-fsyntax-only")
    assert lacking.returncode != 0 and "described_joint" in lacking.stderr and "integrate" in lacking.stderr


def test_a_new_algorithm(tmp_path):
    for folder in ("api", "include", "src", "scripts", "python", "test/engine", "test/model"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    header, row = blocks("A new algorithm")
    (tmp_path / "include/ksl/engine/algorithms/energy/momentum.hpp").write_text(header)
    table = tmp_path / "api/algorithms/energy.py"
    text = table.read_text(encoding="utf-8")
    end = text.rindex("\n]") if "\n]" in text else text.rindex("\n)")
    table.write_text(text[: end + 1] + textwrap.indent(row, "    ", lambda line: not line.startswith(("q (", '"""'))) + text[end + 1 :], encoding="utf-8")
    written = subprocess.run([sys.executable, "scripts/generate.py"], cwd=tmp_path, capture_output=True, text=True)
    assert written.returncode == 0, written.stderr
    assert {"src/engine/kernels/algorithms/energy_1.cpp", "include/ksl/engine_calls.h", "python/ksl/mechanism/calls.py"} <= set(written.stdout.split())

    flags = ["g++", "-std=c++20", "-Wall", "-Wextra", "-Werror", "-I", "include", "-I", "src"]
    for source in ("src/engine/kernels/algorithms/energy_1.cpp", "src/engine/run/dynamics_calls.cpp", "src/c_api/engine_calls.cpp"):
        compiled = subprocess.run([*flags, "-DKSL_ISA=x86_64_v2", "-fsyntax-only", source], cwd=tmp_path, capture_output=True, text=True)
        assert compiled.returncode == 0, compiled.stderr
    (tmp_path / "swing.cpp").write_text(SWING)
    linked = subprocess.run(["g++", "-std=c++20", "-I", "include", "swing.cpp", "-o", "swing"], cwd=tmp_path, capture_output=True, text=True)
    assert linked.returncode == 0, linked.stderr
    assert subprocess.run([tmp_path / "swing"], capture_output=True, text=True).stdout == "as expected\n"
