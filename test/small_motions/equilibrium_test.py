"""Poses at rest: moments by hand, other calls, and simulations that come to rest there."""

import math

import numpy as np
import pytest

import ksl
from linkages import FOURBAR


def pendulum(**options):
    b = ksl.Builder("pendulum").add_link("ground").add_link("rod", 2.0, (0.5, 0, 0), np.diag([0, 1, 1]) * 2 / 12)
    return b.add_joint("hinge", "continuous", "ground", "rod", axis=(0, 1, 0), damping=0.5, spring_stiffness=4.0, spring_rest=0.3).build(**options)


def test_moments_by_hand():
    """The weight m g c cos(q) turns it down, the spring and the effort hold it."""
    m = pendulum(physics="spring")
    for tau in (0.0, 3.0, -2.0):
        found = m.equilibrium([0.5], tau=[tau])
        q = float(found.q[0])
        assert found.converged and found.reason == "at rest" and abs(2 * 9.81 * 0.5 * math.cos(q) - 4.0 * (q - 0.3) + tau) < 1e-12
        np.testing.assert_allclose(found.stiffness, [[4.0 + 9.81 * math.sin(q)]], rtol=1e-12)
        assert found.stable == (found.stiffness[0, 0] > 0)
    hanging, upright = (pendulum().equilibrium([start]) for start in (1.4, -1.4))
    np.testing.assert_allclose([hanging.q[0], upright.q[0]], [math.pi / 2, -math.pi / 2], rtol=1e-14)
    assert hanging.stable and not upright.stable and "not stable" in repr(upright)


def test_external_wrenches_and_where_there_is_none():
    m = pendulum()
    found = m.equilibrium([1.0], external={"rod": [9.81, 0, 0, 0, 0, 0]})  # a force along the rod, with the rod
    np.testing.assert_allclose(found.q, [math.pi / 2], rtol=1e-12)
    turned = m.equilibrium([1.0], external={"rod": [0, 0, 0, 0, -5.0, 0]}, external_axes="world")
    np.testing.assert_allclose(9.81 * math.cos(turned.q[0]), 5.0, rtol=1e-12)
    none = m.equilibrium([0.1], tau=[30.0])
    assert not none.converged and none.reason == "not found" and not none.stable
    np.testing.assert_allclose(none.residual, [30.0 + 9.81 * math.cos(none.q[0])], rtol=1e-12)
    light = m.with_gravity(1e-14 * np.array(m.gravity))
    assert light.equilibrium([0.1], tau=[30e-14]).reason == "not found" and light.equilibrium([1.0]).reason == "at rest", "whatever the unit of force"
    near = m.equilibrium([0.001], tau=[-9.8])  # about level the stiffness is next to none: shorter steps are taken
    assert near.converged and 9.81 * math.cos(near.q[0]) == pytest.approx(9.8, rel=1e-12)
    np.testing.assert_allclose(m.equilibrium([0.1]).q, [math.pi / 2], rtol=1e-12, err_msg="no turn away, as a step of 10 rad were")


def test_a_closed_mechanism_rests_where_its_drive_holds_it_and_nearest_to_where_it_was():
    m = ksl.load_string(FOURBAR, drives=["A"])
    q0 = m.close(m.neutral()).q
    q = m.close(m.integrate(q0, m.consistent_velocity(q0, 0.3 * np.eye(3)[0], ["A"])), hold=["A"]).q
    tau = m.inverse_dynamics(q, np.zeros(3), np.zeros(3))
    near = m.close(m.integrate(q, m.consistent_velocity(q, 0.05 * np.eye(3)[0], ["A"])), hold=["A"]).q
    found = m.equilibrium(near, tau=tau)
    np.testing.assert_allclose(m.difference(q, found.q), 0, atol=1e-12)
    by_q = m.inverse_dynamics_derivatives(q, np.zeros(3), np.zeros(3))[0]
    np.testing.assert_allclose(found.stiffness, by_q[:1], rtol=1e-9)
    assert found.stable == (by_q[0, 0] > 0) and found.independent.tolist() == [0]


def test_what_is_let_go_with_damping_comes_to_rest_there():
    m = pendulum(physics=["spring", "damping"])
    found = m.equilibrium([0.5])
    run = m.simulate([0.5], [0.0], [0.0, 40.0])
    assert found.stable
    np.testing.assert_allclose(run.q[-1], found.q, atol=1e-6)


def test_what_does_not_fit():
    m = pendulum()
    with pytest.raises(ValueError, match="expected one"):
        m.equilibrium(np.zeros((3, 1)))
    with pytest.raises(ValueError, match="tau"):
        m.equilibrium([0.0], tau=[1.0, 2.0])
    b = ksl.Builder("falls").add_link("hull", 1.0, (0, 0, 0), np.eye(3))
    falling = b.build(floating_base=True)
    assert falling.equilibrium(falling.neutral()).reason == "not found"
