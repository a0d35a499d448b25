"""USD: stages that are refused, with what is missing or makes no sense, and those of which something is said."""

import re
import sys

import numpy as np
import pytest
from ksl_command import run_ksl

import ksl

pxr = pytest.importorskip("pxr")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics
from usd_stages import Writer, arm


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
