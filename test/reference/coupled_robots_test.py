"""Mimic joints of real robots: the nine files of example-robot-data that couple moving joints."""

import sys
import warnings
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from robots import all_robots

import ksl

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "laws"))
from projection import Projection, check_projection


def followers(path: Path) -> dict[str, str]:
    """{moving joint: the joint that it mimics} in a file."""
    joints = ET.parse(path).getroot().findall("joint")
    return {j.get("name"): j.find("mimic").get("joint") for j in joints if j.find("mimic") is not None and j.get("type") != "fixed"}


ROBOTS = {name: path for name, path in all_robots().items() if path.read_bytes().find(b"<mimic") >= 0 and followers(path)}
WRONG = "alex_description/urdf/alex_psyonic_hands.urdf"
"""Its fingers mimic `index_q1` and others, which are called `Left_index_q1` and `Right_index_q1`."""


CLOSED = "pr2_description/urdf/pr2.urdf"
"""Its `<gazebo>` joints close the loops of the grippers, in a form that KSL refuses to read; here its tree is meant."""


def load(name: str, **options) -> ksl.Model:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)
        return ksl.load(ROBOTS[name], loops="cut" if name == CLOSED else None, **options)


def test_nine_robots_couple_joints():
    assert len(ROBOTS) == 9 and WRONG in ROBOTS


@pytest.mark.parametrize("name", sorted(set(ROBOTS) - {WRONG}))
def test_coupled_robots_are_projections_of_independent_ones(name):
    coupled, independent = load(name), load(name, mimic="independent")
    leaders = followers(ROBOTS[name])
    assert sorted(coupled.follower_names) == sorted(leaders)
    assert all(coupled.joint(follower).leader == leader for follower, leader in leaders.items())
    assert coupled.nv == independent.nv - len(leaders)
    rng = np.random.default_rng(1)
    check_projection(Projection(coupled, independent), rng)
    q, v, a = coupled.random(rng, size=2), rng.normal(size=(2, coupled.nv)), rng.normal(size=(2, coupled.nv))
    M = coupled.mass_matrix(q)
    if np.linalg.cond(M).max() < 1e12:
        tau = coupled.inverse_dynamics(q, v, a)
        found = coupled.forward_dynamics(q, v, tau)
        assert np.abs(found - a).max() < 1e-13 * np.linalg.cond(M).max()
        by_q, by_v, by_a = coupled.inverse_dynamics_derivatives(q, v, a)
        for x, of_tau in zip(coupled.forward_dynamics_derivatives(q, v, tau), (-by_q, -by_v, np.eye(coupled.nv)), strict=True):
            size = np.abs(M).max() * np.abs(x).max() + np.abs(of_tau).max()
            assert np.abs(by_a @ x - of_tau).max() < 1e-12 * size * np.linalg.cond(M).max() ** 0.5


@pytest.mark.parametrize("name", sorted(set(ROBOTS) - {WRONG}))
def test_derivatives_of_coupled_robots_are_limits_of_differences(name):
    m, rng = load(name), np.random.default_rng(2)
    q, v, a, w = m.random(rng), *rng.normal(size=(3, m.nv))
    joints, h = m.joint_names[:1] + m.follower_names, 1e-6
    ahead, behind = m.integrate(q, h * w), m.integrate(q, -h * w)

    def check(found, of):
        quotient = (of(ahead) - of(behind)) / (2 * h)
        assert np.abs(found @ w - quotient).max() <= 1e-7 * max(1, np.abs(quotient).max(), np.abs(of(q)).max())

    check(m.inverse_dynamics_derivatives(q, v, a)[0], lambda x: m.inverse_dynamics(x, v, a))
    for part in ("total", "actuation", "coupling"):
        check(m.reactions_derivatives(q, v, a, joints=joints, part=part)[0], lambda x: m.reactions(x, v, a, joints=joints, part=part))


def test_a_leader_that_does_not_exist_is_named():
    with pytest.raises(ksl.DescriptionError, match='Left_index_q2: it mimics joint "index_q1", which does not exist.*independent'):
        load(WRONG)
    assert load(WRONG, mimic="independent").follower_names == []
