"""on, at, axes, order: what each changes.  Against the transform written out: split_test.py."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from frames import swapped
from random_tree import Case

TOLERANCE = 1e-12

seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(1, 24)
bases = st.booleans()


@given(seeds, sizes, bases)
def test_forces_do_not_depend_on_the_point(seed, bodies, floating):
    c = Case(seed, bodies, floating_base=floating)
    own = c.all_reactions()[..., :3]
    for at in ("world", c.m.link_names[-1], (1.0, 2.0, 3.0)):
        assert np.abs(c.all_reactions(at=at)[..., :3] - own).max() < TOLERANCE * c.load, at


@given(seeds, sizes, bases)
def test_parent_is_the_negative_and_order_the_swap(seed, bodies, floating):
    c = Case(seed, bodies, floating_base=floating)
    how = {"at": "world", "axes": c.m.link_names[-1], "part": "constraint"}
    child = c.all_reactions(**how)
    assert np.array_equal(c.all_reactions(on="parent", **how), -child)
    assert np.array_equal(c.all_reactions(order="ang_lin", **how), swapped(child))


@given(seeds, sizes)
def test_at_the_child_link_and_in_its_axes_is_the_joint_frame(seed, bodies):
    c = Case(seed, bodies)
    own = c.all_reactions()
    for i, j in enumerate(c.m.joints):
        named = c.m.reactions(*c.state, c.external, joints=[j.name], at=j.child, axes=j.child)[:, 0]
        assert np.abs(named - own[:, i]).max() < 10 * TOLERANCE * c.load, j.name


@given(seeds, st.integers(2, 24))
def test_joints_are_given_in_the_order_asked_for(seed, bodies):
    c = Case(seed, bodies)
    own = c.all_reactions(axes="world")
    order = c.rng.permutation(len(c.names))
    asked = c.m.reactions(*c.state, c.external, joints=[c.names[i] for i in order], axes="world")
    assert np.array_equal(asked, own[:, order])
    moving = c.m.reactions(*c.state, c.external, axes="world")
    assert np.array_equal(moving, own[:, : len(c.m.joint_names)])
