"""A kind of joint that is added by the steps of CONTRIBUTING.md is known to all of Python: columns, tables, checks, sizing, report.

Python keeps no list of kinds; it takes the rows of the compiled module.  The short test compiles these rows alone and puts them in the
place of the module's.  The long one builds the module with the kind, and runs the commands with it."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from contributing_test import ROOT, TEXT, blocks, insert_before

ROWS = r"""
#include "FOLDER/description.hpp"
#include "FOLDER/joints.hpp"
#include <cstdio>

static void words(const char *name, int n, auto of) {
  std::printf(", \"%s\": [", name);
  for (int i = 0; i < n; ++i)
    std::printf("%s\"%s\"", i ? ", " : "", of(i));
  std::printf("]");
}
static void number(const char *name, int x) { x < 0 ? std::printf(", \"%s\": null", name) : std::printf(", \"%s\": %d", name, x); }
static void truth(const char *name, bool x) { std::printf(", \"%s\": %s", name, x ? "true" : "false"); }

int main() {
  const char *before = "[";
  for (const ksl::joint_kind each : ksl::joint_kinds) {
    const ksl::joint_kind_row k = ksl::row_of(each);
    std::printf("%s{\"name\": \"%s\", \"nq\": %d, \"nv\": %d", before, k.name, k.nq, k.nv);
    std::printf(k.other_name ? ", \"other_name\": \"%s\"" : ", \"other_name\": null", k.other_name);
    number("angle", k.angle), number("quaternion", k.quaternion), number("numbers_with_limits", ksl::numbers_with_limits(k));
    truth("has_axis", k.has_axis), truth("has_axis2", k.has_axis2), truth("has_pitch", k.has_pitch), truth("has_limits", k.has_limits);
    truth("is_free", k.is_free), truth("in_urdf", k.in_urdf), truth("velocity_is_rate", k.velocity_is_rate);
    words("position", k.nq, [&](int i) { return k.positions[i].name; }), words("position_unit", k.nq, [&](int i) { return k.positions[i].unit; });
    words("velocity", k.nv, [&](int i) { return k.velocities[i].velocity; }), words("velocity_unit", k.nv, [&](int i) { return k.velocities[i].unit; });
    words("acceleration", k.nv, [&](int i) { return k.velocities[i].acceleration; });
    words("effort", k.nv, [&](int i) { return k.velocities[i].effort; });
    std::printf("}");
    before = ",\n";
  }
  std::puts("]");
}
"""

WITH_ROWS = """
import json, sys
from types import SimpleNamespace
from ksl import _core

rows = json.load(open(sys.argv[1]))
own = {kind.name: kind for kind in _core.joint_kinds}
for row in rows:  # what the program printed is what the module has, but for the new kind
    for key, value in row.items() if row["name"] in own else ():
        found = getattr(own[row["name"]], key)
        assert (list(found) if isinstance(found, tuple) else found) == value, (row["name"], key, found, value)
_core.joint_kinds = tuple(SimpleNamespace(**{k: tuple(x) if isinstance(x, list) else x for k, x in row.items()}) for row in rows)
"""

USES = """
import numpy as np
from ksl.checks.run import check
from ksl.drivetrain.loop_rows import _rows_of
from ksl.load_cases.quantities import joint_loads, summarise
from ksl.load_cases.verdict import Verdict, uses_of
from ksl.mechanism.joint_columns import by_name, endings_of
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint, Loop
from ksl.mechanism.stiffness import steady_motion
from ksl.mechanism.joint_kinds import columns_of, units_of
from ksl.report.html.input import CaseCurves, ReportInput
from ksl.report.html.page import write_report
from ksl.sizing.samples import ResultJoint

slide = Joint("slide", "xy_table", "floor", "plate", 2, 2, 0, 0, (0, 0, 0), limits=((-1.0, 2.0), (None, None)))
assert columns_of(slide) == (["slide.x", "slide.y"], ["slide.vx", "slide.vy"], ["slide.ax", "slide.ay"])
assert units_of(slide)[0] == ("m", "m")
table = {"slide.y": [3.0, 4.0], "slide.x": [1.0, 2.0]}
assert by_name(table, list(table), "q", [("slide", endings_of(KINDS["xy_table"]))]).tolist() == [[1, 3], [2, 4]]

loop = Loop("closing", "xy_table", "floor", "plate", tuple(np.eye(4).ravel()), tuple(np.eye(4).ravel()), None, None, 0.0, 4)
assert steady_motion(slide).tolist() == np.eye(6)[:, :2].tolist()
assert [(row.what, row.direction.tolist()) for row in _rows_of(loop)] == [("length", [0, 0, 1]), *(("turn", list(e)) for e in np.eye(3))]

found = [(f.rule, f.name) for f in check(sys.argv[2])]
assert ("joint-type-extension", "slide") in found and "joint-type" not in [rule for rule, _ in found], found

result = ResultJoint("slide", "xy_table", (0, 0, 1), False)
assert not result.driven and not result.turns

time, q = np.linspace(0, 1, 5), np.array([[0, 0], [0.5, 1], [1, 2], [1.5, 3], [1.9, 4.0]])
loads = joint_loads(slide, np.ones((5, 6)), None, None)
row = {"case": "motion", **summarise(time, loads)}
uses = uses_of(slide, row, time, q)
assert [(use.column, use.unit) for use in uses] == [("slide.x", "m")], uses
write_report(sys.argv[3], ReportInput("Loads", [], [], [row], [CaseCurves("motion", time, [loads], None)], verdict=Verdict(tuple(uses), ())))
page = open(sys.argv[3], encoding="utf-8").read()
assert "slide.x" in page and "xy_table" in page
print("known everywhere")
"""

ROBOT = """<robot name="table"><link name="floor"/><link name="plate"><inertial><mass value="2"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="xy_table"><parent link="floor"/><child link="plate"/></joint></robot>"""


def follow(tree: Path) -> Path:
    """The first three steps of CONTRIBUTING.md in a copy of the tree.  Returns the list of kinds, joints.hpp."""
    struct, value, lines = blocks("A new kind of joint")
    include, general, with_joint, listed = lines.splitlines()
    header = tree / re.search(r"`(include/[\w/]*/joints/xy_table\.hpp)`", TEXT)[1]
    header.write_text(struct, encoding="utf-8")
    folder = header.parent.parent
    insert_before(folder / "joint.hpp", "continuous = ", value.rstrip())
    joints = folder / "joints.hpp"
    insert_before(joints, "<concepts>", include)
    insert_before(joints, "    joint_kind::helical,\n", general)
    insert_before(joints, "case joint_kind::floating: return step(", with_joint)
    insert_before(joints, "    joint_kind::floating};", listed)
    return joints


def run(*command: object, statuses: tuple[int, ...] = (0,), **options) -> subprocess.CompletedProcess:
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, **options)
    assert done.returncode in statuses, f"{done.stdout}\n{done.stderr}"
    return done


def test_python_knows_a_new_kind_by_its_row(tmp_path):
    shutil.copytree(ROOT / "include", tmp_path / "include")
    joints = follow(tmp_path)
    (tmp_path / "rows.cpp").write_text(ROWS.replace("FOLDER", joints.parent.relative_to(tmp_path / "include").as_posix()))
    run("g++", "-std=c++20", "-I", tmp_path / "include", tmp_path / "rows.cpp", "-o", tmp_path / "rows")
    rows = run(tmp_path / "rows").stdout
    assert [kind["name"] for kind in json.loads(rows)].count("xy_table") == 1
    (tmp_path / "rows.json").write_text(rows)
    (tmp_path / "robot.urdf").write_text(ROBOT)
    done = run(sys.executable, "-c", WITH_ROWS + USES, tmp_path / "rows.json", tmp_path / "robot.urdf", tmp_path / "report.html", cwd=tmp_path)
    assert done.stdout == "known everywhere\n"


@pytest.mark.long
def test_commands_know_a_new_kind(tmp_path):
    """The module built with the kind, without optimisation: `ksl check`, `ksl loads` with its report, and `ksl hold`."""
    for name in ("include", "src", "python", "cmake", "api", "scripts"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__", "_core*"))
    for name in ("CMakeLists.txt", "LICENSE", "README.md"):
        shutil.copy(ROOT / name, tmp_path / name)
    follow(tmp_path)
    nanobind = run(sys.executable, "-c", "import nanobind; print(nanobind.cmake_dir())").stdout.strip()
    sets = ["-DKSL_INSTRUCTION_SETS=x86_64_v2", "-DKSL_PLAIN_SETS=x86_64_v2"]
    run("cmake", "-S", tmp_path, "-B", tmp_path / "build", "-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS_DEBUG=-O0", "-DKSL_PYTHON=ON", "-DKSL_PYTHON_TYPES=OFF",
        f"-Dnanobind_DIR={nanobind}", f"-DPython_EXECUTABLE={sys.executable}", *sets)  # fmt: skip
    run("cmake", "--build", tmp_path / "build", "--target", "_core", "--parallel", os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", "2"))
    for module in (tmp_path / "build/python").glob("_core*.so"):
        shutil.copy(module, tmp_path / "python/ksl")

    robot, motion, out = tmp_path / "robot.urdf", tmp_path / "motion.csv", tmp_path / "out"
    robot.write_text(ROBOT)
    x = [(k / 20, 0.5 * (k / 20) ** 2) for k in range(21)]  # an acceleration of 1 m/s² along x
    motion.write_text("time,slide.x,slide.y\n" + "".join(f"{t},{s},0\n" for t, s in x))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "python"), "COLUMNS": "200"}

    def ksl(*arguments: object, may_find: bool = False) -> str:
        return run(sys.executable, "-m", "ksl", *arguments, statuses=(0, 1) if may_find else (0,), env=environment, cwd=tmp_path).stdout

    rules = {finding["rule"] for finding in json.loads(ksl("check", robot, "--json", may_find=True))["findings"]}
    assert "joint-type-extension" in rules and "joint-type" not in rules
    ksl("loads", robot, motion, "-o", out, "--json")
    assert "xy_table" in (out / "report.html").read_text(encoding="utf-8")
    rows = [row for row in json.loads((out / "report.json").read_text())["summary"] if row["joint"] == "slide"]
    assert rows[0]["kind"] == "xy_table"
    assert rows[0]["force_peak"] == pytest.approx(2 * (9.81**2 + 1) ** 0.5, rel=1e-6)  # the weight, and 2 kg · 1 m/s²
    assert "slide" in ksl("hold", robot)
