"""`ksl.frequencies`, `ksl modes` and `ksl loads --deflection`: poses, motions, grids, files, and what is said of bad input."""

import csv

import numpy as np
import pytest

import ksl
from ksl.small_motions.deflections import Deflections
from ksl_command import run_ksl
from linkages import FOURBAR

ARM = """<robot name="arm"><link name="wall"/>
<link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="4"/><inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="wall"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="90" velocity="9"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="90" velocity="9"/></joint></robot>"""
STIFF = "shoulder = 9000\n[elbow]\nmotion = 4000.0\naxial = 1e7\nradial = 3e7\ntilting = 0\n"
GIVEN = {"shoulder": 9000, "elbow": {"motion": 4000.0, "axial": 1e7, "radial": 3e7, "tilting": 0}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    at = tmp_path_factory.mktemp("modes")
    (at / "arm.urdf").write_text(ARM)
    (at / "fourbar.urdf").write_text(FOURBAR)
    (at / "s.toml").write_text(STIFF)
    (at / "drives.toml").write_text("shoulder = 9000\nelbow = 4000\n")
    (at / "pins.toml").write_text("A = 900\n")
    rows = [f"{k / 50:.4f},{0.3 * np.sin(k / 8):.6f},{1.2 + 0.9 * np.cos(k / 9):.6f}\n" for k in range(40)]
    (at / "m.csv").write_text("time,shoulder,elbow\n" + "".join(rows))
    return at


def test_a_pose_a_motion_and_a_grid_are_the_modes_of_their_poses(folder):
    m = ksl.load(folder / "arm.urdf")
    one = ksl.frequencies(m, pose={"elbow": 0.7}, stiffness=folder / "s.toml", count=4)
    np.testing.assert_array_equal(one.frequencies[0], m.modes([0, 0.7], stiffness=GIVEN).frequencies[:4])
    motion = ksl.read_motion(m, folder / "m.csv")
    along = ksl.frequencies(m, folder / "m.csv", stiffness=GIVEN, samples=9)
    assert len(along.q) == 9 and along.time[0] == motion.time[0] and along.time[-1] == motion.time[-1]
    firsts = [m.modes(q, stiffness=GIVEN).frequencies[0] for q in along.q]
    assert along.lowest == int(np.argmin(firsts)) and along.frequencies[along.lowest, 0] == min(firsts) == along.modes.frequencies[0]
    np.testing.assert_array_equal(ksl.frequencies(m, pose=along.q[3], stiffness=GIVEN, count=1).frequencies, [[firsts[3]]])
    grid = ksl.frequencies(m, pose=[0.1, 0], grid={"elbow": [0.0, 1.0], "shoulder": [0.2, 0.4, 0.6]}, stiffness=GIVEN)
    assert grid.q.tolist() == [[s, e] for e in (0.0, 1.0) for s in (0.2, 0.4, 0.6)]


def test_a_spring_whose_ends_meet_pulls_back_every_way():
    """√(k/m)/2π, along a slide across which it has no length.  The slide's own spring is left out, as physics are."""
    b = ksl.Builder("slide").add_link("ground").add_link("mass", 2.0, (0, 0, 0), np.eye(3))
    b.add_joint("x", "prismatic", "ground", "mass", axis=(1, 0, 0), spring_stiffness=30.0)
    m = b.add_force_element("spring", "ground", (0.1, 0, 0), "mass", (0, 0, 0), 50.0).build(physics="force elements")
    for x in (0.1, 0.3):
        assert ksl.frequencies(m, pose=[x], stiffness={"x": 0.0}).frequencies[0] == pytest.approx(5 / (2 * np.pi))


def test_closed_mechanisms_follow_their_drives(folder):
    m = ksl.load(folder / "fourbar.urdf", drives=["A"])
    found = ksl.frequencies(m, grid={"A": [0.1, 0.3]}, stiffness={"A": 900.0})
    assert np.abs(m.loop_error(found.q)).max() < 1e-9 and found.q[:, 0] == pytest.approx([0.1, 0.3])
    assert (found.frequencies > 1).all() and found.frequencies[0] != found.frequencies[1]


def test_the_command_prints_and_writes_them(folder):
    done = run_ksl("modes", "arm.urdf", "--stiffness", "s.toml", "--motion", "m.csv", "--count", "3", "-o", "f.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    found = ksl.frequencies(folder / "arm.urdf", folder / "m.csv", stiffness=GIVEN, count=3)
    with open(folder / "f.csv", newline="") as file:
        head, *rows = csv.reader(file)
    assert head == ["time", "shoulder", "elbow", "f1", "f2", "f3"]
    np.testing.assert_array_equal(np.array(rows, float), np.column_stack([found.time, found.q, found.frequencies]))
    assert f"40 poses; the lowest is {found.frequencies[found.lowest, 0]:.4g}" in done.stdout and "what gives way" in done.stdout
    free = run_ksl("modes", "arm.urdf", "--stiffness", "s.toml", "--pose", "elbow=90deg", "--gravity", "0,0,0", cwd=folder)
    assert "nothing resists: elbow" in free.stdout, "its bearing tilts freely"
    held = run_ksl("modes", "fourbar.urdf", "--drives", "A", "--stiffness", "pins.toml", "--grid", "A=0:0.5:3", cwd=folder)
    assert held.returncode == 0 and "3 poses; the lowest is" in held.stdout


def test_deflections_along_a_motion(folder):
    done = run_ksl("loads", "arm.urdf", "m.csv", "--stiffness", "drives.toml", "--deflection", "fore", "-o", "out", cwd=folder)
    assert done.returncode == 0 and "fore is off by up to" in done.stdout, done.stderr
    m, table = ksl.load(folder / "arm.urdf"), np.genfromtxt(folder / "out" / "deflection.csv", delimiter=",", names=True, deletechars="")
    motion = ksl.read_motion(m, folder / "m.csv")
    tau = m.inverse_dynamics(motion.q, motion.v, motion.a)
    turn = -tau / [9000, 4000]  # what a planar arm turns by, and its elbow moves by
    np.testing.assert_allclose(table["ry"], turn.sum(axis=1), rtol=1e-9)
    np.testing.assert_allclose(table["shoulder.motion.ry"], turn[:, 0], rtol=1e-9)
    off = np.hypot(table["x"], table["z"])
    np.testing.assert_allclose(off, 0.4 * np.abs(turn[:, 0]), rtol=1e-9)
    assert f"{1000 * off.max():.4g} mm" in done.stdout and "shoulder motion 100 %" in done.stdout
    assert run_ksl("loads", "arm.urdf", "m.csv", "-o", "out", cwd=folder).returncode == 0 and not (folder / "out" / "deflection.csv").exists()


def test_deflections_are_said_with_their_shares():
    """A frame that is off by (3, 4, 0) mm, of which a joint's motion has (3, 0, 0), 9/25 of it in the direction of the whole."""
    shares = np.array([[[[3e-3, 0, 0, 0.1, 0, 0], [0, 4e-3, 0, 0.2, 0, 0]]]])
    one = Deflections("tool", ("hip",), ("walk",), (np.array([0.5]),), (shares,))
    assert str(one) == "tool is off by up to 5 mm, at 0.5 s: hip bearing 64 %, hip motion 36 %"
    two = Deflections("tool", ("hip",), ("walk", "run"), (np.array([0.5]), np.array([0.7])), (shares, shares / 2))
    assert str(two) == "tool is off by up to 5 mm, at 0.5 s of walk: hip bearing 64 %, hip motion 36 %"
    many = Deflections("tool", tuple("abcde"), ("walk",), (np.zeros(1),), (np.repeat(shares, 5, axis=1) * np.arange(1, 6)[:, None, None],))
    assert str(many).endswith(": e bearing 21 %, d bearing 17 %, c bearing 13 %, e motion 12 %"), "the four largest"


BAD = {
    "modes needs stiffnesses: --stiffness FILE.toml": ["modes", "arm.urdf"],
    "bad.toml: stiffness of joint elbow has key='torsion'; did you mean 'torsional'? expected one of": ["modes", "arm.urdf", "--stiffness", "bad.toml"],
    "none.toml: arm: no joint named 'elbw'; did you mean": ["modes", "arm.urdf", "--stiffness", "none.toml"],
    "--grid elbow=0:1: expected JOINT=FROM:TO:N": ["modes", "arm.urdf", "--stiffness", "s.toml", "--grid", "elbow=0:1"],
    "--grid elbow=…: is given twice": ["modes", "arm.urdf", "--stiffness", "s.toml", "--grid", "elbow=0:1:2", "--grid", "elbow=0:1:2"],
    "motion with pose or grid: the motion says where all joints are": ["modes", "arm.urdf", "--stiffness", "s.toml", "--motion", "m.csv", "--pose", "elbow=1"],
    "count=0; expected a number, 1 or more": ["modes", "arm.urdf", "--stiffness", "s.toml", "--count", "0"],
    "grid: 1000000 poses; expected between 1 and 100000": [
        "modes",
        "arm.urdf",
        "--stiffness",
        "s.toml",
        "--grid",
        "elbow=0:1:1000",
        "--grid",
        "shoulder=0:1:1000",
    ],
    "--deflection fore: needs the stiffnesses of joints": ["loads", "arm.urdf", "m.csv", "--deflection", "fore", "-o", "x"],
    "no link or joint named 'hand'": ["loads", "arm.urdf", "m.csv", "--deflection", "hand", "--stiffness", "drives.toml", "-o", "x"],
    "bad.toml: stiffness of joint elbow has key='torsion'": ["loads", "arm.urdf", "m.csv", "--deflection", "fore", "--stiffness", "bad.toml", "-o", "x"],
    "--stiffness s.toml: arm has no loops": ["loads", "arm.urdf", "m.csv", "--stiffness", "s.toml", "-o", "x"],
    "m.csv": ["modes", "arm.urdf", "--stiffness", "drives.toml", "--motion", "m.csv", "-o", "m.csv"],
}


@pytest.mark.parametrize("said", BAD)
def test_bad_input(folder, said):
    (folder / "bad.toml").write_text("[elbow]\ntorsion = 4\n")
    (folder / "none.toml").write_text("elbw = 4\n")
    done = run_ksl(*BAD[said], cwd=folder)
    assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1, done.stderr
