"""Equations (1) to (12) of the Coscrews page, each as a test under its number; where the page errs (errata A), the
corrected equation holds and the printed one is shown not to."""

import gmpy2
import numpy as np
import pytest

import reference as ref
from functions import everything
from reference import T, Ad, CoAd, dot, mp, mul, norm, pose

CASES = 200
U = 2.0**-53
TYPES = {t.base: t for f in everything().values() for t in f.args if t.scalar == "double"}


def sample(base, k=0, moderate=True):
    """Random arguments; moderate: vectors of length 0.1 to 10."""
    random = np.random.default_rng([k, *base.encode()])
    x = ref.sample(random, CASES, TYPES[base])
    for i in {"SE3": [9], "screw": [0, 3], "coscrew": [0, 3], "vec3": [0]}.get(base, []) if moderate else []:
        v = x[:, i : i + 3]
        x[:, i : i + 3] = v / np.linalg.norm(v, axis=1)[:, None] * 10 ** random.uniform(-1, 1, (CASES, 1))
    return x


def dense(ksl, name, D):
    """The 6×6 matrix of a linear function of the library, column by column."""
    columns = [ksl.outputs(name, D, np.tile(np.eye(6)[j], (CASES, 1)), np.zeros((CASES, 6)))[0] for j in range(6)]
    return np.stack(columns, -1)


def close(a, b, bound=64):
    scale = 1 + np.abs(b.astype(float)).max()
    return np.abs((a - b).astype(float)).max() <= bound * U * scale


def test_coscrews_01_a_wrench_is_a_force_above_a_moment(ksl):
    """(1): f* = {f; τ}: the constructor, lin and ang, and the six numbers name the same storage."""
    x = ksl("ksl_coscrew", 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)[0]
    assert x.tolist() == [[1, 2, 3, 4, 5, 6]]
    force = ksl.outputs("ksl_add_cct", np.zeros((1, 6)), x, np.zeros((1, 6)))[0]
    assert force.tolist() == [[1, 2, 3, 0, 0, 0]]


def test_coscrews_02_power_is_invariant(ksl):
    """(2): p = f · v + τ · ω, whatever the frame."""
    D, c, s = sample("SE3"), sample("coscrew"), sample("screw")
    (p,) = ksl.outputs("ksl_dot_cs", c, s)
    assert np.allclose(p, (c[:, :3] * s[:, :3]).sum(1) + (c[:, 3:] * s[:, 3:]).sum(1), rtol=0, atol=64 * U * 200)
    c2 = ksl.outputs("ksl_product_CoAdc", D, c, c)[0]
    s2 = ksl.outputs("ksl_product_Ads", D, s, s)[0]
    (p2,) = ksl.outputs("ksl_dot_cs", c2, s2)
    assert (abs(p2 - p) / (np.linalg.norm(c2, axis=1) * np.linalg.norm(s2, axis=1))).max() <= 32 * U


def test_coscrews_03_adjoint(ksl):
    """(3): [Ad] = [R r̃R; 0 R]."""
    D = sample("SE3")
    assert close(dense(ksl, "ksl_product_Ads", D), Ad(pose(mp(D))))


def test_coscrews_04_inverse_adjoint_corrected(ksl):
    """(4) with [Ad]⁻¹ = [Rᵀ −Rᵀr̃; 0 Rᵀ]; the printed [Rᵀ r̃Rᵀ; 0 Rᵀ] is not the inverse (A2)."""
    D = sample("SE3")
    R, r = pose(mp(D))[:, :3, :3], ref.tilde(mp(D)[:, 9:])
    inverse = ref.block(T(R), -mul(T(R), r), ref.zeros(CASES, 3, 3), T(R))
    printed = ref.block(T(R), mul(r, T(R)), ref.zeros(CASES, 3, 3), T(R))
    one = np.eye(6)
    assert close(mul(inverse, Ad(pose(mp(D)))), one)
    assert not close(mul(printed, Ad(pose(mp(D)))), one, bound=1e12)
    assert close(dense(ksl, "ksl_product_Adinvs", D), inverse)
    c, s = mp(sample("coscrew")), mp(sample("screw"))
    power = dot(mul(T(inverse), c), mul(Ad(pose(mp(D))), s))
    assert close(power, dot(c, s), bound=1000)


def test_coscrews_05_coadjoint_is_the_inverse_transposed(ksl):
    """(5): f' = [Ad]⁻ᵀ f = [Ad]* f."""
    D = sample("SE3")
    assert close(dense(ksl, "ksl_product_CoAdc", D), dense(ksl, "ksl_product_Adinvs", D).transpose(0, 2, 1))
    assert close(dense(ksl, "ksl_product_CoAdinvc", D), dense(ksl, "ksl_product_Ads", D).transpose(0, 2, 1))


def test_coscrews_06_coadjoint(ksl):
    """(6): [Ad]* = [R 0; r̃R R]."""
    D = sample("SE3")
    assert close(dense(ksl, "ksl_product_CoAdc", D), CoAd(pose(mp(D))))


PASSIVE = np.diag([1.0, 1, 1, 1, 1, 0])  # what a revolute joint about z transmits without doing work
ACTIVE = np.diag([0.0, 0, 0, 0, 0, 1])


def basis(ksl, D, kind):
    """The six unit twists (kind s) or wrenches (kind c) of a joint frame at D, as columns."""
    return np.stack([ksl.outputs(f"ksl_h{kind}{m}{axis}", D, np.zeros((CASES, 6)))[0] for m in "tr" for axis in "xyz"], -1)


def test_coscrews_07_a_revolute_joint_transmits_all_but_the_moment_about_its_axis():
    """(7): the reaction does no work on the joint's twist; the axial force is transmitted, against the page's words (A6)."""
    c = sample("coscrew")
    reaction = c @ PASSIVE
    assert np.all(reaction[:, 5] == 0)
    assert np.array_equal(reaction[:, :5], c[:, :5])
    assert np.all(reaction[:, 2] != 0)


def test_coscrews_08_constraint_basis_in_another_frame(ksl):
    """(8): H̄*_0 = [Ad]*_0a diag(1, 1, 1, 1, 1, 0): its columns are hctx, hcty, hctz, hcrx, hcry and 0."""
    D = sample("SE3")
    expected = basis(ksl, D, "c")
    expected[:, :, 5] = 0
    assert close(dense(ksl, "ksl_product_CoAdc", D) @ PASSIVE, expected)


def test_coscrews_09_motor_torque(ksl):
    """(9): the working part of a wrench is its moment about the axis, [Ad]* diag(0, 0, 0, 0, 0, 1) f; the motor that
    resists the wrench supplies the negative (A6)."""
    D, c = sample("SE3"), sample("coscrew")
    working = np.einsum("nij,nj->ni", dense(ksl, "ksl_product_CoAdc", D) @ ACTIVE, c)
    h = ksl.outputs("ksl_hcrz", D, np.zeros((CASES, 6)))[0]
    assert close(working, h * c[:, 5:])
    resisting = ksl.outputs("ksl_hcrzinv", D, np.zeros((CASES, 6)))[0] * c[:, 5:]
    twist = ksl.outputs("ksl_hsrz", D, np.zeros((CASES, 6)))[0]
    whole = ksl.outputs("ksl_product_CoAdc", D, c, c)[0]
    (p,) = ksl.outputs("ksl_dot_cs", whole, twist)
    (q,) = ksl.outputs("ksl_dot_cs", resisting, twist)
    assert np.allclose(p + q, 0, rtol=0, atol=64 * U * 1e3)


def test_coscrews_10_columns_make_the_coadjoint(ksl):
    """(10): [Ad]* = [H̄* h*]: the five constraint columns and the working one."""
    D = sample("SE3")
    assert close(basis(ksl, D, "c"), dense(ksl, "ksl_product_CoAdc", D))
    assert close(basis(ksl, D, "s"), dense(ksl, "ksl_product_Ads", D))


@pytest.mark.parametrize("k", range(6))
def test_coscrews_11_orthogonality_corrected(ksl, k):
    """(11) with H̄ the SCREW basis less its column k: H̄ᵀ h* = 0, and dually H̄*ᵀ h = 0; H̄*ᵀ h*, which the page's words
    say vanishes, does not (A5)."""
    D = sample("SE3")
    screws, coscrews = basis(ksl, D, "s"), basis(ksl, D, "c")
    others = [j for j in range(6) if j != k]
    assert close(np.einsum("nij,ni->nj", screws[:, :, others], coscrews[:, :, k]), np.zeros((CASES, 5)), 2000)
    assert close(np.einsum("nij,ni->nj", coscrews[:, :, others], screws[:, :, k]), np.zeros((CASES, 5)), 2000)
    if k < 3:
        return  # forces: H̄*ᵀ h* mixes the lengths of moments; the page's example is a couple
    assert abs(np.einsum("nij,ni->nj", coscrews[:, :, others], coscrews[:, :, k])).max() > 0.1


def path(t):
    """A smooth motion: poses at time t, and their twist (spatial linear velocity v = ṙ − ω × r)."""
    w = mp([[0.3, -0.5, 0.7]])
    D0, velocity = pose(mp(sample("SE3")[:1])), mp([[0.2, 0.9, -0.4]])
    D = ref.identity(1, 4)
    D[:, :3, :3] = mul(ref.expm(ref.tilde(w * t)), D0[:, :3, :3])
    D[:, :3, 3] = D0[:, :3, 3] + velocity * t
    return D, w, velocity


def test_coscrews_12_derivative_of_the_coadjoint(ksl):
    """(12): d[Ad]*/dt = [ad]*(v, ω) [Ad]*, [ad]* = −[ad]ᵀ, with v = ṙ − ω × r, not ṙ (A7); cross_sc is [ad]*."""
    h = gmpy2.mpfr(1) / 2**60
    (D, w, velocity), before, after = path(0), CoAd(path(-h)[0]), CoAd(path(h)[0])
    rate = (after - before) / (2 * h)
    r = D[:, :3, 3]
    spatial = np.concatenate([velocity - ref.cross(w, r), w], 1)
    material = np.concatenate([velocity, w], 1)
    assert norm(mul(ref.coad(spatial), CoAd(D)) - rate)[0] < 1e-30
    assert norm(mul(ref.coad(material), CoAd(D)) - rate)[0] > 0.01
    s = np.tile(spatial.astype(float), (6, 1))
    columns = ksl.outputs("ksl_cross_sc", s, CoAd(D)[0].astype(float).T, np.zeros((6, 6)))[0].T
    assert np.abs(columns - rate[0].astype(float)).max() <= 64 * U * np.abs(columns).max()
