"""The physics of joints as users ask for it: options, fields, files, models made from models, refusals, the loads table."""

import json
import pickle

import numpy as np
import pytest

import ksl

ALL = ("damping", "friction", "armature", "rotor", "spring", "force elements")
SHOULDER = {"damping": 0.3, "friction": 1.5, "friction_width": 0.2, "armature": 0.02, "rotor_inertia": 1e-5, "gear_ratio": 100.0}
ELBOW = {"damping": 0.1, "friction": 0.4, "rotor_inertia": 2e-4, "gear_ratio": -30.0, "spring_stiffness": 7.0, "spring_rest": 0.2}
Q, V, A = np.array([0.8, -1.9]), np.array([2.1, -0.6]), np.array([-1.7, 0.4])


def arm() -> ksl.Builder:
    b = ksl.Builder("arm")
    b.add_link("base").add_link("upper", 1.3, (0.1, 0, -0.4), 0.03 * np.eye(3)).add_link("lower", 0.7, (0, 0.05, -0.3), 0.02 * np.eye(3))
    elbow = np.eye(4)
    elbow[:3, 3] = 0.1, 0.0, -0.8
    b.add_joint("shoulder", "revolute", "base", "upper", axis=(0, 1, 0), **SHOULDER)
    return b.add_joint("elbow", "revolute", "upper", "lower", elbow, axis=(1, 2, 0.5), **ELBOW)


def numbers_of(joint: ksl.Joint, given: dict[str, float]) -> dict[str, float]:
    return {name: getattr(joint, name) for name in given}


def test_nothing_is_on_unless_it_is_named():
    m = arm().build()
    assert m.physics == () and m.friction_width == 0.01
    assert numbers_of(m.joint("shoulder"), SHOULDER) == SHOULDER and numbers_of(m.joint("elbow"), ELBOW) == ELBOW
    assert m.unused == (
        "joint shoulder, elbow: damping, friction, rotor (read, not applied)",
        "joint shoulder: armature (read, not applied)",
        "joint elbow: spring (read, not applied)",
    )
    assert not m.effort_parts(Q, V, A)[1:].any()
    np.testing.assert_array_equal(m.effort_part(Q, V, A, "transmitted"), m.inverse_dynamics(Q, V, A))


@pytest.mark.parametrize("names", ["spring", ["damping", "friction"], ("exact friction",), ("rotor bodies", "spring"), "all", []])
def test_a_model_tells_what_is_on(names):
    built, changed = arm().build(physics=names, friction_width=0.3), arm().build().with_physics(names, 0.3)
    wanted = ALL if names == "all" else (names,) if isinstance(names, str) else tuple(names)
    for m in (built, changed, pickle.loads(pickle.dumps(built)), built.with_physics("all").with_physics(names, 0.3)):
        assert m.physics == wanted and m.friction_width == 0.3
        assert m.unused == built.unused and m.link_names == built.link_names
        np.testing.assert_array_equal(m.inverse_dynamics(Q, V, A), built.inverse_dynamics(Q, V, A))
    assert built.with_physics(None).unused == arm().build().unused


def test_wrong_names_are_refused_with_the_list():
    listed = "expected some of all, damping, friction, exact friction, armature, rotor, rotor bodies, spring, force elements; did you mean"
    with pytest.raises(ksl.DescriptionError, match=f'physics "dampin" is unknown, {listed} "?damping'):
        arm().build(physics=["spring", "dampin"])
    with pytest.raises(ValueError, match="expected names, for example"):
        arm().build().with_physics([1])
    with pytest.raises(ksl.DescriptionError, match="friction_width is 0; expected the speed"):
        arm().build(physics="friction", friction_width=0)


def test_parts_follow_their_laws():
    m = arm().build(physics="all", friction_width=0.01)
    friction = np.array([1.5, 0.4]) * V / np.sqrt(V**2 + np.array([0.2, 0.01]) ** 2)
    expected = {
        "transmitted": arm().build().inverse_dynamics(Q, V, A),
        "damping": [0.3, 0.1] * V,
        "friction": friction,
        "rotor": [0.02 + 1e-5 * 100**2, 2e-4 * 30**2] * A,
        "spring": [0, 7 * (Q[1] - 0.2)],
    }
    for part, efforts in expected.items():
        np.testing.assert_allclose(m.effort_part(Q, V, A, part), efforts, rtol=1e-14, atol=1e-16)
    np.testing.assert_allclose(m.inverse_dynamics(Q, V, A), sum(map(np.array, expected.values())), rtol=1e-14)
    np.testing.assert_array_equal(m.effort_part(Q, V, A), m.inverse_dynamics(Q, V, A))
    with pytest.raises(ValueError, match="part='motors'"):
        m.effort_part(Q, V, A, "motors")


def test_efforts_may_be_written_over_any_argument():
    m = arm().build(physics="all")
    for i in range(3):
        given = [Q.copy(), V.copy(), A.copy()]
        np.testing.assert_array_equal(m.inverse_dynamics(*given, out=given[i]), m.inverse_dynamics(Q, V, A))


def test_exact_friction_is_for_inverse_dynamics_only():
    m = arm().build(physics=["exact friction", "damping"])
    np.testing.assert_array_equal(m.effort_part(Q, V, A, "friction"), [1.5, -0.4])
    np.testing.assert_array_equal(m.effort_part(Q, [1e-9, 0], A, "friction"), [1.5, 0])
    assert m.mass_matrix(Q).shape == (2, 2) and m.bias(Q, V).shape == (2,)
    calls = {
        "forward_dynamics": lambda: m.forward_dynamics(Q, V, A),
        "forward_dynamics_by_mass_matrix": lambda: m.forward_dynamics_by_mass_matrix(Q, V, A),
        "inverse_dynamics_derivatives": lambda: m.inverse_dynamics_derivatives(Q, V, A),
        "inverse_dynamics_gradient": lambda: m.inverse_dynamics_gradient(Q, V, A, A),
        "forward_dynamics_derivatives": lambda: m.forward_dynamics_derivatives(Q, V, A),
        "inverse_dynamics_second_derivatives": lambda: m.inverse_dynamics_second_derivatives(Q, V, A),
        "forward_dynamics_second_derivatives": lambda: m.forward_dynamics_second_derivatives(Q, V, A),
        "operational_space": lambda: m.operational_space(Q, V, ["lower"]),
    }
    for name, call in calls.items():
        with pytest.raises(ValueError, match=f'^{name}: exact dry friction jumps at rest, .* take the smooth law, "friction", with a width'):
            call()


def test_models_made_from_models_keep_it(tmp_path):
    m = arm().build(physics="all", friction_width=0.05)
    with pytest.warns(ksl.DescriptionWarning, match="rotor bodies"):  # of another root
        turned = m.with_root("lower")
    held, double = m.with_frozen_joints({"elbow": -1.9}), m.merged(m, "lower", prefix="second_")
    for other in (turned, held, double, m.subtree("upper"), m.with_payload("lower", 1.0), m.with_frame("tip", "lower")):
        assert other.physics == ALL and other.friction_width == 0.05
    np.testing.assert_allclose(turned.effort_parts(Q[::-1], V[::-1], A[::-1])[1:, ::-1], m.effort_parts(Q, V, A)[1:], rtol=1e-14)
    np.testing.assert_allclose(held.effort_parts(Q[:1], V[:1], A[:1])[1:], m.effort_parts(Q, V, A)[1:, :1], rtol=1e-14)
    assert numbers_of(double.joint("second_elbow"), ELBOW) == ELBOW
    m.to_urdf(tmp_path / "arm.urdf")
    again = ksl.load(tmp_path / "arm.urdf", physics="all", friction_width=0.05)
    assert again.joints == m.joints and again.unused == m.unused == ()
    np.testing.assert_allclose(again.effort_parts(Q, V, A), m.effort_parts(Q, V, A), rtol=1e-12)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(again)).effort_parts(Q, V, A), again.effort_parts(Q, V, A))


DRAKE = """<robot name="arm" xmlns:drake="http://drake.mit.edu"><link name="base"/><link name="rod"><inertial><origin xyz="0 0 -1"/>
<mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>{dynamics}</joint>
<transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="{joint}"/>
<actuator name="motor"><drake:rotor_inertia value="1e-4"/><drake:gear_ratio value="50"/></actuator></transmission></robot>"""


def drake(path, dynamics: str = "", joint: str = "hinge") -> ksl.Model:
    (path / "arm.urdf").write_text(DRAKE.format(dynamics=dynamics, joint=joint))
    return ksl.load(path / "arm.urdf", physics="rotor")


def test_rotors_as_drake_writes_them(tmp_path):
    m = drake(tmp_path)
    assert (m.joint("hinge").rotor_inertia, m.joint("hinge").gear_ratio) == (1e-4, 50)
    assert m.mass_matrix([0.3])[0, 0] == pytest.approx(3 + 1e-4 * 2500, rel=1e-15)
    assert drake(tmp_path, '<dynamics rotor_inertia="1e-4" gear_ratio="50"/>').unused == ("transmission (1)",)
    other = drake(tmp_path, '<dynamics rotor_inertia="1e-4" gear_ratio="20"/>')
    assert other.joint("hinge").gear_ratio == 20
    assert "joint hinge: drake:rotor_inertia, drake:gear_ratio (differs from <dynamics>, which is used)" in other.unused
    with pytest.raises(ksl.DescriptionError, match='its actuator has a rotor, and its joint "knee" does not exist'):
        drake(tmp_path, joint="knee")


def test_a_rotor_on_the_ground_is_reflected_inertia():
    """The first joint's parent doesn't turn, so that there is no other effect of its rotor."""
    bodies, reflected = (arm().build().with_frozen_joints({"elbow": -1.9}).with_physics(name) for name in ("rotor bodies", "rotor"))
    assert bodies.follower_names == ["shoulder_rotor"] and bodies.joint("shoulder_rotor").is_rotor
    q, v, a = Q[:1], V[:1], A[:1]
    parts, expected = bodies.effort_parts(q, v, a), reflected.effort_parts(q, v, a)
    np.testing.assert_allclose(parts, expected, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(bodies.mass_matrix(q), reflected.mass_matrix(q), rtol=1e-14)


def test_the_rotor_of_a_frozen_joint_turns_with_the_link_that_holds_it():
    """With ½ I (ω · z)², as it does where its joint is at rest."""
    z = np.array([1, 2, 0.5]) / np.linalg.norm([1, 2, 0.5])
    frozen, plain = (arm().build(physics=name).with_frozen_joints({"elbow": -1.9}) for name in ("rotor bodies", None))
    rotors = frozen.mass_matrix(Q[:1]) - plain.mass_matrix(Q[:1])
    np.testing.assert_allclose(rotors, [[1e-5 * 100**2 + 2e-4 * z[1] ** 2]], rtol=1e-12)


def test_a_rotor_turns_with_its_parent_link():
    """½ I (N q̇ + ω · z)² of each rotor, ω being that of the joint's parent link, and Lagrange's equations with it."""
    plain, bodies = arm().build(), arm().build(physics="rotor bodies")
    z = np.array([1, 2, 0.5]) / np.linalg.norm([1, 2, 0.5])
    spins = np.array([100 * V[0], -30 * V[1] + V[0] * z[1]])
    rotors = 0.5 * np.array([1e-5, 2e-4]) @ spins**2
    assert bodies.energy(Q, V)[0] - plain.energy(Q, V)[0] == pytest.approx(rotors, rel=1e-13)
    assert bodies.energy(Q, V)[1] == plain.energy(Q, V)[1]
    per_v = np.array([[100, 0], [z[1], -30]])
    inertia = per_v.T @ np.diag([1e-5, 2e-4]) @ per_v  # constant, since the upper arm turns about one fixed axis
    np.testing.assert_allclose(bodies.mass_matrix(Q) - plain.mass_matrix(Q), inertia, rtol=1e-11, atol=1e-16)
    np.testing.assert_allclose(bodies.effort_part(Q, V, A, "rotor")[1], -30 * 2e-4 * (-30 * A[1] + z[1] * A[0]), rtol=1e-13)
    np.testing.assert_allclose(bodies.inverse_dynamics(Q, V, A) - plain.inverse_dynamics(Q, V, A), inertia @ A, rtol=1e-11)
    np.testing.assert_allclose(bodies.forward_dynamics(Q, V, bodies.inverse_dynamics(Q, V, A)), A, rtol=1e-11)
    assert "_rotor" not in bodies.to_urdf()
    back = bodies.with_physics(None)
    assert back.link_names == plain.link_names and back.joints == plain.joints
    np.testing.assert_array_equal(back.inverse_dynamics(Q, V, A), plain.inverse_dynamics(Q, V, A))


@pytest.mark.parametrize("physics", ["all", ("damping", "exact friction", "rotor bodies", "spring")])
def test_the_table_splits_the_effort_and_the_power_balances(physics):
    from ksl.load_cases.curves import Curves
    from ksl.load_cases.load_case import LoadCase
    from ksl.motions.motion import Motion

    m = arm().build(physics=physics, friction_width=0.5)
    t = np.linspace(0, 2, 801)
    angle = np.array([1.3, -2.2]) * t[:, None]
    q, v, a = np.sin(angle), np.array([1.3, -2.2]) * np.cos(angle), -(np.array([1.3, -2.2]) ** 2) * np.sin(angle)
    table = m.wrench_table(t, q, v, a, external={"lower": [1, 2, 3, 0.1, 0.2, 0.3]})
    columns = {name: np.array(table[name].to_pylist(), dtype=float) for name in ("effort", "transmitted", "damping", "friction", "rotor", "spring")}
    own = np.array(table["joint"].to_pylist()) == "elbow"
    np.testing.assert_allclose(sum(x[own] for name, x in columns.items() if name != "effort"), columns["effort"][own], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(columns["damping"][own], 0.1 * v[:, 1], rtol=1e-14)
    np.testing.assert_allclose(columns["spring"][own], 7 * (q[:, 1] - 0.2), rtol=1e-14)
    assert "physics" in str(table.schema.metadata[b"ksl"])

    wrenches = {"lower": np.broadcast_to([1, 2, 3, 0.1, 0.2, 0.3], (len(t), 6))}
    curves = Curves(LoadCase(m, Motion(t, q, v, a, [], []), external=wrenches))
    for block in curves.case.blocks():
        curves.add(block)
    balance = curves.power_balance()
    assert balance.relative_residual < 1e-8 and (balance.dissipation >= 0).all()
    assert abs(balance.dissipation).max() > 0.1 * balance.largest_power and abs(balance.external).max() > 1e-2 * balance.largest_power


def test_a_table_without_physics_is_as_ever():
    m, t = arm().build(), np.linspace(0, 1, 20)
    table = m.wrench_table(t, np.sin(np.outer(t, [1, 2])))
    assert table.column_names[-7:] == ["speed", "acceleration", "effort", "power", "on", "at", "axes"]
    assert json.loads(table.schema.metadata[b"ksl"])["cases"][0]["physics"] == []


def test_nothing_on_a_rotor_is_lost_or_moved_to_another_link_when_rotors_go():
    m = arm().build(physics="rotor bodies")
    for on_rotor, sentence in (
        (
            lambda: m.with_frame("tip", "shoulder_rotor"),
            'joint "tip_joint": its parent link "shoulder_rotor" is a rotor, which .* put the joint on another link',
        ),
        (lambda: m.with_payload("shoulder_rotor", 5.0), 'link "shoulder_rotor" is a rotor, which .* put that on another link'),
        (lambda: m.with_parameters({"elbow_rotor": np.r_[0, 0, 0, 0, 1, 0, 1, 0, 0, 1]}), 'link "elbow_rotor" is a rotor, which'),
    ):
        with pytest.raises(ksl.DescriptionError, match=sentence):
            on_rotor().with_physics(None)
    with pytest.raises(ksl.DescriptionError, match='link "shoulder_rotor" is the rotor of joint shoulder'):
        m.with_root("shoulder_rotor")


def test_rotors_cause_no_warning_of_their_own():
    m = arm().build(physics="rotor bodies")
    assert [name for name in m.link_names if name.endswith("_rotor")], "there are some"
    assert m.subtree(m.root).warnings == m.warnings == ()


@pytest.mark.parametrize(("plain", "refined"), [("friction", "exact friction"), ("rotor", "rotor bodies")])
def test_two_laws_for_the_same_are_refused(plain, refined):
    for names in ([plain, refined], [refined, "damping", plain]):
        with pytest.raises(ksl.DescriptionError, match=f'physics names both "{plain}" and "{refined}", two laws for the same thing; keep one'):
            arm().build(physics=names)
    assert refined in arm().build(physics=["all", refined]).physics


def test_rotors_stay_on_their_links_under_another_root_and_a_warning_tells_where_later_ones_are():
    bare = arm().add_link("cart", 2.0, inertia=np.eye(3)).add_joint("mount", "fixed", "base", "cart").build(floating_base=True)
    m = bare.with_physics("rotor bodies")
    q, v = np.r_[0, 0, 0, 0, 0, 0, 1, Q], np.r_[0.1, 0.2, 0.3, 3.0, 4.0, 5.0, V]
    for before in (m, bare):
        with pytest.warns(ksl.DescriptionWarning) as told:
            turned = before.with_root("lower")
        assert [str(w.message).split(";")[0].split(" have its rotor on ")[1] for w in told] == [
            "link upper in place of link base",
            "link lower in place of link upper",
        ]
        later = turned.with_physics(None).with_physics("rotor bodies")
        stays, moved = (x.energy(np.r_[q[:7], Q[::-1]], np.r_[m.frame_velocity(q, v, "lower"), V[::-1]])[0] for x in (turned, later))
        np.testing.assert_allclose(stays, before.energy(q, v)[0], rtol=1e-12)
        assert abs(moved - m.energy(q, v)[0]) > 1e-4
