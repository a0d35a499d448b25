"""The viewer draws the wrenches that results hold, whatever they were made with, and says or refuses what differs."""

import numpy as np
import pytest
from ksl_command import run_ksl
from linkages import FOURBAR

import ksl
from ksl.base.errors import MotionError
from ksl.mechanism.stiffness import compliances_of, rigid_beside
from ksl.model.surgery import with_compliances
from ksl.viewer.readout import Choice, wrench_at
from ksl.load_cases.results_table import read_results
from ksl.viewer.results_scene import scene_of_results
from ksl.viewer.scene import make_scene

TIME = np.linspace(0, 2, 81)
TURN = 2 * np.pi * (TIME / 2 - np.sin(np.pi * TIME) / (2 * np.pi))
BEARING = {"axial": 2e7, "radial": 1e8, "tilting": 1e5}


@pytest.fixture(scope="module")
def fourbar():
    return ksl.load_string(FOURBAR, drives=["A"])


@pytest.fixture(scope="module")
def stiff(fourbar):
    return fourbar.with_stiffness(dict.fromkeys("ABCD", BEARING))


@pytest.fixture(scope="module")
def motion(fourbar):
    q = np.full((len(TIME), fourbar.nq), np.nan)
    q[:, fourbar.joint("A").q_index] = TURN
    return ksl.compute_loads(fourbar, (TIME, q)).cases[0].motion


def total(scene):
    return scene.constraint + scene.actuation


@pytest.mark.parametrize(
    "placement",
    [{}, {"on": "parent", "at": "world", "axes": "world"}, {"at": "rocker", "axes": "coupler"}, {"at": {"C": (0.1, 0.2, -0.1)}}, {"at": (0.1, 0, 0)}],
)
def test_wrenches_are_those_of_the_results(fourbar, stiff, motion, tmp_path, placement):
    """Stiffnesses change the wrenches; a robot without them is told to differ, and with those that the results name it doesn't."""
    ksl.compute_loads(stiff, motion, **placement).write(tmp_path)
    results = read_results(tmp_path)
    expected = make_scene(stiff, motion.q, motion.v, motion.a, motion.time)
    plain = make_scene(fourbar, motion.q, motion.v, motion.a, motion.time)
    scale = abs(total(expected)).max()
    assert abs(total(plain) - total(expected)).max() > 1e-3 * scale
    scene, notes = scene_of_results(fourbar, results)
    assert total(scene) == pytest.approx(total(expected), abs=1e-8 * scale) and scene.constraint == pytest.approx(expected.constraint, abs=1e-8 * scale)
    assert "stiffnesses or external wrenches have changed since" in notes[0]
    assert wrench_at(scene, 5, "C", Choice())[3:] == pytest.approx(
        stiff.reactions(motion.q[5], motion.v[5], motion.a[5], joints=["C"])[0, 3:], abs=1e-8 * scale
    )
    restored = with_compliances(fourbar, results.description["compliance"])
    assert compliances_of(restored) == compliances_of(stiff) and scene_of_results(restored, results)[1] == []


def test_results_of_some_joints_refuse_a_robot_that_differs(fourbar, stiff, motion, tmp_path):
    """Those of others would be computed by it."""
    np.savetxt(tmp_path / "crank.csv", np.column_stack([np.rad2deg(TURN), TIME]), delimiter=",", header="A,time", comments="", fmt="%.17g")
    ksl.compute_loads(stiff, tmp_path / "crank.csv", joints=["A", "C"], reading={"degrees": True}).write(tmp_path / "out")
    results = read_results(tmp_path / "out")
    scene, notes = scene_of_results(stiff, results)
    assert notes == [] and scene.q[:, 0] == pytest.approx(TURN), "read in degrees, as the run did"
    with pytest.raises(MotionError, match=r"hold no wrenches of B, and those of others differ .*; run `ksl loads` again, with all joints"):
        scene_of_results(fourbar, results)


def test_stiffnesses_that_are_none(fourbar):
    for wrong in ({"Z": [0.0] * 36}, {"A": [0.0] * 6}, {"A": [np.nan] * 36}):
        with pytest.raises(ValueError, match="expected 36 finite numbers of a joint of fourbar, or 72"):
            with_compliances(fourbar, wrong)
    assert compliances_of(fourbar) == {} and rigid_beside(fourbar) == [] and compliances_of(fourbar.without_loops()) == {}
    assert sorted(rigid_beside(fourbar.with_stiffness({"A": BEARING, "C": BEARING}))) == ["B", "D"]


CASES = """[cases.plain]
[cases.pushed]
stiffness = { A = { axial = 2e7, radial = 1e8, tilting = 1e5 }, B = [1e7, 1e7, 1e7, 1e5, 1e5, 1e5], C = [1e7, 1e7, 1e7, 1e5, 1e5, 1e5], D = [1e8, 1e7, 1e7, 1e5, 1e5, 1e5] }
physics = ["damping"]
payloads = [{ link = "coupler", mass = 2.0, center = [0.1, 0, 0], inertia = [0.1, 0.1, 0.1, 0, 0, 0] }, { link = "coupler", mass = 1.0 }]
external = [{ link = "rocker", wrench = [0, 30, 0, 5, 0, 0] }]
[cases.changing]
external = [{ link = "rocker", steps = [[0.0, 0, 30, 0, 5, 0, 0], [1.0, 0, 0, 0, 0, 0, 0]] }]
"""


@pytest.mark.parametrize(
    ("case", "notes"),
    [
        ("plain", ""),
        ("pushed", ""),
        ("changing", ""),
        ("changing", "external wrenches of the load case are not shown, since results don't hold those that load cases or programs give as they change"),
    ],
)
def test_the_command_uses_what_the_results_were_made_with(tmp_path, case, notes):
    """Loops, stiffnesses, payloads with inertia, physics and wrenches of the file of cases: nothing is told to differ, but for wrenches that change where that file is gone."""
    pytest.importorskip("viser")
    (tmp_path / "fourbar.urdf").write_text(
        FOURBAR.replace('<limit effort="5" velocity="10"/>', '<limit effort="5" velocity="10"/><dynamics damping="0.5"/>', 1)
    )
    (tmp_path / "cases.toml").write_text(CASES)
    np.savetxt(tmp_path / "crank.csv", np.column_stack([TIME, TURN]), delimiter=",", header="time,A", comments="")
    done = run_ksl("loads", "fourbar.urdf", "crank.csv", "--drives", "A", "--cases", "cases.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    if notes:
        (tmp_path / "cases.toml").unlink()
    shown = run_ksl("view", "fourbar.urdf", "out", "--case", case, "--export", "x.html", cwd=tmp_path)
    said = [line.removeprefix("ksl: note: ") for line in shown.stderr.splitlines() if "differ" in line or "external" in line]
    assert shown.returncode == 0 and said == ([notes] if notes else []), shown.stderr
