"""KSL against the results of an independent library on real and generated robots.  README.md has the conventions."""

import hashlib
import json
import warnings
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from robots import all_robots

import ksl

HERE = Path(__file__).parent
TOLERANCE = 1e-10

FILES = {
    "panda": "panda_description/urdf/panda.urdf",
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "solo12": "solo_description/robots/solo12.urdf",
    "talos": "talos_data/robots/talos_reduced.urdf",
    "chain8": None,
    "rtree12": None,
}


def error(found, expected) -> float:
    """Largest error; each item, or column, by its own scale over the states, so that a small joint can't hide behind a
    large one, but not below a thousandth of the largest."""
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape, f"shape {found.shape} instead of {expected.shape}"
    axes = (0, *range(2, expected.ndim)) if expected.ndim > 2 else 0
    scale = np.abs(expected).max(axis=axes, keepdims=True)
    return float((np.abs(found - expected) / np.maximum(scale, 1e-3 * max(1.0, np.abs(expected).max()))).max())


class Reference:
    """A robot, its reference results in KSL's order of joints, and the states."""

    def __init__(self, name: str) -> None:
        self.path = HERE / f"{name}.urdf" if FILES[name] is None else all_robots()[FILES[name]]
        described = json.loads((HERE / f"{name}.json").read_text())
        self.sha256 = described["sha256"]
        rows = {("floating_base" if j["type"] == "FF" else j["name"]): (i, j) for i, j in enumerate(described["joints"])}
        self.m = ksl.load(self.path, floating_base="floating_base" in rows, mimic="independent")
        assert sorted(self.m.joint_names) == sorted(rows), "the moving joints are not those of the reference"
        data = np.load(HERE / f"{name}.npz")
        self.joints = [rows[n][1] for n in self.m.joint_names]
        order = [rows[n][0] for n in self.m.joint_names]
        in_v = np.concatenate([np.arange(j["idx_v"], j["idx_v"] + j["nv"]) for j in self.joints])
        in_q = np.concatenate([np.arange(j["idx_q"], j["idx_q"] + j["nq"]) for j in self.joints])
        manifold = np.load(HERE / "manifold.npz")
        self.integrated, self.differences = manifold[f"{name}_integrate"][:, in_q], manifold[f"{name}_difference"][:, in_v]
        self.of_v = {key: data[key][:, in_v] for key in ("v", "a", "rnea", "rnea_fext")}
        self.of_joint = {key: data[key][:, order] for key in ("joint_reaction", "fext", "joint_R", "joint_p")}
        of_joint = {row: name for name, (row, _) in rows.items()}
        self.jacobian_joints = [of_joint[int(row)] for row in data["jacobian_joints"]]
        self.jacobians = {key: data[f"J_{key}"][..., in_v] for key in ("local", "world", "lwa")}
        self.energy = data["kinetic_energy"], data["potential_energy"]
        self.state = data["q"][:, in_q], self.of_v["v"], self.of_v["a"]
        self.children = [self.m.joint(n).child for n in self.m.joint_names]

    def subspace(self, i: int) -> np.ndarray:
        """S (6, n) of moving joint i as the reference describes it, linear first."""
        j = self.joints[i]
        if j["type"] == "FF":
            return np.eye(6)
        zero = [0.0, 0.0, 0.0]
        return np.array([*j["axis"], *zero] if j["type"].startswith("P") else [*zero, *j["axis"]])[:, None]


@pytest.fixture(scope="module", params=FILES)
def r(request) -> Reference:
    return Reference(request.param)


def test_the_results_belong_to_this_file(r):
    assert hashlib.sha256(r.path.read_bytes()).hexdigest() == r.sha256, f"{r.path} has changed since the results were made"


def test_efforts(r):
    assert error(r.m.inverse_dynamics(*r.state), r.of_v["rnea"]) < TOLERANCE


def test_efforts_of_one_state(r):
    one = [x[0] for x in r.state]
    assert error(r.m.inverse_dynamics(*one)[None], r.of_v["rnea"][:1]) < TOLERANCE


def test_efforts_under_external_wrenches(r):
    external = {child: r.of_joint["fext"][:, i] for i, child in enumerate(r.children)}
    assert error(r.m.inverse_dynamics(*r.state, external=external), r.of_v["rnea_fext"]) < TOLERANCE


def test_reactions(r):
    assert error(r.m.reactions(*r.state), r.of_joint["joint_reaction"]) < TOLERANCE


def test_reactions_in_world_axes(r):
    R, w = r.of_joint["joint_R"], r.of_joint["joint_reaction"]
    turned = np.concatenate([np.einsum("sjab,sjb->sja", R, x) for x in (w[..., :3], w[..., 3:])], axis=-1)
    assert error(r.m.reactions(*r.state, axes="world"), turned) < TOLERANCE


def test_reactions_about_the_worlds_origin(r):
    R, p, w = r.of_joint["joint_R"], r.of_joint["joint_p"], r.of_joint["joint_reaction"]
    f, t = (np.einsum("sjab,sjb->sja", R, x) for x in (w[..., :3], w[..., 3:]))
    assert error(r.m.reactions(*r.state, axes="world", at="world"), np.concatenate([f, t + np.cross(p, f)], axis=-1)) < TOLERANCE


def test_split(r):
    total, held, driven = (r.m.reactions(*r.state, part=part) for part in ("total", "constraint", "actuation"))
    assert error(held + driven, total) < TOLERANCE
    for i, name in enumerate(r.m.joint_names):
        S = r.subspace(i)
        assert np.abs(held[:, i] @ S).max() < TOLERANCE * max(1.0, np.abs(total[:, i]).max()), f"the constraint of {name} works"
    efforts = np.concatenate([driven[:, i] @ r.subspace(i) for i in range(len(r.joints))], axis=1)
    assert error(efforts, r.of_v["rnea"]) < TOLERANCE


def test_parent_side_and_order(r):
    w = r.of_joint["joint_reaction"]
    assert error(r.m.reactions(*r.state, on="parent"), -w) < TOLERANCE
    assert error(r.m.reactions(*r.state, order="ang_lin"), np.concatenate([w[..., 3:], w[..., :3]], axis=-1)) < TOLERANCE


def test_poses(r):
    for i, child in enumerate(r.children):
        T = r.m.frame_pose(r.state[0], child)
        assert np.abs(T[:, :3, :3] - r.of_joint["joint_R"][:, i]).max() < TOLERANCE, child
        assert np.abs(T[:, :3, 3] - r.of_joint["joint_p"][:, i]).max() < TOLERANCE, child


@pytest.mark.parametrize("key, axes, at", [("local", "frame", "frame"), ("world", "world", "world"), ("lwa", "world", "frame")])
def test_jacobians(r, key, axes, at):
    found = np.stack([r.m.jacobian(r.state[0], name, axes=axes, at=at) for name in r.jacobian_joints], axis=1)
    assert error(found, r.jacobians[key]) < TOLERANCE


def test_energies(r):
    kinetic, potential = r.m.energy(*r.state[:2])
    assert error(kinetic, r.energy[0]) < TOLERANCE
    # the reference leaves out links that are welded to the ground: compare differences
    assert error(potential - potential[0], r.energy[1] - r.energy[1][0]) < TOLERANCE


def test_integration(r):
    assert error(r.m.integrate(r.state[0], 0.1 * r.state[1]), r.integrated) < 1e-12


def test_differences(r):
    q = r.state[0]
    assert error(r.m.difference(q[:-1], q[1:]), r.differences) < 1e-11  # the condition of a logarithm near half a turn


# Files that describe no robot: {file: words of the refusal}.
REFUSED = {"ur_description/urdf/ur3.urdf": "no <link>"}  # an empty shell around a xacro
CLOSED = {"pr2_description/urdf/pr2.urdf": "<joint:hinge> names links r_gripper_r_finger_tip_link, r_gripper_r_parallel_link.*loops=.cut."}
"""Refused as well: joints of Gazebo close the loops of its grippers; the tree without them is a robot like the others."""


@pytest.mark.parametrize("name", all_robots())
def test_every_robot_of_the_package(name):
    """Each file loads and gives finite results whose parts add up, and the ground carries the weight; or it is refused in
    a sentence that names the file."""
    path = all_robots()[name]
    refused = (REFUSED | CLOSED).get(name)
    if refused is not None:
        with pytest.raises(ksl.DescriptionError, match=refused) as refusal:
            ksl.load(path, mimic="independent")
        assert path.name in str(refusal.value) and "\n" not in str(refusal.value)
    if name in REFUSED:
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ksl.DescriptionWarning)
        m = ksl.load(path, mimic="independent", loops="cut" if name in CLOSED else None)
    rng = np.random.default_rng(0)
    q, v, a = rng.uniform(-1, 1, (3, m.nq)), rng.normal(size=(3, m.nv)), rng.normal(size=(3, m.nv))
    for j in m.joints:
        if j.kind == "floating":
            q[:, j.q_index + 3 : j.q_index + 7] = [0, 0.6, 0, 0.8]
    names = [j.name for j in m.joints]
    total, held, driven = (m.reactions(q, v, a, joints=names, part=part) for part in ("total", "constraint", "actuation"))
    assert np.isfinite(total).all() and np.isfinite(m.inverse_dynamics(q, v, a)).all()
    assert np.abs(held + driven - total).max() < 1e-12 * max(1.0, np.abs(total).max())
    tau = m.inverse_dynamics(q, v, a)
    for i, j in enumerate(m.joints):
        if j.has_axis:
            assert driven[:, i].reshape(-1, 2, 3)[:, 0 if j.kind == "prismatic" else 1] @ np.array(j.axis) == pytest.approx(
                tau[:, j.v_index], rel=1e-9, abs=1e-9
            )
    ground = m.reactions(q, 0 * v, 0 * a, joints=[names[-1]], axes="world")[:, 0, :3]
    assert ground == pytest.approx(np.tile([0, 0, 9.81 * sum(link.mass for link in m.links)], (3, 1)), rel=1e-9, abs=1e-9)
    children = {e.find("child").get("link") for e in ET.parse(path).getroot().findall("joint")}
    assert children == {j.child for j in m.joints if j.parent is not None}, "a joint was lost"
