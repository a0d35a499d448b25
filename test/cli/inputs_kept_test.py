"""No command replaces or removes a file that it reads, or files of others that have names of results."""

import json
import shutil
from pathlib import Path

import pytest
from ksl_command import run_ksl

URDF = """<robot name="arm"><link name="wall"/><link name="rod"><inertial><origin xyz="0.3 0 0"/><mass value="2"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="pin" type="revolute"><parent link="wall"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="3" effort="18" velocity="4"/></joint></robot>"""
MOTION = "time,pin\n" + "".join(f"{k / 10},{k / 100}\n" for k in range(9))
EXTERNAL = "time,rod.fz\n" + "".join(f"{k / 10},1\n" for k in range(9))


def run(*arguments, folder):
    return run_ksl(*arguments, cwd=folder)


@pytest.fixture
def work(tmp_path):
    (tmp_path / "robot.urdf").write_text(URDF)
    (tmp_path / "m.csv").write_text(MOTION)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {str(f.relative_to(folder)): f.read_bytes() for f in sorted(folder.rglob("*")) if f.is_file()}


def refused(folder: Path, *arguments) -> str:
    """What a command says that is refused, which must change nothing."""
    before = contents(folder)
    p = run(*arguments, folder=folder)
    assert p.returncode == 2 and contents(folder) == before, p.stdout + p.stderr
    assert p.stderr.startswith("ksl: ") and "fault in KSL" not in p.stderr
    return p.stderr


@pytest.mark.parametrize("force", [[], ["--force"]], ids=["", "force"])
@pytest.mark.parametrize("name", ["wrenches.csv", "summary.csv", "report.json"])
def test_loads_keeps_its_inputs(work, name, force):
    (work / name).write_text(EXTERNAL)
    assert "this run reads it" in refused(work, "loads", "robot.urdf", "m.csv", "--external", name, "-o", ".", *force)
    (work / name).write_text(MOTION)
    assert "this run reads it" in refused(work, "loads", "robot.urdf", name, "-o", work, *force)


def test_loads_keeps_an_input_behind_a_link(work):
    (work / "o").mkdir()
    shutil.copy(work / "m.csv", work / "o/wrenches.csv")
    (work / "moved.csv").symlink_to("o/wrenches.csv")
    assert "this run reads it" in refused(work, "loads", "robot.urdf", "moved.csv", "-o", "o", "--force")


@pytest.mark.parametrize("name", ["report.pdf", "report.html", "wrenches.csv", "summary.csv", "wrenches.parquet"])
def test_files_of_others_are_kept(work, name):
    (work / name).write_text("the thesis")
    said = refused(work, "loads", "robot.urdf", "m.csv", "-o", ".")
    assert name in said and "--force" in said
    assert "--force" in refused(work, "hold", "robot.urdf", "-o", ".")
    assert run("loads", "robot.urdf", "m.csv", "-o", ".", "--force", folder=work).returncode == 0
    assert b"the thesis" not in contents(work).values()


def test_earlier_results_are_replaced_without_force(work):
    for options in (["--csv", "--json"], []):
        assert run("loads", "robot.urdf", "m.csv", "-o", "o", *options, folder=work).returncode == 0
    assert not (work / "o/wrenches.csv").exists()
    (work / "o/wrenches.parquet").unlink()  # summary.csv still says whose results these are
    assert run("loads", "robot.urdf", "m.csv", "-o", "o", folder=work).returncode == 0


def test_size_keeps_its_components_and_files_of_others(work):
    assert run("loads", "robot.urdf", "m.csv", "-o", "o", folder=work).returncode == 0
    (work / "sizing.json").write_text('[[component]]\njoint = "pin"\nkind = "limits"\ntorque = 10\n')
    assert "this run reads it" in refused(work, "size", "o", "sizing.json", "-o", ".", "--force")
    (work / "sizing.json").write_text('{"robot": "arm"}')
    assert "--force" in refused(work, "size", "o", "-o", ".")
    (work / "o/peaks.csv").write_text("somebody's")
    assert "holds peaks.csv" in refused(work, "size", "o", "-o", "o")
    for _ in range(2):
        assert run("size", "o", "-o", "o/sizes", folder=work).returncode == 0


def test_view_and_motion_keep_their_inputs(work):
    assert "this run reads it" in refused(work, "view", "robot.urdf", "--export", "robot.urdf")
    assert "this run reads it" in refused(work, "view", "robot.urdf", "m.csv", "--export", "m.csv")
    (work / "w.csv").write_text("pin\n0\n1\n")
    assert "this run reads it" in refused(work, "motion", "robot.urdf", "--kind", "minjerk", "--waypoints", "w.csv", "-o", "w.csv")


SWEEP = """[sweep]
sampling = "latin hypercube"
cases = 4
[base]
motion = "m.csv"
[[vary]]
kind = "payload"
link = "rod"
from = 1
to = 2
"""


def test_sweep_keeps_files_of_others(work):
    (work / "s.toml").write_text(SWEEP)
    for name, text in (("sweep.json", json.dumps({"mine": 1})), ("worst.csv", "mine")):
        (work / name).write_text(text)
        assert "move it away" in refused(work, "sweep", "robot.urdf", "s.toml", "-o", ".")
        (work / name).unlink()
    assert run("sweep", "robot.urdf", "s.toml", "-o", "o", folder=work).returncode == 0
    (work / "o/cases/notes.txt").write_text("mine")
    (work / "s.toml").write_text(SWEEP.replace("cases = 4", "cases = 5"))
    assert run("sweep", "robot.urdf", "s.toml", "-o", "o", "--force", folder=work).returncode == 0
    assert (work / "o/cases/notes.txt").read_text() == "mine"
