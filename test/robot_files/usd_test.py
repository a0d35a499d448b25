"""USD: stages that usd-core writes, against the same robot in URDF; units, axes, loops, and what is said of the rest."""

import numpy as np
import pytest

import ksl

pxr = pytest.importorskip("pxr")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics
from usd_stages import Writer, arm, quaternion, same_dynamics


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
