"""USD: stages that usd-core writes, against the same robot in URDF; units, axes, loops, and what is said of the rest."""

import re
import sys

import numpy as np
import pytest
from ksl_command import run_ksl

import ksl

pxr = pytest.importorskip("pxr")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

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


@pytest.mark.parametrize("end", ["usda", "usdc"])
@pytest.mark.parametrize(
    "options",
    [{}, {"length": 0.01}, {"length": 0.01, "mass": 0.001, "scale": 2.5}, {"swap": ("j0", "j1", "j3", "j4")}],
    ids=["metres", "centimetres", "centimetres, grams, scaled", "bodies the other way round"],
)
def test_a_stage_is_the_same_robot(tmp_path, end, options):
    m = arm(np.random.default_rng(5))
    Writer(tmp_path / f"arm.{end}", m, **options)
    found = ksl.load(tmp_path / f"arm.{end}")
    assert found.name == "robot" and found.joint_names == m.joint_names and found.mass == pytest.approx(m.mass, rel=1e-6)
    same_dynamics(m, found, m.joint_names, turned=options.get("swap", ()))
    for name in m.joint_names:
        ours, theirs = m.joint(name), found.joint(name)
        assert (
            theirs.kind == ours.kind
            and (theirs.effort is None or theirs.effort == pytest.approx(ours.effort, rel=1e-6))
            and (theirs.effort is None) == (ours.effort is None)
        )
        assert (theirs.lower is None) == (ours.lower is None) and (
            ours.lower is None or (theirs.lower, theirs.upper) == pytest.approx((ours.lower, ours.upper), rel=1e-6)
        )
    said = "\n".join(found.warnings)
    assert ("lengths are in units of 0.01 m (metersPerUnit), converted to m" in said) == ("length" in options)
    assert ("masses are in units of 0.001 kg" in said) == ("mass" in options) and ("body1 carries body0" in said) == ("swap" in options)
    assert "stand where it doesn't let them" not in said


def test_units_and_axes_that_are_not_given_are_said(tmp_path):
    m = arm(np.random.default_rng(5))
    w = Writer(tmp_path / "arm.usda", m, length=0.01, up="Y")
    w.stage.ClearMetadata("metersPerUnit")
    w.stage.Save()
    with pytest.warns(ksl.DescriptionWarning, match="the file doesn't give metersPerUnit; lengths are taken in centimetres"):
        found = ksl.load(tmp_path / "arm.usda")
    assert tuple(found.gravity) == (0.0, -9.81, 0.0) and any("up is the axis Y" in line for line in found.warnings)
    same_dynamics(m.with_gravity((0, -9.81, 0)), found, m.joint_names)
    scene = UsdPhysics.Scene.Define(w.stage, "/scene")
    scene.CreateGravityDirectionAttr(Gf.Vec3f(1, 0, 0))
    scene.CreateGravityMagnitudeAttr(162.0)
    w.stage.Save()
    assert tuple(ksl.load(tmp_path / "arm.usda").gravity) == pytest.approx((1.62, 0, 0))
    assert ksl.load(tmp_path / "arm.usda", gravity=(0, 0, -1)).gravity[2] == -1
    scene.GetGravityMagnitudeAttr().Set(9.81)
    w.stage.Save()
    with pytest.warns(ksl.DescriptionWarning, match=r"gravity is 0.0981 m/s², 9.81 in units of 0.01 m: give 981 if it is the Earth's"):
        ksl.load(tmp_path / "arm.usda")


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_layers_in_other_units_are_said(tmp_path):
    """As of a robot in centimetres that a scene in metres refers to: a hundred times as long."""
    own = 'metersPerUnit = 0.01\n kilogramsPerUnit = 0.001\n upAxis = "Y"\n'
    inner = f'#usda 1.0\n(\n {own} defaultPrim = "r"\n)\ndef "r"\n{{\n def "a" ( apiSchemas = ["PhysicsRigidBodyAPI"] )\n {{\n }}\n}}\n'
    (tmp_path / "inner.usda").write_text(inner)
    refer = "\n)\n" + 'def "x" ( references = @./inner.usda@ )\n{\n}\n'
    sublayer = "\n subLayers = [@./inner.usda@]\n)\n"
    for units, by, times in (('metersPerUnit = 1\n upAxis = "Z"', refer, 1), ("metersPerUnit = 1", sublayer, 1), (own, refer, 0), (own, sublayer, 0)):
        (tmp_path / "top.usda").write_text(f"#usda 1.0\n(\n {units}{by}")
        said = [line for line in ksl.load(tmp_path / "top.usda", masses="optional").warnings if line.startswith("layer inner.usda gives")]
        assert len(said) == times and all("metersPerUnit = 0.01, and the stage 1; kilogramsPerUnit = 0.001, and the stage 1" in line for line in said)


def test_gravity_points_down_the_axis_that_is_up(tmp_path):
    for up, gravity in (("Y", (0, -9.81, 0)), ("Z", (0, 0, -9.81))):
        Writer(tmp_path / f"{up}.usda", arm(np.random.default_rng(5)), up=up)
        assert tuple(ksl.load(tmp_path / f"{up}.usda").gravity) == gravity


def test_bodies_that_nothing_carries_float(tmp_path):
    m = arm(np.random.default_rng(5))
    w = Writer(tmp_path / "arm.usda", m)
    w.stage.RemovePrim("/robot/j0")
    w.stage.Save()
    found = ksl.load(tmp_path / "arm.usda", floating_base=True)
    assert found.joint_names[0] == "floating_base" and found.nv == m.nv - 1 + 6 and found.mass == pytest.approx(m.mass)
    np.testing.assert_allclose(found.frame_pose(found.neutral(), "link:l0"), w.world["l0"], atol=1e-6)
    w.stage.RemovePrim("/robot/j4")
    w.stage.Save()
    assert {"l0_floating", "l4_floating"} < set(ksl.load(tmp_path / "arm.usda").joint_names)
    Writer(tmp_path / "fixed.usda", m)
    with pytest.raises(ksl.DescriptionError, match="fixed.usda: a floating base is asked for, but joints connect all bodies to the world"):
        ksl.load(tmp_path / "fixed.usda", floating_base=True)


FOUR_BAR = """<robot name="four-bar"><link name="ground"/>
{}{}{}
<joint name="A" type="continuous"><parent link="ground"/><child link="crank"/><axis xyz="0 1 0"/></joint>
<joint name="B" type="continuous"><parent link="crank"/><child link="coupler"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/></joint>
<joint name="D" type="continuous"><parent link="ground"/><child link="rocker"/><origin xyz="0.6 0 0"/><axis xyz="0 1 0"/></joint>{}</robot>"""
LINK = (
    '<link name="{}"><inertial><origin xyz="0.2 0 0"/><mass value="1"/><inertia ixx="0.002" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>'
)
LINKS = [LINK.format(name) for name in ("crank", "coupler", "rocker")]
CLOSED = '<constraint name="C" type="revolute"><parent link="coupler"/><parent_origin xyz="0.6 0 0"/><parent_axis xyz="0 1 0"/><child link="rocker"/><child_origin xyz="0.5 0 0"/><child_axis xyz="0 1 0"/></constraint>'


@pytest.mark.parametrize("excluded", [True, False])
def test_joints_that_close_loops(tmp_path, excluded):
    tree, closed = (ksl.load_string(FOUR_BAR.format(*LINKS, more)) for more in ("", CLOSED))
    q = closed.close(np.array([1.0, 0.5, 1.0]), hold=["A"]).q
    w = Writer(tmp_path / "bars.usda", tree, q=q)
    joint = UsdPhysics.RevoluteJoint.Define(w.stage, "/robot/C")
    joint.CreateAxisAttr("Y")
    joint.CreateExcludeFromArticulationAttr(excluded)
    for k, (name, x) in enumerate((("coupler", 0.6), ("rocker", 0.5))):
        frame = np.eye(4)
        frame[0, 3] = x
        frame = np.linalg.inv(w.own[name]) @ frame
        (joint.CreateBody0Rel if k == 0 else joint.CreateBody1Rel)().SetTargets([f"/robot/{name}"])
        (joint.CreateLocalPos0Attr if k == 0 else joint.CreateLocalPos1Attr)(Gf.Vec3f(*frame[:3, 3].tolist()))
        (joint.CreateLocalRot0Attr if k == 0 else joint.CreateLocalRot1Attr)(quaternion(frame[:3, :3]))
    UsdPhysics.DriveAPI.Apply(w.stage.GetPrimAtPath("/robot/A"), "angular")
    w.stage.Save()
    found = ksl.load(tmp_path / "bars.usda")
    assert found.loop_names == ["C"] and list(found.drives or ()) == ["A"]
    said = "\n".join(found.warnings)
    assert ("closes a loop, and excludeFromArticulation doesn't say so" in said) != excluded
    assert "its bodies stand where it doesn't let them" not in said
    v = closed.consistent_velocity(q, np.array([2.0, 0, 0]), given=["A"])
    a = closed.consistent_acceleration(q, v, np.array([3.0, 0, 0]), given=["A"])
    order = [closed.joint_names.index(name) for name in found.joint_names]
    assert np.abs(found.loop_error(q[order])).max() < 1e-6 and found.mobility(found.close(q[order], hold=["A"]).q).mobility == 1
    expected = closed.with_drives(["A"]).inverse_dynamics(q, v, a)
    q, v, a = (x[order] for x in (q, v, a))
    v = found.consistent_velocity(q, v, given=["A"])
    np.testing.assert_allclose(found.inverse_dynamics(q, v, found.consistent_acceleration(q, v, a, given=["A"])), expected[order], rtol=1e-5, atol=1e-5)
    cut = ksl.load(tmp_path / "bars.usda", loops="cut")
    assert not cut.loops
    same_dynamics(tree, cut, tree.joint_names)


def test_joints_of_six_freedoms(tmp_path):
    m = arm(np.random.default_rng(5))
    w = Writer(tmp_path / "arm.usda", m)
    old = w.stage.GetPrimAtPath("/robot/j0")
    axis = {f"physics:{name}": old.GetAttribute(f"physics:{name}").Get() for name in ("localPos0", "localPos1", "localRot0", "localRot1")}
    targets = UsdPhysics.Joint(old).GetBody1Rel().GetTargets()

    def six(*free, limits=(-30.0, 60.0), locked=(1.0, -1.0)):
        w.stage.RemovePrim("/robot/j0")
        joint = UsdPhysics.Joint.Define(w.stage, "/robot/j0")
        joint.CreateBody1Rel().SetTargets(targets)
        for name, value in axis.items():
            joint.GetPrim().GetAttribute(name).Set(value)
        for freedom in ("transX", "transY", "transZ", "rotX", "rotY", "rotZ"):
            limit = UsdPhysics.LimitAPI.Apply(joint.GetPrim(), freedom)
            for end, value in zip((limit.CreateLowAttr, limit.CreateHighAttr), limits if freedom in free else locked):
                if value is not None:
                    end(value)
        w.stage.Save()
        return ksl.load(tmp_path / "arm.usda")

    found = six("rotX")
    assert found.joint("j0").kind == "revolute" and (found.joint("j0").lower, found.joint("j0").upper) == pytest.approx((-np.pi / 6, np.pi / 3))
    same_dynamics(m, found, m.joint_names)
    assert six().joint("j0").kind == six(locked=(0.0, 0.0)).joint("j0").kind == "fixed"
    assert six("rotX", locked=(0.0, 0.0)).joint("j0").kind == "revolute" and six("rotX", limits=(30.0, 30.0)).joint("j0").lower == pytest.approx(np.pi / 6)
    with pytest.raises(ksl.DescriptionError, match=r"joint j0: is held in rotX \(at 30\), rotY \(at 30\) by limits that are the same"):
        six("rotX", "rotY", limits=(30.0, 30.0))
    for limits, known in (((-30.0, 60.0), True), ((None, 60.0), True), ((-np.inf, np.inf), False), ((None, None), False)):
        ball = six("rotX", "rotY", "rotZ", limits=limits)
        assert (
            ball.joint("j0").kind == "spherical"
            and ("limits of joint j0 in rotX, rotY, rotZ: those of revolute and prismatic joints are read" in ball.unused) == known
        )
    for of, rows in ("rot", slice(3, 6)), ("trans", slice(3)):  # the axes of a right-handed frame
        along = [r.jacobian(r.neutral(), f"link:{r.joint('j0').child}", axes="world")[rows, 0] for r in (six(f"{of}{axis}") for axis in "XYZ")]
        assert np.abs(np.cross(along[0], along[1:]) - [along[2], -along[1]]).max() < 1e-6
    for limits, more in (((-np.inf, np.inf), ""), ((-30.0, 60.0), ", as if within the limits of transX, transY, transZ, rotX, rotY, rotZ")):
        assert f"joint j0 (all of its freedoms are free{more})" in six("transX", "transY", "transZ", "rotX", "rotY", "rotZ", limits=limits).unused
    assert six("rotX", "transX").joint("j0").kind == "cylindrical" and six("transX", "transY", "transZ").joint("j0").kind == "translation"
    with pytest.raises(ksl.DescriptionError, match="joint j0: is free in rotX, rotY, which no kind of joint is; lock some of them"):
        six("rotX", "rotY")


def test_masses_that_are_missing_are_said(tmp_path):
    w = Writer(tmp_path / "arm.usda", arm(np.random.default_rng(5)))
    for name in ("l1", "l2", "l3"):
        w.stage.GetPrimAtPath(f"/robot/{name}").RemoveProperty({"l1": "physics:mass", "l2": "physics:centerOfMass", "l3": "physics:diagonalInertia"}[name])
    w.stage.Save()
    with pytest.warns(ksl.DescriptionWarning):
        said = "\n".join(ksl.load(tmp_path / "arm.usda").warnings)
    for line in ("link l1: no physics:mass; simulators compute it", "link l2: no physics:centerOfMass", "link l3: no physics:diagonalInertia"):
        assert line in said


def test_masses_of_parts_are_those_of_the_body(tmp_path):
    w = Writer(tmp_path / "arm.usda", arm(np.random.default_rng(5)))
    w.stage.GetPrimAtPath("/robot/l2").RemoveAPI(UsdPhysics.MassAPI)
    for k, (mass, x) in enumerate(((1.0, -0.1), (3.0, 0.1))):
        part = UsdGeom.Cube.Define(w.stage, f"/robot/l2/part{k}")
        part.AddTranslateOp().Set(Gf.Vec3d(x, 0, 0))
        UsdPhysics.CollisionAPI.Apply(part.GetPrim())
        api = UsdPhysics.MassAPI.Apply(part.GetPrim())
        api.CreateMassAttr(mass)
        api.CreateCenterOfMassAttr(Gf.Vec3f(0, 0, 0))
        api.CreateDiagonalInertiaAttr(Gf.Vec3f(0.01, 0.02, 0.03))
    w.stage.Save()
    link = ksl.load(tmp_path / "arm.usda").link("l2")
    assert link.mass == 4.0 and np.allclose(link.first_moment, (0.2, 0, 0)) and np.allclose(link.inertia[:3], (0.02, 0.08, 0.1))


def test_numbers_of_physx(tmp_path):
    """Raw attributes: their schema is not a part of usd-core."""
    w = Writer(tmp_path / "arm.usda", arm(np.random.default_rng(5)), length=0.01)
    for name, velocity, armature in (("j0", 1.8, 500.0), ("j1", 50.0, 0.7), ("j4", 1e6, 0.0)):
        prim = w.stage.GetPrimAtPath(f"/robot/{name}")
        prim.CreateAttribute("physxJoint:maxJointVelocity", Sdf.ValueTypeNames.Float).Set(velocity)
        prim.CreateAttribute("physxJoint:armature", Sdf.ValueTypeNames.Float).Set(armature)
    w.stage.Save()
    m = ksl.load(tmp_path / "arm.usda")
    turns, slides, none = (m.joint(name) for name in ("j0", "j1", "j4"))
    assert (turns.velocity, turns.armature) == pytest.approx((np.pi / 100, 0.05)) and (slides.velocity, slides.armature) == pytest.approx((0.5, 0.7))
    assert none.velocity is None and none.armature == 0.0


def test_what_is_not_carried(tmp_path):
    w = Writer(tmp_path / "arm.usda", arm(np.random.default_rng(5)))
    UsdPhysics.DistanceJoint.Define(w.stage, "/robot/rope").CreateBody1Rel().SetTargets(["/robot/l3"])
    off = UsdPhysics.FixedJoint.Define(w.stage, "/robot/off")
    off.CreateBody1Rel().SetTargets(["/robot/l4"])
    off.CreateJointEnabledAttr(False)
    w.stage.Save()
    assert {"joint rope: a distance joint, as if its bodies were within its limits", "joint off (not enabled)"} <= set(ksl.load(tmp_path / "arm.usda").unused)


@pytest.mark.parametrize(
    ("least", "most", "holds"), [(-1, 30, False), (20, 30, False), (20, -1, False), (30, 30, True), (40, 30, True), (-1, 0, True), (0.05, 0.05, True)]
)
def test_a_rod_is_refused_and_a_rope_is_not(tmp_path, least, most, holds):
    w = Writer(tmp_path / "arm.usda", arm(np.random.default_rng(5)), length=0.01)
    rod = UsdPhysics.DistanceJoint.Define(w.stage, "/robot/rod")
    rod.CreateBody1Rel().SetTargets(["/robot/l3"])
    rod.CreateMinDistanceAttr(float("nan"))
    rod.CreateMaxDistanceAttr(30)
    w.stage.Save()
    with pytest.raises(ksl.DescriptionError, match="joint rod: its minDistance or maxDistance is no number"):
        ksl.load(tmp_path / "arm.usda")
    rod.CreateMinDistanceAttr(least)
    rod.CreateMaxDistanceAttr(most)
    w.stage.Save()
    if holds:
        with pytest.raises(ksl.DescriptionError, match=f"joint rod: holds its bodies {most / 100:g} m apart"):
            ksl.load(tmp_path / "arm.usda")
    else:
        assert any(said.startswith("joint rod") for said in ksl.load(tmp_path / "arm.usda").unused)


@pytest.mark.parametrize("scale", [(2, 2, 2), (1, 2, 3), (-1, 1, 1)])
def test_masses_of_scaled_bodies_are_those_that_usd_computes(tmp_path, scale):
    """Its own library scales centres of mass, and no tensor of inertia."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "body.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    body = UsdGeom.Xform.Define(stage, "/body")
    body.AddScaleOp().Set(Gf.Vec3f(*scale))
    UsdPhysics.RigidBodyAPI.Apply(body.GetPrim())
    api = UsdPhysics.MassAPI.Apply(body.GetPrim())
    api.CreateMassAttr(3.0)
    api.CreateCenterOfMassAttr(Gf.Vec3f(0.1, 0.2, 0.3))
    api.CreateDiagonalInertiaAttr(Gf.Vec3f(0.5, 0.6, 0.7))
    api.CreatePrincipalAxesAttr(Gf.Quatf(1))
    stage.Save()
    mass, moments, centre, _ = UsdPhysics.RigidBodyAPI(body.GetPrim()).ComputeMassProperties(lambda prim: None)
    link = ksl.load(tmp_path / "body.usda").link("body")
    c = np.array(centre)
    I = np.diag(moments) + mass * (c @ c * np.eye(3) - np.outer(c, c))
    assert np.allclose([*link.first_moment, *link.inertia], [*(mass * c), *np.diag(I), I[0, 1], I[1, 2], I[2, 0]], rtol=1e-6, atol=1e-9)


def test_points_of_sheared_prims_are_said(tmp_path):
    """Scales that differ above a turn: USD's own parser multiplies such points by three scales, which is no place of the prim's."""
    text = """def Xform "r"
{
  float3 xformOp:scale = (1, 2, 1)
  float xformOp:rotateZ = {}
  uniform token[] xformOpOrder = ["xformOp:scale", "xformOp:rotateZ"]
  def Xform "a" ( prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"] )
  {
    float physics:mass = 1
    point3f physics:centerOfMass = (1, 0, 0)
  }
}"""
    for turn, times in (("30", 1), ("0", 0)):
        (tmp_path / "a.usda").write_text("#usda 1.0\n( metersPerUnit = 1\n)\n" + text.replace("{}", turn))
        assert sum("shear its space" in line for line in ksl.load(tmp_path / "a.usda").warnings) == times


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda s: s.GetPrimAtPath("/robot/j1").GetRelationship("physics:body0").SetTargets(["/nowhere"]),
            "joint j1: physics:body0 is /nowhere, and no such prim",
        ),
        (lambda s: s.GetPrimAtPath("/robot/j1").GetRelationship("physics:body0").SetTargets(["/robot/l0", "/robot/l2"]), "physics:body0 names 2 prims"),
        (lambda s: s.RemovePrim("/robot"), "no rigid body"),
    ],
)
def test_what_is_refused(tmp_path, change, said):
    w = Writer(tmp_path / "arm.usda", arm(np.random.default_rng(5)))
    change(w.stage)
    w.stage.Save()
    with pytest.raises(ksl.DescriptionError, match=said.replace("(", r"\(")) as e:
        ksl.load(tmp_path / "arm.usda")
    assert str(e.value).startswith(f"{tmp_path / 'arm.usda'}: ")


def test_values_of_other_types_are_refused(tmp_path):
    w = Writer(tmp_path / "arm.usda", arm(np.random.default_rng(5)))
    text = (tmp_path / "arm.usda").read_text()
    for was, becomes in (
        ("float physics:mass = 2", 'token[] physics:mass = ["a"]'),
        ("xformOp:transform", "xformOp:trnsform"),
        ("quatf physics:localRot0", "dummy physics:localRot0"),
    ):
        (tmp_path / "bad.usda").write_text(text.replace(was, becomes))
        with pytest.raises(ksl.DescriptionError, match="bad.usda: "):
            ksl.load(tmp_path / "bad.usda")
    rng = np.random.default_rng(0)
    for k in range(40):
        data = bytearray(text.encode())
        for i in rng.integers(8, len(data), size=3):
            data[i] = int(rng.choice(list(b'0123456789.-"()[]{}=,abcxyz \n')))
        (tmp_path / f"{k}.usda").write_bytes(bytes(data))
        try:
            ksl.load(tmp_path / f"{k}.usda")
        except ksl.DescriptionError as e:
            assert "\n" not in str(e)
    assert w.stage


def test_a_default_prim_that_is_missing_or_no_name(tmp_path):
    stage = (
        "#usda 1.0\n(\n    defaultPrim = {}\n    metersPerUnit = 1\n)\n"
        + 'def Xform "r"\n{{\n    def Xform "a" (prepend apiSchemas = ["PhysicsRigidBodyAPI"])\n    {{\n    }}\n}}\n'
    )
    path = tmp_path / "arm.usda"
    path.write_text(stage.format('"nobody"'))
    assert ksl.load(path, masses="optional").name == "arm"
    for bad in (b'{ string a = "b" }', b'"\xff"'):
        path.write_bytes(stage.format("?").encode().replace(b"?", bad))
        with pytest.raises(ksl.DescriptionError, match="arm.usda: USD .*; correct it, or write it again$"):
            ksl.load(path, masses="optional")


def test_damaged_files_and_no_package(tmp_path, monkeypatch):
    for text in (b"#usda 1.0\n( garbage", b"PXR-USDC" + bytes(200)):
        (tmp_path / "bad.usd").write_bytes(text)
        with pytest.raises(ksl.DescriptionError, match="bad.usd: "):
            ksl.load(tmp_path / "bad.usd")
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(ksl.DescriptionError, match=r"this is USD, which is read by the package usd-core; install it with: pip install 'ksl\[usd\]'"):
        ksl.load(tmp_path / "bad.usd")


def test_the_command_and_layers_that_it_uses(tmp_path):
    Writer(tmp_path / "arm.usdc", arm(np.random.default_rng(5)))
    top = Usd.Stage.CreateNew(str(tmp_path / "top.usda"))
    UsdGeom.SetStageMetersPerUnit(top, 1.0)
    UsdGeom.SetStageUpAxis(top, "Z")
    prim = top.DefinePrim("/cell")
    prim.GetReferences().AddReference("./arm.usdc")
    top.SetDefaultPrim(prim)
    top.Save()
    found = ksl.load(tmp_path / "top.usda")
    assert [(f.role, f.file.rpartition("/")[2]) for f in found.inputs] == [("robot", "top.usda"), ("included", "arm.usdc")]
    done = run_ksl("info", tmp_path / "top.usda")
    assert done.returncode == 0 and "cell" in done.stdout and "moving joints 5" in done.stdout
    assert Sdf.Layer.FindOrOpen(str(tmp_path / "arm.usdc"))


def test_a_stage_that_a_process_of_its_own_reads_is_the_same_robot(tmp_path, monkeypatch):
    """As commands read it.  What ends that process is a sentence."""
    from ksl.base import own_process
    from ksl.robot_files.usd import machine

    Writer(tmp_path / "arm.usda", arm(np.random.default_rng(5)), length=0.01)
    here = ksl.load(tmp_path / "arm.usda")
    monkeypatch.setattr(own_process, "_is_wanted", True)
    apart = ksl.load(tmp_path / "arm.usda")
    for of in ("links", "joints", "unused", "warnings", "inputs"):
        assert getattr(apart, of) == getattr(here, of)
    (tmp_path / "bad.usda").write_text("#usda 1.0\n( garbage")
    with pytest.raises(ksl.DescriptionError, match="bad.usda: USD refuses the file: "):
        ksl.load(tmp_path / "bad.usda")
    monkeypatch.setattr(machine, "_READ", "os.kill(os.getpid(), 9)")
    with pytest.raises(ksl.DescriptionError, match="arm.usda: USD didn't read the file to its end: .*most likely since memory ran out"):
        ksl.load(tmp_path / "arm.usda")


SCENE = """#usda 1.0
(
  metersPerUnit = {}
  kilogramsPerUnit = {}
  timeCodesPerSecond = {}
  upAxis = "Z"{}
)
def Xform "r"{}
{{
  def Xform "a" ( prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"] )
  {{
    float physics:mass = 2
    point3f physics:centerOfMass = (0, 0, 0)
    float3 physics:diagonalInertia = (1, 1, 1)
    {}
  }}
  {}
}}
"""


def scene(path, length=1, mass=1, rate=24, layer="", root="", body="", more=""):
    path.write_text(SCENE.format(length, mass, rate, layer, root, body, more))
    return path


@pytest.mark.parametrize("bad", [0, -1, "nan", "inf", 1e-300, 1e300])
@pytest.mark.parametrize(("unit", "name"), [("length", "metersPerUnit"), ("mass", "kilogramsPerUnit"), ("rate", "timeCodesPerSecond")])
def test_units_that_are_none_are_refused(tmp_path, bad, unit, name):
    with pytest.raises(ksl.DescriptionError, match=rf"{name} is {re.escape(f'{float(bad):g}')} .*; expected 1e-\d+ to 1e\+09"):
        ksl.load(scene(tmp_path / "a.usda", **{unit: bad}))


GONE = "(\n  references = @./gone.usda@\n)"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"root": GONE}, "Could not open asset .*gone.usda.* for reference introduced by .*</r>"),
        ({"root": GONE.replace("references", "payload")}, "Could not open asset .*gone.usda.* for payload"),
        ({"layer": "\n  subLayers = [@./gone.usda@]"}, "Could not load sublayer .*gone.usda"),
        ({"layer": "\n  subLayers = [@./torn.usda@]"}, "Could not load sublayer .*torn.usda.* Expected"),
        ({"more": 'def "b" (\n references = @./other.usda@</nobody>\n) {\n}'}, "Unresolved reference prim path .*other.usda@</nobody>"),
        ({"more": 'def "b" (\n references = </nowhere>\n) {\n}'}, "Unresolved reference prim path"),
        ({"more": 'def "b" (\n references = @omniverse://server/arm.usd@\n) {\n}'}, "Could not open asset"),
        ({"more": 'def "b" (\n references = </r>\n) {\n}'}, "cycle"),
        ({"more": 'def "b" (\n references = [@./gone.usda@, @./gone2.usda@]\n) {\n}'}, r"\(2 in all\)"),
    ],
)
def test_a_part_of_a_stage_that_is_missing_refuses_it(tmp_path, capfd, given, said):
    (tmp_path / "torn.usda").write_text("#usda 1.0\n( torn")
    (tmp_path / "other.usda").write_text('#usda 1.0\ndef "b" {\n}\n')
    file = scene(tmp_path / "a.usda", **given)
    with pytest.raises(ksl.DescriptionError, match=f"(?i){said}") as e:
        ksl.load(file)
    assert str(e.value).startswith(f"{file}: a part of the stage is missing: ") and "0x" not in str(e.value)
    if Usd.GetVersion() >= (0, 25, 5):
        assert capfd.readouterr().err == ""
    done = run_ksl("info", file)
    assert done.returncode and "a part of the stage is missing" in done.stderr


def test_what_usd_says_is_passed_on(tmp_path, capfd):
    if Usd.GetVersion() < (0, 25, 5):
        pytest.skip("USD prints it itself")
    file = scene(
        tmp_path / "a.usda", more='def Cube "b" ( prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsCollisionAPI"] )\n{\n  rel material:binding = </r>\n}'
    )
    with pytest.warns(ksl.DescriptionWarning, match="USD says: Found material bindings on prim"):
        ksl.load(file)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (
            'def "b" (\n variants = {{ string tool = "{}" }}\n prepend variantSets = "tool"\n)\n{{\n variantSet "tool" = {{ "two" {{\n }} }}\n}}',
            "prim /r/b: variant {} is chosen of tool, which has two",
        ),
        ('{} "b" ( prepend apiSchemas = ["PhysicsRigidBodyAPI"] )\n{{\n}}', "prim /r/b: has PhysicsRigidBodyAPI, and nothing defines it .{}."),
        ('{} PhysicsFixedJoint "b"\n{{\n rel physics:body1 = </r/a>\n}}', "prim /r/b: has PhysicsFixedJoint, and nothing defines it .{}."),
    ],
)
def test_what_usd_leaves_out_without_a_word_is_said(tmp_path, more, said):
    bad, good = ("one", "two") if "variants" in more else ("over", "def")
    with pytest.warns(ksl.DescriptionWarning, match=said.format(bad)):
        ksl.load(scene(tmp_path / "a.usda", more=more.format(bad)))
    assert not any(line.startswith("prim /r/b") for line in ksl.load(scene(tmp_path / "b.usda", more=more.format(good))).warnings)


def test_instances_of_instances_are_bounded(tmp_path, monkeypatch):
    levels = "".join(
        f'class "c{k}" {{\n' + "".join(f'def "p{i}" ( instanceable = true\n references = </c{k + 1}> ) {{\n}}\n' for i in range(4)) + "}\n" for k in range(5)
    )
    file = scene(tmp_path / "a.usda", more='def "b" ( instanceable = true\n references = </c0> ) {\n}')
    file.write_text(file.read_text() + levels + 'class "c5" {\n}\n')
    assert ksl.load(file).link_names
    monkeypatch.setattr("ksl.robot_files.usd.stage.USD_PRIMS", 1000)
    with pytest.raises(ksl.DescriptionError, match="its instances unfold to more than 1,000 prims, which are the most that are read"):
        ksl.load(file)


HINGE = 'def PhysicsRevoluteJoint "j"{}\n{{\n  rel physics:body1 = </r/a>\n  {}\n}}'


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_a_side_that_a_reference_leaves_out_is_not_the_world(tmp_path):
    """USD drops targets outside of the prim that is referenced; what is left has no target, which means the world elsewhere."""
    inner = scene(tmp_path / "inner.usda", more=HINGE.format("", "rel physics:body0 = </other>"))
    outer = tmp_path / "outer.usda"
    outer.write_text(f'#usda 1.0\n( metersPerUnit = 1\n)\ndef "s" ( references = @./{inner.name}@</r> )\n{{\n}}\n')
    with pytest.raises(ksl.DescriptionError, match="joint j: physics:body0 is </other>|joint j: physics:body0 is /other, which USD can't follow"):
        ksl.load(outer)
    with pytest.raises(ksl.DescriptionError, match="physics:body0 is /r/b, which is not active"):
        ksl.load(scene(tmp_path / "b.usda", more=HINGE.format("", "rel physics:body0 = </r/b>") + '\ndef Xform "b" ( active = false ) {\n}'))


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_bodies_that_are_off_or_held(tmp_path):
    with pytest.raises(ksl.DescriptionError, match="its only rigid body, /r/a, is not enabled; set physics:rigidBodyEnabled"):
        ksl.load(scene(tmp_path / "a.usda", body="bool physics:rigidBodyEnabled = false"))
    for more, kind, loops in (
        ("", "a_kinematic", []),
        (HINGE.format("", "").replace("Revolute", "Fixed"), "j", []),
        (HINGE.format("", ""), "a_kinematic", ["j"]),
    ):
        held = ksl.load(scene(tmp_path / "a.usda", body="bool physics:kinematicEnabled = true", more=more), masses="optional")
        assert held.nv == 0 and held.joint(kind).kind == "fixed" and held.loop_names == loops and any("link a: kinematic" in line for line in held.warnings)
    light = scene(tmp_path / "a.usda")
    light.write_text(light.read_text().replace("physics:mass = 2", "physics:mass = 0"))
    with pytest.raises(ksl.DescriptionError, match=r"none of the links that move \(a\) has a mass.*; give these links a mass;"):
        ksl.load(light)


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_numbers_of_joints_are_used_or_named(tmp_path):
    """Attribute by attribute: what a joint has is in the model, or in a line."""
    used = "float physics:lowerLimit = -90\nfloat physics:upperLimit = 45\nfloat drive:angular:physics:maxForce = 0.07"
    named = {
        "float physics:breakForce = 30": "physics:breakForce of j",
        "float physics:breakTorque = inf": "",
        "bool physics:collisionEnabled = 1": "physics:collisionEnabled of j",
        "float drive:angular:physics:stiffness = 3": "drive:angular:physics:stiffness of j",
        "float drive:linear:physics:damping = 3": "drive:linear:physics:damping of j",
        "float drive:linear:physics:maxForce = 3": "drive:linear:physics:maxForce of j",
        "float limit:rotX:physics:low = -3": "limit:rotX:physics:low of j",
        "float state:angular:physics:position = 30": "state:angular:physics:position of j",
        "float physxJoint:jointFriction = 0.1": "physxJoint:jointFriction of j",
        "quatf strange:turn = (1, 0, 0, 0)": "strange:turn of j",
        'string strange:name = "x"': "strange:name of j",
        "rel strange:to = </r>": "strange:to of j",
    }
    schemas = ' ( prepend apiSchemas = ["PhysicsDriveAPI:angular"] )'
    found = ksl.load(
        scene(
            tmp_path / "a.usda",
            body="vector3f physics:velocity = (1, 0, 0)\nbool physxRigidBody:disableGravity = 1",
            more=HINGE.format(schemas, used + "\n" + "\n".join(named)),
        )
    )
    j = found.joint("j")
    assert (j.lower, j.upper, j.effort) == pytest.approx((-np.pi / 2, np.pi / 4, 0.07))
    assert set(found.unused) == {*filter(None, named.values()), "physics:velocity of a", "physxRigidBody:disableGravity of a"}
    idle = HINGE.replace("PhysicsRevoluteJoint", "PhysicsSphericalJoint").format("", "float physxJoint:armature = 3\nfloat physics:lowerLimit = -3")
    assert ksl.load(scene(tmp_path / "a.usda", more=idle)).unused == ("physics:lowerLimit of j", "physxJoint:armature of j")
    for angle, said in (("0", "joint j: physics:coneAngle1Limit of 0 lets a ball turn about its axis alone"), ("30", None)):
        ball = ksl.load(scene(tmp_path / "a.usda", more=idle.replace("physics:lowerLimit = -3", f"physics:coneAngle1Limit = {angle}")))
        assert any(line.startswith(said) for line in ball.warnings) if said else "physics:coneAngle1Limit of j" in ball.unused
    one = ksl.load(scene(tmp_path / "a.usda", more=HINGE.format("", "float physics:upperLimit = 3"))).joint("j")
    assert (one.lower, one.upper) == (None, pytest.approx(np.pi / 60))
    crossed = ksl.load(scene(tmp_path / "a.usda", more=HINGE.format("", "float physics:lowerLimit = 45\nfloat physics:upperLimit = 30")))
    assert crossed.joint("j").lower is None and any("its lower limit (45) is above its upper one (30)" in line for line in crossed.warnings)
    for number, said in (
        ("physics:lowerLimit = nan", r"a limit of its position is nan rad or m; expected a magnitude of 0 to 1e\+09 rad or m;"),
        ("physxJoint:maxJointVelocity = nan", r"physxJoint:maxJointVelocity is nan rad/s or m/s; expected 0 to 1e\+09 rad/s or m/s;"),
        ("drive:angular:physics:maxForce = -1", r"drive:angular:physics:maxForce is -1 N m or N; expected 0 to 1e\+15 N m or N;"),
    ):
        with pytest.raises(ksl.DescriptionError, match=f"joint j: {said}"):
            ksl.load(scene(tmp_path / "a.usda", more=HINGE.format(schemas, f"float {number}")))


def test_two_bodies_of_one_name_have_longer_ones(tmp_path):
    w = Writer(tmp_path / "arm.usda", arm(np.random.default_rng(5)))
    for side in ("left", "right"):
        prim = UsdGeom.Xform.Define(w.stage, f"/robot/{side}/finger").GetPrim()
        UsdPhysics.RigidBodyAPI.Apply(prim)
        UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(1.0)
    w.stage.Save()
    names = ksl.load(tmp_path / "arm.usda").link_names
    assert "robot_left_finger" in names and "robot_right_finger" in names


def test_vectors_are_read_at_once(tmp_path, monkeypatch):
    """Python's way through a vector of USD ends by an exception of C++, and took most of the time of a stage."""
    Writer(tmp_path / "r.usda", arm(np.random.default_rng(5)))
    plain = ksl.load(tmp_path / "r.usda")
    vector = Gf.Vec3f
    element, asked = vector.__getitem__, []
    monkeypatch.setattr(vector, "__getitem__", lambda self, k: (asked.append(k), element(self, k))[1])
    assert list(vector(1, 2, 3)) == [1, 2, 3] and len(asked) == 4  # the fourth raises
    asked.clear()
    again = ksl.load(tmp_path / "r.usda")
    assert not asked and again.links == plain.links
