"""The angular-first layer: equations (11) to (16) of the six-d page under their numbers, its matrices and conversions against 200 bits, and
how it relates to the linear-first one.  Errors of functions of its types: formulas.py."""

import gmpy2
import numpy as np
import pytest

import reference as ref
from cases import arithmetic  # noqa: F401, a fixture
from cases import CASES, PRECISIONS, bound, close, error, room, sample
from formulas import X_force, X_motion, crf, crm, inertia6, swap
from reference import T, mp, mul, norm, tilde


def BOTH(test):
    """In both precisions, and against both arithmetics."""
    return pytest.mark.usefixtures("arithmetic")(pytest.mark.parametrize("scalar, f", PRECISIONS)(test))


SQRT2 = np.sqrt(2)


def call(ksl, name, scalar, f, *args, width=6):
    return ksl.outputs(f"ksl_plucker{f}_{name}", *args, room(width, scalar, len(args[0])))[0]


def matrix6(ksl, name, scalar, f, x):
    """The row-major matrix, after a look at the column-major one."""
    r, c = (call(ksl, f"{name}_{o}mo", scalar, f, x, width=36).reshape(-1, 6, 6) for o in "rc")
    assert np.array_equal(r, c.transpose(0, 2, 1))
    return r


# the equations


def rounded_orthogonal(X):
    """(X, X⁻ᵀ) need an exact rotation: E at 200 bits is made orthonormal to that precision."""
    n = len(X)
    R = ref.rotations(np.random.default_rng(12), n)
    return np.concatenate([ref.numbers(R), mp(X)[:, 9:]], 1)


def test_six_d_11_motion_transform(ksl):
    """(11): B_m = BXA A_m, BXA = [E 0; 0 E] [1 0; −r× 1], E from A to B, r the origin of B in A."""
    X, m = sample("plucker", "double", n=300, moderate=True), sample("motion", "double", n=300, moderate=True)
    expected = X_motion(mp(X))
    close(matrix6(ksl, "motion", "double", "", X), expected, "double", 8)
    close(call(ksl, "motion", "double", "", X, m), mul(expected, mp(m)), "double", 16)
    # the geometry: a turn about a point in A is the same turn in B, about the same point
    p = sample("vec3", "double", n=300, moderate=True)
    w = m[:, :3]
    turn = np.concatenate([w, np.cross(p, w)], 1)
    in_B = call(ksl, "motion", "double", "", X, turn)
    at = call(ksl, "Xpt", "double", "", X, p, width=3)
    close(call(ksl, "Vpt", "double", "", in_B, at, width=3), 0 * p, "double", 512)


def test_six_d_12_force_transform(ksl):
    """(12): B_f = BXA* A_f, BXA* = [E 0; 0 E] [1 −r×; 0 1] = BXA⁻ᵀ, cf. (2): power stays."""
    X, g = sample("plucker", "double", n=300, moderate=True), sample("force", "double", n=300, moderate=True)
    m = sample("motion", "double", n=300, moderate=True)
    expected = X_force(mp(X))
    close(matrix6(ksl, "force", "double", "", X), expected, "double", 8)
    close(call(ksl, "force", "double", "", X, g), mul(expected, mp(g)), "double", 16)
    exact = rounded_orthogonal(X)
    assert norm(mul(T(X_motion(exact)), X_force(exact)) - ref.identity(300, 6)).max() < 1e-50
    mB, fB = call(ksl, "motion", "double", "", X, m), call(ksl, "force", "double", "", X, g)
    close(ksl.outputs("ksl_plucker_dot", mB, fB)[0], ksl.outputs("ksl_plucker_dot", m, g)[0], "double", 256)


def test_six_d_13_skew_matrix(ksl):
    """(13): r× = [0 −rz ry; rz 0 −rx; −ry rx 0], which maps v to r × v."""
    r, v = np.array([[2.0, 3, 5]]), np.array([[7.0, 11, 13]])
    (S,) = ksl.outputs("ksl_mat3x3_setTilde", room(9, "double", 1), r)
    S = S.reshape(3, 3).T
    assert S.tolist() == [[0, -5, 3], [5, 0, -2], [-3, 2, 0]]
    assert np.array_equal(S @ v[0], np.cross(r, v)[0])


H = gmpy2.mpfr(1) / 2**60  # step of the differences


def moving_frame(t):
    """A motion at 200 bits: the transform AX0(t) from a fixed frame, as (E, r), and A_vA, the velocity of A in A coordinates."""
    w = mp([[0.3, -0.5, 0.7]])
    turn = mp([[-0.2, 0.4, 0.1]])
    R = mul(ref.expm(tilde(turn)), ref.expm(tilde(w * t)))  # pose of A; ω = w in A's own axes
    r = mp([[0.2, 0.9, -0.4]]) * t + mp([[0.5, -0.3, 0.1]]) * t * t + mp([[1, 2, -1]])
    rate = mp([[0.2, 0.9, -0.4]]) + 2 * mp([[0.5, -0.3, 0.1]]) * t
    return np.concatenate([ref.numbers(T(R)), r], 1), np.concatenate([w, mul(T(R), rate)], 1)


def vector(t, k=0):
    """A vector that moves, in fixed coordinates."""
    a, b, c = (mp(np.random.default_rng([k, j]).normal(size=(1, 6))) for j in range(3))
    return a + b * t + c * t * t * t


def test_six_d_14_derivative_is_the_limit_of_a_difference_quotient(ksl):
    """(14): where the basis does not move the coordinate vector's componentwise derivative is it; of a sum the sum; and it is a
    motion vector (a force vector): transformed like one between fixed frames."""
    t = gmpy2.mpfr("0.7")
    X = sample("plucker", "double", n=1, moderate=True)
    for transform, name in ((X_motion, "motion"), (X_force, "force")):
        here = [vector(t + k * H) for k in (-1, 1)]
        rate = (here[1] - here[0]) / (2 * H)
        there = [mul(transform(mp(X)), v) for v in here]
        expected = (there[1] - there[0]) / (2 * H)
        assert norm(mul(transform(mp(X)), rate) - expected)[0] < 1e-30
        close(call(ksl, name, "double", "", X, rate.astype(float)), expected, "double", 16)


@pytest.mark.parametrize("name, transform, bracket, product", [("motion", X_motion, crm, "crossMotion"), ("force", X_force, crf, "crossForce")])
def test_derivative_of_coordinates_and_coordinates_of_a_derivative(ksl, name, transform, bracket, product):
    """Along a real motion the two differ by the cross product, and not by less."""
    t = gmpy2.mpfr("0.7")
    frame, velocity = moving_frame(t)
    fixed = (vector(t + H) - vector(t - H)) / (2 * H)
    coordinates_of_derivative = mul(transform(frame), fixed)
    before, after = (mul(transform(moving_frame(t + k * H)[0]), vector(t + k * H)) for k in (-1, 1))
    derivative_of_coordinates = (after - before) / (2 * H)
    here = mul(transform(frame), vector(t))
    right = derivative_of_coordinates + mul(bracket(velocity), here)
    assert norm(coordinates_of_derivative - right)[0] < 1e-30
    assert norm(coordinates_of_derivative - derivative_of_coordinates)[0] > 0.1
    # the velocity itself: from the rate of the transform, d(AX0)/dt = −(A_vA ×) AX0
    rate = (transform(moving_frame(t + H)[0]) - transform(moving_frame(t - H)[0])) / (2 * H)
    assert norm(rate + mul(bracket(velocity), transform(frame)))[0] < 1e-30
    got = call(ksl, product, "double", "", velocity.astype(float), here.astype(float))
    close(derivative_of_coordinates.astype(float) + got, coordinates_of_derivative, "double", 16)


def test_six_d_15_motion_in_a_moving_frame(ksl):
    """(15): A(dm/dt) = d(A_m)/dt + A_vA × A_m."""
    test_derivative_of_coordinates_and_coordinates_of_a_derivative(ksl, "motion", X_motion, crm, "crossMotion")


def test_six_d_16_force_in_a_moving_frame(ksl):
    """(16): A(df/dt) = d(A_f)/dt + A_vA ×* A_f; × = [ω× 0; v× ω×], ×* = [ω× v×; 0 ω×] = −(×)ᵀ."""
    test_derivative_of_coordinates_and_coordinates_of_a_derivative(ksl, "force", X_force, crf, "crossForce")
    v = sample("motion", "double", n=100)
    assert np.all(matrix6(ksl, "crm", "double", "", v) == crm(mp(v)))
    assert np.all(matrix6(ksl, "crf", "double", "", v) == crf(mp(v)))


# errors


@BOTH
@pytest.mark.parametrize("name", ["motion", "force"])
def test_matrices(ksl, name, scalar, f, record_property):
    X = sample("plucker", scalar)
    got, expected = matrix6(ksl, name, scalar, f, X), (X_motion if name == "motion" else X_force)(mp(X))
    worst = 0
    for i in (0, 3):
        for j in (0, 3):
            moment = (i, j) == ((3, 0) if name == "motion" else (0, 3))
            size = SQRT2 * norm(mp(X)[:, 9:]) if moment else 0
            worst = max(worst, error(got[:, i : i + 3, j : j + 3], expected[:, i : i + 3, j : j + 3], size, scalar))
    bound(record_property, worst)


@BOTH
def test_from_matrix(ksl, scalar, f, record_property):
    """plux in reverse: E and r of a 6×6 matrix, by rows and by columns."""
    X = sample("plucker", scalar)
    A = matrix6(ksl, "motion", scalar, f, X)
    for o, stored in (("r", A), ("c", A.transpose(0, 2, 1))):
        got = call(ksl, f"fromMotion_{o}mo", scalar, f, np.ascontiguousarray(stored).reshape(CASES, 36), width=12)
        assert np.array_equal(got[:, :9], X[:, :9])
        # E is orthonormal only to its own rounding, which counts here
        worst = error(got[:, 9:], mp(X)[:, 9:], norm(mp(X)[:, 9:]), scalar)
    bound(record_property, worst)


@BOTH
def test_product_and_inverse_are_those_of_matrices(ksl, scalar, f):
    """CXA = CXB BXA, AXB = BXA⁻¹."""
    X2, X1 = (sample("plucker", scalar, k, 300, True) for k in (0, 1))
    A = [matrix6(ksl, "motion", scalar, f, X).astype(float) for X in (X2, X1, call(ksl, "product", scalar, f, X2, X1, width=12))]
    close(A[2], A[0] @ A[1], scalar, 32)
    inverse = matrix6(ksl, "motion", scalar, f, call(ksl, "inverted", scalar, f, X1, width=12)).astype(float)
    close(inverse @ A[1], np.tile(np.eye(6), (300, 1, 1)), scalar, 32)


@BOTH
def test_inertia_as_a_matrix(ksl, scalar, f):
    M = sample("spatial_inertia", scalar)
    assert np.all(matrix6(ksl, "inertia", scalar, f, M) == inertia6(mp(M)))


# making transforms, and the linear-first layer


@BOTH
def test_axis_rotations_are_passive(ksl, scalar, f):
    """rx, ry, rz: coordinates in the frame that was turned by the angle, E = R(angle)ᵀ; rotx, roty, rotz the same with r = 0."""
    angle = np.random.default_rng(1).uniform(-7, 7, CASES).astype(room(1, scalar).dtype)
    sc = np.stack([np.sin(angle.astype(float)), np.cos(angle.astype(float))], -1)
    for k, axis in enumerate("xyz"):
        E = call(ksl, f"r{axis}", scalar, f, angle, width=9)
        X = call(ksl, f"rot{axis}", scalar, f, angle, width=12)
        assert np.array_equal(X, np.concatenate([E, 0 * E[:, :3]], 1))
        close(ref.matrix(E), T(ref.axis_rotation(k, mp(sc))), scalar, 2)
    # a point on y, seen from a frame that was turned from x to y, lies on its x
    quarter = np.array([np.pi / 2], dtype=room(1, scalar).dtype)
    E = ref.matrix(call(ksl, "rz", scalar, f, quarter, width=9))[0]
    close(E @ [0, 1, 0], [1, 0, 0], scalar, 2)


@BOTH
def test_mcI(ksl, scalar, f, record_property):
    """Mass, centroid, inertia about the centroid → ten numbers, and back."""
    M = sample("inertia", scalar)
    m, c = M[:, 0], (M[:, 1:4] / M[:, :1]).astype(M.dtype)
    Ic = np.ascontiguousarray(ref.numbers(ref.symmetric(mp(M)[:, 4:])).astype(float)).astype(M.dtype)
    got = call(ksl, "mcI", scalar, f, m, c, Ic, width=10)
    mm, C, I = mp(m), mp(c), ref.symmetric(mp(M)[:, 4:])
    dense = inertia6(np.concatenate([mm[:, None], mm[:, None] * C, ref.six(I + ref.parallel_axis(mm, C))], 1))
    am, size = m.astype(float), norm(I) + 2 * m.astype(float) * norm(C) ** 2
    worst = max(error(got[:, 1:4], mm[:, None] * C, am * norm(C), scalar), error(got[:, 4:], ref.six(dense[:, :3, :3]), size, scalar))
    (_, m2, c2, I2) = ksl(f"ksl_plucker{f}_toMcI", got, room(1, scalar), room(3, scalar), room(9, scalar))[1]
    assert np.array_equal(m2[:, 0], m)
    worst = max(worst, error(c2, C, norm(C), scalar), error(I2, ref.numbers(I), 2 * size, scalar))
    bound(record_property, worst)


def test_XtoV_is_the_logarithm_to_second_order(ksl):
    """In A coordinates, like the logarithm of the pose of B in A; the difference falls with the third power of the displacement."""
    s = sample("screw", "double", n=200, moderate=True)
    worst = []
    for k in (1e-1, 1e-2, 1e-3):
        (D,) = ksl.outputs("ksl_SE3_exp", k * s, room(12, "double", 200))
        v = call(ksl, "XtoV", "double", "", call(ksl, "fromSE3", "double", "", D, width=12))
        worst.append(np.abs(swap(v) - k * s).max())
    assert worst[1] < 2e-3 * worst[0] and worst[2] < 2e-3 * worst[1]


@BOTH
def test_linear_first_is_another_order(ksl, scalar, f):
    """BXA = P [Ad]⁻¹(D) P, BXA* = P [Ad]*⁻¹(D) P with D = D_AB: the same functions of the other layer, and conversions swap."""
    X, m, g = sample("plucker", scalar, moderate=True), sample("motion", scalar, moderate=True), sample("force", scalar, moderate=True)
    D = call(ksl, "toSE3", scalar, f, X, width=12)
    (s,) = ksl.outputs(f"ksl_motion{f}_toScrew", m, room(6, scalar))
    (c,) = ksl.outputs(f"ksl_force{f}_toCoscrew", g, room(6, scalar))
    assert np.array_equal(s, swap(m)) and np.array_equal(c, swap(g))
    assert np.array_equal(ksl.outputs(f"ksl_motion{f}_fromScrew", s, room(6, scalar))[0], m)
    assert np.array_equal(ksl.outputs(f"ksl_force{f}_fromCoscrew", c, room(6, scalar))[0], g)
    for x, there, name, back in (
        (s, m, "product_Adinvs", "motion"),
        (c, g, "product_CoAdinvc", "force"),
        (s, m, "product_Ads", "motionInverse"),
        (c, g, "product_CoAdc", "forceInverse"),
    ):
        (y,) = ksl.outputs(f"ksl_{name}{f}", D, x, room(6, scalar))
        close(call(ksl, back, scalar, f, X, there), swap(y), scalar, 16)
    v = sample("motion", scalar, 1, moderate=True)
    (y,) = ksl.outputs(f"ksl_cross_ss{f}", swap(v), s, room(6, scalar))
    assert np.array_equal(call(ksl, "crossMotion", scalar, f, v, m), swap(y))
    (y,) = ksl.outputs(f"ksl_cross_sc{f}", swap(v), c, room(6, scalar))
    assert np.array_equal(call(ksl, "crossForce", scalar, f, v, g), swap(y))
