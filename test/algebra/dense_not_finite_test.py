"""Dense matrices and arrays: a NaN or an infinity reaches every result that depends on it, and no other.

The names in api/functions.tsv whose rows say "documented".  Pivots that are not finite, selections and Gram-Schmidt: linalg_test.py; comparisons,
interpolation and the largest element: array_test.py."""

import ctypes

import numpy as np
import pytest

from linalg_test import DTYPE, ORDER, F, Guarded, la, load, spd, store  # noqa: F401

N = 5
BAD = pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
finite = np.isfinite


def lower(n, f):
    """A lower triangle without zeros, and its right side."""
    random = np.random.default_rng(31)
    return np.tril(random.uniform(1, 2, (n, n))).astype(DTYPE[f]), random.uniform(1, 2, n).astype(DTYPE[f])


@F
@ORDER
@BAD
@pytest.mark.parametrize("name", ["ldlt", "cholesky"])
def test_triangular_solves(la, name, order, f, bad):  # noqa: F811
    L, b = lower(N, f)
    for verb, reached in (("forwardElimination", lambda k: slice(k, None)), ("backwardSubstitution", lambda k: slice(None, k + 1))):

        def solution(L, b, verb=verb):
            B, x = Guarded(b, DTYPE[f]), Guarded(np.zeros(N), DTYPE[f])
            la(f"linalg_{name}_{verb}_{order}", f, Guarded(store(L, order), DTYPE[f]), B, x, N)
            return x.value().copy()

        right = solution(L, b)
        for k in range(N):
            wrong = b.copy()
            wrong[k] = bad
            x, there = solution(L, wrong), np.zeros(N, bool)
            there[reached(k)] = True
            assert not finite(x[there]).any()
            assert np.array_equal(x[~there], right[~there])


@F
@ORDER
@BAD
@pytest.mark.parametrize("name", ["ldlt", "cholesky"])
def test_solves_with_factors(la, name, order, f, bad):  # noqa: F811
    """One number of b is not finite, or one of the factors: every unknown depends on the first, and on some of the second."""
    A = Guarded(store(spd(np.random.default_rng(32), N, f), order), DTYPE[f])
    assert la(f"linalg_{name}_{order}", f, A, N) == 0
    _, b = lower(N, f)

    def solution(A, b):
        B, x = Guarded(b, DTYPE[f]), Guarded(np.zeros(N), DTYPE[f])
        la(f"linalg_{name}_solve_{order}", f, A, B, x, N)
        return x.value()

    for k in range(N):
        wrong = b.copy()
        wrong[k] = bad
        assert not finite(solution(A, wrong)).any()
    for i in range(N):
        for j in range(i):
            factors = load(A.value(), (N, N), order)
            factors[i, j] = bad
            assert not finite(solution(Guarded(store(factors, order), DTYPE[f]), b)).all()


@F
@ORDER
def test_what_is_solved_after_an_lu(la, order, f):  # noqa: F811
    """B = U⁻¹ B takes a NaN up its column; C = C L⁻¹ takes it left along its row; the norm of B is NaN."""
    rank, rows, columns = 3, 5, 6
    A = np.random.default_rng(33).uniform(1, 2, (rows, columns))

    def after(name, A):
        X = Guarded(store(A, order), DTYPE[f])
        size = (rank, columns) if name == "linalg_lu_setBMatrix" and order == "rmo" else (rows, columns, rank)
        la(f"{name}_{order}", f, *size, X)
        return load(X.value(), (rows, columns), order)

    for name, places, reached in (
        ("linalg_lu_setBMatrix", [(i, j) for i in range(rank) for j in range(rank, columns)], lambda i, j: np.s_[: i + 1, j]),
        ("linalg_lu_setCMatrix", [(i, j) for i in range(rank, rows) for j in range(rank)], lambda i, j: np.s_[i, : j + 1]),
    ):
        right = after(name, A)
        for i, j in places:
            wrong, expected = A.copy(), right.copy()
            wrong[i, j] = np.nan
            expected[reached(i, j)] = np.nan
            assert np.array_equal(after(name, wrong), expected, equal_nan=True)
            if name.endswith("BMatrix"):
                X = Guarded(store(wrong, order), DTYPE[f])
                assert np.isnan(la(f"linalg_lu_infinityNormB_{order}", f, *((rank, columns) if order == "rmo" else (rows, columns, rank)), X))


@F
@ORDER
def test_an_lu_without_pivots(la, order, f):  # noqa: F811
    """Rows above a NaN, and columns left of it in its row, stay as they are without it."""
    n = 4
    A = (np.random.default_rng(34).uniform(1, 2, (n, n)) + 4 * np.eye(n)).astype(DTYPE[f])

    def after(A):
        X = Guarded(store(A, order), DTYPE[f])
        la(f"linalg_lu_{order}", f, n, n, X)
        return load(X.value(), (n, n), order)

    right = after(A)
    for i in range(n):
        for j in range(n):
            wrong = A.copy()
            wrong[i, j] = np.nan
            found = after(wrong)
            assert np.isnan(found[i, j]) and np.isnan(found[-1, -1])
            assert np.array_equal(found[:i], right[:i]) or i > j
            assert np.array_equal(found[i, :j], right[i, :j])


@F
@ORDER
@BAD
def test_the_inverse_of_a_symmetric_matrix(la, order, f, bad):  # noqa: F811
    """The pivot that is not above zero is returned, or the inverse is not finite.

    But of ∞ on the diagonal the inverse has zeros in that row and column, the limit; the rest is the inverse of the other rows and columns.
    """
    A = spd(np.random.default_rng(35), N, f)
    for i in range(N):
        for j in range(i + 1):
            wrong = A.copy()
            wrong[i, j] = bad
            X = Guarded(store(wrong, order), DTYPE[f])
            failed = la(f"linalg_symmetricMatrixInverse_{order}", f, X, N)
            if i == j and bad == np.inf:
                rest = [k for k in range(N) if k != i]
                assert not failed and not X.value()[i].any() and not X.value()[:, i].any()
                assert np.allclose(X.value()[np.ix_(rest, rest)], np.linalg.inv(A[np.ix_(rest, rest)].astype(float)), rtol=1e-4 if f else 1e-12)
            else:
                assert failed or not finite(X.value()).all()


@F
@BAD
def test_axpy(ksl, f, bad):
    real = {"": ctypes.c_double, "f": ctypes.c_float}[f]
    call = getattr(ksl.dll, f"ksl_axpy{f}")

    def sums(a, x, y):
        y = np.array(y, DTYPE[f])
        x = np.array(x, DTYPE[f])
        call(3, real(a), ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(y.ctypes.data))
        return y.tolist()

    for k in range(3):
        wrong = [1.0, 2.0, 4.0]
        wrong[k] = bad
        for found, right in ((sums(2, wrong, [1, 1, 1]), [3, 5, 9]), (sums(2, [1, 1, 1], wrong), [3, 4, 6])):
            assert not finite(found[k])
            assert np.delete(found, k).tolist() == np.delete(right, k).tolist()
    assert not finite(sums(bad, [1, 2, 4], [1, 1, 1])).any()


@F
def test_swaps_move_bits(ksl, f):
    """Of a NaN, too: a payload comes back."""
    bits = np.array([0x7FF8_0000_0000_1234, 0x8000_0000_0000_0001] if not f else [0x7FC0_1234, 0x8000_0001], np.uint64 if not f else np.uint32)
    numbers = bits.copy()
    first, second = (ctypes.c_void_p(numbers.ctypes.data + k * numbers.itemsize) for k in range(2))
    getattr(ksl.dll, f"ksl_swap{f}")(first, second)
    assert numbers.tolist() == bits[::-1].tolist()
    getattr(ksl.dll, f"ksl_swapArray{f}")(1, first, 1, second, 1)
    assert numbers.tolist() == bits.tolist()
