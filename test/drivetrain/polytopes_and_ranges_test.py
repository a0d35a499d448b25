"""Polytopes and boxes against linear programmes, and ranges against the geometry of rods."""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq, linprog

import ksl
from examples import JOINTS, ROBOTS, leg
from ksl.drivetrain.judged_limits import judged_limits
from ksl.drivetrain.region import usable_ranges, within


@pytest.mark.parametrize("name", JOINTS)
def test_polytopes_are_what_linear_programmes_reach(name):
    a = leg(name)
    limits = a.model.effort_limit[[a.model.joint(motor).v_index for motor in a.motors]]
    for q in a.usable(3, seed=1):
        J, vertices = a.jacobian(q), a.effort_polytope(q)
        assert len(vertices) == 2 ** len(a.motors)
        for direction in np.random.default_rng(2).normal(size=(6, len(a.joints))):
            best = linprog(-direction, A_ub=np.vstack([J.T, -J.T]), b_ub=np.tile(limits, 2), bounds=(None, None))  # |Jᵀ τ| ≤ limits
            assert_allclose((vertices @ direction).max(), -best.fun, rtol=1e-7)


@pytest.mark.parametrize("name", JOINTS)
@pytest.mark.parametrize("what", ["effort", "velocity"])
def test_boxes_are_inside_and_none_is_larger(name, what):
    """Each corner keeps the motors' limits; the gradient of the volume is a sum of those of limits that it reaches (Karush, Kuhn, Tucker), so that it is the largest."""
    a = leg(name)
    rows = [a.model.joint(motor).v_index for motor in a.motors]
    limits = (a.model.effort_limit if what == "effort" else a.model.velocity_limit)[rows]
    for q in a.usable(4, seed=5):
        half = (a.effort_box if what == "effort" else a.velocity_box)(q)[:, 1]
        to_motors = a.jacobian(q).T if what == "effort" else a.motor_jacobian(q)
        used = np.array([to_motors @ (s * half) for s in product((-1, 1), repeat=len(half))]) / limits
        assert np.abs(used).max() <= 1 + 1e-9
        reached = np.abs(used).max(axis=0) > 1 - 1e-7
        multipliers, rest, *_ = np.linalg.lstsq(np.abs(to_motors[reached]).T / limits[reached], 1 / half, rcond=None)
        assert (multipliers > -1e-6).all()
        assert_allclose(np.abs(to_motors[reached]).T / limits[reached] @ multipliers, 1 / half, rtol=1e-5)


def test_a_parallelogram_ends_where_its_links_are_in_line():
    """Both rods at once: determinants touch zero there and don't change their sign."""
    r = leg("two_rod_ankle").range("ankle_pitch", limits=False)
    assert_allclose([r.lower, r.upper], [-np.pi / 2, np.pi / 2], atol=1e-6)
    assert (r.lower_by, r.upper_by) == ("reach", "reach")


def test_a_knee_holds_until_its_rod_points_at_the_axis():
    a = leg("four_bar_knee")
    r = a.range("knee")
    assert (r.lower, r.lower_by, r.lower_name) == (pytest.approx(-0.05), "limit", "knee") and r.upper_by == "hold"
    Q, _, _ = a.state([r.upper])
    knee, top, end = (a.model.frame_pose(Q, "knee")[:3, 3], a.model.frame_pose(Q, "rod")[:3, 3], (a.model.frame_pose(Q, "rod") @ [0.02, 0, -0.32, 1])[:3])
    assert_allclose(np.cross(top - knee, end - top), 0, atol=1e-9)
    with pytest.raises(ValueError, match="knee_motor hold nothing there"):
        a.jacobian([r.upper])


def test_a_platform_reaches_until_a_crank_is_in_line_with_its_rod():
    a = leg("three_rod_platform")
    r = a.range("heave", limits=False)
    crank, rod, out = 0.06, 0.22, 0.12 - 0.06  # the ball is 0.06 m further out than the crank's pivot, and 0.22 m above it
    assert_allclose(r.upper, np.sqrt((crank + rod) ** 2 - out**2) - 0.22, atol=1e-6)
    assert r.upper_by == "reach"
    with pytest.raises(ValueError, match="of state 1: heave, pitch, roll = .* is out of reach"):
        a.motors_of([[0, 0, 0], [r.upper + 1e-4, 0, 0]])
    assert np.isfinite(a.motors_of([r.upper - 1e-6, 0, 0])).all()
    found = a.motors_of([[0, 0, 0], [r.upper + 1e-4, 0, 0]], unreachable="nan")
    assert np.isnan(found[1]).all() and np.isfinite(found[0]).all()


def test_next_to_where_both_rods_reach_their_ends_steps_are_shorter():
    """The path bends sharply there: beyond what is found there is no position."""
    a, roll = leg("two_rod_ankle"), -0.0147
    r = a.range("ankle_pitch", at=[-0.661, roll], limits=False)
    found = a.motors_of([[end + s, roll] for end in (r.lower, r.upper) for s in (1e-4, -1e-4)], unreachable="nan")
    assert (r.lower_by, r.upper_by) == ("reach", "reach") and np.isnan(found).all(axis=1).tolist() == [False, True, True, False]


def test_ends_are_looked_for_within_ten_lengths():
    """The platform a thousand times as large: ends of what slides are as far in its lengths."""
    large = lambda found: f'xyz="{" ".join(repr(1e3 * float(x)) for x in found[1].split())}"'
    axes = re.compile(r'(?<!<axis )xyz="([^"]*)"')
    a = ksl.load_string(axes.sub(large, (ROBOTS / "three_rod_platform.urdf").read_text())).actuation(JOINTS["three_rod_platform"])
    found, small = (x.range("heave", limits=False) for x in (a, leg("three_rod_platform")))
    assert_allclose([found.lower, found.upper], [1e3 * small.lower, 1e3 * small.upper], rtol=1e-6)


def test_ranges_without_an_end():
    assert leg("differential_wrist").range("roll", at=[0, 3]).upper == 6, "within a turn of where it begins"
    r = leg("differential_wrist").range("roll", limits=False)
    assert (r.lower, r.upper, r.lower_by, r.upper_by) == (-np.inf, np.inf, "none", "none")


@pytest.mark.parametrize("name", JOINTS)
def test_positions_are_used_a_little_away_from_where_efforts_have_no_bound(name):
    """5 % of a range, next to an end by reach or hold; nothing next to a limit; a turn where there is no end."""
    a = leg(name)
    at = a.joints_of(a.motors_of(np.zeros(len(a.joints))))
    for joint, found, centre in zip(a.joints, usable_ranges(a, at), at):
        r = a.range(joint, at=at)
        ends = np.clip([r.lower, r.upper], centre - np.pi, centre + np.pi)
        back = [0.05 * np.ptp(ends) * (by in ("reach", "hold")) for by in (r.lower_by, r.upper_by)]
        assert_allclose(found, ends + np.array([1, -1]) * back, atol=1e-12)


def test_positions_beyond_the_limit_of_a_ball_are_not_used():
    """Nor does it matter by how much motors turn at the start: those of the wrist by 314 rad for each metre."""
    a, q = leg("two_rod_ankle"), np.array([[0.0, 0.0], [0.5, 0.0]])
    for limits, used in (({}, [True, True]), ({"ball_left_top": 0.3}, [True, False])):
        assert within(a.model.actuation(a.joints, ball_limits=limits), q).tolist() == used
    assert within(leg("differential_wrist"), np.array([[0.0, 0.0], [0.05, 1.0]])).all()


def test_positions_are_used_down_to_a_tenth_of_what_holds_at_the_start():
    a = leg("four_bar_knee")
    share = lambda q: float(a.motor_jacobian([q])[0, 0] / a.motor_jacobian(a.start[a.of_joints])[0, 0])
    ends = a.range("knee").upper
    for wanted in (0.095, 0.105):
        assert within(a, np.array([[brentq(lambda q: share(q) - wanted, 0.5, ends - 1e-4)]])).tolist() == [wanted > 0.1]


def test_positions_are_used_within_limits_of_motors():
    """Of the box of both joints' ranges, in whose corners a motor turns by the sum of what they turn it."""
    text = (ROBOTS / "two_rod_ankle.urdf").read_text()
    for side in ("left", "right"):
        text = re.sub(rf'(<joint name="motor_{side}".*?<limit lower=)"[^"]*" upper="[^"]*"', r'\1"-0.2" upper="0.2"', text, count=1, flags=re.DOTALL)
    a = ksl.load_string(text).actuation(JOINTS["two_rod_ankle"])
    q = a.usable(100, seed=3)
    assert 20 < len(q) < 80 and np.abs(a.motors_of(q)).max() <= 0.2 + 1e-9 and (np.abs(q).max(axis=0) > 0.12).all()


def test_single_limits_are_those_of_polytopes_on_axes():
    """What a joint has alone: the box's side is no longer, and the polytope ends there."""
    a = leg("two_rod_ankle")
    for q in a.usable(3, seed=2):
        for what, to_motors in (("effort", a.jacobian(q).T), ("velocity", a.motor_jacobian(q))):
            rows = [a.model.joint(motor).v_index for motor in a.motors]
            limits = (a.model.effort_limit if what == "effort" else a.model.velocity_limit)[rows]
            alone, box = (a.effort_alone, a.effort_box) if what == "effort" else (a.velocity_alone, a.velocity_box)
            used = np.abs(to_motors * alone(q)) / limits[:, None]
            assert_allclose(used.max(axis=0), 1, rtol=1e-12)
            assert (box(q)[:, 1] <= alone(q)).all()


@pytest.mark.parametrize("what", ["effort", "velocity"])
def test_limits_of_a_file_are_judged_by_the_least_that_motors_give(what):
    """A thousandth is a file's rounding.  Joints that the file lacks, and numbers that it doesn't give, are not judged."""
    a = leg("two_rod_ankle")
    joint = a.model.joint("ankle_pitch")
    judge = lambda given: next(x for x in judged_limits(a, {"ankle_pitch": replace(joint, **{what: given})}) if x.what == what)
    first = judge(1.0)
    assert first.joint == "ankle_pitch"
    least, most = first.least, first.most
    assert least < most
    for given, judgement in ((0.99 * least, "too small"), (0.9995 * least, "true"), ((least + most) / 2, "partly too large"), (1.01 * most, "too large")):
        assert judge(given).judgement == judgement
    assert judged_limits(a, {}) == []
    assert what not in [x.what for x in judged_limits(a, {"ankle_pitch": replace(joint, **{what: None})})]
    text = (ROBOTS / "two_rod_ankle.urdf").read_text()
    unbounded = re.sub(rf'(<joint name="motor_left".*?){what}="[^"]*"', r"\1", text, count=1, flags=re.DOTALL)
    assert what not in [x.what for x in judged_limits(ksl.load_string(unbounded).actuation(JOINTS["two_rod_ankle"]))], "a motor has none"


def test_limits_are_not_judged_from_a_start_beyond_them():
    text = (ROBOTS / "four_bar_knee.urdf").read_text().replace('<limit lower="-0.4" upper="2.2"', '<limit lower="0.3" upper="2.2"')
    a = ksl.load_string(text).actuation(["knee"])
    rows = [row for row in judged_limits(a) if row.what in ("lower", "upper")]
    assert [row.judgement for row in rows] == ["not judged"] * 2 and "is beyond the limit of knee_motor; take a map with start=" in rows[0].reason
    assert "not judged" not in {row.judgement for row in judged_limits(a.model.actuation(["knee"], start=a.state([0.5])[0]))}


def test_balls_that_end_ranges():
    """A crank of the ankle swings its rod's upper ball by what the crank turns, less what the rod leans: at the end of the range the angle is the limit's."""
    a, most = leg("two_rod_ankle"), 0.3
    for ball, rod, carrier in (("ball_left_top", "rod_left", "crank_left"), ("ball_right_foot", "rod_right", "foot")):
        b = a.model.actuation(a.joints, ball_limits={ball: most})
        r = b.range("ankle_pitch")
        assert (r.upper_by, r.upper_name) == ("limit", ball) and r.upper < a.range("ankle_pitch").upper
        lines = []
        for Q in (a.start, b.state([r.upper, 0])[0]):
            along = b.swings[0].along
            lines.append(a.model.frame_pose(Q, carrier)[:3, :3].T @ a.model.frame_pose(Q, rod)[:3, :3] @ along)
        assert_allclose(np.arctan2(np.linalg.norm(np.cross(*lines)), np.dot(*lines)), most, rtol=1e-9)
        assert b.range("ankle_pitch", limits=False) == a.range("ankle_pitch", limits=False)
        assert b.range("ankle_roll", at=[r.upper + 0.1, 0]).upper_name == ball
        assert np.abs(b.usable(60)[:, 0]).max() < r.upper < np.abs(a.usable(60)[:, 0]).max()
        assert b.with_rotors.ball_limits == {ball: most}
    for limits, said in (
        ({"ankle_roll": 0.3}, "'ankle_roll' is no ball at the end of a rod of this mechanism: ball_left_foot, ball_left_top, ball_right_foot"),
        ({"ball_left_top": 4}, "expected an angle"),
        ([1], "expected"),
    ):
        with pytest.raises(ValueError, match=said):
            a.model.actuation(a.joints, ball_limits=limits)
