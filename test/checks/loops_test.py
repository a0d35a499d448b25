"""What the rules of loops say: mechanisms that are rebuilt as they advise have fewer redundant constraints, and as many freedoms."""

import math

import ksl
import numpy as np
import pytest
from files import hinge as arm_hinge
from files import more
from linkages import FOURBAR, FREE_COUPLER, SLIDERCRANK, bricard
from loop_files import CASES, IDLE, IN_MJCF, IN_SDF, INERTIA, MOTOR, hinge, in_mjcf, in_sdf, planar, spatial

from ksl.checks.description import loop_positions
from ksl.checks.loop_advice import Change, advice, is_across_a_plane


def only(findings, rule):
    assert set(findings.rules) == {rule}, findings
    return findings[0]


def advised(m):
    joints = [*(j for j in m.joints if j.nv), *m.loops]
    found = advice(m, m.reactions_null_basis(m.close(m.neutral()).q, [j.name for j in joints]), joints)
    return {change.joint: change for change in found.changes}, found.left


def four_bar(kinds, drives=("A",)):
    """A planar four-bar linkage with axes along z, as the crank, rod and rocker of `planar`."""
    b = ksl.Builder("planar").add_link("ground")
    for name in ("crank", "rod", "rocker"):
        b.add_link(name, 1.0)

    def axes(name):
        kind = kinds.get(name, "revolute")
        return {"kind": kind} | ({} if kind == "spherical" else {"axis": (0, 0, 1)}) | ({"axis2": (1, 0, 0)} if kind == "universal" else {})

    b.add_joint("A", parent="ground", child="crank", **axes("A"))
    b.add_joint("B", parent="crank", child="rod", xyz=(0, 0.2, 0), **axes("B"))
    b.add_joint("E", parent="ground", child="rocker", xyz=(0.5, 0, 0), **axes("E"))
    at = [np.block([[np.eye(3), np.array([p]).T], [np.array([[0, 0, 0, 1.0]])]]) for p in ((0.5, 0, 0), (0, 0.2, 0))]
    return b.add_loop("D", predecessor="rod", successor="rocker", predecessor_pose=at[0], successor_pose=at[1], **axes("D")).build(
        masses="optional", drives=drives
    )


def test_the_mechanism_that_is_rebuilt_as_advised_has_no_redundant_constraints_and_moves_as_before():
    m = four_bar({})
    changes, left = advised(m)
    assert changes == {"D": Change("D", "spherical", 2), "B": Change("B", "cylindrical", 1)} and left == 0
    q = m.integrate(m.neutral(), [0.3, 0.1, 0.2])
    for kinds, redundant in (({}, 3), ({"D": "spherical"}, 1), ({name: change.kind for name, change in changes.items()}, 0)):
        rebuilt = four_bar(kinds)
        turned = np.insert(q, 2, 0.0) if kinds.get("B") == "cylindrical" else q
        freedoms = rebuilt.mobility(rebuilt.close(turned).q)
        assert (freedoms.mobility, freedoms.redundant) == (1, redundant), kinds


@pytest.mark.parametrize("drives", [None, [], ["A"], ["B"], ["E"], ["A", "B"]])
def test_joints_with_a_motor_stay_as_they_are(drives):
    """Loop joints change first, those of the ground last; and what is advised leaves nothing redundant where other joints can still change."""
    changes, left = advised(four_bar({}, drives))
    other = next(name for name in "BAE" if name not in (drives or ()))
    assert left == 0 and changes == {"D": Change("D", "spherical", 2), other: Change(other, "cylindrical", 1)}
    rebuilt = four_bar({name: change.kind for name, change in changes.items()}, drives)
    assert rebuilt.mobility(rebuilt.close(rebuilt.neutral()).q).redundant == 0


@pytest.mark.parametrize("seed", range(4))
def test_patterns_across_a_plane(seed):
    """Forces along one direction of the world and moments across it, in the axes of three joints; and one component more, which is in the plane."""
    rng = np.random.default_rng(seed)
    normal, *plane = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    axes = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(3)]

    def pattern(force, moment):
        return [np.concatenate([R.T @ (force * rng.normal()), R.T @ (moment * rng.normal())]) for R in axes]

    across = np.array([pattern(normal, plane[0]), pattern(normal, plane[1]), pattern(0 * normal, plane[0])])
    for patterns in (across, across[2:], np.array([pattern(normal, 0 * normal)]), np.array([pattern(0 * normal, plane[1]), pattern(0 * normal, plane[0])])):
        assert is_across_a_plane(patterns, axes)
    for size, is_zero in ((0.99e-7, True), (1.01e-7, False)):
        small = np.array([np.concatenate([0 * normal, R.T @ (size * normal * sign)]) for R, sign in zip(axes, (0.5, -1, 0), strict=True)])
        assert is_across_a_plane(np.concatenate([across, small[None]]), axes) == is_zero
    for force, moment in ((plane[0], 0 * normal), (0 * normal, normal)):
        wrong = np.array(pattern(force, moment))[None]
        assert not is_across_a_plane(np.concatenate([across, 1e-6 * wrong / np.abs(wrong).max()]), axes)
        assert is_across_a_plane(np.concatenate([across, 1e-9 * wrong / np.abs(wrong).max()]), axes)


def test_what_a_change_to_a_universal_joint_removes():
    """With two balls in place of hinges the rod turns about itself; a universal joint leaves that out, and the constraint across it is not redundant."""
    changes, left = advised(four_bar({"B": "spherical"}))
    assert left == 0 and changes["D"].kind == "cylindrical" and set(changes) == {"D"}
    changes, left = advised(four_bar({"B": "universal", "E": "cylindrical"}))
    assert left == 0 and (changes["D"].kind, changes["D"].second_axis) == ("universal", (0, 1, 0))


def test_redundant_constraints_are_named_with_their_loop_and_the_change(check):
    finding = only(check(planar()), "loop-redundant")
    assert finding.name == "D" and finding.value == 3 and finding.severity == "note"
    assert (
        "3 of its 5 equations follow from the others; not determined are force along the axis, moment across the axis; of A, B and E some, too" in finding.found
    )
    assert "Make D spherical (2 fewer) and B cylindrical (1 fewer): the mechanism moves as before, and nothing is redundant then." in finding.repair


def test_a_planar_linkage_is_normal_practice(check):
    """Parallel axes need no more than that; a third crank needs lengths that agree in the plane, too, and a second hinge of a door one line."""
    assert check(planar()).status == 0 and "planar linkage" in only(check(planar()), "loop-redundant").cause
    third = f'<link name="crank3">{INERTIA}</link>' + hinge("G", "ground", "crank3", "0.25 0 0")
    pin = '<constraint name="H" type="continuous"><parent link="rod"/><parent_origin xyz="0.25 0 0"/><child link="crank3"/><child_origin xyz="0 0.2 0"/><parent_axis xyz="0 0 1"/></constraint>'
    findings = check(planar().replace("</robot>", third + pin + "</robot>"))
    finding = only(findings, "loop-redundant")
    assert findings.status == 1 and finding.severity == "warning" and finding.value == 7 and "of D and H follow from the others" in finding.found
    upper = '<constraint name="upper" type="continuous"><parent link="ground"/><parent_origin xyz="0 0 1"/><child link="leaf"/><child_origin xyz="0 0 1"/><parent_axis xyz="0 0 1"/></constraint>'
    leaf = f'<robot name="door"><link name="ground"/><link name="leaf">{INERTIA}</link>{hinge("A", "ground", "leaf")}{upper}{MOTOR}</robot>'
    assert only(check(leaf), "loop-redundant").severity == "warning"


def test_loops_that_share_joints_are_one_finding(check):
    """A second rocker on the same rod, at a point that has no crank of that length."""
    second = (
        f'<link name="more">{INERTIA}</link><link name="end">{INERTIA}</link>' + hinge("G", "rod", "more", "0.2 0 0") + hinge("I", "ground", "end", "0.9 0.1 0")
    )
    pin = '<constraint name="H" type="continuous"><parent link="more"/><parent_origin xyz="0.4 0.1 0"/><child link="end"/><child_origin xyz="-0.3 0.2 0"/><parent_axis xyz="0 0 1"/></constraint>'
    finding = only(check(planar().replace("</robot>", second + pin + "</robot>")), "loop-redundant")
    assert finding.name == "D" and finding.value == 6 and finding.severity == "note"
    assert "6 of the 10 equations of D and H follow from the others; not determined are force along the axis, moment across the axis of D; of" in finding.found
    assert finding.repair.count("spherical") == 2 and finding.repair.count("cylindrical") == 2 and "nothing is redundant then" in finding.repair


def test_one_pattern_alone_does_not_make_a_linkage_planar(check):
    """A loop with one pattern has one force in all its joints; the six axes of Bricard's mechanism have three directions, and it moves by its dimensions."""
    finding = only(check(bricard(drives=["hinge0"]).to_urdf()), "loop-redundant")
    assert finding.severity == "warning" and finding.value == 1 and "planar" not in finding.cause and "because of its dimensions" in finding.cause


def test_every_rule_has_a_case_in_the_formats_that_can_break_it():
    assert set(IN_MJCF) == set(CASES) and set(IN_SDF) == set(CASES) - {"loop-frames", "loop-open", "loop-open-at-zero"}


@pytest.mark.parametrize("rule", IN_SDF)
def test_rules_in_sdf(check, rule):
    text, drives = IN_SDF[rule]
    finding = only(check(text, "robot.sdf", drives=drives), rule)
    of = "E" if rule == "loop-limits" else "D"
    assert finding.name == of and finding.line == 1 + text[: text.index(f'<joint name="{of}"')].count("\n")
    assert not check(in_sdf(), "robot.sdf", drives=["A"])


@pytest.mark.parametrize("rule", IN_MJCF)
def test_rules_in_mjcf(check, rule):
    pytest.importorskip("mujoco")
    finding = only(check(IN_MJCF[rule], "robot.xml"), rule)
    assert (finding.name, finding.line) == ("E", 1) if rule == "loop-limits" else finding.name.startswith("D") and finding.line == 2
    assert not check(in_mjcf(), "robot.xml")


@pytest.mark.parametrize(("name", "text"), [("robot.sdf", in_sdf()), ("robot.xml", in_mjcf())])
def test_a_loop_of_a_file_beside_the_robot(check, tmp_path, name, text):
    if name.endswith("xml"):
        pytest.importorskip("mujoco")
    beside = tmp_path / "loops.toml"
    beside.write_text('[[loop]]\nname = "K"\nkind = "spherical"\npredecessor = "rod"\nsuccessor = "rocker"\npredecessor_xyz = [0.1, 0.2, 5]\n')
    findings = check(text, name, loops=beside, drives=["A"])
    assert findings.rules.get("loop-open") and "K" in {f.name for f in findings.errors}


def test_numbers_of_few_digits(check):
    """π/2 as 1.5708 in a loop that closes only where axes are parallel, and a length of six digits where the others have all: made exact, and fewer digits."""
    quarter = lambda angle: planar(f"{angle} 0 0").replace('<parent_origin xyz="0.5 0 0"', '<parent_origin xyz="0.5 0 0" rpy="1.57079632679489662 0 0"')
    for text, size in ((quarter("1.5708"), 1.5708 - math.pi / 2), (planar(rod="0.5 0 0.000001"), 1e-6)):
        found = check(text)
        (note,) = (f for f in found if f.rule == "loop-frames")
        assert size * 0.49 < note.value < size * 1.01 and "1.5708 stands for π/2" in note.cause and note.severity == "note" and not found.errors
    finding = only(check(quarter("1.571")), "loop-frames")
    assert finding.value == pytest.approx(1.571 - math.pi / 2, rel=1e-6) and finding.severity == "error"


def test_drives(check):
    assert "1 drive, A, for 2 freedoms: with the drives at rest 1 is left, of" in only(check(IDLE), "loop-drives").found
    both = MOTOR + MOTOR.replace('"A"', '"E"').replace('"t"', '"u"')
    finding = only(check(spatial(motors=both)), "loop-drives")
    assert "2 drives, A and E, for 1 freedom: 1 more than the motion needs" in finding.found and finding.severity == "note"
    of_loop = [f for f in check(spatial(motors=MOTOR.replace('"A"', '"D"'))) if f.rule == "transmission-unused"]
    assert [f.found for f in of_loop] == ['transmission "t" is of joint "D", which closes a loop, and so is no drive']
    limit = '<limit lower="-1" upper="1" effort="0" velocity="1"/></joint>'
    zero = spatial().replace("</joint>", limit)
    assert [f.name for f in check(zero) if f.rule == "effort-zero"] == ["A"], "the others have no motor"
    assert "loop-drives" not in check(FREE_COUPLER.replace("</robot>", MOTOR + "</robot>")).rules, "what a loop ties down counts as no drive"
    assert "candidates: A, B, C or E" in only(check(spatial(motors="")), "loop-drives-unknown").found


def test_distances_have_the_unit_of_the_number_that_is_meant(check):
    """Of a ball joint rad, though its orientation has four numbers."""
    ball = (
        spatial(rod="-0.1 0.2 0.4")
        .replace('<joint name="B" type="continuous">', '<joint name="B" type="spherical">')
        .replace('<joint name="C" type="continuous">', '<joint name="C" type="fixed">')
    )
    found = next(f.found for f in check(ball) if f.rule == "loop-open-at-zero")
    assert found.endswith(" has B 0.313 rad from there"), found


@pytest.mark.parametrize("text", [SLIDERCRANK, FOURBAR])
def test_motions_keep_the_loops_closed(text):
    """An orthonormal basis, of sliding coordinates in lengths of the mechanism."""
    m = ksl.load_string(text)
    found = loop_positions.LoopPositions(m)
    lengths = np.array([found.length if joint.unit == "m" else 1.0 for joint in m.joints if joint.nv])
    for angle in (0.3, 2.0):
        q = m.close(np.array([angle, -angle, 0.3]), hold=["A"]).q
        basis = found.motions(q)
        assert (
            basis.shape == (3, 1)
            and basis.T @ basis == pytest.approx(np.eye(1))
            and m.loop_jacobian(q) @ (lengths[:, None] * basis) == pytest.approx(0, abs=1e-9)
        )


def test_turns_of_joints_are_none():
    """How far a position is from zero, of hinges that may turn and turn."""
    m = ksl.load_string(planar())
    found = loop_positions.LoopPositions(m)
    for angle, away in ((0.1, 0.1), (3.0, 3.0), (-3.0, -3.0), (4.0, 4 - 2 * math.pi), (-4.0, 2 * math.pi - 4), (2 * math.pi + 0.2, 0.2)):
        assert found.moved(m.neutral() + angle) == pytest.approx(np.full(3, away))
    slide = loop_positions.LoopPositions(ksl.load_string(SLIDERCRANK))
    assert slide.moved(np.array([0.0, 7.0, 7.0])) == pytest.approx([0, 7 - 2 * math.pi, 7]), "m are no turns"


def test_a_dead_centre_of_the_drive(check):
    """The rocker moves the ball along x, across the rod, which then keeps its length while the crank rests."""
    finding = only(check(spatial(crank="0.1 0.05 0", rod="0 0.25 0.4")), "loop-drives")
    assert "a dead centre at the closed position nearest to zero, where B and E can move" in finding.found and finding.severity == "note"


def test_notes_leave_the_exit_status_zero(check):
    findings = check(spatial(motors=""))
    assert findings.status == 0 and findings.summary == "1 note" and len(findings.notes) == findings.as_dict()["notes"] == 1


def test_a_second_joint_of_a_link_closes_a_loop_at_its_line(check):
    finding = only(check(more(arm_hinge("second", "stand", "fore"))), "loop-open")
    assert finding.name == "second" and finding.line == 36 and finding.found.startswith("open by 0.4 m at the zero position")


def test_mechanisms_that_are_too_large_are_said(check, monkeypatch):
    monkeypatch.setattr(loop_positions, "MOST", 3)
    findings = check(spatial(motors=""))
    assert not findings and "4 equations or coordinates are more than 3" in findings.not_checked[0]
