"""Every operator of the table, by itself: derivatives of all orders against differences and each other, on NumPy arrays.

What torch and JAX make of them is in torch_test.py and jax_test.py.
"""

import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from operator_cases import arguments, robot_named

import ksl
from ksl.mechanism.requests import request_of_frames, request_of_links
from ksl.operators.operator import More, Operator, Stage, layout
from ksl.operators.table import ROWS

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "api"))
from algorithms import ALGORITHMS

CROSSED = ("world", "frame", "ang_lin", (0.3, -0.2, 0.1))
STEP = 1e-4
N = 5


def request_of(m: ksl.Model, name: str):
    """Two links, or joints, not in order, in unusual axes."""
    links = [m.link_names[-1], m.link_names[1]]
    if name == "frame_poses":
        return request_of_links(m, links)
    if name in ("frame_velocities", "frame_accelerations"):
        return request_of_frames(m, links, *CROSSED, "classical" if "acc" in name else "spatial")
    return m.reaction_request("parent", "world", links[0], "ang_lin", "total", [j.name for j in m.joints][::2]) if name == "reactions" else None


def operator_of(m: ksl.Model, name: str, parameters: bool = False, threads: int = 1) -> Operator:
    return Operator(m, name, request_of(m, name), More(parameters=parameters), threads)


def run(operator: Operator, stage: Stage, *given: np.ndarray) -> list[np.ndarray]:
    groups, states = given[0].shape[:2]
    results = [np.full(shape, np.nan, given[0].dtype) for shape in operator.result_shapes(stage, groups, states)]
    operator.compute(stage, [np.ascontiguousarray(x) for x in given], results)
    return results


def grouped(operator: Operator, given: list[np.ndarray]) -> list[np.ndarray]:
    """One group of states."""
    return [x[None] for x in given]


def differences(operator: Operator, stage: Stage, x: list[np.ndarray], fixed: list[np.ndarray], change: list[np.ndarray]) -> list[np.ndarray]:
    """The change of a stage along a change of the inputs, by central differences of order four."""
    total = None
    for factor, weight in ((1, 2 / 3), (-1, -2 / 3), (2, -1 / 12), (-2, 1 / 12)):
        moved = [a + factor * STEP * b for a, b in zip(x, change)]
        results = [weight / STEP * y for y in run(operator, stage, *moved, *fixed)]
        total = results if total is None else [a + b for a, b in zip(total, results)]
    return total


def close(found: list[np.ndarray], expected: list[np.ndarray], tolerance: float) -> None:
    for a, b in zip(found, expected, strict=True):
        assert np.abs(a - b).max() < tolerance * max(1.0, np.abs(b).max())


def case(m: ksl.Model, name: str, parameters: bool, seed: int = 0):
    operator = operator_of(m, name, parameters)
    rng = np.random.default_rng(seed)
    x = grouped(operator, arguments(m, operator.inputs, rng, N))
    others = lambda: [rng.normal(size=a.shape) for a in x]
    weights = rng.normal(size=(1, N, operator.numbers))
    return operator, x, others(), others(), weights


@pytest.mark.parametrize("name", ROWS)
@pytest.mark.parametrize("parameters", [False, True], ids=["", "parameters"])
def test_first_derivatives(robot, name, parameters):
    if parameters and not ROWS[name].regressor:
        pytest.skip("no derivative by parameters")
    operator, x, dx, _, weights = case(robot, name, parameters)
    (change,) = run(operator, Stage.JVP, *x, *dx)
    close([change], differences(operator, Stage.VALUE, x, [], dx), 1e-8)
    gradients = run(operator, Stage.VJP, *x, weights)
    along = sum((g * d).sum() for g, d in zip(gradients, dx, strict=True))
    assert abs(along - (weights * change).sum()) < 1e-10 * max(1.0, np.abs(change).max() * N * operator.numbers)


@pytest.mark.parametrize("name", [name for name in ROWS if ROWS[name].second])
def test_second_derivatives(robot, name):
    """By raw numbers of q they are symmetric, which those along joint velocities are not."""
    operator, x, dx, other, weights = case(robot, name, False)
    (change,) = run(operator, Stage.SECOND_JVP, *x, *dx, *other)
    close([change], differences(operator, Stage.JVP, x, dx, other), 1e-6)
    close([change], run(operator, Stage.SECOND_JVP, *x, *other, *dx), 1e-11)
    gradients = run(operator, Stage.SECOND_VJP, *x, weights, *other)
    close(gradients, differences(operator, Stage.VJP, x, [weights], other), 1e-6)
    along = sum((g * d).sum() for g, d in zip(gradients, dx, strict=True))
    assert abs(along - (weights * change).sum()) < 1e-10 * max(1.0, np.abs(change).max() * N * operator.numbers)


def test_values_are_the_bits_of_the_model(robot):
    rng = np.random.default_rng(1)
    q = robot.random(rng, size=N)
    v, a = rng.normal(size=(2, N, robot.nv))
    at = {"q": q, "v": v, "a": a, "tau": a, "dv": v, "q0": q, "q1": robot.random(rng, size=N)}
    for name, row in ROWS.items():
        if name.startswith(("frame", "reactions")):
            continue
        operator = operator_of(robot, name)
        (found,) = run(operator, Stage.VALUE, *(at[x][None] for x in row.inputs))
        expected = getattr(robot, row.value)(*(at[x] for x in row.inputs)) if row.value != "energy" else robot.energy(q, v)[row.result]
        if row.value == "energy" or any(j.quaternion is not None for j in robot.joints):
            np.testing.assert_allclose(found[0], np.reshape(expected, found[0].shape), rtol=1e-12, atol=1e-12)  # normalised once more
        else:
            np.testing.assert_array_equal(found[0], np.reshape(expected, found[0].shape), err_msg=name)


@pytest.mark.parametrize("name", ["inverse_dynamics", "forward_dynamics", "reactions"])
def test_groups_have_parameters_of_their_own(name):
    m = robot_named("floating")
    operator = operator_of(m, name, parameters=True)
    rng = np.random.default_rng(2)
    x = [a.reshape(3, 4, -1) for a in arguments(m, operator.inputs[:-1], rng, 12)]
    p = m.parameters * rng.uniform(0.9, 1.1, size=(3, 1, 1))
    weights = rng.normal(size=(3, 4, operator.numbers))
    (found,) = run(operator, Stage.VALUE, *x, p)
    gradients = run(operator, Stage.VJP, *x, p, weights)
    for g in range(3):
        alone = operator_of(m.with_parameters(dict(zip(m.link_names, p[g]))), name)
        close([found[g]], [run(alone, Stage.VALUE, *(a[g : g + 1] for a in x))[0][0]], 1e-13)
        one = run(operator, Stage.VJP, *(a[g : g + 1] for a in x), p[g : g + 1], weights[g : g + 1])
        for a, b in zip(gradients, one, strict=True):
            np.testing.assert_array_equal(a[g : g + 1], b)


@pytest.mark.parametrize("parameters", [False, True])
def test_results_do_not_depend_on_threads(parameters):
    m = robot_named("every kind")
    for stage in (Stage.VALUE, Stage.VJP):
        found = []
        for threads in (1, 2):
            operator = operator_of(m, "inverse_dynamics", parameters, threads)
            x = grouped(operator, arguments(m, operator.inputs, np.random.default_rng(4), 3000))
            found.append(run(operator, stage, *x, *([np.ones((1, 3000, m.nv))] if stage is Stage.VJP else [])))
        for one, two in zip(*found, strict=True):
            np.testing.assert_array_equal(one, two)


def test_single_precision(robot):
    for name in ("inverse_dynamics", "forward_dynamics", "reactions", "integrate"):
        operator, x, dx, _, _ = case(robot, name, False)
        (exact,) = run(operator, Stage.JVP, *x, *dx)
        (found,) = run(operator, Stage.JVP, *(a.astype(np.float32) for a in (*x, *dx)))
        assert found.dtype == np.float32
        scale = np.abs(exact).max()
        assert np.abs(found - exact).max() < (5e-2 if name == "forward_dynamics" else 1e-3) * max(1.0, scale)


def test_nan_stays_in_its_state():
    m = robot_named("physics")
    operator, x, _, _, weights = case(m, "inverse_dynamics", False)
    x[0][0, 2, 1] = np.nan
    (y,) = run(operator, Stage.VALUE, *x)
    assert np.isnan(y[0, 2]).any() and np.isfinite(np.delete(y[0], 2, 0)).all()
    for gradient in run(operator, Stage.VJP, *x, weights):
        assert np.isfinite(np.delete(gradient[0], 2, 0)).all()


def test_no_states_and_one():
    m = robot_named("every kind")
    for name in ROWS:
        operator = operator_of(m, name)
        given = arguments(m, operator.inputs, np.random.default_rng(0), 3)
        (whole,) = run(operator, Stage.VALUE, *(x[None] for x in given))
        (one,) = run(operator, Stage.VALUE, *(x[None, :1] for x in given))
        np.testing.assert_array_equal(one[0, 0], whole[0, 0], err_msg=name)
        (none,) = run(operator, Stage.VALUE, *(x[None, :0] for x in given))
        assert none.shape == (1, 0, operator.numbers)


def test_the_table_names_algorithms_and_their_inputs():
    """And no algorithm with whole derivatives is left out."""
    rows = {row.name: row for row in ALGORITHMS}
    for name, row in ROWS.items():
        value = rows[row.value]
        assert [value.called.get(x, x) for x in value.inputs][: len(row.inputs)] == list(row.inputs), name
        assert all(result < len(rows[row.first].results) for result in row.by) and len(row.by) == len(row.inputs)
        assert all(result < len(rows[row.second].results) for result, _, _ in row.by_two)
    derivatives = {name for name, row in rows.items() if row.faces and name.endswith(("derivatives", "jacobians", "gradient"))}
    used = {name for row in ROWS.values() for name in (row.first, row.second, row.gradient)}
    single = {"frame_velocity_derivatives", "frame_acceleration_derivatives"}  # those of several frames compute them
    assert derivatives - used - single == {"reactions_external_derivatives"}


def test_leading_shapes():
    m = robot_named("physics")
    operator = operator_of(m, "inverse_dynamics", parameters=True)
    p = m.parameters.shape
    split = lambda *shapes: (found := layout(operator, shapes)).leading and found.split()
    assert split((5, 6), (6,), (5, 6), p) == (1, 5)
    assert split((4, 5, 6), (5, 6), (6,), (5, *p)) == (20, 1)
    assert split((4, 5, 6), (5, 6), (), (4, 1, *p)) == (4, 5)
    assert split((5, 6), (6,), (6,), (3, 1, *p)) == (3, 5)
    assert layout(operator, ((6,), (6,), (), p)).split() == (1, 1)
    for shapes, said in (
        (((5,), (6,), (6,), p), r"inverse_dynamics: q has shape \(5,\); expected \(…, 6\): nq numbers for each state"),
        (((6,), (6,), (7,), p), r"a has shape \(7,\); expected \(…, 6\): nv numbers for each state"),
        (((6,), (6,), (6,), (10,)), r"parameters has shape \(10,\); expected \(…, 8, 10\): ten for each link"),
        (((), (6,), (6,), p), r"q has shape \(\)"),
        (((2, 6), (3, 6), (6,), p), r"leading shapes don't broadcast: q \(2, 6\), v \(3, 6\)"),
    ):
        with pytest.raises(ValueError, match=said):
            layout(operator, shapes)


def test_models_that_have_no_operators():
    m = robot_named("physics")
    with pytest.raises(ValueError, match="inverse_dynamics_derivatives: exact dry friction jumps at rest"):
        operator_of(m.with_physics("exact friction"), "inverse_dynamics")


def test_a_mass_that_is_negative_is_refused_by_its_link():
    m = robot_named("physics")
    operator = operator_of(m, "inverse_dynamics", parameters=True)
    given = [x[None] for x in arguments(m, operator.inputs, np.random.default_rng(0), 40)]
    given[-1][0, 3, 0] = -1
    with pytest.raises(ksl.DescriptionError, match=f"link {m.link_names[3]}: "):
        run(operator, Stage.VALUE, *given)


def test_second_derivatives_that_there_are_not():
    m = robot_named("physics")
    with pytest.raises(NotImplementedError, match="reactions: there are no second derivatives of it; those that have some are inverse_dynamics, bias"):
        operator_of(m, "reactions").require_twice()
    with pytest.raises(NotImplementedError, match="inverse_dynamics: there are no second derivatives of it with parameters="):
        operator_of(m, "inverse_dynamics", parameters=True).require_twice()


def test_operators_are_computed_by_several_threads_at_once():
    m = robot_named("floating")
    operator, x, _, _, weights = case(m, "inverse_dynamics", True)
    expected = run(operator, Stage.VJP, *x, weights)
    found: list[list[np.ndarray]] = []
    threads = [threading.Thread(target=lambda: found.append(run(operator, Stage.VJP, *x, weights))) for _ in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert len(found) == 4
    for each in found:
        for a, b in zip(each, expected, strict=True):
            np.testing.assert_array_equal(a, b)
