"""Results are the same, to the bit, wherever the output lies: on an input, or inside one."""

import itertools
import zlib

import numpy as np
import pytest

import reference as ref
from functions import SIZES, everything

CASES = 100
FUNCTIONS = everything()
# where a vec3 lies inside a larger argument
INSIDE = {
    "SE3": [9],
    "screw": [0, 3],
    "coscrew": [0, 3],
    "motion": [0, 3],
    "force": [0, 3],
    "plucker": [9],
    "mat3x3": [0, 3, 6],
    "quaternion": [0],
    "inertia": [1],
    "spatial_inertia": [1],
}


def is_output(t):
    return t.kind == "pointer" and not t.const and t.base in SIZES


def is_input(t):
    return t.kind == "pointer" and t.base in SIZES


def same_type(a, b):
    return (a.base, a.scalar) == (b.base, b.scalar)


def pairs(f):
    return itertools.permutations(enumerate(f.args), 2)


# of each function, (output, input) for each output that may be an input of its own type
ALIASES = {f.name: [(i, j) for (i, a), (j, b) in pairs(f) if is_output(a) and is_input(b) and b.const and same_type(a, b)] for f in FUNCTIONS.values()}
# of each function, (output or input vec3, larger argument, number at which it begins there)
INSIDES = {
    f.name: [
        (i, j, k)
        for (i, a), (j, b) in pairs(f)
        if is_input(a) and is_input(b) and a.base == "vec3" and a.scalar == b.scalar and (is_output(a) or is_output(b))
        for k in INSIDE.get(b.base, [])
    ]
    for f in FUNCTIONS.values()
}


def arguments(f):
    """Independent random arguments; what shares memory in a call is given equal values before it."""
    random = np.random.default_rng(zlib.crc32(f.name.encode()))
    return [ref.sample(random, CASES, t) for t in f.args]


def bits(arrays):
    return [np.ascontiguousarray(x).view(np.uint8) for x in arrays]


def test_something_is_tested():
    assert sum(map(len, ALIASES.values())) >= 2 * 75
    assert sum(map(len, INSIDES.values())) >= 2 * 20


@pytest.mark.parametrize("name", [name for name, there in ALIASES.items() if there])
def test_output_on_an_input(ksl, name):
    for output, given in ALIASES[name]:
        args = arguments(FUNCTIONS[name])
        args[output] = args[given].copy()  # what an accumulator holds before the call
        apart = ksl.outputs(name, *args)
        together = ksl.outputs(name, *args, alias=(output, given))
        for a, b in zip(bits(apart), bits(together)):
            assert np.array_equal(a, b), (output, given)


@pytest.mark.parametrize("name", [name for name, there in INSIDES.items() if there])
def test_vector_inside_an_argument(ksl, name):
    """The output is part of an input (Do->t, say), or an input is part of the output."""
    f = FUNCTIONS[name]
    for part, whole, at in INSIDES[name]:
        args = arguments(f)
        args[part] = args[whole][:, at : at + 3].copy()
        _, apart = ksl(name, *args)
        _, together = ksl(name, *args, inside=(part, whole, at))
        output = part if is_output(f.args[part]) else whole
        assert np.array_equal(*bits([apart[output], together[output]])), (part, whole, at)


@pytest.mark.parametrize(
    "name",
    [
        f.name
        for f in FUNCTIONS.values()
        if len(f.args) == 3
        and is_output(f.args[2])
        and f.args[0].const
        and f.args[1].const
        and same_type(f.args[0], f.args[1])
        and same_type(f.args[1], f.args[2])
    ],
)
def test_all_three_the_same(ksl, name):
    f = FUNCTIONS[name]
    x = arguments(f)[0]
    apart = ksl.outputs(name, x, x, x)[-1]
    call, _, _ = ksl._function(name)
    y = np.array(x, order="C")
    for p in range(y.ctypes.data, y.ctypes.data + y.nbytes, y.strides[0]):
        call(p, p, p)
    assert np.array_equal(*bits([apart, y]))
