"""ksl.Pose, Twist, Acceleration, Wrench, Momentum, Inertia: laws, shapes, and what is refused with which words."""

import pickle
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ksl

KINDS = {"Twist": ksl.Twist, "Acceleration": ksl.Acceleration, "Wrench": ksl.Wrench, "Momentum": ksl.Momentum}
ORDERS = ("lin_ang", "ang_lin")

orders = st.sampled_from(ORDERS)
kinds = st.sampled_from(list(KINDS.values()))
seeds = st.integers(0, 2**32 - 1)
shapes = st.sampled_from([(), (1,), (3,), (2, 3), (0,)])


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def pose(r: np.random.Generator, shape=(), to=None, of=None, angle=3.0) -> ksl.Pose:
    s = r.normal(size=(*shape, 6))
    s[..., 3:] *= angle * r.uniform(size=(*shape, 1)) / np.linalg.norm(s[..., 3:], axis=-1, keepdims=True)
    return ksl.Pose.exp(ksl.Twist(s)).named(to, of)


def inertia(r: np.random.Generator, shape=(), frame=None) -> ksl.Inertia:
    A = r.normal(size=(*shape, 3, 3))
    return ksl.Inertia(r.uniform(0.1, 5, size=shape), r.normal(size=(*shape, 3)), A @ np.swapaxes(A, -1, -2), frame=frame)


def close(a, b, tolerance=1e-12) -> bool:
    return a.allclose(b, rtol=tolerance, atol=tolerance * 10)


# laws


@given(seeds, kinds, orders, shapes)
def test_a_product_of_poses_acts_as_one_after_the_other(seed, kind, order, shape):
    r = rng(seed)
    ab, bc, x = pose(r, shape, "a", "b"), pose(r, (), "b", "c"), kind(r.normal(size=(*shape, 6)), order=order, frame="c")
    assert close((ab @ bc) @ x, ab @ (bc @ x))
    assert ((ab @ bc).to, (ab @ bc).of, ((ab @ bc) @ x).frame) == ("a", "c", "a")


@given(seeds, orders, shapes)
def test_power_is_the_same_in_every_frame(seed, order, shape):
    r = rng(seed)
    X, v, f = pose(r, shape, "a", "b"), ksl.Twist(r.normal(size=6), order=order, frame="b"), ksl.Wrench(r.normal(size=(*shape, 6)), order=order, frame="b")
    assert np.allclose((X @ f) @ (X @ v), f @ v, rtol=1e-10, atol=1e-10)
    assert np.shape(f @ v) == shape
    assert np.allclose(f @ v, np.sum(f.lin * v.lin + f.ang * v.ang, axis=-1))


@given(seeds, shapes)
def test_the_inverse_undoes(seed, shape):
    r = rng(seed)
    X, Y = pose(r, shape, "a", "b"), pose(r, shape, "b", "c")
    assert close(X @ X.inv(), ksl.Pose.identity(to="a", of="a")) and close((X @ Y).inv(), Y.inv() @ X.inv())
    assert (X.inv().to, X.inv().of) == ("b", "a")


@given(seeds, kinds, orders, shapes)
def test_adjoint_matrices_do_what_products_do(seed, kind, order, shape):
    r = rng(seed)
    X, x = pose(r, shape), kind(r.normal(size=(*shape, 6)), order=order)
    matrix = X.CoAd(order) if kind in (ksl.Wrench, ksl.Momentum) else X.Ad(order)
    assert np.allclose((matrix @ x.array[..., None])[..., 0], (X @ x).array)
    assert np.allclose(X.CoAd(order), np.swapaxes(np.linalg.inv(X.Ad(order)), -1, -2))


@given(seeds, kinds)
def test_the_order_is_only_how_numbers_are_stored(seed, kind):
    r = rng(seed)
    X, M, v, x = pose(r), inertia(r), ksl.Twist(r.normal(size=6)), kind(r.normal(size=6))
    turned = x.in_order("ang_lin")
    assert np.array_equal(turned.array, x.array[[3, 4, 5, 0, 1, 2]]) and np.array_equal(turned.lin, x.lin) and np.array_equal(turned.ang, x.ang)
    assert close((X @ turned).in_order("lin_ang"), X @ x)
    assert close(v.in_order("ang_lin").cross(turned).in_order("lin_ang"), v.cross(x))
    assert close((M @ v.in_order("ang_lin")).in_order("lin_ang"), M @ v)
    assert np.allclose(M.matrix("ang_lin") @ v.in_order("ang_lin").array, (M @ v.in_order("ang_lin")).array)


@given(seeds, st.sampled_from([1e-12, 1e-5, 0.03, 0.0317, 1.0, 3.1, np.pi - 1e-9]), orders)
def test_the_logarithm_undoes_the_exponential(seed, angle, order):
    r = rng(seed)
    axis = r.normal(size=3)
    s = ksl.Twist.from_parts(r.normal(size=3), angle * axis / np.linalg.norm(axis), frame="a", order=order)
    X = ksl.Pose.exp(s)
    assert np.allclose(X.R.T @ X.R, np.eye(3), atol=1e-14) and (X.to, X.of) == ("a", "a")
    assert np.allclose(X.log(order).lin, s.lin, atol=1e-13, rtol=1e-13)
    assert np.allclose(X.log(order).ang, s.ang, atol=1e-14, rtol=1e-12)
    assert close(ksl.Pose.exp(X.log()), X) and close(X @ X.log(), X.log())


def series(s: np.ndarray) -> np.ndarray:
    """exp of a 4×4 matrix by halving and squaring, without any formula for rotations."""
    A = np.zeros((4, 4))
    A[:3, :3], A[:3, 3] = np.cross(np.eye(3), s[3:]), s[:3]
    A = A.astype(np.longdouble) / 2**10
    E = term = np.eye(4, dtype=np.longdouble)
    for k in range(1, 16):
        term = term @ A / k
        E = E + term
    for _ in range(10):
        E = E @ E
    return E


@given(seeds, st.sampled_from([1e-9, 0.02, 0.5, 3.0, 6.0]))
def test_the_exponential_is_that_of_the_matrix(seed, size):
    s = rng(seed).normal(size=6) * size
    assert np.allclose(ksl.Pose.exp(ksl.Twist(s)).matrix, series(s).astype(float), rtol=1e-12, atol=1e-12)


def test_half_a_turn_and_no_turn_have_a_logarithm():
    for R in (np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1]), np.eye(3)):
        X = ksl.Pose.from_Rt(R, [1, 2, 3])
        assert close(ksl.Pose.exp(X.log()), X)


@given(seeds, shapes)
def test_the_equation_of_motion_is_the_same_in_every_frame(seed, shape):
    r = rng(seed)
    X, M = pose(r, shape, "a", "b"), inertia(r, shape, "b")
    v, a = ksl.Twist(r.normal(size=(*shape, 6)), frame="b"), ksl.Acceleration(r.normal(size=(*shape, 6)), frame="b")

    def newton_euler(M, v, a):
        return M @ a + v.cross(M @ v)

    assert close(newton_euler(X @ M, X @ v, X @ a), X @ newton_euler(M, v, a), 1e-10)
    assert np.allclose((M @ v).array, (M.matrix() @ v.array[..., None])[..., 0])


@given(seeds)
def test_cross_products(seed):
    """Dual of each other, and the Jacobi identity; in numbers, the matrices of the conventions."""
    r = rng(seed)
    a, b, c = (ksl.Twist(r.normal(size=6)) for _ in range(3))
    f = ksl.Wrench(r.normal(size=6))
    assert isinstance(a.cross(b), ksl.Acceleration) and isinstance(a.cross(f), ksl.Wrench)
    assert np.isclose(a.cross(f) @ b, -(f @ ksl.Twist(a.cross(b).array)))
    assert close(a.cross(b.cross(c)) + b.cross(c.cross(a)) + c.cross(a.cross(b)), ksl.Acceleration(np.zeros(6)))
    assert np.allclose(a.cross(f).lin, np.cross(a.ang, f.lin)) and np.allclose(a.cross(f).ang, np.cross(a.ang, f.ang) + np.cross(a.lin, f.lin))


@given(seeds)
def test_an_inertia_is_its_points(seed):
    """Four points with masses, without any formula for inertias: p = Σ m (v + ω × r), l = Σ r × m (v + ω × r)."""
    r = rng(seed)
    masses, points, v = r.uniform(1, 2, size=4), r.normal(size=(4, 3)), ksl.Twist(r.normal(size=6))
    com = masses @ points / masses.sum()
    d = points - com
    tensor = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, d, strict=True))
    M = ksl.Inertia(masses.sum(), com, tensor)
    speeds = masses[:, None] * (v.lin + np.cross(v.ang, points))
    assert np.allclose((M @ v).lin, speeds.sum(axis=0)) and np.allclose((M @ v).ang, np.cross(points, speeds).sum(axis=0))
    assert np.isclose((M @ v) @ v, (speeds**2 / masses[:, None]).sum())
    assert np.isclose(M.mass, masses.sum()) and np.allclose(M.com, com) and np.allclose(M.tensor, tensor)
    assert close(ksl.Inertia.from_numbers(M.numbers), M) and np.allclose(M.tensor_at_origin, M.matrix()[3:, 3:])
    parts = [ksl.Inertia(m, p, np.zeros((3, 3))) for m, p in zip(masses, points, strict=True)]
    assert close(parts[0] + parts[1] + parts[2] + parts[3], M)
    X = pose(r)
    assert np.allclose((X @ M).com, X.R @ com + X.t) and np.allclose((X @ M).tensor, X.R @ tensor @ X.R.T)


def test_an_inertia_without_mass_has_its_centroid_at_zero():
    M = ksl.Inertia(0, [1, 2, 3], np.eye(3))
    assert M.com.tolist() == [0, 0, 0] and np.array_equal(M.tensor, np.eye(3))


def test_arithmetic():
    v, w = ksl.Twist([1, 2, 3, 4, 5, 6], frame="b"), ksl.Twist([6, 5, 4, 3, 2, 1], frame="b")
    assert (v + w).array.tolist() == [7] * 6 and (v - w + w) == v and (-v).array.tolist() == [-1, -2, -3, -4, -5, -6] and +v is v
    assert 2 * v == v * 2 == v + v == v / 0.5 == np.array(2) * v == np.float64(2) * v
    assert (np.arange(3) * v).array[:, 0].tolist() == [0, 1, 2]
    assert v != w and v != v.named("c") and v != v.in_order("ang_lin") and v != ksl.Wrench(v.array, frame="b") and v != 1


# shapes, dtypes, memory


@given(seeds, shapes, st.sampled_from([(), (3,), (2, 1), (1, 1)]))
def test_leading_shapes_broadcast(seed, left, right):
    try:
        shape = np.broadcast_shapes(left, right)
    except ValueError:
        return
    r = rng(seed)
    X, Y, v, M = pose(r, left), pose(r, right), ksl.Twist(r.normal(size=(*right, 6))), inertia(r, right)
    f = ksl.Wrench(r.normal(size=(*left, 6)))
    for result in (X @ Y, X @ v, X @ M, inertia(r, left) @ v, ksl.Twist(f.array).cross(v), v.cross(f), ksl.Twist(f.array) + v, inertia(r, left) + M):
        assert result.shape == shape
    assert np.shape(f @ v) == shape
    one = X[(0,) * len(left)] if 0 not in left else None
    if one is not None and 0 not in right:
        assert close((X @ Y)[(0,) * len(shape)], one @ Y[(0,) * len(right)])


NARROW, WIDE = np.float32, np.float64


@pytest.mark.parametrize(("left", "right", "result"), [(NARROW, NARROW, NARROW), (WIDE, WIDE, WIDE), (NARROW, WIDE, WIDE), (WIDE, NARROW, WIDE)])
@pytest.mark.parametrize("shape", [(), (3,)])
def test_dtypes_are_kept_or_promoted(left, right, result, shape):
    r = rng(0)
    X, M, v = pose(r, shape).astype(left), inertia(r, shape).astype(left), ksl.Twist(r.normal(size=(*shape, 6)).astype(right))
    f = ksl.Wrench(r.normal(size=(*shape, 6)).astype(left))
    assert X.dtype == M.dtype == f.dtype == left and v.dtype == right
    for x in (X @ v, X @ pose(r, shape).astype(right), M @ v, v.cross(f), f @ v, pose(r).astype(right) @ M, X @ v * 2, 0.5 * (X @ v)):
        assert x.dtype == result
    for x in (X.matrix, X.R, X.Ad(), X.CoAd("ang_lin"), X.log(), ksl.Pose.exp(X.log()), X.inv(), M.com, M.tensor, M.matrix(), 2 * f, f / 3, -f, M + M):
        assert x.dtype == left
    assert close((X @ v).astype(WIDE), X.astype(WIDE) @ v.astype(WIDE), 1e-6)


def test_other_numbers_become_float64():
    for dtype in (int, np.float16, np.uint8, np.longdouble, bool, ">f4"):
        assert ksl.Twist(np.ones(6, dtype)).dtype == np.float64 and ksl.Pose(np.eye(4).astype(dtype)).dtype == np.float64
    assert ksl.Twist(np.ones(6, np.float32)).astype(np.float64).dtype == np.float64
    assert (ksl.Twist(np.ones(6, np.float32)) * np.ones(3)).dtype == np.float64


def test_memory_is_shared_and_never_written():
    columns, x = np.ascontiguousarray(np.broadcast_to(np.eye(4, 3), (5, 4, 3))), np.ones((5, 6))
    X, v = ksl.Pose.from_columns(columns), ksl.Twist(x)
    for mine, yours in ((X.columns, columns), (X.R, columns), (X.t, columns), (v.array, x), (v.lin, x), (v[1:].ang, x)):
        assert np.shares_memory(mine, yours)
        with pytest.raises(ValueError, match="read-only"):
            mine[...] = 0
    columns[0, 3, 0] = 7
    assert X.t[0, 0] == 7 and X[0].matrix[0, 3] == 7
    with pytest.raises(AttributeError):
        v.frame = "a"
    with pytest.raises(AttributeError):
        v.farme = "a"


def test_the_column_layout_is_that_of_the_matrix():
    X = pose(rng(1), (2,), "a", "b")
    assert ksl.Pose(X.matrix, to="a", of="b") == X == ksl.Pose.from_columns(X.columns, to="a", of="b") == ksl.Pose.from_Rt(X.R, X.t, to="a", of="b")
    assert np.array_equal(X.columns[..., 1, :], X.matrix[..., :3, 1]) and np.array_equal(X.columns[..., 3, :], X.matrix[..., :3, 3])
    assert np.array_equal(X.matrix[..., :3, :3], X.R) and np.array_equal(X.matrix[:, 3], [[0, 0, 0, 1]] * 2)


def test_indices_are_those_of_the_leading_axes():
    v = ksl.Twist(np.arange(36.0).reshape(2, 3, 6), frame="b", order="ang_lin")
    assert len(v) == 2 and v.shape == (2, 3) and v.ndim == 2 and v[1].shape == (3,) and v[1, 2].shape == () and v[..., 0].shape == (2,)
    assert v[:, None].shape == (2, 1, 3) and v[np.ones((2, 3), bool)].shape == (6,) and [x.shape for x in v] == [(3,), (3,)]
    assert v[0].frame == "b" and v[0].order == "ang_lin" and np.array_equal(v[1, 2].array, v.array[1, 2])
    X = pose(rng(0), (2, 3), "a", "b")
    assert X[1].shape == (3,) and (X[1].to, X[1].of) == ("a", "b") and np.array_equal(X[1, 2].R, X.R[1, 2])
    with pytest.raises(IndexError):
        v[0, 0, 0]
    with pytest.raises(TypeError, match=r"Twist\(.*one value"):
        len(v[0, 0])


def test_values_can_be_pickled_and_read():
    v, X = ksl.Twist([1, 2, 3, 4, 5, 6], frame="b"), ksl.Pose.identity(to="a", of="b")
    assert pickle.loads(pickle.dumps(v)) == v and pickle.loads(pickle.dumps(X)) == X
    X = ksl.Pose.from_Rt([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [1, 2, 3], to="world", of="tool")
    assert repr(X) == "Pose(" + np.array2string(X.matrix, separator=", ", prefix="Pose(") + ", to='world', of='tool')"
    assert eval(repr(X), {"Pose": ksl.Pose}) == X, "the matrix, which the constructor takes"
    assert repr(v) == "Twist([1., 2., 3., 4., 5., 6.], frame='b', order='lin_ang')"
    assert repr(ksl.Wrench(np.zeros((4, 6), np.float32))) == "Wrench(shape (4,), float32, order='lin_ang')"


def test_nan_is_passed_on_in_six_vectors():
    v = ksl.Twist([[np.nan] * 6, [1] * 6])
    moved = pose(rng(0)) @ v
    assert np.isnan(moved.array[0]).all() and np.isfinite(moved.array[1]).all()


# what is refused

T, W = ksl.Twist(np.zeros(6), frame="b"), ksl.Wrench(np.zeros(6), frame="b")
A, P = ksl.Acceleration(np.zeros(6), frame="b"), ksl.Momentum(np.zeros(6), frame="b")
X, M = ksl.Pose.identity(to="a", of="b"), ksl.Inertia(1, [0, 0, 0], np.eye(3), frame="b")

MIXED_KINDS = [
    (lambda: T + W, "Twist", "Wrench"),
    (lambda: W - T, "Wrench", "Twist"),
    (lambda: T + A, "Twist", "Acceleration"),
    (lambda: W + P, "Wrench", "Momentum"),
    (lambda: T + M, "Twist", "Inertia"),
    (lambda: M - M, "Inertia", "Inertia"),
    (lambda: X + X, "Pose", "Pose"),
    (lambda: X + T, "Pose", "Twist"),
    (lambda: X * 2, "Pose", "int"),
    (lambda: 2 * X, "int", "Pose"),
    (lambda: np.ones(3) * X, "numpy.ndarray", "Pose"),
    (lambda: X * T, "Pose", "Twist"),
    (lambda: 2 * M, "int", "Inertia"),
    (lambda: T * T, "Twist", "Twist"),
    (lambda: T / W, "Twist", "Wrench"),
    (lambda: T * "2", "Twist", "str"),
    (lambda: 1j * T, "complex", "Twist"),
    (lambda: W @ W, "Wrench", "Wrench"),
    (lambda: T @ W, "Twist", "Wrench"),
    (lambda: W @ A, "Wrench", "Acceleration"),
    (lambda: T @ X, "Twist", "Pose"),
    (lambda: M @ W, "Inertia", "Wrench"),
    (lambda: M @ M, "Inertia", "Inertia"),
    (lambda: X @ np.ones(6), "Pose", "array of shape (6,)"),
    (lambda: np.ones((4, 4)) @ X, "numpy.ndarray", "Pose"),
    (lambda: T + np.ones(6), "Twist", "array of shape (6,)"),
    (lambda: np.ones(6) + T, "array of shape (6,)", "Twist"),
    (lambda: T + 1, "Twist", "int 1"),
    (lambda: sum([T, T]), "int 0", "Twist"),
    (lambda: T.cross(X), "Twist", "Pose"),
    (lambda: T.allclose(W), "Twist", "Wrench"),
    (lambda: ksl.Pose.exp(W), "Pose.exp", "Wrench"),
    (lambda: ksl.Wrench(T), "Wrench", "Twist"),
    (lambda: np.asarray(T), "Twist", "array"),
    (lambda: np.linalg.norm(X), "Pose", ".matrix"),
    (lambda: {T}, "unhashable", "Twist"),
]


@pytest.mark.parametrize(("nonsense", "left", "right"), MIXED_KINDS)
def test_kinds_that_do_not_go_together(nonsense, left, right):
    with pytest.raises(TypeError, match=f"(?s){re.escape(left)}.*{re.escape(right)}"):
        nonsense()


def named(kind: type, frame):
    return kind(np.zeros(6), frame=frame)


MIXED_FRAMES = [
    (lambda: T + named(ksl.Twist, "c"), "frame 'b'", "frame 'c'"),
    (lambda: W - named(ksl.Wrench, "c"), "frame 'b'", "frame 'c'"),
    (lambda: X @ named(ksl.Twist, "a"), "frame 'b'", "frame 'a'"),
    (lambda: X @ named(ksl.Momentum, "c"), "frame 'b'", "frame 'c'"),
    (lambda: X @ X, "frame 'b'", "frame 'a'"),
    (lambda: X @ M.named("c"), "frame 'b'", "frame 'c'"),
    (lambda: M @ named(ksl.Twist, "a"), "frame 'b'", "frame 'a'"),
    (lambda: M + M.named("a"), "frame 'b'", "frame 'a'"),
    (lambda: W @ named(ksl.Twist, "a"), "frame 'b'", "frame 'a'"),
    (lambda: T.cross(named(ksl.Wrench, "a")), "frame 'b'", "frame 'a'"),
    (lambda: T.allclose(T.named("a")), "frame 'b'", "frame 'a'"),
    (lambda: X.allclose(X.named("a", "c")), "frame 'b'", "frame 'c'"),
    (lambda: X @ named(ksl.Twist, None), "frame 'b'", "a frame without a name"),
    (lambda: X.named(None, None) @ T, "a frame without a name", "frame 'b'"),
    (lambda: T + T.named(None), "frame 'b'", "a frame without a name"),
]


@pytest.mark.parametrize(("nonsense", "left", "right"), MIXED_FRAMES)
def test_frames_that_do_not_meet(nonsense, left, right):
    with pytest.raises(ksl.FrameError, match=f"{re.escape(left)} meets {re.escape(right)}"):
        nonsense()


@pytest.mark.parametrize("operation", [lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a.cross(b), lambda a, b: ksl.Wrench(a.array) @ b])
def test_orders_that_differ(operation):
    a, b = ksl.Twist(np.zeros(6)), ksl.Twist(np.zeros(6), order="ang_lin")
    operation(a, a)  # with one order it is defined
    with pytest.raises(ValueError, match=r"order='lin_ang'\).*order='ang_lin'\).*in_order\('lin_ang'\)"):
        operation(a, b)


def eye(**changed: float) -> np.ndarray:
    D = np.eye(4)
    for place, x in changed.items():
        D[int(place[1]), int(place[2])] = x
    return D


BAD_ARGUMENTS = [
    (lambda: ksl.Twist(np.zeros(5)), ValueError, r"Twist has shape \(5,\); expected \(…, 6\)"),
    (lambda: ksl.Wrench(3.0), ValueError, r"Wrench has shape \(\); expected \(…, 6\)"),
    (lambda: ksl.Twist([[1], [1, 2]]), ValueError, "Twist: .*inhomogeneous"),
    (lambda: ksl.Twist(np.zeros(6, complex)), TypeError, "Twist of dtype complex128; expected real numbers"),
    (lambda: ksl.Twist("twist"), TypeError, "Twist of dtype <U5; expected real numbers"),
    (lambda: ksl.Twist(np.zeros(6), order="xyz"), ValueError, "Twist: order='xyz'; expected 'lin_ang' .*'ang_lin'"),
    (lambda: T.in_order("linear"), ValueError, "Twist: order='linear'; expected 'lin_ang' .*'ang_lin'"),
    (lambda: X.Ad("v"), ValueError, "Pose.Ad: order='v'; expected 'lin_ang' .*'ang_lin'"),
    (lambda: X.log(order=None), ValueError, "Pose.log: order=None; expected 'lin_ang' .*'ang_lin'"),
    (lambda: M.matrix("v"), ValueError, "Inertia.matrix: order='v'; expected 'lin_ang' .*'ang_lin'"),
    (lambda: ksl.Twist(np.zeros(6), frame=3), TypeError, "frame's name is a string or None, found 3"),
    (lambda: ksl.Twist(np.zeros(6), frame=""), ValueError, "frame's name is empty"),
    (lambda: ksl.Pose(np.eye(4), to="a"), ValueError, r"Pose\(to='a', of=None\): name both frames or neither"),
    (lambda: X.named("a", None), ValueError, r"Pose\(to='a', of=None\)"),
    (lambda: ksl.Pose(np.eye(3)), ValueError, r"Pose has shape \(3, 3\); expected \(…, 4, 4\)"),
    (lambda: ksl.Pose.from_columns(np.eye(4)), ValueError, r"Pose.from_columns has shape \(4, 4\); expected \(…, 4, 3\)"),
    (lambda: ksl.Pose.from_Rt(np.ones((2, 3, 3)), np.ones((3, 3))), ValueError, r"Pose: leading shapes don't broadcast: R \(2,\), t \(3,\)"),
    (lambda: ksl.Pose([eye(), eye(_30=1)]), ValueError, r"Pose\[1\] has a last row that isn't 0 0 0 1"),
    (lambda: ksl.Pose([eye(), eye(_00=1.01)]), ValueError, r"Pose\[1\] isn't a rotation: \|RᵀR − 1\| is 0.0201, .*1e-06 is tolerated, project=True"),
    (lambda: ksl.Pose(eye(_01=2e-6)), ValueError, "isn't a rotation"),
    (lambda: ksl.Pose(eye(_22=-1.0)), ValueError, "isn't a rotation: .*det R < 0: left-handed axes"),
    (lambda: ksl.Pose(eye(_22=-1.0), project=True), ValueError, "det R ≤ 0"),
    (lambda: ksl.Pose(eye(_22=0.0), project=True), ValueError, "det R ≤ 0"),
    (lambda: ksl.Pose(eye(_03=np.nan)), ValueError, "Pose has numbers that aren't finite"),
    (lambda: ksl.Inertia(1, [0, 0, 0], eye(_01=1)[:3, :3]), ValueError, "Inertia tensor isn't symmetric"),
    (lambda: ksl.Inertia([1, -1], [0, 0, 0], np.eye(3)), ValueError, r"Inertia\[1\] has a negative mass"),
    (lambda: ksl.Inertia(1, [0, np.inf, 0], np.eye(3)), ValueError, "Inertia has numbers that aren't finite"),
    (lambda: ksl.Inertia([1, 2], np.zeros((3, 3)), np.eye(3)), ValueError, r"mass \(2,\), com \(3,\), tensor \(\)"),
    (lambda: ksl.Inertia.from_numbers(np.zeros(9)), ValueError, r"Inertia.from_numbers has shape \(9,\); expected \(…, 10\)"),
    (lambda: ksl.Twist(np.zeros((3, 6))) + ksl.Twist(np.zeros((2, 6))), ValueError, r"Twist\(\) \+ Twist\(\): leading shapes .* left \(3,\), right \(2,\)"),
    (lambda: np.ones(3) * ksl.Twist(np.zeros((2, 6))), ValueError, r"Twist.*leading shapes .* left \(2,\), right \(3,\)"),
    (lambda: T.astype(int), TypeError, r"int64\); expected float32 or float64"),
]


@pytest.mark.parametrize(("call", "error", "words"), BAD_ARGUMENTS)
@pytest.mark.filterwarnings("error")
def test_arguments_that_do_not_fit(call, error, words):
    with pytest.raises(error, match=f"(?s){words}"):
        call()


@given(seeds, shapes, st.sampled_from([np.float32, np.float64]))
def test_the_nearest_rotation_mends(seed, shape, dtype):
    r = rng(seed)
    good = pose(r, shape)
    off = good.matrix
    off[..., :3, :3] += 1e-3 * r.normal(size=(*shape, 3, 3))
    mended = ksl.Pose(off.astype(dtype), project=True)
    assert mended.dtype == dtype and ksl.Pose(mended.matrix) == mended and np.array_equal(mended.t, good.t.astype(dtype))
    assert close(mended.astype(np.float64), good, 5e-3)
    assert close(ksl.Pose(good.matrix, project=True), good)
    # nearest: no rotation close by is nearer
    R, wanted = mended.R.astype(float), off[..., :3, :3]
    turned = pose(r, shape, angle=1e-2).R @ R
    assert np.all(np.linalg.norm(R - wanted, axis=(-2, -1)) <= np.linalg.norm(turned - wanted, axis=(-2, -1)) + 1e-6)


# with models, and with the compiled functions


def test_with_a_model(examples):
    """The power that joint wrenches transmit, in types, is that of inverse dynamics."""
    m = ksl.load(examples / "robots" / "ur5.urdf")
    q, v, a = rng(3).normal(size=(3, 5, m.nv))
    joint = m.joints[2]
    f = ksl.Wrench(m.reactions(q, v, a, joints=[joint.name])[:, 0], frame=joint.child)
    axis = ksl.Twist.from_parts([0, 0, 0], joint.axis, frame=joint.child)
    assert np.allclose(f @ axis, m.inverse_dynamics(q, v, a)[:, joint.v_index])
    X = ksl.Pose(m.frame_pose(q, joint.child), to="world", of=joint.child)
    world = ksl.Wrench(m.reactions(q, v, a, joints=[joint.name], at="world", axes="world")[:, 0], frame="world")
    assert close(X @ f, world, 1e-9)
    link = next(link for link in m.links if link.name == joint.child)
    body = ksl.Inertia.from_numbers([link.mass, *link.first_moment, *link.inertia], frame=link.name)
    assert np.isclose(body.mass, link.mass) and (X @ body).shape == (5,) and (X @ body).frame == "world"


def tilde(v):
    return np.cross(np.eye(3), v)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_product_is_that_of_dense_matrices(dtype):
    """Poses as 4×4 matrices, adjoints and inertias as 6×6 ones, in float64 whatever the dtype of the values is."""
    tolerance = {"rtol": 2e-5, "atol": 2e-5} if dtype == np.float32 else {"rtol": 1e-13, "atol": 1e-13}
    r = rng(7)
    X, Y, M = pose(r).astype(dtype), pose(r).astype(dtype), inertia(r).astype(dtype)
    v, w, f = (kind(r.normal(size=6).astype(dtype)) for kind in (ksl.Twist, ksl.Twist, ksl.Wrench))
    D, R, t = (x.astype(float) for x in (X.matrix, X.R, X.t))
    m, c = float(M.mass), M.com.astype(float)
    Ad = np.block([[R, tilde(t) @ R], [np.zeros((3, 3)), R]])
    CoAd = np.linalg.inv(Ad).T
    dense = np.block([[m * np.eye(3), -m * tilde(c)], [m * tilde(c), M.tensor.astype(float) - m * tilde(c) @ tilde(c)]])
    ad = np.block([[tilde(v.ang), tilde(v.lin)], [np.zeros((3, 3)), tilde(v.ang)]]).astype(float)
    pairs = [
        ((X @ Y).matrix, D @ Y.matrix),
        (X.inv().matrix, np.linalg.inv(D)),
        ((X @ v).array, Ad @ v.array),
        ((X @ f).array, CoAd @ f.array),
        (f @ v, f.array.astype(float) @ v.array),
        (v.cross(w).array, ad @ w.array),
        (v.cross(f).array, -ad.T @ f.array),
        ((M @ v).array, dense @ v.array),
        ((X @ M).matrix(), CoAd @ dense @ np.linalg.inv(Ad)),
        (ksl.Pose.exp(v).matrix, series(v.array.astype(float)).astype(float)),
        (series(X.log().array.astype(float)).astype(float), D),
    ]
    for k, (found, expected) in enumerate(pairs):
        assert np.allclose(found, expected, **tolerance), f"row {k}: {found}, expected {expected}"


@pytest.mark.parametrize("shape", [(), (7,), (2, 3)])
def test_poses_of_angles_and_quaternions_are_those_of_scipy(shape):
    """scipy's Rotation: "xyz" in small letters are fixed axes; its quaternions have w last."""
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    rng = np.random.default_rng(3)
    xyz, rpy, q = rng.normal(size=(*shape, 3)), rng.uniform(-4, 4, (*shape, 3)), rng.normal(size=(*shape, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    for made, expected in (
        (ksl.Pose.from_rpy(xyz, rpy, to="a", of="b"), rotation.from_euler("xyz", rpy.reshape(-1, 3))),
        (ksl.Pose.from_quaternion(xyz, 1.009 * q, to="a", of="b"), rotation.from_quat(q.reshape(-1, 4))),
    ):
        assert made.shape == shape and (made.to, made.of) == ("a", "b")
        np.testing.assert_allclose(made.R.reshape(-1, 3, 3), expected.as_matrix(), atol=1e-15)
        np.testing.assert_array_equal(made.t, xyz)
    assert ksl.Pose.from_rpy() == ksl.Pose.from_quaternion() == ksl.Pose.identity()


def test_angles_and_quaternions_that_are_none():
    for wrong, words in (
        (lambda: ksl.Pose.from_quaternion((0, 0, 0), (1, 1, 0, 0)), "a quaternion has length 1.414; expected unit quaternions x, y, z, w"),
        (lambda: ksl.Pose.from_quaternion((0, 0, 0), (0, 0, 0)), "Pose quaternion has shape"),
        (lambda: ksl.Pose.from_rpy((0, 0, 0), (0, 0, np.nan)), "Pose rpy has numbers that aren't finite"),
    ):
        with pytest.raises(ValueError, match=words):
            wrong()
