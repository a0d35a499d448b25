"""Dense linear algebra: against exact rational arithmetic, for random shapes and ranks, both orders, both precisions."""

import ctypes
from fractions import Fraction

import numpy as np
import pytest

from library import CTYPE

EPS = {"": 2.0**-52, "f": 2.0**-23}
DTYPE = {"": np.float64, "f": np.float32}
F = pytest.mark.parametrize("f", ["", "f"])
ORDER = pytest.mark.parametrize("order", ["rmo", "cmo"])
GUARD = 12345.0


class Guarded:
    """An array with numbers before and after it, which no call may change."""

    def __init__(self, x, dtype):
        x = np.asarray(x, dtype)
        guard = dtype(GUARD) if dtype is not np.int32 else np.int32(GUARD)
        self.all = np.concatenate([[guard] * 4, x.ravel(), [guard] * 4]).astype(dtype)
        self.x = self.all[4 : len(self.all) - 4].reshape(x.shape)

    @property
    def pointer(self):
        self.check_guards()
        return ctypes.c_void_p(self.all.ctypes.data + 4 * self.all.itemsize)

    def value(self):
        self.check_guards()
        return self.x

    def check_guards(self):
        assert (self.all[:4] == GUARD).all() and (self.all[-4:] == GUARD).all()


@pytest.fixture
def la(ksl):
    def call(name, f, *args):
        function = getattr(ksl.dll, f"ksl_{name}{f}")
        real = CTYPE["float" if f else "double"]
        function.restype = real if "infinityNorm" in name else ctypes.c_int
        return function(
            *[a.pointer if isinstance(a, Guarded) else real(a) if isinstance(a, (float, np.floating)) else a if a is None else int(a) for a in args]
        )

    return call


def store(A, order):
    return np.ascontiguousarray(A if order == "rmo" else A.T)


def load(x, shape, order):
    return np.array(x.reshape(shape) if order == "rmo" else x.reshape(shape[::-1]).T)


def of_rank(random, m, n, rank):
    """Small integers: rank and products are exact in both precisions."""
    if rank == min(m, n):
        while True:
            A = random.integers(-9, 10, (m, n)).astype(float)
            if np.linalg.matrix_rank(A) == rank:
                return A
    while True:
        A = (random.integers(-2, 3, (m, rank)) @ random.integers(-2, 3, (rank, n))).astype(float)
        if np.linalg.matrix_rank(A) == rank:
            return A


def shapes(seed, count=80, largest=9):
    random = np.random.default_rng(seed)
    for _ in range(count):
        m, n = random.integers(1, largest, 2)
        yield random, m, n, int(random.integers(0, min(m, n) + 1))


def factors(LU, rank):
    m, n = LU.shape
    L, U = np.eye(m), np.zeros((m, n))
    for j in range(rank):
        L[j + 1 :, j] = LU[j + 1 :, j]
        U[j, j:] = LU[j, j:]
    return L[:, :rank], U[:rank]


def exact_solve(A, b):
    """A⁻¹ b of float arrays, in fractions."""
    n = len(A)
    M = [[Fraction(float(x)) for x in row] + [Fraction(float(y))] for row, y in zip(A, b)]
    for k in range(n):
        p = max(range(k, n), key=lambda i: abs(M[i][k]))
        M[k], M[p] = M[p], M[k]
        for i in range(n):
            if i != k:
                q = M[i][k] / M[k][k]
                M[i] = [x - q * y for x, y in zip(M[i], M[k])]
    return np.array([float(M[i][n] / M[i][i]) for i in range(n)])


# ---- LU ----


@F
@ORDER
def test_lu_full_of_any_shape_and_rank(la, order, f):
    for random, m, n, rank in shapes(1):
        A = of_rank(random, m, n, rank)
        X, pr, pc = Guarded(store(A, order), DTYPE[f]), Guarded(np.zeros(m), np.int32), Guarded(np.zeros(n), np.int32)
        got = la(f"linalg_lu_full_{order}", f, m, n, X, 32 * EPS[f], pr, pc)
        assert got == rank
        assert sorted(pr.value()) == list(range(m)) and sorted(pc.value()) == list(range(n))
        LU = load(X.value(), (m, n), order).astype(float)
        L, U = factors(LU, rank)
        scale = abs(A).max()
        assert abs(A[np.ix_(pr.x, pc.x)] - L @ U).max() <= 64 * EPS[f] * max(scale, 1)
        assert (abs(L) <= 1).all()
        if rank:
            assert abs(U[0, 0]) == scale


@F
def test_row_and_column_major_give_the_same_numbers(la, f):
    for random, m, n, _ in shapes(2, 30):
        A = random.normal(size=(m, n))
        out = []
        for order in ("rmo", "cmo"):
            X, pr, pc = Guarded(store(A, order), DTYPE[f]), Guarded(np.zeros(m), np.int32), Guarded(np.zeros(n), np.int32)
            la(f"linalg_lu_full_{order}", f, m, n, X, 0.0, pr, pc)
            out.append((load(X.value(), (m, n), order), pr.value(), pc.value()))
        assert all(np.array_equal(a, b) for a, b in zip(*out))


@F
@ORDER
def test_lu_full_pivots_first_of_equals_and_refuses_no_sizes(la, order, f):
    X, pr, pc = Guarded(np.ones((3, 3)), DTYPE[f]), Guarded([0] * 3, np.int32), Guarded([0] * 3, np.int32)
    assert la(f"linalg_lu_full_{order}", f, 3, 3, X, 0.0, pr, pc) == 1
    assert pr.value().tolist() == pc.value().tolist() == [0, 1, 2]
    for m, n in ((0, 3), (3, 0), (-1, 2)):
        assert la(f"linalg_lu_full_{order}", f, m, n, X, 0.0, pr, pc) == -1


@F
@ORDER
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("eps", [0.0, 1e-6])
def test_lu_full_of_what_is_not_finite_has_rank_0(la, order, bad, eps, f):
    for place in range(9):
        A = np.arange(1.0, 10).reshape(3, 3) ** 2
        A.flat[place] = bad
        X, pr, pc = Guarded(store(A, order), DTYPE[f]), Guarded([0] * 3, np.int32), Guarded([0] * 3, np.int32)
        assert la(f"linalg_lu_full_{order}", f, 3, 3, X, eps, pr, pc) == 0
        assert np.array_equal(load(X.value(), (3, 3), order), A.astype(DTYPE[f]), equal_nan=True)


@F
@ORDER
def test_lu_full_threshold_is_relative(la, order, f):
    for scale in (1e-30, 1.0, 1e30):
        for small, rank in ((1e-3, 2), (1e-5, 1)):
            X = Guarded(store(np.diag([scale, small * scale]), order), DTYPE[f])
            pr, pc = Guarded([0] * 2, np.int32), Guarded([0] * 2, np.int32)
            assert la(f"linalg_lu_full_{order}", f, 2, 2, X, 1e-4, pr, pc) == rank
            assert la(f"linalg_lu_full_{order}", f, 2, 2, Guarded(X.x, DTYPE[f]), -1e-4, pr, pc) == rank


@F
@ORDER
def test_published_way_to_solve(la, order, f):
    """lu_full_specified on [A | b], then setBMatrix; the specified column may stand anywhere."""
    random = np.random.default_rng(3)
    for _ in range(40):
        n = int(random.integers(1, 8))
        A, b = of_rank(random, n, n, n), random.integers(-9, 10, n).astype(float)
        at = int(random.integers(0, n + 1))
        M = np.insert(A, at, b, axis=1)
        X, pr, pc = Guarded(store(M, order), DTYPE[f]), Guarded(np.zeros(n), np.int32), Guarded(np.zeros(n + 1), np.int32)
        assert la(f"linalg_lu_full_specified_{order}", f, n, n + 1, X, 1e-7, pr, pc, at) == n
        assert pc.value()[n] == at
        LU = load(X.value(), (n, n + 1), order).astype(float)
        L, U = factors(LU, n)
        assert abs(M[np.ix_(pr.x, pc.x)] - L @ U).max() <= 256 * EPS[f]
        if order == "rmo":
            la("linalg_lu_setBMatrix_rmo", f, n, n + 1, X)
        else:
            la("linalg_lu_setBMatrix_cmo", f, n, n + 1, n, X)
        x = np.empty(n + 1)
        x[pc.x[:n]] = load(X.value(), (n, n + 1), order)[:, n]
        x = np.delete(x, at)
        exact = exact_solve(A, b)
        assert abs(x - exact).max() <= 64 * EPS[f] * np.linalg.cond(A) * max(abs(exact).max(), 1e-30) + 1e-30


@ORDER
def test_lu_full_specified_bounds_and_rank(la, order):
    pr, pc = Guarded([0] * 3, np.int32), Guarded([0] * 3, np.int32)
    X = Guarded(store(np.array([[1.0, 100, 1], [1, 200, 1], [1, 300, 1]]), order), np.float64)
    for bad in (-1, 3, 99):
        assert la(f"linalg_lu_full_specified_{order}", "", 3, 3, X, 0.0, pr, pc, bad) == -1
    assert la(f"linalg_lu_full_specified_{order}", "", 3, 1, X, 0.0, pr, pc, 0) == -1
    assert la(f"linalg_lu_full_specified_{order}", "", 3, 3, X, 1e-12, pr, pc, 1) == 1
    assert pc.value()[2] == 1
    # a NaN in the specified column does not disturb the rank
    A = np.array([[1.0, np.nan, 1], [1, 2, 3], [0, 3, 1]])
    X = Guarded(store(A, order), np.float64)
    assert la(f"linalg_lu_full_specified_{order}", "", 3, 3, X, 1e-12, pr, pc, 1) == 2


@F
@ORDER
def test_B_and_C_matrices(la, order, f):
    """B = U⁻¹ UR: A's dependent columns in terms of the others; C = LR L⁻¹: its dependent rows."""
    for random, m, n, rank in shapes(4, 40):
        A = of_rank(random, m, n, rank)
        X, pr, pc = Guarded(store(A, order), DTYPE[f]), Guarded(np.zeros(m), np.int32), Guarded(np.zeros(n), np.int32)
        assert la(f"linalg_lu_full_{order}", f, m, n, X, 32 * EPS[f], pr, pc) == rank
        la(f"linalg_lu_setCMatrix_{order}", f, m, n, rank, X)
        if order == "rmo":
            la("linalg_lu_setBMatrix_rmo", f, rank, n, X)
            norm = la("linalg_lu_infinityNormB_rmo", f, rank, n, X)
        else:
            la("linalg_lu_setBMatrix_cmo", f, m, n, rank, X)
            norm = la("linalg_lu_infinityNormB_cmo", f, m, n, rank, X)
        got = load(X.value(), (m, n), order).astype(float)
        P = A[np.ix_(pr.x, pc.x)]
        B, C = got[:rank, rank:], got[rank:, :rank]
        tolerance = 512 * EPS[f] * max(abs(A).max(), 1) * max(abs(B).max(initial=1), abs(C).max(initial=1))
        assert abs(P[:, rank:] - P[:, :rank] @ B).max(initial=0) <= tolerance
        assert abs(P[rank:] - C @ P[:rank]).max(initial=0) <= tolerance
        assert norm == abs(B).max(initial=0)


@F
@ORDER
def test_unpivoted_lu(la, order, f):
    random = np.random.default_rng(5)
    for _ in range(30):
        m = int(random.integers(1, 7))
        n = m + int(random.integers(0, 4))
        A = random.normal(size=(m, n)) + 8 * np.eye(m, n)
        X = Guarded(store(A, order), DTYPE[f])
        la(f"linalg_lu_{order}", f, m, n, X)
        LU = load(X.value(), (m, n), order).astype(float)
        L, U = factors(LU, m)
        assert abs(A.astype(DTYPE[f]) - L @ U).max() <= 64 * EPS[f]
    X = Guarded(store(A, order), DTYPE[f])
    la(f"linalg_lu_{order}", f, n + 1, n, X)
    la(f"linalg_lu_{order}", f, 0, n, X)
    assert np.array_equal(X.value(), store(A, order).astype(DTYPE[f]))


# ---- solve ----


def solve(la, f, order, n, A, b, eps, six):
    X, B, x = Guarded(store(A, order), DTYPE[f]), Guarded(b, DTYPE[f]), Guarded(np.zeros(n), DTYPE[f])
    residual = Guarded([0], DTYPE[f])
    if six:
        rank = la(f"linalg_lu_solve6_{order}", f, X, B, x, eps, residual)
    else:
        work, indices = Guarded(np.zeros(n * (n + 2)), DTYPE[f]), Guarded(np.zeros(2 * n + 1), np.int32)
        rank = la(f"linalg_lu_solve_{order}", f, n, X, B, x, eps, residual, work, indices)
        work.value(), indices.value()
    assert np.array_equal(X.value(), store(A, order).astype(DTYPE[f]), equal_nan=True)
    assert np.array_equal(B.value(), np.asarray(b, DTYPE[f]), equal_nan=True)
    return rank, x.value().astype(float), float(residual.value()[0])


SIX = pytest.mark.parametrize("six", [False, True], ids=["n", "6"])


def sizes(random, six):
    return 6 if six else int(random.integers(1, 9))


@F
@ORDER
@SIX
def test_solve_against_fractions(la, six, order, f):
    random = np.random.default_rng(7)
    for scale in (1e-15, 1.0, 1e15):
        for _ in range(15):
            n = sizes(random, six)
            A = (random.normal(size=(n, n)) * scale).astype(DTYPE[f])
            b = random.normal(size=n).astype(DTYPE[f])
            rank, x, residual = solve(la, f, order, n, A, b, n * EPS[f], six)
            exact = exact_solve(A, b)
            assert rank == n
            assert abs(x - exact).max() <= 8 * n * EPS[f] * np.linalg.cond(A.astype(float)) * abs(exact).max()
            # backward stable, and the residual is that of x
            bound = 8 * n * EPS[f] * (abs(A).astype(float) @ abs(x)).max()
            assert residual <= bound
            assert abs(residual - abs(A.astype(float) @ x - b).max()) <= bound


@F
@ORDER
@SIX
def test_B12_pivots_are_sought(la, six, order, f):
    random = np.random.default_rng(8)
    for _ in range(20):
        n = sizes(random, six)
        P, b = np.eye(n)[random.permutation(n)], random.integers(-9, 10, n).astype(float)
        rank, x, residual = solve(la, f, order, n, P, b, 1e-6, six)
        assert rank == n and np.array_equal(x, P.T @ b) and residual == 0
        D = 2.0 ** random.integers(-30, 31, n)
        rank, x, residual = solve(la, f, order, n, P * D, b, 0.0, six)
        assert rank == n and np.array_equal(x, (P.T @ b) / D) and residual == 0


@F
@ORDER
@SIX
def test_solve_of_lower_rank(la, six, order, f):
    """The rank; a solution if there is one; a residual that says so."""
    random = np.random.default_rng(9)
    for _ in range(40):
        n = sizes(random, six)
        rank = int(random.integers(0, n))
        A = of_rank(random, n, n, rank)
        b = A @ random.integers(-3, 4, n)
        got, x, residual = solve(la, f, order, n, A, b, 64 * EPS[f], six)
        assert got == rank
        assert np.count_nonzero(x) <= rank
        assert residual <= 512 * EPS[f] * max(abs(b).max(), 1)
        null = np.linalg.svd(A.T)[2][-1]
        _, x, residual = solve(la, f, order, n, A, b + 10 * null, 64 * EPS[f], six)
        assert residual >= 10 * abs(null).max() / (n * n) / 10
        assert np.isfinite(x).all()


@F
@ORDER
@SIX
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_solve_of_what_is_not_finite(la, six, order, bad, f):
    n = 6
    for eps in (0.0, 1e-6):
        for place in range(36):
            A = np.eye(n) + np.arange(36.0).reshape(n, n) % 7
            A.flat[place] = bad
            rank, x, residual = solve(la, f, order, n, A, np.ones(n), eps, six)
            assert rank == 0 and np.isnan(x).all() and np.isnan(residual)
        b = np.ones(n)
        b[2] = bad
        rank, x, residual = solve(la, f, order, n, np.diag([1.0, 2, 3, 4, 5, 6]), b, eps, six)
        assert rank == n and not np.isfinite(x[2]) and not np.isfinite(residual)


@F
@ORDER
def test_solve_in_place_and_without_residual(la, order, f):
    random = np.random.default_rng(10)
    A, b = random.normal(size=(6, 6)).astype(DTYPE[f]), random.normal(size=6).astype(DTYPE[f])
    work, indices = Guarded(np.zeros(48), DTYPE[f]), Guarded(np.zeros(13), np.int32)
    X = Guarded(store(A, order), DTYPE[f])
    for six in (True, False):
        _, x, _ = solve(la, f, order, 6, A, b, 0.0, six)
        B = Guarded(b, DTYPE[f])
        if six:
            la(f"linalg_lu_solve6_{order}", f, X, B, B, 0.0, None)
        else:
            la(f"linalg_lu_solve_{order}", f, 6, X, B, B, 0.0, None, work, indices)
        assert np.array_equal(B.value(), x.astype(DTYPE[f]))
    assert la(f"linalg_lu_solve_{order}", f, 0, X, B, B, 0.0, None, work, indices) == -1


# ---- symmetric ----


def spd(random, n, f):
    M = random.normal(size=(n, n))
    return (M @ M.T + np.eye(n)).astype(DTYPE[f])


def lower_only(A, order, f):
    """What is above the diagonal must not be read."""
    return Guarded(store(np.where(np.tril(np.ones_like(A)) > 0, A, np.nan), order), DTYPE[f])


@F
@ORDER
@pytest.mark.parametrize("name", ["ldlt", "cholesky"])
def test_factors_of_symmetric_matrices(la, name, order, f):
    random = np.random.default_rng(11)
    for _ in range(30):
        n = int(random.integers(1, 9))
        A = spd(random, n, f)
        X = lower_only(A, order, f)
        assert la(f"linalg_{name}_{order}", f, X, n) == 0
        got = load(X.value(), (n, n), order).astype(float)
        assert np.array_equal(got, got.T)
        if name == "ldlt":
            L = np.tril(got, -1) + np.eye(n)
            assert abs(L @ np.diag(np.diag(got)) @ L.T - A).max() <= 16 * n * EPS[f] * abs(A).max()
        else:
            assert np.allclose(np.tril(got), np.linalg.cholesky(A.astype(float)), rtol=0, atol=32 * n * EPS[f] * np.linalg.cond(A))
            assert abs(np.tril(got) @ np.tril(got).T - A).max() <= 16 * n * EPS[f] * abs(A).max()

        b = random.normal(size=n).astype(DTYPE[f])
        B, x = Guarded(b, DTYPE[f]), Guarded(np.zeros(n), DTYPE[f])
        la(f"linalg_{name}_solve_{order}", f, X, B, x, n)
        exact = exact_solve(A, b)
        assert abs(x.value() - exact).max() <= 16 * n * EPS[f] * np.linalg.cond(A.astype(float)) * abs(exact).max()
        la(f"linalg_{name}_solve_{order}", f, X, B, B, n)
        assert np.array_equal(B.value(), x.value())


@F
@ORDER
@pytest.mark.parametrize("name", ["ldlt", "cholesky", "symmetricMatrixInverse"])
def test_first_pivot_that_is_not_positive(la, name, order, f):
    for k in range(4):
        for bad in (0.0, -1.0, np.nan):
            A = np.diag([2.0, 3, 4, 5])
            A[k, k] = bad
            assert la(f"linalg_{name}_{order}", f, Guarded(store(A, order), DTYPE[f]), 4) == k + 1
    assert la(f"linalg_{name}_{order}", f, Guarded([[1, 2], [2, 1]], DTYPE[f]), 2) == 2
    assert la(f"linalg_{name}_{order}", f, Guarded([[1]], DTYPE[f]), 0) == 0


@F
@ORDER
def test_symmetric_inverse(la, order, f):
    random = np.random.default_rng(12)
    for _ in range(30):
        n = int(random.integers(1, 9))
        A = spd(random, n, f)
        X = lower_only(A, order, f)
        assert la(f"linalg_symmetricMatrixInverse_{order}", f, X, n) == 0
        got = load(X.value(), (n, n), order).astype(float)
        assert np.array_equal(got, got.T)
        exact = np.stack([exact_solve(A, e) for e in np.eye(n)], axis=1)
        assert abs(got - exact).max() <= 16 * n * EPS[f] * np.linalg.cond(A.astype(float)) * abs(exact).max()


@F
@ORDER
@pytest.mark.parametrize("name", ["ldlt", "cholesky"])
def test_B18_triangular_solves_read_the_lower_triangle_only(la, name, order, f):
    """The published cholesky_forwardElimination_cmo read the upper one."""
    random = np.random.default_rng(13)
    for n in (1, 2, 5):
        L = (np.tril(random.normal(size=(n, n)), -1) + np.diag(random.uniform(1, 2, n))).astype(DTYPE[f])
        unit = np.tril(L, -1) + np.eye(n) if name == "ldlt" else L
        stored = L.copy()
        if name == "ldlt":
            stored[range(n), range(n)] = np.nan
        b = random.normal(size=n).astype(DTYPE[f])
        for verb, T in (("forwardElimination", unit), ("backwardSubstitution", unit.T)):
            B, y = Guarded(b, DTYPE[f]), Guarded(np.zeros(n), DTYPE[f])
            la(f"linalg_{name}_{verb}_{order}", f, lower_only(stored, order, f), B, y, n)
            assert abs(y.value() - exact_solve(T, b)).max() <= 32 * EPS[f] * np.linalg.cond(T)
            la(f"linalg_{name}_{verb}_{order}", f, lower_only(stored, order, f), B, B, n)
            assert np.array_equal(B.value(), y.value())


@F
def test_B18_setBMatrix_does_nothing_out_of_range_in_both_orders(la, f):
    A = np.arange(1.0, 7).reshape(2, 3)
    for rank in (-1, 0, 3, 4, 99):
        X = Guarded(A, DTYPE[f])
        la("linalg_lu_setBMatrix_rmo", f, rank, 3, X)
        la("linalg_lu_setBMatrix_cmo", f, 2, 3, rank, X)
        la("linalg_lu_setCMatrix_rmo", f, 2, 3, rank, X)
        la("linalg_lu_setCMatrix_cmo", f, 2, 3, rank, X)
        assert np.array_equal(X.value(), A)
        assert la("linalg_lu_infinityNormB_rmo", f, rank, 3, X) == la("linalg_lu_infinityNormB_cmo", f, 2, 3, rank, X) == 0


# ---- columns ----


@F
def test_B19_gramSchmidt_works_on_the_columns(la, f):
    random = np.random.default_rng(14)
    for _ in range(30):
        n = int(random.integers(1, 6))
        m = n + int(random.integers(0, 4))
        A = random.normal(size=(m, n))
        if n > 1:
            A[:, 1] = A[:, 0] + 1e-3 * A[:, 1]  # nearly dependent
        A *= 10.0 ** random.integers(-25, 25)
        X = Guarded(A, DTYPE[f])
        la("linalg_gramSchmidt", f, X, m, n)
        Q = X.value().astype(float)
        assert abs(Q.T @ Q - np.eye(n)).max() <= 8 * m * EPS[f]
        R = Q.T @ A  # upper triangular, with a positive diagonal
        assert abs(np.tril(R, -1)).max(initial=0) <= 64 * EPS[f] * abs(A).max() and (np.diag(R) > 0).all()


@F
def test_gramSchmidt_of_dependent_columns(la, f):
    A = np.array([[1.0, 2, 0, np.nan, 1, 0], [2, 4, 0, 1, 0, 1], [2, 4, 0, 1, 0, 0]])
    X = Guarded(A, DTYPE[f])
    la("linalg_gramSchmidt", f, X, 3, 6)
    Q = X.value()
    assert np.isnan(Q).all(axis=0).tolist() == [False, True, True, True, False, False]
    assert np.array_equal(np.isnan(Q).any(axis=0), np.isnan(Q).all(axis=0))
    good = Q[:, [0, 4, 5]].astype(float)
    assert abs(good.T @ good - np.eye(3)).max() <= 16 * EPS[f]


@F
def test_pca(la, f):
    random = np.random.default_rng(15)
    for _ in range(20):
        n = int(random.integers(1, 6))
        m = int(random.integers(2, 20))
        A = (random.normal(size=(m, n)) * 10.0 ** random.integers(-2, 3, n) + random.normal(size=n)).astype(DTYPE[f])
        X, mean, variances, axes = (Guarded(x, DTYPE[f]) for x in (A, np.zeros(n), np.zeros(n), np.zeros((n, n))))
        assert la("linalg_pca", f, X, m, n, mean, variances, axes) == 0
        A, V = A.astype(float), axes.value().astype(float)
        scale = abs(A).max()
        assert abs(mean.value() - A.mean(axis=0)).max() <= 16 * EPS[f] * scale
        assert abs(V.T @ V - np.eye(n)).max() <= 64 * EPS[f]
        assert abs(mean.x + X.value().astype(float) @ V.T - A).max() <= 128 * EPS[f] * scale
        expected = np.zeros(n)
        found = np.linalg.svd(A - A.mean(axis=0), compute_uv=False) ** 2 / (m - 1)
        expected[: len(found)] = found
        assert abs(variances.value() - expected).max() <= 256 * EPS[f] * expected[0]
        assert (np.diff(variances.x) <= 0).all() and (variances.x >= 0).all()


@F
def test_pca_refuses(la, f):
    X, mean, variances, axes = (Guarded(x, DTYPE[f]) for x in (np.ones((3, 2)), np.zeros(2), np.zeros(2), np.zeros((2, 2))))
    assert la("linalg_pca", f, X, 1, 2, mean, variances, axes) == -1
    assert la("linalg_pca", f, X, 3, 0, mean, variances, axes) == -1
    for bad in (np.nan, np.inf):
        X.x[1, 1] = bad
        assert la("linalg_pca", f, X, 3, 2, mean, variances, axes) == 1
        assert all(np.isnan(g.value()).all() for g in (X, mean, variances, axes))


def test_B22_float_linear_algebra_exists(ksl):
    """Each double function has its twin."""
    from functions import published

    names = [x.name for x in published() if x.header == "linalg.h" and not x.name.endswith("f")]
    assert len(names) == 32
    assert [n for n in names if not hasattr(ksl.dll, n + "f")] == []
