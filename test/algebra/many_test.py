"""Many random cases of the exponential, the logarithm and the lengths, against closed forms in 64-bit arithmetic.  The same
functions stand against series at 200 bits in exponential_test.py, lie_test.py and quaternion_test.py; so does, here, the
reference itself."""

import numpy as np
import pytest

import reference as ref
from random_cases import MANY as CASES
from reference import UNIT, mp, mul, norm
from exponential_test import condition, directions, dtype, pose_error, rotation_error

F = pytest.mark.parametrize("scalar, f", [("double", ""), ("float", "f")])
ANGLES = pytest.mark.parametrize("angles", ["near 0", "at the switch", "ordinary", "near π", "large"])
pytestmark = [pytest.mark.many_cases, pytest.mark.skipif(not ref.HAS_EXTENDED, reason="long double is no longer than double here")]


@pytest.fixture(autouse=True)
def extended():
    with ref.extended():
        yield


def sample(angles, scalar):
    """Screws (v, ω), |v| over six decades."""
    random = np.random.default_rng([len(angles), *angles.encode()])
    angle = {
        "near 0": lambda: 10 ** random.uniform(-12, -1, CASES),
        "at the switch": lambda: random.uniform(0.03, 0.0334, CASES),
        "ordinary": lambda: random.uniform(0, np.pi, CASES),
        "near π": lambda: np.pi - 10 ** random.uniform(-4, -1, CASES),
        "large": lambda: 10 ** random.uniform(0.5, 4, CASES),
    }[angles]()
    speed = 10 ** random.uniform(-3, 3, CASES)
    return np.concatenate([directions(random, CASES) * speed[:, None], directions(random, CASES) * angle[:, None]], 1).astype(dtype(scalar))


def exponential(s):
    """Poses by Rodrigues' formula: 1 − cos θ as 2 sin²(θ/2), θ − sin θ only where its loss doesn't count."""
    v, w = s[:, :3], ref.tilde(s[:, 3:])
    t = np.sqrt((s[:, 3:] ** 2).sum(1))[:, None, None]
    a, b, c = np.sin(t) / t, 2 * (np.sin(t / 2) / t) ** 2, (1 - np.sin(t) / t) / t**2
    w2, one = mul(w, w), ref.identity(len(s), 3)
    D = ref.identity(len(s), 4)
    D[:, :3, :3] = one + a * w + b * w2
    D[:, :3, 3] = mul(one + b * w + c * w2, v)
    return D


def worst(record_property, *ratios):
    value = max(float(np.max(r)) for r in ratios)
    record_property("worst", value)
    assert value <= 1


@ANGLES
def test_the_reference_is_the_series_at_200_bits(angles):
    s = sample(angles, "double")[:100]
    if angles == "large":
        s[:, 3:] /= 100
    near = exponential(mp(s))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ref, "_extended", False)
        exact = ref.expm(ref.twist_matrix(mp(s)))
        upper = near.astype(float)
        apart = exact - upper.astype(object) - (near - upper).astype(float).astype(object)
        assert ref.spectral(apart[:, :3, :3]).max() <= 0.02 * UNIT["double"] * (1 + norm(s[:, 3:]).max())
        assert (norm(apart[:, :3, 3]) / norm(s[:, :3])).max() <= 0.02 * UNIT["double"]


@F
@ANGLES
def test_exp(ksl, scalar, f, angles, record_property):
    s = sample(angles, scalar)
    D, w = exponential(mp(s)), mp(s)[:, 3:]
    size = (8 + norm(w)) * UNIT[scalar]
    R, t = pose_error(ksl.outputs(f"ksl_SE3{f}_exp", s, np.zeros((CASES, 12)))[0], D)
    R2 = rotation_error(ksl.outputs(f"ksl_mat3x3{f}_exp", s[:, 3:], np.zeros((CASES, 9)))[0], D[:, :3, :3])
    half = np.sqrt((w**2).sum(1))[:, None] / 2
    q = np.concatenate([w * np.sin(half) / (2 * half), np.cos(half)], 1)
    turn = ref.distance(ksl.outputs(f"ksl_quaternion{f}_exp", s[:, 3:], np.zeros((CASES, 4)))[0], q)
    worst(record_property, R / size, t / norm(s[:, :3]) / size, R2 / size, 2 * turn / size)


@F
@pytest.mark.parametrize("angles", ["near 0", "at the switch", "ordinary", "near π"])
def test_log(ksl, scalar, f, angles, record_property):
    """Of rounded poses and quaternions; at π, where either sign is right, the one that the screw has is not owed."""
    s = sample(angles, scalar)
    v, w = mp(s)[:, :3], mp(s)[:, 3:]
    D = exponential(mp(s))
    numbers = np.concatenate([ref.numbers(D[:, :3, :3]), D[:, :3, 3]], 1).astype(dtype(scalar))
    (got,) = ksl.outputs(f"ksl_SE3{f}_log", numbers, np.zeros((CASES, 6)))
    (turn,) = ksl.outputs(f"ksl_mat3x3{f}_log", numbers[:, :9], np.zeros((CASES, 3)))
    size = (8 + norm(w)) * condition(norm(w)) * UNIT[scalar]
    half = np.sqrt((w**2).sum(1))[:, None] / 2
    q = np.concatenate([w * np.sin(half) / (2 * half), np.cos(half)], 1).astype(dtype(scalar))
    (back,) = ksl.outputs(f"ksl_quaternion{f}_log", q, np.zeros((CASES, 3)))
    sure = norm(w) < np.pi * (1 - 8 * UNIT[scalar])
    worst(
        record_property,
        (ref.distance(got[:, 3:], w) / size)[sure],
        (ref.distance(got[:, :3], v) / norm(v) / size)[sure],
        (ref.distance(turn, w) / size)[sure],
        (ref.distance(back, w) / (8 + norm(w)) / UNIT[scalar])[sure],
    )


@F
@pytest.mark.parametrize(
    "name, width, part",
    [
        ("vec3{}_l2norm", 3, slice(3)),
        ("vec4{}_l2norm", 4, slice(4)),
        ("quaternion{}_l2norm", 4, slice(4)),
        ("screw{}_norm", 6, slice(3, 6)),
        ("coscrew{}_norm", 6, slice(3)),
    ],
)
def test_lengths(ksl, scalar, f, name, width, part, record_property):
    """To 1.5 ULP."""
    random = np.random.default_rng(width)
    x = (random.normal(size=(CASES, width)) * 10 ** random.uniform(-15, 15, (CASES, 1))).astype(dtype(scalar))
    got, _ = ksl("ksl_" + name.format(f), x)
    exact = np.sqrt((mp(x)[:, part] ** 2).sum(1))
    ulp = np.spacing(exact.astype(dtype(scalar)))
    worst(record_property, abs(mp(got) - exact) / ulp / 1.5)


@F
def test_axis_and_angle(ksl, scalar, f, record_property):
    """The angle to 1.5 ULP beside the rounding of the rotation that it is of."""
    w = sample("ordinary", scalar)[:, 3:]
    R = exponential(np.concatenate([0 * mp(w), mp(w)], 1))[:, :3, :3]
    _, angle = ksl.outputs(f"ksl_mat3x3{f}_getAxisAngle", ref.numbers(R).astype(dtype(scalar)), np.zeros((CASES, 3)), np.zeros((CASES, 1)))
    size = norm(w)
    allowed = 1.5 * np.spacing(size.astype(dtype(scalar))) + 8 * condition(size) * UNIT[scalar]
    worst(record_property, abs(mp(angle[:, 0]) - np.sqrt((mp(w) ** 2).sum(1))) / allowed)
