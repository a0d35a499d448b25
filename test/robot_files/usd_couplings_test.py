"""What couples joints in USD stages besides joints of UsdPhysics: read as followers, or refused, whether the schema is known or not."""

import numpy as np
import pytest

import ksl

pytest.importorskip("pxr")

LINK = """def Xform "{0}" ( prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"{2}] )
  {{
    float physics:mass = 1
    point3f physics:centerOfMass = (0.1, 0.02, 0)
    float3 physics:diagonalInertia = (0.01, 0.02, 0.03)
    double3 xformOp:translate = ({1}, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    {3}
  }}
"""


def stage(
    path, joints=("", "", ""), schemas=("", "", ""), more="", length=1.0, on="world", kinds=("Revolute", "Revolute", "Prismatic"), flip="", link=("", "")
):
    """Three links 1 m apart on the world or on the first one: A and B turn about z, C slides along y.  Text in the braces of joints, and beside them."""
    text = f'#usda 1.0\n( metersPerUnit = {length}\n  upAxis = "Z"\n)\ndef Xform "r"\n{{\n'
    for k, (name, axis) in enumerate((("A", "Z"), ("B", "Z"), ("C", "Y"))):
        text += LINK.format(name.lower(), k / length, link[0] if k == 1 else "", link[1] if k == 1 else "")
        carrier, own = (f"rel physics:body0 = </r/{on}>" if on != "world" and name != on.upper() else ""), f"rel physics:body1 = </r/{name.lower()}>"
        at = k / length
        if name in flip:
            carrier, own = own.replace("body1", "body0"), carrier.replace("body0", "body1")
        place = f"point3f physics:localPos{1 if name in flip else 0} = ({at}, 0, 0)"
        schema = f" ( prepend apiSchemas = [{schemas[k]}] )" if schemas[k] else ""
        text += f'def Physics{kinds[k]}Joint "{name}"{schema}\n{{\nuniform token physics:axis = "{axis}"\n{carrier}\n{own}\n{place}\n{joints[k]}\n}}\n'
    path.write_text(f"{text}{more}\n}}\n")
    return path


NEWTON, PHYSX = '"NewtonMimicAPI"', '"PhysxMimicJointAPI:rotZ"'


def newton(leader, a1="", a0="", more=""):
    return (
        f"rel newton:mimicJoint = </r/{leader}>\n"
        + (f"float newton:mimicCoef1 = {a1}\n" if a1 else "")
        + (f"float newton:mimicCoef0 = {a0}\n" if a0 else "")
        + more
    )


def physx(leader, gearing="", offset="", more=""):
    of = "physxMimicJoint:rotZ:"
    return (
        f"rel {of}referenceJoint = </r/{leader}>\n"
        + (f"float {of}gearing = {gearing}\n" if gearing else "")
        + (f"float {of}offset = {offset}\n" if offset else "")
        + more
    )


def gear(ratio, kind="PhysxPhysicsGearJoint", names=("hinge0", "hinge1"), joints="AB", frames="", ratio_name="gearRatio"):
    """Between the links of two joints; its x axes are turned to theirs, z."""
    to_z = "(0.70710678, 0, -0.70710678, 0)"
    frames = frames or f"quatf physics:localRot0 = {to_z}\nquatf physics:localRot1 = {to_z}"
    of = "\n".join(f"rel physics:body{k} = </r/{j.lower()}>\nrel physics:{name} = </r/{j}>" for k, (j, name) in enumerate(zip(joints, names)))
    return f'def {kind} "G"\n{{\n{of}\nfloat physics:{ratio_name} = {ratio}\n{frames}\n}}\n'


RACK = {"kind": "PhysxPhysicsRackAndPinionJoint", "names": ("hinge", "prismatic"), "joints": "AC", "ratio_name": "ratio"}
TO_Y = "quatf physics:localRot0 = (0.70710678, 0, -0.70710678, 0)\nquatf physics:localRot1 = (0.70710678, 0, 0, 0.70710678)"
DEGREE = np.pi / 180


@pytest.mark.parametrize(
    ("given", "follower", "leader", "multiplier", "offset"),
    [
        ({"joints": ("", newton("A", "-2.5", "30"), ""), "schemas": ("", NEWTON, "")}, "B", "A", -2.5, 30 * DEGREE),
        ({"joints": ("", newton("A"), ""), "schemas": ("", NEWTON, "")}, "B", "A", 1, 0),
        ({"joints": ("", physx("A", "2", "-90"), ""), "schemas": ("", PHYSX, "")}, "B", "A", -2, 90 * DEGREE),
        ({"joints": ("", "", physx("A", "0.5", "20")), "schemas": ("", "", PHYSX), "length": 0.01}, "C", "A", -0.5 * 0.01 / DEGREE, -0.2),
        ({"joints": (physx("C", "40"), "", ""), "schemas": (PHYSX, "", ""), "length": 0.01}, "A", "C", -40 * DEGREE / 0.01, 0),
        ({"more": gear(3)}, "B", "A", -3, 0),
        ({"more": gear(3).replace("float physics:gearRatio = 3", "")}, "B", "A", -1, 0),
        ({"more": gear(-0.25), "on": "c"}, "B", "A", 0.25, 0),
        ({"more": gear(3), "flip": "A"}, "B", "A", 3, 0),
        ({"more": gear(3, frames="quatf physics:localRot0 = (0.70710678, 0, -0.70710678, 0)\nquatf physics:localRot1 = (0.70710678, 0, 0.70710678, 0)")}, "B", "A", 3, 0),
        ({"more": gear(20, frames=TO_Y, **RACK), "length": 0.01}, "C", "A", 0.01 / (20 * DEGREE), 0),
        ({"more": gear(20, frames=TO_Y + "\npoint3f physics:localPos0 = (5, 0, 0)", **RACK)}, "C", "A", -1 / (20 * DEGREE), 0),
        ({"more": gear(20, frames=TO_Y + "\npoint3f physics:localPos0 = (2.00315, 3, 0)", **RACK)}, "C", "A", -1 / (20 * DEGREE), 0),
    ],
    ids=["newton", "newton's defaults", "physx", "a slide follows a hinge", "a hinge follows a slide", "gears", "gears' default", "gears on a link", "gears, turned", "gears, frames apart", "rack", "rack on the other side", "rack whose sign is just known"],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_couplings_that_are_read(tmp_path, given, follower, leader, multiplier, offset):
    file = stage(tmp_path / "r.usda", **given)
    coupled, free = ksl.load(file), ksl.load(file, mimic="independent")
    assert coupled.nv == 2 and free.nv == 3 and not [line for line in coupled.unused if line.startswith("physics") or "naturalFrequency" in line]
    q = coupled.random(1)
    positions = {name: float(coupled.position_of(coupled.joint(name), q)) for name in "ABC"}
    assert positions[follower] == pytest.approx(multiplier * positions[leader] + offset, rel=1e-5)


def refused(tmp_path, said, **given):
    with pytest.raises(ksl.DescriptionError, match=said):
        ksl.load(stage(tmp_path / "r.usda", **given))


TWO = "rel {} = [</r/A>, </r/B>]"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"more": 'def FutureGear "x"\n{\nrel some:first = [</r/A>, </r/b>]\nrel some:second = [</r/B>, </r/C>, </r/a>]\n}'},
            "prim /r/x: some:first, some:second names A, B, C, a, and KSL doesn't know",
        ),
        ({"joints": ("", "rel physxMimicJoint:rotZ:beside = </r/A>", ""), "schemas": ("", PHYSX, "")}, "prim /r/B: physxMimicJoint:rotZ:beside names A, B"),
        ({"more": 'def Xform "x" ( prepend apiSchemas = ["TieAPI:left"] )\n{\nrel tie:left:ends = [</r/a>, </r/c/mount>]\n}'}, ""),
        ({"more": 'def Scope "x"\n{\nrel tie:ends = [</r/a>, </r/b.physics:mass>]\n}'}, "names a, b"),
        ({"joints": ("", "rel follow:joint = </r/A>", ""), "schemas": ("", '"FollowAPI"', "")}, "prim /r/B: follow:joint names A, B"),
        ({"link": (', "CableAPI"', "rel cable:to = </r/a>")}, "prim /r/b: cable:to names a, b"),
        ({"joints": ("", newton("A"), "")}, "prim /r/B: newton:mimicJoint names A, B"),
        ({"more": 'def MotorJoint "x"\n{\nrel physics:body1 = </r/b>\n}'}, "prim /r/x: connects bodies .* as a MotorJoint"),
        ({"more": 'def PointInstancer "x"\n{\nrel prototypes = </r/b>\n}'}, "prim /r/x: a PointInstancer makes copies of rigid bodies"),
        ({"joints": ("", newton("nobody"), ""), "schemas": ("", NEWTON, "")}, "joint B: NewtonMimicAPI: newton:mimicJoint names 0 joints"),
        ({"joints": ("", newton("C"), ""), "schemas": ("", NEWTON, "")}, "a joint that turns and one that slides have no unit in common"),
        ({"joints": ("", newton("A", "nan"), ""), "schemas": ("", NEWTON, "")}, "joint B: NewtonMimicAPI: its ratio is nan"),
        ({"joints": ("", newton("A", "0"), ""), "schemas": ("", NEWTON, "")}, "its ratio is 0; expected a magnitude of"),
        ({"joints": ("", newton("A", "2", "0", "double mjc:coef3 = 1"), ""), "schemas": ("", NEWTON, "")}, "mjc:coef3 .* a polynomial of it that isn't linear"),
        (
            {"joints": ("", newton("A", "1", "inf"), ""), "schemas": ("", NEWTON, "")},
            r"its offset is inf rad or m; expected a magnitude of 0 to 1e\+09 rad or m;",
        ),
        (
            {"joints": ("", newton("A"), ""), "schemas": ("", NEWTON, ""), "kinds": ("Spherical", "Revolute", "Prismatic")},
            "couples joint A, a spherical; revolute",
        ),
        (
            {"joints": ("bool physics:jointEnabled = 0", newton("A"), ""), "schemas": ("", NEWTON, "")},
            "couples joint A, a joint that holds nothing, or is not enabled",
        ),
        ({"joints": ("", newton("A"), ""), "schemas": ("", NEWTON, ""), "more": gear(3)}, "couples joint B, which .* couples already"),
        ({"more": gear(0)}, r"joint /r/G \(PhysxPhysicsGearJoint\): its physics:gearRatio is 0"),
        ({"more": gear(1, frames="float x = 0")}, "the x axis of its frame on physics:body0 isn't that of joint A"),
        (
            {"more": gear(1, frames="quatf physics:localRot0 = (0.71221259, 0, -0.70196358, 0)")},
            "the x axis of its frame on physics:body0 isn't that of joint A",
        ),
        ({"more": gear(1, joints="AC")}, "physics:hinge1 is joint C, which is a prismatic joint"),
        ({"more": gear(1).replace("rel physics:hinge1 = </r/B>", "")}, "physics:hinge1 and physics:body1 name no joint"),
        (
            {"more": gear(1).replace("rel physics:body1 = </r/b>", "rel physics:body1 = </r/c>")},
            "physics:hinge1 is joint B, which is no joint of physics:body1",
        ),
        ({"more": gear(20, frames=TO_Y + "\npoint3f physics:localPos0 = (2, 3, 0)", **RACK)}, "so that the sign of its ratio is open"),
        ({"more": gear(1), "on": "a"}, "its joints A and B are on different bodies"),
    ],
)
@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_what_names_two_and_is_not_read_is_refused(tmp_path, given, said):
    if not said:
        given, said = {**given, "more": given["more"].replace("</r/c/mount>", "</r/c>")}, "prim /r/x: tie:left:ends names a, c"
    refused(tmp_path, said, **given)


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_what_chooses_or_is_not_enabled_is_read_over(tmp_path):
    more = """def Scope "x" ( prepend apiSchemas = ["CollectionAPI:arm"] )
{
  rel collection:arm:includes = [</r/a>, </r/b>]
  rel isaac:physics:robotJoints = [</r/A>, </r/B>]
}
def NewtonActuator "motor"
{
  rel newton:targets = </r/A>
}
def PhysicsCollisionGroup "g" {
  rel physics:filteredGroups = [</r/a>, </r/b>]
}
def FutureGear "off"
{
  bool physics:jointEnabled = 0
  rel some:first = </r/A>
  rel some:second = </r/B>
}
"""
    off = newton("A", more="bool newton:mimicEnabled = 0")
    found = ksl.load(stage(tmp_path / "r.usda", more=more + gear(2).replace("rel", "bool physics:jointEnabled = 0\nrel", 1), joints=("", off, ""), schemas=("", NEWTON, ""), link=(', "PhysicsFilteredPairsAPI"', "rel physics:filteredPairs = </r/a>")))  # fmt: skip
    assert found.nv == 3
    for line in (
        "NewtonActuator /r/motor at joint A",
        "joint /r/off (FutureGear, not enabled)",
        "joint /r/G (PhysxPhysicsGearJoint, not enabled)",
        "joint B: NewtonMimicAPI (not enabled)",
        "physics:filteredPairs of b",
    ):
        assert line in found.unused
    soft = physx("A", more="float physxMimicJoint:rotZ:naturalFrequency = 25")
    tendon = ('"PhysxTendonAxisRootAPI:t"', '"PhysxTendonAxisAPI:t"', PHYSX)
    found = ksl.load(stage(tmp_path / "r.usda", joints=("", "", soft), schemas=tendon))
    assert {"joint C: PhysxMimicJointAPI:rotZ: naturalFrequency and dampingRatio; the coupling is exact", "tendon t (PhysX) at A, B"} <= set(found.unused)


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
def test_a_joint_that_closes_a_loop_follows_none(tmp_path):
    refused(tmp_path, "joint B follows joint A, but B closes a loop", joints=("", newton("A") + "uniform bool physics:excludeFromArticulation = 1", ""), schemas=("", NEWTON, ""), more='def PhysicsFixedJoint "F"\n{\nrel physics:body0 = </r/a>\nrel physics:body1 = </r/b>\n}')  # fmt: skip
