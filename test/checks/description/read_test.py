"""Numbers and poses as the rules read them are those that the loader reads."""

import math
import re

import numpy as np
import pytest
from files import changed, hinge, link, more
from scipy.spatial.transform import Rotation

import ksl
from ksl.checks.run import _read
from ksl.checks.description.xml_file import half_unit, rotation_of, rotation_of_quaternion


def seen(path):
    return _read(path, (), (), 0.05)[0]


def test_rotations_against_scipy():
    rpy, xyzw = [0.3, -1.2, 2.5], [0.1, -0.7, 0.4, 0.9]
    assert np.allclose(rotation_of(np.array(rpy)), Rotation.from_euler("xyz", rpy).as_matrix(), atol=1e-15)
    assert np.allclose(rotation_of_quaternion(np.array(xyzw)), Rotation.from_quat(xyzw).as_matrix(), atol=1e-15)


def test_inertias_in_turned_axes_are_the_loaders(tmp_path):
    """About the link's origin, in its axes: R I R^T + m (c^2 1 - c c^T)."""
    path = tmp_path / "robot.urdf"
    path.write_text(changed(('<origin xyz="0 0 0.15"/>', '<origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/>')))
    inertial = seen(path).link_of["fore"].inertial
    c, m = inertial.centroid, inertial.mass
    about_origin = inertial.in_link_axes + m * (c @ c * np.eye(3) - np.outer(c, c))
    xx, yy, zz, xy, yz, zx = ksl.load(path).link("fore").inertia
    assert np.allclose(about_origin, [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]], atol=1e-15)


def test_the_same_robot_as_urdf_sdf_and_mjcf(tmp_path):
    """Masses, centroids, moments and limits of a link, from three formats."""
    pytest.importorskip("mujoco")
    moments = "<ixx>0.02</ixx><iyy>0.03</iyy><izz>0.04</izz><ixy>0.001</ixy>"
    texts = {
        "a.urdf": """<robot name="r"><link name="base"/><link name="arm"><inertial><origin xyz="0.1 0 0.2"/><mass value="3"/>
<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/><limit lower="-1" upper="2" effort="5" velocity="3"/></joint></robot>""",
        "a.sdf": f"""<sdf version="1.10"><model name="r"><link name="arm"><inertial><pose>0.1 0 0.2 0 0 0</pose><mass>3</mass><inertia>{moments}</inertia></inertial></link>
<joint name="j" type="revolute"><parent>world</parent><child>arm</child><axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis></joint></model></sdf>""",
        "a.xml": """<mujoco><compiler angle="radian"/><worldbody><body name="arm"><joint name="j" axis="0 0 1" range="-1 2" limited="true"/>
<inertial pos="0.1 0 0.2" mass="3" fullinertia="0.02 0.03 0.04 0.001 0 0"/></body></worldbody></mujoco>""",
    }
    for name, text in texts.items():
        path = tmp_path / name
        path.write_text(text)
        robot = seen(path)
        inertial, joint = robot.link_of["arm"].inertial, robot.joint_of["j"]
        assert inertial.mass == 3 and np.allclose(inertial.centroid, [0.1, 0, 0.2]), name
        assert np.allclose(inertial.in_link_axes, [[0.02, 0.001, 0], [0.001, 0.03, 0], [0, 0, 0.04]], atol=1e-7), name
        assert (joint.lower, joint.upper, joint.kind) == (-1, 2, "revolute"), name


SHAPES = {
    "box": ({"size": "0.2 0.4 0.6"}, (0.1, 0.2, 0.3)), "sphere": ({"radius": "0.3"}, (0.3, 0.3, 0.3)), "cylinder": ({"radius": "0.1", "length": "0.6"}, (0.1, 0.1, 0.3)),
    "capsule": ({"radius": "0.1", "length": "0.6"}, (0.1, 0.1, 0.4)), "mesh": ({"scale": "1 2 3"}, (1, 2, 3)),
}  # fmt: skip
TURNED = Rotation.from_euler("xyz", [0.4, -0.5, 0.6])
QUATERNION = " ".join(repr(float(x)) for x in TURNED.as_quat())
PLACES = {
    "angles": ('<origin xyz="1 2 3" rpy="0.4 -0.5 0.6"/>', "<pose>1 2 3 0.4 -0.5 0.6</pose>"),
    "quaternion": (f'<origin xyz="1 2 3" quat_xyzw="{QUATERNION}"/>', f'<pose rotation_format="quat_xyzw">1 2 3 {QUATERNION}</pose>'),
    "degrees": ("", "<pose degrees='true'>1 2 3 {!r} {!r} {!r}</pose>".format(*map(math.degrees, (0.4, -0.5, 0.6)))),
}


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("how", PLACES)
def test_places_and_shapes_of_both_formats(tmp_path, kind, how):
    sizes, expected = SHAPES[kind]
    urdf, sdf = PLACES[how]
    moments = {"ixx": 0.02, "iyy": 0.03, "izz": 0.04, "ixy": 1e-3, "iyz": 2e-3, "ixz": 3e-3}
    attributes = lambda of: " ".join(f'{k}="{x}"' for k, x in of.items())
    inside = lambda of: "".join(f"<{k}>{x}</{k}>" for k, x in of.items())
    mesh = kind == "mesh"
    shape = f"<geometry><{kind}>{inside(sizes | ({'uri': 'a.stl'} if mesh else {}))}</{kind}></geometry>"
    inertia = f"<inertial>{sdf}<mass>3</mass><inertia>{inside(moments)}</inertia></inertial>"
    texts = {"a.sdf": f'<sdf version="1.10"><model name="r"><link name="x">{inertia}<collision name="c">{sdf}{shape}</collision></link></model></sdf>'}
    if urdf:
        shape = f"<geometry><{kind} {attributes(sizes | ({'filename': 'a.stl'} if mesh else {}))}/></geometry>"
        inertia = f'<inertial>{urdf}<mass value="3"/><inertia {attributes(moments)}/></inertial>'
        texts["a.urdf"] = f'<robot name="r"><link name="x">{inertia}<collision name="c">{urdf}{shape}</collision></link></robot>'
    matrix = np.array([[0.02, 1e-3, 3e-3], [1e-3, 0.03, 2e-3], [3e-3, 2e-3, 0.04]])
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
        link = seen(tmp_path / name).link_of["x"]
        (shape,) = link.shapes
        assert tuple(shape.scale if mesh else shape.half_size) == pytest.approx(expected) and shape.kind == ("cylinder" if kind == "capsule" else kind)
        assert (link.inertial.mass, shape.name, shape.role, shape.uri) == (3, "c", "collision", "a.stl" if mesh else "")
        for rotation, place in ((link.inertial.rotation, link.inertial.centroid), (shape.rotation, shape.translation)):
            assert rotation == pytest.approx(TURNED.as_matrix(), abs=1e-12) and place == pytest.approx([1, 2, 3])
        assert link.inertial.moments == pytest.approx(matrix) and link.inertial.in_link_axes == pytest.approx(
            TURNED.as_matrix() @ matrix @ TURNED.as_matrix().T
        )
        assert link.inertial.rounding == pytest.approx(0.015)


def test_joints_of_both_formats(tmp_path):
    """Limits, damping, friction and what a joint follows, given and left out."""
    texts = {
        "a.urdf": """<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="j" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 3 4"/><limit lower="-1" upper="2" effort="5" velocity="3"/><dynamics damping="0.5" friction="0.25"/></joint>
<joint name="k" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><mimic joint="j" multiplier="-2" offset="0.5"/></joint></robot>""",
        "a.sdf": """<sdf version="1.11"><model name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="j" type="prismatic"><parent>a</parent><child>b</child><axis><xyz>0 3 4</xyz><limit><lower>-1</lower><upper>2</upper><effort>5</effort><velocity>3</velocity></limit><dynamics><damping>0.5</damping><friction>0.25</friction></dynamics></axis></joint>
<joint name="k" type="revolute"><parent>b</parent><child>c</child><axis><xyz>0 0 1</xyz><mimic joint="j"><multiplier>-2</multiplier><offset>0.5</offset><reference>0</reference></mimic></axis></joint></model></sdf>""",
    }
    for name, text in texts.items():
        for whole in (True, False):
            (tmp_path / name).write_text(
                text
                if whole
                else re.sub(
                    r' (multiplier|offset)="[^"]*"|<(multiplier|offset)>[^<]*</(multiplier|offset)>|<limit.*?(/>|</limit>)|<dynamics.*?(/>|</dynamics>)',
                    "",
                    text,
                )
            )
            j, k = (seen(tmp_path / name).joint_of[n] for n in "jk")
            assert (j.parent, j.child, j.axis.tolist(), j.line, k.line) == ("a", "b", [0, 3, 4], 2, 3)
            assert (j.lower, j.upper, j.effort, j.velocity, j.damping, j.friction) == ((-1, 2, 5, 3, 0.5, 0.25) if whole else (None,) * 6), name
            inertial = seen(tmp_path / name).link_of["a"].inertial
            assert (None if inertial is None else (inertial.mass, inertial.moments)) == (None if name == "a.urdf" else (1.0, None)), "SDF takes 1 kg"
            assert j.mimic is None and (k.mimic.leader, k.mimic.multiplier, k.mimic.offset) == (("j", -2, 0.5) if whole else ("j", 1, 0)), name


NUMBERS = [*"1. .5 +1 1e5 1E+5 -0 inf nan 1d0 1f 0x10 1_0 1,5 ٣ --1 1e 1e400 1e-5".split(), "", " 1 ", "1 2"]


@pytest.mark.filterwarnings("ignore::ksl.DescriptionWarning")
@pytest.mark.parametrize("text", NUMBERS)
def test_what_is_a_number_is_what_the_loader_reads(check, tmp_path, text):
    findings = check(changed(('mass value="1"', f'mass value="{text}"')), ignore="not-loaded")
    try:
        ksl.load(tmp_path / "robot.urdf", masses="optional")
        loaded = True
    except ksl.DescriptionError:
        loaded = False
    assert ("number-unreadable" in findings.rules) != loaded


@pytest.mark.parametrize("text, half", [("0.12", 0.005), ("3", 0.5), ("1.20e-3", 5e-6), ("-4.5", 0.05), ("x", 0.5), ("1e400", 0.0)])
def test_what_rounding_may_have_changed(text, half):
    assert half_unit(text) == pytest.approx(half)


def test_rounded_plates_are_only_a_warning(check):
    """A plate has Ixx + Iyy = Izz; printed with four digits, 0.0083 + 0.0017 may be 0.0101."""
    fore = 'ixx="0.0083" iyy="0.0084" izz="0.0017"'
    (finding,) = check(changed((fore, 'ixx="0.0083" iyy="0.010001" izz="0.0017"')))
    assert finding.rule == "inertia-triangle" and finding.severity == "warning" and "Rounding" in finding.cause


def test_an_impossible_inertia_beside_a_heavy_part_is_only_a_warning(check):
    """A sensor of 1 g that is welded to the arm, and the same on a joint of its own."""
    sensor = link("sensor", 0.001, moments='ixx="1e-6" iyy="1e-6" izz="9e-6"')
    (welded,) = check(more(sensor, hinge("j", "fore", "sensor", kind="fixed")))
    (moved,) = check(more(sensor, hinge("j", "fore", "sensor")))
    assert (welded.severity, moved.severity) == ("warning", "error")
