"""Loops and drives in MJCF, held against MuJoCo's own residuals."""

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

import ksl
from ksl import mjcf

BODIES = """
<body name="a" pos="0.1 0.2 0.3" quat="0.9 0.1 0.2 0.3"><freejoint name="fa"/><geom type="box" size="0.1 0.2 0.3"/><site name="sa" pos="0.4 0.1 0" quat="0.8 0 0.6 0"/></body>
<body name="b" pos="1 0.2 0" quat="0.7 0.1 -0.2 0.3"><freejoint name="fb"/><geom type="box" size="0.1 0.2 0.3"/><site name="sb" pos="-0.4 0.1 0.3"/></body>"""
EQUALITIES = {
    "connect at an anchor": '<connect name="e" body1="a" body2="b" anchor="0.3 0.1 0.2"/>',
    "connect of sites": '<connect name="e" site1="sa" site2="sb"/>',
    "weld as placed": '<weld name="e" body1="a" body2="b" anchor="0.2 0.1 0"/>',
    "weld at a pose": '<weld name="e" body1="a" body2="b" anchor="0.2 0.1 0" relpose="0.3 0.2 0.1 0.5 0.5 0.5 -0.5"/>',
    "weld of sites": '<weld name="e" site1="sa" site2="sb"/>',
    "weld to the world": '<weld name="e" body1="a"/>',
}


def robot(inside: str, equality: str = "", more: str = "") -> str:
    return f"<mujoco><worldbody>{inside}</worldbody><equality>{equality}</equality>{more}</mujoco>"


@pytest.mark.parametrize("equality", EQUALITIES.values(), ids=EQUALITIES)
def test_frames_are_those_of_mujoco(equality):
    text = robot(BODIES, equality)
    mj = mujoco.MjModel.from_xml_string(text)
    m, data = ksl.load_string(text), mujoco.MjData(mj)
    (loop,) = m.loops
    assert loop.name == "e" and loop.kind == ("fixed" if "weld" in equality else "spherical")
    rng = np.random.default_rng(1)
    for _ in range(3):
        data.qpos[:] = rng.normal(size=mj.nq)
        mujoco.mj_normalizeQuat(mj, data.qpos)
        mujoco.mj_forward(mj, data)
        residual = data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
        q = mjcf.from_mujoco(m, data.qpos).q
        sides = ((loop.predecessor, loop.predecessor_pose), (loop.successor, loop.successor_pose))
        first, second = (m.frame_pose(q, link) @ np.reshape(pose, (4, 4)) for link, pose in sides)
        assert np.abs(first[:3, 3] - second[:3, 3] - residual[:3]).max() < 1e-14
        if loop.kind == "fixed":
            cosine = (np.trace(first[:3, :3].T @ second[:3, :3]) - 1) / 2
            assert abs(np.linalg.norm(residual[3:]) - np.sqrt((1 - cosine) / 2)) < 1e-14  # the sine of half the angle
    assert "solref, solimp of equality constraints (1 loop, closed exactly)" in m.unused
    assert not ksl.load_string(text, loops="cut").loops


ARM = """
<body name="a"><joint name="ja" axis="0 0 1"/><geom type="box" size="0.1 0.2 0.3"/></body>
<body name="b" pos="1 0 0" quat="0.8 0 0 0.6"><joint name="jb" axis="0 0 1"/><geom type="box" size="0.1 0.2 0.3"/></body>"""


def test_two_connects_are_a_revolute_joint():
    first, second = (
        '<connect name="pin_{}" body1="{}" body2="{}" anchor="{}"/>'.format(*x) for x in ((1, "a", "b", "0.5 0.25 0"), (2, "a", "b", "0.5 0.25 0.1"))
    )
    swapped = '<connect name="pin_2" body1="b" body2="a" anchor="0.1 0.555 0.1"/>'
    with pytest.warns(ksl.DescriptionWarning, match="pin_1 and pin_2 connect the same two bodies at two points; they are read as one revolute"):
        m = ksl.load_string(robot(ARM, first + second))
    (loop,) = m.loops
    assert loop.name == "pin" and loop.kind == "revolute" and np.allclose(loop.axis, (0, 0, 1))
    assert np.abs(m.loop_error(np.zeros(2))).max() < 1e-15
    with pytest.warns(ksl.DescriptionWarning, match="revolute"):
        assert ksl.load_string(robot(ARM, first + swapped)).loops[0].kind == "revolute"
    apart = ksl.load_string(robot(ARM, first + first.replace("pin_1", "pin_3")))  # at one point: no line
    assert [(x.name, x.kind) for x in apart.loops] == [("pin_1", "spherical"), ("pin_3", "spherical")]


def test_connects_of_three_bodies_are_two_joints():
    """Of the first body with each of the others, as far from each other as points of one axis would be."""
    bodies = "".join(f'<body name="{n}"><freejoint/><geom size="0.1"/><site name="{n}0"/><site name="{n}1" pos="0 0 1"/></body>' for n in "abc")
    m = ksl.load_string(robot(bodies, '<connect name="p" site1="a0" site2="b0"/><connect name="q" site1="a1" site2="c1"/>'))
    assert [(x.name, x.kind) for x in m.loops] == [("p", "spherical"), ("q", "spherical")]


def test_actuators_name_the_drives():
    connect = '<connect body1="a" body2="b" anchor="0.5 0.25 0"/>'
    follows = '<joint joint1="jb" joint2="ja" polycoef="0 2 0 0 0"/>'
    both = '<tendon><fixed name="t"><joint joint="ja" coef="1"/><joint joint="jb" coef="1"/></fixed></tendon>'

    def loaded(equality: str, actuators: str, before: str = "") -> ksl.Model:
        return ksl.load_string(robot(ARM, equality, f"{before}<actuator>{actuators}</actuator>"))

    m = loaded(connect, '<motor joint="jb"/><position joint="jb"/>')
    assert m.drives == ("jb",) and m.loop_names == ["a_b_loop"] and not any("actuator" in line for line in m.unused)
    m = loaded(connect, '<motor tendon="t"/>', both)  # of two coordinates
    assert m.drives is None and "actuator (1)" in m.unused
    assert loaded(connect + follows, '<motor tendon="t"/>', both).drives == ("ja",)
    assert loaded(connect + follows, '<motor joint="jb"/>').drives == ("ja",)
    assert loaded(connect, "").drives is None
    if hasattr(mujoco.mjtTrn, "mjTRN_SO3"):
        ball = ksl.load_string(robot(ARM.replace('name="ja" axis="0 0 1"', 'name="ja" type="ball"'), connect, '<actuator><orientation joint="ja"/></actuator>'))
        assert ball.drives == ("ja",) and ball.joint("ja").kind == "spherical"
    stack = ARM.replace('<joint name="jb" axis="0 0 1"/>', '<joint name="jb" axis="0 0 1"/><joint name="jc" axis="1 0 0"/>')
    kinds = [
        [m.joint(x).kind for x in m.joint_names]
        for m in (ksl.load_string(robot(stack, connect, f"<actuator>{x}</actuator>")) for x in ("", '<motor joint="jc"/>'))
    ]
    assert kinds == [["revolute", "universal"], ["revolute"] * 3]
    coupled = ksl.load_string(robot(stack, '<joint joint1="jc" joint2="ja"/>'))
    assert (coupled.joint_names, coupled.follower_names) == (["ja", "jb"], ["jc"])


def test_constraints_that_are_turned_off():
    connect = '<connect body1="a" body2="b" anchor="0.5 0.25 0" active="false"/>'
    m = ksl.load_string(robot(ARM, connect))
    assert not m.loops and "equality connect, not active (1)" in m.unused
    off = robot(ARM, connect.replace("false", "true")).replace("<worldbody>", '<option><flag equality="disable"/></option><worldbody>')
    assert not ksl.load_string(off).loops


def test_a_loop_inside_one_body_is_refused(tmp_path: Path):
    path = tmp_path / "r.xml"
    path.write_text(
        robot(BODIES.replace('<site name="sb" pos="-0.4 0.1 0.3"/>', "").replace("</body>", '<site name="sb"/></body>', 1), EQUALITIES["connect of sites"])
    )
    with pytest.raises(ksl.DescriptionError, match=r"r\.xml: .*e: it connects link a with itself"):
        ksl.load(path)


LINES = {
    "the same direction": ((0, 0, 0.3), (0, 0, 0.5)),
    "opposite": ((0, 0, 0.3), (0, 0, -0.5)),
    "beyond a right angle": ((0.1, 0.2, 0.3), (0, 0, -0.5)),
    "opposite, along x": ((-0.5, 0, 0), (0.5, 0, 0)),
    "any": ((0.3, -0.1, 0.2), (-0.2, 0.4, 0.1)),
    "nearly opposite": ((0.3, 0.4, 1e-9), (-0.3, -0.4, 0)),
}


def tied_at_two_points(along_a: np.ndarray, along_b: np.ndarray, order: str, size: float = 1.0) -> str:
    """Bodies that two `connect` of sites tie: the line through the sites has these directions on them."""
    a1, b1 = size * np.array((0.4, -0.3, 0.2)), size * np.array((-0.7, 0.1, 0.6))
    sites = {"a": (a1, a1 + along_a), "b": (b1, b1 + along_b)}
    bodies = ""
    for body, points in sites.items():
        marks = "".join('<site name="{}{}" pos="{} {} {}"/>'.format(body, k, *(repr(float(x)) for x in p)) for k, p in enumerate(points, 1))
        bodies += f'<body name="{body}"><freejoint name="f{body}"/><geom type="box" size="0.1 0.2 0.3"/>{marks}</body>'
    second = 'site1="b2" site2="a2"' if order == "swapped" else 'site1="a2" site2="b2"'
    return robot(bodies, f'<connect name="p1" site1="a1" site2="b1"/><connect name="p2" {second}/>')


@pytest.mark.parametrize("order", ["in order", "swapped"])
@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
@pytest.mark.filterwarnings("ignore:equality constraints p1 and p2 connect")
def test_the_axis_of_two_connects_is_the_line_through_their_points_on_both_bodies(line, order):
    along_a, along_b = (np.array(x, dtype=float) for x in line)
    along_a *= np.linalg.norm(along_b) / np.linalg.norm(along_a)
    (loop,) = ksl.load_string(tied_at_two_points(along_a, along_b, order)).loops
    first, second = (np.reshape(pose, (4, 4)) for pose in (loop.predecessor_pose, loop.successor_pose))
    assert loop.kind == "revolute" and (loop.predecessor, loop.successor) == ("a", "b")
    assert np.allclose(first[:3, 3], (0.4, -0.3, 0.2)) and np.allclose(second[:3, 3], (-0.7, 0.1, 0.6)) and np.array_equal(second[:3, :3], np.eye(3))
    length = np.linalg.norm(along_b)
    assert np.abs(length * np.array(loop.axis) - along_b).max() < 1e-15 and np.abs(length * first[:3, :3] @ loop.axis - along_a).max() < 1e-8
    assert np.abs(first[:3, :3] @ first[:3, :3].T - np.eye(3)).max() < 1e-15 and np.linalg.det(first[:3, :3]) > 0


def test_constraints_without_a_name_are_told_by_their_place():
    """Of their kind, in the order of the file."""
    text = re.sub('name="p[12]" ', "", tied_at_two_points(np.ones(3), np.ones(3), "in order"))
    with pytest.warns(ksl.DescriptionWarning, match="^equality constraints <connect> 1 and <connect> 2 connect the same two bodies"):
        assert [loop.name for loop in ksl.load_string(text).loops] == ["a_b_loop"]
    coupled = '<joint name="named" joint1="j" joint2="k"/><joint joint1="j" joint2="k" polycoef="0 2 0 0 0"/>'
    bodies = "".join(f'<body name="{x}"><joint name="{x}"/><geom size="0.1"/></body>' for x in "jk")
    with pytest.raises(ksl.DescriptionError, match="equality constraint <joint> 2 couples joint j, which follows joint k already"):
        ksl.load_string(robot(bodies, f'<weld body1="j" body2="k" active="false"/>{coupled}'))


@pytest.mark.parametrize("size", [1.0, 1e-7])
@pytest.mark.parametrize(("longer", "folds"), [(1 + 1e-8, True), (1 - 1e-8, True), (1 + 1.05e-6, False), (1 - 1e-5, False), (1e-9, False)])
@pytest.mark.filterwarnings("ignore:equality constraints p1 and p2 connect")
def test_points_at_other_distances_stay_two_joints(longer, folds, size):
    """A revolute joint would ask for another distance; where both are one point there is no line."""
    along = size * np.array((0.3, -0.1, 0.2))
    m = ksl.load_string(tied_at_two_points(longer * along, along if longer > 0.5 else longer * along, "in order", size))
    assert [x.kind for x in m.loops] == (["revolute"] if folds else ["spherical"] * 2)


def test_a_weld_without_a_scale_of_its_torque_holds_a_point_alone():
    text = robot(BODIES, '<weld name="e" body1="a" body2="b" anchor="0.2 0.1 0" torquescale="0"/>')
    (loop,) = ksl.load_string(text).loops
    mj = mujoco.MjModel.from_xml_string(text)
    assert (
        loop.kind == "spherical" and np.allclose(loop.successor_pose[3:12:4], (0.2, 0.1, 0)) and np.allclose(loop.predecessor_pose[3:12:4], mj.eq_data[0][3:6])
    )


def test_followers_of_followers_and_motors_on_them():
    """c follows b, which follows a: positions, and whose drive a motor on c is."""
    bodies = "".join(f'<body name="{n}" pos="{k} 0 0"><joint name="{n}" ref="0.{k}"/><geom size="0.1"/></body>' for k, n in enumerate("abc"))
    follows = '<joint joint1="c" joint2="b" polycoef="0.2 3 0 0 0"/><joint joint1="b" joint2="a" polycoef="0.1 -2 0 0 0"/>'
    text = robot(bodies, follows + '<connect body1="a" body2="b" anchor="0 0 0"/>', '<actuator><motor joint="c"/></actuator>')
    m, mj = ksl.load_string(text), mujoco.MjModel.from_xml_string(text)
    assert m.drives == ("a",) and m.follower_names == ["b", "c"]
    data = mujoco.MjData(mj)
    data.qpos[:] = mjcf.to_mujoco(m, [0.7]).q
    mujoco.mj_forward(mj, data)
    kinds = data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
    assert np.abs(kinds[:2]).max() < 1e-15 and np.ptp(data.qpos) > 1
