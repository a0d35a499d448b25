"""One test per erratum of the published page (A) and library (B) that the algebra corrects.  docs/algebra.md lists them.
A5, A6 and A7 are in coscrews_equations_test.py, equations (7), (9), (11) and (12); B21, outputs on inputs, is in in_place_test.py for every function."""

import subprocess

import numpy as np
import pytest

import reference as ref
from functions import INCLUDE, published
from reference import Ad, CoAd, inverse_pose, mp, mul, pose

N = 100
U = 2.0**-53
F = pytest.mark.parametrize("f, dtype", [("", np.float64), ("f", np.float32)])


def poses(seed=1):
    random = np.random.default_rng(seed)
    return np.concatenate([ref.numbers(ref.rotations(random, N)).astype(float), random.normal(size=(N, 3))], 1)


def room(k):
    return np.zeros((N, k))


def matrices(ksl, name, D):
    columns = [ksl.outputs(name, D, np.tile(np.eye(6)[j], (N, 1)), room(6))[0] for j in range(6)]
    return np.stack(columns, -1)


def test_A1_inverse_coadjoint_is_the_true_inverse(ksl):
    D = poses()
    product = matrices(ksl, "ksl_product_CoAdinvc", D) @ matrices(ksl, "ksl_product_CoAdc", D)
    assert abs(product - np.eye(6)).max() < 1e-14
    R, t = pose(mp(D))[:, :3, :3], ref.tilde(mp(D)[:, 9:])
    printed = ref.block(ref.T(R), ref.zeros(N, 3, 3), -mul(t, ref.T(R)), ref.T(R))
    assert abs(mul(printed, CoAd(pose(mp(D)))).astype(float) - np.eye(6)).max() > 0.5


def test_A2_inverse_adjoint_is_the_true_inverse(ksl):
    D = poses()
    assert abs(matrices(ksl, "ksl_product_Adinvs", D) @ matrices(ksl, "ksl_product_Ads", D) - np.eye(6)).max() < 1e-14
    assert abs(matrices(ksl, "ksl_product_Adinvs", D) - Ad(inverse_pose(pose(mp(D)))).astype(float)).max() < 1e-14


def test_A3_single_precision_coadjoint_exists_beside_the_rotation(ksl):
    D, c = poses().astype(np.float32), np.random.default_rng(2).normal(size=(N, 6)).astype(np.float32)
    (got,) = ksl.outputs("ksl_product_CoAdcf", D, c, room(6))
    assert abs(got - mul(CoAd(pose(mp(D))), mp(c)).astype(float)).max() < 1e-5
    (rotated,) = ksl.outputs("ksl_product_CoAdrcf", D[:, :9], c, room(6))
    assert abs(rotated - got).max() > 0.1


def test_A4_functions_that_the_page_leaves_out_exist(ksl):
    names = {f.name for f in published() if f.header == "coscrew.h"}
    missing = ["coscrew_norm", "coscrew_normalize", "coscrewf_norm", "coscrewf_normalize", "product_CoAdcf"]
    missing += [f"{n}{f}" for f in ("", "f") for n in ("add_cct", "cross_sca", "product_CoAdrcinv", "product_CoAdtinvc", "product_CoAdcinv")]
    missing += [f"hc{m}{axis}{inv}{f}" for m in "tr" for axis in "xyz" for inv in ("", "inv") for f in ("", "f")]
    assert len(missing) == 39
    assert {f"ksl_{n}" for n in missing} <= names


@F
def test_B1_product_with_an_inverse_rotation(ksl, f, dtype):
    A, B = poses(1).astype(dtype), poses(2).astype(dtype)
    RA, RB = pose(mp(A))[:, :3, :3].astype(float), pose(mp(B))[:, :3, :3].astype(float)
    right, wrong = RA @ RB.transpose(0, 2, 1), RB.transpose(0, 2, 1) @ RA
    tolerance = 8 * np.finfo(dtype).eps
    for name, first, second, numbers in (("drdrinv", A[:, :9], B[:, :9], 9), ("ddrinv", A, B[:, :9], 12), ("ddinv", A, B, 12)):
        (got,) = ksl.outputs(f"ksl_product_{name}{f}", first, second, room(numbers))
        R = got[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1)
        assert abs(R - right).max() < tolerance
        assert abs(R - wrong).max() > 0.5


@F
def test_B2_inverse_pose_times_pose(ksl, f, dtype):
    A, B = poses(1).astype(dtype), poses(2).astype(dtype)
    (got,) = ksl.outputs(f"ksl_product_dinvd{f}", A, B, room(12))
    expected = mul(inverse_pose(pose(mp(A))), pose(mp(B))).astype(float)
    assert abs(got[:, 9:] - expected[:, :3, 3]).max() < 16 * np.finfo(dtype).eps * 4


@F
def test_B7_names_that_were_declared_and_never_defined(ksl, f, dtype):
    s = np.array([[1, 2, 3, 0, 3, 4]], dtype)
    (got,) = ksl.outputs(f"ksl_screw{f}_normalized", s, s)
    assert np.allclose(got, s / 5, rtol=1e-6)
    D = poses().astype(np.float32)
    assert np.array_equal(ksl.outputs("ksl_hrxinvf", D, room(6))[0], ksl.outputs("ksl_hsrxinvf", D, room(6))[0])


@F
def test_B9_translated_inertia_copies_its_input(ksl, f, dtype):
    """Mass 2, centroidal I = diag(1, 2, 3), moved by (1, 0, 0): m, mt = (2, 0, 0), I + 2 diag(0, 1, 1)."""
    M = np.array([[2, 0, 0, 0, 1, 2, 3, 0, 0, 0]], dtype)
    t = np.array([[1, 0, 0]], dtype)
    expected = [[2, 2, 0, 0, 1, 4, 5, 0, 0, 0]]
    (got,) = ksl.outputs(f"ksl_inertia{f}_translated", M, t, np.full((1, 10), np.nan))
    assert got.tolist() == expected
    assert ksl.outputs(f"ksl_inertia{f}_translate", M, t)[0].tolist() == expected


@F
def test_B9_merge_is_about_the_combined_centroid(ksl, f, dtype):
    """Two point masses of 1 and 3, one at the origin, one at distance 4: the centroid is at 3, μ d² = 0.75 · 16 = 12."""
    i = np.array([[1, 0, 0, 0, 0, 0, 0, 0, 0, 0]], dtype)
    j = np.array([[3, 0, 0, 0, 0, 0, 0, 0, 0, 0]], dtype)
    D = np.array([[1, 0, 0, 0, 1, 0, 0, 0, 1, 4, 0, 0]], dtype)
    zero = np.zeros((1, 3), dtype)
    (got,) = ksl.outputs(f"ksl_inertia{f}_merge", i, zero, j, zero, D)
    assert got.tolist() == [[4, 12, 0, 0, 0, 12, 12, 0, 0, 0]]


@F
def test_B9_massless_bodies_stay_finite(ksl, f, dtype):
    M = np.array([[0, 0, 0, 0, 1, 2, 3, 0, 0, 0]], dtype)
    t = np.array([[1, 2, 3]], dtype)
    assert ksl.outputs(f"ksl_inertia{f}_translated", M, t, np.zeros((1, 10)))[0].tolist() == M.tolist()
    assert ksl.outputs(f"ksl_inertia{f}_toSpatialInertia", M, np.zeros((1, 10)))[0].tolist() == M.tolist()


def inertia_of(matrices, dtype):
    I = np.asarray(matrices, float)
    return np.concatenate([np.ones((len(I), 1)), np.zeros((len(I), 3)), I[:, [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]], 1).astype(dtype)


def factor(ksl, f, M):
    result, (L,) = ksl(f"ksl_inertia{f}_factor", M)
    lower = np.zeros((len(M), 3, 3))
    for k, (r, c) in enumerate(((0, 0), (1, 1), (2, 2), (1, 0), (2, 1), (2, 0))):
        lower[:, r, c] = L[:, 4 + k]
    return result, lower, L


@F
@pytest.mark.parametrize("rank", [1, 2, 3])
@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e9])
def test_B10_factor_tells_rank_and_returns_the_factor(ksl, f, dtype, rank, scale):
    random = np.random.default_rng(rank)
    R = ref.rotations(random, N).astype(float)
    R[:20] = np.eye(3)  # and some along the axes
    R[20:40] = ref.rotations(random, 20).astype(float) * 1e-9 + np.eye(3)
    d = np.zeros((N, 3))
    for row in d:
        row[random.permutation(3)[:rank]] = random.uniform(0.3, 1, rank)
    I = (R * d[:, None, :]) @ R.transpose(0, 2, 1) * scale
    M = inertia_of(I, dtype)
    assert ksl(f"ksl_inertia{f}_rank", M)[0].tolist() == [rank] * N
    result, L, _ = factor(ksl, f, M)
    assert result.tolist() == [rank] * N
    assert abs(L @ L.transpose(0, 2, 1) - I).max() < 16 * np.finfo(dtype).eps * scale


@F
def test_B10_factor_refuses_what_is_no_inertia(ksl, f, dtype):
    bad = inertia_of([np.diag([1.0, 2, -3]), [[1, 2, 0], [2, 1, 0], [0, 0, 1]], np.diag([1, np.nan, 1]), [[0, 1, 0], [1, 0, 0], [0, 0, 0]]], dtype)
    result, _, after = factor(ksl, f, bad)
    assert result.tolist() == [-1] * 4
    assert np.array_equal(after, bad, equal_nan=True)
    result, _, after = factor(ksl, f, inertia_of([np.zeros((3, 3))], dtype))
    assert result.tolist() == [0] and not after[:, 4:].any()


@F
def test_B12_inverse_pivots_and_tests_relatively(ksl, f, dtype):
    eps = np.finfo(dtype).eps
    tiny = 1e-10 if dtype is np.float64 else 1e-5
    good = [
        np.eye(3)[[1, 2, 0]],
        [[0, 1, 0], [1, 0, 0], [0, 0, 1]],
        [[tiny, 1, 0], [1, 1, 0], [0, 0, 1]],
        np.diag([1, 2, 4]) * 1e-13,
        np.diag([1, 2, 4]) * 1e13,
    ]
    for A in good:
        A = np.asarray(A, dtype)
        (code,), (_, inverse) = ksl(f"ksl_mat3x3{f}_inverted", A.T.reshape(1, 9), np.zeros((1, 9)))
        assert code == 0
        assert abs(A.astype(float) @ inverse.reshape(3, 3).T.astype(float) - np.eye(3)).max() < 8 * eps
    random = np.random.default_rng(4)
    a, b = random.normal(size=(2, 3))
    for rank, A in ((0, np.zeros((3, 3))), (1, np.outer(a, b)), (2, np.outer(a, b) + np.outer(b, a)), (2, np.arange(9).reshape(3, 3))):
        for scale in (1e-20, 1.0, 1e15):
            (code,), (_, inverse) = ksl(f"ksl_mat3x3{f}_inverted", (A * scale).reshape(1, 9), np.zeros((1, 9)))
            assert code == -(rank + 1)
            assert np.isnan(inverse).all()
    for k in range(9):
        A = np.eye(3).ravel()
        A[k] = np.nan
        (code,), (_, inverse) = ksl(f"ksl_mat3x3{f}_inverted", A.reshape(1, 9), np.zeros((1, 9)))
        assert code < 0 and np.isnan(inverse).all()


@F
@pytest.mark.parametrize("kind, main", [("screw", 3), ("coscrew", 0)])
def test_B17_norm_is_relative_and_normalize_divides_everything(ksl, kind, main, f, dtype):
    """main: where the part begins that counts unless it is negligible."""
    other = 3 - main
    eps = np.finfo(dtype).eps

    def make(first, second):
        x = np.zeros((1, 6), dtype)
        x[0, main : main + 3], x[0, other : other + 3] = first, second
        return x

    def norm(x):
        return float(ksl(f"ksl_{kind}{f}_norm", x)[0][0])

    def normalized(x):
        (got,) = ksl.outputs(f"ksl_{kind}{f}_normalized", x, np.zeros((1, 6)))
        assert np.array_equal(got, ksl.outputs(f"ksl_{kind}{f}_normalize", x)[0], equal_nan=True)
        return got

    for scale in (1e-15, 5e-10, 1.1e-9, 1.0, 1e12):
        assert np.isclose(norm(make([0, 3 * scale, 4 * scale], [0, 0, 0])), 5 * scale, rtol=4 * eps)
        assert np.isclose(norm(make([0, 0, 0], [0, 3 * scale, 4 * scale])), 5 * scale, rtol=4 * eps)
        both = make([0, 3 * scale, 4 * scale], [7 * scale, 0, 0])
        assert np.isclose(norm(both), 5 * scale, rtol=4 * eps)
        assert np.allclose(normalized(both), both / (5 * scale), rtol=8 * eps)
        negligible = make([0.1 * eps * scale, 0, 0], [0, 3 * scale, 4 * scale])
        assert np.isclose(norm(negligible), 5 * scale, rtol=4 * eps)
        assert np.allclose(normalized(negligible), negligible / (5 * scale), rtol=8 * eps, atol=0)
        small = make([100 * eps * scale, 0, 0], [0, 3 * scale, 4 * scale])
        assert np.isclose(norm(small), 100 * eps * scale, rtol=4 * eps)
    assert norm(make([0, 0, 0], [0, 0, 0])) == 0
    assert np.isnan(normalized(make([0, 0, 0], [0, 0, 0]))).all()


@F
def test_B19_normalize_makes_the_columns_orthonormal(ksl, f, dtype):
    """Also of nearly dependent columns; the first keeps its direction, the handedness stays."""
    random = np.random.default_rng(5)
    A = random.normal(size=(N, 3, 3))
    A[: N // 2, :, 1] = A[: N // 2, :, 0] + 1e-3 * A[: N // 2, :, 1]
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_normalized", A.transpose(0, 2, 1).reshape(N, 9), room(9))
    Q = got.reshape(N, 3, 3).transpose(0, 2, 1).astype(float)
    assert abs(Q.transpose(0, 2, 1) @ Q - np.eye(3)).max() < 8 * np.finfo(dtype).eps
    assert np.allclose(Q[:, :, 0], A[:, :, 0] / np.linalg.norm(A[:, :, 0], axis=1)[:, None], rtol=0, atol=1e-5)
    assert np.array_equal(np.sign(np.linalg.det(Q)), np.sign(np.linalg.det(A)))


def test_B19_indices_are_checked_in_debug_builds(tmp_path):
    """Built here with assertions on, whatever the library was built with: the program makes the call whose number it is given."""
    calls = [
        "mat3x3_get(x, -1, 0)",
        "mat3x3_get(x, 0, -1)",
        "mat3x3_get(x, 3, 0)",
        "mat3x3_get(x, 0, 3)",
        "mat3x3_set(x, -1, 0, 1.0)",
        "SE3_get(x, 3, 0)",
        "SE3_get(x, 0, 4)",
        "SE3_get(x, 0, -1)",
        "SE3_set(x, 0, 4, 1.0)",
    ]
    cases = "".join(f"    case {k}: {{ ksl_{c.split('_')[0]}_t *x = ksl_{c.split('_')[0]}_alloc(1); ksl_{c}; break; }}\n" for k, c in enumerate(calls))
    (tmp_path / "main.c").write_text(f"#include <ksl/ksl.h>\nint main(int n, char **a) {{\n  switch (n > 1 ? atoi(a[1]) : -1) {{\n{cases}  }}\n}}\n")
    subprocess.run(["gcc", "-std=c11", f"-I{INCLUDE}", tmp_path / "main.c", "-o", tmp_path / "main", "-lm"], check=True)
    assert subprocess.run([tmp_path / "main"]).returncode == 0
    for k, call in enumerate(calls):
        run = subprocess.run([tmp_path / "main", str(k)], capture_output=True, text=True)
        assert run.returncode != 0 and "Assertion" in run.stderr, call


def test_B22_what_was_missing_exists(ksl):
    """Inertia × screw, exponential and logarithm."""
    for name in ("product_Ms", "product_Msf", "SE3_exp", "SE3f_exp", "SE3_log", "SE3f_log"):
        assert hasattr(ksl.dll, f"ksl_{name}")
    M = np.array([[2, 0, 0, 2, 1, 1, 3, 0, 0, 0]], float)  # mass 2, centroid at (0, 0, 1)
    s = np.array([[1, 0, 0, 0, 0, 1]], float)
    assert ksl.outputs("ksl_product_Ms", M, s, np.zeros((1, 6)))[0].tolist() == [[2, 0, 0, 0, 2, 3]]
