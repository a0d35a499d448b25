"""Mechanisms with loops and mimic joints: against the same ones whose followers have motors of their own, which are models with other equations."""

import xml.etree.ElementTree as ET

import ksl
import numpy as np
import pytest
from closed_mechanisms import KINDS, random_case
from projection import COUPLED, Projection
from random_tree import load_text


def close_to(x, y, limit):
    x, y = np.asarray(x), np.asarray(y)
    assert x.shape == y.shape and np.isfinite(x).all()
    assert np.abs(x - y).max(initial=0) <= limit * max(1, np.abs(y).max(initial=0))


def joint_of(m, coordinate):
    return next(j for j in m.joints if j.nv and j.v_index <= coordinate < j.v_index + j.nv)


def driven(m, q, wanted):
    """The model with drives that determine its motion, as many as the freedoms, and among them the joints that are wanted; None if these don't do."""
    free = m.with_drives(wanted).independent(q)
    drives = list(dict.fromkeys([*wanted, *(joint_of(m, i).name for i in free)]))
    while sum(m.joint(name).nv for name in drives) > len(free) and len(drives) > len(wanted):
        drives.pop()
    m = m.with_drives(drives)
    coordinates = sorted(i for name in drives for i in range(m.joint(name).v_index, m.joint(name).v_index + m.joint(name).nv))
    return (m, drives) if list(m.independent(q)) == coordinates else (None, [])


def along_independent(m, q, free):
    """G (nv, freedoms), by which all velocities follow from the independent ones."""
    J = m.loop_jacobian(q)
    rest = np.setdiff1d(np.arange(m.nv), free)
    G = np.eye(m.nv)[:, free]
    G[rest] = -np.linalg.lstsq(J[:, rest], J[:, free], rcond=1e-9)[0]
    return G


def coupled_case(kind, seed):
    """A random closed mechanism in which one or two joints follow a driven one, the same with motors at the followers, and a position."""
    for number in range(1000 * seed, 1000 * seed + 1000):
        c = random_case(kind, number, lengths=(4, 4))
        rng = np.random.default_rng(number)
        names = [j.name for j in c.model.joints if j.kind in COUPLED]
        rng.shuffle(names)
        freedoms = c.model.mobility(c.q)
        if len(names) < 2 or freedoms.mobility < 2 or freedoms.smallest < 0.02:
            continue
        leader, *followers = names[: min(3, freedoms.mobility)]
        robot = ET.fromstring(c.model.to_urdf())
        at = lambda name: c.q[c.model.joint(name).q_index]
        for name in followers:
            factor = float(rng.choice([-1, 1]) * rng.uniform(0.4, 1.6))
            follows = {"joint": leader, "multiplier": repr(factor), "offset": repr(float(at(name) - factor * at(leader)))}
            ET.SubElement(robot.find(f"joint[@name='{name}']"), "mimic", follows)
        text = ET.tostring(robot, encoding="unicode")
        m, free = load_text(text), load_text(text, mimic="independent")
        q = np.zeros(m.nq)
        for own in (j for j in m.joints if j.nq):
            start = c.model.joint(own.name).q_index
            q[own.q_index : own.q_index + own.nq] = c.q[start : start + own.nq]
        m, drives = driven(m, q, [leader])
        free, _ = driven(free, Projection(m, free).position(q), [*drives, *followers]) if m else (None, [])
        if free and m.mobility(q).smallest > 0.02 and np.abs(along_independent(m, q, m.independent(q))).max() < 30:  # no dead centre of the drives
            return Projection(m, free), q, rng
    raise AssertionError("no such case")


@pytest.mark.parametrize("kind", KINDS)
def test_followers_in_loops(kind):
    p, q, rng = coupled_case(kind, 1)
    m, free, G = p.m, p.free, p.G
    with pytest.warns(UserWarning):  # what is given doesn't determine all
        v = m.consistent_velocity(q, rng.normal(size=m.nv), given=[])
        a = m.consistent_acceleration(q, v, rng.normal(size=m.nv), given=[])
    external, tau = {"a0": rng.normal(size=6), "b1": rng.normal(size=6)}, rng.normal(size=m.nv)
    expanded = p.position(q), p.motion(v), p.motion(a)
    along = np.linalg.svd(m.loop_jacobian(q))[2][m.mobility(q).rank :]  # motions that the mechanism has
    efforts = m.inverse_dynamics(q, v, a, external)
    close_to(along @ efforts, along @ G.T @ free.inverse_dynamics(*expanded, external), 1e-11)
    close_to(m.effort_parts(q, v, a, external).sum(axis=0), efforts, 1e-12)
    names = [*m.joint_names, "L"]
    both = m.reactions_unique(q, names) & free.reactions_unique(expanded[0], names)
    reactions = m.reactions(q, v, a, external, joints=names)
    close_to(np.where(both, reactions, 0), np.where(both, free.reactions(*expanded, external, joints=names), 0), 1e-10)
    found = m.forward_dynamics(q, v, tau, external)
    close_to(m.loop_acceleration(q, v, found), np.zeros(len(m.loop_error(q))), 1e-9)
    without = free.without_loops().inverse_dynamics(*expanded[:2], p.motion(found), external)
    close_to(along @ (G.T @ without), along @ tau, 1e-9)  # Gauss: loops do no work
    close_to(m.forward_dynamics(q, v, efforts, external), a, 1e-9)
    # batches have the bits of single states, and single precision has the numbers
    three = lambda x: np.tile(x, (3, 1))
    for call, last in ((m.inverse_dynamics, a), (m.effort_parts, a), (m.forward_dynamics, tau)):
        one = call(q, v, last, external)
        assert np.array_equal(call(three(q), three(v), three(last), external), np.stack([one] * 3))
        close_to(call(*(x.astype(np.float32) for x in (q, v, last)), {k: w.astype(np.float32) for k, w in external.items()}), one, 1e-2)
    assert np.array_equal(m.reactions(three(q), three(v), three(a), external, joints=names)[1], reactions)
    close_to(m.bias(three(q), three(v))[2], m.inverse_dynamics(q, v, m.forward_dynamics(q, v, m.bias(q, v))), 1e-8)


def linkages(sides):
    """Planar four-bars side by side; the crank of each follows that of the first."""
    at = lambda *t: np.block([[np.eye(3), np.reshape(t, (3, 1))], [np.zeros((1, 3)), 1]])
    b = ksl.Builder("gripper").add_link("ground")
    for k in range(sides):
        for name, mass, length in (("crank", 1.0, 0.2), ("coupler", 2.0, 0.6), ("rocker", 1.5, 0.5)):
            b.add_link(f"{name}{k}", mass=mass, center_of_mass=(length / 2, 0, 0), inertia=np.diag([0.001, 1, 1]) * mass * length**2 / 12)
        hinge = {"axis": (0, 1, 0)}
        b.add_joint(f"A{k}", "continuous", "ground", f"crank{k}", pose=at(0, k, 0), mimic=("A0", 1.0, 0.0) if k else None, **hinge)
        b.add_joint(f"B{k}", "continuous", f"crank{k}", f"coupler{k}", pose=at(0.2, 0, 0), **hinge)
        b.add_joint(f"E{k}", "continuous", "ground", f"rocker{k}", pose=at(0.6, k, 0), **hinge)
        b.add_loop(f"D{k}", "revolute", f"coupler{k}", f"rocker{k}", at(0.6, 0, 0), at(0.5, 0, 0), **hinge)
    return b.build(drives=["A0"])


def test_a_gripper_whose_sides_are_alike_needs_twice_the_effort_of_one():
    """And of the wrenches that rigid bodies leave open those of least norm: none of the patterns that may be added makes them smaller."""
    both, one, names = linkages(2), linkages(1), {}
    angles = {"A": -1.0, "B": 0.4, "E": -1.5}
    state = {}
    for m in (one, both):
        q = np.array([angles[j.name[0]] for j in m.joints[: len(m.joint_names)]])
        q = m.close(q, hold=["A0"]).q
        v = m.consistent_velocity(q, np.full(m.nv, 0.7), given=["A0"])
        state[m] = q, v, m.consistent_acceleration(q, v, np.full(m.nv, -1.1), given=["A0"])
        names[m] = [*(j.name for j in m.joints if j.kind == "continuous"), *m.loop_names]
    drive = both.joint("A0").v_index
    close_to(both.inverse_dynamics(*state[both])[drive], 2 * one.inverse_dynamics(*state[one])[one.joint("A0").v_index], 1e-12)
    close_to(both.inverse_dynamics_derivatives(*state[both])[0][drive], 2 * one.inverse_dynamics_derivatives(*state[one])[0][one.joint("A0").v_index], 1e-11)
    reactions, patterns = both.reactions(*state[both], joints=names[both]), both.reactions_null_basis(state[both][0], names[both])
    assert len(patterns) == 6  # three of each side
    close_to(np.einsum("kji,ji->k", patterns, reactions), np.zeros(6), 1e-11)
    several = both.reactions(*(np.tile(x, (5, 1)) for x in state[both]), joints=names[both])
    assert np.array_equal(several, np.stack([reactions] * 5))


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_with_followers_in_loops(kind):
    """By drives, in lanes and alone, and by other independent coordinates, which have other pivots."""
    p, q, rng = coupled_case(kind, 2)
    m = p.m
    free, other = m.independent(q), m.with_drives([])
    given = list(dict.fromkeys(joint_of(m, i).name for i in free))
    v = m.consistent_velocity(q, rng.normal(size=m.nv), given=given)
    a = m.consistent_acceleration(q, v, rng.normal(size=m.nv), given=given)
    external = {"a1": rng.normal(size=6)}
    tau = m.inverse_dynamics(q, v, a, external)
    mine, forward = m.inverse_dynamics_derivatives(q, v, a, external), m.forward_dynamics_derivatives(q, v, tau, external)
    H = mine[2][free]  # efforts of the drives by their accelerations
    for by, effort in zip(forward, mine[:2]):
        close_to(H @ by[free], -effort[free], 1e-8)
    close_to(H @ forward[2][np.ix_(free, free)], np.eye(len(free)), 1e-8)
    G = along_independent(m, q, other.independent(q))
    by_others = other.forward_dynamics_derivatives(q, v, tau, external)
    close_to(by_others[1], forward[1] @ G[free], 1e-7)
    close_to(by_others[2], forward[2], 1e-8)
    h = 1e-5  # by a position along the mechanism: differences
    j = next(k for k, i in enumerate(free) if joint_of(m, i).kind in COUPLED)
    held = [m.close(q + s * h * (np.arange(m.nq) == joint_of(m, free[j]).q_index), hold=given).q for s in (1, -1)]
    speeds = np.where(np.isin(np.arange(m.nv), free), v, 0)
    at = [(x, m.consistent_velocity(x, speeds, given=given)) for x in held]
    ahead, behind = (m.forward_dynamics(*x, tau, external) for x in at)
    close_to((ahead - behind) / (2 * h), forward[0][:, j], 1e-5)
    several = m.forward_dynamics_derivatives(np.tile(q, (3, 1)), np.tile(v, (3, 1)), np.tile(tau, (3, 1)), external)
    assert all(np.array_equal(D[2], E) for D, E in zip(several, forward))
