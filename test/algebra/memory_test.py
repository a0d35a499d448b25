"""Allocation, access by index, and storing screws in matrices."""

import ctypes

import numpy as np
import pytest

from functions import SIZES, everything
from library import CTYPE, DTYPE

FUNCTIONS = everything()
LIBC = ctypes.CDLL(None)
LIBC.free.argtypes = [ctypes.c_void_p]
IDENTITY = {"mat3x3": np.eye(3).ravel(), "SE3": np.append(np.eye(3).ravel(), [0, 0, 0]), "mat4x4": np.eye(4).ravel(), "quaternion": np.array([0, 0, 0, 1])}


@pytest.mark.parametrize("name", [n for n in FUNCTIONS if n.endswith("_alloc")])
def test_alloc(ksl, name):
    t = FUNCTIONS[name].returns
    n = t.numbers()
    for count in (1, 2, 1000):
        (address,), _ = ksl(name, count)
        x = np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(CTYPE[t.scalar])), (count, n)).copy()
        LIBC.free(address)
        assert np.array_equal(x, np.tile(IDENTITY.get(t.base, np.zeros(n)), (count, 1)))
    assert ksl(name, 0)[0] == [None]
    assert ksl(name, -1)[0] == [None]


def test_alloc_is_complete():
    assert sum(n.endswith("_alloc") for n in FUNCTIONS) == 20


@pytest.mark.parametrize("f", ["", "f"])
@pytest.mark.parametrize("kind", ["mat3x3", "SE3", "mat4x4"])
def test_get_and_set(ksl, kind, f):
    t = FUNCTIONS[f"ksl_{kind}{f}_get"].args[0]
    x = np.arange(1, SIZES[kind] + 1, dtype=DTYPE[t.scalar])[None]
    rows = 4 if kind == "mat4x4" else 3
    for r in range(rows):
        for c in range(SIZES[kind] // rows):
            assert ksl(f"ksl_{kind}{f}_get", x, r, c)[0][0] == x[0, rows * c + r]
            _, after = ksl(f"ksl_{kind}{f}_set", x, r, c, 99.0)
            expected = x.copy()
            expected[0, rows * c + r] = 99
            assert np.array_equal(after[0], expected)


@pytest.mark.parametrize("f", ["", "f"])
@pytest.mark.parametrize("sign, verb", [(1, "copy"), (-1, "ncopy")])
@pytest.mark.parametrize("order", ["rmo", "cmo"])
def test_copy_into_a_matrix(ksl, order, sign, verb, f):
    dtype = np.float32 if f else np.float64
    s = np.array([[1.5, -2, 3, 4, -5, 6]], dtype)
    rows, columns, row, column = 9, 5, 2, 3
    A = np.arange(rows * columns, dtype=dtype).reshape(rows, columns)
    expected = A.copy()
    expected[row : row + 6, column] = sign * s[0]
    stored = A if order == "rmo" else A.T
    _, after = ksl(f"ksl_screw{f}_{verb}_{order}", s, np.ascontiguousarray(stored).reshape(1, -1), row, column, columns if order == "rmo" else rows)
    got = after[1].reshape(stored.shape)
    assert np.array_equal(got if order == "rmo" else got.T, expected)


def test_vec4i(ksl):
    assert ksl("ksl_vec4i", 3, -4, 5, -6)[0].tolist() == [[3, -4, 5, -6]]


def test_vec3i(ksl):
    assert ksl("ksl_vec3i", 3, -4, 5)[0].tolist() == [[3, -4, 5]]
    a = np.array([[1, 2, 3]] * 4, np.int32)
    b = np.array([[1, 2, 3], [0, 2, 3], [1, 0, 3], [1, 2, 0]], np.int32)
    assert ksl("ksl_vec3i_isEqual", a, b)[0].tolist() == [True, False, False, False]
