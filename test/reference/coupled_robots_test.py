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
from projection import Projection, check_projection  # noqa: E402


def followers(path: Path) -> dict[str, str]:
    """{moving joint: the joint that it mimics} in a file."""
    joints = ET.parse(path).getroot().findall("joint")
    return {j.get("name"): j.find("mimic").get("joint") for j in joints if j.find("mimic") is not None and j.get("type") != "fixed"}


ROBOTS = {name: path for name, path in all_robots().items() if path.read_bytes().find(b"<mimic") >= 0 and followers(path)}
WRONG = "alex_description/urdf/alex_psyonic_hands.urdf"
"""Its fingers mimic `index_q1` and others, which are called `Left_index_q1` and `Right_index_q1`."""


def load(name: str, **options) -> ksl.Model:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)
        return ksl.load(ROBOTS[name], **options)


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
        found = coupled.forward_dynamics(q, v, coupled.inverse_dynamics(q, v, a))
        assert np.abs(found - a).max() < 1e-13 * np.linalg.cond(M).max()


def test_a_leader_that_does_not_exist_is_named():
    with pytest.raises(ksl.DescriptionError, match='Left_index_q2: it mimics joint "index_q1", which does not exist.*independent'):
        load(WRONG)
    assert load(WRONG, mimic="independent").follower_names == []
