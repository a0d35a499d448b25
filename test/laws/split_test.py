"""What the structure carries and what the motor supplies: the split of a reaction."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from frames import drive, placements, requested, subspace, swapped
from random_tree import Case

TOLERANCE = 1e-12
"""Of the largest wrench, moved by arms of some metres."""

seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(1, 40)
bases = st.booleans()


def parts(c, **options):
    return (c.all_reactions(part=part, **options) for part in ("total", "constraint", "actuation"))


@given(seeds, sizes, bases)
def test_constraint_and_actuation_make_the_total(seed, bodies, floating):
    c = Case(seed, bodies, floating_base=floating)
    total, constraint, actuation = parts(c)
    assert np.array_equal(constraint + actuation, total) or np.abs(constraint + actuation - total).max() < TOLERANCE * c.load


@given(seeds, sizes, bases)
def test_constraint_does_no_work_and_actuation_is_the_effort(seed, bodies, floating):
    c = Case(seed, bodies, floating_base=floating)
    tau, (_, constraint, actuation) = c.m.inverse_dynamics(*c.state, c.external), parts(c)
    for i, j in enumerate(c.m.joints):
        S = subspace(j, c.q)
        works = lambda part: np.einsum("ni,nij->nj", part[:, i], S)
        assert np.abs(works(constraint)).max(initial=0.0) < TOLERANCE * c.load, f"{j.name} ({j.kind}): its constraint works"
        effort = tau[:, j.v_index : j.v_index + j.nv] if j.nv else np.empty((len(tau), 0))
        assert np.abs(works(actuation) - effort).max(initial=0.0) < TOLERANCE * c.load, f"{j.name} ({j.kind}): actuation is not the effort"


@given(seeds, sizes, bases)
def test_shape_of_the_parts_by_kind(seed, bodies, floating):
    """Revolute, helical: actuation is a moment along the axis and no force; spherical: any moment and no force; prismatic: a force along it and no moment; fixed: all is
    constraint; floating: all is actuation.  Cylindrical: along and about the axis; universal: constraint is any force, and a moment normal to both axes; planar:
    constraint is a force along the normal, and a moment across it; translation: any force is actuation."""
    c = Case(seed, bodies, floating_base=floating)
    total, constraint, actuation = parts(c)
    for i, j in enumerate(c.m.joints):
        if j.kind == "fixed":
            assert not actuation[:, i].any() and np.array_equal(constraint[:, i], total[:, i]), j.name
        elif j.kind == "floating":
            assert not constraint[:, i].any() and np.array_equal(actuation[:, i], total[:, i]), j.name
        elif j.kind == "spherical":
            assert not actuation[:, i, :3].any() and not constraint[:, i, 3:].any() and np.array_equal((actuation + constraint)[:, i], total[:, i]), j.name
        elif j.kind == "translation":
            assert not actuation[:, i, 3:].any() and not constraint[:, i, :3].any(), j.name
        elif j.kind in ("cylindrical", "planar"):
            axial, across = (actuation, constraint) if j.kind == "cylindrical" else (constraint, actuation)
            axis, force, moment = np.array(j.axis), slice(0, 3), slice(3, 6)
            lean = lambda x: np.abs(np.cross(x, axis)).max()
            assert lean(axial[:, i, force]) < TOLERANCE * c.load and np.abs(across[:, i, force] @ axis).max() < TOLERANCE * c.load, j.name
            assert lean(actuation[:, i, moment]) < TOLERANCE * c.load and np.abs(constraint[:, i, moment] @ axis).max() < TOLERANCE * c.load, j.name
        elif j.kind == "universal":
            first, second = np.moveaxis(subspace(j, c.q)[:, 3:], 2, 0)
            normal = np.cross(first, second)
            assert not actuation[:, i, :3].any(), j.name
            assert np.abs(np.sum(actuation[:, i, 3:] * normal, axis=1)).max() < TOLERANCE * c.load, j.name
            assert np.abs(np.cross(constraint[:, i, 3:], normal)).max() < TOLERANCE * c.load, j.name
        else:
            along, none = (slice(0, 3), slice(3, 6)) if j.kind == "prismatic" else (slice(3, 6), slice(0, 3))
            assert not actuation[:, i, none].any(), f"{j.name} ({j.kind})"
            axis = np.array(j.axis)
            across = actuation[:, i, along] - (actuation[:, i, along] @ axis)[:, None] * axis
            assert np.abs(across).max() < TOLERANCE * c.load, f"{j.name} ({j.kind})"


@given(seeds, sizes, bases)
def test_the_split_moves_by_the_coadjoint(seed, bodies, floating):
    """At any point, in any axes, on either side and in either order: total = constraint + actuation, and each part is the
    joint frame's part, moved."""
    c = Case(seed, bodies, floating_base=floating)
    how = placements(c.rng, c.m)
    there, here = list(parts(c, **how)), list(parts(c))
    assert np.abs(there[1] + there[2] - there[0]).max() < 10 * TOLERANCE * c.load, how
    for i, j in enumerate(c.m.joints):
        X = requested(c.m, c.q, j, how["at"], how["axes"])
        for moved, own in zip(there, here):
            expected = (X @ own[:, i, :, None])[..., 0] * (1 if how["on"] == "child" else -1)
            expected = expected if how["order"] == "lin_ang" else swapped(expected)
            assert np.abs(moved[:, i] - expected).max() < 10 * TOLERANCE * c.load, f"{j.name} ({j.kind}), {how}"


@given(seeds, sizes, bases)
def test_projectors_move_as_coadjoint_projector_inverse_coadjoint(seed, bodies, floating):
    """H̄* there = CoAd H̄* CoAd⁻¹, applied to the total there, is the constraint there; the same with h̄* and actuation."""
    c = Case(seed, bodies, floating_base=floating)
    how = placements(c.rng, c.m) | {"on": "child", "order": "lin_ang"}
    total, constraint, actuation = parts(c, **how)
    for i, j in enumerate(c.m.joints):
        X, S = requested(c.m, c.q, j, how["at"], how["axes"]), subspace(j, c.q)
        h = X @ (drive(j, c.q) @ np.swapaxes(S, 1, 2)) @ np.linalg.inv(X)
        assert np.abs(h @ h - h).max() < 1e-9, "no projector"
        for projector, part in ((h, actuation), (np.eye(6) - h, constraint)):
            found = (projector @ total[:, i, :, None])[..., 0]
            assert np.abs(found - part[:, i]).max() < 100 * TOLERANCE * c.load, f"{j.name} ({j.kind}), {how}"
