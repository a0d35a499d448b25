"""Calls of every function of the algebra with one number of its arguments changed at a time: what NaN, infinities and subnormal numbers do
(nan_test.py, not_finite_test.py)."""

import numpy as np

import reference as ref
from cases import DTYPE
from functions import SIZES, everything

FUNCTIONS = everything()
CASES = 12
ROOM = 80  # numbers of an array argument, of which functions read 36 at most
READ = 36
# tested elsewhere: a refused argument is left as it is and told by what is returned (errata_test.py); indices alone
NOT_HERE = {"inertia_factor", "inertia_rank", "axis_getIndices", "joint_space_setCoordinate"}
# choices between two, of which the functions that use them make NaN where they must
NOT_HERE |= {"larger_q", "atEnd_q", "mat3x3_toQuaternionRay"}
WHOLE = {"int", "bool", "ptrdiff_t", "axis_enum"}


def is_number(t):
    return t.scalar in ("double", "float") and t.base not in WHOLE


def is_array(t):
    return t.base == "real" and t.kind != "value"


def changes(x):
    return [x * (1 + 2.0**-8), -x, 0 * x, x + 1, x + 1e3, x - 1e3, x * 1e-3]


def arguments(f, random):
    """Random arguments of ordinary size; in every third case a vector of them is zero."""
    out = []
    for t in f.args:
        if is_array(t):
            angle = random.uniform(-3, 3, CASES)
            x = random.normal(size=(CASES, ROOM))
            x[:, 0], x[:, 1] = np.sin(angle), np.cos(angle)
            out.append(x.astype(DTYPE[t.scalar]))
        elif t.base == "ptrdiff_t":
            out.append(np.full(CASES, 3))
        elif t.base == "int" and f.name.startswith("ksl_joint_space") and f.name.endswith("_set"):
            out.append(np.arange(CASES) % (3 if len(out) == 2 else 9))  # kind, axis
        elif t.base == "real":
            out.append(random.uniform(0.1, 0.9, CASES).astype(DTYPE[t.scalar]))
        else:
            x = np.concatenate([ref.sample(random, CASES, t) for _ in range(4 if t.kind == "array" else 1)], -1)  # squad takes four quaternions
            if t.base in ("vec3", "screw", "coscrew", "motion", "force"):
                x = random.normal(size=x.shape).astype(x.dtype)
                x[::3, :3] = 0
                x[1::6, 3:] = 0
            out.append(x)
    return out


def results(ksl, f, args):
    """The real numbers that each call leaves, (calls, n)."""
    result, after = ksl(f.name, *args)
    calls = len(args[0])
    written = [x for t, x in zip(f.args, after) if t.kind != "value" and not t.const and is_number(t)]
    if f.returns.base in SIZES or f.returns.base == "real":
        written.append(np.asarray(result))
    return np.concatenate([np.asarray(x, np.float64).reshape(calls, -1) for x in written], 1) if written else np.zeros((calls, 0))


def with_numbers():
    for f in FUNCTIONS.values():
        if not f.name.endswith("_alloc") and (f.double or f.name).removeprefix("ksl_") not in NOT_HERE and any(map(is_number, f.args)):
            yield f


def varied(ksl, f, args, variants):
    """Of every number that a function is given: which it is, (argument, number), and the results (variants, CASES, n) with each variant in its place.

    variants(values) gives arrays (CASES,), or numbers.  All calls are made at once."""
    places = [(k, j) for k, t in enumerate(f.args) if is_number(t) for j in range(min(args[k].reshape(CASES, -1).shape[1], READ))]
    if not places:
        return []
    count = len(variants(np.zeros(CASES)))
    many = [np.tile(a, (len(places) * count, *[1] * (a.ndim - 1))) for a in args]
    for p, (k, j) in enumerate(places):
        for n, x in enumerate(variants(args[k].reshape(CASES, -1)[:, j])):
            first = (p * count + n) * CASES
            many[k].reshape(len(many[k]), -1)[first : first + CASES, j] = x
    return zip(places, results(ksl, f, many).reshape(len(places), count, CASES, -1))


def differ(before, after):
    """Which results (CASES, n) one of the variants changes."""
    return ((after != before) & ~(np.isnan(after) & np.isnan(before))).any(0)
