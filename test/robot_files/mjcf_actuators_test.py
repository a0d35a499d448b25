"""Limits of motors in MJCF, held against the forces that MuJoCo exerts for any control."""

import mujoco
import numpy as np
import pytest

import ksl
from ksl import mjcf
from ksl.robot_files.mjcf_actuators import effort_ranges

BODY = '<geom type="box" size="0.1 0.2 0.3" contype="0" conaffinity="0"/>'
TENDON = '<tendon><fixed name="t"{}><joint joint="a" coef="0.5"/><joint joint="b" coef="-2"/></fixed></tendon>'
SINCE_4 = pytest.mark.skipif(not hasattr(mujoco.MjModel, "actuator_armature"), reason="actuators of this MuJoCo have no armature")
FOLLOWS = '<equality><joint joint1="b" joint2="a" polycoef="0 -3 0 0 0"/></equality>'


def robot(actuators: str, joints: tuple[str, str] = ("", ""), more: str = "", head: str = "") -> str:
    bodies = "".join(f'<body name="{n}"><joint name="{n}" {given}/>{BODY}</body>' for n, given in zip("ab", joints))
    return f"<mujoco>{head}<worldbody>{bodies}</worldbody>{more}<actuator>{actuators}</actuator></mujoco>"


def exerted(text: str, leader_of_b: float = 0.0) -> np.ndarray:
    """The largest efforts of both joints that MuJoCo exerts at rest: of the weaker direction."""
    least, largest = ends(text, leader_of_b)
    return np.minimum(largest, -least)


def ends(text: str, leader_of_b: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """The least and largest efforts over the ends of all controls and beyond them."""
    mj = mujoco.MjModel.from_xml_string(text)
    mj.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EQUALITY
    d, found = mujoco.MjData(mj), []
    for signs in np.ndindex(*[2] * mj.nu):
        mujoco.mj_resetData(mj, d)
        d.ctrl[:] = np.where(signs, 1e6, -1e6)
        d.act[:] = np.where(signs, 1e6, -1e6)[: mj.na]
        for i in range(mj.na):  # a state that has followed its control for long
            low, high = mj.actuator_actrange[i] if mj.actuator_actlimited[i] else mj.actuator_ctrlrange[i]
            d.act[i] = np.clip(d.act[i], min(low, 0.0), max(high, 0.0)) if mj.actuator_dyntype[0] != 1 else np.clip(d.act[i], low, high)
        mujoco.mj_forward(mj, d)
        a, b = d.qfrc_actuator
        found.append((a + leader_of_b * b, b))
    return np.min(found, axis=0), np.max(found, axis=0)


@pytest.mark.parametrize(
    ("actuators", "more"),
    [
        ('<motor joint="a" ctrlrange="-1 1" gear="50"/>', {}),
        ('<motor joint="a" ctrlrange="-1 1" gear="-50"/><motor joint="b" forcerange="-3 3" gear="2"/>', {}),
        ('<motor joint="a" ctrlrange="-2 2" forcerange="-1.5 1.5" gear="10"/><motor joint="a" ctrlrange="-1 1"/>', {}),  # two on one joint
        ('<motor joint="a" ctrlrange="-1 2" gear="50"/>', {}),  # the weaker direction
        ('<position joint="a" kp="100" ctrlrange="-1 1" forcerange="-5 5"/><velocity joint="b" kv="10" forcerange="-2 2" gear="3"/>', {}),
        ('<motor joint="a" ctrlrange="-1 1" gear="50"/>', {"joints": ('actuatorfrcrange="-30 30"', "")}),
        ('<motor joint="a" ctrlrange="-1 1" gear="20"/>', {"joints": ('actuatorfrcrange="-30 30"', "")}),
        ('<motor class="m" joint="a"/>', {"head": '<default><default class="m"><motor ctrlrange="-1 1" gear="7"/></default></default>'}),
        ('<general joint="a" gainprm="4" biastype="affine" biasprm="1 0 0" ctrlrange="-2 2"/>', {}),
        ('<general joint="a" gainprm="4" dyntype="filter" dynprm="0.1" ctrlrange="-2 2"/>', {}),
        ('<general joint="a" gainprm="4" dyntype="integrator" actlimited="true" actrange="-0.5 0.5" ctrlrange="-2 2"/>', {}),
        ('<motor tendon="t" ctrlrange="-1 1" gear="6"/>', {"more": TENDON.format("")}),
        (
            '<motor tendon="t" ctrlrange="-1 1" gear="6"/><motor tendon="t" ctrlrange="-1 1"/><motor joint="b" ctrlrange="-1 1"/>',
            {"more": TENDON.format(' actuatorfrcrange="-4 4"')},
        ),
    ],
)
def test_limits_are_the_largest_efforts_that_mujoco_exerts(actuators, more):
    text = robot(actuators, **more)
    m, largest = ksl.load_string(text), exerted(text)
    assert m.joint_names == ["a", "b"] and largest[0] > 0
    assert np.allclose(m.effort_limit, np.where(largest > 0, largest, np.inf), rtol=1e-14)


@pytest.mark.parametrize(
    ("actuators", "more"),
    [
        ('<motor joint="a" ctrlrange="-1 2" gear="50"/><motor joint="b" ctrlrange="-3 1" gear="-2"/>', {}),
        ('<general joint="a" gainprm="4" biastype="affine" biasprm="1 0 0" ctrlrange="-2 3"/><motor joint="a" ctrlrange="-0.5 0.25"/>', {}),
        ('<general joint="a" gainprm="-4" dyntype="filter" dynprm="0.1" ctrlrange="1 2"/>', {}),  # its state starts at 0
        ('<general joint="a" gainprm="4" dyntype="integrator" actlimited="true" actrange="-0.5 1.5" ctrlrange="-2 2"/>', {}),
        ('<motor joint="a" ctrlrange="-1 2" gear="20"/>', {"joints": ('actuatorfrcrange="-30 10"', "")}),
        ('<position joint="a" kp="1000" forcerange="-5 8" gear="-3"/>', {}),
        ('<motor tendon="t" ctrlrange="-1 3" gear="6"/><motor tendon="t" ctrlrange="-2 1" gear="-1"/>', {"more": TENDON.format("")}),
    ],
)
def test_both_ends_of_unequal_efforts_are_those_of_mujoco(actuators, more):
    text = robot(actuators, **more)
    found, (least, largest) = effort_ranges(mujoco.MjModel.from_xml_string(text)), ends(text)
    for j in range(2):
        assert np.allclose(found.get(j, (0.0, 0.0)), (least[j], largest[j]), rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("gears", [(6, 1), (6, -1), (-2, 5)])
def test_a_bound_on_the_sum_of_motors_of_a_tendon(gears):
    """No control exerts more than the range, and some come near its ends."""
    motors = "".join(f'<motor tendon="t" ctrlrange="{low} {high}" gear="{gear}"/>' for (low, high), gear in zip(((-1, 3), (-1, 2)), gears))
    mj = mujoco.MjModel.from_xml_string(robot(motors, more=TENDON.format(' actuatorfrcrange="-1.5 4"')))
    d, found = mujoco.MjData(mj), []
    for d.ctrl[0] in np.linspace(-1, 3, 17):
        for d.ctrl[1] in np.linspace(-1, 2, 13):
            mujoco.mj_forward(mj, d)
            found.append(d.qfrc_actuator[0])
    assert np.allclose(effort_ranges(mj)[0], (min(found), max(found)), rtol=1e-12)


def test_motors_of_a_follower_are_its_leaders():
    motors = '<motor joint="a" ctrlrange="-1 1" gear="5"/><motor joint="b" ctrlrange="-1 1" gear="2"/>'
    text = robot(motors, more=FOLLOWS)
    m = ksl.load_string(text)
    assert m.follower_names == ["b"] and m.effort_limit == exerted(text, -3.0)[0] == 11.0
    assert list(ksl.load_string(text, mimic="independent").effort_limit) == [5.0, 2.0]


@pytest.mark.parametrize(
    "actuators",
    [
        '<position joint="a" kp="100" ctrlrange="-1 1"/>',  # a servo's range is one of positions
        '<motor joint="a" gear="50"/>',
        '<motor joint="a" gear="50"/><motor joint="a" ctrlrange="-1 1"/>',
        '<general joint="a" dyntype="integrator" gainprm="3" ctrlrange="-1 1"/>',
        '<damper joint="a" kv="3" ctrlrange="0 1"/>',
    ],
)
def test_no_limit_where_there_is_none(actuators):
    assert np.isinf(ksl.load_string(robot(actuators)).effort_limit).all()
    unclamped = robot('<motor joint="a" ctrlrange="-1 1"/>', head='<option><flag clampctrl="disable"/></option>')
    assert np.isinf(ksl.load_string(unclamped).effort_limit).all()


@pytest.mark.parametrize(("off", "left"), [('<option actuatorgroupdisable="2"/>', ("a",)), ('<option><flag actuation="disable"/></option>', ())])
def test_actuators_that_the_file_turns_off_are_no_motors(off, left):
    motors = robot('<motor joint="a" ctrlrange="-1 1"/><motor joint="a" group="2" ctrlrange="-3 3"/><motor joint="b" group="2" ctrlrange="-2 2"/>', head=off)
    m = ksl.load_string(motors)
    limits = exerted(motors)
    assert np.array_equal(m.effort_limit, np.where(limits > 0, limits, np.inf)) and (m.drives or ()) == left
    assert f"actuator ({3 - len(left)} of 3 turned off by the file: no effort of theirs counts)" in m.unused


def test_one_direction_alone_and_unequal_ones_are_said():
    m = ksl.load_string(robot('<motor joint="a" ctrlrange="0 1" gear="9"/><motor joint="b" ctrlrange="-2 1"/>'))
    assert list(m.effort_limit) == [9.0, 1.0]
    assert any("a: unequal efforts, 0 to 9; the limit is 9 both ways" in line for line in m.unused) and any(
        "b: unequal efforts, -2 to 1; the limit is 1" in line for line in m.unused
    )


def test_a_joint_with_a_limit_stays_one_of_its_own():
    two = '<mujoco><worldbody><body><joint name="a" axis="1 0 0"/><joint name="b" axis="0 1 0"/>' + BODY + "</body></worldbody><actuator>{}</actuator></mujoco>"
    kinds = [[m.joint(name).kind for name in m.joint_names] for m in (ksl.load_string(two.format(x)) for x in ("", '<motor joint="b" ctrlrange="-1 1"/>'))]
    assert kinds == [["universal"], ["revolute", "revolute"]]


@SINCE_4
@pytest.mark.parametrize("kind", ["hinge", "ball"])
def test_armature_and_damping_of_actuators_act_on_their_joint(kind):
    on_a = '<motor joint="a" gear="-5" armature="0.01" damping="0.2"/><motor joint="a" gear="2" armature="0.03"/>'
    text = robot(on_a, (f'type="{kind}" armature="0.5"', ""))
    m, mj = ksl.load_string(text, physics=["armature", "damping"]), mujoco.MjModel.from_xml_string(text)
    d, M = mujoco.MjData(mj), np.zeros((mj.nv, mj.nv))
    d.qvel[:] = d.qacc[:] = np.arange(1.0, mj.nv + 1)
    mujoco.mj_inverse(mj, d)
    mujoco.mj_fullM(mj, d, M)
    q, v, a, _ = mjcf.from_mujoco(m, d.qpos, d.qvel, d.qacc)
    assert np.allclose(m.mass_matrix(q), M, rtol=1e-13)
    assert np.allclose(m.inverse_dynamics(q, v, a), d.qfrc_inverse, rtol=1e-13)
    assert not m.warnings
    with pytest.warns(ksl.DescriptionWarning, match="tendon t couples joints a, b by its damping, armature, which KSL doesn't read"):
        ksl.load_string(robot('<motor tendon="t" armature="0.01" damping="0.2"/>', more=TENDON.format("")))
    rod = '<site name="s" pos="0 0 1"/><body><joint/><geom size="0.1"/><site name="t" pos="1 0 0"/></body>'
    pulled = f"""<mujoco><worldbody>{rod}</worldbody><tendon><spatial name="t" stiffness="1" damping="3"><site site="s"/><site site="t"/></spatial></tendon>
      <actuator><motor tendon="t" gear="2" damping="0.5" armature="1"/></actuator></mujoco>"""
    (element,), unused = (m := ksl.load_string(pulled)).force_elements, m.unused
    assert element.damping == 5.0 and "tendon t: armature (not used)" in unused


@SINCE_4
def test_what_actuators_and_springs_have_besides_is_listed():
    m = ksl.load_string(robot('<motor joint="a" damping="0 2"/>', ('stiffness="3" springyield="0.1"', "")))
    assert {"actuator dampingpoly (nonlinear terms are not used)", "joint a: springyield (not used)"} <= set(m.unused)
