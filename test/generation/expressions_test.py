"""Recordings that Python makes: which steps numbers leave, and that a recording is played, replayed and printed to the same numbers."""

import numpy as np
import pytest
from ksl.generation.expressions import Graph, cosine, is_zero, played, sine
from ksl.generation.recording import Operation
from numpy.testing import assert_array_equal

OF_ONE = {
    "x + 0": "x", "0 + x": "x", "x - 0": "x", "x * 1": "x", "1 * x": "x", "x / 1": "x", "-(-x)": "x", "x + 0 * y": "x", "(x * 1) / (y / y * 0 + 1)": "x",
    "0 - x": "-x", "x * -1": "-x", "-1 * x": "-x", "0 * x": 0.0, "x * 0": 0.0, "0 / x": 0.0, "2 * 3 + x * 0": 6.0,
    "x + y": "y + x", "x * y": "y * x", "x * (y + 2)": "(2 + y) * x",
}  # fmt: skip
OF_THEIR_OWN = [
    "x",
    "y",
    "-x",
    "x + y",
    "x - y",
    "y - x",
    "x * y",
    "x / y",
    "y / x",
    "1 / x",
    "x - 1",
    "1 - x",
    "x + 1",
    "2 * x",
    "x / 2",
    "x / -1",
    "1 + x / y",
]


def test_zeros_and_ones_leave_no_steps():
    """And a step is noted once, whatever the order of what sums and products take."""
    graph = Graph()
    names = dict(zip("xy", graph.inputs("given", 2)))
    for text, same in OF_ONE.items():
        found, wanted = eval(text, names), eval(same, names) if isinstance(same, str) else same
        assert found == wanted if isinstance(same, float) else found.step == wanted.step, text
    assert len({eval(text, names).step for text in OF_THEIR_OWN}) == len(OF_THEIR_OWN)
    choose = lambda condition: graph.put(Operation.SELECT, condition, names["x"], names["y"])
    assert (choose(1.0), choose(0.0)) == (names["x"], names["y"]) and choose(names["x"]) not in (names["x"], names["y"])
    assert [is_zero(x) for x in (0.0, 1.0, 0 * names["x"], names["x"])] == [True, False, True, False]


def formula(graph, p, q):
    """Results of three shapes, which use all operations: of numbers of a graph, or, without one, of NumPy's."""
    put = (lambda what, *x: graph.put(what, *x)) if graph else lambda what, *x: PLAIN[what](*x)
    r = put(Operation.ROOT, p[0] * p[0] + q[2] * q[2] + 1.0)
    chosen = put(Operation.SELECT, put(Operation.LESS, p[0], q[1]), p[1] / r, -q[0])
    equal = put(Operation.SELECT, put(Operation.AT_MOST, p[1], p[1]), put(Operation.ABSOLUTE, q[1]), 7.0)
    other = put(Operation.SELECT, put(Operation.EQUAL, p[0], 0.25), put(Operation.ARCTANGENT, p[1], q[2]), 3.0 - q[2])
    return {"one": sine(chosen) - cosine(r), "table": [[p[0], 2.5, equal], [other, 0.0, 1.0 / q[1]]], "none": []}


PLAIN = {
    Operation.ROOT: np.sqrt, Operation.SELECT: lambda a, b, c: b if a else c, Operation.LESS: lambda a, b: a < b, Operation.AT_MOST: lambda a, b: a <= b,
    Operation.EQUAL: lambda a, b: a == b, Operation.ABSOLUTE: abs, Operation.ARCTANGENT: np.arctan2,
}  # fmt: skip


@pytest.fixture(scope="module")
def recording():
    graph = Graph()
    p, q = graph.inputs("p", 2), graph.inputs("q", 3)
    p[0] * q[0] * 17.0  # a step that no result needs
    return graph.recording("formula", formula(graph, p, q))


def test_recordings_are_played_to_the_numbers_of_numpy(recording):
    rng = np.random.default_rng(3)
    P, Q = rng.normal(size=(6, 2)), rng.normal(size=(6, 3))
    P[3, 0] = 0.25
    wanted = [[np.array(x, float) for x in formula(None, p, q).values()] for p, q in zip(P, Q)]
    for of_result, exact in zip(played(recording, P, Q), zip(*wanted), strict=True):
        assert_array_equal(of_result, exact)
    for p, q, one in zip(P, Q, wanted):
        for found, exact in zip(recording.play([p, q]), one, strict=True):
            assert_array_equal(found, exact.ravel())
        for found, exact in zip(Graph().replayed(recording, p, q), one, strict=True):  # of floats nothing is left to be noted
            assert_array_equal(found.astype(float), exact)


def test_a_replayed_recording_has_its_steps_again(recording):
    graph = Graph()
    p, q = graph.inputs("p", 2), graph.inputs("q", 3)
    again = graph.recording("formula", dict(zip(("one", "table", "none"), graph.replayed(recording, p, q))))
    for name in ("operations", "operands", "numbers", "outputs"):
        assert_array_equal(getattr(again, name), getattr(recording, name), err_msg=name)
    assert (again.inputs, again.results) == (recording.inputs, recording.results) == ((("p", 2), ("q", 3)), (("one", ()), ("table", (2, 3)), ("none", (0,))))


def test_what_is_counted(recording):
    """Sums, differences, products and quotients of the formula; the angles of which there are a sine or a cosine; the inputs that are read."""
    assert recording.arithmetic == 8 and recording.angles == 2
    assert [recording.count(x) for x in (Operation.MULTIPLY, Operation.SELECT, Operation.NEGATE)] == [2, 3, 1] and recording.sizes() == [1, 6, 0]
    graph = Graph()
    (x,), _, (z,) = graph.inputs("x", 1), graph.inputs("y", 2), graph.inputs("z", 1)
    of_two = graph.recording("", {"sum": sine(x) + cosine(x) + z})
    assert [of_two.reads(name) for name in "xyz"] == [True, False, True] and of_two.angles == 1
