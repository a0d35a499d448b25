"""ksl.motions.signal.suspicions: units that can't be are named with the option that mends them, and usual motions are not suspected."""

import re

import numpy as np
import pytest

import ksl
from chains import limit, one_sided_joints, robot_of
from ksl.mechanism.lengths import extent
from ksl.motions.motion import complete
from ksl.motions.signal.suspicions import suspicions, suspicions_of_pose


@pytest.fixture
def ur5(examples):
    return ksl.load(examples / "robots/ur5.urdf")


def doubts(model, t, q):
    return complete(model, t, q, [[None, None]] * 6).doubts


def motion(t):
    return 0.8 * np.sin(t[:, None] * np.linspace(0.5, 1.5, 6))


def test_a_joint_without_limits(robot):
    wheel = robot(
        '<robot name="w"><link name="a"/><link name="b"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="wheel" type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
    )
    t = np.arange(500) * 0.01
    (line,) = complete(wheel, t, 4000 * np.sin(t / 5)[:, None], [[None, None]]).doubts
    assert line == f"wheel reaches {4000 * np.sin(t / 5).max():.4g} rad: are these degrees? Then add --degrees"
    assert complete(wheel, t, 30 * t[:, None] * 0.1, [[None, None]]).doubts == []


@pytest.mark.parametrize("option, factor", [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_times_in_another_unit(ur5, option, factor):
    t = np.arange(1000) * 0.004
    (line,) = doubts(ur5, t * factor, motion(t))
    assert line.endswith(f"Then add --time-unit {option}") and f"samples are {0.004 * factor:.4g} s apart" in line


@pytest.mark.parametrize(("kind", "sizes", "reach"), [("revolute", (0.1, 3.0), (5.0, 100.0)), ("prismatic", (0.01, 2.0), (8.0, 1200.0))])
@pytest.mark.parametrize("order", [1, -1])
def test_the_joint_that_is_farthest_beyond_its_own_limits_is_named(robot, kind, sizes, reach, order):
    """And not the one that goes farthest."""
    part = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    ends = list(zip("ab", sizes, strict=True))[::order]
    joints = [
        f'<joint name="{n}" type="{kind}"><parent link="l{k}"/><child link="l{k + 1}"/><limit lower="{-x}" upper="{x}" effort="1" velocity="1"/></joint>'
        for k, (n, x) in enumerate(ends)
    ]
    m = robot(f'<robot name="r">{"".join(part.format(f"l{k}") for k in range(3))}{"".join(joints)}</robot>')
    q = np.array([[dict(zip("ab", reach, strict=True))[name] for name in m.joint_names]])
    (said,) = suspicions_of_pose(m, q[0])
    assert said.startswith(f"a reaches {reach[0]:g} ")


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("start", [-7.0, 0.4, 3000.0])
def test_what_is_suspected_does_not_depend_on_where_times_begin(ur5, factor, start):
    t = np.arange(1024) / 256
    samples = np.delete(np.arange(1024), slice(300, 420)) if factor == 1.0 else slice(None)  # one with a gap
    places = re.compile(r"between \S+ s and \S+ s")
    found = [[places.sub("", line) for line in doubts(ur5, (t * factor + begin)[samples], motion(t)[samples])] for begin in (0.0, start)]
    assert found[0] == found[1] and len(found[0]) == 1


@pytest.mark.parametrize(
    ("kind", "limits", "least", "most"),
    [
        ("revolute", limit(-1, 1), 3.0, 3.0 * 180 / np.pi), ("revolute", limit(-4, -1), 6.0, 6.0 * 180 / np.pi), ("revolute", limit(1, 4), 6.0, 6.0 * 180 / np.pi),
        ("continuous", "", 100.0, 100 * 180 / np.pi), ("prismatic", limit(-2, 1), 4.5, 4500.0), ("prismatic", limit(0, 0.2), 1.0, 300.0), ("prismatic", limit(0, 0), None, None),
    ],
)  # fmt: skip
def test_positions_of_another_unit(robot, kind, limits, least, most):
    """Beyond 1.5 times the limits or their range, 100 rad, or 20 times the robot's extent, 1 m at least; and possible in the smaller unit."""
    m = robot_of(robot, ("j", kind, limits))
    least, most = (20 * extent(m), 20e3 * extent(m)) if least is None else (least, most)
    word = "millimetres" if kind == "prismatic" else "degrees"
    for x, said in ((0.999 * least, False), (1.001 * least, True), (0.999 * most, True), (1.001 * most, False)):
        for found in (suspicions_of_pose(m, np.array([-x])), suspicions(m, np.arange(3.0), np.array([[0.0], [x], [0]]), np.ones((3, 1)))):
            assert [f"j reaches {x:.4g} " in line and word in line for line in found] == [True] * said


def test_joints_with_one_limit_are_as_those_without():
    for m in one_sided_joints():
        assert [bool(suspicions_of_pose(m, np.array([x]))) for x in (99.0, 101.0)] == [False, True]


@pytest.mark.parametrize(
    ("speed", "step", "said"),
    [
        (2e-3, 0.5, "milliseconds? Then add --time-unit ms"), (2.01e-3, 0.5, ""), (4.02e-5, 0.5, "--time-unit ms"), (3.98e-5, 0.5, ""), (2e-3, 0.0999, ""), (2e-3, 0.1001, "ms"),
        (2e-3, 999.0, "ms"), (2e-3, 1001.0, ""), (2e-6, 1001.0, "microseconds? Then add --time-unit us"), (2e-9, 2e6, "nanoseconds? Then add --time-unit ns"), (4.02e-8, 0.5, "us"), (3.98e-8, 0.5, ""),
        (4.02e-11, 0.5, "ns"), (3.98e-11, 0.5, ""), (0.0, 0.5, ""),
        (201.0, 0.99e-4, "times its limit: check"), (199.0, 0.99e-4, ""), (201.0, 1.01e-4, ""),
    ],
)  # fmt: skip
@pytest.mark.parametrize("limits", [limit(-9, 9), ""])
def test_times_of_another_unit(robot, speed, step, said, limits):
    m = robot_of(robot, ("j", "revolute" if limits else "continuous", limits))
    found = suspicions(m, step * np.arange(5), np.zeros((5, 1)), np.linspace(0, -speed, 5)[:, None])
    assert [(said if limits else said.replace("its limit", "2 rad/s or m/s")) in line for line in found] == [True] * bool(said)
    long = suspicions(m, np.linspace(0, 0.1001, 5000), np.zeros((5000, 1)), np.full((5000, 1), 201.0))
    assert long == [] and len(suspicions(m, np.linspace(0, 0.0999, 5000), np.zeros((5000, 1)), np.full((5000, 1), 201.0))) == 1
