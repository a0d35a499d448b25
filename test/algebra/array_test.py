"""Arrays of any length.  Two-dimensional arrays on the heap: c_functions_test.cpp."""

import ctypes

import numpy as np
import pytest

DTYPE = {"": np.float64, "f": np.float32, "i": np.int32}
C = {"": ctypes.c_double, "f": ctypes.c_float, "i": ctypes.c_int}
F = pytest.mark.parametrize("f", ["", "f"])
GUARD = 77


def array(x, f):
    """A copy with a number before and behind it that no call may change."""
    whole = np.concatenate([[GUARD], np.ravel(x), [GUARD]]).astype(DTYPE[f])
    return whole[1:-1]


def pointer(a):
    assert a.base[0] == a.base[-1] == GUARD
    return ctypes.c_void_p(a.ctypes.data)


def close(ksl, f, a, b):
    call = getattr(ksl.dll, f"ksl_allclose{f}")
    call.restype = ctypes.c_bool
    a, b = array(a, f), array(b, f)
    return call(len(a), pointer(a), pointer(b))


@pytest.mark.parametrize("f", ["", "f", "i"])
def test_swap(ksl, f):
    a, b = array([3], f), array([4], f)
    getattr(ksl.dll, f"ksl_swap{f}")(pointer(a), pointer(b))
    assert (a[0], b[0]) == (4, 3)
    getattr(ksl.dll, f"ksl_swap{f}")(pointer(a), pointer(a))
    assert a[0] == 4


@F
def test_axpy(ksl, f):
    for n in (0, -1, 1, 5):
        x, y = array(np.arange(1, 6), f), array(np.arange(5) * 10, f)
        expected = y + np.where(np.arange(5) < n, 3 * x, 0)
        getattr(ksl.dll, f"ksl_axpy{f}")(n, C[f](3), pointer(x), pointer(y))
        pointer(x), pointer(y)
        assert np.array_equal(y, expected)
    getattr(ksl.dll, f"ksl_axpy{f}")(5, C[f](3), pointer(x), pointer(x))
    assert np.array_equal(x, 4 * np.arange(1, 6))


@F
def test_B15_allclose(ksl, f, capfd):
    inf, nan = np.inf, np.nan
    assert close(ksl, f, [1, -2, 3], [1, -2, 3])
    assert close(ksl, f, [0, 1000], [0.9e-6, 1000.0009])
    assert not close(ksl, f, [0], [1.1e-6])
    assert not close(ksl, f, [1, 2, 3], [1, 2, 3.1])
    assert not close(ksl, f, [1000, 0], [1000, 5e-6]), "each pair has a bound of its own"
    # NaN is close to nothing, an infinity to itself
    for a, b in ((nan, nan), (nan, 1), (1, nan), (inf, 1), (1, -inf), (inf, -inf), (nan, inf)):
        assert not close(ksl, f, [0, a], [0, b])
    assert close(ksl, f, [inf, -inf], [inf, -inf])
    largest = np.finfo(DTYPE[f]).max
    assert not close(ksl, f, [largest], [-largest])
    # symmetric
    random = np.random.default_rng(1)
    for scale in (1, 1e3):
        for _ in range(2000):
            a = random.normal(size=1) * scale
            b = a * (1 + 2e-6 * random.normal(size=1))
            assert close(ksl, f, a, b) == close(ksl, f, b, a)
    # at the edge: 1e-6 of the larger, whichever it is
    a, b = [1e6], [1e6 + (1.0000005 if f == "" else 0.9375)]
    assert close(ksl, f, a, b) and close(ksl, f, b, a)
    # silent
    assert capfd.readouterr() == ("", "")


def test_allclosei(ksl):
    assert close(ksl, "i", [1, 2], [1, 2])
    assert not close(ksl, "i", [1, 2], [1, 3])
    assert close(ksl, "i", [], [])


@F
def test_arraylerp(ksl, f):
    y1, y2 = array([1, -4, 3], f), array([3, 4, np.inf], f)
    for p, expected in ((0, y1), (-5, y1), (0.9e-9, y1), (1, y2), (7, y2), (0.25, [1.5, -2, np.inf])):
        y = array([0, 0, 0], f)
        getattr(ksl.dll, f"ksl_arraylerp{f}")(3, C[f](p), pointer(y1), pointer(y2), pointer(y))
        assert np.array_equal(y, expected)
    getattr(ksl.dll, f"ksl_arraylerp{f}")(3, C[f](np.nan), pointer(y1), pointer(y2), pointer(y))
    assert np.isnan(y).all()
    getattr(ksl.dll, f"ksl_arraylerp{f}")(3, C[f](0.25), pointer(y1), pointer(y2), pointer(y1))
    assert y1.tolist() == [1.5, -2, np.inf]


@F
def test_maxIndex(ksl, f):
    call = getattr(ksl.dll, f"ksl_maxIndex{f}")
    for x, k in (([1, -5, 5, 2], 1), ([1, 2, -7], 2), ([0, 0], 0), ([3], 0), ([1, np.nan, 9, np.nan], 1), ([-np.inf, np.inf], 0)):
        a = array(x, f)
        assert call(len(x), pointer(a)) == k
    assert call(0, pointer(a)) == call(-3, pointer(a)) == call(0, None) == 0, "of nothing it is 0, as published"


@F
def test_swapArray(ksl, f):
    a, b = array(np.arange(6), f), array(np.arange(10, 16), f)
    getattr(ksl.dll, f"ksl_swapArray{f}")(3, pointer(a), 2, pointer(b), 1)
    assert a.tolist() == [10, 1, 11, 3, 12, 5] and b.tolist() == [0, 2, 4, 13, 14, 15]
    getattr(ksl.dll, f"ksl_swapArray{f}")(2, pointer(a), 1, pointer(b), 3)
    assert a.tolist() == [0, 13, 11, 3, 12, 5] and b.tolist() == [10, 2, 4, 1, 14, 15]
    getattr(ksl.dll, f"ksl_swapArray{f}")(2, pointer(a), 1, pointer(b), 3)
    for n in (0, -2):
        getattr(ksl.dll, f"ksl_swapArray{f}")(n, pointer(a), 1, pointer(b), 1)
    assert a.tolist() == [10, 1, 11, 3, 12, 5]
