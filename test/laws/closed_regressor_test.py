"""Regressors of closed mechanisms: times any links' parameters they are efforts of drives and reactions, least norm and least energy included; and identification by them."""

import ksl
import numpy as np
import pytest
from closed_mechanisms import KINDS, body
from closed_test import Motion, close_to, determined_case
from ksl import base_parameters
from ksl.identification import identify
from linkages import four_bar

REQUESTS = ({}, {"axes": "world", "at": "world", "order": "ang_lin"}, {"part": "constraint", "on": "parent", "at": (0.3, -0.2, 0.5)})


def with_drives(x, drives):
    """The model, with drives as many as the freedoms, or with all that one coordinate has and weights."""
    m = x.case.model
    return m if drives == "as many" else m.with_drives({j.name: k + 1.0 for k, j in enumerate(j for j in m.joints if j.nv)})


@pytest.mark.parametrize("drives", ["as many", "more"])
@pytest.mark.parametrize("kind", KINDS)
def test_times_the_parameters(kind, drives):
    x = Motion(kind, 1, determined_case)
    q, v, a, m = x.case.q, x.v, x.a, with_drives(x, drives)
    rng = np.random.default_rng(3)
    other = m.with_parameters({name: tuple(body(rng).values()) for name in m.link_names if name != "ground"})
    names = [*m.joint_names, "L"]
    efforts, resting = m.inverse_dynamics_regressor(q, v, a), m.gravity_torque_regressor(q)
    assert efforts.shape == (m.nv, len(m.links), 10)
    wrenches = [m.reactions_regressor(q, v, a, joints=names, **how) for how in REQUESTS]
    for n in (m, other):
        load = max(1.0, np.abs(n.reactions(q, v, a, joints=names)).max())
        close_to(np.tensordot(efforts, n.parameters) / load, n.inverse_dynamics(q, v, a) / load, 1e-11)
        close_to(np.tensordot(resting, n.parameters) / load, n.gravity_torque(q) / load, 1e-11)
        for Y, how in zip(wrenches, REQUESTS, strict=True):
            close_to(np.tensordot(Y, n.parameters), n.reactions(q, v, a, joints=names, **how), 1e-10)
    some = m.inverse_dynamics_regressor(q, v, a, links=["b0", "a1", "b0"])
    assert np.array_equal(some, efforts[:, [m.link_names.index(name) for name in ("b0", "a1", "b0")]])


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_by_wrenches_on_links(kind):
    x = Motion(kind, 2, determined_case)
    q, m = x.case.q, x.case.model
    names = [*m.joint_names, "L"]
    w = {name: np.random.default_rng(k).normal(size=6) for k, name in enumerate(m.link_names)}
    for how in REQUESTS:
        D = m.reactions_external_derivatives(q, joints=names, **how)
        change = np.einsum("jclk,lk->jc", D, [w[name] for name in m.link_names])
        with_wrenches, without = (m.reactions(q, x.v, x.a, external, joints=names, **how) for external in (w, None))
        load = max(1.0, np.abs(with_wrenches).max(), np.abs(without).max())
        close_to(change / load, (with_wrenches - without) / load, 1e-11)


def test_least_energy_is_linear_in_parameters_too():
    m = four_bar().with_payload("coupler", 2.0, (0.2, 0.1, 0))  # beside the plane
    q = m.close([1.0, 0.5, 1.2], hold=["A"]).q
    v = m.consistent_velocity(q, [3.0, 0, 0], given=["A"])
    a = m.consistent_acceleration(q, v, [1.0, 0, 0], given=["A"])
    soft = m.with_stiffness({name: {"axial": 1e6, "radial": 2e7, "tilting": 3e2} for name in "ABCD"})
    wrenches = [n.reactions(q, v, a, joints=list("ABCD")) for n in (m, soft)]
    assert np.abs(wrenches[0] - wrenches[1]).max() > 0.1
    for n, f in zip((m, soft), wrenches, strict=True):
        close_to(np.tensordot(n.reactions_regressor(q, v, a, joints=list("ABCD")), n.parameters), f, 1e-11)


@pytest.mark.parametrize("call", ["inverse_dynamics_regressor", "reactions_regressor", "gravity_torque_regressor", "reactions_external_derivatives"])
def test_batches_single_precision_and_open_states(call):
    x = Motion("spherical", 1, determined_case)
    m, state = x.case.model, (x.case.q, x.v, x.a) if call.startswith(("inv", "reactions_r")) else (x.case.q,)
    one = getattr(m, call)(*state)
    three = [np.tile(y, (3, 1)) for y in state]
    out = np.empty((3, *one.shape))
    assert getattr(m, call)(*three, out=out) is out and np.array_equal(out, np.stack([one] * 3))
    single = getattr(m, call)(*(y.astype(np.float32) for y in three))
    assert single.dtype == np.float32
    close_to(single[1], one, 1e-4)
    three[0][1] = m.integrate(x.case.q, np.full(m.nv, 0.1))
    with pytest.raises(ksl.ResultError, match=f"{call}: state 1: loop joint L is open"):
        getattr(m, call)(*three)
    with pytest.raises(ksl.ResultError, match="the drives leave a freedom"):
        getattr(m.with_drives([]), call)(*state)


def test_a_motion_of_a_four_bar_identifies_what_its_drive_feels():
    """Eight combinations in the plane: mass moments of three links, two each, and two inertias, as a linkage's kinetic and potential energy have."""
    m = four_bar()
    t = np.linspace(0, 6, 200)[:, None]
    crank = [
        x * np.array([1, 0, 0])
        for x in (1 + 0.5 * np.sin(2 * t) + 0.3 * np.cos(3.1 * t), np.cos(2 * t) - 0.93 * np.sin(3.1 * t), -2 * np.sin(2 * t) - 2.883 * np.cos(3.1 * t))
    ]
    q = [m.close([1.3, 0.5, 1.0], hold=["A"]).q]
    for x in crank[0]:
        q.append(m.close([x[0], *q[-1][1:]], hold=["A"]).q)
    q = np.array(q[1:])
    v = m.consistent_velocity(q, crank[1], given=["A"])
    a = m.consistent_acceleration(q, v, crank[2], given=["A"])
    truth = m.with_parameters({"crank": (1.2, [0.11, 0, 0.02], np.diag([0.001, 0.02, 0.02])), "coupler": (2.5, [0.33, 0, 0], np.diag([0.001, 0.1, 0.1]))})
    tau = truth.inverse_dynamics(q, v, a)
    found = identify(m, q, v, a, tau)
    assert found.base.names == base_parameters.structural(m).names and len(found.base) == 8
    close_to(found.base_values, found.base.values(truth.parameters[1:]), 1e-5)
    close_to(found.model.inverse_dynamics(q, v, a), tau, 1e-6)
