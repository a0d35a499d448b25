"""Each rule has a file that it alone finds fault with, and one near it that is sound."""

import math
from types import SimpleNamespace
from xml.parsers import expat

import numpy as np
import pytest
from files import ARM, END, changed, hinge, link, more, stl
from loop_files import CASES as LOOPS

from ksl.checks.description.findings import STATUS
from ksl.checks.loop_rules import _list
from ksl.checks.rule import clipped
from ksl.checks.run import RULES

UPPER = 'ixx="0.0283" iyy="0.0283" izz="0.0033"'
FORE = 'ixx="0.0083" iyy="0.0084" izz="0.0017"'
ELBOW = '<limit lower="-2" upper="2" effort="50" velocity="2"/>'
BALL = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
FINGERS = [link("f1"), link("f2"), link("f3"), hinge("j1", "fore", "f1")]


def follower(name, parent, child, leader, inside="", kind="revolute"):
    return hinge(name, parent, child, f'<mimic joint="{leader}"{inside}/>', kind)


def visual(mesh, more=""):
    return f'<visual><geometry><mesh filename="{mesh}"{more}/></geometry></visual>'


def limbs(left, right):
    return more(link("hand_left", left), hinge("l", "fore", "hand_left"), link("hand_right", right), hinge("r", "fore", "hand_right"))


def wheel(moments):
    """A disc that turns about y, on whose collision the cylinder is turned, and its moments with or without the turn."""
    turned = '<collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision>'
    return link("x", 1.0, turned, moments), hinge("j", "fore", "x")


# rule: (a file that breaks it, one beside it that doesn't), with a cube.stl of 0.1 m in the folder
CASES = {
    "xml-syntax": (changed((END, END + "</robot>")), changed((END, END + "<!-- </robot> -->"))),
    "xml-encoding": (changed(("an arm", "Kölner Arm")).encode("latin-1"), changed(("an arm", "Kölner Arm"))),
    "xacro-unexpanded": (
        changed(('<robot name="arm">', '<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:property name="a" value="1"/>')),
        changed(('<robot name="arm">', '<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro">')),
    ),
    "number-unreadable": (changed(('mass value="1"', 'mass value="1,2"')), changed(('mass value="1"', 'mass value="1.2e0"'))),
    "element-repeated": (
        changed(('<child link="fore"/>', '<child link="fore"/><axis xyz="0 1 0"/>')),
        changed(('<child link="fore"/>', '<child link="fore"/><!-- <axis xyz="0 1 0"/> -->')),
    ),
    "unknown-tag": (changed(("<collision>", "<colision>"), ("</collision>", "</colision>")), changed((END, "<gazebo><anything/></gazebo>" + END))),
    "unknown-attribute": (changed(('effort="50"', 'effort="50" torque="50"')), changed(('effort="50"', 'effort="50" jerk="900"'))),
    "not-loaded": (changed(('<robot name="arm">', '<robot name="arm" version="3.0">')), changed(('<robot name="arm">', '<robot name="arm" version="1.0">'))),
    "name-missing": (more('<link name=""/>'), more('<link name="x"/>', hinge("j", "fore", "x", kind="fixed"))),
    "name-duplicate": (more(link("fore")), more(link("fore2"), hinge("j", "fore", "fore2"))),
    "name-case": (more(link("FORE"), hinge("j", "fore", "FORE")), more(link("FORE2"), hinge("j", "fore", "FORE2"))),
    "name-space": (changed(('"fore"', '"fore "')), ARM),
    "no-link": ('<robot name="none"/>', '<robot name="one"><link name="only"/></robot>'),
    "joint-incomplete": (changed(('<joint name="elbow" type="revolute">', '<joint name="elbow">')), ARM),
    "joint-type": (changed(('"elbow" type="revolute"', '"elbow" type="hinge"')), changed(('"elbow" type="revolute"', '"elbow" type="continuous"'))),
    "joint-type-extension": (more(link("x"), hinge("j", "fore", "x", kind="spherical")), more(link("x"), hinge("j", "fore", "x", kind="floating"))),
    "link-undefined": (more(hinge("j", "fore", "gripper", kind="fixed")), more(hinge("j", "fore", "gripper", kind="fixed"), '<link name="gripper"/>')),
    "joint-copied": (more(link("x"), *(hinge(name, "fore", "x", kind="floating") for name in "ij")), more(link("x"), hinge("i", "fore", "x", kind="floating"))),
    "joint-cycle": (
        more(link("a"), link("b"), hinge("j1", "a", "b"), hinge("j2", "b", "a")),
        more(link("a"), link("b"), hinge("j1", "a", "b"), hinge("j2", "fore", "a")),
    ),
    "link-unreachable": (more(link("lost")), more(link("lost"), hinge("j", "fore", "lost"))),
    "mass-negative": (changed(('mass value="1"', 'mass value="-1"')), ARM),
    "inertia-without-mass": (more(link("x", 0), hinge("j", "fore", "x", kind="fixed")), more('<link name="x"/>', hinge("j", "fore", "x", kind="fixed"))),
    "inertia-not-positive": (changed((FORE + ' ixy="0"', FORE + ' ixy="0.009"')), changed((FORE + ' ixy="0"', FORE + ' ixy="0.0001"'))),
    # 0.0083 + 0.0017 = 0.0100
    "inertia-triangle": (changed((FORE, 'ixx="0.0083" iyy="0.0110" izz="0.0017"')), changed((FORE, 'ixx="0.0083" iyy="0.0100" izz="0.0017"'))),
    "inertia-zero": (changed((FORE, 'ixx="0" iyy="0" izz="0"')), more(link("x", moments='ixx="0" iyy="0" izz="0"'), hinge("j", "fore", "x", kind="fixed"))),
    "inertia-placeholder": (
        more(link("x", moments='ixx="1" iyy="1" izz="1"'), hinge("j", "fore", "x")),
        more(link("x", 0.7, BALL, 'ixx="0.001" iyy="0.001" izz="0.001"'), hinge("j", "fore", "x")),
    ),
    "massless-end": (more('<link name="x"/>', hinge("j", "fore", "x")), more('<link name="x"/>', hinge("j", "fore", "x", kind="fixed"))),
    # welded to a link between two joints, it makes that a body without mass
    "mass-missing": (
        more(f'<link name="x">{BALL}</link>', hinge("j", "fore", "x"), link("y"), hinge("k", "x", "y")),
        more(f'<link name="x">{BALL}</link>', hinge("j", "fore", "x", kind="fixed")),
    ),
    "root-inertial": (changed(('<link name="stand"/>', link("stand"))), ARM),
    "centroid-outside": (changed(('<origin xyz="0 0 0.2"/>\n      <mass', '<origin xyz="0 0 0.8"/>\n      <mass')), ARM),
    # about the end, a bar of length L has 4 times the moment that it has about its centroid: 0.0283 + 2 · 0.2² = 0.1083
    "inertia-about-origin": (changed((UPPER, 'ixx="0.1083" iyy="0.1083" izz="0.0033"')), changed((UPPER, 'ixx="0.0400" iyy="0.0400" izz="0.0033"'))),
    "inertia-units": (changed((UPPER, 'ixx="28300" iyy="28300" izz="3300"')), ARM),
    "inertia-too-large": (changed((UPPER, 'ixx="0.55" iyy="0.56" izz="0.54"')), changed((UPPER, 'ixx="0.05" iyy="0.05" izz="0.0033"'))),
    "mass-units": (
        changed(('mass value="2"', 'mass value="2000"'), (UPPER, 'ixx="28.3" iyy="28.3" izz="3.3"')),
        changed(('mass value="2"', 'mass value="20"'), (UPPER, 'ixx="0.283" iyy="0.283" izz="0.033"')),
    ),
    "axis-zero": (changed(('axis xyz="0 1 0"', 'axis xyz="0 0 0"')), ARM),
    "axis-not-unit": (changed(('axis xyz="0 1 0"', 'axis xyz="0 1 1"')), changed(('axis xyz="0 1 0"', 'axis xyz="0 0.7071 0.7071"'))),
    "axis-missing": (changed(('<axis xyz="0 1 0"/>', "")), changed(('"elbow" type="revolute"', '"elbow" type="fixed"'), ('<axis xyz="0 1 0"/>', ""))),
    "mimic-unknown": (more(*FINGERS[:1], follower("j1", "fore", "f1", "elbo")), more(*FINGERS[:1], follower("j1", "fore", "f1", "elbow"))),
    "mimic-kind": (
        more(link("a"), link("b"), hinge("j1", "fore", "a", kind="planar"), follower("j2", "fore", "b", "j1")),
        more(link("a"), link("b"), hinge("j1", "fore", "a", kind="continuous"), follower("j2", "fore", "b", "j1")),
    ),
    "mimic-fixed": (more(link("a"), follower("j1", "fore", "a", "elbow", kind="fixed")), more(link("a"), follower("j1", "fore", "a", "elbow"))),
    "mimic-loop": (
        more(*FINGERS[:2], follower("j1", "fore", "f1", "j2"), follower("j2", "fore", "f2", "j1")),
        more(*FINGERS[:2], follower("j1", "fore", "f1", "elbow"), follower("j2", "fore", "f2", "elbow")),
    ),
    "mimic-chain": (
        more(*FINGERS[:2], follower("j1", "fore", "f1", "elbow"), follower("j2", "fore", "f2", "j1")),
        more(*FINGERS[:2], follower("j1", "fore", "f1", "elbow"), follower("j2", "fore", "f2", "elbow")),
    ),
    "dynamics-negative": (changed((ELBOW, ELBOW + '<dynamics damping="-0.1"/>')), changed((ELBOW, ELBOW + '<dynamics damping="0.1" friction="0"/>'))),
    "limit-missing": (changed((ELBOW, "")), changed(('"elbow" type="revolute"', '"elbow" type="continuous"'), (ELBOW, ""))),
    "limit-reversed": (changed(('lower="-2" upper="2"', 'lower="2" upper="-2"')), ARM),
    "limit-zero": (changed(('lower="-2" upper="2"', 'lower="0" upper="0"')), changed(('lower="-2" upper="2"', 'lower="0" upper="0.01"'))),
    "limit-units": (changed(('lower="-2" upper="2"', 'lower="-90" upper="90"')), changed(('lower="-2" upper="2"', 'lower="-12.5" upper="12.5"'))),
    "effort-zero": (changed(('effort="50"', 'effort="0"')), ARM),
    "velocity-zero": (changed(('effort="50" velocity="2"', 'effort="50" velocity="0"')), ARM),
    "limit-negative": (changed(('effort="50"', 'effort="-50"')), ARM),
    "mesh-uri": (
        more(link("x", inside=visual("sub\\cube.stl")), hinge("j", "fore", "x")),
        more(link("x", inside=visual("sub/cube.stl")), hinge("j", "fore", "x")),
    ),
    "package-missing": (
        more(link("x", inside=visual("package://nowhere/cube.stl")), hinge("j", "fore", "x")),
        more(link("x", inside=visual("cube.stl")), hinge("j", "fore", "x")),
    ),
    "mesh-missing": (
        more(link("x", inside=visual("sphere.stl")), hinge("j", "fore", "x")),
        more(link("x", inside=visual("cube.stl")), hinge("j", "fore", "x")),
    ),
    "mesh-unreadable": (
        more(link("x", inside=visual("short.stl")), hinge("j", "fore", "x")),
        more(link("x", inside=visual("cube.stl")), hinge("j", "fore", "x")),
    ),
    "mesh-units": (
        more('<link name="x">' + visual("cube.stl", ' scale="1000 1000 1000"') + "</link>", hinge("j", "fore", "x", kind="fixed")),
        more('<link name="x">' + visual("cube.stl", ' scale="2 2 2"') + "</link>", hinge("j", "fore", "x", kind="fixed")),
    ),
    "mesh-scales": (
        more('<link name="x">' + visual("cube.stl") + visual("cube.stl", ' scale="0.01 0.01 0.01"') + "</link>", hinge("j", "fore", "x", kind="fixed")),
        more('<link name="x">' + visual("cube.stl") + visual("cube.stl", ' scale="0.5 0.5 0.5"') + "</link>", hinge("j", "fore", "x", kind="fixed")),
    ),
    "portability": (changed(('mass value="1"', 'mass value="1 "')), changed(('mass value="1"', 'mass value=" 1"'))),
    "shape-size": (changed(('<box size="0.1 0.1 0.4"/>', '<box size="0.1 0 0.4"/>')), changed(('<box size="0.1 0.1 0.4"/>', '<box size="0.1 0.1 0.4"/>'))),
    "inertia-axis": (more(*wheel('ixx="0.0026" iyy="0.0026" izz="0.0050"')), more(*wheel('ixx="0.0026" iyy="0.0050" izz="0.0026"'))),
    "symmetry-mass": (limbs(1.0, 1.2), limbs(1.0, 1.04)),
    "transmission-unused": (
        more('<transmission name="t"><joint name="elbw"/></transmission>'),
        more('<transmission name="t"><joint name="elbow"/></transmission>'),
    ),
} | LOOPS

SDF = """<sdf version="1.10"><model name="m"><link name="a"><inertial><mass>1</mass>
<inertia><ixx>{ixx}</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></inertial></link>{more}</model></sdf>"""


@pytest.fixture(autouse=True)
def meshes(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "cube.stl").write_bytes(stl())
    (tmp_path / "sub/cube.stl").write_bytes(stl())
    (tmp_path / "short.stl").write_bytes(stl(declared=99))


def test_every_rule_has_a_case():
    assert set(CASES) | {"inertial-default"} == set(RULES)


def test_the_arm_is_clean(check):
    findings = check(ARM)
    assert not findings and findings.status == 0 and findings.summary == "no findings"


@pytest.mark.parametrize("rule", CASES)
def test_one_file_breaks_the_rule_and_no_other(check, rule):
    findings = check(CASES[rule][0])
    assert set(findings.rules) == {rule}, findings
    finding = findings[0]
    assert finding.severity == RULES[rule].severity and finding.condition == RULES[rule].condition
    assert finding.found and finding.cause and finding.repair
    assert finding.line is not None
    assert findings.status == STATUS[finding.severity]
    left = check(CASES[rule][0], ignore=rule)
    assert set(left.rules) <= {"not-loaded"}, "what the loader refuses stays an error"
    assert not check(CASES[rule][0], ignore=[rule, "not-loaded"])


@pytest.mark.parametrize("rule", CASES)
def test_the_file_beside_it_is_sound(check, rule):
    assert not check(CASES[rule][1])


def elements(text):
    """{(kind, name): lines from its begin to its end} of the links and joints of a file, of several with a name the last, by a parser of its own."""
    parser, found, opened = expat.ParserCreate(), {}, []

    def begin(tag, attributes):
        opened.append((tag, attributes.get("name", ""), parser.CurrentLineNumber))

    def end(_):
        tag, name, line = opened.pop()
        found["joint" if tag == "constraint" else tag, name] = range(line, parser.CurrentLineNumber + 1)

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.Parse(text)
    return found


@pytest.mark.parametrize("rule", CASES)
def test_a_finding_names_the_element_in_whose_lines_it_is(check, rule):
    text = CASES[rule][0]
    if rule in ("xml-syntax", "xml-encoding"):
        return
    for finding in check(text):
        assert (finding.kind in ("link", "joint")) == bool(finding.name) == (finding.place.endswith(f"{finding.kind} {finding.name}") and bool(finding.kind))
        if finding.kind:
            assert finding.line in elements(text)[finding.kind, finding.name]
        else:
            assert 0 < finding.line <= text.count("\n") + 1


ZERO = (
    "inertia-without-mass",
    "inertia-zero",
    "massless-end",
    "mass-missing",
    "axis-zero",
    "limit-zero",
    "effort-zero",
    "velocity-zero",
    "no-link",
    "loop-rigid",
)
ONE = (
    "xacro-unexpanded",
    "unknown-attribute",
    "inertia-placeholder",
    "root-inertial",
    "mimic-fixed",
    "mesh-uri",
    "loop-singular",
    "loop-drives",
    "loop-drives-unknown",
)
DIAGONAL = math.sqrt(0.1**2 + 0.1**2 + 0.4**2)
VALUES = dict.fromkeys(ZERO, 0.0) | dict.fromkeys(ONE, 1.0) | {
    "mass-negative": -1, "inertia-not-positive": 0.00835 - math.hypot(0.00005, 0.009), "inertia-triangle": 0.0110 - 0.0083 - 0.0017, "centroid-outside": 0.8 - 0.4 - DIAGONAL / 4,
    "inertia-units": math.sqrt((28300 + 28300 + 3300) / 2 / 2), "inertia-too-large": ((0.56 + 0.54 - 0.55) / 2 / 2) / (0.05 + DIAGONAL / 4) ** 2, "mass-units": 2000 / 0.004,
    "axis-not-unit": math.sqrt(2), "dynamics-negative": -0.1, "limit-reversed": 4, "limit-units": 90, "limit-negative": -50, "mesh-units": 100, "mesh-scales": 100, "symmetry-mass": 1 / 6,
    "loop-frames": 0.1, "loop-open-at-zero": 0.01, "loop-redundant": 3, "loop-limits": -2,
}  # fmt: skip
"""The numbers that break the conditions, of the files above; of other rules there are none, but for the distance that a loop stays open."""


@pytest.mark.parametrize("rule", CASES)
def test_the_number_that_breaks_the_condition(check, rule):
    (finding,) = [f for f in check(CASES[rule][0]) if f.rule == rule][:1]
    assert finding.value == (None if rule not in VALUES else pytest.approx(VALUES[rule], rel=1e-6, abs=1e-12)) or rule == "loop-open"


MORE = ("", ", and 1 more", ", and 2 more")
TOGETHER = {
    "unknown-tag": (lambda k: f'<link name="x{k}"><foo/></link>', MORE),
    "unknown-attribute": (lambda k: f'<link name="x{k}" foo="1"/>', MORE),
    "mesh-uri": (lambda k: f'<link name="x{k}">{visual("sub" + chr(92) + "cube.stl")}</link>', MORE),
    "portability": (lambda k: f'<link name="x{k}"><visual><origin xyz="0\t0 0"/>{BALL[11:-12]}</visual></link>', MORE),
    "package-missing": (lambda k: f'<link name="x{k}">{visual("package://nowhere/cube.stl")}</link>', ("with 1 mesh,", "with 2 meshes", "with 3 meshes")),
    "mimic-fixed": (lambda k: f'<link name="x{k}"/>', ("", ", and so do 1 more fixed joints", ", and so do 2 more fixed joints")),
    "inertia-placeholder": (lambda k: link(f"x{k}", moments='ixx="1" iyy="1" izz="1"'), ("", ", and so has 1 other link", ", and so have 2 other links")),
}
"""Rules that name several places in one finding: a link with such a place, and what is said of one to three of them."""


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("rule", TOGETHER)
def test_several_places_are_counted(check, rule, count):
    place, words = TOGETHER[rule]
    joint = follower if rule == "mimic-fixed" else hinge
    more_of = [part for k in range(count) for part in (place(k), joint(f"j{k}", "fore", f"x{k}", *["elbow"] * (joint is follower), kind="fixed"))]
    (finding,) = [f for f in check(more(*more_of)) if f.rule == rule]
    assert " more" not in finding.found or count > 1
    assert all((each in finding.found) == (each == words[count - 1] or not each) for each in words) and finding.name in ("x0", "j0", "")
    assert finding.value in (None, count) or rule == "inertia-placeholder"


@pytest.mark.parametrize(
    ("bounds", "rule", "value"),
    [
        ('upper="0.05"', None, None), ('lower="-0.05"', None, None), ('lower="0.05"', "limit-reversed", 0.05), ('upper="-0.05"', "limit-reversed", 0.05), ("", "limit-zero", 0.0), ('lower="0"', "limit-zero", 0.0),
        ('upper="13"', "limit-units", 13.0), ('lower="-13"', "limit-units", 13.0), ('lower="0.3" upper="0.3"', "limit-zero", 0.3),
    ],
)  # fmt: skip
def test_bounds_that_are_not_given_are_zero(check, bounds, rule, value):
    findings = check(changed(('lower="-2" upper="2" effort="50"', f'{bounds} effort="50"')))
    assert {f.rule: f.value for f in findings} == ({} if rule is None else {rule: pytest.approx(value)})


@pytest.mark.parametrize(("length", "found"), [(1, True), (199, True), (200, True), (201, False)])
def test_prefixes_that_are_found(check, length, found):
    """Of 200 letters at most, and up to the whole name of the joint that follows."""
    prefix = "p" * length
    fingers = more(link("x"), hinge(f"{prefix}one", "fore", "x"), link("y"), follower(prefix, "fore", "y", "one"))
    (finding,) = [f for f in check(fingers) if f.rule == "mimic-unknown"]
    assert (finding.repair == f"Did you mean {prefix}one?") == found == finding.acceptable


def test_what_is_too_long_is_cut():
    for length in (200, 600):
        assert clipped("x" * length, length) == "x" * length and clipped("x" * (length + 1), length) == "x" * length + "…" and clipped("a\n  b") == "a b"
    broken = list(
        RULES["axis-zero"].findings(SimpleNamespace(path="f", joints=[SimpleNamespace(kind="revolute", axis=np.zeros(3), axis_line=1, name="n" * 300)]))
    )
    assert broken[0].name == "n" * 200 + "…"


@pytest.mark.parametrize("count", range(8))
def test_lists_of_names(count):
    names = list("abcdefgh"[:count])
    expected = ["", "a", "a and b", "a, b and c", "a, b, c and d", "a, b, c, d and e", "a, b, c, d, e and 1 more", "a, b, c, d, e and 2 more"][count]
    assert _list(names) == expected and _list(names, "or") == expected.replace(" and ", " or ")


@pytest.mark.parametrize("count", [2, 7, 8, 20])
def test_long_chains_and_texts_are_shortened(check, count):
    """Eight joints of a chain, sixty letters of a number that is none."""
    chain = [part for k in range(count) for part in (link(f"x{k}"), follower(f"j{k}", "fore", f"x{k}", f"j{k - 1}" if k else "elbow"))]
    finding = [f for f in check(more(*chain)) if f.rule == "mimic-chain"][-1]
    leaders = [f"j{k}" for k in range(count - 2, -1, -1)] + ["elbow"]
    assert finding.found == "it mimics " + " → ".join(leaders if count <= 8 else [*leaders[:7], f"… ({count - 8} more)", leaders[-1]])
    (finding,) = [f for f in check(changed(('mass value="1"', f'mass value="{"y" * 4 * count}"'))) if f.rule == "number-unreadable"]
    assert finding.found == f'value of <mass> is "{"y" * min(60, 4 * count)}", expected a finite number'
    (finding,) = [f for f in check(changed(('axis xyz="0 1 0"', 'axis xyz="0 1,5"'))) if f.rule == "number-unreadable"]
    assert finding.found == 'xyz of <axis> is "0 1,5", expected 3 finite numbers; numbers have a decimal point'


@pytest.mark.parametrize(
    ("below", "words"),
    [
        (0, "no joint carries it; the root"),
        (1, "no joint carries it, and 1 link that hangs on it; the root"),
        (2, "no joint carries it, and 2 links that hang on it; the root"),
    ],
)
def test_what_hangs_on_a_link_that_nothing_carries(check, below, words):
    chain = [part for k in range(below) for part in (link(f"x{k}"), hinge(f"j{k}", f"x{k - 1}" if k else "lost", f"x{k}"))]
    (finding,) = check(more(link("lost"), *chain))
    assert finding.rule == "link-unreachable" and finding.found == f"{words} is stand"


def test_a_joint_of_the_same_name_is_no_copy_but_a_duplicate(check):
    twice = more(link("x"), *[hinge("j", "fore", "x", kind="floating")] * 2)
    assert "name-duplicate" in check(twice).rules and "joint-copied" not in check(twice).rules


def test_a_link_of_sdf_without_inertial(check):
    one = '<link name="b"/><joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint>'
    findings = check(SDF.format(ixx=0.02, more=one))
    assert set(findings.rules) == {"inertial-default"} and findings[0].name == "b"
    assert not check(SDF.format(ixx=0.02, more=""))


@pytest.mark.parametrize("number, told", [("-50", 0), (" 2e-4 ", 0), ("0", 1), ("", 2), ("fifty", 2), ("5 kg m²", 2), ("nan", 2), ("-0.0", 1)])
def test_rotor_and_gear_of_a_transmission(check, number, told):
    rotor = '<joint name="elbow"/><motorInertia>{}</motorInertia>'.format(number.replace("-", ""))
    transmission = f"<transmission>{rotor}<actuator><mechanicalReduction>{number}</mechanicalReduction></actuator></transmission>"
    assert check(more(transmission)).rules == ({"transmission-unused": told} if told else {})
    assert "transmission-unused" in check(more(transmission.replace("Inertia>", "Inertia>-1", 1))).rules


@pytest.mark.parametrize("joint, carried, told", [("continuous", "fixed", 1), ("continuous", "revolute", 0), ("revolute", "fixed", 0)])
def test_moments_of_a_wheel_whose_joint_turns_about_another_axis(check, joint, carried, told):
    shape = '<visual><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></visual>'  # round about y, as its moments are
    wheel = link("x", 1.0, shape, 'ixx="0.0026" iyy="0.0050" izz="0.0026"'), hinge("j", "fore", "x", kind=joint), link("y"), hinge("k", "x", "y", kind=carried)
    findings = check(more(*wheel))
    assert findings.rules.get("inertia-axis", 0) == told and all("turns about z" in f.found for f in findings if f.rule == "inertia-axis")


@pytest.mark.parametrize(
    "sign, named",
    [
        ("\xa0", "U+00A0, no-break space"),
        ("\u3000", "U+3000, ideographic space"),
        ("\u2212", "U+2212, minus sign"),
        ("\uff11", "U+FF11, fullwidth digit one"),
        ("\u200b", "zero width"),
    ],
)
def test_characters_that_look_like_blanks_and_digits(check, sign, named):
    for old in ('mass value="1', 'xyz="0 0 0.4', 'upper="2', 'size="0.1'):
        (finding,) = [f for f in check(changed((old, old + sign))) if f.severity == "error"]
        assert finding.rule == "number-unreadable" and named in finding.found
    assert "only looks" not in check(changed(('mass value="1', 'mass value="1 µg')))[0].found


@pytest.mark.parametrize("says", ["utf-16", "UTF-32", "ucs-4", "nope"])
@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_a_file_that_says_another_encoding_is_looked_at(check, tmp_path, says, encoding):
    from ksl.checks.run import fix

    text = changed(
        ('<?xml version="1.0"?>', f'<?xml version="1.0" encoding="{says}"?>'), ("an arm", "Kölner Arm"), ('axis xyz="0 1 0"', 'axis xyz="0 2 0"')
    ).encode(encoding)
    assert set(check(text).rules) == {"xml-encoding", "axis-not-unit"}
    (tmp_path / "a.urdf").write_bytes(text)
    assert not fix(tmp_path / "a.urdf", tmp_path / "b.urdf").left
    assert "Kölner Arm" in (tmp_path / "b.urdf").read_text("utf-8") and not check((tmp_path / "b.urdf").read_bytes())


@pytest.mark.parametrize("rule", ["mass-negative", "transmission-unused", "axis-not-unit"])
def test_a_file_with_a_namespace_is_looked_at(check, tmp_path, rule):
    """No rule saw a link."""
    from ksl.checks.run import fix

    text = changed(('<robot name="arm">', '<robot xmlns="http://www.ros.org" name="arm">'), text=CASES[rule][0])
    findings = check(text)
    assert findings.rules == {rule: 1} and findings[0].line == check(CASES[rule][0])[0].line
    (tmp_path / "a.urdf").write_text(text)
    fixed = fix(tmp_path / "a.urdf", tmp_path / "b.urdf")
    assert (tmp_path / "b.urdf").read_text() == (text if fixed.left else text.replace('xyz="0 1 1"', 'xyz="0 0.707106781187 0.707106781187"'))


SIZES = {
    "a box without size": "<box/>",
    "a negative box": '<box size="0.1 -0.1 0.1"/>',
    "a sphere without radius": "<sphere/>",
    "a sphere of nothing": '<sphere radius="0"/>',
    "a cylinder without length": '<cylinder radius="0.1"/>',
    "a cylinder without radius": '<cylinder length="0.1"/>',
    "a negative capsule": '<capsule radius="0.1" length="-1"/>',
    "a mesh of nothing": '<mesh filename="cube.stl" scale="0 0 0"/>',
    "no shape": "",
}
SDF_SIZES = {
    "a box without size": "<box/>",
    "a negative box": "<box><size>0.1 -0.1 0.1</size></box>",
    "a sphere without radius": "<sphere/>",
    "a cylinder of nothing": "<cylinder><radius>0</radius><length>1</length></cylinder>",
    "an ellipsoid without radii": "<ellipsoid/>",
    "a cone without length": "<cone><radius>1</radius></cone>",
    "a mesh of nothing": "<mesh><uri>cube.stl</uri><scale>0 0 0</scale></mesh>",
    "no shape": "",
}


@pytest.mark.parametrize("role", ["visual", "collision"])
def test_sizes_that_no_shape_has(check, role):
    for what, shape in SIZES.items():
        findings = check(more(link("x", inside=f"<{role}><geometry>{shape}</geometry></{role}>"), hinge("j", "fore", "x")))
        assert [f.name for f in findings if f.rule == "shape-size"] == ["x"], what
    for what, shape in SDF_SIZES.items():
        findings = check(SDF.format(ixx=0.02, more=f'<link name="b"><{role} name="c"><geometry>{shape}</geometry></{role}></link>'))
        assert [f.name for f in findings if f.rule == "shape-size"] == ["b"], what
    for several in ('<geometry><sphere radius="1"/><box size="1 1 1"/></geometry>', 2 * '<geometry><sphere radius="1"/></geometry>'):
        assert check(more(f'<link name="x"><{role}>{several}</{role}></link>', hinge("j", "fore", "x", kind="fixed"))).rules == {"element-repeated": 1}
    two = f'<link name="b"><{role} name="c"><geometry><sphere><radius>1</radius></sphere><plane/></geometry></{role}></link>'
    assert "element-repeated" in check(SDF.format(ixx=0.02, more=two)).rules
    assert "shape-size" in check(more(f'<link name="x"><{role}/></link>', hinge("j", "fore", "x", kind="fixed"))).rules
    for shape in ("ellipsoid", "cone", "plane", "heightmap", "x" * 300):  # those that URDF doesn't have ended with a fault in KSL
        assert (
            "unknown-tag" in check(more(f'<link name="x"><{role}><geometry><{shape}/></geometry></{role}></link>', hinge("j", "fore", "x", kind="fixed"))).rules
        )
    mirrored = f'<link name="x"><{role}><geometry><mesh filename="cube.stl" scale="1 -1 1"/></geometry></{role}></link>'
    assert not check(more(mirrored, hinge("j", "fore", "x", kind="fixed")))


@pytest.mark.parametrize(
    "old, new",
    [
        ('ixy="0" ixz="0" iyz="0"/>\n    </inertial>\n    <collision>', 'ixy="0 " ixz="0" iyz="0\t"/>\n    </inertial>\n    <collision>'),
        ('upper="2" effort', 'upper="2  " effort'),
        ('<origin xyz="0 0 0.4"/>', '<origin xyz="0\t0\t0.4"/>'),
        ('<box size="0.1 0.1 0.4"/>', '<box size="0.1\n0.1 0.4"/>'),
    ],
)
def test_numbers_that_readers_take_differently(check, tmp_path, old, new):
    from ksl.checks.run import fix

    text = changed((old, new))
    findings = check(text)
    assert findings.rules == {"portability": 1} and findings[0].fixable
    assert (", and 1 more numbers of it: a blank" in findings[0].found) == ("more" in findings[0].found) == old.startswith("ixy")
    (tmp_path / "a.urdf").write_text(text)
    assert not fix(tmp_path / "a.urdf", tmp_path / "b.urdf").left
    assert not check(changed((END, "<!-- <origin xyz='1\t2\t3'/> -->" + END)))


def test_moments_that_do_not_change_with_the_mass_are_those_of_a_template(check):
    moments = 'ixx="0.01" iyy="0.01" izz="0.01"'
    chain = [x for k, mass in enumerate((0.5, 1, 2, 5)) for x in (link(f"c{k}", mass, moments=moments), hinge(f"j{k}", f"c{k - 1}" if k else "fore", f"c{k}"))]
    (finding,) = check(more(*chain))
    assert finding.rule == "inertia-placeholder" and "in 4 links of 0.5 to 5 kg: c0, c1, c2, c3" in finding.found
    copies = [x for k in range(4) for x in (link(f"c{k}"), hinge(f"j{k}", "fore", f"c{k}"))]  # four equal fingers
    assert not check(more(*copies))


def test_names_of_sides_in_a_chain_are_none(check):
    names = ("link_s", "link_l", "link_u", "link_r", "link_b", "link_t")
    chain = [x for k, name in enumerate(names) for x in (link(name, 9.0 - k), hinge(f"j{k}", names[k - 1] if k else "fore", name))]
    assert not check(more(*chain))


def test_a_bumper_does_not_show_where_the_centroid_is(check):
    body = '<link name="x"><inertial><mass value="9"/><inertia ixx="0.3" iyy="0.31" izz="0.32" ixy="0" ixz="0" iyz="0"/></inertial>{}</link>'
    shape = '<visual{}><origin xyz="0.4 0 0"/><geometry><box size="0.05 {} 0.1"/></geometry></visual>'
    for name, width in ((' name="front_bumper"', "0.3"), ("", "0.1")):  # named so, or too small for 9 kg
        assert "centroid-outside" not in check(more(body.format(shape.format(name, width)), hinge("j", "fore", "x"))).rules
    assert "centroid-outside" in check(more(body.format(shape.format("", "0.3")), hinge("j", "fore", "x"))).rules
    # unnamed, on a body of 1 × 0.8 × 0.4 m by its moments: the bumper is a part of it
    large = body.replace('ixx="0.3" iyy="0.31" izz="0.32"', 'ixx="0.6" iyy="0.87" izz="1.23"')
    assert "centroid-outside" not in check(more(large.format(shape.format("", "0.3")), hinge("j", "fore", "x"))).rules


def test_a_computed_inertia_of_sdf_holds_no_placeholder(check):
    computed = '<link name="b"><inertial auto="true"><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>'
    assert set(check(SDF.format(ixx=0.02, more=computed)).rules) == {"not-loaded"}  # which says that KSL doesn't compute it
