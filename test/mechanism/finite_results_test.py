"""Finite arguments give finite results, or an error that says why: overflow, or a joint that moves no mass."""

import math
import re
import warnings

import numpy as np
import pytest

import ksl
from linkages import four_bar

PANDA = "robots/panda.urdf"
INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
JOINT = '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="{4}"/><axis xyz="0 0 1"/>{5}</joint>'


def quietly_loaded(text: str, **options) -> ksl.Model:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)
        return ksl.load_string(text, **options)


@pytest.fixture(scope="module")
def massless_first() -> ksl.Model:
    """Two bars that turn about parallel axes, of which the first has no mass, and a point mass at the end: singular where it is straight."""
    point = '<inertial><origin xyz="1 0 0"/><mass value="2"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>'
    joints = JOINT.format("shoulder", "continuous", "ground", "upper", "0 0 0", "") + JOINT.format("elbow", "continuous", "upper", "lower", "1 0 0", "")
    return quietly_loaded(f'<robot name="bars"><link name="ground"/><link name="upper"/><link name="lower">{point}</link>{joints}</robot>')


@pytest.mark.parametrize("n", [None, 1, 5, 200])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_overflow_is_an_error_that_names_result_and_state(examples, n, dtype):
    m = ksl.load(examples / PANDA)
    q = np.tile(m.neutral().astype(dtype), (n, 1) if n else 1)
    v, bad = np.zeros_like(q), np.zeros_like(q)
    bad[(n - 1) if n else ...] = 1e200 if dtype == np.float64 else 1e30
    with pytest.raises(ksl.ResultError, match=r"inverse_dynamics: .*tau\[\d\] is -?(nan|inf), although all arguments are finite.* precision") as caught:
        m.inverse_dynamics(q, bad, v)
    if n and n > 1:
        assert f"state {n - 1}: " in str(caught.value)
    assert caught.value.state == (n or 1) - 1
    assert isinstance(caught.value, ValueError)
    assert np.isfinite(m.inverse_dynamics(q, v, v)).all()


def test_gravity_that_is_too_large(examples):
    m = ksl.load(examples / PANDA, gravity=(0, 0, 1e308))
    with pytest.raises(ksl.ResultError, match="gravity_torque: tau"):
        m.gravity_torque(m.neutral())
    with pytest.raises(ksl.ResultError, match="single precision"):
        ksl.load(examples / PANDA, gravity=(0, 0, 1e39)).gravity_torque(m.neutral().astype(np.float32))


@pytest.mark.parametrize("angle", [0.0, math.pi, -math.pi])
def test_a_joint_without_inertia_at_one_position_is_named(massless_first, angle):
    """Also where rounding leaves it 1e-17 instead of zero."""
    m = massless_first
    assert m.warnings == ()
    q, v, tau = np.array([0.3, angle]), np.array([1.0, 2.0]), np.array([1.0, -1.0])
    for call in (m.forward_dynamics, m.forward_dynamics_derivatives, m.forward_dynamics_by_mass_matrix):
        with pytest.raises(ksl.ResultError, match="joint shoulder, at this position, can move without moving any mass"):
            call(q, v, tau)
        good = np.tile([0.3, 1.0], (40, 1))
        good[17] = q
        with pytest.raises(ksl.ResultError, match="state 17: joint shoulder"):
            call(good, np.tile(v, (40, 1)), np.tile(tau, (40, 1)))
    for call in (m.mass_matrix_inverse, lambda q: m.solve_mass_matrix(q, tau)):
        with pytest.raises(ksl.ResultError, match="joint shoulder"):
            call(q)
    assert np.isfinite(m.forward_dynamics([0.3, 1.0], v, tau)).all()
    assert np.isfinite(m.inverse_dynamics(q, v, tau)).all()


def test_the_model_warns_when_it_is_loaded():
    text = f'<robot name="r"><link name="ground"/><link name="a">{INERTIAL}</link><link name="tip"/>' + (
        JOINT.format("first", "continuous", "ground", "a", "0 0 0", "") + JOINT.format("last", "continuous", "a", "tip", "1 0 0", "") + "</robot>"
    )
    with pytest.warns(ksl.DescriptionWarning, match="forward dynamics are refused: joint last can move without moving any mass.* tip or a link beyond"):
        m = ksl.load_string(text)
    assert sum("joint last" in line for line in m.warnings) == 1
    assert m.with_payload("tip", 1.0, (0.1, 0, 0)).warnings == ()
    assert sum("joint last" in line for line in m.with_gravity((0, 0, 0)).warnings) == 1
    none = quietly_loaded(text.replace(INERTIAL, ""), masses="optional")
    assert not any("forward dynamics" in line for line in none.warnings), "for kinematics only"


FAR = [[1, 0, 0, 1e308], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
HUGE = (1e308, [1e308] * 3, np.full((3, 3), 1e308))


@pytest.mark.parametrize("given", [{"point": (1e308, 1e308, 0)}, {"share": HUGE}, {"point": (1e308, 1e308, 0), "axes": "world", "order": "ang_lin"}])
def test_a_section_that_is_too_far_or_too_heavy(examples, given):
    m = ksl.load(examples / "robots/ur5.urdf")
    q = np.full(m.nq, 0.3)
    whole = {"name": "forearm_link", "point": (0, 0, 0.1), "normal": (0, 0, 1)}
    assert np.isfinite(m.section_wrench(q, q, q, **whole)).all()
    with (
        warnings.catch_warnings(),
        pytest.raises(ksl.ResultError, match=r"section_wrench: wrench\[\d\] is -?(nan|inf), although all arguments are finite") as caught,
    ):
        warnings.simplefilter("error")
        m.section_wrench(q, q, q, **whole | given)
    assert caught.value.state == 0
    with pytest.raises(ksl.ResultError, match="section_wrench: state 0: wrench"):
        m.section_wrench(np.stack([q, q]), q, q, **whole | given)
    with pytest.raises(ksl.ResultError):
        m.section_wrench(q, np.full(m.nv, 1e200), q, **whole)


def test_a_target_whose_distance_has_no_square(examples):
    m = ksl.load(examples / "robots/ur5.urdf")
    with pytest.raises(ksl.ResultError, match=r"inverse_kinematics: error\[0\] is inf, .* double precision"):
        m.inverse_kinematics("tool0", FAR)
    with pytest.raises(ksl.ResultError, match=r"inverse_kinematics: state 1: error\[0\] is inf") as caught:
        m.inverse_kinematics("tool0", [np.eye(4), FAR])
    assert caught.value.state == 1
    single = np.eye(4, dtype=np.float32)
    single[0, 3] = 1e30
    with pytest.raises(ksl.ResultError, match="single precision"):
        m.inverse_kinematics("tool0", single)


def test_random_positions_between_limits_whose_difference_is_infinite():
    slide = JOINT.format("slide", "prismatic", "ground", "car", "0 0 0", '<limit lower="-1.7e308" upper="1.7e308" effort="1" velocity="1"/>')
    m = ksl.load_string(f'<robot name="r"><link name="ground"/><link name="car">{INERTIAL}</link>{slide}</robot>')
    q = m.random(1, 100)
    assert (np.abs(q) <= 1.7e308).all() and q.min() < -1e308 and q.max() > 1e308


LARGE = four_bar().close([-1.0, 0.4, -1.5]).q, np.array([8.0, 0, 0]), np.array([1.0, 0, 0])
CLOSED_CALLS = {
    "forward_dynamics": (lambda m, q, v, x: m.forward_dynamics(q, v, x), "tau"),
    "stabilised": (lambda m, q, v, x: m.forward_dynamics(q, v, x, stabilise=20.0), "tau"),
    "inverse_dynamics": (lambda m, q, v, x: m.inverse_dynamics(q, v, x), "a"),
    "reactions": (lambda m, q, v, x: m.reactions(q, v, x), "a"),
    "effort_parts": (lambda m, q, v, x: m.effort_parts(q, v, x), "a"),
    "velocity_jump": (lambda m, q, v, x: m.velocity_jump(q, {"rocker": np.tile(np.asarray(x)[..., :1], 6)}), "tau"),
    "loop_acceleration": (lambda m, q, v, x: m.loop_acceleration(q, v, x), "a"),
    "consistent_acceleration": (lambda m, q, v, x: m.consistent_acceleration(q, v, x, given=["A"]), "a"),
    "forward_dynamics_derivatives": (lambda m, q, v, x: m.forward_dynamics_derivatives(q, v, x), "tau"),
    "inverse_dynamics_derivatives": (lambda m, q, v, x: m.inverse_dynamics_derivatives(q, v, x), "a"),
    "reactions_derivatives": (lambda m, q, v, x: m.reactions_derivatives(q, v, x, undetermined="nan"), "a"),
    "inverse_dynamics_regressor": (lambda m, q, v, x: m.inverse_dynamics_regressor(q, v, x), "a"),
}


def heavy(factor: float) -> ksl.Model:
    m = four_bar()
    return m.with_parameters({name: factor * np.asarray(m.parameters)[m.link_names.index(name)] for name in ("crank", "coupler", "rocker")})


@pytest.mark.parametrize("size", [1e150, 1e200, 1e300])
@pytest.mark.parametrize("name", CLOSED_CALLS)
def test_overflow_of_closed_mechanisms(name, size):
    """Numbers that are finite, or a sentence; of velocities, of efforts and accelerations, and of masses."""
    call, last = CLOSED_CALLS[name]
    m, (q, v, a) = four_bar(), LARGE
    v = m.consistent_velocity(q, v, given=["A"])
    fast = size * v
    for model, state in ((m, (q, fast, a)), (m, (q, v, size * a)), (m, (q, fast, size * a)), (heavy(size), (q, v, a)), (m, (size * q, v, a))):
        for several in (False, True):
            with np.errstate(all="ignore"):
                try:
                    found = call(model, *([x] * 3 if several else x for x in state))
                except (ksl.ResultError, ValueError) as e:
                    assert re.search(
                        r"overflow|too large|give smaller|open it by|is open at this position|no motion of the closed|keep the loops closed", str(e)
                    ), str(e)
                    continue
            numbers = np.concatenate([np.ravel(x) for x in (found if isinstance(found, (tuple, list)) else [found])])
            assert np.isfinite(numbers).all() or name == "reactions_derivatives"
    for bad in (None, [None] * 3, "x") if name != "velocity_jump" else ():
        with pytest.raises((ValueError, TypeError), match="q|v|a|tau|number"):
            call(m, q, v, bad)
