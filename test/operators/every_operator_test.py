"""Every operator of both libraries with arguments as careless programs give them: the right numbers, or a sentence that names the argument."""

import functools
import importlib
import re

import numpy as np
import pytest
from each_case import each
from operator_cases import arguments, closed_named, robot_named

from ksl.operators.table import COMPLETIONS, ROWS

N = 3
RAW = re.compile(r"cannot reshape|out of bounds|incompatible|broadcast together|subscriptable|NoneType|unsupported|ambiguous|inhomogeneous")


@pytest.fixture(scope="module", params=["jax", "torch"])
def library(request):
    found = pytest.importorskip(request.param, reason=f"needs {request.param}: pip install 'ksl[{request.param}]'")
    if request.param == "jax":
        found.config.update("jax_enable_x64", True)
        return importlib.import_module("ksl.jax"), found.numpy.asarray
    return importlib.import_module("ksl.torch"), found.as_tensor


@functools.cache
def case_of(library, robot):
    """A model, its calls, and its motion where it has loops."""
    if robot != "four-bar":
        m, motion = robot_named(robot), None
    else:
        c = closed_named(robot)
        m, motion = c.model, dict(zip("qva", c.motions(np.random.default_rng(0), N)))
    return m, library[0].differentiable(m), motion


EVERY_ROBOT = each("robot", ["floating", "coupled", "four-bar"])


def given_to(library, robot, name):
    """{input: array} of an operator, and its call with arrays of NumPy or of the library."""
    m, d, motion = case_of(library, robot)
    row = (ROWS | COMPLETIONS)[name]
    if name in COMPLETIONS and motion is None:
        pytest.skip("of mechanisms with loops")
    if motion is not None and name not in COMPLETIONS and name in ("mass_matrix",):
        pytest.skip("of trees")
    numbers = dict(zip(row.inputs, arguments(m, row.inputs, np.random.default_rng(1), N)))
    numbers |= {k: x for k, x in (motion or {}).items() if k in numbers}
    more = {"hold": m.drives} if name == "close" else {"given": m.drives} if name in COMPLETIONS else {}
    return numbers, lambda x: np.asarray(getattr(d, name)(*x.values(), **more))


def said(call, x):
    with pytest.raises((ValueError, TypeError)) as e:
        call(x)
    text = str(e.value)
    assert not RAW.search(text) and "\n" not in text.split("For simplicity")[0].strip(), text
    return text


@pytest.mark.parametrize("name", [*ROWS, *COMPLETIONS])
@EVERY_ROBOT
def test_wrong_arrays_are_refused_by_name(library, robot, name):
    numbers, call = given_to(library, robot, name)
    for which, x in numbers.items():
        for wrong in (None, "seven", object(), x + 1j, np.concatenate([x, x[..., :1]], axis=-1), x[..., :0], np.zeros((2, *x.shape[1:]))):
            text = said(call, numbers | {which: wrong}) if len(numbers) > 1 or np.shape(wrong)[:1] != (2,) else which
            assert re.search(rf"\b{which}\b", text), text


@pytest.mark.parametrize("name", [*ROWS, *COMPLETIONS])
@EVERY_ROBOT
def test_other_types_and_no_states(library, robot, name):
    numbers, call = given_to(library, robot, name)
    expected, array = call(numbers), library[1]
    assert np.array_equal(call({k: array(x) for k, x in numbers.items()}), expected), "arrays of NumPy are constants"
    assert call({k: x[:0] for k, x in numbers.items()}).shape == (0, *expected.shape[1:])
    small = {k: x.astype(np.float16) for k, x in numbers.items()}
    with (
        pytest.raises(TypeError, match="float16; expected .*float32 or .*float64")
        if robot != "four-bar" or name == "close"
        else pytest.raises((TypeError, ValueError))
    ):
        call({k: array(x) for k, x in small.items()})


@pytest.mark.parametrize("name", [*ROWS, *COMPLETIONS])
@each("bad", [np.nan, np.inf, 1e200])
@EVERY_ROBOT
def test_a_state_with_bad_numbers_is_alone(library, robot, name, bad):
    numbers, call = given_to(library, robot, name)
    expected = call(numbers)
    for which, x in numbers.items():
        spoilt = x.copy()
        spoilt[1, -1] = bad
        try:
            found = call(numbers | {which: spoilt})
        except Exception as e:  # a state that isn't closed
            assert robot == "four-bar" and re.search(r"state 1|closed|open|velocit|accelerat", str(e)), str(e)
            continue
        assert np.array_equal(found[[0, 2]], expected[[0, 2]])
        assert bad == 1e200 or not np.isfinite(found[1]).all()
