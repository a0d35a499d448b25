"""Every algorithm of api/algorithms/: all its faces give the same bits.

Python is held against C (one state, and batches), in double and float, with and without external wrenches.  Batches of any
size are their states; threads, `out=`, strides and leading shapes change nothing; no states give no results.  The faces of
C++ are held against those of C by the test that scripts/generator/tests.py makes.
"""

import ctypes
import functools
import math
import os
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from each_case import each
from random_states import random_states

import ksl

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "api"))
from algorithms import ALGORITHMS

ROWS = [row for row in ALGORITHMS if "python" in row.faces]
C_ROWS = [row for row in ROWS if "c" in row.faces or "c batch" in row.faces]
PUSHED, LINKS = [7, 3], [5, 2, 5]
"""Indices of links that wrenches act on, and that are asked for."""
OFFSET = [0.3, -0.2, 0.1]
CROSSED = {"axes": "world", "at": "frame", "order": "ang_lin"}
"""How a frame's motion is expressed: axes and point in different frames, and not in the default order."""
UNTOUCHED = {
    "operational_space": [True, False, True, True],  # its bias alone depends on them
    "inverse_dynamics_derivatives": [False, True, True],  # held in axes that move with q
    "forward_dynamics_derivatives": [False, True, True],
    "reactions_derivatives": [False, True, True],
    "inverse_dynamics_second_derivatives": [False, True, True, True],
    "forward_dynamics_second_derivatives": [False, True, True, True],
}
"""Which results external wrenches have no part in."""
PRECISIONS = {np.float64: ("", ctypes.c_double), np.float32: ("f", ctypes.c_float)}


@functools.cache
def robot_named(name):
    """An arm, on the ground and floating, a robot with every kind of joint, and the same with joints that follow others."""
    if name in ("every kind", "coupled"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ksl.DescriptionWarning)  # types beyond URDF
            return ksl.load(Path(__file__).resolve().parents[1] / f"engine/{name.replace(' ', '_')}.urdf")
    return ksl.load(Path(__file__).resolve().parents[2] / "examples/robots/panda.urdf", floating_base=name == "floating")


EVERY_ROBOT = each("robot", ["fixed", "floating", "every kind", "coupled"], robot_named)
EVERY_PRECISION = each("dtype", PRECISIONS)


def names(m, links):
    return [m.link_names[i] for i in links]


def inputs(m, row, *leading, dtype=np.float64):
    """The arguments of a row, by name."""
    if row.mimic == "refusal" and m.follower_names:
        pytest.skip("refused for robots with mimic joints")
    q, v, x = (x.astype(dtype) for x in random_states(m, np.random.default_rng(7), *leading))
    q1, _, _ = (x.astype(dtype) for x in random_states(m, np.random.default_rng(9), *leading))
    given = {"q": q, "v": v, "a": x, "tau": x, "q1": q1, "fraction": np.full(leading, 0.3, dtype)}
    arguments, links = {row.called.get(name, name): given[name] for name in row.inputs}, names(m, LINKS)
    arguments |= {
        "link": {"name": links[0]}, "frame": {"name": links[0], "offset": OFFSET} | CROSSED, "links": {row.links_keyword: links}, "frames": {row.links_keyword: links} | CROSSED,
        "relative": {"name": links[0], "seen_from": links[1], "offset": OFFSET} | CROSSED,
    }.get(row.request, {})  # fmt: skip
    if row.mimic == "hybrid":
        arguments["names"] = list(dict.fromkeys(m.joint_above(link).name for link in links))
    if row.keywords == "order":
        arguments["order"] = "ang_lin"
    if row.keywords == "kind":
        arguments["kind"] = "classical"
    if row.keywords == "point":
        arguments = {k: x for k, x in arguments.items() if k not in ("at", "order", "offset")} | {"point": OFFSET}
    if row.external:
        rng = np.random.default_rng(8)
        arguments["external"] = {name: rng.normal(size=(*leading, 6)).astype(dtype) for name in names(m, PUSHED)}
    return arguments


def python(m, row, arguments, **keywords):
    """Results, always as a list."""
    found = getattr(m, row.name)(**arguments, **keywords)
    found = list(found) if isinstance(found, tuple) else [found]
    return found if "out" in keywords else written(row, found)


def written(row, results):
    """What an algorithm writes of its results: of some matrices one triangle alone."""
    return [np.triu(x) for x in results] if row.name == "mass_matrix_upper" else results


def part(arguments, index):
    """Some of the states of a call."""
    take = lambda x: x[index] if isinstance(x, np.ndarray) else x
    return {k: {n: take(w) for n, w in x.items()} if isinstance(x, dict) else take(x) for k, x in arguments.items()}


def same(found, expected):
    return all(x.dtype == y.dtype and np.array_equal(x, y) for x, y in zip(found, expected, strict=True))


@pytest.mark.parametrize("row", ROWS, ids=lambda r: r.name)
@EVERY_PRECISION
@EVERY_ROBOT
def test_a_batch_of_any_size_is_its_states(robot, row, dtype):
    arguments = inputs(robot, row, 37, dtype=dtype)
    whole = python(robot, row, arguments)
    assert all(x.dtype == dtype for x in whole)
    for n in (0, 1, 2, 7, 8, 9, 17, 37):
        assert same(python(robot, row, part(arguments, slice(n))), [x[:n] for x in whole])
    for k in (0, 18, 36):
        assert same(python(robot, row, part(arguments, k)), [x[k] for x in whole])


@pytest.mark.parametrize("row", ROWS, ids=lambda r: r.name)
@EVERY_ROBOT
def test_layouts_threads_and_out_change_nothing(robot, row):
    large = max((len(result.shape) for result in row.results), default=0) > 2  # derivatives of matrices: thousands of numbers a state
    grid_of = (5, 12) if large else (20, 60)
    arguments = inputs(robot, row, math.prod(grid_of))
    whole = python(robot, row, arguments, threads=1)
    for threads in (None, 5):
        assert same(python(robot, row, arguments, threads=threads), whole)
    assert same(python(robot, row, part(arguments, slice(None, None, -3))), [x[::-3] for x in whole])
    grid = {k: {n: w.reshape(*grid_of, 6) for n, w in x.items()} if isinstance(x, dict) else x.reshape(*grid_of, *x.shape[1:]) if isinstance(x, np.ndarray) else x
            for k, x in arguments.items()}  # fmt: skip
    assert same(python(robot, row, grid), [x.reshape(*grid_of, *x.shape[1:]) for x in whole])
    out = [np.full_like(x, np.nan) for x in whole]
    found = python(robot, row, arguments, out=tuple(out) if len(out) > 1 else out[0])
    assert all(x is y for x, y in zip(found, out, strict=True)) and same(written(row, out), whole)


@pytest.mark.parametrize("row", ROWS, ids=lambda r: r.name)
@EVERY_ROBOT
def test_float_is_near_double(robot, row):
    double, single = (python(robot, row, inputs(robot, row, 50, dtype=dtype)) for dtype in PRECISIONS)
    for x, y in zip(single, double, strict=True):
        if row.name in ("operational_space_inertia", "operational_space"):
            continue  # singular for these frames, one of which comes twice: test/laws/operational_space_test.py
        loss = 1e4 if row.needs_mass or row.name == "operational_space_inertia_inverse" else 50  # the condition of a mass matrix
        assert np.abs(x - y).max() < 2e-7 * loss * max(1.0, np.abs(y).max())
        whole = np.array_equal(y, y.round())  # Jacobians of a robot whose joints all have one axis
        assert whole or not np.array_equal(x, y)


@pytest.mark.parametrize("row", [row for row in ROWS if row.external == "optional"], ids=lambda r: r.name)
@EVERY_ROBOT
def test_external_wrenches_count(robot, row):
    arguments = inputs(robot, row, 5)
    pushed = python(robot, row, arguments)
    free = python(robot, row, arguments | {"external": None})
    equal = [np.array_equal(x, y) for x, y in zip(pushed, free, strict=True)]
    assert equal == UNTOUCHED.get(row.name, [False] * len(equal))
    zero = {name: np.zeros(6) for name in names(robot, PUSHED)}
    assert same(python(robot, row, arguments | {"external": zero}), free)


def exchanged(x: np.ndarray, shape: tuple) -> np.ndarray:
    """Linear and angular halves of a result exchanged, along each axis of twists, wrenches or momenta, but for given wrenches on links."""
    for axis, (extent, before) in enumerate(zip(shape, (None, *shape), strict=False), x.ndim - len(shape)):
        if extent in (6, "6 links") and before != "all_links":
            x = np.roll(x.reshape(*x.shape[:axis], -1, 6, *x.shape[axis + 1 :]), 3, axis + 1).reshape(x.shape)
    return x


SIX = [row for row in ROWS if row.name == "reactions" or any(n in (6, "6 links") for r in row.results for n in r.shape)]


@pytest.mark.parametrize("row", SIX, ids=lambda r: r.name)
@EVERY_ROBOT
def test_every_result_with_six_numbers_has_an_order(robot, row):
    arguments = inputs(robot, row, 3)
    if row.name in ("operational_space_inertia", "operational_space"):  # of one frame, where that can move in all directions
        arguments["names"] = robot.link_names[-1:]
        if python(robot, row, arguments)[-1].min() < 6:
            pytest.skip("what a singular inertia leaves out depends on the order")
    linear, angular = (python(robot, row, arguments | {"order": order}) for order in ("lin_ang", "ang_lin"))
    for x, y, shape in zip(linear, angular, [r.shape for r in row.results] or [("joints", 6)], strict=True):
        assert np.abs(exchanged(x, shape) - y).max(initial=0) <= 1e-7 * np.abs(y).max(initial=1)
        assert np.array_equal(exchanged(x, shape), y) or row.name.startswith("operational")
    with pytest.raises(ValueError, match="order='angular'; expected one of 'lin_ang', 'ang_lin'"):
        python(robot, row, arguments | {"order": "angular"})
    with pytest.raises(ValueError, match="order="):
        python(robot, row, arguments | {"order": np.zeros(6)})


@EVERY_PRECISION
@EVERY_ROBOT
def test_a_triangle_is_chosen_by_name(robot, dtype):
    q = random_states(robot, np.random.default_rng(3), 4, 5)[0].astype(dtype)
    whole = robot.mass_matrix(q)
    assert np.array_equal(robot.mass_matrix(q, triangle="both"), whole)
    out = np.full_like(whole, 7)
    assert robot.mass_matrix(q, triangle="upper", out=out, threads=2) is out
    assert np.array_equal(out, np.where(np.tri(robot.nv, k=-1, dtype=bool), dtype(7), whole)), "nothing is written below the diagonal"
    for wrong in ("lower", "Upper", None, 1, out):
        with pytest.raises(ValueError, match="triangle=.*expected one of 'both', 'upper'"):
            robot.mass_matrix(q, triangle=wrong)


# C


class ExternalRows(ctypes.Structure):
    _fields_ = [("n", ctypes.c_int), ("link", ctypes.c_void_p), ("wrench", ctypes.c_void_p), ("stride", ctypes.c_ssize_t), ("axes", ctypes.c_int)]


class External(ctypes.Structure):
    _fields_ = [("n", ctypes.c_int), ("link", ctypes.c_void_p), ("wrench", ctypes.c_void_p), ("axes", ctypes.c_int)]


class FrameOptions(ctypes.Structure):
    _fields_ = [("axes", ctypes.c_int), ("at", ctypes.c_int), ("order", ctypes.c_int), ("kind", ctypes.c_int), ("offset", ctypes.c_double * 3)]


@pytest.fixture(scope="module")
def library():
    path = os.environ.get("KSL_LIBRARY")
    assert path, "KSL_LIBRARY names the library that make test builds"
    loaded = ctypes.CDLL(path)
    loaded.ksl_error_message.restype = ctypes.c_char_p
    return loaded


class Options(ctypes.Structure):
    _fields_ = [("floating_base", ctypes.c_bool), ("rest", ctypes.c_char * 127)]


class Loaded:
    """A model of the C library."""

    def __init__(self, library, m: ksl.Model) -> None:
        self.library, self.m, self.model, self.data = library, m, ctypes.c_void_p(), ctypes.c_void_p()
        library.ksl_model_options.restype = Options
        options = library.ksl_model_options()
        options.floating_base = "floating_base" in m.joint_names
        self.check(library.ksl_model_load(m.file.encode(), ctypes.byref(options), ctypes.byref(self.model)))
        self.check(library.ksl_data_create(self.model, ctypes.byref(self.data)))

    def check(self, status: int) -> None:
        assert status == 0, self.library.ksl_error_message()

    def links(self, names):
        return np.array([self.m.link_names.index(n) for n in names], np.int32)

    def call(self, row, arguments, dtype, batch: bool):
        """Results of a batch, or of one state."""
        n = len(arguments[row.input_names()[0]]) if batch else 1
        suffix, kept = PRECISIONS[dtype][0], []
        states = lambda x: x.reshape(n, -1)
        keep = lambda x: (kept.append(np.ascontiguousarray(x)), kept[-1].ctypes.data)[1]
        strided = lambda x: [ctypes.c_void_p(keep(states(x))), ctypes.c_ssize_t(states(x).shape[1])] if batch else [ctypes.c_void_p(keep(x))]
        given = [a for name in row.input_names() for a in strided(arguments[name])]
        external = arguments.get("external") or {}
        if row.external:
            link, wrench = keep(self.links(external)), keep(np.stack([states(w) for w in external.values()], axis=1))
            shape = ExternalRows(len(external), link, wrench, 6 * len(external)) if batch else External(len(external), link, wrench)
            given.append(ctypes.byref(shape))
        request = []
        if row.request == "links":
            request = [len(LINKS), ctypes.c_void_p(keep(np.array(LINKS, np.int32)))]
        elif row.request in ("frame", "frames", "relative"):
            which = {"frame": LINKS[:1], "frames": [len(LINKS), ctypes.c_void_p(keep(np.array(LINKS, np.int32)))], "relative": LINKS[:2]}
            request = [
                *which[row.request],
                ctypes.byref(FrameOptions(1, 0, row.keywords != "point", row.keywords == "kind", tuple(OFFSET) if row.request != "frames" else (0, 0, 0))),
            ]
        elif row.request in ("joints", "reactions"):
            joints = np.arange(len(self.m.joint_names), dtype=np.int32)
            request = [len(joints), ctypes.c_void_p(keep(joints)), None]
        request += [1] if row.keywords == "order" else []
        expected = [np.empty(x.shape, dtype) for x in python(self.m, row, arguments)]
        results = [
            a for x in expected for a in ([ctypes.c_void_p(x.ctypes.data), ctypes.c_ssize_t(x.size // n)] if batch else [ctypes.c_void_p(x.ctypes.data)])
        ]
        given += [*request, *results]
        external_batch = "_external" if row.external == "optional" and batch else ""
        function = getattr(self.library, f"ksl_{row.name}{external_batch}{'_batch' if batch else ''}{suffix}")
        if batch:
            self.check(function(self.model, ctypes.c_size_t(n), *given, 2))
        else:
            self.check(function(self.model, self.data, *given))
        return written(row, expected)


@pytest.mark.parametrize("row", C_ROWS, ids=lambda r: r.name)
@EVERY_PRECISION
@EVERY_ROBOT
def test_c_gives_the_bits_of_python(robot, library, row, dtype):
    loaded = Loaded(library, robot)
    arguments = inputs(robot, row, 21, dtype=dtype)
    whole = python(robot, row, arguments)
    assert same(loaded.call(row, arguments, dtype, batch=True), whole)
    if "c" in row.faces:
        for k in (0, 20):
            assert same(loaded.call(row, part(arguments, k), dtype, batch=False), [x[k] for x in whole])
