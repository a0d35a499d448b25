"""Articulated-body inertia against dense 6×6 matrices at 200 bits: a rigid body's, and [Ad]* A [Ad]⁻¹ of any.

Errors of products: per block (M, H, I) or vector (f, τ), against the sum of the norms of the products that enter it, Frobenius norms
(of t̃: √2 |t|), in units of u."""

import numpy as np
import pytest

import reference as ref
from cases import arithmetic  # noqa: F401, a fixture
from reference import T, UNIT, mp, mul, norm

CASES = 10_000
pytestmark = pytest.mark.usefixtures("arithmetic")
BOTH = pytest.mark.parametrize("scalar, f", [("double", ""), ("float", "f")])


def dtype(scalar):
    return np.float64 if scalar == "double" else np.float32


def sample(base, scalar, k=0, n=None):
    n = n or CASES
    from functions import Type

    return ref.sample(np.random.default_rng([k, *base.encode()]), n, Type(base, "pointer", True, scalar))


def blocks(A):
    """M, H, I of the 21 numbers."""
    return ref.symmetric(A[:, :6]), ref.matrix(A[:, 6:15]), ref.symmetric(A[:, 15:])


def dense(A):
    M, H, I = blocks(A)
    return ref.block(M, H, T(H), I)


def sizes(A):
    return [norm(b) for b in blocks(A)]


def worst(got, expected, scale, scalar):
    """Largest error in u of the 21 numbers got against a dense reference, block by block."""
    M, H, I = expected[:, :3, :3], expected[:, :3, 3:], expected[:, 3:, 3:]
    parts = ((got[:, :6], ref.six(M)), (got[:, 6:15], ref.numbers(H)), (got[:, 15:], ref.six(I)))
    return max((ref.distance(g, e) / np.maximum(s, 1e-300)).max() for (g, e), s in zip(parts, scale)) / UNIT[scalar]


@BOTH
def test_from_a_rigid_body(ksl, scalar, f):
    M = sample("spatial_inertia", scalar)
    (A,) = ksl.outputs(f"ksl_spatial_inertia{f}_toArticulated", M, np.zeros((CASES, 21)))
    m = mp(M)
    expected = ref.spatial_inertia(m[:, 0], m[:, 1:4], ref.symmetric(m[:, 4:]))
    assert np.all(dense(mp(A)) == expected)


@BOTH
def test_copy_add_and_blocks(ksl, scalar, f):
    A, B = sample("articulated_inertia", scalar), sample("articulated_inertia", scalar, 1)
    assert np.array_equal(ksl.outputs(f"ksl_articulated_inertia{f}_copy", A, np.zeros((CASES, 21)))[0], A)
    (C,) = ksl.outputs(f"ksl_articulated_inertia{f}_added", A, B, np.zeros((CASES, 21)))
    assert np.array_equal(C, A + B)
    M, _, I = blocks(A)
    assert np.array_equal(ref.matrix(ksl.outputs(f"ksl_articulated_inertia{f}_getM", A, np.zeros((CASES, 9)))[0]), M)
    assert np.array_equal(ref.matrix(ksl.outputs(f"ksl_articulated_inertia{f}_getI", A, np.zeros((CASES, 9)))[0]), I)


@BOTH
def test_product(ksl, scalar, f, record_property):
    A, s = sample("articulated_inertia", scalar), sample("screw", scalar)
    (c,) = ksl.outputs(f"ksl_product_As{f}", A, s, np.zeros((CASES, 6)))
    expected = mul(dense(mp(A)), mp(s))
    (M, H, I), v, w = sizes(mp(A)), norm(mp(s)[:, :3]), norm(mp(s)[:, 3:])
    error = (
        max((ref.distance(c[:, :3], expected[:, :3]) / (M * v + H * w)).max(), (ref.distance(c[:, 3:], expected[:, 3:]) / (H * v + I * w)).max()) / UNIT[scalar]
    )
    record_property("worst_u", float(error))
    assert error <= 4


def transformation(kind, scalar):
    """Argument and dense pose of rotated, translated, transformed."""
    x = sample({"rotated": "mat3x3", "translated": "vec3", "transformed": "SE3"}[kind], scalar)
    D = {"rotated": lambda y: ref.rotation_pose(ref.matrix(y)), "translated": ref.translation_pose, "transformed": ref.pose}[kind](mp(x))
    return x, D


@BOTH
@pytest.mark.parametrize("kind", ["rotated", "translated", "transformed"])
def test_transformed(ksl, kind, scalar, f, record_property):
    """[Ad]* A [Ad]⁻¹, from the definition."""
    A = sample("articulated_inertia", scalar)
    x, D = transformation(kind, scalar)
    (got,) = ksl.outputs(f"ksl_articulated_inertia{f}_{kind}", A, x, np.zeros((CASES, 21)))
    expected = mul(mul(ref.CoAd(D), dense(mp(A))), ref.Ad(ref.inverse_pose(D)))
    (M, H, I), t = sizes(mp(A)), np.sqrt(2) * norm(D[:, :3, 3])
    error = worst(got, expected, (M, H + M * t, I + 2 * H * t + M * t**2), scalar)
    record_property("worst_u", float(error))
    assert error <= 4


@BOTH
def test_downdated(ksl, scalar, f, record_property):
    A, U = sample("articulated_inertia", scalar), sample("coscrew", scalar)
    d = ref.magnitudes(np.random.default_rng(3), CASES, scalar).astype(dtype(scalar))
    (got,) = ksl.outputs(f"ksl_articulated_inertia{f}_downdated", A, U, d, np.zeros((CASES, 21)))
    u = mp(U)
    expected = dense(mp(A)) - mp(d)[:, None, None] * ref.outer(u, u)
    (M, H, I), p, q = sizes(mp(A)), norm(u[:, :3]), norm(u[:, 3:])
    error = worst(got, expected, (M + d * p * p, H + d * p * q, I + d * q * q), scalar)
    record_property("worst_u", float(error))
    assert error <= 4
