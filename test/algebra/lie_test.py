"""Exponential and logarithm of rotations, and the Jacobians of both groups, against series at 200 bits."""

import functools

import gmpy2
import numpy as np
import pytest

import reference as ref
from random_cases import AT_200_BITS
from reference import UNIT, dot, mp, mul, norm, numbers
from exponential_test import angle_sets, condition, directions, dtype, rotation_error

pytestmark = pytest.mark.many_cases
N = AT_200_BITS // 3
F = pytest.mark.parametrize("f, scalar", [("", "double"), ("f", "float")])
ANGLES = pytest.mark.parametrize("angles", ["tiny", "at the switch", "ordinary", "at one", "near π"])
PI = gmpy2.const_pi()
SIDES = pytest.mark.parametrize("side, sign", [("left", 1), ("right", -1)])


def angles_of(random, name):
    sets = angle_sets(random, N) | {"at one": random.uniform(0.9, 1.1, N), "near π": np.pi - 10 ** random.uniform(-8, -1, N)}
    sets["tiny"][:3] = [0, 1e-30, 1e-20]
    return sets[name]


def screws(seed, angles, scalar):
    random = np.random.default_rng(seed)
    v = directions(random, N) * 10 ** random.uniform(-3, 3, (N, 1))
    return np.concatenate([v, directions(random, N) * angles_of(random, angles)[:, None]], 1).astype(dtype(scalar))


def series(A):
    """Σ Aⁿ/(n + 1)! and Σ (−A)ⁿ/(n + 1)!, |A| moderate, to the last term that counts at 200 bits."""
    term, sums = ref.identity(len(A), A.shape[1]), [ref.identity(len(A), A.shape[1]), ref.zeros(*A.shape)]  # even and odd powers
    for n in range(1, 90):
        term = mul(term, A) / (n + 1)
        sums[n % 2] = sums[n % 2] + term
        if np.abs(term.astype(float)).max() < 2.0**-210:
            return sums[0] + sums[1], sums[0] - sums[1]
    raise AssertionError("the series has not converged")


@functools.cache
def exact_jacobians(angles, scalar):
    """Screws, and the Jacobians of poses on the left and on the right, which share their terms."""
    s = screws(4, angles, scalar)
    return s, dict(zip(("left", "right"), series(ref.ad(mp(s)))))


def inverse(A):
    """By elimination without pivoting, at 200 bits; Jacobians of |ω| ≤ π allow it."""
    n = A.shape[1]
    A = np.concatenate([A, ref.identity(len(A), n)], 2)
    for k in range(n):
        A[:, k] = A[:, k] / A[:, k, k][:, None]
        for r in range(n):
            if r != k:
                A[:, r] = A[:, r] - A[:, r, k][:, None] * A[:, k]
    return A[:, :, n:]


@F
@ANGLES
def test_exp_of_rotations(ksl, f, scalar, angles, record_property):
    w = screws(1, angles, scalar)[:, 3:]
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_exp", w, np.zeros((N, 9)))
    worst = (rotation_error(got, ref.expm(ref.tilde(mp(w)))) / (8 + norm(mp(w)))).max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 1


@F
@ANGLES
def test_log_of_rotations(ksl, f, scalar, angles, record_property):
    w = mp(screws(2, angles, "double")[:, 3:])
    R = numbers(ref.expm(ref.tilde(w))).astype(float).astype(dtype(scalar))
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_log", R, np.zeros((N, 3)))
    size = norm(w)
    error = np.minimum(ref.distance(got, w), np.where(size > 3.14, ref.distance(-got, (2 * PI / ref.sqrt(dot(w, w)) - 1)[:, None] * w), np.inf))
    worst = (error / ((8 + size) * condition(size))).max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 1


@F
def test_log_of_half_turns(ksl, f, scalar):
    """ω = ±π a to rounding, for axes along, between and nearly along x, y, z."""
    a = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, -1, 1], [1, 2, 3], [1e-9, 1, 0], [-1, 1e-17, 1]])
    a = mp(a) / ref.sqrt(dot(mp(a), mp(a)))[:, None]
    R = numbers(2 * ref.outer(a, a) - ref.identity(len(a), 3)).astype(float)
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_log", R, np.zeros((len(a), 3)))
    error = np.minimum(ref.distance(got, PI * a), ref.distance(-got, PI * a))
    assert error.max() <= (8 + np.pi) * UNIT[scalar]


@F
@ANGLES
@SIDES
def test_jacobian_on_rotations(ksl, f, scalar, angles, side, sign, record_property):
    w = screws(3, angles, scalar)[:, 3:]
    J = series(sign * ref.tilde(mp(w)))[0]
    size = 8 + norm(mp(w))
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_{side}Jacobian", w, np.zeros((N, 9)))
    (back,) = ksl.outputs(f"ksl_mat3x3{f}_{side}JacobianInverse", w, np.zeros((N, 9)))
    worst = max((rotation_error(got, J) / size).max(), (rotation_error(back, inverse(J)) / size).max()) / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 1


@F
@ANGLES
@pytest.mark.parametrize("side", ["left", "right"])
def test_jacobian_on_poses(ksl, f, scalar, angles, side, record_property):
    s, jacobians = exact_jacobians(angles, scalar)
    exact = jacobians[side]
    size, v = 8 + norm(mp(s)[:, 3:]), norm(mp(s)[:, :3])
    for name, M in (("Jacobian", exact), ("JacobianInverse", inverse(exact))):
        J, Q = ksl.outputs(f"ksl_SE3{f}_{side}{name}", s, np.zeros((N, 9)), np.zeros((N, 9)))
        a = (rotation_error(J, M[:, :3, :3]) / size).max() / UNIT[scalar]
        b = (rotation_error(Q, M[:, :3, 3:]) / (size * v)).max() / UNIT[scalar]
        record_property(f"worst_u_{name}", float(max(a, b)))
        assert a <= 1 and b <= 1
        dense = ref.block(ref.matrix(mp(J)), ref.matrix(mp(Q)), ref.zeros(N, 3, 3), ref.matrix(mp(J))).astype(float)
        room = np.zeros((N, 36))
        rows, columns = (ksl(f"ksl_SE3{f}_{side}{name}_{order}", s, room)[1][1].reshape(N, 6, 6) for order in ("rmo", "cmo"))
        assert np.array_equal(rows, dense) and np.array_equal(columns.transpose(0, 2, 1), dense)


@pytest.mark.parametrize("angles", ["tiny", "ordinary", "near π"])
@SIDES
def test_jacobians_are_derivatives_of_the_exponential(ksl, angles, side, sign):
    """exp(s + h d) = exp(h J d) exp(s), or exp(s) exp(h J d), to second order in h = 1e-20, at 200 bits."""
    s = screws(5, angles, "double")
    d, h = mp(np.random.default_rng(6).normal(size=(N, 6))), gmpy2.mpfr(2) ** -66
    (A,) = [ksl(f"ksl_SE3_{side}Jacobian_rmo", s, np.zeros((N, 36)))[1][1].reshape(N, 6, 6)]
    E, E2 = ref.expm(ref.twist_matrix(mp(s))), ref.expm(ref.twist_matrix(mp(s) + h * d))
    step = mul(E2, ref.inverse_pose(E)) if side == "left" else mul(ref.inverse_pose(E), E2)
    rate = (step - ref.identity(N, 4)) / h
    got = mul(mp(A), d)
    expected = np.concatenate([rate[:, :3, 3], rate[:, [2, 0, 1], [1, 2, 0]]], 1)
    scale = (1 + norm(mp(s)[:, :3])) * norm(d)
    assert (norm(got - expected) / scale).max() < 1e-14


@F
def test_coefficients(ksl, f, scalar):
    """b, c, db = b'(θ)/θ and dc = c'(θ)/θ, to what their use demands: b, c θ, db θ² and dc θ³ to a few u."""
    x = (10 ** np.random.default_rng(12).uniform(-20, 1, 4 * N)).astype(dtype(scalar))
    b, c, db, dc = (mp(y[:, 0]) for y in ksl.outputs(f"ksl_jacobian_coefficients{f}", x, *np.zeros((4, 4 * N, 1))))
    X = mp(x)
    t = ref.sqrt(X)
    k = [gmpy2.fac(n) for n in range(60)]
    exact = [sum(((-X) ** n / k[2 * n + m] for n in range(28)), start=0 * X) for m in (2, 3)]
    exact += [-sum((2 * (n + 1) * (-X) ** n / k[2 * n + m] for n in range(27)), start=0 * X) for m in (4, 5)]
    for n, (got, value) in enumerate(zip((b, c, db, dc), exact)):
        error = abs(((got - value) * t**n).astype(float))
        assert error.max() <= 6 * UNIT[scalar]
    small = x < 1
    assert abs(((c - exact[1]) / exact[1]).astype(float)[small]).max() <= 3 * UNIT[scalar]
    assert abs(((db - exact[2]) / exact[2]).astype(float)[small]).max() <= 3 * UNIT[scalar]


@F
def test_log_coefficient(ksl, f, scalar):
    """e θ² = 1 − half"""
    x = (10 ** np.random.default_rng(13).uniform(-9, 1, 4 * N)).astype(dtype(scalar))
    t = ref.sqrt(mp(x))
    half = t / 2 * np.frompyfunc(gmpy2.cot, 1, 1)(t / 2)
    got, _ = ksl(f"ksl_log_coefficient{f}", x, half.astype(float))
    error = abs(((mp(got) - (1 - half) / mp(x)) * mp(x)).astype(float))
    assert error.max() <= 4 * UNIT[scalar]


def test_log_of_a_quaternion_tells_the_half_cotangent(ksl):
    w = np.array([[0.3, -0.2, 0.5]])
    (q,) = ksl.outputs("ksl_quaternion_exp", w, np.zeros((1, 4)))
    back, half = ksl.outputs("ksl_log_q", -q, np.zeros((1, 3)), np.zeros((1, 1)))
    theta = np.linalg.norm(w)
    assert np.allclose(back, w, rtol=1e-15) and np.isclose(half[0, 0], theta / 2 / np.tan(theta / 2), rtol=1e-15)
