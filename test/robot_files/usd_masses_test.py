"""Masses of USD stages, beside those that UsdPhysics computes: RigidBodyAPI.ComputeMassProperties, which asks its caller for volumes of shapes."""

import numpy as np
import pytest

import ksl

pytest.importorskip("pxr")
from pxr import Gf, Tf, Usd, UsdGeom, UsdPhysics, UsdShade

needs_witness = pytest.mark.skipif(
    not hasattr(UsdPhysics, "MassUnits") or Usd.GetVersion() < (0, 26, 11), reason="before usd-core 26.11 disabled colliders count"
)
KINDS = ["Cube", "Sphere", "Cylinder", "Capsule", "Cone"]


def turn(rng):
    x = rng.normal(size=4)
    return Gf.Quatf(*(x / np.linalg.norm(x)).tolist())


def vector(x):
    return Gf.Vec3f(*np.asarray(x).tolist())


def give_mass(rng, prim, share):
    """Each attribute with this probability; SI units of the file."""
    stage = prim.GetStage()
    length, mass = UsdGeom.GetStageMetersPerUnit(stage), UsdPhysics.GetStageKilogramsPerUnit(stage)
    api, has = UsdPhysics.MassAPI.Apply(prim), rng.random(5) < share
    for yes, create, value in (
        (has[0], api.CreateMassAttr, float(rng.uniform(0.1, 5) / mass)),
        (has[1], api.CreateDensityAttr, float(rng.uniform(100, 5000) * length**3 / mass)),
        (has[2], api.CreateCenterOfMassAttr, vector(rng.normal(size=3) / length)),
        (has[3], api.CreateDiagonalInertiaAttr, vector(rng.uniform(1, 2, size=3) / mass / length**2)),
        (has[4], api.CreatePrincipalAxesAttr, turn(rng)),
    ):
        if yes:
            create(value)


def solid(prim):
    """Volume, centroid and tensor about it, by discs along the axis; in units of the file."""
    scale = np.abs(Gf.Transform(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).GetScale())
    get = lambda name: prim.GetAttribute(name).Get()
    if prim.GetTypeName() == "Cube":
        a = get("size") * scale
        return a.prod(), np.zeros(3), np.diag(a.prod() / 12 * (a @ a - a**2))
    kind, axis = prim.GetTypeName(), 2 if prim.GetTypeName() == "Sphere" else "XYZ".index(get("axis"))
    r, h = get("radius") * (scale if kind == "Sphere" else np.delete(scale, axis)).max(), 0.0 if kind == "Sphere" else get("height") * scale[axis]
    z = np.linspace(-h / 2 - (r if kind in ("Sphere", "Capsule") else 0), h / 2 + (r if kind in ("Sphere", "Capsule") else 0), 20001)
    rim = {"Cylinder": lambda: 0 * z + r, "Cone": lambda: r * (0.5 - z / h)}.get(
        kind, lambda: np.sqrt(np.maximum(0, r * r - np.maximum(0, np.abs(z) - h / 2) ** 2))
    )()
    disc = np.pi * rim**2
    volume = np.trapezoid(disc, z)
    centre = np.trapezoid(disc * z, z) / volume
    centroid, moments = np.zeros(3), np.full(3, np.trapezoid(disc * (rim**2 / 4 + (z - centre) ** 2), z))
    centroid[axis], moments[axis] = centre, np.trapezoid(disc * rim**2 / 2, z)
    return volume, centroid, np.diag(moments)


def computed(prim):
    """What USD computes of a body: kg, m, its tensor about the centroid."""
    cache, stage = UsdGeom.XformCache(), prim.GetStage()
    own = cache.GetLocalToWorldTransform(prim).RemoveScaleShear()

    def of_shape(part):
        made = UsdPhysics.RigidBodyAPI.MassInformation()
        volume, centroid, tensor = solid(part)
        made.volume, made.centerOfMass, made.inertia = float(volume), vector(centroid), Gf.Matrix3f(*tensor.ravel().tolist())
        at = cache.GetLocalToWorldTransform(part).RemoveScaleShear() * own.GetInverse()
        made.localPos, made.localRot = Gf.Vec3f(at.ExtractTranslation()), Gf.Quatf(at.ExtractRotationQuat())
        return made

    with Tf.DiagnosticTrap() as trap:
        mass, moments, centroid, axes = UsdPhysics.RigidBodyAPI(prim).ComputeMassProperties(of_shape)
        trap.Clear()
    length, kg = UsdGeom.GetStageMetersPerUnit(stage), UsdPhysics.GetStageKilogramsPerUnit(stage)
    R = np.array(Gf.Matrix3d(Gf.Rotation(Gf.Quatd(axes)))).T if abs(axes.GetLength() - 1) < 1e-3 else np.eye(3)
    return mass * kg, np.array(centroid) * length, R @ np.diag(moments) @ R.T * kg * length**2


def random_stage(rng, path):
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, float(rng.choice([1.0, 0.01])))
    UsdPhysics.SetStageKilogramsPerUnit(stage, float(rng.choice([1.0, 0.001])))
    length = UsdGeom.GetStageMetersPerUnit(stage)
    steel = UsdShade.Material.Define(stage, "/steel")
    UsdPhysics.MaterialAPI.Apply(steel.GetPrim()).CreateDensityAttr(7800 * length**3 / UsdPhysics.GetStageKilogramsPerUnit(stage))

    def placed(of, scale):
        of.AddTranslateOp().Set(Gf.Vec3d(*(rng.normal(size=3) / length).tolist()))
        of.AddOrientOp().Set(turn(rng))
        of.AddScaleOp().Set(vector(scale))
        return of.GetPrim()

    for k in range(6):
        share = rng.choice([0.2, 0.5, 0.8])
        body = placed(UsdGeom.Xform.Define(stage, f"/body{k}"), np.full(3, rng.choice([1.0, 2.0])))
        UsdPhysics.RigidBodyAPI.Apply(body)
        if rng.random() < 0.7:
            give_mass(rng, body, share)
        below = UsdGeom.Xform.Define(stage, f"/body{k}/{rng.choice(['frame', 'not_a_body'])}").GetPrim()
        if below.GetName() == "not_a_body":
            UsdPhysics.RigidBodyAPI.Apply(below).CreateRigidBodyEnabledAttr(False)
            give_mass(rng, below, 0.5)
        for i in range(rng.integers(0, 4)):
            kind = str(rng.choice(KINDS))
            part = getattr(UsdGeom, kind).Define(stage, below.GetPath().AppendChild(f"part{i}") if rng.random() < 0.5 else f"/body{k}/part{i}")
            prim = placed(part, rng.uniform(0.5, 2, size=3))
            if kind == "Cube":
                part.CreateSizeAttr(rng.uniform(0.2, 1) / length)
            else:
                part.CreateRadiusAttr(rng.uniform(0.2, 1) / length)
            if kind in ("Cylinder", "Capsule", "Cone"):
                part.CreateHeightAttr(rng.uniform(0.2, 1) / length)
                part.CreateAxisAttr(str(rng.choice(list("XYZ"))))
            if rng.random() < 0.9:
                UsdPhysics.CollisionAPI.Apply(prim).CreateCollisionEnabledAttr(bool(rng.random() < 0.8))
            if rng.random() < 0.6:
                give_mass(rng, prim, share)
            if rng.random() < 0.3:
                UsdShade.MaterialBindingAPI.Apply(prim).Bind(steel)
    stage.Save()
    return stage


def of_link(link):
    """Mass, centroid and tensor about it."""
    xx, yy, zz, xy, yz, zx = link.inertia
    c = np.array(link.first_moment) / (link.mass or 1.0)
    return link.mass, c, np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) - link.mass * (c @ c * np.eye(3) - np.outer(c, c))


@needs_witness
@pytest.mark.parametrize("seed", range(15))
@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_masses_at_random_places_are_those_that_usd_computes(tmp_path, seed):
    stage = random_stage(np.random.default_rng(seed), tmp_path / "bodies.usda")
    found = ksl.load(tmp_path / "bodies.usda", masses="optional")
    for k in range(6):
        prim = stage.GetPrimAtPath(f"/body{k}")
        mass, centroid, tensor = computed(prim)
        ours, our_centroid, our_tensor = of_link(found.link(f"body{k}"))
        said = [line for line in found.warnings if line.startswith(f"link body{k}:")]
        parts = [p for p in Usd.PrimRange(prim) if p.HasAPI(UsdPhysics.CollisionAPI) and UsdPhysics.CollisionAPI(p).GetCollisionEnabledAttr().Get()]
        if not parts:
            assert ours == max(mass, 0) and (said or ours)
            continue
        assert ours == pytest.approx(mass, rel=1e-5) and np.abs(our_centroid - centroid).max() < 1e-5 * (1 + np.abs(centroid).max())
        assert np.allclose(np.linalg.eigvalsh(our_tensor), np.linalg.eigvalsh(tensor), rtol=0, atol=2e-5 * np.abs(tensor).max())
        if len(parts) > 1 or not any("has physics:diagonalInertia alone" in line for line in said):  # the axes of one cylinder are any across its own
            assert np.abs(our_tensor - tensor).max() < 2e-5 * np.abs(tensor).max()


def one_body(path, more="", body="", of_parts=("", ""), schemas=("", "")):
    """A body with two cubes of 10 cm; text in its braces and in theirs."""
    path.write_text(f"""#usda 1.0
( metersPerUnit = 1
  upAxis = "Z"
)
def Xform "body" ( prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"] )
{{
  {body}
  def Cube "a" ( prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMassAPI"{schemas[0]}] )
  {{
    double size = 0.1
    {of_parts[0]}
  }}
  def Cube "b" ( prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMassAPI"{schemas[1]}] )
  {{
    double size = 0.1
    double3 xformOp:translate = (0.2, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    {of_parts[1]}
  }}
  {more}
}}
""")
    found = ksl.load(path, masses="optional")
    mass, centroid, _ = of_link(found.link("body"))
    return mass, centroid[0], "\n".join(line for line in found.warnings if line.startswith("link body"))


MASS, DENSITY, OFF = "float physics:mass = {}", "float physics:density = {}", "bool physics:collisionEnabled = false"


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_each_attribute_comes_from_where_it_is_given(tmp_path):
    stage = tmp_path / "body.usda"
    assert one_body(stage, of_parts=(MASS.format(0.05), DENSITY.format(4000)))[:2] == pytest.approx((4.05, 0.2 * 4 / 4.05))
    assert one_body(stage, body="point3f physics:centerOfMass = (0.1, 0, 0)", of_parts=(MASS.format(1), MASS.format(3)))[:2] == pytest.approx((4, 0.1))
    assert one_body(stage, of_parts=(MASS.format(1), MASS.format(3) + "\n" + OFF))[:2] == pytest.approx((1, 0))
    assert one_body(stage, body=DENSITY.format(2000), of_parts=("", DENSITY.format(1000)))[:2] == pytest.approx((3, 0.2 / 3))
    assert one_body(stage, body=MASS.format(6), of_parts=(DENSITY.format(1000), DENSITY.format(2000))) == (pytest.approx(6), pytest.approx(0.4 / 3), "")


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_what_is_left_to_a_simulator_is_named(tmp_path):
    stage = tmp_path / "body.usda"
    mesh = 'def Mesh "cover" ( prepend apiSchemas = ["PhysicsCollisionAPI"] )\n{\n}'
    mass, _, said = one_body(stage, mesh, of_parts=(MASS.format(1), ""))
    assert mass == pytest.approx(2) and "simulators fit shapes of their own to /body/cover (Mesh: mass, centre of mass, inertia)" in said
    assert "neither a mass nor a density of /body/b; USD's default, 1000 kg/m³, is taken" in said
    assert "link body: no physics:mass; simulators compute it" in one_body(stage, mesh, of_parts=(OFF, OFF))[2]
    lost = 'def Xform "lost" ( prepend apiSchemas = ["PhysicsMassAPI"] )\n{\nfloat physics:mass = 3\n}'
    mass, _, said = one_body(stage, lost, body=MASS.format(1))
    assert mass == 1 and "the mass of /body/lost doesn't count" in said
    said = one_body(stage, body="float3 physics:diagonalInertia = (1, 2, 2)", of_parts=(MASS.format(1), MASS.format(1)))[2]
    assert "the body has physics:diagonalInertia alone" in said


SIX = "double[] newton:inertia = [{}]"
WHOLE = MASS.format(2) + "\npoint3f physics:centerOfMass = (0.1, 0, 0)\n"


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
@pytest.mark.parametrize("schemas", ['"PhysicsMassAPI", "NewtonMassAPI"', '"NewtonMassAPI"'])
@pytest.mark.parametrize(("length", "mass"), [(1, 1), (0.01, 0.5)])
def test_the_whole_tensor_that_newton_states(tmp_path, schemas, length, mass):
    """Six numbers, in the axes of the body and about its centre of mass, in units of the file; with the schema of Newton alone, too, which contains that of USD."""
    numbers = np.array([0.3, 0.4, 0.5, 0.01, -0.02, 0.03]) / (mass * length**2)
    stage = tmp_path / "body.usda"
    stage.write_text(f"""#usda 1.0
( metersPerUnit = {length}
  kilogramsPerUnit = {mass} )
def Xform "body" ( prepend apiSchemas = ["PhysicsRigidBodyAPI", {schemas}] )
{{
  float physics:mass = {2 / mass}
  point3f physics:centerOfMass = ({0.1 / length}, 0, 0)
  double[] newton:inertia = {[float(x) for x in numbers]}
  double3 xformOp:rotateXYZ = (20, 30, 40)
  uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
  def Cube "a" ( prepend apiSchemas = ["PhysicsCollisionAPI"] ) {{}}
}}
""")
    found = ksl.load(stage)
    ours, centroid, tensor = of_link(found.link("body"))
    assert ours == pytest.approx(2) and centroid == pytest.approx([0.1, 0, 0])
    assert tensor == pytest.approx(np.array([[0.3, 0.01, -0.02], [0.01, 0.4, 0.03], [-0.02, 0.03, 0.5]]), rel=1e-12)
    assert not found.unused and not any("link body" in line for line in found.warnings)


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_where_the_whole_tensor_counts(tmp_path):
    stage = tmp_path / "body.usda"
    six = SIX.format("0.3, 0.4, 0.5, 0, 0, 0")
    assert "newton:inertia" not in one_body(stage, body=WHOLE + six)[2]
    assert "newton:inertia" not in one_body(stage, body=WHOLE + six + "\nfloat3 physics:diagonalInertia = (0.3, 0.4, 0.50001)")[2]
    said = one_body(stage, body=WHOLE + six + "\nfloat3 physics:diagonalInertia = (0.3, 0.4, 0.6)")[2]
    assert "newton:inertia and physics:diagonalInertia differ by 0.1 kg m²; the first counts" in said
    assert of_link(ksl.load(stage).link("body"))[2][2, 2] == pytest.approx(0.5)
    assert "has physics:diagonalInertia alone" not in one_body(stage, body=six + "\nfloat3 physics:diagonalInertia = (0.3, 0.4, 0.5)")[2]
    one_body(stage, body=SIX.format("") + "\n" + WHOLE + "float3 physics:diagonalInertia = (0.1, 0.1, 0.1)")
    assert of_link(ksl.load(stage).link("body"))[2][2, 2] == pytest.approx(0.1), "an empty one says nothing"
    stage.write_text(f'#usda 1.0\ndef Xform "body" ( prepend apiSchemas = ["PhysicsRigidBodyAPI"] )\n{{\n{six}\n}}\n')
    assert "newton:inertia of body" in ksl.load(stage, masses="optional").unused, "without the schema it is an attribute as any other"
    said = one_body(stage, of_parts=(MASS.format(1) + "\n" + six, MASS.format(1)))[2]
    assert "newton:inertia of /body/a doesn't count: it is one of bodies" in said


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
@pytest.mark.parametrize("shell", ['uniform token newton:massModel = "shell"', "bool mjc:shellinertia = 1"])
def test_shells_are_left_to_simulators(tmp_path, shell):
    """They weigh at their surface, with a thickness that simulators choose."""
    stage = tmp_path / "body.usda"
    mass, centroid, said = one_body(stage, of_parts=(shell, MASS.format(2)))
    assert (mass, centroid) == pytest.approx((2, 0.2)) and "/body/a (Cube, a shell: mass, centre of mass, inertia)" in said
    solid = shell.replace('shell"', 'solid"').replace("= 1", "= 0")
    assert one_body(stage, of_parts=(solid, MASS.format(2)))[0] == pytest.approx(3)


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ({"body": MASS.format(-3)}, "prim /body: its physics:mass is -3 kg; expected 1e-15 to 1e"),
        ({"body": MASS.format("nan")}, "its physics:mass is nan"),
        ({"body": MASS.format("inf")}, "its physics:mass is inf"),
        ({"of_parts": ("", DENSITY.format(-1))}, "prim /body/b: its physics:density is -1 kg/m³"),
        ({"of_parts": ("", DENSITY.format(1e12))}, "its physics:density is 1e"),
        ({"body": "float3 physics:diagonalInertia = (1, -1, 1)"}, "its physics:diagonalInertia is -1"),
        ({"body": SIX.format("1, 2, 3")}, "prim /body: its newton:inertia has 3 numbers; expected Ixx, Iyy, Izz, Ixy, Ixz, Iyz"),
        ({"body": SIX.format("1, 2, -3, 0, 0, 0")}, "prim /body: its newton:inertia is -3 kg m²"),
        ({"body": SIX.format("1, 2, 3, nan, 0, 0")}, "prim /body: its newton:inertia is nan"),
        ({"body": "point3f physics:centerOfMass = (nan, 0, 0)"}, "its physics:centerOfMass is"),
        ({"body": "quatf physics:principalAxes = (inf, 0, 0, 0)"}, "a quaternion is"),
        ({"body": 'float3 xformOp:scale = (1, 0, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'}, "prim /body.*: its scale is 0"),
        ({"body": 'double3 xformOp:translate = (nan, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'}, "where it stands is not finite"),
        (
            {"body": 'double3 xformOp:translate.timeSamples = { 0: (1, 0, 0) }\nuniform token[] xformOpOrder = ["xformOp:translate"]'},
            "xformOp:translate has time samples alone",
        ),
        ({"body": "float physics:mass.timeSamples = { 0: 2 }"}, "physics:mass has time samples alone"),
    ],
)
def test_numbers_that_no_body_has_are_refused(tmp_path, what, said):
    with pytest.raises(ksl.DescriptionError, match=said) as e:
        one_body(tmp_path / "body.usda", **what)
    assert str(e.value).startswith(f"{tmp_path / 'body.usda'}: ")
