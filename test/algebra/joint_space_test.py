"""Joint spaces: geometry against motions, equations (7) to (11) of the Coscrews page for every kind, and errors against 200 bits."""

import numpy as np
import pytest

import gmpy2
import reference as ref
from cases import DTYPE, PRECISIONS, bound, close, error, room, sample
from random_cases import AT_200_BITS
from reference import T, mp, mul, norm

BOTH = pytest.mark.parametrize("scalar, f", PRECISIONS)
KINDS = ["fixed", "revolute", "prismatic", "helical", "cylindrical", "universal", "spherical", "planar", "free"]
KIND = pytest.mark.parametrize("kind", KINDS)
AXIS = pytest.mark.parametrize("axis", range(3))
PITCH, ANGLE = 0.375, 0.7
# axes are coordinate axes: equation (10) holds
COORDINATE = [k for k in KINDS if k not in ("helical", "universal")]


def freedoms(kind, axis):
    """The coordinates that are free, 0 to 2 sliding, 3 to 5 turning, in order."""
    a, b, c = axis, (axis + 1) % 3, (axis + 2) % 3
    return {
        "fixed": [],
        "revolute": [3 + a],
        "prismatic": [a],
        "helical": [3 + a],
        "cylindrical": [a, 3 + a],
        "universal": [3 + a, 3 + b],
        "spherical": [3, 4, 5],
        "planar": sorted([b, c]) + [3 + a],
        "free": list(range(6)),
    }[kind]


def bases(ksl, kind, axis, scalar="double", f="", pitch=PITCH, q=ANGLE, n=1, D=None):
    """Number of freedoms, screws and coscrews as columns (n, 6, 6), and the 72 numbers."""
    q = np.broadcast_to(np.asarray(q, DTYPE[scalar]), n)
    (count, J) = ksl.outputs(f"ksl_joint_space{f}_set", room(72, scalar, n), KINDS.index(kind), axis, np.full(n, pitch, DTYPE[scalar]), q)
    if D is not None:
        (J,) = ksl.outputs(f"ksl_joint_space{f}_transformed", J, D, room(72, scalar, n))
    assert len(set(count.tolist())) == 1
    return int(count[0]), *columns(J), J


def columns(J):
    return J[:, :36].reshape(-1, 6, 6).transpose(0, 2, 1), J[:, 36:].reshape(-1, 6, 6).transpose(0, 2, 1)


def test_enumeration(ksl):
    """The order of the kinds here is that of ksl_joint_kind_t, and what is no kind or axis is refused and changes nothing."""
    from functions import INCLUDE

    text = (INCLUDE / "ksl" / "types.h").read_text()
    at = [text.index(f"KSL_JOINT_{k.upper()}") for k in KINDS]
    assert at == sorted(at)
    for kind, axis in ((-1, 0), (9, 0), (1, -1), (1, 3)):
        n, J = ksl.outputs("ksl_joint_space_set", np.full((1, 72), 7.0), kind, axis, np.zeros(1), np.zeros(1))
        assert n[0] == -1 and np.all(J == 7)


@pytest.mark.parametrize("kind", ["fixed", "spherical", "free"])
def test_a_joint_without_an_axis_takes_any_number_for_it(ksl, kind):
    expected = bases(ksl, kind, 0)
    for axis in (9, -1, -(2**31), 2**31 - 1):
        found = bases(ksl, kind, axis)
        assert found[0] == expected[0] == len(freedoms(kind, 0)) and np.array_equal(found[-1], expected[-1])


@BOTH
@KIND
@AXIS
def test_bases_are_dual(ksl, kind, axis, scalar, f):
    """sᵀ c = 1: H̄*ᵀ S = 0, h*ᵀ S = 1, H̄ᵀ h* = 0; exactly, but for cos² + sin² of a universal joint."""
    n, s, c, _ = bases(ksl, kind, axis, scalar, f)
    assert n == len(freedoms(kind, axis))
    product = s[0].astype(float).T @ c[0].astype(float)
    if kind == "universal":
        close(product, np.eye(6), scalar, 2)
    else:
        assert np.array_equal(product, np.eye(6))


def pose_of(kind, axis, q):
    """The child's pose after moving its freedoms one after the other, each in the frame the last left: products of exponentials."""
    D = ref.identity(1, 4)
    for x, i in zip(q, freedoms(kind, axis)):
        s = ref.zeros(1, 6)
        s[0, i] = x
        if kind == "helical":
            s[0, i - 3] = x * gmpy2.mpfr(PITCH)
        D = np.stack([mul(D, ref.expm(ref.twist_matrix(s)))[0]])
    return D


@KIND
@AXIS
def test_motion_subspace_is_the_velocity_of_the_motion(ksl, kind, axis):
    """S q̇ is the twist, in the parent's axes and at its origin, of the motion at q = (angle, 0, ...), by central differences."""
    n, s, _, J = bases(ksl, kind, axis)
    h = gmpy2.mpfr(1) / 2**60
    q = [gmpy2.mpfr(ANGLE if kind == "universal" else 0)] + [gmpy2.mpfr(0)] * 5
    rates = [gmpy2.mpfr(x) for x in (0.5, -1.25, 2.0, 0.75, -0.25, 1.5)]
    before, after = (pose_of(kind, axis, [x + k * h * v for x, v in zip(q, rates)]) for k in (-1, 1))
    rate = mul((after - before) / (2 * h), ref.inverse_pose(pose_of(kind, axis, q)))[0].astype(float)
    twist = [rate[0, 3], rate[1, 3], rate[2, 3], rate[2, 1], rate[0, 2], rate[1, 0]]
    (got,) = ksl.outputs("ksl_joint_space_twist", J, n, np.array([rates], float), room(6, "double", 1))
    close(got[0], twist, "double", 8)


@KIND
@AXIS
def test_drives_are_pure(ksl, kind, axis):
    """Each drive is a pure force or a pure couple along its axis, of unit length: of a helical joint the couple, of a
    universal one the couples about its two axes, which stay normal to each other."""
    n, s, c, _ = bases(ksl, kind, axis)
    h = c[0, :, 6 - n :]
    for j, i in enumerate(freedoms(kind, axis)):
        force, couple = h[:3, j], h[3:, j]
        assert np.all((couple if i < 3 else force) == 0)
        assert abs(np.linalg.norm(h[:, j]) - 1) <= 1e-15
    if kind == "universal":
        first, second = h[3:, 0], h[3:, 1]
        assert np.array_equal(first, np.eye(3)[axis])
        R = ref.expm(ref.tilde(mp(ANGLE * np.eye(3)[[axis]])))[0].astype(float)
        close(second, R[:, (axis + 1) % 3], "double", 2)
        assert first @ second == 0


def test_universal_geometry_by_hand(ksl):
    """Axes x and y' = R_x(q1) y = (0, cos q1, sin q1); the structure carries three forces and the couple about x × y'."""
    n, s, c, _ = bases(ksl, "universal", 0)
    sin, cos = np.sin(ANGLE), np.cos(ANGLE)
    assert np.allclose(s[0, 3:, 4:].T, [[1, 0, 0], [0, cos, sin]], rtol=0, atol=1e-15)
    assert np.allclose(c[0, :, 3], [0, 0, 0, 0, -sin, cos], rtol=0, atol=1e-15)
    assert np.array_equal(c[0, :, :3], np.eye(6)[:, :3])


def test_helical_geometry_by_hand(ksl):
    """S = (p z, z), driven by the couple z; a force f along the axis needs the couple −p f to do no work."""
    n, s, c, _ = bases(ksl, "helical", 2)
    assert n == 1
    assert s[0, :, 5].tolist() == [0, 0, PITCH, 0, 0, 1]
    assert c[0, :, 5].tolist() == [0, 0, 0, 0, 0, 1]
    assert c[0, :, 2].tolist() == [0, 0, 1, 0, 0, -PITCH]


def dense_CoAd(ksl, D, scalar="double", f=""):
    return ksl.outputs(f"ksl_matrix6{f}_CoAd_rmo", D, room(36, scalar, len(D)))[0].reshape(-1, 6, 6)


@pytest.mark.parametrize("kind", COORDINATE)
@AXIS
def test_coscrews_10_constraints_and_drives_make_the_coadjoint(ksl, kind, axis):
    """(10): [Ad]*_0a = [H̄* ∪ h*], its columns constraints first."""
    D = sample("SE3", "double", n=200, moderate=True)
    n, s, c, _ = bases(ksl, kind, axis, n=200, D=D)
    free = freedoms(kind, axis)
    order = [i for i in range(6) if i not in free] + free
    close(c, dense_CoAd(ksl, D)[:, :, order], "double", 8)


@BOTH
@KIND
@AXIS
def test_coscrews_11_duality_in_another_frame(ksl, kind, axis, scalar, f):
    """(11) as corrected, for every kind: H̄ᵀ h* = 0, H̄*ᵀ S = 0, h*ᵀ S = 1, after a move by [Ad] and [Ad]*."""
    count = 300
    D = sample("SE3", scalar, n=count, moderate=True)
    n, s, c, _ = bases(ksl, kind, axis, scalar, f, n=count, D=D, q=np.linspace(-3, 3, count))
    s, c = s.astype(float), c.astype(float)
    Hbar, S, Hstar, h = s[:, :, : 6 - n], s[:, :, 6 - n :], c[:, :, : 6 - n], c[:, :, 6 - n :]
    close(np.einsum("nki,nkj->nij", Hbar, h), np.zeros((count, 6 - n, n)), scalar)
    close(np.einsum("nki,nkj->nij", Hstar, S), np.zeros((count, 6 - n, n)), scalar)
    close(np.einsum("nki,nkj->nij", h, S), np.tile(np.eye(n), (count, 1, 1)), scalar)
    close(np.einsum("nki,nkj->nij", s, c), np.tile(np.eye(6), (count, 1, 1)), scalar)


@pytest.mark.parametrize("kind", COORDINATE)
@AXIS
def test_coscrews_07_09_diagonal_projectors(ksl, kind, axis):
    """(7), (9): in the joint's frame the projectors are diagonal, and applied without forming them give the same bits."""
    c = sample("coscrew", "double", n=100)
    n, _, _, J = bases(ksl, kind, axis, n=100)
    free = freedoms(kind, axis)
    drive, carry = (ksl.outputs(f"ksl_joint_space_{p}", J, n, c, room(6, "double", 100))[0] for p in ("actuation", "constraint"))
    expected = c.copy()
    expected[:, [i for i in range(6) if i not in free]] = 0
    assert np.array_equal(drive, expected)
    assert np.array_equal(carry, c - expected)


@BOTH
@KIND
@AXIS
def test_projectors(ksl, kind, axis, scalar, f):
    """h̄* = h* Sᵀ and 1 − h* Sᵀ: they add up, are idempotent, the rest does no work, and they move with the frame:
    h̄*' = [Ad]* h̄* [Ad]*⁻¹."""
    n = 300
    D, x = sample("SE3", scalar, n=n, moderate=True), sample("coscrew", scalar, n=n, moderate=True)
    k, s, _, J = bases(ksl, kind, axis, scalar, f, n=n, D=D)

    def part(name, c, J=J):
        return ksl.outputs(f"ksl_joint_space{f}_{name}", J, k, c, room(6, scalar, n))[0]

    drive, carry = part("actuation", x), part("constraint", x)
    close(drive.astype(float) + carry, x, scalar)
    close(part("actuation", drive), drive, scalar, 512)
    close(part("actuation", carry), 0 * x, scalar, 512)
    (_, _, _, e) = ksl(f"ksl_joint_space{f}_efforts", J, k, carry, room(6, scalar, n))[1]
    close(e[:, :k], np.zeros((n, k)), scalar, 512)
    # split in the joint's frame, then move
    _, _, _, own = bases(ksl, kind, axis, scalar, f, n=n)
    moved = ksl.outputs(f"ksl_product_CoAdc{f}", D, x, room(6, scalar, n))[0]
    split = ksl.outputs(f"ksl_product_CoAdc{f}", D, part("actuation", x, own), room(6, scalar, n))[0]
    close(part("actuation", moved), split, scalar, 1024)
    if kind == "fixed":
        assert np.array_equal(carry, x) and np.all(drive == 0)


@BOTH
@KIND
def test_power_of_a_drive(ksl, kind, scalar, f):
    """efforts · rates = power of the drive's wrench on the joint's twist, and Sᵀ h* efforts = efforts."""
    n = 300
    k, _, _, J = bases(ksl, kind, 2, scalar, f, n=n, D=sample("SE3", scalar, n=n, moderate=True))
    x = np.random.default_rng(2).normal(size=(2, n, 6)).astype(DTYPE[scalar])
    (s,) = ksl.outputs(f"ksl_joint_space{f}_twist", J, k, x[0], room(6, scalar, n))
    (c,) = ksl.outputs(f"ksl_joint_space{f}_drive", J, k, x[1], room(6, scalar, n))
    (_, _, _, e) = ksl(f"ksl_joint_space{f}_efforts", J, k, c, room(6, scalar, n))[1]
    close(e[:, :k], x[1][:, :k], scalar, 128)
    close(ksl.outputs(f"ksl_dot_cs{f}", c, s)[0], (x[0].astype(float) * x[1])[:, :k].sum(1), scalar, 512)


def halves(x):
    return x[:, :3], x[:, 3:]


@BOTH
def test_transformed(ksl, scalar, f):
    """Each vector as product_Ads and product_CoAdc give it, to the bit."""
    n = 500
    D = sample("SE3", scalar, n=n)
    _, _, _, J = bases(ksl, "helical", 1, scalar, f, n=n)
    (moved,) = ksl.outputs(f"ksl_joint_space{f}_transformed", J, D, room(72, scalar, n))
    for k in range(12):
        name = "product_Ads" if k < 6 else "product_CoAdc"
        assert np.array_equal(ksl.outputs(f"ksl_{name}{f}", D, J[:, 6 * k : 6 * k + 6], room(6, scalar, n))[0], moved[:, 6 * k : 6 * k + 6])


@pytest.mark.many_cases
@BOTH
@pytest.mark.parametrize("n", [1, 3, 6])
def test_error_of_the_sums(ksl, n, scalar, f, record_property):
    """twist, efforts, drive, actuation and constraint of any numbers."""
    random = np.random.default_rng(6)
    J = random.normal(size=(AT_200_BITS, 72)).astype(DTYPE[scalar])
    c, x = sample("coscrew", scalar, n=AT_200_BITS, moderate=True), random.normal(size=(AT_200_BITS, 6)).astype(DTYPE[scalar])
    s, h = (y[:, :, 6 - n :] for y in columns(mp(J)))
    r, w = mp(x)[:, :n], mp(c)
    (twist,) = ksl.outputs(f"ksl_joint_space{f}_twist", J, n, x, room(6, scalar, AT_200_BITS))
    (drive,) = ksl.outputs(f"ksl_joint_space{f}_drive", J, n, x, room(6, scalar, AT_200_BITS))
    efforts = ksl(f"ksl_joint_space{f}_efforts", J, n, c, room(6, scalar, AT_200_BITS))[1][3][:, :n]
    (act,) = ksl.outputs(f"ksl_joint_space{f}_actuation", J, n, c, room(6, scalar, AT_200_BITS))
    (rest,) = ksl.outputs(f"ksl_joint_space{f}_constraint", J, n, c, room(6, scalar, AT_200_BITS))
    e = mul(T(s), w)
    S, H = ([np.stack([norm(p[:, :, j]) for j in range(n)], -1) for p in (y[:, :3], y[:, 3:])] for y in (s, h))
    C = [norm(p)[:, None] for p in halves(w)]
    sizes = C[0] * S[0] + C[1] * S[1]
    worst = max(error(efforts[:, j], e[:, j], sizes[:, j], scalar) for j in range(n))
    for i, p in enumerate((slice(0, 3), slice(3, 6))):
        worst = max(
            worst,
            error(twist[:, p], mul(s, r)[:, p], (S[i] * abs(r.astype(float))).sum(1), scalar),
            error(drive[:, p], mul(h, r)[:, p], (H[i] * abs(r.astype(float))).sum(1), scalar),
            error(act[:, p], mul(h, e)[:, p], (H[i] * sizes).sum(1), scalar),
            error(rest[:, p], (w - mul(h, e))[:, p], (H[i] * sizes).sum(1) + C[i][:, 0], scalar),
        )
    bound(record_property, worst)
