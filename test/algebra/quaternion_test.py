"""Quaternions against 200 bits: conversions, exponential and logarithm, interpolation; the errata B3 to B7 of the
published library.  Products are in formulas.py."""

import gmpy2
import numpy as np
import pytest

import reference as ref
from formulas import conj, hamilton, pure
from functions import published
from random_cases import AT_200_BITS
from reference import UNIT, dot, mp, mul, norm

pytestmark = pytest.mark.many_cases
N = AT_200_BITS
F = pytest.mark.parametrize("f, scalar", [("", "double"), ("f", "float")])
DTYPE = {"double": np.float64, "float": np.float32}
sin, cos = np.frompyfunc(gmpy2.sin, 1, 1), np.frompyfunc(gmpy2.cos, 1, 1)
atan2 = np.frompyfunc(gmpy2.atan2, 2, 1)


def unit(q):
    return q / ref.sqrt(dot(q, q))[:, None]


def rotation(q):
    """R(q) of a quaternion of length 1, at 200 bits."""
    r = ref.tilde(q[:, :3])
    return ref.identity(len(q), 3) + 2 * q[:, 3, None, None] * r + 2 * mul(r, r)


def half_turns():
    """Quaternions of rotations by exactly 180°, by 120° (diagonal 0) and by 0."""
    axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, -1], [1, 2, 3], [-1, 1, 1e-9], [1e-20, 1, 0]]
    q = [[*a, 0] for a in axes] + [[1, 1, 1, 1], [1, -1, 1, 1], [-1, -1, -1, 1], [0, 0, 0, 1]]
    return np.array(q, float)


def all_rotations(seed=1):
    """Random ones, small ones, half turns and their neighbours: unit quaternions at 200 bits."""
    random = np.random.default_rng(seed)
    q = random.normal(size=(N, 4))
    small = np.concatenate([random.normal(size=(N, 3)) * 10.0 ** random.uniform(-20, 0, (N, 1)), np.ones((N, 1))], 1)
    near = np.concatenate([random.normal(size=(N, 3)), random.choice([-1, 1], (N, 1)) * 10.0 ** random.uniform(-20, 0, (N, 1))], 1)
    return unit(mp(np.concatenate([q, small, near, half_turns(), -half_turns()])))


def up_to_sign(got, q):
    """Distance to q or to −q, whichever is less."""
    return np.minimum(ref.distance(got, q), ref.distance(-got, q))


@F
def test_quaternion_of_every_rotation(ksl, f, scalar, record_property):
    q = all_rotations()
    R = ref.numbers(rotation(q)).astype(float).astype(DTYPE[scalar])
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_toQuaternion", R, np.zeros((len(R), 4)))
    worst = up_to_sign(got, q).max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 4
    # the sign as published: w > 0 if the trace is positive, else x, y, z > 0 if its diagonal element stands out
    d = R[:, [0, 4, 8]].astype(float)
    rest = np.ones(len(q), bool)
    for stands_out, k in [(d.sum(1), 3)] + [(2 * d[:, k] - d.sum(1), k) for k in range(3)]:
        rows = rest & (stands_out > 1e-3)
        assert rows.any() and (got[rows, k] > 0).all()
        rest &= stands_out < -1e-3
    thirds = abs(d).max(1) < 1e-7
    assert thirds.any() and np.allclose(got[thirds, 3], 0.5, rtol=1e-6)


@F
def test_the_sign_at_the_boundary_between_two_rules(ksl, f, scalar):
    """Matrices whose trace, or whose rule for x, y or z, is exactly at its limit: neither sum and difference nor two elements of the diagonal may
    be taken for each other."""
    s = np.sqrt(0.5)
    # x, y, z or w is −1/2 and one of the others 1/√2, so that two rules are at their limits and the third decides
    q = [[0, 0.5, s, -0.5], [0.5, 0, s, -0.5], [0.5, s, 0, -0.5], [0, s, 0.5, -0.5], [s, 0.5, 0, -0.5], [s, 0, 0.5, -0.5]]
    R = ref.numbers(rotation(mp(np.array(q)))).astype(float)
    R[:, [0, 4, 8]] = np.round(2 * R[:, [0, 4, 8]]) / 2  # of s² nothing is left but 1/2
    R = R.astype(DTYPE[scalar])
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_toQuaternion", R, np.zeros((len(R), 4)))
    assert np.allclose(got, q, atol=1e-6)


@F
def test_turns_by_120_degrees_have_w_above_zero_whatever_rounding_leaves_on_the_diagonal(ksl, f, scalar):
    epsilon = np.finfo(DTYPE[scalar]).eps
    signs = np.array([[1, 1, 1, 1], [1, 1, -1, 1], [1, -1, 1, 1], [-1, 1, 1, 1]]) / 2
    R = ref.numbers(rotation(mp(signs))).astype(float)
    k = np.arange(-4, 5)
    diagonals = np.stack(np.meshgrid(k, k, k), -1).reshape(-1, 3)  # in units of epsilon
    rules = 2 * diagonals - diagonals.sum(1)[:, None]
    diagonals = diagonals[(diagonals.sum(1) <= 0) & (rules.max(1) <= 8)]
    assert len(diagonals) > 100
    near = np.repeat(R, len(diagonals), 0)
    near[:, [0, 4, 8]] = np.tile(diagonals, (len(R), 1)) * epsilon
    (got,) = ksl.outputs(f"ksl_mat3x3{f}_toQuaternion", near.astype(DTYPE[scalar]), np.zeros((len(near), 4)))
    assert np.allclose(got, np.repeat(signs, len(diagonals), 0), atol=1e-5)


@F
def test_round_trip_to_a_matrix_and_back(ksl, f, scalar):
    q = all_rotations().astype(float).astype(DTYPE[scalar])
    n = len(q)
    _, R = ksl.outputs(f"ksl_quaternion{f}_toMat3x3", q, np.zeros((n, 9)))
    (back,) = ksl.outputs(f"ksl_mat3x3{f}_toQuaternion", R, np.zeros((n, 4)))
    assert up_to_sign(back, mp(q)).max() <= 8 * UNIT[scalar]
    (again,) = ksl.outputs(f"ksl_mat3x3{f}_setFromQuaternion", R, back)
    assert abs(again - R).max() <= 16 * UNIT[scalar]


@F
def test_rotating_a_vector_is_the_product_and_the_matrix(ksl, f, scalar):
    q = all_rotations().astype(float).astype(DTYPE[scalar])
    v = np.random.default_rng(2).normal(size=(len(q), 3)).astype(DTYPE[scalar])
    exact = unit(mp(q))
    (got,) = ksl.outputs(f"ksl_product_qvqconj{f}", q, v, np.zeros((len(q), 3)))
    assert (ref.distance(got, hamilton(hamilton(exact, pure(mp(v))), conj(exact))[:, :3]) / norm(mp(v))).max() <= 12 * UNIT[scalar]
    (back,) = ksl.outputs(f"ksl_product_qconjvq{f}", q, v, np.zeros((len(q), 3)))
    assert (ref.distance(back, mul(ref.T(rotation(exact)), mp(v))) / norm(mp(v))).max() <= 12 * UNIT[scalar]


@F
def test_exp(ksl, f, scalar, record_property):
    random = np.random.default_rng(3)
    w = random.normal(size=(3 * N, 3))
    w /= np.linalg.norm(w, axis=1)[:, None]
    w[:N] *= 10.0 ** random.uniform(-40 if scalar == "double" else -20, 0, (N, 1))
    w[N : 2 * N] *= random.uniform(0, np.pi, (N, 1))
    w[2 * N :] *= random.uniform(np.pi, 50, (N, 1))
    w = np.concatenate([w, np.zeros((1, 3))]).astype(DTYPE[scalar])
    theta = ref.sqrt(dot(mp(w), mp(w)))
    safe = np.where(theta == 0, ref.ONE, theta)
    exact = np.concatenate([mp(w) * (sin(theta / 2) / safe)[:, None], cos(theta / 2)[:, None]], 1)
    (got,) = ksl.outputs(f"ksl_quaternion{f}_exp", w, np.zeros((len(w), 4)))
    size = theta.astype(float)
    worst = (ref.distance(got, exact) / (4 + 0.5 * size)).max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 1


def logarithm(q):
    q = np.where(q[:, 3:] < 0, -q, q)
    s = ref.sqrt(dot(q[:, :3], q[:, :3]))
    return q[:, :3] * (2 * atan2(s, q[:, 3]) / np.where(s == 0, ref.ONE, s))[:, None]


@F
@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
def test_log(ksl, f, scalar, length, record_property):
    """Of a quaternion as it is, of any length, to relative accuracy."""
    q = (all_rotations().astype(float) * length).astype(DTYPE[scalar])
    exact = logarithm(mp(q))
    (got,) = ksl.outputs(f"ksl_quaternion{f}_log", q, np.zeros((len(q), 3)))
    size = norm(exact)
    sure = size > (1e-100 if scalar == "double" else 1e-15)  # below, squares vanish, and the series' first term is left
    error = np.minimum(ref.distance(got, exact), np.where(q[:, 3] == 0, ref.distance(-got, exact), np.inf))
    worst = (error[sure] / size[sure]).max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 8
    assert (norm(mp(got)) <= np.pi * (1 + 4 * UNIT[scalar])).all()


def slerp(p, q, t):
    """By the definition: p (p* q)^t, the short way."""
    q = np.where(dot(p, q)[:, None] < 0, -q, q)
    w = logarithm(hamilton(conj(p), q)) * t[:, None] / 2
    s = ref.sqrt(dot(w, w))
    k = np.array([gmpy2.sin(x) / x if x else ref.ONE for x in s], dtype=object)
    return hamilton(p, np.concatenate([w * k[:, None], cos(s)[:, None]], 1))


def pairs(seed, angles, scalar):
    """Unit quaternions p and q = ± p exp(angle a), rounded."""
    random = np.random.default_rng(seed)
    n = len(angles)
    p, a = unit(mp(random.normal(size=(n, 4)))), mp(random.normal(size=(n, 3)))
    a = a / ref.sqrt(dot(a, a))[:, None]
    h = mp(angles)
    q = hamilton(p, np.concatenate([a * sin(h)[:, None], cos(h)[:, None]], 1)) * mp(random.choice([-1, 1], n))[:, None]
    return [x.astype(float).astype(DTYPE[scalar]) for x in (p, q)]


@F
def test_slerp(ksl, f, scalar, record_property):
    """Any angle; tiny ones; next to a half turn of the quaternions, which is none of the rotation."""
    random = np.random.default_rng(4)
    angles = np.concatenate([random.uniform(0, np.pi, N), 10.0 ** random.uniform(-15, 0, N), np.pi - 10.0 ** random.uniform(-15, 0, N), [0, np.pi]])
    p, q = pairs(5, angles, scalar)
    t = random.uniform(0, 1, len(p)).astype(DTYPE[scalar])
    t[:5] = 1e-3
    got = ksl.outputs(f"ksl_quaternion{f}_slerp", p, q, t, np.zeros((len(p), 4)))[-1]
    sure = abs(dot(mp(p), mp(q)).astype(float)) > 1e-3  # next to a half turn of the rotation rounding may choose the way
    exact = slerp(unit(mp(p)), unit(mp(q)), mp(t))
    worst = ref.distance(got, exact)[sure].max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 8


@F
@pytest.mark.parametrize("kind", ["slerp", "nlerp"])
def test_interpolation_ends_at_its_ends(ksl, f, scalar, kind):
    p, q = pairs(6, np.random.default_rng(6).uniform(0, np.pi, N), scalar)
    for t, end in ((0.0, p), (-1.0, p), (1.0, q), (2.0, q)):
        got = ksl.outputs(f"ksl_quaternion{f}_{kind}", p, q, np.full(N, t), np.zeros((N, 4)))[-1]
        assert np.array_equal(got, end)
    got = ksl.outputs(f"ksl_quaternion{f}_{kind}", p, q, np.full(N, np.nan), np.zeros((N, 4)))[-1]
    assert np.isnan(got).all()


@F
def test_nlerp(ksl, f, scalar, record_property):
    p, q = pairs(7, np.random.default_rng(7).uniform(0, np.pi, N), scalar)
    t = np.random.default_rng(8).uniform(1e-3, 1, N).astype(DTYPE[scalar])
    got = ksl.outputs(f"ksl_quaternion{f}_nlerp", p, q, t, np.zeros((N, 4)))[-1]
    sign = np.where(dot(mp(p), mp(q)) < 0, -1, 1)
    exact = unit((1 - mp(t))[:, None] * mp(p) + (mp(t) * sign)[:, None] * mp(q))
    worst = ref.distance(got, exact).max() / UNIT[scalar]
    record_property("worst_u", float(worst))
    assert worst <= 4
    got = ksl.outputs(f"ksl_quaternion{f}_nlerp", p, q, np.full(N, 5e-10), np.zeros((N, 4)))[-1]
    assert np.array_equal(got, p)


@F
def test_squad(ksl, f, scalar):
    random = np.random.default_rng(9)
    base = unit(mp(random.normal(size=(N, 4)))).astype(float)
    q = [unit(mp(base + 0.3 * random.normal(size=(N, 4)))).astype(float).astype(DTYPE[scalar]) for _ in range(4)]
    t = random.uniform(0, 1, N).astype(DTYPE[scalar])
    four = np.stack(q, 1).reshape(N, 16)
    got = ksl.outputs(f"ksl_quaternion{f}_squad", four, t, np.zeros((N, 4)))[-1]
    e, s = [mp(x) for x in q], mp(t)
    exact = slerp(slerp(e[0], e[3], s), slerp(e[1], e[2], s), 2 * s * (1 - s))
    assert up_to_sign(got, exact).max() <= 20 * UNIT[scalar]
    # signs do not matter; the ends are those of the first and the last
    signs = np.repeat(random.choice([-1, 1], (N, 4)), 4, 1)
    other = ksl.outputs(f"ksl_quaternion{f}_squad", (four * signs).astype(DTYPE[scalar]), t, np.zeros((N, 4)))[-1]
    assert up_to_sign(other, mp(got)).max() <= 20 * UNIT[scalar]
    for t, end in ((0.0, q[0]), (1.0, q[3]), (-3.0, q[0]), (3.0, q[3])):
        assert np.array_equal(ksl.outputs(f"ksl_quaternion{f}_squad", four, np.full(N, t), np.zeros((N, 4)))[-1], end)


def test_choice_at_the_end(ksl):
    a, b, o = np.array([[1.0, 2, 3, 4]]), np.array([[5.0, 6, 7, 8]]), np.zeros((1, 4))
    for t, chosen in ((0.999, b), (1.0, a), (1.5, a), (np.nan, b)):
        assert np.array_equal(ksl.outputs("ksl_atEnd_q", np.array([t]), a, b, o)[0], chosen)


@F
def test_rates_are_those_of_the_rotation(ksl, f, scalar):
    """A small step in the body's axes is q exp(dπ/2), a rate in the base's axes d/dt exp(ω t) q; lengths come back to 1."""
    random = np.random.default_rng(10)
    q = unit(mp(random.normal(size=(N, 4)))).astype(float).astype(DTYPE[scalar])
    step = (random.normal(size=(N, 3)) * 1e-3).astype(DTYPE[scalar])
    (moved,) = ksl.outputs(f"ksl_add_dpiToq{f}", step, q)
    (e,) = ksl.outputs(f"ksl_quaternion{f}_exp", step, np.zeros((N, 4)))
    assert abs(moved - hamilton(mp(q), mp(e)).astype(float)).max() < 1e-5
    (back,) = ksl.outputs(f"ksl_subtract_dpiFromq{f}", step, moved)
    assert abs(back - q).max() < 1e-5
    w = random.normal(size=(N, 3)).astype(DTYPE[scalar])
    (dq,) = ksl.outputs(f"ksl_omega_to_dquaternion{f}", w, q, np.zeros((N, 4)))
    assert abs(dq - (hamilton(pure(mp(w)), mp(q)) / 2).astype(float)).max() <= 16 * UNIT[scalar]
    long = q * DTYPE[scalar](1.1)
    (dq,) = ksl.outputs(f"ksl_omega_to_dquaternion{f}", 0 * w, long, np.zeros((N, 4)))
    assert (dot(mp(dq), mp(long)).astype(float) < -0.2).all()


# errata of the published library


@F
def test_B3_product_of_two_conjugates(ksl, f, scalar):
    """i* j* = i j = k, and (2 + i)* (3 + j)* = 6 − 2j − 3i + k"""
    p, q = np.array([[1, 0, 0, 0], [1, 0, 0, 2.0]]), np.array([[0, 1, 0, 0], [0, 1, 0, 3.0]])
    (got,) = ksl.outputs(f"ksl_product_qconjqconj{f}", p, q, np.zeros((2, 4)))
    assert got.tolist() == [[0, 0, 1, 0], [-3, -2, 1, 6]]


@F
def test_B4_conjugate_times_vector(ksl, f, scalar):
    """(2 + i)* j = 2j − k"""
    (got,) = ksl.outputs(f"ksl_product_qconjv{f}", np.array([[1.0, 0, 0, 2]]), np.array([[0.0, 1, 0]]), np.zeros((1, 4)))
    assert got.tolist() == [[0, 2, -1, 0]]


@F
@pytest.mark.parametrize("name", ["toMat3x3", "toMat3x3f"])
def test_B5_matrix_of_a_quaternion(ksl, f, scalar, name):
    """A quarter turn about z; the quaternion, of length 10, is normalised."""
    if name == "toMat3x3f" and not f:
        pytest.skip("single precision alone")
    q, R = ksl.outputs(f"ksl_quaternion{f}_{name}", np.array([[0, 0, np.sqrt(50), np.sqrt(50)]]), np.zeros((1, 9)))
    assert np.allclose(R, [[0, 1, 0, -1, 0, 0, 0, 0, 1]], atol=1e-6)
    assert np.allclose(q, [[0, 0, np.sqrt(0.5), np.sqrt(0.5)]], rtol=1e-6)


@F
@pytest.mark.parametrize("name", ["ksl_quaternion{}_slerp", "ksl_slerp{}"])
def test_B6_slerp_takes_the_short_way_without_a_jump(ksl, f, scalar, name):
    """Length 1 for every t next to a half turn, no jump where the sine is 0.001, and nothing written beyond the result."""
    p = np.array([0, 0, 0, 1.0])
    for angle in (0.0009, 0.0011, np.pi - 0.0009, np.pi - 5e-5, np.pi):
        q = np.array([np.sin(angle), 0, 0, np.cos(angle)])
        t = np.linspace(0.01, 0.99, 99)
        room = np.full((99, 4), np.nan)
        got = ksl.outputs(name.format(f), np.tile(p, (99, 1)), np.tile(q, (99, 1)), t, room)[-1].astype(float)
        assert abs(np.linalg.norm(got, axis=1) - 1).max() < 4 * UNIT[scalar]
        short = angle if angle < 1 else angle - np.pi
        assert abs(got[:, 0] - np.sin(short * t)).max() < 4 * UNIT[scalar]


@F
def test_B6_slerp_of_antipodal_quaternions_stays(ksl, f, scalar):
    p = all_rotations()[:N].astype(float).astype(DTYPE[scalar])
    got = ksl.outputs(f"ksl_quaternion{f}_slerp", p, -p, np.full(N, 0.3), np.zeros((N, 4)))[-1]
    assert ref.distance(got, mp(p)).max() <= 2 * UNIT[scalar]


def test_B7_every_published_spelling_exists(ksl):
    names = ["ksl_quaternion_product_" + n for n in ("qq", "qconjq", "qqconj", "qconjqconj", "qv", "qconjv", "vq", "vqconj", "uqinverseq")]
    names += [
        f"ksl_product_{n}{f}"
        for n in ("qq", "qconjq", "qqconj", "qconjqconj", "qv", "qconjv", "vq", "vqconj", "qxq", "ainvv")
        for f in ("", "f")
        if n + f != "qxqf"
    ]
    names += [
        "ksl_quaternion_slerp",
        "ksl_slerp",
        "ksl_slerpf",
        "ksl_quaternionf_slerp",
        "ksl_quaternion_squad",
        "ksl_squadf",
        "ksl_quaternion_nlerp",
        "ksl_nlerpf",
        "ksl_quaternionf_nlerp",
        "ksl_add_dpiToq",
        "kls_add_dpiToq",
        "ksl_mat3x3_pca",
    ]
    assert set(names) <= {p.name for p in published()}
    for name in names:
        assert hasattr(ksl.dll, name)
    q, v = np.array([[1.0, 2, 3, 4]]), np.array([[0.5, 0.25, 2]])
    assert np.array_equal(ksl.outputs("kls_add_dpiToq", v, q)[0], ksl.outputs("ksl_add_dpiToq", v, q)[0])
    assert ksl.outputs("ksl_product_ainvvf", v, np.array([2.0]), v)[0].tolist() == [[0.25, 0.125, 1]]
