"""The readers of SDF and MJCF against results of Kane's equations at 420 bits.  README.md has the conventions."""

import json
from pathlib import Path

import numpy as np
import pytest

import ksl

HERE = Path(__file__).parent
TOLERANCE = 1e-12


class Case:
    """The model of a description file, and its reference results in the order of the model's joints."""

    def __init__(self, name: str, file: str) -> None:
        self.m = ksl.load(HERE / file)
        self.case = json.loads((HERE / f"{name}.json").read_text())
        self.by_link = {j["child"]: j for j in self.case["joints"]}
        moving = [self.by_link[self.m.joint(name).child] for name in self.m.joint_names]
        columns = lambda i, n: np.concatenate([np.arange(j[i], j[i] + j[n]) for j in moving])
        self.in_q, self.in_v = columns("idx_q", "nq"), columns("idx_v", "nv")

    def states(self):
        return [{k: np.asarray(x, float) for k, x in s.items()} for s in self.case["states"]]


@pytest.fixture(scope="module", params=[("read_sdf", "read_sdf.sdf"), ("read_mjcf", "read_mjcf.xml")], ids=["sdf", "mjcf"])
def case(request) -> Case:
    return Case(*request.param)


def check(found, expected, tolerance=TOLERANCE) -> None:
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() < tolerance * max(1.0, np.abs(expected).max())


def test_links_and_joints_are_those_of_the_case(case):
    m = case.m
    assert (m.nq, m.nv, m.root) == (case.case["nq"], case.case["nv"], "world")
    assert m.warnings == m.unused == ()
    assert {link.name for link in m.links} == {"world", *case.by_link}
    for j in m.joints[:-1]:
        expected = case.by_link[j.child]
        kind = expected["type"].replace("free", "floating")
        if m.file.endswith(".xml"):
            kind = kind.replace("continuous", "revolute")
        assert (j.kind, j.parent) == (kind, expected["parent"])
        if j.kind != "fixed" or m.file.endswith(".sdf"):  # MJCF has no names for them
            assert j.name == expected["name"]
        for axis in ("axis", "axis2"):
            if expected[axis]:
                check(getattr(j, axis), expected[axis])
        check(j.pitch, expected["pitch"] or 0.0)


def test_dynamics(case):
    m, square = case.m, np.ix_(case.in_v, case.in_v)
    for s in case.states():
        q, v, a = s["q"][case.in_q], s["v"][case.in_v], s["a"][case.in_v]
        external = {j["child"]: w for j, w in zip(case.case["joints"], s["external"])}
        check(m.inverse_dynamics(q, v, a), s["effort"][case.in_v])
        check(m.inverse_dynamics(q, v, a, external), s["effort_with_external"][case.in_v])
        check(m.bias(q, v), s["bias"][case.in_v])
        check(m.gravity_torque(q), s["gravity_effort"][case.in_v])
        check(m.mass_matrix(q), s["mass_matrix"][square])
        check(m.forward_dynamics(q, v, s["applied_effort"][case.in_v]), s["forward_acceleration"][case.in_v], 1e-10)
        check(m.energy(q, v), [s["kinetic_energy"], s["potential_energy"]])


def test_poses_and_reactions(case):
    m, links = case.m, [j["child"] for j in case.case["joints"]]
    for s in case.states():
        q, v, a = s["q"][case.in_q], s["v"][case.in_v], s["a"][case.in_v]
        poses = m.frame_poses(q, links)
        check(poses[:, :3, :3], s["body_R"])
        check(poses[:, :3, 3], s["body_p"])
        check(m.reactions(q, v, a, joints=[m.joint_above(link).name for link in links]), s["wrench"])
