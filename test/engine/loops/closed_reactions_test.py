"""Derivatives of reactions along closed mechanisms: by finite differences along the mechanism, and by a second way to close the loop."""

import sys
from pathlib import Path

import ksl
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "laws"))
from closed_mechanisms import KINDS
from closed_test import Motion, close_to, determined_case

CASES = [(kind, seed) for kind in KINDS for seed in range(2)]
STEP = 1e-3


def along(x, state):
    """States along the mechanism: (by, coordinate, step) to q, v, a with one independent coordinate moved, and the others where they were."""
    c, m = x.case, x.case.model
    free = m.independent(c.q)

    def moved(by, j, step):
        dq, v, a = np.zeros(m.nv), state[1].copy(), state[2].copy()
        (dq, v, a)[by][free[j]] += step
        q = state[0]
        if by == 0:
            q = m.close(m.integrate(q, dq), hold=c.drives).q
        v = m.consistent_velocity(q, v, given=c.drives)
        return q, v, m.consistent_acceleration(q, v, a, given=c.drives)

    return moved, len(free)


def difference(f, step=STEP):
    """Fourth order."""
    return (8 * (f(step) - f(-step)) - (f(2 * step) - f(-2 * step))) / (12 * step)


@pytest.mark.parametrize("kind, seed", CASES)
def test_finite_differences_along_the_mechanism(kind, seed):
    x = Motion(kind, seed, determined_case)
    c, m = x.case, x.case.model
    names = [*m.joint_names, "L"]
    unique = m.reactions_unique(c.q, names)
    moved, free = along(x, (c.q, x.v, x.a))
    for how in ({}, {"on": "parent", "order": "ang_lin"}):
        found = m.reactions_derivatives(c.q, x.v, x.a, x.external, joints=names, undetermined="nan", **how)
        sure = unique if not how else np.roll(unique, 3, axis=1)
        assert all((np.isnan(D).any(axis=-1) == ~sure).all() for D in found)
        for by, D in enumerate(found):
            for j in range(free):
                expected = difference(lambda step: m.reactions(*moved(by, j, step), x.external, joints=names, **how))
                close_to(np.where(sure, D[..., j], 0), np.where(sure, expected, 0), 2e-6)


@pytest.mark.parametrize("kind, seed", CASES)
def test_a_second_way_to_close_the_loop(kind, seed):
    """The loop's joint in the tree, and a weld: none of its steps is shared, and there are no finite differences."""
    x = Motion(kind, seed, determined_case)
    c, m, w = x.case, x.case.model, x.case.welded
    names = [*m.joint_names, "L"]
    both = m.reactions_unique(c.q, names) & w.reactions_unique(c.q_welded, names)
    of = {name: w.joint(name) for name in m.joint_names}
    in_other = [of[j.name].v_index + (i - j.v_index) for i in m.independent(c.q) for j in m.joints if j.nv and j.v_index <= i < j.v_index + j.nv]
    order = np.argsort(np.argsort(in_other))
    mine = m.reactions_derivatives(c.q, x.v, x.a, x.external, joints=names, undetermined="nan")
    other = w.reactions_derivatives(c.q_welded, x.vw, x.aw, x.external, joints=[n for n in names if n != "L"], undetermined="nan")
    keep = [i for i, name in enumerate(names) if name != "L"]
    for D, E in zip(mine, other):
        sure = both[keep][..., None]
        close_to(np.where(sure, D[keep], 0), np.where(sure, E[..., order], 0), 1e-9)


def test_other_points_axes_and_wrenches_in_the_worlds_axes():
    x = Motion("spherical", 1, determined_case)
    c, m = x.case, x.case.model
    moved, free = along(x, (c.q, x.v, x.a))
    names = [m.joint_names[0]]
    assert m.reactions_unique(c.q, names).all()
    for how in ({"axes": "world", "at": "world"}, {"axes": "a0"}, {"at": (0.1, 0.2, 0.3), "part": "constraint"}, {"external_axes": "world"}):
        found = m.reactions_derivatives(c.q, x.v, x.a, x.external, joints=names, **how)
        for by, D in enumerate(found):
            for j in range(free):
                expected = difference(lambda step: m.reactions(*moved(by, j, step), x.external, joints=names, **how))
                close_to(D[..., j], expected, 2e-6)
    three = lambda y: np.tile(y, (3, 1))
    batch = m.reactions_derivatives(three(c.q), three(x.v), three(x.a), x.external, joints=names)
    for D, E in zip(batch, m.reactions_derivatives(c.q, x.v, x.a, x.external, joints=names)):
        assert np.array_equal(D, np.stack([E] * 3))


def test_what_is_not_determined_is_refused_by_name():
    up = np.eye(4)
    up[2, 3] = 1.0
    b = ksl.Builder("door").add_link("wall").add_link("leaf", mass=10.0, center_of_mass=(0.5, 0, 0.5), inertia=np.eye(3))
    m = (
        b.add_joint("lower", "revolute", "wall", "leaf", axis=(0, 0, 1))
        .add_loop("upper", "revolute", "wall", "leaf", up, up, axis=(0, 0, 1))
        .build(drives=["lower"])
    )
    with pytest.raises(ksl.ResultError, match=r"reactions_derivatives: fx, fy, fz, tx, ty of joint lower are not determined by rigid bodies"):
        m.reactions_derivatives([0.0], [0.0], [0.0])
    by_q, _, by_a = m.reactions_derivatives([0.0], [0.0], [0.0], joints=["lower", "upper"], undetermined="nan")
    assert np.isnan(by_q[:, :5]).all() and by_a[0, 5, 0] == pytest.approx(1 + 10 * 0.25) and by_a[1, 5, 0] == 0  # about the axis
    with pytest.raises(ValueError, match="stiffnesses split reactions"):
        m.with_stiffness(dict.fromkeys(["lower", "upper"], np.full(6, 1e6))).reactions_derivatives([0.0], [0.0], [0.0])
    with pytest.raises(ValueError, match="upper closes a loop"):
        m.reactions_derivatives([0.0], [0.0], [0.0], joints=["upper"], axes="world")
    with pytest.raises(ValueError, match="undetermined='non'"):
        m.reactions_derivatives([0.0], [0.0], [0.0], undetermined="non")
    with pytest.raises(ValueError, match="out= is for models without loops"):
        m.reactions_derivatives([0.0], [0.0], [0.0], out=(np.zeros(1),) * 3)


@pytest.mark.parametrize("soft", [["J0"], ["J0", "J1"], ["L1"]])
def test_least_energy_where_some_patterns_store_none(soft):
    """Two joints between the same links: what one exerts on the other goes through no other joint.  Against a dense solution: energy first, then the norm."""
    rng = np.random.default_rng(4)
    b = ksl.Builder("held twice").add_link("ground").add_link("b0", 1.0, rng.normal(size=3), np.eye(3)).add_link("b1", 2.0, rng.normal(size=3), np.eye(3))
    b.add_joint("J0", "spherical", "ground", "b0", xyz=(0.1, 0.2, 0.3)).add_joint("J1", "spherical", "b0", "b1", xyz=(0.5, 0.1, -0.2))
    there = np.eye(4)
    there[:3, 3] = 0.6, 0.3, 0.1
    b.add_loop("L1", "translation", "b1", "ground").add_loop("L2", "revolute", "b1", "ground", np.eye(4), there, axis=(0.0, 0.6, 0.8))
    m = b.build(drives=["J0", "J1"])
    q = m.close(m.neutral()).q
    assert m.mobility(q).redundant == 3
    names, zero = ["J0", "J1", "L1", "L2"], np.zeros(m.nv)
    stiffness = {}
    for name in soft:
        A = rng.normal(size=(6, 6))
        stiffness[name] = 1e4 * (A @ A.T + np.eye(6))
    f = m.reactions(q, zero, zero, {"b0": np.arange(6.0)}, joints=names).ravel()
    N = m.reactions_null_basis(q, names).reshape(-1, 24).T
    C = np.zeros((24, 24))
    for name in soft:
        at = slice(6 * names.index(name), 6 * names.index(name) + 6)
        C[at, at] = np.linalg.inv(stiffness[name])
    energies, turn = np.linalg.eigh(N.T @ C @ N)
    stores = energies > 1e-9 * energies.max()
    assert 0 < stores.sum() < len(stores)
    N = N @ turn[:, stores]
    expected = f - N @ ((N.T @ C @ f) / energies[stores])
    for state in ((q, zero, zero), tuple(np.tile(x, (3, 1)) for x in (q, zero, zero))):
        found = m.reactions(*state, {"b0": np.arange(6.0)}, joints=names, stiffness=stiffness)
        close_to(found.reshape(-1, 24), np.tile(expected, (found.size // 24, 1)), 1e-8)
