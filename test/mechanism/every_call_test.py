"""Every public call of a model with arguments as careless programs give them: the right numbers, or a sentence that names the argument.

The table has all methods of `ksl.Model`, rows of api/algorithms among them: a new one is in it by itself, with arguments by the names of its parameters.
Never is the answer NaN out of finite numbers, or an error in the words of the interpreter, of NumPy or of the compiled module.
"""

import functools
import inspect
import re
import warnings
from dataclasses import fields, is_dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from algorithms_test import ROWS
from each_case import each
from linkages import FOURBAR, LIMIT, joint, link

import ksl

UR5 = Path(__file__).resolve().parents[2] / "examples/robots/ur5.urdf"
FOLLOWS = '<mimic joint="A" multiplier="-0.5" offset="0.1"/></joint>'
TREE = f"""<robot name="tree">{{}}{link("crank", 0.6, 0.05)}{link("coupler", 1.1, 0.16)}{link("rocker", 0.9, 0.13)}
{joint("A", "frame", "crank", "0 0 0", limit=LIMIT)}{joint("B", "crank", "coupler", "0.1 0.03 0").replace("</joint>", FOLLOWS)}{joint("D", "frame", "rocker", "0.35 0.04 0.04")}</robot>"""
ROBOTS = {
    "open": lambda: ksl.load(UR5),
    "mimic": lambda: ksl.load_string(TREE.format('<link name="frame"/>')),
    "floating": lambda: ksl.load_string(TREE.format(link("frame", 2.0, 0.1)), floating_base=True),
    "loops": lambda: ksl.load_string(FOURBAR, drives=["A"]),
    "floating loops": lambda: ksl.load_string(
        FOURBAR.replace('<link name="frame"/>', link("frame", 2.0, 0.1)), floating_base=True, drives=["A", "floating_base"]
    ),
}
N = 40
"""States of a batch: more than are computed at once."""
RAW = re.compile(
    r"cannot reshape|out of bounds|incompatible function|broadcast together|could not be broadcast|subscriptable|NoneType|unsupported|ambiguous|inhomogeneous|unpack|nb_|axis \d|encountered in",
    re.IGNORECASE,
)
OTHERS = {
    "to_urdf": "tests of files",
    "merged": "names_test",
    "with_physics": "physics_test",
    "as_array": "arguments_test",
    "in_order": "arguments_test",
    "random": "takes no array",
}
"""Methods whose arguments are no numbers, and where they are tested."""
ONE_POSITION = {"mobility", "independent", "branches", "reactions_null_basis", "reactions_unique", "modes", "compliance", "equilibrium", "linearise"}
"""What is asked of one position, and of no batch."""


class Robot:
    """A model, and what calls are given by the names of their parameters."""

    def __init__(self, kind):
        self.m = m = ROBOTS[kind]()
        rng = np.random.default_rng(5)
        q = m.random(rng, N)
        if m.loops:
            q[:, -3:] = np.linspace(-0.4, 0.4, N)[:, None] * [1, 0, 0]
            q = m.close(q, hold=["A"]).q
            assert m.close(q).converged.all()
        v, a, dv = rng.normal(size=(3, N, m.nv))
        if m.loops:
            v = m.consistent_velocity(q, v, m.drives)
            a = m.consistent_acceleration(q, v, a, m.drives)
        tip = m.link_names[-1]
        self.states = {"q": q, "q0": q, "q1": q[::-1].copy(), "v": v, "a": a, "tau": dv, "dv": dv, "weights": dv, "fraction": np.full(N, 0.3), "wrench": rng.normal(size=(N, 6)),
                       "target": m.frame_pose(q, tip)}  # fmt: skip
        self.plain = {"name": tip, "frame": tip, "names": tip, "seen_from": m.link_names[1], "joint": m.joint_names[-1], "given": m.drives or m.joint_names, "requests": m.reaction_request(),
                      "point": np.array([0, 0, 0.1]), "normal": np.array([0, 0, 1.0]), "times": np.array([0, 0.001]), "time": np.linspace(0, 1, N), "gravity": np.array([0, 0, -9.81]),
                      "link": tip, "mass": 2.0, "pose": np.eye(4)}  # fmt: skip

    def arguments(self, call, index):
        """Those of a call for the states of an index; numbers are NumPy's arrays."""
        found = {}
        for name, parameter in inspect.signature(getattr(ksl.Model, call)).parameters.items():
            if name in self.states and (parameter.default is parameter.empty or name == "q"):
                found[name] = self.states[name][index]
            elif name == "external":
                found[name] = {self.plain["link"]: self.states["wrench"][index]}
            elif name in self.plain and parameter.default is parameter.empty:
                found[name] = self.plain[name]
        if call == "wrench_table":
            found |= {name: self.states[name] for name in "qva"} | {"external": {self.plain["link"]: self.states["wrench"]}}
        if call == "simulate":
            found["external"] = {self.plain["link"]: self.states["wrench"][3]}
        if call == "hybrid_dynamics":
            found["names"] = [self.m.joint_names[-1]]
        if call == "inverse_kinematics":
            found |= {"q0": self.states["q"][index], "starts": 1}
        if call == "with_frozen_joints":
            found["joints"] = {self.m.joint_names[-1]: np.array(0.3)}
        if call == "with_parameters":
            found["parameters"] = {self.plain["link"]: np.array(self.m.link(self.plain["link"]).parameters)}
        if call == "with_payload":
            found |= {"center_of_mass": self.plain["point"], "inertia": np.eye(3)}
        return found


CALLS = [name for name, f in inspect.getmembers(ksl.Model, inspect.isfunction) if not name.startswith("_") and name not in OTHERS]
BATCHED = [
    name
    for name in CALLS
    if "q" in inspect.signature(getattr(ksl.Model, name)).parameters and name not in ONE_POSITION | {"wrench_table", "show", "free_bodies"}
] + ["difference", "interpolate"]


EVERY_ROBOT = each("robot", ROBOTS, functools.cache(Robot))


@pytest.fixture(autouse=True)
def no_page(monkeypatch):
    """What a page would show, without a page."""
    live = pytest.importorskip("ksl.viewer.live")
    monkeypatch.setattr(live, "Viewer", lambda scene, port, joint: scene)
    monkeypatch.setattr(live, "_in_notebook", lambda: True)


def numbers_of(result):
    """The arrays of a result."""
    if isinstance(result, (tuple, list)):
        return [x for part in result for x in numbers_of(part)]
    if is_dataclass(result) and type(result).__module__.startswith("ksl.") and not hasattr(result, "look"):
        return [x for f in fields(result) for x in numbers_of(getattr(result, f.name))]
    if hasattr(result, "column_names"):  # nothing stands where a joint has no such number
        return [column.drop_null().to_numpy() for column in result.columns if str(column.type) == "double"]
    return [np.asarray(result)] if isinstance(result, (np.ndarray, np.generic, float, int)) else []


def answer(robot, call, arguments):
    """Arrays, or the sentence with which a call refuses its arguments, or says why there is no more."""
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            found = numbers_of(getattr(robot.m, call)(**arguments))
            found = [np.triu(x) for x in found] if call == "mass_matrix_upper" and "out" not in arguments else found  # nothing else is written
            said = " ".join(str(w.message) for w in warned if w.category is RuntimeWarning)  # of runs that end early
        except (ValueError, TypeError) as e:
            said = str(e)
    if not said:
        return found
    assert not RAW.search(said) and "\n" not in said, said
    return said


def slots(arguments):
    """Names of arguments that hold numbers."""
    return [name for name, x in arguments.items() if isinstance(x, (np.ndarray, float)) or (isinstance(x, dict) and x)]


def replaced(arguments, name, make):
    """The arguments with other numbers in a slot: those of a mapping, too."""
    x = arguments[name]
    return arguments | {name: {key: make(np.asarray(value)) for key, value in x.items()} if isinstance(x, dict) else make(np.asarray(x))}


def one_number(value):
    def make(x):
        bad = np.array(x, dtype=float)
        bad[(-1,) * bad.ndim] = value
        return bad

    return make


WRONG = {
    "None": lambda x: None,
    "NaN": one_number(np.nan),
    "∞": one_number(np.inf),
    "one too many": lambda x: np.concatenate([x.reshape(*x.shape[:-1], -1), x.reshape(*x.shape[:-1], -1)[..., :1]], axis=-1) if x.ndim else np.zeros(2),
    "no numbers": lambda x: x[..., :0] if x.ndim else np.zeros(0),
    "text": lambda x: "seven",
    "object": lambda x: object(),
    "complex": lambda x: x + 1j,
}
SAID_OF = {"joints": "position|frozen", "parameters": "parameters|inertia", "center_of_mass": "centre of mass"}
"""What sentences call an argument, where it isn't by its name."""
NAN_IS_TAKEN = {"position_of", "velocity_of"}


@pytest.mark.parametrize("call", CALLS)
@EVERY_ROBOT
def test_wrong_numbers_are_refused_by_name(robot, call):
    for index in (3,) if call in ONE_POSITION else (3, slice(None)):
        arguments = robot.arguments(call, index)
        refusal = answer(robot, call, arguments)
        for name, wrong in product(slots(arguments), WRONG):
            may_miss = wrong == "None" and inspect.signature(getattr(ksl.Model, call)).parameters[name].default is None
            more_states = name == "fraction" and wrong in ("one too many", "no numbers")
            if may_miss or more_states or (call in NAN_IS_TAKEN and wrong in ("NaN", "∞")):
                continue
            said = answer(robot, call, replaced(arguments, name, WRONG[wrong]))
            assert isinstance(said, str), f"{call} takes {name} = {wrong}"
            assert said == refusal or re.search(rf"\b({SAID_OF.get(name, name)})\b", said), f"{call}, {name} = {wrong}: {said}"


@pytest.mark.parametrize("call", BATCHED)
@EVERY_ROBOT
def test_no_states_have_empty_results(robot, call):
    open_too = {"undetermined": "nan"} if call == "reactions_derivatives" else {}
    one, none = (answer(robot, call, robot.arguments(call, index) | open_too) for index in (3, slice(0)))
    if isinstance(one, str):
        assert isinstance(none, str)
    else:
        assert not isinstance(none, str), none
        of_all = 1 if call == "simulate" else 0  # the times are those of all runs
        assert [x.shape for x in none[of_all:]] == [(0, *x.shape) for x in one[of_all:]]


@pytest.mark.parametrize("call", sorted(ONE_POSITION))
@pytest.mark.parametrize("index", [slice(0), slice(2)])
@EVERY_ROBOT
def test_what_is_asked_of_one_position_refuses_others(robot, call, index):
    q, frame = robot.states["q"][index], {"frame": robot.plain["frame"]} if call == "compliance" else {}
    assert answer(robot, call, {"q": q} | frame).startswith(f"q has {len(q)} positions")
    one, same_one = (answer(robot, call, {"q": x} | frame) for x in (robot.states["q"][:1], robot.states["q"][0]))
    assert one == same_one if isinstance(one, str) else all(np.array_equal(x, y) for x, y in zip(one, same_one, strict=True))


def same(found, expected):
    return (
        found == expected
        if isinstance(expected, str)
        else all(np.array_equal(x, y, equal_nan=x.dtype.kind == "f") for x, y in zip(found, expected, strict=True))
    )


@pytest.mark.parametrize("call", CALLS)
@EVERY_ROBOT
def test_numbers_of_other_types_are_numbers(robot, call):
    for index, kind in product((3,) if call in ONE_POSITION else (3, slice(4)), (np.float16, np.int8, np.uint64, bool)):
        found, expected = robot.arguments(call, index), robot.arguments(call, index)
        for name in slots(found):
            found = replaced(found, name, lambda x: np.abs(x).astype(kind) if np.dtype(kind).kind in "ub" else x.astype(kind))
            expected = replaced(expected, name, lambda x: (np.abs(x) if np.dtype(kind).kind in "ub" else x).astype(kind).astype(float))
        assert same(answer(robot, call, found), answer(robot, call, expected)), kind


@pytest.mark.parametrize("call", CALLS)
@EVERY_ROBOT
def test_numbers_too_large_are_refused_or_right(robot, call):
    for index in (3,) if call in ONE_POSITION | {"simulate"} else (3, slice(None)):
        arguments = robot.arguments(call, index)
        for name, size in product(slots(arguments), (1e160, 1e200, -1e308)):
            require_finite(answer(robot, call, replaced(arguments, name, lambda x: np.full_like(x, size, dtype=float))), f"{name} = {size}")


def require_finite(found, what):
    """Or refused."""
    assert isinstance(found, str) or all(np.isfinite(x).all() for x in found if x.dtype.kind == "f"), what


@pytest.mark.parametrize("mass", [1e160, 1e250, 1e300])
@EVERY_ROBOT
def test_masses_too_large_are_refused_or_right(robot, mass):
    try:
        heavy = robot.m.with_parameters({robot.plain["link"]: (mass, (0.1, 0, 0), mass * np.eye(3))})
    except ksl.DescriptionError as e:
        assert "mass" in str(e)
        return
    other = object.__new__(Robot)
    other.__dict__ = robot.__dict__ | {"m": heavy}
    for call in CALLS:
        require_finite(answer(other, call, other.arguments(call, 3)), call)


WITH_OUT = [name for name in CALLS if "out" in inspect.signature(getattr(ksl.Model, name)).parameters]


@pytest.mark.parametrize("call", WITH_OUT)
@EVERY_ROBOT
def test_results_that_can_not_be_written_are_refused(robot, call):
    """Read-only, of another type or shape; and over an argument, where that may not be."""
    arguments = robot.arguments(call, slice(None))
    found = answer(robot, call, arguments)
    if isinstance(found, str):
        return
    for spoil in (lambda x: x.view(), lambda x: x.astype(np.float16), lambda x: x[1:], lambda x: x.tolist(), lambda x: "seven"):
        out = [spoil(x.copy()) for x in found]
        for x in out:
            if isinstance(x, np.ndarray):
                x.setflags(write=False)
        assert re.search(r"\bout\b", answer(robot, call, arguments | {"out": tuple(out) if len(out) > 1 else out[0]}))
    name = next(iter(slots(arguments)))
    memory = np.zeros(sum(x.size for x in found) + arguments[name].size)
    over = memory[: arguments[name].size].reshape(arguments[name].shape)
    over[...] = arguments[name]
    out = [memory[1 : 1 + x.size].reshape(x.shape) for x in found]
    assert re.search(r"\bout\b", answer(robot, call, arguments | {name: over, "out": tuple(out) if len(out) > 1 else out[0]}))


@pytest.mark.parametrize("call", [name for name in CALLS if "threads" in inspect.signature(getattr(ksl.Model, name)).parameters])
@EVERY_ROBOT
def test_threads_give_the_same_and_refuse_the_same(robot, call):
    arguments = robot.arguments(call, slice(None))
    expected = answer(robot, call, arguments | {"threads": 1})
    found = answer(robot, call, arguments | {"threads": 3})
    assert same(found, expected)
    if isinstance(expected, str):
        return
    bad = np.array(arguments["q"] if "q" in arguments else arguments.get("q0", arguments["q0"]))
    bad[37, 0] = np.nan
    name = "q" if "q" in arguments else "q0"
    assert name in answer(robot, call, arguments | {name: bad, "threads": 3})
    for threads in ("two", 1.5, -1, None):
        assert threads is None or "threads" in answer(robot, call, arguments | {"threads": threads})


def test_all_algorithms_are_in_the_table():
    assert {row.name for row in ROWS} <= set(CALLS)
