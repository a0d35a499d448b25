"""Units of what is returned, at values so large that a small-angle formula or a wrong factor is seen: angles of some radians, metres, N m beside a closed form."""

import numpy as np
import pytest

import ksl
from ksl import ufuncs


@pytest.fixture(scope="module")
def arm():
    """A joint that turns by ±0.25 rad about z and one that slides to 40 m along x, with 2 kg at (3, 0, 0) m of the slider."""
    b = ksl.Builder("arm").add_link("ground").add_link("turntable").add_link("slider", 2.0, (3.0, 0.0, 0.0), np.zeros((3, 3)))
    b.add_joint("turn", "revolute", "ground", "turntable", axis=(0, 0, 1), limits=(-0.25, 0.25))
    return b.add_joint("slide", "prismatic", "turntable", "slider", axis=(1, 0, 0), limits=(0, 40)).build()


@pytest.fixture(scope="module")
def ball():
    b = ksl.Builder("ball").add_link("ground").add_link("ball", 1.0, (0, 0, 1), np.eye(3))
    return b.add_joint("socket", "spherical", "ground", "ball").build()


def about_z(angle, x=0.0):
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[0, 3] = x
    return pose


def turned(angle):
    return np.array([0, 0, np.sin(angle / 2), np.cos(angle / 2)])


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("angle", [0.5, 1.5, 3.0, -3.0])
def test_errors_of_inverse_kinematics_are_radians_and_metres(arm, angle, dtype):
    """3.0 rad gave 1.995, 2 sin(θ/2)."""
    found = arm.inverse_kinematics("turntable", about_z(angle).astype(dtype), np.array([np.sign(angle) * 0.25, 0], dtype), weights=(0, 1), starts=1)
    assert not found.converged and found.error[1] == pytest.approx(abs(angle) - 0.25, rel=1e-9 if dtype == np.float64 else 1e-4)
    far = arm.inverse_kinematics("slider", about_z(0, 90.0).astype(dtype), np.array([0, 40], dtype), weights=(1, 0), starts=1)
    assert far.error[0] == pytest.approx(50.0, rel=1e-6)


@pytest.mark.parametrize("tolerance", [0.1, 1.0, 2.5])
def test_the_tolerance_of_orientations_is_radians(arm, tolerance):
    for angle, within in ((0.25 + 0.99 * tolerance, True), (0.25 + 1.01 * tolerance, False)):
        found = arm.inverse_kinematics("turntable", about_z(angle), np.array([0.25, 0.0]), weights=(0, 1), tolerance=(1e-6, tolerance), starts=1)
        assert bool(found.converged) == within and (found.error[1] <= tolerance) == within


CLOSED_FORMS = {
    "difference, rad": (lambda a, b: b.difference(turned(0.0), turned(3.0))[2], 3.0),
    "difference, m": (lambda a, b: a.difference([0.1, -7.0], [0.2, 30.0]), [0.1, 37.0]),
    "integrate, rad": (lambda a, b: b.integrate(turned(0.0), [0, 0, 3.0]), turned(3.0)),
    "interpolate": (lambda a, b: b.interpolate(turned(0.0), turned(3.0), 0.5), turned(1.5)),
    "logarithm, rad": (lambda a, b: ufuncs.SE3_log(np.vstack([about_z(3.0)[:3, :3].T, np.zeros(3)]))[5], 3.0),
    "velocity, m/s": (lambda a, b: a.frame_velocity([0.0, 20.0], [2.0, 5.0], "slider"), [5, 40, 0, 0, 0, 2]),
    "classical acceleration, m/s²": (
        lambda a, b: a.frame_acceleration([0.0, 20.0], [2.0, 5.0], [3.0, 7.0], "slider", kind="classical")[:2],
        [7 - 4 * 20, 3 * 20 + 2 * 2 * 5],
    ),
    "efforts, N m and N": (lambda a, b: a.inverse_dynamics([0.0, 20.0], [2.0, 0.0], [3.0, 0.0]), [2 * 23**2 * 3, -2 * 4 * 23]),
    "reaction, N and N m": (lambda a, b: a.reactions([0.0, 20.0], [0, 0], [0, 0])[0], [0, 0, 2 * 9.81, 0, -2 * 9.81 * 23, 0]),
    "energy, J": (lambda a, b: a.energy([0.0, 20.0], [2.0, 0.0])[0], 0.5 * 2 * 23**2 * 4),
    "momentum, kg m/s and kg m²/s": (lambda a, b: a.centroidal_momentum([0.0, 20.0], [2.0, 0.0])[:3], [0, 2 * 23 * 2, 0]),
    "mass matrix": (lambda a, b: a.mass_matrix([0.0, 20.0]), [[2 * 23**2, 0], [0, 2]]),
    "power, W": (lambda a, b: a.external_power([0.0, 20.0], [2.0, 5.0], {"slider": [10, 20, 0, 0, 0, 30]}), 10 * 5 + 20 * 40 + 30 * 2),
}


@pytest.mark.parametrize(("call", "expected"), CLOSED_FORMS.values(), ids=CLOSED_FORMS)
def test_closed_forms(arm, ball, call, expected):
    assert np.allclose(call(arm, ball), expected, rtol=1e-12, atol=1e-9)


SIZES = {"pendulum of a nanogram": (1e-9, 1e-7, 0.0), "of a planet": (1e24, 1e6, 0.0), "heavy, thin": (1e9, 0.0, 1e-5), "light, long": (1e-12, 1e4, 0.0)}


@pytest.mark.parametrize(("mass", "length", "moment"), SIZES.values(), ids=SIZES)
def test_no_size_is_without_mass(mass, length, moment):
    """D was compared with a sum of kilograms and kg m²."""
    b = ksl.Builder("pendulum").add_link("ground").add_link("bob", mass, (length, 0, 0), moment * np.eye(3))
    m = b.add_joint("hinge", "revolute", "ground", "bob", axis=(0, 1, 0)).build()
    expected = 9.81 / length if length else 0.0
    assert m.forward_dynamics([0.0], [0.0], [0.0])[0] == pytest.approx(expected, rel=1e-12)
    double = (
        ksl.Builder("double")
        .add_link("ground")
        .add_link("first", mass, (length, 0, 0), moment * np.eye(3))
        .add_link("second", mass, (length, 0, 0), moment * np.eye(3))
    )
    pose = np.eye(4)
    pose[0, 3] = length
    double.add_joint("a", "revolute", "ground", "first", axis=(0, 1, 0)).add_joint("b", "revolute", "first", "second", pose, axis=(0, 1, 0))
    m, q = double.build(), np.array([0.3, 1.1])
    a = m.forward_dynamics(q, [0.2, 0.1], [0, 0])
    assert np.allclose(m.inverse_dynamics(q, [0.2, 0.1], a), 0, atol=1e-9 * mass * max(9.81 * length, moment))


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_what_rounding_leaves_is_no_mass(scale):
    """A rod along its own joint's axis, a point mass at the end of two parallel joints, whatever the unit."""
    for pose, center in ((None, (0.1 * scale, 0.2 * scale, 0.7 * scale)),):
        b = ksl.Builder("rod").add_link("ground").add_link("arm").add_link("rod", scale**-1, center, np.zeros((3, 3)))
        axis = np.array(center) / np.linalg.norm(center)
        b.add_joint("first", "revolute", "ground", "arm", axis=np.cross(axis, (0, 0, 1))).add_joint("spin", "revolute", "arm", "rod", pose, axis=axis)
        with pytest.warns(ksl.DescriptionWarning, match="joint spin can move without moving any mass"):
            m = b.build()
        with pytest.raises(ValueError, match="joint spin can move without moving any mass"):
            m.forward_dynamics([0.1, 0.2], [0, 0], [0, 0])
