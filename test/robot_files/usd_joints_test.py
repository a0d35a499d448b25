"""Joints of USD: several between the same two bodies, held against the product of their motions."""

import numpy as np
import pytest

import ksl

pytest.importorskip("pxr")

HEAD = """#usda 1.0
(
 metersPerUnit = 1
 upAxis = "Z"
)
def Xform "r" ( apiSchemas = [{}] )
{{
 {}
 def Xform "a" ( apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"] )
 {{
  float physics:mass = 1
  float3 physics:diagonalInertia = (1, 1, 1)
  point3f physics:centerOfMass = (0, 0, 0)
 }}
"""
JOINT = """ def Physics{}Joint "{}"
 {{
  rel physics:body{} = </r/a>
  uniform token physics:axis = "{}"
  point3f physics:localPos0 = ({}, 0, 0)
  point3f physics:localPos1 = ({}, 0, 0)
 }}
"""
STACKED = '"PhysicsArticulationRootAPI", "NewtonArticulationRootAPI"', "uniform bool newton:jointsAddMobility = true"
AXES = dict(zip("XYZ", np.eye(3)))


def motion(kind: str, axis: np.ndarray, x: float, at: float) -> np.ndarray:
    """About or along an axis through (at, 0, 0)."""
    X, K = np.eye(4), np.cross(np.eye(3), axis)
    if kind == "Prismatic":
        X[:3, 3] = x * axis
        return X
    X[:3, :3] = np.eye(3) + np.sin(x) * K + (1 - np.cos(x)) * K @ K
    X[:3, 3] = (np.eye(3) - X[:3, :3]) @ [at, 0, 0]
    return X


@pytest.mark.parametrize("which", ["Revolute X Revolute Y", "Prismatic X Revolute Z Prismatic Y", "Revolute Z Prismatic Z Revolute Y"])
def test_joints_between_two_bodies_add_freedoms_where_the_file_says_so(tmp_path, which):
    words = which.split()
    stack = list(zip(words[::2], words[1::2], (0.3, -0.2, 0.5)))
    joints = "".join(JOINT.format(kind, f"j{k}", 1, axis, at, at) for k, (kind, axis, at) in enumerate(stack))
    (tmp_path / "a.usda").write_text(HEAD.format(*STACKED) + joints + "}\n")
    m = ksl.load(tmp_path / "a.usda")
    assert m.joint_names == [f"j{k}" for k in range(len(stack))] and not m.loops and not m.warnings and not m.unused
    q = np.array([0.4, -0.7, 0.3])[: m.nv]
    expected = np.linalg.multi_dot([motion(kind, AXES[axis], x, at) for (kind, axis, at), x in zip(stack, q)])
    assert np.allclose(m.frame_pose(q, "a"), expected, atol=1e-6) and m.mass == 1.0


@pytest.mark.parametrize("head", [("", ""), (STACKED[0], "")])
def test_joints_between_two_bodies_hold_them_otherwise_and_that_is_said(tmp_path, head):
    (tmp_path / "a.usda").write_text(HEAD.format(*head) + JOINT.format("Revolute", "one", 1, "X", 0, 0) + JOINT.format("Revolute", "two", 1, "Y", 0, 0) + "}\n")
    with pytest.warns(ksl.DescriptionWarning, match="joint two: is between the same bodies as joint one, and holds them, too.*newton:jointsAddMobility"):
        assert [loop.name for loop in ksl.load(tmp_path / "a.usda").loops] == ["two"]
    turned = JOINT.format("Revolute", "one", 1, "X", 0, 0) + JOINT.format("Revolute", "two", 0, "Y", 0, 0)
    (tmp_path / "a.usda").write_text(HEAD.format(*STACKED) + turned + "}\n")
    with pytest.warns(ksl.DescriptionWarning, match="joint two: is between the same bodies as joint one"):
        ksl.load(tmp_path / "a.usda")
