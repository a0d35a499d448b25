"""Poses by name, of files and within limits, each just below and just above."""

from types import SimpleNamespace

import numpy as np
import pytest

from hinged_rods import BODY, HINGE, joint_of
from ksl.base.errors import MotionError
from ksl.load_cases.closed_poses import closed_pose, reach_of
from ksl.load_cases.holding import read_pose
from ksl.load_cases.poses import neutral, pose_of
from ksl.mechanism.mechanism import Joint
from linkages import SLIDERCRANK

MIXED = (
    f'<robot name="m"><link name="wall"/>{BODY.format("b")}{BODY.format("c")}{BODY.format("d")}{BODY.format("e")}'
    + HINGE.format("above", "revolute", "wall", "b", '<limit lower="0.5" upper="2" effort="9" velocity="9"/>')
    + HINGE.format("below", "revolute", "b", "c", '<limit lower="-2" upper="-0.25" effort="9" velocity="9"/>')
    + HINGE.format("none", "revolute", "c", "d", '<limit lower="3" upper="3" effort="9" velocity="9"/>')
    + '<joint name="free" type="floating"><parent link="wall"/><child link="e"/></joint></robot>'
)


def test_poses_by_name(robot):
    m = robot(MIXED)
    free = slice(m.joint("free").q_index, m.joint("free").q_index + 7)
    at = lambda q, name: q[m.joint(name).q_index]
    assert [at(neutral(m), name) for name in ("above", "below", "none")] == [0.5, -0.25, 0] and neutral(m)[free].tolist() == [0, 0, 0, 0, 0, 0, 1]
    whole = pose_of(m, {"free": [1, 2, 3, 0, 0, 0.6, 0.8], "above": 1.5})
    assert whole[free] == pytest.approx([1, 2, 3, 0, 0, 0.6, 0.8]) and at(whole, "above") == 1.5
    for length in (0.9901, 1.0099):
        assert pose_of(m, {"free.x": 5, "free.qx": length, "free.qw": 0})[free] == pytest.approx([5, 0, 0, 1, 0, 0, 0])
    for length in (0.9899, 1.0101):
        with pytest.raises(MotionError, match=f"the quaternion of free has length {length:.4g}; expected a unit"):
            pose_of(m, {"free.qx": length, "free.qw": 0})
    for wrong in ({"free": [1, 2, 3]}, {"above": [1.0]}, {"above": True}, {"above": np.inf}):
        with pytest.raises(MotionError, match="pose: "):
            pose_of(m, wrong)


def test_a_pose_of_a_file_is_its_nearest_sample(robot, tmp_path):
    m = robot(f'<robot name="r"><link name="wall"/>{BODY.format("b")}{HINGE.format("pin", "continuous", "wall", "b", "")}</robot>')
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{2 + k / 10},{k}\n" for k in range(8)))
    assert [read_pose(m, tmp_path / "m.csv", t)["pin"] for t in (None, 2, 2.34, 2.36, 2.7)] == [0, 0, 3, 4, 7]
    for time in (1.99, 2.71):
        with pytest.raises(MotionError, match=f"no sample at {time} s; its times are 2 s to 2.7 s"):
            read_pose(m, tmp_path / "m.csv", time)


def test_a_pose_within_one_bound():
    for lower, upper, at in ((None, -1.5, -1.5), (None, 1.5, 0), (0.5, None, 0.5), (-0.5, None, 0)):
        assert neutral(SimpleNamespace(nq=1, joints=(joint_of(limits=((lower, upper),)),), joint_names=("pin",))).tolist() == [at]
    planar = Joint("p", "planar", "a", "b", 3, 3, 1, 1, (0.0, 0.0, 1.0), limits=((1.0, 2.0), (None, -3.0), (4.0, 4.0)))
    assert neutral(SimpleNamespace(nq=4, joints=(planar,), joint_names=("p",))).tolist() == [0, 1, -3, 0]


def test_poses_within_the_limits_of_joints_that_follow(robot):
    """Up to a billionth; a position that is given for one of them may differ by a thousandth."""
    m = robot(SLIDERCRANK, drives=["A"])
    start, slide = m.close(m.neutral(), hold=["A"]).q, m.joint("S").q_index
    at = float(start[slide])
    for beyond, ok in ((0.9e-9, True), (1.1e-9, False)):
        for limit in (f'lower="0" upper="{at - beyond!r}"', f'lower="{at + beyond!r}" upper="1"'):
            narrow = robot(SLIDERCRANK.replace('lower="0" upper="1"', limit), drives=["A"])
            assert reach_of(narrow, start, set()).closed(start[None])[1].tolist() == [ok], limit
    for off, ok in ((0.9e-3, True), (-0.9e-3, True), (1.1e-3, False), (-1.1e-3, False)):
        q = start + off * np.eye(m.nq)[slide]
        if ok:
            assert closed_pose(m, q, ["A", "S"])[0] == pytest.approx(start, abs=1e-9)
            continue
        with pytest.raises(MotionError, match=f"pose: S is given {q[slide]:.6g} m, but with A = .* the loops put it at {at:.6g} m"):
            closed_pose(m, q, ["A", "S"])
