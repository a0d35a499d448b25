"""Operators of mechanisms with loops, by themselves: derivatives along the mechanism against differences of closed motions, and what is refused.

What torch and JAX make of them is in torch_test.py and jax_test.py.
"""

from pathlib import Path

import numpy as np
import pytest
from closed_mechanisms import KINDS
from operator_cases import CLOSED, along, closed_named
from operators_test import N, close, run

import ksl
from ksl.mechanism.chosen_coordinates import coordinates_of
from ksl.mechanism.requests import request_of_frames
from ksl.operators.operator import More, Operator, Stage
from ksl.operators.table import COMPLETIONS, ROWS

STEP = 1e-3
MECHANISMS = (*CLOSED, *KINDS)
OF_MOTIONS = ("inverse_dynamics", "bias", "gravity_torque", "forward_dynamics", "reactions", "frame_velocities", "centroidal_momentum_rate", "potential_energy")


def operator_of(c, name, threads=1, **more) -> Operator:
    m = c.model
    request = None
    if name == "reactions":
        request = m.reaction_request(joints=[*m.joint_names, *m.loop_names])
        more = {"nan_where_open": True, **more}
    if name.startswith("frame"):
        request = request_of_frames(m, [m.link_names[-1]], "frame", "frame", "lin_ang")
    if name in COMPLETIONS:
        more = {"given": tuple(coordinates_of(m, more.pop("given", c.drives), "given")), **more}
    return Operator(m, name, request, More(**more), threads)


def one(operator: Operator, stage: Stage, *given: np.ndarray) -> np.ndarray:
    return run(operator, stage, *(x[None] for x in given))[0][0]


class Along:
    """The motion that follows from the coordinates of drives, by operators, and how it changes along changes of the numbers."""

    def __init__(self, c):
        self.steps = [operator_of(c, name) for name in COMPLETIONS]

    def changed(self, x, dx):
        """Motion and its change, by products of operators."""
        motion, change = [], []
        for number, step in enumerate(self.steps):
            given = [*motion, x[number]], [*change, dx[number]]
            motion.append(one(step, Stage.VALUE, *given[0]))
            change.append(one(step, Stage.JVP, *given[0], *given[1]))
        return motion, change


def numbers(c, rng, n=N):
    """Inputs: closed motions, quaternions of any length; changes; tau is the third in place of a."""
    m = c.model
    q, v, a = c.motions(rng, n)
    q = q * (rng.uniform(0.7, 1.4, (n, 1)) if all(j.quaternion is not None for j in m.joints if j.nq) else 1)
    return [q, v, a], [rng.normal(size=x.shape) for x in (q, v, a)]


def value(c, name, motion):
    m = c.model
    q, v, a = motion
    if name == "reactions":
        return m.reactions(q, v, a, joints=[*m.joint_names, *m.loop_names])
    if name == "potential_energy":
        return m.energy(q, v)[1]
    if name == "frame_velocities":
        return m.frame_velocities(q, v, [m.link_names[-1]])
    return getattr(m, name)(*motion[: len(ROWS[name].inputs)])


@pytest.mark.parametrize("of", MECHANISMS)
def test_changes_along_the_mechanism(of):
    """By differences of the model's own calls: coordinates of drives vary, and the motion is closed again."""
    c = closed_named(of)
    m = c.model
    x, dx = numbers(c, np.random.default_rng(1), 2)
    motion, change = Along(c).changed(x, dx)
    moved = along(lambda q, hold: m.close(q, hold).q, m.consistent_velocity, m.consistent_acceleration, c.drives)
    turn = operator_of(c, "integrate")  # makes quaternions unit ones
    at = lambda step: moved(one(turn, Stage.VALUE, x[0] + step * dx[0], np.zeros_like(dx[1])), x[1] + step * dx[1], x[2] + step * dx[2])
    states = {step: at(step) for step in (-2 * STEP, -STEP, STEP, 2 * STEP)}
    difference = lambda f: (8 * (f(states[STEP]) - f(states[-STEP])) - (f(states[2 * STEP]) - f(states[-2 * STEP]))) / (12 * STEP)
    close(change, [difference(lambda s: s[k]) for k in range(3)], 1e-6)
    sure = np.array([m.reactions_unique(q, [*m.joint_names, *m.loop_names]) for q in motion[0]])
    for name in OF_MOTIONS:
        operator = operator_of(c, name)
        n = len(operator.inputs)
        found = one(operator, Stage.JVP, *motion[:n], *change[:n])
        expected = difference(lambda s: value(c, name, s)).reshape(found.shape)
        if name == "reactions":
            assert np.array_equal(np.isnan(found), ~sure.reshape(found.shape))
            found, expected = (np.where(sure.reshape(found.shape), each, 0) for each in (found, expected))
        close([found], [expected], 1e-6)


@pytest.mark.parametrize("of", CLOSED)
@pytest.mark.parametrize("name", [*COMPLETIONS, *OF_MOTIONS])
def test_products_in_both_directions(of, name):
    c = closed_named(of)
    operator = operator_of(c, name)
    rng = np.random.default_rng(2)
    x, dx = (each[: len(operator.inputs)] for each in numbers(c, rng))
    change = one(operator, Stage.JVP, *x, *dx)
    weights = np.where(np.isnan(change), 0, rng.normal(size=change.shape))
    gradients = [g[0] for g in run(operator, Stage.VJP, *(each[None] for each in x), weights[None])]
    product = sum((g * d).sum() for g, d in zip(gradients, dx, strict=True))
    assert abs(product - np.nansum(weights * change)) < 1e-10 * max(1.0, np.nansum(abs(change)) * len(dx))
    if name in ("close", "consistent_acceleration", "inverse_dynamics", "reactions"):  # of the coordinates of drives alone
        passive = np.setdiff1d(np.arange(c.model.nv), c.driven)
        assert all((g[:, passive] == 0).all() for g in gradients[1:])
        held = [i for j in c.model.joints if j.name in c.drives for i in range(j.q_index, j.q_index + j.nq)]
        assert (np.delete(gradients[0], held, axis=1) == 0).all() and gradients[0].any()


@pytest.mark.parametrize("of", [*CLOSED, "cylindrical", "planar"])
@pytest.mark.parametrize(
    "name, axes", [("inverse_dynamics", "world"), ("forward_dynamics", "link"), ("bias", None), ("gravity_torque", None), ("reactions", None)]
)
def test_external_wrenches_and_parameters(of, name, axes):
    """By these alone, in which all are smooth at one motion."""
    c = closed_named(of)
    m = c.model
    external = (m.link_names[-1], m.link_names[1]) if axes else ()
    operator = operator_of(c, name, external=external, in_world=axes == "world", parameters=True)
    rng = np.random.default_rng(3)
    motion = numbers(c, rng)[0][: len(ROWS[name].inputs)]
    more = [rng.normal(size=(1, N, 12)), m.parameters[None] + 0.05] if axes else [m.parameters[None] + 0.05]
    x = [*(each[None] for each in motion), *more]
    dx = [*(np.zeros_like(each)[None] for each in motion), *(rng.normal(size=each.shape) for each in more)]
    (change,) = run(operator, Stage.JVP, *x, *dx)
    step = 1e-4
    at = lambda s: run(operator, Stage.VALUE, *(a + s * b for a, b in zip(x, dx)))[0]
    determined = np.isfinite(change)
    assert determined.all() or name == "reactions"
    change = np.where(determined, change, 0)
    close([change], [np.where(determined, (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step), 0)], 1e-7)
    weights = np.where(determined, rng.normal(size=change.shape), 0)
    gradients = run(operator, Stage.VJP, *x, weights)
    assert abs(sum((g * d).sum() for g, d in zip(gradients, dx)) - (weights * change).sum()) < 1e-9 * max(1.0, abs(change).sum())


@pytest.mark.parametrize("of", CLOSED)
def test_single_precision(of):
    c = closed_named(of)
    x, dx = numbers(c, np.random.default_rng(4))
    for name in (*COMPLETIONS, *OF_MOTIONS):
        operator = operator_of(c, name)
        given = [*x[: len(operator.inputs)], *dx[: len(operator.inputs)]]
        found, exact = (np.nan_to_num(one(operator, Stage.JVP, *(each.astype(kind) for each in given))) for kind in (np.float32, float))
        assert found.dtype == np.float32 and np.abs(found - exact).max() < 2e-3 * max(1.0, np.abs(exact).max()), name


def test_results_do_not_depend_on_threads_or_on_other_states():
    c = closed_named("Stewart platform")
    x, dx = numbers(c, np.random.default_rng(5), 300)
    for name in ("close", "inverse_dynamics"):
        n = len(operator_of(c, name).inputs)
        found = [one(operator_of(c, name, threads), Stage.JVP, *x[:n], *dx[:n]) for threads in (1, 2)]
        alone = one(operator_of(c, name), Stage.JVP, *(each[7:8] for each in (*x[:n], *dx[:n])))
        np.testing.assert_array_equal(*found)
        np.testing.assert_array_equal(found[0][7:8], alone)


def turned(c, q, dq):
    """What a change of the numbers of positions is along joint velocities."""
    return one(operator_of(c, "difference"), Stage.JVP, q, q, np.zeros_like(dq), dq)


OTHER_REACTIONS = (
    {"on": "parent", "at": "world", "axes": "world", "order": "ang_lin"},
    {"at": (0.1, 0.2, 0.3), "part": "constraint"},
    {"joints": ["S3", "P1", "S0", "free"], "on": "parent", "order": "ang_lin"},
    {"joints": ["S3", "P1"], "part": "actuation"},
)


@pytest.mark.parametrize("how", OTHER_REACTIONS, ids=str)
def test_reactions_as_they_are_asked_for(how):
    """Those of joints that close loops among them, in any order, against the derivatives of the model, which has them along joint velocities."""
    c = closed_named("Stewart platform")
    m = c.model
    x, dx = numbers(c, np.random.default_rng(6))
    found = one(Operator(m, "reactions", m.reaction_request(**how), More(), 1), Stage.JVP, *x, *dx)
    along = [d[:, m.independent(c.q)] for d in (turned(c, x[0], dx[0]), *dx[1:])]
    expected = sum(np.einsum("njcf,nf->njc", D, d) for D, d in zip(m.reactions_derivatives(*x, **how), along, strict=True))
    np.testing.assert_allclose(found, expected.reshape(found.shape), rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_states_that_have_no_result():
    """One that is open is refused by its loop and its number; NaN stays in its state; so does a position out of reach."""
    c = closed_named("four-bar")
    x, dx = numbers(c, np.random.default_rng(7), 70)
    operator = operator_of(c, "inverse_dynamics")
    opened = [x[0] + 0, *x[1:]]
    opened[0][66, 1] += 0.1
    for stage, given in ((Stage.VALUE, opened), (Stage.JVP, [*opened, *dx])):
        with pytest.raises(
            ksl.ResultError, match=r"inverse_dynamics: state 66: loop joint closure is open at this position by .* close\(q\) gives the nearest"
        ) as e:
            one(operator, stage, *given)
        assert e.value.state == 66
    moving = [x[0], x[1] + [0, 1, 0], x[2]]
    with pytest.raises(ksl.ResultError, match="inverse_dynamics: state 0: loop joint closure: these velocities open it"):
        one(operator, Stage.VJP, *moving, np.ones((70, 3)))
    lost = [x[0] + 0, *x[1:]]
    lost[0][66, 1] = np.nan
    for stage, given in ((Stage.VALUE, lost), (Stage.JVP, [*lost, *dx])):
        y = one(operator, stage, *given)
        assert np.isnan(y[66]).all() and np.isfinite(np.delete(y, 66, 0)).all()
    held = operator_of(c, "close", given=["to rocker"])
    far = np.array([c.q, [0, 0.3, 0.0]])  # the rocker's end is further away than crank and coupler reach
    y = one(held, Stage.VALUE, far)
    assert np.isfinite(y[0]).all() and np.isnan(y[1]).all() and not c.model.close(far[1], hold=["to rocker"]).converged
    assert np.isnan(run(held, Stage.VJP, far[None], np.ones((1, 2, 3)))[0][0, 1]).all()


def test_what_is_refused_by_name():
    c = closed_named("four-bar")
    m = c.model
    x, dx = numbers(c, np.random.default_rng(8), 1)
    for name in ("mass_matrix",):
        with pytest.raises(ValueError, match=f"{name} is not available for mechanisms with loops"):
            operator_of(c, name)
    with pytest.raises(NotImplementedError, match="inverse_dynamics: there are no second derivatives of it for mechanisms with loops"):
        operator_of(c, "inverse_dynamics").require_twice()
    with pytest.raises(NotImplementedError, match="close: there are no second derivatives of it"):
        operator_of(c, "close").require_twice()
    with pytest.raises(ValueError, match="close: no joint of this model closes a loop"):
        Operator(m.without_loops(), "close", None, More(given=(0,)), 1)
    for joints, said in (([], "have 0 coordinates"), (["to crank", "to rocker"], "have 2 coordinates")):
        with pytest.raises(
            ksl.ResultError, match=f"close: state 0: the joints named {said}, from which the others must follow, and the mechanism has 1 freedom at"
        ):
            one(operator_of(c, "close", given=joints), Stage.JVP, x[0], dx[0])
    with pytest.raises(ksl.ResultError, match="consistent_velocity: state 0: the given joints leave freedoms"):
        one(operator_of(c, "consistent_velocity", given=[]), Stage.VALUE, *x[:2])
    with pytest.raises(ksl.ResultError, match="consistent_velocity: state 0: no motion of the closed mechanism has these coordinates"):
        one(operator_of(c, "consistent_velocity", given=["to crank", "to rocker"]), Stage.VALUE, x[0], np.ones((1, 3)))
    without = type(c)(m.with_drives([]), c.q, c.drives)
    with pytest.raises(ksl.ResultError, match="inverse_dynamics: state 0: .*drives"):
        one(operator_of(without, "inverse_dynamics"), Stage.VALUE, *x)
    assert np.isfinite(one(operator_of(without, "forward_dynamics"), Stage.JVP, *x, *dx)).all()
    many = operator_of(type(c)(m.with_drives(["to crank", "to rocker"]), c.q, c.drives), "inverse_dynamics")
    assert np.isfinite(one(many, Stage.VALUE, *x)).all()
    with pytest.raises(ksl.ResultError, match="derivatives of efforts need as many drives as freedoms"):
        one(many, Stage.JVP, *x, *dx)


def test_reactions_that_are_not_determined():
    """A gradient is refused where such a component has a weight, and a change wherever there is one; or they are NaN."""
    c = closed_named("four-bar")
    m = c.model
    x, dx = numbers(c, np.random.default_rng(9), 2)
    request = m.reaction_request(joints=["to crank", "closure"], order="ang_lin")
    operator = Operator(m, "reactions", request, More(), 1)
    in_plane = np.tile([0, 1, 0, 1, 0, 1.0], (2, 2))
    weights = in_plane + 0
    gradients = run(operator, Stage.VJP, *(each[None] for each in x), weights[None])
    assert all(np.isfinite(g).all() for g in gradients)
    weights[1, 6 + 4] = 1  # the closure's force along y
    with pytest.raises(ksl.ResultError, match="reactions: state 1: fy of joint closure is not determined by rigid bodies, and has no derivative"):
        run(operator, Stage.VJP, *(each[None] for each in x), weights[None])
    with pytest.raises(ksl.ResultError, match="reactions: state 0: tx of joint to crank is not determined"):
        one(operator, Stage.JVP, *x, *dx)
    marked = Operator(m, "reactions", request, More(nan_where_open=True), 1)
    gradients = run(marked, Stage.VJP, *(each[None] for each in x), weights[None])
    assert all(np.isfinite(g[0, 0]).all() and np.isnan(g[0, 1]).all() for g in gradients)
    assert np.array_equal(np.isnan(one(marked, Stage.JVP, *x, *dx)), in_plane == 0)
    with pytest.raises(ValueError, match="reactions: .*closure closes a loop; its derivatives are those at the joint, in its axes"):
        one(Operator(m, "reactions", m.reaction_request(joints=["closure"], axes="world"), More(), 1), Stage.JVP, *x, *dx)
    stiff = m.with_stiffness({"to crank": np.full(6, 1e6), "closure": np.full(6, 1e6), "to rocker": np.full(6, 1e6), "to coupler": np.full(6, 1e6)})
    with pytest.raises(ksl.ResultError, match="reactions: state 0: stiffnesses split reactions of this mechanism"):
        one(Operator(stiff, "reactions", stiff.reaction_request(joints=["to crank"]), More(), 1), Stage.JVP, *x, *dx)


def test_a_mechanism_whose_base_floats():
    """Forward dynamics of an excavator on nothing: the base's six coordinates are independent, too."""
    m = ksl.load(Path(__file__).resolve().parents[2] / "examples/robots/excavator.urdf", floating_base=True)
    drives = ["floating_base", *m.drives]
    c = type(closed_named("four-bar"))(m, m.close(m.neutral(), hold=drives).q, drives)
    x, dx = numbers(c, np.random.default_rng(10), 2)
    found = one(operator_of(c, "forward_dynamics"), Stage.JVP, *x, *dx)
    by_q, by_v, by_tau = m.forward_dynamics_derivatives(*x)
    dq = turned(c, x[0], dx[0])
    for k, y in enumerate(found):
        free = m.independent(x[0][k])
        assert len(free) == 9 and np.isin(range(6), free).all()
        np.testing.assert_allclose(y, by_q[k] @ dq[k, free] + by_v[k] @ dx[1][k, free] + by_tau[k] @ dx[2][k], rtol=1e-9, atol=1e-9)
