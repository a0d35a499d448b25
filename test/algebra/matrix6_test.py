"""Dense 6×6 matrices, and stiffness and compliance under a pose, against 200 bits."""

import numpy as np
import pytest

import reference as ref
from cases import arithmetic  # noqa: F401, a fixture
from cases import CASES, PRECISIONS, bound, close, error, room, sample
from reference import T, mp, mul, norm

pytestmark = pytest.mark.usefixtures("arithmetic")
BOTH = pytest.mark.parametrize("scalar, f", PRECISIONS)
SQRT2 = np.sqrt(2)


def dense(ksl, name, f, x):
    """The row-major matrix, after a look at the column-major one: its transpose to the bit."""
    scalar = "float" if f else "double"
    r, c = (ksl.outputs(f"ksl_matrix6{f}_{name}_{o}mo", x, room(36, scalar, len(x)))[0].reshape(-1, 6, 6) for o in "rc")
    assert np.array_equal(r, c.transpose(0, 2, 1))
    return r


def test_adjoints_of_a_known_pose(ksl):
    """A quarter turn about z and t = (1, 2, 3), written out by hand."""
    D = np.array([[0.0, 1, 0, -1, 0, 0, 0, 0, 1, 1, 2, 3]])
    R = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    tR = np.array([[-3, 0, 2], [0, -3, -1], [1, 2, 0.0]])
    assert np.array_equal(dense(ksl, "Ad", "", D)[0], np.block([[R, tR], [0 * R, R]]))
    assert np.array_equal(dense(ksl, "CoAd", "", D)[0], np.block([[R, 0 * R], [tR, R]]))


@BOTH
@pytest.mark.parametrize("name", ["Ad", "CoAd"])
def test_adjoints(ksl, name, scalar, f, record_property):
    D = sample("SE3", scalar)
    got, expected = dense(ksl, name, f, D), getattr(ref, name)(ref.pose(mp(D)))
    t = norm(mp(D)[:, 9:])
    worst = 0
    for i in (0, 3):
        for j in range(6):
            moment = (i < 3) != (j < 3)
            worst = max(worst, error(got[:, i : i + 3, j], expected[:, i : i + 3, j], t if moment else 0, scalar))
    bound(record_property, worst)


@BOTH
def test_brackets_and_inertias_are_copies(ksl, scalar, f):
    s, M, A = sample("screw", scalar), sample("spatial_inertia", scalar), sample("articulated_inertia", scalar)
    assert np.all(dense(ksl, "ad", f, s) == ref.ad(mp(s)))
    assert np.all(dense(ksl, "coad", f, s) == ref.coad(mp(s)))
    m = mp(M)
    assert np.all(dense(ksl, "spatial_inertia", f, M) == ref.spatial_inertia(m[:, 0], m[:, 1:4], ref.symmetric(m[:, 4:])))
    a = mp(A)
    H = ref.matrix(a[:, 6:15])
    assert np.all(dense(ksl, "articulated_inertia", f, A) == ref.block(ref.symmetric(a[:, :6]), H, T(H), ref.symmetric(a[:, 15:])))


@BOTH
@pytest.mark.parametrize("name, kind, letter", [("Ad", "SE3", "s"), ("CoAd", "SE3", "c"), ("ad", "screw", "s"), ("coad", "screw", "c")])
def test_matrices_do_what_the_products_do(ksl, name, kind, letter, scalar, f):
    x, y = sample(kind, scalar, moderate=True), sample({"s": "screw", "c": "coscrew"}[letter], scalar, 1, moderate=True)
    function = {"Ad": "product_Ads", "CoAd": "product_CoAdc", "ad": "cross_ss", "coad": "cross_sc"}[name]
    (product,) = ksl.outputs(f"ksl_{function}{f}", x, y, room(6, scalar))
    close(product, np.einsum("nij,nj->ni", dense(ksl, name, f, x).astype(float), y.astype(float)), scalar, 16)


def matrices(scalar, stiff=True, k=0):
    """Random 6×6 matrices, not symmetric, whose blocks differ in size as stiffnesses or compliances do."""
    random = np.random.default_rng([k, stiff])
    a = ref.magnitudes(random, CASES, scalar)[:, None, None] ** 0.3
    scale = np.ones((1, 6, 6))
    scale = np.where(np.arange(6) >= 3, a, 1 + 0 * a) * np.where(np.arange(6)[:, None] >= 3, a, 1 + 0 * a) * scale
    return (random.normal(size=(CASES, 6, 6)) * (scale if stiff else 1 / scale)).astype(np.float32 if scalar == "float" else float)


@BOTH
@pytest.mark.parametrize("what", ["stiffness", "compliance"])
def test_stiffness_and_compliance(ksl, what, scalar, f, record_property):
    """K' = [Ad]* K [Ad]⁻¹, C' = [Ad] C [Ad]*⁻¹, block by block, against the sum of the norms of the products in each."""
    K, D = matrices(scalar, what == "stiffness"), sample("SE3", scalar)
    name = f"ksl_matrix6{f}_{what}Transformed"
    _, (_, _, got) = ksl(name, K.reshape(CASES, 36), D, room(36, scalar))
    got = got.reshape(CASES, 6, 6)
    X = (ref.CoAd if what == "stiffness" else ref.Ad)(ref.pose(mp(D)))
    expected = mul(mul(X, mp(K)), T(X))
    t = SQRT2 * norm(mp(D)[:, 9:])
    size = np.stack([np.stack([norm(mp(K[:, i : i + 3, j : j + 3])) for j in (0, 3)], -1) for i in (0, 3)], 1)
    one, worst = np.ones(CASES), 0
    x = np.array([[one, 0 * one], [t, one]] if what == "stiffness" else [[one, t], [0 * one, one]])
    for i in (0, 1):
        for j in (0, 1):
            scale = sum(x[i, p] * size[:, p, q] * x[j, q] for p in (0, 1) for q in (0, 1))
            worst = max(worst, error(got[:, 3 * i : 3 * i + 3, 3 * j : 3 * j + 3], expected[:, 3 * i : 3 * i + 3, 3 * j : 3 * j + 3], scale, scalar))
    bound(record_property, worst)


def alias_all(ksl, name, K, D):
    """The 36 numbers after a call in place."""
    call, _, _ = ksl._function(name)
    A, D = np.array(K, order="C"), np.ascontiguousarray(D)
    for a, d in zip(A, D):
        call(a.ctypes.data, d.ctypes.data, a.ctypes.data)
    return A


@BOTH
@pytest.mark.parametrize("what", ["stiffness", "compliance"])
def test_in_place(ksl, what, scalar, f):
    n = min(CASES, 200)
    K, D = matrices(scalar, what == "stiffness")[:n].reshape(n, 36), sample("SE3", scalar, n=n, moderate=True)
    name = f"ksl_matrix6{f}_{what}Transformed"
    apart = ksl(name, K, D, room(36, scalar, n))[1][2]
    assert np.array_equal(apart, alias_all(ksl, name, K, D))


@BOTH
def test_compliance_is_the_inverse_of_stiffness(ksl, scalar, f):
    """(K')⁻¹ = (K⁻¹)', and the energy sᵀ K s stays."""
    n, random = 300, np.random.default_rng(9)
    B = random.normal(size=(n, 6, 6))
    K = (B @ B.transpose(0, 2, 1) + 6 * np.eye(6)).astype(room(1, scalar).dtype)
    D, s = sample("SE3", scalar, n=n, moderate=True), sample("screw", scalar, n=n, moderate=True)
    C = np.linalg.inv(K.astype(float)).astype(K.dtype)
    K2 = ksl(f"ksl_matrix6{f}_stiffnessTransformed", K.reshape(n, 36), D, room(36, scalar, n))[1][2].reshape(n, 6, 6)
    C2 = ksl(f"ksl_matrix6{f}_complianceTransformed", C.reshape(n, 36), D, room(36, scalar, n))[1][2].reshape(n, 6, 6)
    close(C2.astype(float) @ K2, np.tile(np.eye(6), (n, 1, 1)), scalar, 2e4)
    s2 = ksl.outputs(f"ksl_product_Ads{f}", D, s, room(6, scalar, n))[0].astype(float)
    close(np.einsum("ni,nij,nj->n", s2, K2, s2), np.einsum("ni,nij,nj->n", s, K.astype(float), s), scalar, 1000)


@BOTH
def test_a_symmetric_stiffness_is_an_articulated_inertia(ksl, scalar, f):
    n = 300
    A, D = sample("articulated_inertia", scalar, n=n), sample("SE3", scalar, n=n, moderate=True)
    A = A / np.abs(A).max(axis=1)[:, None]
    K = dense(ksl, "articulated_inertia", f, A)
    moved = dense(ksl, "articulated_inertia", f, ksl.outputs(f"ksl_articulated_inertia{f}_transformed", A, D, room(21, scalar, n))[0])
    got = ksl(f"ksl_matrix6{f}_stiffnessTransformed", K.reshape(n, 36), D, room(36, scalar, n))[1][2]
    close(got.reshape(n, 6, 6), moved, scalar)


@BOTH
def test_gather_and_scatter(ksl, scalar, f):
    """Six numbers at any step, into a screw or coscrew and back."""
    for kind in ("screw", "coscrew"):
        A = np.arange(36, dtype=room(1, scalar).dtype).reshape(1, 36)
        _, (x, _, _) = ksl(f"ksl_{kind}{f}_gather", room(6, scalar, 1), A, 6)
        assert np.array_equal(x[0], A[0, ::6])
        _, (_, B, _) = ksl(f"ksl_{kind}{f}_scatter", x, 0 * A, 6)
        assert np.array_equal(B[0, ::6], A[0, ::6]) and np.count_nonzero(B) == 5
