"""Numbers of robot files that no machine has, in every format: refused, or named with the link or joint, and the line where the format has lines."""

import warnings

import pytest

import ksl
from ksl.base.judged import MASS, MOMENT, RATIO

BODY = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
URDF = f"""<robot name="r"><link name="w"/><link name="b">{BODY}</link><joint name="j" type="continuous"><parent link="w"/><child link="a"/></joint>
<link name="a"><inertial><mass value="{{mass}}"/><inertia ixx="{{moment}}" iyy="{{moment}}" izz="{{moment}}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="k" type="continuous"><parent link="a"/><child link="b"/><mimic joint="j" multiplier="{{multiplier}}" offset="{{offset}}"/></joint></robot>"""
SOLID = "<inertial><mass>{}</mass><inertia><ixx>{}</ixx><iyy>{}</iyy><izz>{}</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>"
AXIS = "<axis><xyz>0 0 1</xyz>{}</axis>"
SDF = f"""<sdf version="1.10" xmlns:drake="drake.mit.edu"><model name="r"><link name="b">{SOLID.format(1, 1, 1, 1)}</link><joint name="j" type="continuous"><parent>world</parent><child>a</child>{AXIS.format("")}</joint>
<link name="a">{SOLID.format("{mass}", *["{moment}"] * 3)}</link>
<joint name="k" type="continuous"><parent>a</parent><child>b</child>%s</joint></model></sdf>"""
OF_SDF = AXIS.format('<mimic joint="j"><multiplier>{multiplier}</multiplier><offset>{offset}</offset><reference>0</reference></mimic>')
OF_DRAKE = AXIS.format("") + '<drake:mimic joint="j" multiplier="{multiplier}" offset="{offset}"/>'
MJCF = """<mujoco><worldbody><body name="a">
<inertial pos="0 0 0" mass="{mass}" diaginertia="{moment} {moment} {moment}"/><joint name="j"/><body name="b"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="k"/></body></body></worldbody>
<equality><joint joint1="k" joint2="j" polycoef="{offset} {multiplier} 0 0 0"/></equality></mujoco>"""
FORMS = {"urdf": URDF, "sdf": SDF % OF_SDF, "drake": SDF % OF_DRAKE, "mjcf": MJCF}
USUAL = {"mass": 1.0, "moment": 1.0, "multiplier": 2.0, "offset": 0.1}
BAD = {
    "mass": (-1.0, "nan", "inf", 1e-160, 1e20, 1e160),
    "moment": (-1.0, "nan", "inf", 1e40, 1e160),
    "multiplier": (0, -0.0, "nan", "inf", "-inf", 1e-300, 1e13, -1e160),
    "offset": ("nan", "inf", 1e13, -1e160),
}
WHO = {"mass": "link a", "moment": "link a", "multiplier": "joint k", "offset": "joint k"}


def said_of(text):
    """What is refused, or what is warned of."""
    if "<mujoco" in text:
        pytest.importorskip("mujoco")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            ksl.load_string(text)
        except ksl.DescriptionError as e:
            return str(e)
    return "\n".join(str(w.message) for w in caught)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("what, number", [(what, number) for what, numbers in BAD.items() for number in numbers])
def test_a_number_that_no_machine_has_is_refused_or_named(form, what, number):
    assert said_of(FORMS[form].format(**USUAL)) == ""
    said = said_of(FORMS[form].format(**USUAL | {what: number}))
    line = "2" if what in ("mass", "moment") else "3"
    if form == "mjcf":  # MuJoCo's compiler refuses some, by its name of the element
        assert WHO[what] in said or "Element name 'a', id 1, line 1" in said
    else:
        assert WHO[what] in said and (f"<string>:{line}:" in said or f"(line {line})" in said), said


@pytest.mark.parametrize("form", ["urdf", "sdf"])
@pytest.mark.parametrize("what, least, most", [("mass", MASS.least, MASS.most), ("moment", None, MOMENT.most), ("multiplier", RATIO.least, RATIO.most)])
def test_bounds_are_those_of_formats_that_python_reads(form, what, least, most):
    moments = {"moment": "1e-30"} if what == "mass" else {}
    for edge, beyond in ((least, 0.99), (most, 1.01)):
        if edge is not None:
            assert said_of(FORMS[form].format(**USUAL | moments | {what: edge})) == ""
            assert f"{edge:g}" in said_of(FORMS[form].format(**USUAL | moments | {what: edge * beyond}))


@pytest.mark.parametrize(
    "kind, of_joint, of_axis", [("screw", "<screw_thread_pitch>inf</screw_thread_pitch>", ""), ("revolute", "", "<dynamics><damping>inf</damping></dynamics>")]
)
def test_infinity_stands_for_no_limit_alone(kind, of_joint, of_axis):
    """Elsewhere it was taken as if nothing were there: as a damping of 0, or a multiplier of 1."""
    text = (SDF % OF_SDF).format(**USUAL)
    limit = "<limit><lower>-inf</lower><upper>inf</upper><effort>inf</effort></limit>"
    joint = '<joint name="k" type="{}"><parent>a</parent><child>b</child>{}{}</joint></model></sdf>'
    start = text[: text.index('<joint name="k"')]
    assert said_of(start + joint.format("revolute", "", AXIS.format(limit))) == ""
    assert '"inf", not a finite number' in said_of(start + joint.format(kind, of_joint, AXIS.format(limit + of_axis)))
