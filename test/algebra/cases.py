"""Random arguments and errors in u, for the tests that are not rows of formulas.py."""

import contextlib
import sys

import numpy as np
import pytest

import reference as ref
from functions import SIZES, Type
from random_cases import AT_200_BITS as FEW
from random_cases import MANY
from reference import UNIT

CASES = 10_000
PRECISIONS = [("double", ""), ("float", "f")]
DTYPE = {"double": np.float64, "float": np.float32}
# where the vectors of a type lie
VECTORS = {"SE3": [9], "plucker": [9], "screw": [0, 3], "coscrew": [0, 3], "motion": [0, 3], "force": [0, 3], "vec3": [0]}


@pytest.fixture(params=[pytest.param(bits, marks=pytest.mark.many_cases) for bits in ("64 bits", "200 bits")])
def arithmetic(request, monkeypatch):
    """Many cases against 64-bit arithmetic, then a few at 200 bits.  A module that counts CASES must see the same."""
    if request.param == "64 bits" and not ref.HAS_EXTENDED:
        pytest.skip("long double is no longer than double here")
    for module in (sys.modules[__name__], request.module):
        monkeypatch.setattr(module, "CASES", MANY if request.param == "64 bits" else FEW)
    with ref.extended() if request.param == "64 bits" else contextlib.nullcontext():
        yield


def sample(base, scalar, k=0, n=None, moderate=False):
    """The k-th n random arguments of a type; moderate: vectors of length 0.3 to 3, bodies of ordinary size."""
    n = n or CASES
    random = np.random.default_rng([k, *base.encode()])
    x = ref.sample(random, n, Type(base, "pointer" if base in SIZES else "value", True, scalar))
    if moderate:
        for i in VECTORS.get(base, []):
            v = x[:, i : i + 3].astype(float)
            x[:, i : i + 3] = v / np.linalg.norm(v, axis=1)[:, None] * random.uniform(0.3, 3, (n, 1))
        if base == "spatial_inertia":
            m, c = random.uniform(0.5, 2, n), random.normal(size=(n, 3))
            J = np.eye(3) * 4 + m[:, None, None] * ((c**2).sum(1)[:, None, None] * np.eye(3) - c[:, :, None] * c[:, None, :])
            x = np.concatenate([m[:, None], m[:, None] * c, ref.six(J)], 1).astype(x.dtype)
    return x


def room(width, scalar, n=None):
    return np.zeros((n or CASES, width), DTYPE[scalar])


def error(got, expected, scale, scalar):
    """The largest |got − expected|/scale over cases, in u; where scale is 0 the numbers must be equal."""
    e = ref.distance(np.asarray(got).reshape(len(expected), -1), expected.reshape(len(expected), -1))
    scale = np.broadcast_to(np.asarray(scale, float), e.shape)
    assert not np.any((e > 0) & (scale == 0))
    return (e / np.where(scale > 0, scale, 1)).max() / UNIT[scalar]


def bound(record_property, worst, limit=4):
    record_property("worst_u", float(worst))
    assert worst <= limit


def close(a, b, scalar, limit=64):
    """|a − b| ≤ limit u (1 + max |b|): for identities on arguments of moderate size."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    assert np.abs(a - b).max(initial=0) <= limit * UNIT[scalar] * (1 + np.abs(b).max(initial=0))
