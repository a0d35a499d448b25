"""Articulated-body inertia against dense 6×6 matrices at 200 bits, and its laws.

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
SIX = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


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
    error = max((ref.distance(c[:, :3], expected[:, :3]) / (M * v + H * w)).max(),
                (ref.distance(c[:, 3:], expected[:, 3:]) / (H * v + I * w)).max()) / UNIT[scalar]
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


@pytest.fixture(params=["double", "float"])
def law(request, ksl):
    """Calls on inertias and poses of moderate size, in one precision."""
    scalar, f = request.param, request.param[0].replace("d", "")
    random = np.random.default_rng(4)
    n, dt = 300, dtype(scalar)

    class Law:
        u = UNIT[scalar]

        @staticmethod
        def inertia():
            B = random.normal(size=(n, 6, 6))
            B = B @ B.transpose(0, 2, 1) + np.eye(6)
            S = lambda X: np.stack([X[:, i, j] for i, j in SIX], -1)
            return np.concatenate([S(B[:, :3, :3]), B[:, :3, 3:].transpose(0, 2, 1).reshape(n, 9), S(B[:, 3:, 3:])], 1).astype(dt)

        @staticmethod
        def pose():
            return np.concatenate([ref.numbers(ref.rotations(random, n)).astype(float), random.normal(size=(n, 3))], 1).astype(dt)

        @staticmethod
        def screw():
            return random.normal(size=(n, 6)).astype(dt)

        def __call__(self, name, *args, width=21):
            return ksl.outputs(f"ksl_{name}", *args, np.zeros((n, width)))[0] if width else ksl.outputs(f"ksl_{name}", *args)[0]

    Law.A = f"articulated_inertia{f}_"
    Law.f = f
    return Law()


def test_transformation_is_a_homomorphism(law):
    A, D, E = law.inertia(), law.pose(), law.pose()
    DE = law(f"product_dd{law.f}", D, E, width=12)
    twice = law(law.A + "transformed", law(law.A + "transformed", A, E), D)
    assert np.abs(law(law.A + "transformed", A, DE) - twice).max() <= 64 * law.u * np.abs(twice).max()


def test_product_is_carried_along(law):
    """[Ad]*(D) (A s) = A' ([Ad](D) s), and the energy sᵀ A s stays."""
    A, D, s = law.inertia(), law.pose(), law.screw()
    B, p = law(law.A + "transformed", A, D), law(f"product_Ads{law.f}", D, s, width=6)
    there, here = law(f"product_As{law.f}", B, p, width=6), law(f"product_As{law.f}", A, s, width=6)
    carried = law(f"product_CoAdc{law.f}", D, here, width=6)
    assert np.abs(carried - there).max() <= 128 * law.u * np.abs(there).max() * 4
    e, k = law(f"dot_cs{law.f}", there, p, width=0), law(f"dot_cs{law.f}", here, s, width=0)
    assert np.abs(e - k).max() <= 1024 * law.u * np.abs(k).max()


def test_rigid_bodies_agree(law, ksl):
    """The same body as a spatial and as an articulated inertia: product, sum and transformation."""
    f, D, s = law.f, law.pose(), law.screw()
    M = np.concatenate([[[2.0, 0.4, -0.6, 1.0, 3, 4, 5, 0.1, -0.2, 0.3]]] * 300).astype(D.dtype)
    A = law(f"spatial_inertia{f}_toArticulated", M)
    assert np.allclose(law(f"product_As{f}", A, s, width=6), law(f"product_Ms{f}", M, s, width=6), rtol=0, atol=128 * law.u)
    moved = law(f"spatial_inertia{f}_toArticulated", law(f"spatial_inertia{f}_transformed", M, D, width=10))
    assert np.allclose(law(law.A + "transformed", A, D), moved, rtol=0, atol=32 * law.u * np.abs(moved).max())


def test_a_freedom_that_is_taken_out_needs_no_wrench(law):
    """A − U Uᵀ/d with U = A s, d = sᵀ U takes s to zero; for several freedoms, one after the other."""
    A, freedoms = law.inertia(), [law.screw() for _ in range(3)]
    for s in freedoms:
        U = law(f"product_As{law.f}", A, s, width=6)
        d = law(f"dot_cs{law.f}", U, s, width=0)
        A = law(law.A + "downdated", A, U, (1 / d).astype(U.dtype))
    for s in freedoms:
        left = law(f"product_As{law.f}", A, s, width=6)
        assert np.abs(left).max() <= 1e5 * law.u
