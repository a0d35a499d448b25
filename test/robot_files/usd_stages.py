"""Stages of USD that usd-core writes from a model, and whether two models are the same robot."""

import numpy as np
import pytest

import ksl

pxr = pytest.importorskip("pxr")
from pxr import Gf, Usd, UsdGeom, UsdPhysics

from ksl.robot_files.mjcf_frames import pose as pose_of


def quaternion(R):
    from ksl.base.rotations import quaternion_of

    x, y, z, w = (float(v) for v in quaternion_of(R))
    return Gf.Quatf(w, x, y, z)


def random_pose(rng, turn=True):
    X = np.eye(4)
    if turn:
        X = pose_of(rng.normal(size=4), np.zeros(3))
    X[:3, 3] = rng.normal(size=3) * 0.2
    return X


class Writer:
    """Writes a model of KSL as a stage: bodies' frames anywhere, joints' frames anywhere on them."""

    def __init__(self, path, m, seed=0, length=1.0, mass=1.0, up="Z", scale=1.0, swap=(), q=None):
        self.stage, self.m, self.length, self.mass = Usd.Stage.CreateNew(str(path)), m, length, mass
        UsdGeom.SetStageMetersPerUnit(self.stage, length)
        UsdPhysics.SetStageKilogramsPerUnit(self.stage, mass)
        UsdGeom.SetStageUpAxis(self.stage, up)
        self.stage.SetDefaultPrim(UsdGeom.Xform.Define(self.stage, "/robot").GetPrim())
        self.rng, self.scale, self.swap = np.random.default_rng(seed), scale, set(swap)
        self.own = {name: random_pose(self.rng) for name in m.link_names if name != m.root}  # of the stage's frame in the link's
        poses = dict(zip(m.link_names, m.frame_poses(m.neutral() if q is None else q, [f"link:{name}" for name in m.link_names])))
        self.world = {name: poses[name] @ self.own[name] for name in self.own}
        for name in self.own:
            self.body(name)
        for joint in m.joints:
            if joint.parent is not None:
                self.joint(joint)
        self.stage.Save()

    def body(self, name):
        link = self.m.link(name)
        prim = UsdGeom.Xform.Define(self.stage, f"/robot/{name}")
        matrix = self.world[name].copy()
        matrix[:3, 3] /= self.length
        matrix[:3, :3] *= self.scale
        prim.AddTransformOp().Set(Gf.Matrix4d(*matrix.T.ravel().tolist()))
        UsdPhysics.RigidBodyAPI.Apply(prim.GetPrim())
        xx, yy, zz, xy, yz, zx = link.inertia
        c = np.array(link.first_moment) / link.mass
        I = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) - link.mass * (c @ c * np.eye(3) - np.outer(c, c))
        R = self.own[name][:3, :3].T
        moments, axes = np.linalg.eigh(R @ I @ R.T)
        axes *= np.linalg.det(axes)
        api = UsdPhysics.MassAPI.Apply(prim.GetPrim())
        api.CreateMassAttr(link.mass / self.mass)
        api.CreateCenterOfMassAttr(Gf.Vec3f(*(R @ (c - self.own[name][:3, 3]) / self.length / self.scale).tolist()))
        api.CreateDiagonalInertiaAttr(Gf.Vec3f(*(moments / self.mass / self.length**2).tolist()))
        api.CreatePrincipalAxesAttr(quaternion(axes))

    def joint(self, j):
        make = {
            "revolute": UsdPhysics.RevoluteJoint,
            "continuous": UsdPhysics.RevoluteJoint,
            "prismatic": UsdPhysics.PrismaticJoint,
            "fixed": UsdPhysics.FixedJoint,
            "spherical": UsdPhysics.SphericalJoint,
        }[j.kind]
        joint = make.Define(self.stage, f"/robot/{j.name}")
        turn = np.eye(4)  # of the joint's frame, so that the axis is x
        if j.has_axis:
            a = np.array(j.axis)
            other = np.cross(a, self.rng.normal(size=3))
            other /= np.linalg.norm(other)
            turn[:3, :3] = np.column_stack([a, other, np.cross(a, other)])
            joint.CreateAxisAttr("X")
            slide = j.kind == "prismatic"
            unit = self.length if slide else np.pi / 180
            if j.lower is not None:
                joint.CreateLowerLimitAttr(j.lower / unit)
                joint.CreateUpperLimitAttr(j.upper / unit)
            if j.effort:
                drive = UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "linear" if slide else "angular")
                drive.CreateMaxForceAttr(j.effort / self.mass / self.length ** (1 if slide else 2))
        elif j.kind == "spherical":
            turn[:3, :3] = np.linalg.inv(self.own[j.child])[:3, :3].T
        poses = self.m.frame_poses(self.m.neutral(), [f"link:{j.parent}", f"link:{j.child}"])
        at_parent = np.linalg.inv(poses[0]) @ poses[1] @ turn
        sides = [(j.parent, at_parent), (j.child, turn)]
        if j.name in self.swap:
            sides = sides[::-1]
        for k, (name, frame) in enumerate(sides):
            if name in self.own:
                (joint.CreateBody0Rel if k == 0 else joint.CreateBody1Rel)().SetTargets([f"/robot/{name}"])
                frame = np.linalg.inv(self.own[name]) @ frame
            local = frame[:3, 3] / self.length / (self.scale if name in self.own else 1.0)
            (joint.CreateLocalPos0Attr if k == 0 else joint.CreateLocalPos1Attr)(Gf.Vec3f(*local.tolist()))
            (joint.CreateLocalRot0Attr if k == 0 else joint.CreateLocalRot1Attr)(quaternion(frame[:3, :3]))


def bodies_with_mass(m, root_fixed=True):
    """The same robot without massless links, whose stage has a body for each."""
    return [link.name for link in m.links if link.mass]


ARM = """<robot name="arm"><link name="post"/>
{}</robot>"""


def arm(rng):
    """Six joints of three kinds, all links with mass, on the ground."""
    text, parent = "", "post"
    for k, kind in enumerate(("revolute", "prismatic", "continuous", "fixed", "revolute", "prismatic")):
        xyz, rpy, axis, c = (" ".join(f"{x:.6f}" for x in rng.normal(size=3) * s) for s in (0.3, 1.0, 1.0, 0.1))
        text += (
            f'<link name="l{k}"><inertial><origin xyz="{c}"/><mass value="{2 + k}"/><inertia ixx="0.3" iyy="0.4" izz="0.5" ixy="0.02" iyz="0.01" ixz="0.03"/></inertial></link>'
            f'<joint name="j{k}" type="{kind}"><parent link="{parent}"/><child link="l{k}"/><origin xyz="{xyz}" rpy="{rpy}"/>'
            + (f'<axis xyz="{axis}"/>' if kind != "fixed" else "") + ('<limit lower="-1" upper="0.5" effort="40" velocity="3"/>' if kind in ("revolute", "prismatic") else "") + "</joint>"
        )  # fmt: skip
        parent = f"l{k}"
    return ksl.load_string(ARM.format(text))


def same_dynamics(m, other, names, tolerance=2e-6, turned=()):
    """Single precision of the file is what is left.  turned: joints whose positions have the other sign there."""
    rng = np.random.default_rng(1)
    q, v, a = rng.uniform(-0.4, 0.4, size=(3, 5, m.nv))
    sign = np.array([-1.0 if name in turned else 1.0 for name in names])
    order = [other.joint_names.index(name) for name in names]
    assert sorted(order) == list(range(m.nv))
    to = lambda x: np.stack([(sign * x)[:, names.index(name)] for name in other.joint_names], axis=1)
    tau, expected = sign * other.inverse_dynamics(to(q), to(v), to(a))[:, order], m.inverse_dynamics(q, v, a)
    assert np.abs(tau - expected).max() < tolerance * np.abs(expected).max()
    M = np.outer(sign, sign) * other.mass_matrix(to(q))[:, order][:, :, order]
    assert np.abs(M - m.mass_matrix(q)).max() < tolerance * np.abs(m.mass_matrix(q)).max()
