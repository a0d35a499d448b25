"""Mechanisms with loops against values from several independent routes: bodies one by one at 420 bits, multipliers on tree coordinates, planar
equations in closed form, other cuts.  They agree with each other to 6e-14."""

import json
from pathlib import Path

import numpy as np
import pytest

import ksl

FOLDER = Path(__file__).parent / "loops"
CASES = {path.stem: json.loads(path.read_text()) for path in sorted(FOLDER.glob("*.json"))}
MECHANISMS = sorted(name for name in CASES if name != "mobility")
TOLERANCE = 1e-12


def pose(R, p):
    D = np.eye(4)
    D[:3, :3], D[:3, 3] = R, p
    return D


def built(case, drives):
    b = ksl.Builder(case["name"], gravity=case.get("gravity", (0, 0, -9.81))).add_link("world")
    for body in case["bodies"]:
        b.add_link(body["name"], mass=body["mass"], center_of_mass=body["com"], inertia=body["inertia_about_com"])
    more = lambda j: {k: j[k] for k in ("axis", "axis2", "pitch") if j.get(k) is not None}
    for j in case["tree_joints"]:
        b.add_joint(j["name"], j["type"], j["parent"], j["child"], pose=pose(j["parent_R"], j["parent_p"]), **more(j))
    for j in case["loop_joints"]:
        frames = pose(j["predecessor_R"], j["predecessor_p"]), pose(j["successor_R"], j["successor_p"])
        b.add_loop(j["name"], j["type"], j["predecessor"], j["successor"], *frames, **more(j))
    return b.build(drives=drives)


def states():
    for name in MECHANISMS:
        case = CASES[name]
        for k, state in enumerate(case.get("states", [case])):
            yield pytest.param(case, state, id=f"{name}-{k}")


def close_to(x, y, limit=TOLERANCE):
    x, y = np.asarray(x, float), np.asarray(y, float)
    assert x.shape == y.shape and np.isfinite(x).all()
    assert np.abs(x - y).max(initial=0) <= limit * max(1.0, np.abs(y).max(initial=0))


class Numbers:
    """A state in the order of the model: joints are found by name."""

    def __init__(self, case, state):
        self.m = m = built(case, case["actuated"])
        by = {j["name"]: j for j in case["tree_joints"]}
        self.order = np.array([by[name]["idx_v"] for name in m.joint_names])
        self.q, self.v, self.a = (np.array(state[k])[self.order] for k in "qva")
        self.names = [*by, *m.loop_names]
        self.drives = [m.joint_names.index(name) for name in case["actuated"]]

    def wrenches(self, of):
        return np.array([of[name]["value"] if isinstance(of[name], dict) else of[name] for name in self.names])


@pytest.mark.parametrize("case, state", list(states()))
def test_dynamics(case, state):
    n = Numbers(case, state)
    m, q, v, a = n.m, n.q, n.v, n.a
    effort = np.zeros(m.nv)
    effort[n.drives] = np.ravel([state["effort"][name] for name in case["actuated"]])
    close_to(m.loop_error(q), np.zeros(len(m.loop_error(q))))
    close_to(m.inverse_dynamics(q, v, a), effort)
    if "open_tree_effort" in state:
        close_to(m.without_loops().inverse_dynamics(q, v, a), np.array(state["open_tree_effort"])[n.order])
    close_to(m.reactions(q, v, a, joints=n.names), n.wrenches(state["wrench"]))
    unique = np.array([state["wrench"][name]["unique"] if isinstance(state["wrench"][name], dict) else [True] * 6 for name in n.names])
    assert np.array_equal(m.reactions_unique(q, joints=n.names), unique)
    null = np.array([[pattern[name] for name in n.names] for pattern in state.get("null_basis", [])]).reshape(-1, unique.size)
    mine = m.reactions_null_basis(q, joints=n.names).reshape(-1, unique.size)
    assert len(mine) == len(null) == np.linalg.matrix_rank(np.vstack([mine, null]), tol=1e-9)
    tau = np.zeros(m.nv)
    tau[n.drives] = np.ravel(state["forward"]["effort"])
    found = m.forward_dynamics(q, v, tau)
    close_to(found, np.array(state["forward"]["a"])[n.order])
    close_to(m.reactions(q, v, found, joints=n.names), n.wrenches(state["forward"]["wrench"]), 1e-11)
    more = state.get("effort_with_more_drives_least_norm")
    if more:
        wanted = np.zeros(m.nv)
        wanted[[m.joint_names.index(name) for name in more]] = np.ravel(list(more.values()))
        close_to(m.with_drives(list(more)).inverse_dynamics(q, v, a), wanted)


@pytest.mark.parametrize("case, state", list(states()))
def test_geometry_and_derivatives(case, state):
    n = Numbers(case, state)
    m, q, v, a = n.m, n.q, n.v, n.a
    given = case["actuated"]
    kept = np.isin(np.arange(m.nv), n.drives)
    close_to(m.consistent_velocity(q, np.where(kept, v, 1.0), given=given), v)
    close_to(m.consistent_acceleration(q, v, np.where(kept, a, 1.0), given=given), a)
    near = m.close(np.where(kept, q, q + 1e-3), hold=given)
    assert near.converged and near.reason == "closed"
    close_to(near.q, q, 1e-10)
    found = m.mobility(q)
    assert (found.mobility, found.rank, found.redundant) == (case["mobility"], case["rank_of_loop_jacobian"], case["redundant_constraints"])
    assert list(m.independent(q)) == sorted(n.drives)
    if "effort_derivatives" in state:
        columns = [case["independent_velocity_indices"].index(n.order[i]) for i in m.independent(q)]
        for key, D in zip("qva", m.inverse_dynamics_derivatives(q, v, a)):
            close_to(D[n.drives], np.array(state["effort_derivatives"][f"d_{key}"])[:, columns], 1e-8)


@pytest.mark.parametrize("case", CASES["mobility"].get("cases") or CASES["mobility"]["mechanisms"], ids=lambda case: case["name"])
def test_mobility_at_generic_and_singular_positions(case):
    found = built(case, []).mobility(case["q"])
    assert (found.mobility, found.rank, found.redundant) == (case["instantaneous_mobility"], case["rank"], case["redundant_constraints"])
    assert len(found.redundant_rows) == found.redundant and found.next < 1e-12 < 1e-3 < (found.smallest or 1)


def test_what_is_determined_does_not_depend_on_the_cut():
    """One four-bar with a lateral load, cut at C and at B: joint by joint the same wrench in world axes."""
    wrenches = []
    for name in ("fourbar_lateral", "fourbar_lateral_cut_b"):
        n = Numbers(CASES[name], CASES[name].get("states", [CASES[name]])[0])
        names = sorted(n.names)
        wrenches.append(dict(zip(names, n.m.reactions(n.q, n.v, n.a, joints=names, axes="world", at="world"))))
    for joint in wrenches[0]:
        same, opposite = (np.abs(wrenches[0][joint] - sign * wrenches[1][joint]).max() for sign in (1, -1))  # C's child is the other body
        assert min(same, opposite) < 1e-11
