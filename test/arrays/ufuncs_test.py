"""Generalised ufuncs keep NumPy's rules: broadcasting, out=, dtypes, any memory layout; a few are checked by matrices."""

import numpy as np
import pytest

from ksl import ufuncs

NAMES = [name for name in ufuncs.__all__ if isinstance(getattr(ufuncs, name), np.ufunc)]


def rotations(random, shape):
    q, r = np.linalg.qr(random.normal(size=(*shape, 3, 3)))
    q = q * np.sign(np.linalg.det(q))[..., None, None]
    return q


def sample(random, core, shape, dtype):
    if core == (3, 3):
        x = rotations(random, shape)
    elif core == (4, 3):
        x = np.concatenate([rotations(random, shape), random.normal(size=(*shape, 1, 3))], axis=-2)
    else:
        x = random.normal(size=(*shape, *core))
    return x.astype(dtype)


def cores(name):
    """Core shapes of the inputs and of the output."""
    left, right = getattr(ufuncs, name).signature.split("->")
    read = lambda text: [tuple(int(i) for i in part.split(",") if i) for part in text.strip("()").split("),(")]
    return read(left), read(right)[0]


def arguments(name, *shapes, dtype=float, seed=0):
    random = np.random.default_rng(seed)
    inputs, _ = cores(name)
    return [sample(random, core, shape, dtype) for core, shape in zip(inputs, shapes * 2)]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_shapes_and_dtypes(name, dtype):
    f = getattr(ufuncs, name)
    inputs, out = cores(name)
    x = arguments(name, (5, 7), dtype=dtype)
    y = f(*x)
    assert y.shape == (5, 7, *out) and y.dtype == dtype
    item = f(*[a[3, 2] for a in x])
    assert np.array_equal(y[3, 2], item)
    into = np.empty_like(y)
    assert f(*x, out=into) is into and np.array_equal(into, y)
    assert f(*[a[:0] for a in x]).shape == (0, 7, *out)


@pytest.mark.parametrize("name", NAMES)
def test_memory_layouts_make_no_difference(name):
    """Negative strides, gaps, core axes that are not neighbours, addresses that are not aligned, foreign byte order."""
    f = getattr(ufuncs, name)
    x = arguments(name, (90,))
    expected = f(*x)
    assert np.array_equal(f(*[a[::-1] for a in x])[::-1], expected)
    assert np.array_equal(f(*[np.repeat(a, 3, axis=0)[::3] for a in x]), expected)
    assert np.array_equal(f(*[np.asfortranarray(a) for a in x]), expected)
    assert np.array_equal(f(*[a.astype(">f8") for a in x]), expected)
    shifted = []
    for a in x:
        raw = np.zeros(a.nbytes + 1, np.uint8)
        b = raw[1:].view(a.dtype).reshape(a.shape)
        b[...] = a
        shifted.append(b)
    assert np.array_equal(f(*shifted), expected)
    if expected.ndim > 1:
        last = np.repeat(x[-1], 2, axis=-1)[..., ::2]  # numbers of an item two apart
        assert np.array_equal(f(*x[:-1], last), expected)
        into = np.zeros((*expected.shape[:-1], 2 * expected.shape[-1]))
        f(*x, out=into[..., ::2])
        assert np.array_equal(into[..., ::2], expected) and not into[..., 1::2].any()
    into = np.zeros((2 * len(expected), *expected.shape[1:]))
    f(*x, out=into[::-2])
    assert np.array_equal(into[::-2], expected) and not into[::2].any()


@pytest.mark.parametrize("name", [n for n in NAMES if len(cores(n)[0]) == 2])
def test_broadcasting(name):
    f = getattr(ufuncs, name)
    a, b = arguments(name, (6, 1))[0], arguments(name, (9,), (9,))[1]
    y = f(a, b)
    assert y.shape == (6, 9, *cores(name)[1])
    full = f(np.broadcast_to(a, (6, 9, *a.shape[2:])).copy(), np.broadcast_to(b, (6, 9, *b.shape[1:])).copy())
    assert np.array_equal(y, full)
    assert np.array_equal(f(a[0, 0], b), full[0])
    assert np.array_equal(f(a[:, 0], b[0]), full[:, 0])


@pytest.mark.parametrize("name", NAMES)
def test_docstrings_say_shapes_and_cost(name):
    doc = getattr(ufuncs, name).__doc__
    assert "flops" in doc and "returns:" in doc and "float32 and float64" in doc


def test_overlapping_memory_is_numpys_rule():
    """The result is as if the inputs had been copied first."""
    D, c = arguments("product_CoAdc", (50,))
    expected = ufuncs.product_CoAdc(D, c)
    again = c.copy()
    ufuncs.product_CoAdc(D, again, out=again)
    assert np.array_equal(again, expected)
    memory = np.concatenate([c, np.zeros((1, 6))])
    ufuncs.product_CoAdc(D, memory[:-1], out=memory[1:])
    assert np.array_equal(memory[1:], expected)


def test_mixed_and_whole_numbers_become_double():
    D, c = arguments("product_CoAdc", (4,))
    assert ufuncs.product_CoAdc(D.astype(np.float32), c).dtype == np.float64
    assert ufuncs.product_CoAdc(D, np.arange(6)).dtype == np.float64
    assert ufuncs.product_CoAdc(D.astype(np.float32), c.astype(np.float32), dtype=float).dtype == np.float64


def test_wrong_shapes_are_refused():
    D, c = arguments("product_CoAdc", (4,))
    with pytest.raises(ValueError, match="mismatch"):
        ufuncs.product_CoAdc(D, c[:, :5])
    with pytest.raises(ValueError, match="mismatch"):
        ufuncs.product_CoAdc(ufuncs.matrices(D), c)
    with pytest.raises(TypeError):
        ufuncs.product_CoAdc(D, c.astype(complex))


def tilde(v):
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return out - np.swapaxes(out, -1, -2)


def adjoint(D):
    R, t = np.swapaxes(D[..., :3, :], -1, -2), D[..., 3, :]
    X = np.zeros((*t.shape[:-1], 6, 6))
    X[..., :3, :3] = X[..., 3:, 3:] = R
    X[..., :3, 3:] = tilde(t) @ R
    return X


def apply(X, s):
    return (X @ s[..., None])[..., 0]


def test_adjoints_are_the_matrices():
    D, s = arguments("product_Ads", (30,))
    X = adjoint(D)
    dual = np.linalg.inv(np.swapaxes(X, -1, -2))
    assert np.allclose(ufuncs.product_Ads(D, s), apply(X, s), atol=1e-13)
    assert np.allclose(ufuncs.product_Adinvs(D, s), apply(np.linalg.inv(X), s), atol=1e-13)
    assert np.allclose(ufuncs.product_CoAdc(D, s), apply(dual, s), atol=1e-13)
    assert np.allclose(ufuncs.product_CoAdinvc(D, s), apply(np.linalg.inv(dual), s), atol=1e-13)
    assert np.allclose(ufuncs.product_CoAdcinv(D, s), -apply(dual, s), atol=1e-13)
    assert np.array_equal(ufuncs.product_Adrs(D[:, :3], s), ufuncs.product_Ads(np.concatenate([D[:, :3], 0 * D[:, 3:]], axis=1), s))


def test_poses_are_the_matrices():
    D, E = arguments("product_dd", (30,))
    A, B = ufuncs.matrices(D), ufuncs.matrices(E)
    assert np.allclose(ufuncs.matrices(ufuncs.product_dd(D, E)), A @ B, atol=1e-13)
    assert np.allclose(ufuncs.matrices(ufuncs.product_dinvd(D, E)), np.linalg.inv(A) @ B, atol=1e-13)
    assert np.allclose(ufuncs.matrices(ufuncs.product_ddinv(D, E)), A @ np.linalg.inv(B), atol=1e-13)
    assert np.allclose(ufuncs.matrices(ufuncs.SE3_inverted(D)), np.linalg.inv(A), atol=1e-13)
    assert np.array_equal(ufuncs.poses(A), D) and np.array_equal(ufuncs.poses(A[..., :3, :]), D)
    assert np.allclose(ufuncs.SE3_exp(ufuncs.SE3_log(D)), D, atol=1e-12)
    v = np.random.default_rng(3).normal(size=(30, 3))
    assert np.allclose(ufuncs.product_dv(D, v), apply(A[:, :3, :3], v) + A[:, :3, 3], atol=1e-13)
    assert np.allclose(ufuncs.product_drv(D[:, :3], v), apply(A[:, :3, :3], v), atol=1e-13)


def test_power_does_not_depend_on_the_frame():
    D, s = arguments("product_Ads", (40,))
    c = np.random.default_rng(4).normal(size=s.shape)
    assert np.allclose(ufuncs.dot_cs(ufuncs.product_CoAdc(D, c), ufuncs.product_Ads(D, s)), (c * s).sum(axis=-1), atol=1e-12)


def test_a_million_by_a_million_is_one_call():
    n = 1_000_000
    random = np.random.default_rng(5)
    D, c = random.normal(size=(n, 4, 3)), random.normal(size=(n, 6))
    y = ufuncs.product_CoAdc(D, c)
    k = np.arange(0, n, 99_991)
    assert np.array_equal(y[k], ufuncs.product_CoAdc(D[k], c[k]))


@pytest.fixture
def threads():
    """ufuncs.set_threads, undone after the test."""
    before = ufuncs.set_threads(1)
    yield ufuncs.set_threads
    ufuncs.set_threads(before)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_threads_make_no_difference(threads, dtype):
    """Plain operands, operands that are copied, in place; a number of items that no number of threads divides."""
    D, c = arguments("product_CoAdc", (200_003,), dtype=dtype)
    foreign = np.asfortranarray(c)
    threads(1)
    expected = ufuncs.product_CoAdc(D, c)
    for n in (2, 3, 7, 0):
        threads(n)
        assert np.array_equal(ufuncs.product_CoAdc(D, c), expected)
        assert np.array_equal(ufuncs.product_CoAdc(D, foreign), expected)
        assert np.array_equal(ufuncs.product_CoAdc(D[0], c), ufuncs.product_CoAdc(np.repeat(D[:1], len(c), axis=0), c))
        again = c.copy()
        assert np.array_equal(ufuncs.product_CoAdc(D, again, out=again), expected)


def test_the_number_of_threads_is_checked(threads):
    assert threads(3) == 1 and threads(0) == 3
    for wrong in (-1, 5000):
        with pytest.raises(ValueError, match="0 for all cores"):
            threads(wrong)
    with pytest.raises(ValueError, match="0 for all cores"):
        threads("2")
    assert threads(1) == 0


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_large_results_wherever_they_begin(threads, dtype):
    """They are written past the caches, line by line; nothing beside them changes."""
    n = 10_000_003 // 24
    D, c = arguments("product_CoAdc", (1000,), dtype=dtype)
    D, c = np.resize(D, (n, 4, 3)), np.resize(c, (n, 6))
    expected = np.resize(ufuncs.product_CoAdc(D[:1000], c[:1000]), (n, 6))
    for begin in (0, 1, 3, 8, 15):
        memory = np.full(6 * n + 40, 7, dtype)
        ufuncs.product_CoAdc(D, c, out=memory[begin : begin + 6 * n].reshape(n, 6))
        assert np.array_equal(memory[begin : begin + 6 * n].reshape(n, 6), expected)
        assert (memory[:begin] == 7).all() and (memory[begin + 6 * n :] == 7).all()


def test_the_first_line_says_that_rotations_are_transposed():
    """Of each function with a pose or a rotation among its operands, and of no other one."""
    functions = [f for f in (getattr(ufuncs, name) for name in ufuncs.__all__) if isinstance(f, np.ufunc)]
    assert len(functions) > 25
    for f in functions:
        first = f.__doc__.split("\n\n")[1]
        assert ("the transpose of the usual matrix" in first) == ("(4,3)" in f.signature or "(3,3)" in f.signature), f.__name__
