"""Maps between motors and joints, against closed forms, two independent computations, identities, and the closed mechanism's own inverse dynamics."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import ksl
from examples import JOINTS, ROBOTS, leg, model
from ksl.drivetrain import assembly
from ksl.drivetrain.parts import driven_outputs

pytestmark = pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")  # spherical is no kind of URDF's
HERE = Path(__file__).parent
CASES = json.loads((HERE / "legs.json").read_text())
"""Two legs with numbers that others have computed: closed forms with force balances of every body, and KSL's closed mechanisms before there was this map."""


@pytest.mark.parametrize("name", CASES)
def test_legs_of_two_independent_computations(name):
    case = CASES[name]
    m = model(name, "rotor", folder=HERE)
    a, plain = m.actuation(case["joints"]), model(name, folder=HERE).actuation(case["joints"])
    for s in case["states"]:
        q, v, acc = (np.array(s[k]) for k in "qva")
        carrier = None
        if case["carrier"]:
            carrier = (m.neutral(), np.zeros(m.nv), np.zeros(m.nv))
            for x, value in zip(carrier, s["carrier"]):
                x[m.joint(case["carrier"]).v_index] = value
        assert_allclose(a.motors_of(q), s["motors"]["q"], atol=1e-11)
        assert_allclose(a.joints_of(s["motors"]["q"]), q, atol=1e-11)
        assert_allclose(a.motor_velocities(q, v), s["motors"]["v"], rtol=1e-10)
        assert_allclose(a.motor_accelerations(q, v, acc), s["motors"]["a"], rtol=1e-9, atol=1e-9)
        assert_allclose(a.joint_accelerations(q, v, s["motors"]["a"]), acc, rtol=1e-9, atol=1e-9)
        assert_allclose(a.jacobian(q), s["jacobian"], rtol=1e-10)
        assert_allclose(a.jacobian_rate(q, v), s["jacobian_rate"], rtol=1e-9, atol=1e-10)
        assert_allclose(a.motor_efforts(q, v, acc, carrier), s["motor_efforts"]["with_rotors"], rtol=1e-9)
        assert_allclose(plain.motor_efforts(q, v, acc, carrier), s["motor_efforts"]["without_rotors"], rtol=1e-9)
        assert_allclose(a.lost_efforts(q, v, acc, carrier), np.subtract(s["motor_efforts"]["with_rotors"], s["motor_efforts_static"]), rtol=1e-8, atol=1e-10)
        for share in ("rotors", "rods"):
            assert_allclose(plain.reflected_inertia(q, of=share), s["reflected_inertia"][share], rtol=1e-9, atol=1e-14)
        assert_allclose(a.effort_box(q)[:, 1], s["effort_box"], rtol=1e-8)
        assert_allclose(a.velocity_box(q)[:, 1], s["velocity_box"], rtol=1e-8)


@pytest.mark.parametrize("name", CASES)
def test_ranges_of_two_independent_computations(name):
    a = model(name, folder=HERE).actuation(CASES[name]["joints"])
    for r in CASES[name]["ranges"]:
        found = a.range(r["joint"], at=r["at"], limits=r["limits"])
        for side in ("lower", "upper"):
            by = r[f"{side}_by"]
            assert (getattr(found, f"{side}_by"), getattr(found, f"{side}_name")) == (by, r[f"{side}_name"] if by == "limit" else "")
            if by != "none":
                assert_allclose(getattr(found, side), r[side], atol=1e-9)


def test_an_ankle_at_its_middle():
    """Rods are upright: a crank of 0.05 m lifts what is 0.05 m behind the ankle and 0.04 m beside it."""
    assert_allclose(leg("two_rod_ankle").motor_jacobian([0, 0]), [[1, 0.8], [1, -0.8]], atol=1e-14)
    assert_allclose(leg("two_rod_ankle").effort_polytope([0, 0]).max(axis=0), [2 * 36, 0.8 * 2 * 36])


def test_the_ratio_of_a_four_bar():
    """The rod's line passes cranks at lever arms whose ratio is that of velocities (Freudenstein)."""
    a = leg("four_bar_knee")
    m = a.model
    for q in np.linspace(-0.04, 1.3, 7):
        Q, _, _ = a.state([q])
        top, end = (m.frame_pose(Q, "rod") @ x for x in ([0, 0, 0, 1], [0.02, 0, -0.32, 1]))
        rod = (end - top)[:3]
        arm = lambda joint: np.cross(top[:3] - m.frame_pose(Q, joint)[:3, 3], rod)[1]
        assert_allclose(a.motor_jacobian([q]), [[arm("knee") / arm("knee_motor")]], rtol=1e-12)


def test_a_differential_is_exactly_linear():
    a, lead = leg("differential_wrist"), 0.02 / (2 * np.pi)
    q = np.concatenate([[[-0.1186179, -0.09507466]], np.random.default_rng(0).uniform([-0.1, -6], [0.1, 6], (19, 2))])  # the first begins with a long step
    assert_allclose(a.motors_of(q), np.stack([q[:, 1] - q[:, 0] / lead, q[:, 1]], axis=1), atol=1e-10)
    assert_allclose(a.jacobian(q), np.broadcast_to([[-lead, lead], [0, 1]], (20, 2, 2)), atol=1e-14)
    assert_allclose(a.jacobian_rate(q, [[0.3, 2.0]]), 0, atol=1e-12)


@pytest.mark.parametrize("name", JOINTS)
def test_identities_at_random_states(name):
    """Positions there and back, rates against differences, power of both sides equal, and efforts of the closed mechanism's own inverse dynamics."""
    a = leg(name, "rotor", "damping")
    m, rng = a.model, np.random.default_rng(4)
    q = a.usable(12, seed=3)
    v, acc, tau = rng.normal(size=(3, *q.shape))
    assert_allclose(a.joints_of(a.motors_of(q)), q, atol=1e-9)
    h = 1e-6
    ahead, back = (a.motors_of(q + s * h * v) for s in (1, -1))
    assert_allclose(a.motor_velocities(q, v), (ahead - back) / (2 * h), rtol=1e-6, atol=1e-6)
    assert_allclose(a.jacobian_rate(q, v), (a.jacobian(q + h * v) - a.jacobian(q - h * v)) / (2 * h), rtol=1e-5, atol=1e-5)
    motors = a.static_motor_efforts(q, tau)
    assert_allclose((motors * a.motor_velocities(q, v)).sum(-1), (tau * v).sum(-1), rtol=1e-10)
    assert_allclose(a.static_joint_efforts(q, motors), tau, rtol=1e-10)
    Q, V, A = a.state(q, v, acc)
    assert (m.actuation(a.joints, start=Q[0]).state(q)[0][:, a.of_joints] == q).all(), "to the last digit"
    assert np.abs(m.loop_error(Q)).max() < 1e-12 and np.abs(np.einsum("nrv,nv->nr", m.loop_jacobian(Q), V)).max() < 1e-12
    power = (a.motor_efforts(q, v, acc) * a.motor_velocities(q, v)).sum(-1)
    assert_allclose(power, (m.without_loops().inverse_dynamics(Q, V, A) * V).sum(-1), rtol=1e-9, atol=1e-9)
    drives = [m.joint(name).v_index for name in a.motors]
    assert_allclose(a.motor_efforts(q, v, acc), m.inverse_dynamics(Q, V, A)[:, drives], rtol=1e-9, atol=1e-10)
    assert_allclose(m.forward_dynamics(Q, V, m.inverse_dynamics(Q, V, A)), A, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("name", ["two_rod_ankle", "three_rod_platform"])
def test_steps_begin_along_their_rates(name, monkeypatch):
    """So that three of Newton's corrections are enough."""
    a = leg(name)
    q = a.usable(12, seed=3)
    wanted = a.motors_of(q)
    monkeypatch.setattr(assembly, "CORRECTIONS", 3)
    assert_allclose(a.motors_of(q), wanted, atol=1e-9)


@pytest.mark.parametrize("name", ["two_rod_ankle", "three_rod_platform"])
def test_idle_rods_do_not_spin(name):
    a = leg(name)
    assert sorted(rod.link for rod in a.equations.rods) == sorted(link for link in a.model.link_names if link.startswith("rod_"))
    q = a.usable(5)
    Q, V, A = a.state(q, np.ones_like(q), np.ones_like(q))
    for rod in a.equations.rods:
        assert_allclose(np.abs(rod.direction), [0, 0, 1], atol=1e-12)  # rods lie along z of their links
        spin = a.model.frame_velocity(Q, V, rod.link)[:, 3:] @ rod.direction
        assert_allclose(spin, 0, atol=1e-12)
        assert_allclose(a.model.frame_acceleration(Q, V, A, rod.link)[:, 3:] @ rod.direction, 0, atol=1e-10)


@pytest.mark.parametrize("name", JOINTS)
def test_joints_that_motors_move_by_rods_are_found(name):
    assert driven_outputs(model(name)) == [JOINTS[name]]


def test_a_joint_in_no_loop_is_its_own_motor():
    a = model("four_bar_knee").actuation(["hip_pitch"])
    assert a.motors == ("hip_pitch",) and a.followers == ()
    assert_allclose(a.jacobian([[0.3], [0.4]]), np.ones((2, 1, 1)))


def test_several_parts_at_once():
    m = model("four_bar_knee", "rotor")
    both, knee = m.actuation(["hip_pitch", "knee"]), leg("four_bar_knee", "rotor")
    q, v, acc = np.array([[0.3, 0.5]]), np.array([[1.0, -2.0]]), np.array([[4.0, 8.0]])
    assert_allclose(both.jacobian(q)[0, 1, 1], knee.jacobian([0.5])[0, 0])
    assert_allclose(both.jacobian(q)[0, [0, 0, 1], [0, 1, 0]], [1, 0, 0], atol=1e-15)
    assert_allclose(both.motor_efforts(q, v, acc)[:, 1], knee.motor_efforts([[0.5]], [[-2.0]], [[8.0]], both.state(q, v, acc))[:, 0], rtol=1e-10)


def own_inverse_dynamics(a, q):
    """The mechanism's efforts at its motors, none elsewhere, and its forces at the ends of rods."""
    m, (v, acc) = a.model, np.random.default_rng(2).normal(size=(2, *q.shape))
    Q, V, A = a.state(q, v, acc)
    tau, drives = m.inverse_dynamics(Q, V, A), [m.joint(name).v_index for name in a.motors]
    assert_allclose(tau[:, drives], a.motor_efforts(q, v, acc), rtol=1e-9, atol=1e-11)
    assert not np.delete(tau, drives, axis=1).any()
    forces = m.reactions(Q, V, A, joints=list(a.loops))[..., :3]
    assert_allclose(np.linalg.norm(forces, axis=2), a.loop_forces(q, v, acc), rtol=1e-9)


def test_rods_and_ankles_that_are_described_otherwise():
    """A ball of three hinges without masses between them, and an ankle whose cross is a universal joint: the map is the same."""
    text = (ROBOTS / "two_rod_ankle.urdf").read_text()
    hinges, universal = text, text
    for side in ("left", "right"):
        top = re.search(rf'<joint name="ball_{side}_top".*?</joint>', text, re.DOTALL)[0]
        names = [f"crank_{side}", f"{side}_1", f"{side}_2", f"rod_{side}"]
        ball = "".join(f'<link name="{name}"/>' for name in names[1:3])
        for k, axis in enumerate(("1 0 0", "0 1 0", "0 0 1")):
            ball += f'<joint name="{side}_{axis}" type="continuous"><parent link="{names[k]}"/><child link="{names[k + 1]}"/>'
            ball += f'<origin xyz="{"-0.05 0 0" if k == 0 else "0 0 0"}"/><axis xyz="{axis}"/></joint>'
        hinges = hinges.replace(top, ball)
    universal = re.sub('<joint name="ankle_(pitch|roll)".*?</joint>|<link name="cross">.*?</link>', "", universal, flags=re.DOTALL)
    both = '<joint name="ankle" type="universal"><parent link="shank"/><child link="foot"/><origin xyz="0 0 -0.32"/><axis xyz="0 1 0"/><axis2 xyz="1 0 0"/></joint></robot>'
    welded = text.replace('<link name="rod_left">', '<link name="rod_left"/><link name="bar">').replace('<parent link="rod_left"/>', '<parent link="bar"/>')
    welded = welded.replace("</robot>", '<joint name="weld" type="fixed"><parent link="rod_left"/><child link="bar"/></joint></robot>')
    light = re.sub(r'<link name="rod_right">.*?</link>', '<link name="rod_right"/>', welded, flags=re.DOTALL)
    for other in (welded, light):  # a rod without a mass is one by the loop that ends at it, and one whose mass and loop are at a link that is welded to it
        found = ksl.load_string(other).actuation(JOINTS["two_rod_ankle"])
        assert [rod.link for rod in found.equations.rods] == ["rod_left", "rod_right"]
        own_inverse_dynamics(found, found.usable(3))
    a, b, c = (
        leg("two_rod_ankle"),
        ksl.load_string(hinges).actuation(JOINTS["two_rod_ankle"]),
        ksl.load_string(universal.replace("</robot>", both)).actuation(["ankle"]),
    )
    q = a.usable(10)
    v, acc = np.random.default_rng(1).normal(size=(2, *q.shape))
    assert [rod.link for rod in b.equations.rods] == ["rod_left", "rod_right"]
    assert_allclose(b.motor_efforts(q, v, acc), a.motor_efforts(q, v, acc), rtol=1e-10, atol=1e-12)
    own_inverse_dynamics(b, q)
    assert_allclose(ksl.load_string(welded).actuation(JOINTS["two_rod_ankle"]).motor_efforts(q, v, acc), a.motor_efforts(q, v, acc), rtol=1e-10, atol=1e-12)
    for other in (b, c):
        assert_allclose(other.motors_of(q), a.motors_of(q), atol=1e-12)
        assert_allclose(other.jacobian_rate(q, v), a.jacobian_rate(q, v), atol=1e-11)
    with pytest.raises(ValueError, match="joint 'ankle' is universal, and its armature"):
        c.serial_model()


def test_another_assembly_by_its_start():
    """The knee with its crank turned over."""
    a = leg("four_bar_knee")
    m = a.model
    other = m.branches(a.start, hold=["knee", "hip_pitch"])[-1]
    assert abs(other - a.start).max() > 0.5
    assert_allclose(a.motors_of([0.0], start=other), other[m.joint("knee_motor").q_index], atol=1e-9)
    assert isinstance(m.actuation(["knee"], start=other), ksl.Actuation)


def test_a_motion_of_motors_alone_has_the_efforts_of_the_map(tmp_path):
    """Rods turn idly, so that two columns say where a mechanism of four freedoms is."""
    a, t = leg("two_rod_ankle"), np.linspace(0, 1, 41)
    theta = np.stack([0.2 * np.sin(3 * t), 0.1 * np.sin(4 * t)], axis=1)
    (tmp_path / "motors.csv").write_text("time,motor_left,motor_right\n" + "".join(f"{x},{l},{r}\n" for x, (l, r) in zip(t, theta)))
    motion = ksl.read_motion(a.model, tmp_path / "motors.csv")
    columns = [[getattr(a.model.joint(name), index) for name in a.joints] for index in ("q_index", "v_index")]
    q, v, acc = motion.q[:, columns[0]], motion.v[:, columns[1]], motion.a[:, columns[1]]
    assert_allclose(a.joints_of(theta), q, atol=1e-9)
    efforts = a.model.inverse_dynamics(motion.q, motion.v, motion.a)[:, [a.model.joint(name).v_index for name in a.motors]]
    assert_allclose(efforts, a.motor_efforts(q, v, acc), rtol=1e-6, atol=1e-9)
