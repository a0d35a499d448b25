"""Loops beside a robot file, drives, and what becomes of both in models that are made from models."""

import pickle
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import ksl

LINK = '<link name="{}"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>'
JOINT = '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/><origin xyz="{}"/><axis xyz="0 -1 0"/></joint>'
TREE = (
    '<robot name="fourbar"><link name="world"/>'
    + "".join(map(LINK.format, ("crank", "coupler", "rocker")))
    + JOINT.format("A", "world", "crank", "0 0 0")
    + JOINT.format("B", "crank", "coupler", "0.25 0 0")
    + JOINT.format("D", "world", "rocker", "0.5 0 0")
    + "{}</robot>"
)
CONSTRAINT = (
    '<constraint name="C" type="continuous"><parent link="coupler"/><parent_origin xyz="0.5 0 0"/><parent_axis xyz="0 -1 0"/>'
    '<child link="rocker"/><child_origin xyz="0.25 0 0"/><child_axis xyz="0 -1 0"/></constraint>'
)
MOTOR = '<transmission name="t"><joint name="D"/><actuator name="m"/></transmission>'
BESIDE = """
robot = "fourbar"
drives = ["A"]
[[loop]]
name = "C"
kind = "continuous"
predecessor = "coupler"
successor = "rocker"
predecessor_xyz = [0.5, 0, 0]
successor_xyz = [0.25, 0.0, 0]
axis = [0, -1, 0]
"""
Q = np.array([0.3, -0.2, 0.9])
"""Any position: what is compared needs no closed one."""


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "fourbar.urdf"
    path.write_text(TREE.format(""))
    return path


def written(folder: Path, text: str) -> Path:
    path = folder / "loops.toml"
    path.write_text(text)
    return path


def test_a_file_beside_says_the_same_as_an_element(robot, tmp_path):
    beside = written(tmp_path, BESIDE)
    m, stated = ksl.load(robot, loops=beside), ksl.load_string(TREE.format(CONSTRAINT))
    assert m.loops == stated.loops and m.loop_names == ["C"] and m.drives == ("A",) and stated.drives is None
    assert np.array_equal(m.loop_error(Q), stated.loop_error(Q))
    assert [(x.role, Path(x.file).name) for x in m.inputs] == [("robot", "fourbar.urdf"), ("loops", "loops.toml")]
    turned = BESIDE + "predecessor_rpy = [0.1, 0.2, 0.3]\n"
    R = np.reshape(ksl.load(robot, loops=written(tmp_path, turned)).loops[0].predecessor_pose, (4, 4))
    same = ksl.load_string(TREE.format(CONSTRAINT.replace('xyz="0.5 0 0"', 'xyz="0.5 0 0" rpy="0.1 0.2 0.3"')))
    assert np.abs(R - np.reshape(same.loops[0].predecessor_pose, (4, 4))).max() < 1e-15


def test_drives_are_those_of_the_call_else_of_the_file_beside_else_of_the_robot(robot, tmp_path):
    robot.write_text(TREE.format(MOTOR))
    assert ksl.load(robot, loops=written(tmp_path, BESIDE), drives="B").drives == ("B",)
    assert ksl.load(robot, loops=written(tmp_path, BESIDE)).drives == ("A",)
    assert ksl.load(robot, loops=written(tmp_path, BESIDE.replace('drives = ["A"]', ""))).drives == ("D",)
    assert ksl.load(robot, loops=written(tmp_path, BESIDE), drives=[]).drives == ()
    weighted = ksl.load(robot, loops=written(tmp_path, BESIDE.replace('drives = ["A"]', "drives = { A = 2.0, B = 3.0 }")))
    assert weighted.drives == ("A", "B") and weighted.drive_weights == (2.0, 3.0)


def test_the_open_tree(robot):
    cut = ksl.load_string(TREE.format(CONSTRAINT), loops="cut")
    assert not cut.loops and cut.drives is None
    zero = np.zeros(3)
    assert np.array_equal(cut.inverse_dynamics(Q, zero, zero), ksl.load(robot).inverse_dynamics(Q, zero, zero))


def test_pickles_have_what_was_asked_for(robot, tmp_path):
    closed = tmp_path / "closed.urdf"
    closed.write_text(TREE.format(CONSTRAINT))
    for m in (ksl.load(robot, loops=written(tmp_path, BESIDE)), ksl.load(closed, drives=["B"]), ksl.load(closed), ksl.load(closed, loops="cut")):
        again = pickle.loads(pickle.dumps(m))
        assert again.loops == m.loops and again.drives == m.drives and again.inputs == m.inputs
    pickled = pickle.dumps(ksl.load(closed))
    closed.write_text(TREE.format(CONSTRAINT.replace("0.25 0 0", "0.26 0 0")))
    with pytest.raises(ValueError, match="have changed since"):
        pickle.loads(pickled)


WRONG = {
    '[[loop]]\nname = "C"': "loop C: no kind; write kind =",
    "drives = []": r"no \[\[loop\]\] and no \[\[force_element\]\] in it; describe at least one",
    BESIDE.replace("kind =", "knd ="): r"loop C has an unknown key 'knd'; did you mean 'kind'\?",
    BESIDE.replace("robot =", "robt ="): r"the file has an unknown key 'robt'; did you mean 'robot'\?",
    BESIDE.replace('"fourbar"', '"sixbar"'): "its loops are those of robot 'sixbar', but the robot is called 'fourbar'; give the file of that robot",
    BESIDE.replace('"coupler"', '"copler"'): r'loop joint C: predecessor "copler".*did you mean "coupler"\?|joint C: .*"copler".*did you mean "coupler"\?',
    BESIDE.replace('"continuous"', '"continous"'): '"continous" is unknown',
    BESIDE.replace('"continuous"', '"floating"'): "loop joint C: a floating joint leaves all freedoms",
    BESIDE.replace('"continuous"', '"helical"'): "loop joint C: .*pitch",
    BESIDE.replace("axis = [0, -1, 0]", ""): "loop joint C: .*needs an axis",
    BESIDE.replace("axis = [0, -1, 0]", "axis = [0, 1]"): r"loop C: axis is \[0, 1\]; expected three numbers",
    BESIDE + "pitch = true": "loop C: pitch is True; expected a number",
    BESIDE.replace('"rocker"', '"coupler"'): "it connects link coupler with itself; name two links",
    BESIDE.replace('name = "C"', 'name = "A"'): 'a second joint is named "A"; rename one',
    BESIDE.replace('["A"]', '"A"'): "drives is 'A'; expected names of joints",
    BESIDE.replace('["A"]', '["C"]'): 'drive "C": it closes a loop, and its position is no coordinate; .*drive one of A, B, D',
    BESIDE.replace('["A"]', '["AA"]'): 'drive "AA": there is no such joint; did you mean "A"',
    BESIDE.replace("[[loop]]", "[loop]"): r"loop is no list of tables; begin each loop with a line \[\[loop\]\]",
    "[[loop]": "is not TOML",
}


@pytest.mark.parametrize("text", WRONG, ids=range(len(WRONG)))
def test_what_is_wrong_in_the_file_is_said(robot, tmp_path, text):
    path = written(tmp_path, text)
    with pytest.raises(ksl.DescriptionError, match=WRONG[text]) as said:
        ksl.load(robot, loops=path)
    assert str(path) in str(said.value)


def test_what_is_wrong_in_the_call_is_said(robot, tmp_path):
    with pytest.raises(ksl.DescriptionError, match="none.toml: .*; give a TOML file with the loops of the robot"):
        ksl.load(robot, loops=tmp_path / "none.toml")
    with pytest.raises(ksl.DescriptionError, match=r"the robot has no loops: each joint of a tree has a motor; leave drives= out"):
        ksl.load(robot, drives=["A"])
    with pytest.raises(ksl.DescriptionError, match='robot "fourbar" has no loops'):
        ksl.load(robot).with_drives(["A"])
    with pytest.raises(ValueError, match='drives are given, but loops="cut" leaves a tree'):
        ksl.load_string(TREE.format(CONSTRAINT), loops="cut", drives=["A"])
    with pytest.raises(ValueError, match='loops is 3; expected the path of a TOML file, or "cut"'):
        ksl.load(robot, loops=3)


@pytest.fixture
def closed() -> ksl.Model:
    return ksl.load_string(TREE.format(CONSTRAINT), drives=["D"])


def test_loops_and_drives_survive_surgery(closed):
    frame = np.reshape(closed.loops[0].predecessor_pose, (4, 4))
    for m in (
        closed.with_frame("tip", "coupler", np.eye(4)),
        closed.with_payload("coupler", 2.0),
        closed.with_root("world"),
        closed.with_gravity((0, 0, -1)),
        closed.with_physics(["damping"]),
        ksl.load_string(closed.to_urdf()),
        pickle.loads(pickle.dumps(closed)),
    ):
        assert m.loops == closed.loops and m.drives == ("D",)
    rerooted = closed.with_root("coupler")  # the loop's equations are those of the same links
    q = dict(zip(closed.joint_names, Q))
    turned = [q[name] for name in rerooted.joint_names]
    seen = np.linalg.inv(rerooted.frame_pose(turned, "world"))
    assert np.abs(seen @ rerooted.frame_pose(turned, "coupler") @ frame - closed.frame_pose(Q, "coupler") @ frame).max() < 1e-15
    assert np.abs(np.abs(rerooted.loop_error(turned)) - np.abs(closed.loop_error(Q))).max() < 1e-14
    held = closed.with_frozen_joints({"D": 0.9})
    assert held.loop_names == ["C"] and held.drives == ()
    assert np.abs(held.loop_error(Q[:2]) - closed.loop_error(Q)).max() < 1e-15
    with pytest.raises(ksl.DescriptionError, match="joint C closes a loop, and has no position to be frozen at"):
        closed.with_frozen_joints({"C": 0.0})


def test_names_are_unique_over_all_joints(closed):
    named = ksl.load_string(TREE.format(CONSTRAINT.replace('"C"', '"tip_joint"'))).with_frame("tip", "crank")
    assert "tip_joint_" in named.fixed_joint_names and named.loop_names == ["tip_joint"]


def test_merged_robots(closed, robot):
    tree = ksl.load(robot)
    both = tree.merged(closed, "coupler", prefix="tool_")
    assert both.loop_names == ["tool_C"] and (both.loops[0].predecessor, both.loops[0].successor) == ("tool_coupler", "tool_rocker")
    assert both.drives == ("A", "B", "D", "tool_D")  # a tree has all its motors
    assert closed.merged(closed, "coupler", prefix="tool_").drives == ("D", "tool_D")
    unknown = ksl.load_string(TREE.format(CONSTRAINT))
    assert unknown.merged(closed, "coupler", prefix="tool_").drives is None
    clash = ksl.load_string('<robot name="r"><link name="x"/><link name="y"/>' + JOINT.format("C", "x", "y", "0 0 0") + "</robot>", masses="optional")
    for a, b, link in ((closed, clash, "coupler"), (clash, closed, "y")):
        with pytest.raises(ksl.DescriptionError, match='both robots have a joint named "C"; give a prefix'):
            a.merged(b, link)


def test_a_loop_that_loses_a_link_is_refused_or_dropped(closed):
    with pytest.raises(ksl.DescriptionError, match='joint C closes a loop over link rocker, which link "crank" doesn\'t carry'):
        closed.subtree("crank")
    part = closed.subtree("crank", loops="drop")
    assert part.joint_names == ["B"] and not part.loops
    assert closed.subtree("world").loops == closed.loops
    with pytest.raises(ValueError, match="loops"):
        closed.subtree("crank", loops="keep")


@pytest.mark.parametrize("file", sorted(Path(__file__).parents[2].glob("examples/robots/*.urdf")), ids=lambda file: file.stem)
def test_transmissions_have_the_type_without_which_others_refuse_a_file(file):
    for text in (file.read_text(), ksl.load(file).to_urdf()):
        transmissions = ElementTree.fromstring(text).findall("transmission")
        assert all((each.findtext("type") or "").startswith("transmission_interface/") for each in transmissions)
    assert bool(transmissions) == ("<transmission" in file.read_text())
