"""The repaired file: what is changed, what is left, and that the rest stays as it was."""

import numpy as np
import pytest
from files import ARM, changed, hinge, link, more, stl
from rules_test import CASES

import ksl
from ksl.base.errors import DescriptionError
from ksl.checks.run import RULES, fix
from ksl.output import OutputError

FIXED = [name for name, rule in RULES.items() if rule.fix]
ACCEPTED = [name for name, rule in RULES.items() if rule.accept and name != "xml-syntax"]

# cases of rules_test that the rule finds but can't repair, and ones that it can
REPAIRABLE = {
    "joint-type": changed(('"elbow" type="revolute"', '"elbow" type="Revolute"')),
    "link-undefined": changed(('<child link="fore"/>', '<child link="Fore"/>')),
    "mimic-unknown": more(link("f"), hinge("j", "fore", "f", '<mimic joint="Elbow"/>')),
    "mesh-missing": more(
        '<link name="x"><visual><geometry><mesh filename="Meshes/Cube.STL"/></geometry></visual></link>', hinge("j", "fore", "x", kind="fixed")
    ),
    "inertia-not-positive": changed(('ixx="0.0083" iyy="0.0084" izz="0.0017" ixy="0"', 'ixx="0.0083" iyy="0.0084" izz="0.0017" ixy="0.0084"')),
    "mimic-unknown, a prefix": more(link("f"), hinge("l_j1", "fore", "f"), link("g"), hinge("l_j2", "fore", "g", '<mimic joint="j1"/>')),
    "unknown-attribute": changed(('velocity="2"', 'velocty="2"')),
    "centroid-outside": changed(('<origin xyz="0 0 0.2"/>\n      <mass', '<origin xyz="0 0 200"/>\n      <mass')),
    "inertia-triangle": changed(('ixx="0.0083" iyy="0.0084" izz="0.0017"', 'ixx="0.0083" iyy="0.0110" izz="0.0017"')),
}


@pytest.fixture
def written(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "sub").mkdir()
    for file in ("cube.stl", "meshes/cube.stl", "sub/cube.stl"):
        (tmp_path / file).write_bytes(stl())

    def write(text):
        path = tmp_path / "robot.urdf"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.mark.parametrize("rule", FIXED)
def test_what_a_rule_repairs_is_sound_and_loads(written, rule, tmp_path):
    path = written(REPAIRABLE.get(rule, CASES[rule][0]))
    before = path.read_bytes()
    findings = ksl.check(path)
    assert findings.rules[rule] and any(f.fixable for f in findings if f.rule == rule), findings
    out = fix(path, tmp_path / "out.urdf")
    assert rule not in out.left.rules and len(out.left) < len(findings), out.left
    assert [f.rule for f, _ in out.changes].count(rule) >= 1 and all(change for _, change in out.changes)
    assert path.read_bytes() == before
    ksl.load(tmp_path / "out.urdf")


@pytest.mark.parametrize("rule", ACCEPTED)
def test_what_needs_a_decision_is_left_until_it_is_accepted(written, rule, tmp_path):
    path = written(REPAIRABLE.get(f"{rule}, a prefix", REPAIRABLE.get(rule, CASES[rule][0])))
    (finding,) = [f for f in ksl.check(path) if f.rule == rule]
    assert finding.acceptable and not finding.fixable
    left = fix(path, tmp_path / "left.urdf")
    assert rule in left.left.rules and not left.changes
    accepted = fix(path, tmp_path / "accepted.urdf", accept=rule)
    assert rule not in accepted.left.rules and len(accepted.changes) == 1


AROUND_THE_ROOT = {
    "nothing": ("", ""),
    "an end of the root in a comment": ("<!-- </robot> -->", "\n<!-- was: </robot> -->\n"),
    "several": ("", "<!-- </robot> --><!-- </robot><robot name='x'> -->\n\n"),
    "in instructions": ("<?a </robot>?>", "<?x </robot> <?y?>\n"),
    "in a comment behind a CDATA": ("", "<!-- <![CDATA[</robot>]]> </robot > -->"),
    "without a line end": ("", ""),
    "blank lines": ("\n\n", "\n\n\n"),
}


@pytest.mark.parametrize("before, after", AROUND_THE_ROOT.values(), ids=AROUND_THE_ROOT)
def test_what_is_written_is_well_formed_whatever_stands_around_the_root(written, tmp_path, before, after):
    inside = changed(('axis xyz="0 1 0"', 'axis xyz="0 3 4"')).split("?>\n")[1].rstrip().replace("</robot>", "<!-- </robot> --></robot>")
    out = fix(written(before + inside + after), tmp_path / "out.urdf")
    assert len(out.changes) == 1 and ksl.load(tmp_path / "out.urdf").nv
    assert (tmp_path / "out.urdf").read_text() == before + inside.replace("0 3 4", "0 0.6 0.8") + after


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_files_of_other_encodings_are_written_as_they_can_be_read(written, tmp_path, encoding):
    text = f'<?xml version="1.0" encoding="{encoding[:6]}"?>' + changed(('axis xyz="0 1 0"', 'axis xyz="0 3 4"')).split("?>")[1] + "<!-- </robot> -->"
    fix(written(text.encode(encoding)), tmp_path / "out.urdf")
    assert ksl.load(tmp_path / "out.urdf").nv and "</robot>" in (tmp_path / "out.urdf").read_bytes().decode(encoding)


def test_only_what_is_listed_changes(written, tmp_path):
    text = "<!-- by hand -->\n" + changed(('axis xyz="0 1 0"', 'axis xyz="0 3 4"')).split("?>\n")[1] + "<!-- end -->\n"
    fix(written(text), tmp_path / "out.urdf")
    lines = [(a, b) for a, b in zip(text.splitlines(), (tmp_path / "out.urdf").read_text().splitlines(), strict=True) if a != b]
    assert lines == [('    <axis xyz="0 3 4"/>', '    <axis xyz="0 0.6 0.8"/>')]


def test_accepted_numbers_by_hand(written, tmp_path):
    """28300 kg mm² are 0.0283 kg m²; 2000 g are 2 kg; 90 degrees are π/2; a bar about its end has m L²/3."""
    moments = 'ixx="0.0283" iyy="0.0283" izz="0.0033"'

    def repaired(rule, *pairs):
        fix(written(changed(*pairs)), tmp_path / "out.urdf", accept=rule, force=True)
        return ksl.load(tmp_path / "out.urdf")

    upper = repaired("inertia-units", (moments, 'ixx="28300" iyy="28300" izz="3300"')).link("upper")
    assert upper.inertia[:3] == pytest.approx([0.0283 + 2 * 0.04, 0.0283 + 2 * 0.04, 0.0033])
    upper = repaired("centroid-outside", ('<origin xyz="0 0 0.2"/>\n      <mass', '<origin xyz="20 -30 150"/>\n      <mass')).link("upper")
    assert np.array(upper.first_moment) / upper.mass == pytest.approx([0.02, -0.03, 0.15])
    assert repaired("mass-units", ('mass value="2"', 'mass value="2000"')).link("upper").mass == 2
    assert repaired("limit-units", ('lower="-2" upper="2"', 'lower="-90" upper="90"')).joint("elbow").upper == pytest.approx(np.pi / 2)
    slide = repaired("limit-units", ('"elbow" type="revolute"', '"elbow" type="prismatic"'), ('lower="-2" upper="2"', 'lower="-90" upper="80"')).joint("elbow")
    assert (slide.lower, slide.upper) == pytest.approx((-0.09, 0.08))
    upper = repaired("inertia-about-origin", (moments, 'ixx="0.1083" iyy="0.1083" izz="0.0033"')).link("upper")
    assert upper.inertia[:3] == pytest.approx([0.1083, 0.1083, 0.0033])  # about the origin, as they were meant


def test_a_chain_of_mimic_joints_keeps_its_motion(written, tmp_path):
    """q3 = 0.5 q2 + 0.1 and q2 = -2 q1 + 0.3: q3 = -q1 + 0.25."""
    path = written(
        more(
            link("a"),
            link("b"),
            hinge("j2", "fore", "a", '<mimic joint="elbow" multiplier="-2" offset="0.3"/>'),
            hinge("j3", "a", "b", '<mimic joint="j2" multiplier="0.5" offset="0.1"/>'),
        )
    )
    out = fix(path, tmp_path / "out.urdf")
    assert not out.left
    old, new = ksl.load(path), ksl.load(out.path)
    assert 'joint="elbow" multiplier="-1" offset="0.25"' in (tmp_path / "out.urdf").read_text()
    assert np.allclose(old.frame_pose([0.3, 0.7], "b"), new.frame_pose([0.3, 0.7], "b"), atol=1e-14)


def test_a_prefix_that_was_left_out(written, tmp_path):
    """Two hands of one macro: the leader is that of the same hand."""
    hands = [
        part for s in ("l", "r") for i in (1, 2) for part in (link(f"{s}_{i}"), hinge(f"{s}_j{i}", "fore", f"{s}_{i}", '<mimic joint="j1"/>' if i == 2 else ""))
    ]
    path = written(more(*hands))
    assert [f.repair for f in ksl.check(path)] == ["Did you mean l_j1?", "Did you mean r_j1?"]
    out = fix(path, tmp_path / "out.urdf", accept="mimic-unknown")
    assert not out.left and [ksl.load(out.path).joint(f"{s}_j2").leader for s in "lr"] == ["l_j1", "r_j1"]


def test_a_mounted_root_moves_as_before(written, tmp_path):
    path = written(CASES["root-inertial"][0])
    out = fix(path, tmp_path / "out.urdf", accept="root-inertial")
    old, new = ksl.load(path), ksl.load(out.path)
    assert new.links[0].name == "stand_mount" and new.links[0].mass == 0
    assert np.allclose(old.mass_matrix([0.3, 0.7]), new.mass_matrix([0.3, 0.7]), atol=1e-15)


def test_the_nearest_inertia_keeps_mass_and_centroid(written, tmp_path):
    path = written(REPAIRABLE["inertia-triangle"])
    fix(path, tmp_path / "out.urdf")
    old, new = ksl.load(path, masses="optional").link("fore"), ksl.load(tmp_path / "out.urdf").link("fore")
    assert (old.mass, old.first_moment) == (new.mass, new.first_moment)
    assert np.allclose(old.inertia, new.inertia, atol=6e-4)  # half the excess of 0.001


def test_the_original_is_never_overwritten(written, tmp_path):
    path = written(CASES["axis-not-unit"][0])
    with pytest.raises(OutputError, match="never overwritten"):
        fix(path, path, force=True)
    (tmp_path / "link.urdf").symlink_to(path)
    with pytest.raises(OutputError, match="never overwritten"):
        fix(path, tmp_path / "link.urdf", force=True)
    (tmp_path / "other.urdf").write_text("keep")
    with pytest.raises(OutputError, match="--force"):
        fix(path, tmp_path / "other.urdf")
    assert (tmp_path / "other.urdf").read_text() == "keep"
    fix(path, tmp_path / "other.urdf", force=True)
    assert "robot" in (tmp_path / "other.urdf").read_text()
    with pytest.raises(OutputError, match="is a folder"):
        fix(path, tmp_path)


def test_tags_are_closed_if_that_is_accepted(written, tmp_path):
    path = written(ARM.replace("</collision>", ""))
    (finding,) = ksl.check(path)
    assert finding.acceptable and finding.line == 15
    out = fix(path, tmp_path / "out.urdf", accept="xml-syntax")
    assert not out.left and len(ksl.load(out.path).links) == 3


def test_files_that_cannot_be_repaired(written, tmp_path):
    with pytest.raises(DescriptionError, match=":36: the XML is broken"):
        fix(written(CASES["xml-syntax"][0]), tmp_path / "out.urdf")
    with pytest.raises(DescriptionError, match="only URDF"):
        fix(written('<sdf version="1.10"><model name="m"><link name="a"/></model></sdf>'), tmp_path / "out.urdf")
    with pytest.raises(DescriptionError, match="what it hides would be lost"):
        fix(written(ARM[:-30]), tmp_path / "out.urdf", accept="xml-syntax")
    assert not (tmp_path / "out.urdf").exists()


def test_other_encodings_stay(written, tmp_path):
    text = changed(('<?xml version="1.0"?>', '<?xml version="1.0" encoding="ISO-8859-1"?>'), ("an arm", "Kölner Arm"), ('axis xyz="0 1 0"', 'axis xyz="0 3 4"'))
    fix(written(text.encode("latin-1")), tmp_path / "out.urdf")
    assert (tmp_path / "out.urdf").read_bytes() == text.replace("0 3 4", "0 0.6 0.8").encode("latin-1")
