"""Exponential, logarithm, and rotations from axis and angle, against series and roots at 200 bits."""

import gmpy2
import numpy as np
import pytest

import reference as ref
from random_cases import AT_200_BITS as CASES
from reference import UNIT, dot, mp, mul, norm, numbers

pytestmark = pytest.mark.many_cases
BOTH = pytest.mark.parametrize("scalar, f", [("double", ""), ("float", "f")])


def dtype(scalar):
    return np.float32 if scalar == "float" else np.float64


def directions(random, n):
    v = random.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


def twists(random, n, angles, scalar):
    speed = 10 ** random.uniform(-3, 3, n)
    return np.concatenate([directions(random, n) * speed[:, None], directions(random, n) * angles[:, None]], 1).astype(dtype(scalar))


def angle_sets(random, n):
    return {
        "tiny": 10 ** random.uniform(-12, -1, n),
        "at the switch": random.uniform(0.0300, 0.0334, n),
        "ordinary": random.uniform(0, np.pi, n),
        "large": random.uniform(np.pi, 100, n),
    }


def rotation_error(got, R):
    """Spectral norm of the error of a rotation given as numbers."""
    return ref.spectral(ref.matrix(mp(got)) - R)


def pose_error(got, D):
    return rotation_error(got[:, :9], D[:, :3, :3]), ref.distance(got[:, 9:], D[:, :3, 3])


@BOTH
@pytest.mark.parametrize("angles", ["tiny", "at the switch", "ordinary", "large"])
def test_exp(ksl, scalar, f, angles, record_property):
    """R within (8 + |ω|) u, t within (8 + |ω|) u |v|."""
    random = np.random.default_rng(5)
    s = twists(random, CASES, angle_sets(random, CASES)[angles], scalar)
    (got,) = ksl.outputs(f"ksl_SE3{f}_exp", s, np.zeros((CASES, 12)))
    D = ref.expm(ref.twist_matrix(mp(s)))
    R, t = pose_error(got, D)
    v, w = norm(mp(s)[:, :3]), norm(mp(s)[:, 3:])
    size = 8 + w
    worst = max((R / size).max(), (t / v / size).max()) / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 1


@BOTH
def test_exp_at_zero_and_below_the_normal_range(ksl, scalar, f):
    tiny = float(np.finfo(dtype(scalar)).tiny)
    s = np.array([[1, 2, 3, 0, 0, 0], [1, 2, 3, tiny, -tiny, tiny], [0, 0, 0, 0, 0, 0]], dtype(scalar))
    (got,) = ksl.outputs(f"ksl_SE3{f}_exp", s, np.zeros((3, 12)))
    assert np.array_equal(got[:, 9:], s[:, :3])
    assert np.allclose(got[:, :9], np.eye(3).ravel(), rtol=0, atol=2 * tiny)


def condition(w):
    """‖dlog‖ at the rotation by |ω| ≤ π: (θ/2)/sin(θ/2), from 1 to π/2."""
    h = np.maximum(w / 2, 1e-300)
    return h / np.sin(h)


@BOTH
@pytest.mark.parametrize("angles", ["tiny", "at the switch", "ordinary", "near π"])
def test_log(ksl, scalar, f, angles, record_property):
    """Of a pose that is a rounded exponential: ω within (8 + |ω|) u, v within (8 + |ω|) u |v|, times the condition."""
    random = np.random.default_rng(6)
    angle = np.pi - 10 ** random.uniform(-4, -1, CASES) if angles == "near π" else angle_sets(random, CASES)[angles]
    s = twists(random, CASES, angle, scalar)
    D = ref.expm(ref.twist_matrix(mp(s)))
    rounded = np.concatenate([numbers(D[:, :3, :3]), D[:, :3, 3]], 1).astype(float).astype(dtype(scalar))
    (got,) = ksl.outputs(f"ksl_SE3{f}_log", rounded, np.zeros((CASES, 6)))
    v, w = norm(mp(s)[:, :3]), norm(mp(s)[:, 3:])
    size = (8 + w) * condition(w)
    worst = max((ref.distance(got[:, 3:], mp(s)[:, 3:]) / size).max(), (ref.distance(got[:, :3], mp(s)[:, :3]) / (size * v)).max()) / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 1


@BOTH
def test_small_rotations_keep_their_relative_accuracy(ksl, scalar, f):
    random = np.random.default_rng(7)
    s = twists(random, CASES, 10 ** random.uniform(-18, -5, CASES), scalar)
    (D,) = ksl.outputs(f"ksl_SE3{f}_exp", s, np.zeros((CASES, 12)))
    (back,) = ksl.outputs(f"ksl_SE3{f}_log", D, np.zeros((CASES, 6)))
    w = norm(mp(s)[:, 3:])
    assert (ref.distance(back[:, 3:], mp(s)[:, 3:]) / w).max() <= 8 * UNIT[scalar]


@BOTH
def test_exp_of_log_up_to_half_turns(ksl, scalar, f, record_property):
    """At and next to π, where either sign of ω is right: exp(log D) is D."""
    random = np.random.default_rng(8)
    axes = np.concatenate([directions(random, 100), np.eye(3), -np.eye(3), [[1, 1, 0], [0, 1, -1], [1, 2, 3], [0, -3, 4]]])
    axes = axes / np.linalg.norm(axes, axis=1)[:, None]
    steps = [0, 1e-17, 1e-12, 1e-9, 1e-7, 1e-4]
    n = len(axes) * len(steps)
    angle = np.repeat([gmpy2.const_pi() - gmpy2.mpfr(x) for x in steps], len(axes))
    v = mp(directions(random, n))
    exact = np.concatenate([v, mp(np.tile(axes, (len(steps), 1))) * angle[:, None]], 1)
    D = ref.expm(ref.twist_matrix(exact))
    rounded = np.concatenate([numbers(D[:, :3, :3]), D[:, :3, 3]], 1).astype(float).astype(dtype(scalar))
    (s,) = ksl.outputs(f"ksl_SE3{f}_log", rounded, np.zeros((n, 6)))
    assert np.all(norm(mp(s)[:, 3:]) <= np.pi * (1 + 4 * UNIT[scalar]))
    R, t = pose_error(rounded, ref.expm(ref.twist_matrix(mp(s))))
    worst = max(R.max(), t.max()) / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= (8 + np.pi) * np.pi / 2


@BOTH
def test_quaternion_ray(ksl, scalar, f):
    """Parallel to the quaternion of the rotation, at least 1 long."""
    random = np.random.default_rng(9)
    q = random.normal(size=(CASES, 4))
    q[:40] = np.repeat([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], 10, 0)
    q = mp(q) / ref.sqrt(dot(mp(q), mp(q)))[:, None]
    r = ref.tilde(q[:, :3])
    R = ref.identity(CASES, 3) + 2 * q[:, 3, None, None] * r + 2 * mul(r, r)
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_toQuaternionRay", numbers(R).astype(float), np.zeros((CASES, 4)))
    got = mp(got)
    length = norm(got)
    assert np.all(length >= 0.99)
    across = got - dot(got, q)[:, None] * q
    assert (norm(across) / length).max() <= 8 * UNIT[scalar]


@BOTH
def test_axis_angle(ksl, scalar, f):
    random = np.random.default_rng(10)
    axis = (directions(random, CASES) * 10 ** random.uniform(-5, 5, (CASES, 1))).astype(dtype(scalar))
    angle = random.uniform(-10, 10, CASES).astype(dtype(scalar))
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_setFromAxisAngle", np.zeros((CASES, 9)), axis, angle)
    a = mp(axis)
    w = a / ref.sqrt(dot(a, a))[:, None] * mp(angle)[:, None]
    error = rotation_error(got, ref.expm(ref.tilde(w)))
    c, s = np.cos(angle), np.sin(angle)
    assert (error / (abs(c) + abs(s) + abs(1 - c))).max() <= 4 * UNIT[scalar]  # the terms of Rodrigues' formula


@BOTH
def test_dc(ksl, scalar, f):
    x = np.random.default_rng(11).uniform(-100, 100, CASES).astype(dtype(scalar))
    (_, after) = ksl(f"ksl_dc{f}", x, np.zeros((CASES, 2)))
    sin, cos = np.frompyfunc(gmpy2.sin, 1, 1), np.frompyfunc(gmpy2.cos, 1, 1)
    assert abs((mp(after[1]) - np.stack([sin(mp(x)), cos(mp(x))], 1)).astype(float)).max() <= 1.01 * UNIT[scalar]


def sines(t):
    return np.frompyfunc(gmpy2.sin, 1, 1)(t), np.frompyfunc(gmpy2.cos, 1, 1)(t)


@BOTH
def test_angle_rest(ksl, scalar, f):
    """What is left of |ω| beyond its rounded value, to a hundredth of u |ω|; of hopeless angles 0."""
    random = np.random.default_rng(12)
    w = (directions(random, CASES) * 10 ** random.uniform(-9, 6, (CASES, 1))).astype(dtype(scalar))
    exact = ref.sqrt(dot(mp(w), mp(w)))
    rounded = exact.astype(float).astype(dtype(scalar)) * (1 + dtype(scalar)(2) * dtype(scalar)(UNIT[scalar]))
    got, _ = ksl(f"ksl_angle_rest{f}", w, rounded)
    assert (abs((mp(got) - (exact - mp(rounded))).astype(float)) / exact.astype(float)).max() <= 0.01 * UNIT[scalar]
    far = (directions(random, CASES) / UNIT[scalar] * 4).astype(dtype(scalar))
    assert np.abs(ksl(f"ksl_angle_rest{f}", far, np.linalg.norm(far.astype(float), axis=1))[0]).max() < 0.5


@BOTH
def test_coefficients(ksl, scalar, f):
    """a and b θ, c θ² where they are large to 4 u and b θ² to 12 u (of 2); by series all three relatively."""
    random = np.random.default_rng(12)
    w = (directions(random, CASES) * 10 ** random.uniform(-5, 2, (CASES, 1))).astype(dtype(scalar))
    a, b, c = (mp(y[:, 0]) for y in ksl.outputs(f"ksl_exp_coefficients{f}", w, *np.zeros((3, CASES, 1))))
    x = dot(mp(w), mp(w))
    t = ref.sqrt(x)
    sin, cos = sines(t)
    u, theta = UNIT[scalar], t.astype(float)
    assert (abs((a - sin / t).astype(float)) * np.maximum(theta, 1)).max() <= 6 * u
    assert (abs((b - (1 - cos) / t**2).astype(float)) * np.maximum(theta, 1) ** 2).max() <= 12 * u
    assert (abs((c - (t - sin) / t**3).astype(float)) * theta**2).max() <= 6 * u
    series = x.astype(float) < 9.9e-4
    for got, exact in ((a, sin / t), (b, (1 - cos) / t**2), (c, (t - sin) / t**3)):
        assert abs(((got - exact) / exact).astype(float)[series]).max() <= 2 * u


def test_larger_q(ksl):
    p, q = np.array([[1.0, 2, 3, 4]]), np.array([[5.0, 6, 7, 8]])
    o = np.zeros((1, 4))
    assert np.array_equal(ksl.outputs("ksl_larger_q", np.array([2.0]), p, np.array([1.0]), q, o)[0], p)
    assert np.array_equal(ksl.outputs("ksl_larger_q", np.array([1.0]), p, np.array([1.0]), q, o)[0], q)
