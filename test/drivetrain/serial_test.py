"""The serial model: what is exact, what is best, and that KSL and MuJoCo read from its files the same numbers."""

import re
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import ksl
from examples import JOINTS, ROBOTS, leg, model
from ksl.drivetrain.least_squares import not_negative
from ksl.drivetrain.region import usable_ranges

AT = {"two_rod_ankle": [0.1, -0.1], "four_bar_knee": [0.4], "differential_wrist": [0.02, 1.0], "three_rod_platform": [0.01, 0.05, -0.1]}


def first_moment(m, Q):
    """Of all links, those on the ground included, kg m."""
    return sum(m.frame_pose(Q, link.name)[:3, :3] @ link.first_moment + link.mass * m.frame_pose(Q, link.name)[:3, 3] for link in m.links)


def at_joints(serial, names, x):
    out = np.zeros((*np.shape(x)[:-1], serial.nv))
    out[..., [serial.joint(name).v_index for name in names]] = x
    return out


@pytest.mark.parametrize("name", JOINTS)
def test_what_is_exact_at_its_place(name):
    a, q = leg(name), np.array(AT[name])
    serial = a.serial_model(at=q)
    assert set(a.with_rotors.model.physics) == {*a.model.physics, "rotor", "armature"} and a.with_rotors.with_rotors is a.with_rotors
    assert serial.loop_names == [] and set(a.joints) <= set(serial.joint_names) and "armature" in serial.physics
    Q, S = a.state(q)[0], at_joints(serial, a.joints, q)
    assert_allclose(serial.mass, a.model.mass, rtol=1e-12)
    assert_allclose(first_moment(serial, S), first_moment(a.model, Q), atol=1e-10)
    B = a.equations.motions(Q[None], [a.model.joint(joint).v_index for joint in a.joints])[0]
    closed = B.T @ a.model.with_physics(["rotor", "armature"]).without_loops().mass_matrix(Q) @ B
    own = [serial.joint(joint).v_index for joint in a.joints]
    assert_allclose(np.diag(serial.mass_matrix(S))[own], np.diag(closed), rtol=1e-10)


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_small_and_large_legs_are_as_exact(size):
    """Masses by the cube of the size, inertias by its fifth power."""
    text = (ROBOTS / "two_rod_ankle.urdf").read_text()
    times = lambda power: lambda found: found[1] + " ".join(repr(size**power * float(x)) for x in found[2].split()) + '"'
    for what, power in (
        (r"(<origin xyz=\")([^\"]*)\"", 1),
        (r"(_origin xyz=\")([^\"]*)\"", 1),
        (r"(<mass value=\")([^\"]*)\"", 3),
        (r"(\bi[xyz]{2}=\")([^\"]*)\"", 5),
    ):
        text = re.sub(what, times(power), text)
    a, q = ksl.load_string(text).actuation(JOINTS["two_rod_ankle"]), np.array(AT["two_rod_ankle"])
    serial = a.serial_model(at=q)
    assert_allclose(serial.mass, a.model.mass, rtol=1e-12)
    assert_allclose(first_moment(serial, at_joints(serial, a.joints, q)), first_moment(a.model, a.state(q)[0]), atol=1e-12 * a.model.mass * size)


@pytest.mark.parametrize("name", ["two_rod_ankle", "four_bar_knee"])
def test_efforts_near_its_place_are_better_than_without_rods(name):
    a, q = leg(name), np.array(AT[name])
    serial, rng = a.serial_model(at=q), np.random.default_rng(0)
    states = q + rng.uniform(-0.15, 0.15, (60, len(q))), rng.normal(size=(60, len(q))), 30 * rng.normal(size=(60, len(q)))
    e = a.serial_errors(serial, *states)
    assert (e.root_mean_square < 0.2 * e.naive_root_mean_square).all() and (e.mean <= e.root_mean_square).all() and (e.root_mean_square <= e.largest).all()
    own = [serial.joint(joint).v_index for joint in a.joints]
    errors = serial.inverse_dynamics(*(at_joints(serial, a.joints, x) for x in states))[:, own] - a.static_joint_efforts(
        states[0], a.with_rotors.motor_efforts(*states)
    )
    assert_allclose(e.largest, np.abs(errors).max(axis=0), rtol=1e-10)


def test_limits():
    """The safe box keeps the motors' limits at every position, and the mean is no smaller."""
    a = leg("two_rod_ankle")
    safe, mean = a.serial_model(), a.serial_model(limits="mean")
    tau = np.array([safe.joint(joint).effort for joint in a.joints])
    q = a.usable(200)
    for signs in ((1, 1), (1, -1)):
        assert (np.abs(a.static_motor_efforts(q, np.broadcast_to(tau * signs, q.shape))) <= 36.5).all()
    assert all(mean.joint(joint).effort >= safe.joint(joint).effort for joint in a.joints)
    assert_allclose([safe.joint("ankle_pitch").damping, safe.joint("ankle_roll").damping], [2 * 0.02, 2 * 0.02 * 0.8**2], rtol=1e-12)


def test_positions_end_where_they_are_used(monkeypatch):
    """But for a joint that turns without an end."""
    monkeypatch.setattr("ksl.drivetrain.serial.SAMPLES", 20)
    text = (ROBOTS / "four_bar_knee.urdf").read_text()
    for kind in ("revolute", "continuous"):
        a = ksl.load_string(text.replace('name="knee" type="revolute"', f'name="knee" type="{kind}"')).actuation(["knee"])
        joint = a.serial_model().joint("knee")
        ends = usable_ranges(a, a.start[a.of_joints])[0] if kind == "revolute" else (None, None)
        assert (joint.kind, joint.lower, joint.upper) == (kind, *ends)


@pytest.mark.parametrize("name", ["two_rod_ankle", "four_bar_knee"])
def test_files(name, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    a = leg(name)
    serial = a.serial_model()
    ksl.mjcf.write(serial, tmp_path / "serial.xml")
    serial.to_urdf(tmp_path / "serial.urdf")
    q = serial.random(1)
    mj = mujoco.MjModel.from_xml_path(str(tmp_path / "serial.xml"))
    d, M = mujoco.MjData(mj), np.zeros((serial.nv, serial.nv))
    d.qpos[:] = q
    mujoco.mj_forward(mj, d)
    mujoco.mj_fullM(mj, d, M)
    want = serial.with_physics(["rotor", "armature"]).mass_matrix(q)
    assert_allclose(M, want, rtol=1e-9, atol=1e-12)
    assert_allclose(d.qfrc_bias, serial.gravity_torque(q), rtol=1e-9, atol=1e-10)
    for joint in a.joints:
        assert_allclose(mj.jnt_actfrcrange[mj.joint(joint).id], [-serial.joint(joint).effort, serial.joint(joint).effort])
    assert_allclose(ksl.load(tmp_path / "serial.urdf", physics=serial.physics).mass_matrix(q), serial.mass_matrix(q), rtol=1e-12)


@pytest.mark.parametrize("name", ["two_rod_ankle", "four_bar_knee", "three_rod_platform"])
def test_the_closed_mechanism_as_mjcf(name, tmp_path):
    """Its constraints are closed where KSL's are, and its drives are the same."""
    pytest.importorskip("mujoco")
    m = model(name)
    ksl.mjcf.write(m, tmp_path / "closed.xml")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)  # that two points are read as one hinge
        again = ksl.load(tmp_path / "closed.xml")
    Q = leg(name).state(leg(name).usable(4))[0]
    assert again.joint_names == m.joint_names and again.drives == m.drives
    assert np.abs(again.loop_error(Q)).max() < 1e-9
    assert_allclose(again.without_loops().gravity_torque(Q), m.without_loops().gravity_torque(Q), atol=1e-10)


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
@pytest.mark.parametrize("seed", range(6))
def test_masses_are_those_of_least_squares(seed, scale):
    """Conditions of Karush, Kuhn and Tucker: the gradient is a sum of the equations' rows and of pushes on numbers that are zero, which push up."""
    rng = np.random.default_rng(seed)
    A, b, equal = rng.normal(size=(40, 9)), scale * rng.normal(size=40), rng.normal(size=(3, 9))
    right = equal @ np.maximum(scale * rng.normal(size=9), 0)
    x = not_negative(A, b, equal, right)
    assert_allclose(equal @ x, right, atol=1e-11 * max(scale, 1))
    gradient, used = A.T @ (A @ x - b), x > 0
    multipliers, *_ = np.linalg.lstsq(equal[:, used].T, gradient[used], rcond=None)
    push = gradient - equal.T @ multipliers
    assert x.min() == 0 and np.abs(push[used]).max() < 1e-9 * scale and push[~used].min() > 0
    assert not_negative(A, b, np.ones((1, 9)), np.array([-scale])) is None, "sums of what is not negative"


def test_loops_that_mjcf_lacks():
    with pytest.raises(ValueError, match="loop joint screw: MJCF has no constraint that is a helical joint"):
        ksl.mjcf.text(model("differential_wrist"))


def test_a_robot_whose_file_has_its_floating_joint(monkeypatch):
    """As SDF files have: it isn't added once more.  One that is loaded with a floating base has it in the serial model, too."""
    monkeypatch.setattr("ksl.drivetrain.serial.SAMPLES", 40)
    text = (ROBOTS / "two_rod_ankle.urdf").read_text()
    root = model("two_rod_ankle").links[0].name
    joint = f'<link name="map"/><joint name="floating_base" type="floating"><parent link="map"/><child link="{root}"/></joint></robot>'
    for m in (ksl.load_string(text.replace("</robot>", joint)), ksl.load_string(text, floating_base=True)):
        found = m.actuation(JOINTS["two_rod_ankle"]).serial_model()
        assert [name for name in found.joint_names if "float" in name] == ["floating_base"] and found.nv == 8
