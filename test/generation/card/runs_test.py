"""`m.simulate` with arrays on a card, on a driver in its place: the motions of the engine, steps between efforts of a policy, and sentences."""

import numpy as np
import pytest
from generated_code import EXAMPLES

import ksl
from ksl.base.errors import ArgumentError

TIMES, STEP = [0.5, 0.504, 0.51], 1e-3


def start(m, *leading):
    rng = np.random.default_rng(1)
    return rng.normal(size=(*leading, m.nv)), rng.normal(size=(*leading, m.nv)), rng.normal(size=(*leading, m.nv))


def test_motions_are_those_of_the_engine(card, cards, ur5):
    fast = ur5.compile(["simulate", "energy"], device="cuda")
    assert fast.compiled == ("simulate", "energy")
    q, v, tau = start(ur5, 3, 11)
    options = {"method": "semi_implicit_euler", "step": STEP}
    for efforts in (None, tau[0, 0], tau[..., None, :]):
        before = card["launches"]
        run = fast.simulate(cards(q), cards(v), TIMES, efforts if efforts is None else cards(efforts), **options)
        assert card["launches"] == before + len(TIMES) and card["stream"] == 5 and run.times.tolist() == TIMES
        for k in ((0, 0), (2, 10)):
            own = tau[k] if efforts is not None and efforts.ndim > 1 else efforts
            expected = ur5.simulate(q[k], v[k], TIMES, own, **options)
            np.testing.assert_array_equal(run.q.host[k], expected.q)
            np.testing.assert_array_equal(run.v.host[k], expected.v)
    one = fast.simulate(cards(q[0, 0]), cards(v[0, 0]), TIMES, cards(tau[0, 0]), **options)
    np.testing.assert_array_equal(one.q.host, ur5.simulate(q[0, 0], v[0, 0], TIMES, tau[0, 0], **options).q)
    here = fast.simulate(q[0, 0], v[0, 0], TIMES, **options)  # on the processor, as before
    assert here.complete and here.kinetic.shape == (3,)


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_runs_of_order_four(cards, ur5):
    """The bits of the engine where positions move by addition, and beside semi-implicit Euler; otherwise its numbers to rounding."""
    fast = ur5.compile(["simulate", "simulate:rk4"], device="cuda")
    q, v, tau = start(ur5, 33)
    for method in ("rk4", "semi_implicit_euler"):
        run = fast.simulate(cards(q), cards(v), TIMES, cards(tau[:, None]), method=method, step=4e-3)
        for k in (0, 32):
            exact = ur5.simulate(q[k], v[k], TIMES, tau[k], method=method, step=4e-3)
            np.testing.assert_array_equal(run.q.host[k], exact.q)
            np.testing.assert_array_equal(run.v.host[k], exact.v)
    floating, excavator = ksl.load(EXAMPLES / "ur5.urdf", floating_base=True), ksl.load(EXAMPLES / "excavator.urdf")
    closed = excavator.close(excavator.neutral()).q
    for m, at, moving in ((floating, floating.random(1), np.linspace(-1, 1, floating.nv)), (excavator, closed, np.zeros(excavator.nv))):
        run = m.compile("simulate:rk4", device="cuda").simulate(cards(at), cards(moving), TIMES, method="rk4", step=4e-3)
        exact = m.simulate(at, moving, TIMES, method="rk4", step=4e-3)
        np.testing.assert_allclose(run.q.host, exact.q, rtol=0, atol=1e-10)
        np.testing.assert_allclose(run.v.host, exact.v, rtol=0, atol=1e-9)
        assert np.abs(exact.v[-1] - moving).max() > 1e-3


def test_efforts_of_a_policy_between_steps(cards, ur5):
    """Each step begins at the end of the one before, where it lies."""
    fast = ur5.compile("simulate", scalar="float", device="cuda")
    q, v = (cards(x.astype(np.float32)) for x in start(ur5, 20)[:2])
    x, w, h = q.host, v.host, np.float32(STEP)
    for _ in range(5):
        tau = -2 * v.host
        run = fast.simulate(q, v, [0, STEP], cards(tau[:, None]), method="semi_implicit_euler", step=STEP)
        q, v = run.q.view(np.s_[:, -1]), run.v.view(np.s_[:, -1])
        w = w + h * ur5.forward_dynamics(x, w, np.float32(-2) * w)
        x = x + h * w
        np.testing.assert_array_equal(q.host, x)
        np.testing.assert_array_equal(v.host, w)


def test_what_a_card_does_not_serve_is_said(cards, ur5):
    fast = ur5.compile("simulate", device="cuda")
    q, v, tau = map(cards, start(ur5, 4))
    for keywords, said in (
        ({}, "method='dop853': runs on a card go by semi_implicit_euler"),
        ({"method": "rk4"}, "method='rk4': runs on a card go by semi_implicit_euler; compile 'simulate:rk4'"),
        ({"step": None}, "step=None: expected the longest step"),
        ({"step": True}, "step=True: expected"),
        ({"times": [0, 0]}, "times: expected"),
        ({"most_steps": 3}, "a run takes 10 steps, more than most_steps, 3"),
        ({"external": {"tool0": tau}}, "runs on a card have no external="),
        ({"project": False}, "runs on a card have no project="),
        ({"efforts": tau}, r"efforts has shape \(4, 6\); runs on a card have constant ones, \(nv\) of all runs or \(…, 1, nv\) of each"),
        ({"efforts": tau.host}, "efforts is in the processor's memory"),
        ({"efforts": cards(np.zeros(6, np.float32))}, "float64 and efforts of float32"),
    ):
        with pytest.raises(ArgumentError, match=said):
            fast.simulate(q, v, **({"times": TIMES} | ({"method": "semi_implicit_euler", "step": STEP} if keywords else {}) | keywords))
    for asked, options, said in (
        (["simulate"] * 2, {}, "simulate comes twice"),
        (["simulate", "simulate:semi_implicit_euler"], {}, "simulate comes twice"),
        (["simulate:dop853"], {}, "simulate:dop853: runs on a card go by semi_implicit_euler or rk4"),
        (["simulate"], {"external": ["tool0"]}, "simulate has no external wrenches on a card"),
    ):
        with pytest.raises(ArgumentError, match=said):
            ur5.compile(asked, device="cuda", **options)
