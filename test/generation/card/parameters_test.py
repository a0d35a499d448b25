"""Inertias of links as arguments of calls on a card, for each state its own: the bits of models that have these inertias."""

import numpy as np
import pytest
from generated_code import EXAMPLES

import ksl
from ksl.base.errors import ArgumentError

LINKS = ["forearm_link", "tool0"]


def given_to(m, n):
    """States, and for each a payload of its own in two links, one of which has no mass in the file."""
    rng = np.random.default_rng(n)
    added = np.array([1.0, 0.05, -0.1, 0.2, 0.06, 0.005, 0.0525, -0.01, 0.02, 0.0225])
    ten = [m.link(link).parameters + rng.uniform(0, 2, (n, 1)) * added for link in LINKS]
    return rng.normal(size=(n, m.nv)), rng.normal(size=(n, m.nv)), rng.normal(size=(n, m.nv)), dict(zip(LINKS, ten))


def others(m, ten, k):
    return m.with_parameters({link: x[k] for link, x in ten.items()})


def test_each_state_has_its_own_robot(cards, ur5):
    fast = ur5.compile(["inverse_dynamics", "reactions:elbow", "energy", "frame_poses"], device="cuda", parameters=LINKS)
    q, v, a, ten = given_to(ur5, 40)
    on = [cards(x) for x in (q, v, a)]
    backwards = {link: cards(ten[link]) for link in reversed(LINKS)}
    found = [
        fast.inverse_dynamics(*on, parameters=backwards),
        fast.reactions(*on, joints="elbow", parameters=backwards),
        *fast.energy(*on[:2], parameters=backwards),
    ]
    for k in (0, 31, 32, 39):
        m = others(ur5, ten, k)
        exact = [m.inverse_dynamics(q[k], v[k], a[k]), m.reactions(q[k], v[k], a[k], joints=["elbow"]), *m.energy(q[k], v[k])]
        for x, y in zip(found, exact, strict=True):
            np.testing.assert_array_equal(x.host[k], y)
    one = {LINKS[0]: backwards[LINKS[0]], LINKS[1]: cards(ten[LINKS[1]][0])}  # one payload for all
    tau = fast.inverse_dynamics(*on, parameters=one).host
    np.testing.assert_array_equal(tau[7], ur5.with_parameters({LINKS[0]: ten[LINKS[0]][7], LINKS[1]: ten[LINKS[1]][0]}).inverse_dynamics(q[7], v[7], a[7]))
    np.testing.assert_array_equal(fast.frame_poses(on[0]).host, ur5.frame_poses(q))  # which has no inertia in it
    np.testing.assert_array_equal(fast.inverse_dynamics(q, v, a), ur5.inverse_dynamics(q, v, a))  # arrays of the processor, as before


def test_one_call_has_code_with_and_without(cards, ur5):
    fast = ur5.compile(["inverse_dynamics"], device="cuda").compile(["inverse_dynamics"], external=["tool0"], device="cuda", parameters="tool0")
    q, v, a, ten = given_to(ur5, 5)
    on, push = [cards(x) for x in (q, v, a)], np.arange(6.0)
    np.testing.assert_array_equal(fast.inverse_dynamics(*on).host, ur5.inverse_dynamics(q, v, a))
    tau = fast.inverse_dynamics(*on, external={"tool0": cards(push)}, parameters={"tool0": cards(ten["tool0"])}).host
    m = ur5.with_parameters({"tool0": ten["tool0"][3]})
    np.testing.assert_array_equal(tau[3], m.inverse_dynamics(q[3], v[3], a[3], external={"tool0": push}))


def test_runs_of_robots_that_differ(cards, ur5):
    fast = ur5.compile("simulate", device="cuda", parameters=LINKS)
    q, v, tau, ten = given_to(ur5, 33)
    options = {"method": "semi_implicit_euler", "step": 1e-3}
    run = fast.simulate(cards(q), cards(v), [0, 0.004, 0.01], cards(tau[:, None]), parameters={link: cards(x) for link, x in ten.items()}, **options)
    for k in (0, 32):
        exact = others(ur5, ten, k).simulate(q[k], v[k], [0, 0.004, 0.01], tau[k], **options)
        np.testing.assert_array_equal(run.q.host[k], exact.q)
        np.testing.assert_array_equal(run.v.host[k], exact.v)
    with pytest.raises(ArgumentError, match="simulate: parameters names no link, and the card's code is of forearm_link, tool0"):
        fast.simulate(cards(q), cards(v), [0, 0.01], **options)
    with pytest.raises(ArgumentError, match=r"simulate: parameters= is for arrays on a card, .*with_parameters"):
        fast.simulate(q[0], v[0], [0, 0.01], parameters={"tool0": ten["tool0"][0]}, **options)


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_closed_mechanisms_with_parameters(cards):
    m = ksl.load(EXAMPLES / "excavator.urdf")
    link = m.link_names[2]
    fast = m.compile(["inverse_dynamics", "simulate"], device="cuda", parameters=[link])
    q = m.close(m.neutral()).q
    v = np.zeros(m.nv)
    heavier = np.array([1.0, 1.3, 2.0])[:, None] * m.link(link).parameters
    at, of, options = cards(np.tile(q, (3, 1))), {link: cards(heavier)}, {"method": "semi_implicit_euler", "step": 1e-3}
    tau = fast.inverse_dynamics(at, 0.0, 0.0, parameters=of).host
    run = fast.simulate(at, cards(v), [0, 0.01], parameters=of, **options)
    for k, ten in enumerate(heavier):
        own = m.with_parameters({link: ten})
        np.testing.assert_allclose(tau[k], own.inverse_dynamics(q, v, v), rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(run.v.host[k], own.simulate(q, v, [0, 0.01], **options).v, rtol=0, atol=1e-11)
    assert np.ptp(run.v.host[:, -1], axis=0).max() > 1e-4


def test_what_does_not_fit_is_said(cards, card, ur5):
    fast = ur5.compile(["inverse_dynamics", "frame_poses"], device="cuda", parameters=["tool0"])
    q, v, a, ten = given_to(ur5, 4)
    on, of = [cards(x) for x in (q, v, a)], cards(ten["tool0"])
    for parameters, said in (
        (None, r"parameters names no link, and the card's code is of tool0; compile with parameters=\[\]"),
        ({"forearm_link": of}, r"parameters names 'forearm_link', and the card's code is of tool0; compile with parameters=\['forearm_link'\]"),
        ({"tool0": ten["tool0"]}, r"parameters\['tool0'\] is in the processor's memory"),
        ({"tool0": cards(np.zeros((4, 6)))}, r"parameters\['tool0'\] has shape \(4, 6\); expected \(…, 10\): m, m c, Ixx"),
        ({"tool0": cards(np.zeros((3, 10)))}, r"leading shapes don't broadcast: q \(4, 6\), .*parameters\['tool0'\] \(3, 10\)"),
        ({"tool0": cards(np.zeros((4, 10), np.float32))}, r"a holds numbers of float64 and parameters\['tool0'\] of float32"),
        (of, r"parameters is Array; expected {link: \(…, 10\)}"),
    ):
        with pytest.raises(ArgumentError, match=said):
            fast.inverse_dynamics(*on, parameters=parameters)
    with pytest.raises(ArgumentError, match=r"parameters names 'tool0', and the card's code is of no link; leave it out, unless results depend on it"):
        fast.frame_poses(on[0], parameters={"tool0": of})
    with pytest.raises(ArgumentError, match=r"inverse_dynamics: parameters= is for arrays on a card, .*with_parameters"):
        fast.inverse_dynamics(q, v, a, parameters=ten)
    for options, said in (
        ({"parameters": ["tool0"]}, "parameters=: calls on the processor have none; with_parameters"),
        ({"parameters": ["tool0", "tool0"], "device": "cuda"}, "parameters names a link twice: tool0, tool0"),
        ({"external": ["tool0", "tool0"]}, "external names a link twice"),
    ):
        with pytest.raises(ArgumentError, match=said):
            ur5.compile(["inverse_dynamics"], **options)
    with pytest.raises(ValueError, match="no_such"):
        ur5.compile(["inverse_dynamics"], device="cuda", parameters=["no_such"])
