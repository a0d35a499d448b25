"""Forward dynamics, the mass matrix and its inverse, first derivatives and rates of Jacobians against the results of an independent
library.  README.md has the conventions."""

import numpy as np
import pytest
from body_reference_test import WholeBody
from reference_test import FILES, HERE, TOLERANCE, error

SOLVED = 1e-8
"""Where the mass matrix, with a condition up to 1e6, is inverted."""
WHERE = {"local": {"axes": "frame", "at": "frame"}, "world": {"axes": "world", "at": "world"}, "lwa": {"axes": "world", "at": "frame"}}


class Dynamics(WholeBody):
    """A robot with the further results: of the first states alone, in KSL's order of joints."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.data = dict(np.load(HERE / f"{name}_dynamics.npz"))
        self.n = len(self.data["tau"])
        self.q, self.v, self.a = (x[: self.n] for x in self.state)
        self.tau = self.vector("tau")

    def vector(self, key: str) -> np.ndarray:
        return self.data[key][:, self.in_v]

    def square(self, key: str) -> np.ndarray:
        return self.data[key][:, self.in_v][:, :, self.in_v]


@pytest.fixture(scope="module", params=FILES)
def r(request) -> Dynamics:
    return Dynamics(request.param)


def test_bias_and_gravity(r):
    assert error(r.m.bias(r.q, r.v), r.vector("nle")) < TOLERANCE
    assert error(r.m.gravity_torque(r.q), r.vector("gravity")) < TOLERANCE
    C = r.m.coriolis_matrix(r.q, r.v)
    assert error(np.einsum("sij,sj->si", C, r.v), r.vector("nle") - r.vector("gravity")) < TOLERANCE


def test_mass_matrix_and_its_inverse(r):
    assert error(r.m.mass_matrix(r.q), r.square("M")) < TOLERANCE
    assert error(r.m.mass_matrix_inverse(r.q), r.square("Minv")) < SOLVED


def test_accelerations(r):
    assert error(r.m.forward_dynamics(r.q, r.v, r.tau), r.vector("aba")) < SOLVED
    external = {child: r.of_joint["fext"][: r.n, i] for i, child in enumerate(r.children)}
    assert error(r.m.forward_dynamics(r.q, r.v, r.tau, external), r.vector("aba_fext")) < SOLVED


def test_derivatives_of_efforts(r):
    for found, key in zip(r.m.inverse_dynamics_derivatives(r.q, r.v, r.a), ("dtau_dq", "dtau_dv", "M")):
        assert error(found, r.square(key)) < TOLERANCE, key


def test_derivatives_of_accelerations(r):
    for found, key in zip(r.m.forward_dynamics_derivatives(r.q, r.v, r.tau), ("ddq_dq", "ddq_dv", "Minv")):
        assert error(found, r.square(key)) < SOLVED, key


def test_twists_and_accelerations_of_links(r):
    """Spatial, in the frames' own axes."""
    assert error(r.m.frame_velocities(r.q, r.v, r.children), r.data["joint_v"][:, r.order]) < TOLERANCE
    assert error(r.m.frame_accelerations(r.q, r.v, r.a, r.children), r.data["joint_a"][:, r.order]) < TOLERANCE


@pytest.mark.parametrize("key", WHERE)
def test_rates_of_jacobians(r, key):
    found = np.stack([np.einsum("sij,sj->si", r.m.jacobian_rate(r.q, r.v, name, **WHERE[key]), r.v) for name in r.jacobian_joints], axis=1)
    assert error(found, r.data[f"dJv_{key}"]) < TOLERANCE
