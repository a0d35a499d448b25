"""Centre of mass, centroidal momentum and regressor against the results of an independent library.  README.md has the conventions."""

import json

import numpy as np
import pytest
from reference_test import FILES, HERE, TOLERANCE, Reference, error


class WholeBody(Reference):
    """A robot with the further results, in KSL's order of joints."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        described = json.loads((HERE / f"{name}.json").read_text())
        rows = {("floating_base" if j["type"] == "FF" else j["name"]): i for i, j in enumerate(described["joints"])}
        self.order = [rows[n] for n in self.m.joint_names]
        self.in_v = np.concatenate([np.arange(j["idx_v"], j["idx_v"] + j["nv"]) for j in self.joints])
        self.body = dict(np.load(HERE / f"{name}_body.npz"))


@pytest.fixture(scope="module", params=FILES)
def r(request) -> WholeBody:
    return WholeBody(request.param)


def test_center_of_mass(r):
    q, v, a = r.state
    assert error(r.m.center_of_mass(q), r.body["com"]) < TOLERANCE
    assert error(r.m.center_of_mass_velocity(q, v), r.body["vcom"]) < TOLERANCE
    assert error(r.m.center_of_mass_acceleration(q, v, a), r.body["acom"]) < TOLERANCE
    assert error(r.m.center_of_mass_jacobian(q), r.body["Jcom"][..., r.in_v]) < TOLERANCE


def test_centroidal_momentum(r):
    q, v, a = r.state
    assert error(r.m.centroidal_momentum(q, v), r.body["hg"]) < TOLERANCE
    assert error(r.m.centroidal_momentum_rate(q, v, a), r.body["dhg"]) < TOLERANCE
    assert error(r.m.centroidal_momentum_matrix(q), r.body["Ag"][..., r.in_v]) < TOLERANCE


def test_regressor(r):
    if "regressor" not in r.body:
        pytest.skip("not among the results for this robot")
    expected = r.body["regressor"].reshape(len(r.state[0]), r.m.nv, -1, 10)[:, r.in_v][:, :, r.order]
    assert error(r.m.inverse_dynamics_regressor(*r.state, links=r.children), expected) < TOLERANCE
