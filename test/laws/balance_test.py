"""Reactions, efforts, poses and energies are those of the witness, whose bodies are in balance; by the reactions of KSL: identities_test.py."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from random_tree import KINDS, Case

TOLERANCE = 1e-12
"""Of the largest wrench in the robot."""

seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(1, 64)
bases = st.booleans()


def rest(x, y, scale) -> float:
    return float(np.abs(np.asarray(x) - y).max(initial=0.0)) / scale


@given(seeds, sizes, bases)
def test_reactions_of_all_joints_are_those_of_the_witness(seed, bodies, floating):
    c = Case(seed, bodies, floating_base=floating)
    found, scale = c.all_reactions(), c.load
    for i, j in enumerate(c.m.joints):
        assert rest(found[:, i], c.witness.in_joint_frame(j.child), scale) < TOLERANCE, f"{j.name} ({j.kind})"


@given(seeds, sizes, bases)
def test_efforts_are_those_of_the_witness(seed, bodies, floating):
    c = Case(seed, bodies, floating_base=floating)
    tau, scale = c.m.inverse_dynamics(*c.state, c.external), c.load
    for j in c.m.joints:
        if j.nv:
            assert rest(tau[:, j.v_index : j.v_index + j.nv], c.witness.effort[j.child], scale) < TOLERANCE, f"{j.name} ({j.kind})"


@given(seeds, sizes, bases)
def test_poses_and_energies_are_those_of_the_witness(seed, bodies, floating):
    c = Case(seed, bodies, floating_base=floating, gravity=(1.0, -2.0, 3.0))
    for link in c.m.link_names:
        assert rest(c.m.frame_pose(c.q, link), c.witness.pose[link], 10.0) < TOLERANCE, link
    kinetic, potential = c.m.energy(c.q, c.v)
    assert rest(kinetic, c.witness.kinetic, max(1.0, np.abs(c.witness.kinetic).max())) < TOLERANCE
    assert rest(potential, c.witness.potential, max(1.0, np.abs(c.witness.potential).max())) < 10 * TOLERANCE


@given(seeds, st.integers(2, 64))
def test_order_of_joints_and_links(seed, bodies):
    """Moving joints depth first, children in file order, with numbers side by side; links parents first."""
    c = Case(seed, bodies, states=1)
    import xml.etree.ElementTree as ET

    file = ET.fromstring(c.text).findall("joint")
    expected = []

    def walk(link):
        for e in file:
            if e.find("parent").get("link") == link:
                expected.append((e.get("name"), e.get("type")))
                walk(e.find("child").get("link"))

    walk(c.tree.root)
    assert c.m.joint_names == [n for n, kind in expected if kind != "fixed"]
    assert c.m.fixed_joint_names == [n for n, kind in expected if kind == "fixed"] + ["base"]
    moving = c.m.joints[: len(c.m.joint_names)]
    assert [j.q_index for j in moving] == list(np.cumsum([0, *(j.nq for j in moving)])[:-1])
    assert [j.v_index for j in moving] == list(np.cumsum([0, *(j.nv for j in moving)])[:-1])
    place = {name: i for i, name in enumerate(c.m.link_names)}
    assert all(place[j.parent] < place[j.child] for j in c.m.joints if j.parent is not None)


def test_a_wrong_witness_would_be_noticed():
    """The comparison has teeth: a millionth of a kilogram on one link is seen."""
    c = Case(7, 12)
    next(iter(link for link in c.tree.links.values() if link.mass > 0)).mass += 1e-6
    from random_tree import witness

    w = witness(c.m, c.tree, *c.state, c.external)
    base = c.m.reactions(*c.state, c.external, joints=["base"])[:, 0]
    assert rest(base, w.in_joint_frame(c.tree.root), c.load) > 100 * TOLERANCE


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_joint_alone(kind):
    """Robots with one kind of joint only, so that none can hide behind the others."""
    for seed in range(5):
        c = Case(seed, 12, kinds=(kind,))
        found = c.all_reactions()
        for i, j in enumerate(c.m.joints):
            assert rest(found[:, i], c.witness.in_joint_frame(j.child), c.load) < TOLERANCE, f"{j.name} ({j.kind})"
