"""Every function of the algebra, many random cases in both precisions, against its formula (formulas.py) in 64-bit arithmetic, and
that against itself at 200 bits."""

import contextlib
import zlib

import numpy as np
import pytest

import reference as ref
from formulas import TABLE
from functions import everything
from random_cases import AT_200_BITS as WITNESSED  # of these, which the others' reference must agree with
from random_cases import MANY as CASES  # against 64-bit arithmetic
from reference import UNIT, mp, norm

CHUNK = 20_000  # at a time, for the sake of memory
FUNCTIONS = everything()
FLOAT_ONLY = {
    "ksl_slerpf": "ksl_quaternion_slerp",
    "ksl_slerp": "ksl_quaternion_slerp",
    "ksl_squadf": "ksl_quaternion_squad",
    "ksl_nlerpf": "ksl_quaternion_nlerp",
    "ksl_quaternionf_toMat3x3f": "ksl_quaternion_toMat3x3",
    "kls_add_dpiToq": "ksl_add_dpiToq",
    "ksl_mat4x4f_toSE3f": "ksl_mat4x4_toSE3",
    "ksl_mat4x4f_fromSE3f": "ksl_mat4x4_fromSE3",
    "catan2pi": "ksl_catan2pi",
    "catan2pif": "ksl_catan2pi",
    "catan1pi": "ksl_catan1pi",
    "catan1pif": "ksl_catan1pi",
    "ksl_mat3x3f_getEulerAnglesWithReference": "ksl_mat3x3_getEulerAnglesWithReference",
    "ksl_hrxinvf": "ksl_hsrxinv",
    "ksl_SE3f_toMat4x4f": "ksl_SE3_toMat4x4",
    "ksl_SE3_toMat4x4f": "ksl_SE3_toMat4x4",
}

# tested elsewhere: where
ELSEWHERE = {
    "memory_test.py": [
        *(f"{kind}_alloc" for kind in ("vec3", "vec3i", "vec4", "vec4i", "mat3x3", "mat4x4", "SE3", "screw", "coscrew", "inertia", "quaternion")),
        *(f"{kind}_{verb}" for kind in ("mat3x3", "mat4x4", "SE3") for verb in ("get", "set")),
        *(f"screw_{name}" for name in ("copy_rmo", "copy_cmo", "ncopy_rmo", "ncopy_cmo", "scatter")),
        *("vec3i", "vec3i_isEqual", "vec4i"),
    ],
    "exponential_test.py": ["SE3_exp", "SE3_log", "exp_coefficients", "angle_rest", "larger_q", "mat3x3_toQuaternionRay", "dc", "mat3x3_setFromAxisAngle"],
    "matrix6_test.py": [
        *("mat3x3_setTilde", "cross_vdr", "screw_gather", "coscrew_gather", "coscrew_scatter"),
        *(f"matrix6_{name}" for name in ("setBlock", "setBlocks", "getBlock", "stiffnessTransformed", "complianceTransformed")),
        *(f"matrix6_{kind}_{order}mo" for kind in ("Ad", "CoAd", "ad", "coad", "spatial_inertia", "articulated_inertia") for order in "rc"),
    ],
    "joint_space_test.py": [
        "vec3_setAxis",
        *(f"joint_space_{name}" for name in ("setCoordinate", "setTurn", "set", "transformed", "twist", "efforts", "drive", "actuation", "constraint")),
    ],
    "plucker_test.py": [
        *(f"plucker_{name}" for name in ("rx", "ry", "rz", "rotx", "roty", "rotz", "toMatrix", "fromMatrix", "mcI", "toMcI")),
        *(f"plucker_{kind}_{order}mo" for kind in ("crm", "crf", "motion", "force", "fromMotion", "inertia") for order in "rc"),
    ],
    "poinsot_test.py": ["poinsot_vv", "unpoinsot_vv", "screw_getAxis", "screw_fromAxis", "coscrew_getAxis", "coscrew_fromAxis"],
    "errata_test.py": ["inertia_factor", "inertia_rank"],
    "quaternion_test.py": ["mat3x3_toQuaternion", "log_q", "atEnd_q", *(f"quaternion_{name}" for name in ("exp", "log", "slerp", "nlerp", "squad"))],
    "euler_test.py": [
        *("axis_getIndices", "axis_getVector", "axis_getEulerAngles"),
        *(f"mat3x3_{name}" for name in ("setFromEulerAngles", "getEulerAnglesNear", "getEulerAnglesWithReference", "getAxisAngle", "pca")),
    ],
    "trig_test.py": ["normalizeDegrees", "normalizeRadians", "catan2pi", "catan1pi", "addHalfTurns", "angleFrom"],
    "lie_test.py": [
        *("mat3x3_exp", "mat3x3_log", "log_coefficient", "jacobian_coefficients", "SE3_storeBlocks"),
        *(
            f"{kind}_{side}Jacobian{inverse}{order}"
            for kind in ("mat3x3", "SE3")
            for side in ("left", "right")
            for inverse in ("", "Inverse")
            for order in (("", "_rmo", "_cmo") if kind == "SE3" else ("",))
        ),
    ],
    # helpers whose every use is in a row above
    "here": ["turn_vv", "orthonormalize_vvv", "inertia_setMatrix", "inertia_addParallelAxis", "inertia_getCentroid", "product_drSdrinv"],
}
NOT_HERE = {f"ksl_{name}" for names in ELSEWHERE.values() for name in names}


def double_name(name):
    return FUNCTIONS[name].double or FLOAT_ONLY.get(name, name)


def test_no_name_is_forgotten():
    assert [n for n in FUNCTIONS if double_name(n) not in TABLE and double_name(n) not in NOT_HERE] == []
    assert [n for n in TABLE if n not in FUNCTIONS] == []
    assert [n for n in NOT_HERE if n not in FUNCTIONS] == []


SAMPLES = {}


def samples(t, k):
    """The k-th sample of a type: made once, shared by all functions."""
    key = (t.base, t.scalar, t.kind if t.base == "real" else "", k)
    if key not in SAMPLES:
        with ref.extended() if ref.HAS_EXTENDED else contextlib.nullcontext():
            SAMPLES[key] = ref.sample(np.random.default_rng(zlib.crc32(repr(key).encode())), CASES if ref.HAS_EXTENDED else 10 * WITNESSED, t)
    return SAMPLES[key]


def arguments(f):
    seen, out = {}, []
    for t in f.args:
        k = seen.get((t.base, t.kind == "value"), 0)
        seen[(t.base, t.kind == "value")] = k + 1
        out.append(samples(t, k))
    return out


def worst_error(name, got, expected, scalar):
    """The largest error over vectors of the result and cases, in u of the scale; exact numbers must be exact."""
    start, worst = 0, 0.0
    for value, scale in expected:
        value = value.reshape(len(value), -1)
        end = start + value.shape[1]
        error = ref.distance(got[:, start:end], value)
        start = end
        inexact = error > 0
        assert not np.any(inexact & (scale == 0)) or (scalar == "float" and name == "ksl_SE3_toMat4x4f")
        if name == "ksl_SE3_toMat4x4f":
            scale = norm(value)
        inexact &= scale > 0
        if inexact.any():
            worst = max(worst, (error[inexact] / scale[inexact]).max() / UNIT[scalar])
    assert start == got.shape[1]
    return worst


def agree(witness, expected):
    """The reference in 64-bit arithmetic is that at 200 bits, to a fiftieth of the unit roundoff of double."""
    for (exact, _), (value, scale) in zip(witness, expected):
        n = len(exact)
        exact, scale = exact.reshape(n, -1), scale[:n]
        value = value[:n].reshape(n, -1)
        upper = value.astype(float)
        apart = norm(exact - upper.astype(object) - (value - upper).astype(float).astype(object))
        assert np.all(apart <= 0.02 * UNIT["double"] * np.where(scale > 0, scale, norm(exact)))


@pytest.mark.many_cases
@pytest.mark.parametrize("name", [n for n in FUNCTIONS if double_name(n) in TABLE])
def test_error(ksl, name, record_property):
    f = FUNCTIONS[name]
    reference, bound = TABLE[double_name(name)]
    given = arguments(f)
    scalar = "float" if any(t.scalar == "float" for t in [*f.args, f.returns]) else "double"
    options = {"eps": 2 * UNIT[scalar]} if "eps" in reference.__code__.co_varnames[: reference.__code__.co_argcount] else {}
    got = ksl.outputs(name, *given)
    got = np.concatenate([g.reshape(len(g), -1).astype(np.float64) for g in got], 1)

    few = slice(WITNESSED if ref.HAS_EXTENDED else None)
    witness = reference(*(mp(x[few]) for x in given), **options)
    worst = worst_error(name, got[few], witness, scalar)
    if ref.HAS_EXTENDED:
        with ref.extended():
            for first in range(0, len(got), CHUNK):
                chunk = slice(first, first + CHUNK)
                expected = reference(*(mp(x[chunk]) for x in given), **options)
                worst = max(worst, worst_error(name, got[chunk], expected, scalar))
                if first == 0:
                    agree(witness, expected)
    record_property("worst_u", float(worst))
    assert worst <= bound
