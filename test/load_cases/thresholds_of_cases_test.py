"""Thresholds and defaults of load cases, each just below and just above, and numbers that a hand computes."""

import hashlib
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest

from ksl.base.files_read import InputFile
from ksl.base.errors import CaseError, MotionError
from ksl.load_cases import case_file, load_case
from ksl.load_cases.case_file import cases_of_text
from ksl.load_cases.case_result import compute
from ksl.load_cases.closed_mechanism import closed_mechanism
from ksl.load_cases.closed_poses import closed_pose, reach_of
from ksl.load_cases.force_elements import element_ranges
from ksl.load_cases.holding import WorstPose, _nearest, _range, read_pose, worst_pose
from ksl.load_cases.load_case import LoadCase, Payload, Placement
from ksl.load_cases.motion_given import motion_given
from ksl.load_cases.poses import neutral, pose_of
from ksl.load_cases.provenance import Provenance, joint_description, provenance_of
from ksl.load_cases.quantities import PowerBalance, first_extreme, power_round_off, rms, summarise, joint_loads, unit, untold, work
from ksl.load_cases.ranking import Ranking
from ksl.load_cases.simulate_keys import simulated_of
from ksl.load_cases.simulated import Simulated, _notes, samples_of, simulated_motion
from ksl.load_cases.stops import Stop, worst_start
from ksl.load_cases.summary_table import worst_rows
from ksl.load_cases.undetermined import _quantities
from ksl.load_cases.wrench_table import wrenches_of_arrays
from ksl.load_cases.wrenches_over_time import WrenchOverTime
from ksl.load_cases.verdict import Use, Verdict, not_given, number, percent, uses_of
from ksl.mechanism.mechanism import Joint
from ksl.motions.closing import Closing
from ksl.motions.motion import Motion
from linkages import FOURBAR, SLIDERCRANK

LIMITS = {"lower": -1.0, "upper": 3.0, "velocity": 4.0, "effort": 20.0}


def joint(name="pin", kind="revolute", angle=True, **more) -> Joint:
    return Joint(name, kind, "wall", "rod", 1, 1, 0, 0, (0.0, 1.0, 0.0), has_axis=True, has_angle=angle, has_limits=True, **more)


def use(share, quantity="effort", case="a", name="pin", column=None):
    return Use(case, name, quantity, column or name, share, 20 * share, 20.0, "effort", "N m", 0.5)


# the verdict


@pytest.mark.parametrize(
    ("quantity", "green", "amber"), [("position", 0.95, 0.9501), ("speed", 0.8, 0.8001), ("effort", 0.8, 0.8001), ("position", 0.0, 1 + 0.9e-9)]
)
def test_colours(quantity, green, amber):
    assert [use(x, quantity).level for x in (green, amber, 1 + 0.9e-9, 1 + 1.1e-9)] == ["green", "amber", "amber", "red"]


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.00099, "<0.1 %"),
        (0.001, "0.1 %"),
        (9.994, "999.4 %"),
        (10, "1,000 %"),
        (1 + 0.9e-9, "100.0 %"),
        (1 + 1.1e-9, "100 %"),
        (1.0004, "100.04 %"),
        (-0.5, "-50.0 %"),
    ],
)
def test_percentages(share, text):
    assert percent(share) == text


def test_what_is_said_of_several_cases_and_joints():
    assert Verdict((use(0.4), use(1.5, case="b"))).headline == "pin uses 150.0 % of its effort limit (30 of 20 N m) at 0.5 s, case b"
    assert Verdict((use(1.2), use(1.5, name="hip"))).headline == "hip uses 150.0 % of its effort limit (30 of 20 N m) at 0.5 s; 2 joints exceed limits"
    assert use(1.5, "position", column="pin.x").exceeded == "pin: x 30 N m is beyond the effort limit 20 N m"
    assert str(use(0.5, "position")) == "pin uses 50.0 % of its position range (10 N m, effort limit 20 N m) at 0.5 s"
    both = Verdict((use(0.3), use(0.2, case="b"), use(0.9, name="hip"), use(0.1, "speed")))
    assert {name: x.share for name, x in both.of("pin").items()} == {"effort": 0.3, "speed": 0.1}


@pytest.mark.parametrize(("count", "said"), [(4, "a, b, c, d"), (5, "a, b, c, d and 1 more")])
def test_names_in_a_sentence(count, said):
    lacking = [joint(name, **LIMITS | {"effort": None}) for name in "abcde"[:count]]
    line = f"no effort limit of {said} in the robot's file (or 0): not compared"
    assert not_given([*lacking, joint("z", **LIMITS)]) == [line]
    assert not_given([*lacking, joint("z", **LIMITS), joint("y")], drives=[*"abcde", "z"]) == [line], "y has no drive"
    assert not_given(lacking) == ["no effort limit of any joint in the robot's file (or 0): not compared"]
    assert not_given(lacking[:1]) == ["no effort limit of a in the robot's file (or 0): not compared"]


@pytest.mark.parametrize(
    ("lower", "upper", "ends", "share", "value"),
    [
        (-1, 3, (0.0, 2.5), 0.75, 2.5), (-1, 3, (-0.8, 2.5), 0.9, -0.8), (None, 0.5, (0.0, 0.4), 0.9, 0.4), (None, 4, (0.0, 5.0), 1.25, 5.0),
        (-2, None, (-2.5, 7.0), 1.25, -2.5), (0.25, None, (0.75, 7.0), 0.5, 0.75), (-1, 3, (-1.2, 3.4), 1.1, -1.2),
    ],
)  # fmt: skip
def test_shares_of_positions(lower, upper, ends, share, value):
    """Of a half range, or of one bound in units of its size, 1 rad at least; both where both are beyond."""
    row = {"case": "c", "position_lowest": ends[0], "position_lowest_time": 0.0, "position_highest": ends[1], "position_highest_time": 1.0}
    found = uses_of(joint(lower=lower, upper=upper), row, np.arange(2.0), np.zeros((2, 1)))
    assert (found[0].share, found[0].value, found[0].case) == (pytest.approx(share), value, "c")
    assert [x.which for x in found] == (["lower", "upper"] if ends == (-1.2, 3.4) else ["lower" if value in ends[:1] else "upper"])
    assert found[-1].time == (0.0 if found[-1].which == "lower" else 1.0)


def test_positions_of_a_joint_with_several_coordinates():
    narrow = Joint("p", "planar", "a", "b", 3, 3, 0, 0, (0.0, 0.0, 1.0), limits=((0.5, 0.5), (None, None), (None, None)))
    assert [x.share for x in uses_of(narrow, {"case": "c"}, np.arange(2.0), np.array([[0.5, 0, 0], [0.75, 0, 0]]))] == [1.25]
    planar = Joint("p", "planar", "a", "b", 3, 3, 2, 2, (0.0, 0.0, 1.0), limits=((-1.0, 1.0), (None, None), (0.0, 4.0)))
    q = np.zeros((3, 5))
    q[:, 2:] = [[0, 0, 3.5], [0.2, 9, 0.5], [-0.9, 0, 1]]
    found = [(x.column, x.share, x.value, x.time) for x in uses_of(planar, {"case": "c"}, np.arange(3.0), q)]
    assert [x[0] for x in found] == ["p.x", "p.angle"] and [x[2:] for x in found] == [(-0.9, 2.0), (3.5, 0.0)]
    assert [x[1] for x in found] == pytest.approx([0.9, 0.75])


# quantities


def test_units():
    slide, pin = joint(kind="prismatic", angle=False), joint()
    assert [unit(x, slide) for x in ("position", "acceleration", "brake", "coupling", "friction")] == ["m", "m/s²", "N", "N", "N"]
    assert [unit(x, pin) for x in ("position", "acceleration", "brake", "coupling", "damping")] == ["rad", "rad/s²", "N m", "N m", "N m"]


@pytest.mark.parametrize(
    ("kinetic", "potential", "q", "v", "effort", "watts"),
    [(4, 0, 0, 2, 9, 8e-12), (0, 7, 0, 0, 9, 14e-12), (0, 0, 3, 0, 5, 30e-12), (4, 7, 3, 2, 5, 52e-12 + 1.44e-12), (4, 0, 3, 0, 0, 8e-12)],
)
def test_round_off_of_powers(kinetic, potential, q, v, effort, watts):
    """u (K + U + q τ) / dt with u = 1e-12, and 3e-14 q / dt² of an acceleration with the momentum 2 K / v; the shortest dt is 0.5 s."""
    time = np.array([0.0, 0.5, 2.0])
    of = lambda x, columns=(): np.full((3, *columns), -float(x)) * [[1.0], [0.5], [0.0]] if columns else np.array([x, -x / 2, 0.0])
    assert power_round_off(time, of(kinetic), of(potential), of(q, (1,)), of(v, (1,)), effort) == pytest.approx(watts, rel=1e-12, abs=0)


@pytest.mark.parametrize(
    ("drive", "rate", "more", "residual", "doubtful"),
    [
        (2.0, 1.981, {}, 0.0095, False), (2.0, 1.979, {}, 0.0105, True), (0.0, 0.0, {}, 0.0, False), (1e-3, 0.0, {"round_off": 1e-3}, 1.0, False),
        (1.01e-3, 0.0, {"round_off": 1e-3}, 1.0, True), (1e-3, 0.0, {"exchanged": 100.0}, 0.01, False), (1e-3, 0.0, {"exchanged": 99.0}, 0.0101, True),
        (2.0, 1.0, {"dissipation": np.ones(2)}, 0.0, False), (2.0, 3.0, {"external": np.ones(2)}, 0.0, False), (1.0, 0.0, {"dissipation": np.full(2, 4.0)}, 0.75, True),
    ],
)  # fmt: skip
def test_power_balances_are_doubted_from_a_hundredth_on(drive, rate, more, residual, doubtful):
    none = np.zeros(2)
    balance = PowerBalance(
        np.array([drive, 0]),
        more.pop("external", none) * [1, 0],
        none,
        np.array([rate, 0]),
        **{k: x * [1, 0] if k == "dissipation" else x for k, x in more.items()},
    )
    assert balance.relative_residual == pytest.approx(residual, rel=2e-2, abs=1e-12) and balance.doubtful == doubtful


@pytest.mark.parametrize(
    ("x", "first"),
    [
        ([0.0, 0.9e-9], 0), ([0.0, 1.1e-9], 1), ([100.0, 100 + 90e-9], 0), ([100.0, 100 + 110e-9], 1), ([0.01, 0.01 + 0.9e-9], 0),
        ([0.0, 5.0, 5 * (1 + 0.95e-14)], 1), ([0.0, 5.0, 5 * (1 + 1.05e-14)], 2), ([-7.0, -5.0, -5.0], 1),
    ],
)  # fmt: skip
def test_where_a_curve_is_largest(x, first):
    assert first_extreme(np.array(x)) == first


def test_a_row_of_one_sample_and_of_several():
    one, three = np.array([2.0]), np.array([0.0, 1.0, 3.0])
    assert rms(one, np.array([-3.0])) == 3 and rms(three, np.array([3.0, 3.0, 0.0])) == pytest.approx(np.sqrt((9 + 9) / 3))
    assert work(three, np.array([2.0, -2.0, -4.0])) == pytest.approx((0.5, -6.5))
    held = summarise(one, joint_loads(joint(), np.zeros((1, 6)), np.array([-2.0]), np.array([3.0])))
    assert (held["power_mean"], held["power_peak"], held["work_positive"]) == (-6.0, 6.0, 0.0)
    moved = summarise(three, joint_loads(joint(), np.zeros((3, 6)), np.ones(3), np.array([2.0, -2.0, -4.0])))
    assert moved["power_mean"] == pytest.approx(-2.0) and (moved["effort_peak"], moved["effort_peak_time"]) == (4.0, 3.0)


def test_the_worst_of_rows_by_sign():
    """Lowest position and negative work: the smallest; of all others the largest magnitude, with its case and time."""
    rows = [
        {
            "case": "a",
            "joint": "j",
            "kind": "k",
            "position_lowest": -1.0,
            "position_lowest_time": 1.0,
            "position_highest": -3.0,
            "work_negative": -4.0,
            "power_mean": -5.0,
        },
        {
            "case": "b",
            "joint": "j",
            "kind": "k",
            "position_lowest": 2.0,
            "position_lowest_time": 2.0,
            "position_highest": -2.0,
            "work_negative": -3.0,
            "power_mean": 4.0,
        },
    ]
    (worst,) = worst_rows(rows)
    assert {n: worst[n] for n in ("position_lowest", "position_highest", "work_negative", "power_mean", "position_lowest_time")} == {
        "position_lowest": -1.0, "position_highest": -2.0, "work_negative": -4.0, "power_mean": -5.0, "position_lowest_time": 1.0,
    }  # fmt: skip
    assert [worst[f"{n}_case"] for n in ("position_lowest", "position_highest", "work_negative", "power_mean")] == ["a", "b", "a", "a"]
    small = {"position_lowest": -0.05, "position_highest": 0.05, "work_negative": -0.05, "power_mean": 0.05}
    (worst,) = worst_rows([rows[0] | dict.fromkeys(small, none) for none in (0.0, None)] + [rows[1] | small])
    assert {name: (worst[name], worst[f"{name}_case"]) for name in small} == {name: (x, "b") for name, x in small.items()}, (
        "zero, or no number, is less than a small one"
    )


def test_cases_that_govern_come_first():
    """The worst use of a limit, then the most peaks; of equal peaks the first has them."""
    ranking = Ranking()
    of = lambda share, **row: SimpleNamespace(uses=[use(share)] if share else [], rows=[{"joint": "j"} | row])
    for result in (of(0.1, force_peak=5.0), of(0.9, force_peak=1.0), of(0.2, force_peak=5.0, moment_peak=1.0, speed_peak=2.0), of(0.0, effort_peak=9.0)):
        ranking.add(result, ["j"])
    assert ranking.first(4) == [1, 2, 0, 3] or ranking.first(4) == [1, 2, 3, 0]
    assert ranking.first(2) == [1, 2] and ranking.first(9, [3, 1])[0] == 1
    small = Ranking()
    for result in (of(0.9), of(0.1), of(0.2, force_peak=0.05), of(0.1, moment_peak=9.0, joint="other")):
        small.add(result, ["j"])
    assert small.first(4) == [0, 2, 1, 3] or small.first(4) == [0, 2, 3, 1], "a peak governs however small it is, of joints that are wanted"


# stops, poses, simulations


@pytest.mark.parametrize(("samples", "starts"), [(2000, 2000), (4001, 2001), (8001, 2001)])
def test_starts_of_long_motions(samples, starts):
    time = 5 + np.linspace(0, 8, samples)
    assert len(Stop(1.0).starts(Motion(time, *np.zeros((3, samples, 1))))) == starts
    uneven = Motion(np.linspace(0, 2, samples) ** 2, *np.zeros((3, samples, 1)))
    assert (len(Stop(1.0).starts(uneven)) == samples) == (samples <= 2000)


@pytest.mark.parametrize(("early", "begins"), [(0.95e-9, 1), (1.05e-9, 2)])
def test_a_sample_stands_for_a_multiple_that_it_misses_by_round_off(early, begins):
    time = np.array([0.0, 1 - early, 1.5, 2.25])
    assert Stop(1.0, step=1.0).starts(Motion(time, *np.zeros((3, 4, 1)))).tolist() == [0, begins, 3]


@pytest.mark.parametrize("law", ["cubic", "linear"])
def test_the_law_of_a_stop_is_its_own_derivative(law):
    x, h = np.linspace(0.01, 0.99, 50), 1e-5
    way, speed, change = Stop(1.0, law).profile(x)
    (before, v0, _), (after, v1, _) = (Stop(1.0, law).profile(x + d) for d in (-h, h))
    assert (after - before) / (2 * h) == pytest.approx(speed, abs=1e-9) and (v1 - v0) / (2 * h) == pytest.approx(change, abs=1e-9)
    ends = Stop(1.0, law).profile(np.array([0.0, 1.0]))
    assert ends[0].tolist() == [0, 0.5] and ends[1].tolist() == [1, 0]


BODY = '<link name="{}"><inertial><origin xyz="0.5 0 0"/><mass value="2"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>'
HINGE = '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><axis xyz="0 0 1"/>{}</joint>'


@pytest.mark.parametrize(("limits", "start"), [((10, 100), 0), ((100, 1), 3), ((0, 100), 3), ((0, 0), 0)])
def test_the_worst_start_is_that_of_the_largest_share(robot, limits, start):
    """Two rods that turn about the vertical, each with m l² = 0.5 kg m²: one is fastest at the first sample, the other at the last."""
    limit = '<limit lower="-9" upper="9" effort="{}" velocity="9"/>'
    joints = "".join(HINGE.format(n, "revolute", "wall", b, limit.format(e)) for n, b, e in zip("pq", "bc", limits, strict=True))
    m = robot(f'<robot name="r"><link name="wall"/>{BODY.format("b")}{BODY.format("c")}{joints}</robot>')
    v = np.array([[4.0, 0.5], [3, 1], [2, 2], [1, 3]])
    assert worst_start(m, Motion(np.arange(4.0), np.zeros((4, 2)), v, np.zeros((4, 2))), Stop(0.5), []) == start


def test_ranges_that_are_searched():
    """Both limits; a turn beside one of them, or about zero; slides need both."""
    ranges = [_range(joint(**x)) for x in ({"lower": -1, "upper": 2}, {"lower": 1}, {"upper": 1}, {})]
    assert ranges == [(-1, 2), (1, pytest.approx(1 + 2 * np.pi)), (pytest.approx(1 - 2 * np.pi), 1), (pytest.approx(-np.pi), pytest.approx(np.pi))]
    assert _range(joint(kind="prismatic", angle=False, upper=1)) is None and _range(joint(kind="prismatic", angle=False, lower=0, upper=1)) == (0, 1)


@pytest.mark.parametrize(
    ("refined", "ended", "agree", "skipped", "said", "converged"),
    [
        (0, 0, 0, 0, "no joint can move: there was nothing to search", True),
        (0, 0, 0, 50, "no closed position within the limits was found from 50 random poses: this is the pose that was given; give limits of position that fit", True),
        (9, 9, 2, 0, "2 of 9 searches, from the best of 50 random poses, came to this value", True),
        (9, 7, 1, 3, "1 of 9 searches, from the best of 50 random poses, came to this value, 2 ended before a maximum; from 3 of the 50 no closed position was found within the limits, or none that the drives hold; "
                     "there may be a worse pose: try other seeds", False),
    ],
)  # fmt: skip
def test_how_far_a_search_came(refined, ended, agree, skipped, said, converged):
    found = WorstPose(np.zeros(1), 1.0, 50, refined, ended, agree, skipped)
    assert str(found) == said and found.converged == converged


MIXED = (
    f'<robot name="m"><link name="wall"/>{BODY.format("b")}{BODY.format("c")}{BODY.format("d")}{BODY.format("e")}'
    + HINGE.format("above", "revolute", "wall", "b", '<limit lower="0.5" upper="2" effort="9" velocity="9"/>')
    + HINGE.format("below", "revolute", "b", "c", '<limit lower="-2" upper="-0.25" effort="9" velocity="9"/>')
    + HINGE.format("none", "revolute", "c", "d", '<limit lower="3" upper="3" effort="9" velocity="9"/>')
    + '<joint name="free" type="floating"><parent link="wall"/><child link="e"/></joint></robot>'
)


def test_poses_by_name(robot):
    m = robot(MIXED)
    free = slice(m.joint("free").q_index, m.joint("free").q_index + 7)
    at = lambda q, name: q[m.joint(name).q_index]
    assert [at(neutral(m), name) for name in ("above", "below", "none")] == [0.5, -0.25, 0] and neutral(m)[free].tolist() == [0, 0, 0, 0, 0, 0, 1]
    whole = pose_of(m, {"free": [1, 2, 3, 0, 0, 0.6, 0.8], "above": 1.5})
    assert whole[free] == pytest.approx([1, 2, 3, 0, 0, 0.6, 0.8]) and at(whole, "above") == 1.5
    for length in (0.9901, 1.0099):
        assert pose_of(m, {"free.x": 5, "free.qx": length, "free.qw": 0})[free] == pytest.approx([5, 0, 0, 1, 0, 0, 0])
    for length in (0.9899, 1.0101):
        with pytest.raises(MotionError, match=f"the quaternion of free has length {length:.4g}; expected a unit"):
            pose_of(m, {"free.qx": length, "free.qw": 0})
    for wrong in ({"free": [1, 2, 3]}, {"above": [1.0]}, {"above": True}, {"above": np.inf}):
        with pytest.raises(MotionError, match="pose: "):
            pose_of(m, wrong)


def test_a_pose_of_a_file_is_its_nearest_sample(robot, tmp_path):
    m = robot(f'<robot name="r"><link name="wall"/>{BODY.format("b")}{HINGE.format("pin", "continuous", "wall", "b", "")}</robot>')
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{2 + k / 10},{k}\n" for k in range(8)))
    assert [read_pose(m, tmp_path / "m.csv", t)["pin"] for t in (None, 2, 2.34, 2.36, 2.7)] == [0, 0, 3, 4, 7]
    for time in (1.99, 2.71):
        with pytest.raises(MotionError, match=f"no sample at {time} s; its times are 2 s to 2.7 s"):
            read_pose(m, tmp_path / "m.csv", time)


@pytest.mark.parametrize(
    ("how", "samples"), [({"until": 1.0}, 251), ({"until": 1.0, "rate": 10.0}, 11), ({"until": 3.0, "start": 2.0}, 251), ({"until": 1e-3}, 2)]
)
def test_samples_of_simulations(how, samples):
    assert samples_of(Simulated(**how), None) == samples
    followed = Motion(np.array([1.0, 2.0]), *np.zeros((3, 2, 1)))
    assert samples_of(Simulated(until=9_999_999 / 250), None) == 10_000_000
    assert samples_of(Simulated(), followed) == 251 and samples_of(Simulated(start=1.5), followed) == 126
    for wrong, said in (
        ({"until": 0.0}, "until 0 s is not after"),
        ({"until": 1.0, "rate": 0.0}, "rate 0; expected"),
        ({"until": 40000.0}, "10,000,001 samples"),
        ({}, "no end"),
    ):
        with pytest.raises(MotionError, match=said):
            samples_of(Simulated(**wrong), None)


# files of load cases

ROD = f'<robot name="r"><link name="wall"/>{BODY.format("rod")}{HINGE.format("pin", "continuous", "wall", "rod", "")}</robot>'


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ("mounting = { quaternion = [0, 0, 0.9901, 0] }", ""), ("mounting = { quaternion = [0, 0, 1.0099, 0] }", ""),
        ("mounting = { quaternion = [0, 0, 0.9899, 0] }", "length 0.9899"), ("mounting = { quaternion = [0, 0, 1.0101, 0] }", "length 1.01"),
        ("payloads = [{ link = 'rod', mass = 1, inertia = [1, 1, 2.0000018, 0, 0, 0] }]", ""),
        ("payloads = [{ link = 'rod', mass = 1, inertia = [1, 1, 2.0000022, 0, 0, 0] }]", "which no body can have"),
        ("payloads = [{ link = 'rod', mass = 1, inertia = [-0.0000011, 1, 1, 0, 0, 0] }]", "which no body can have"),
        ("payloads = [{ link = 'rod', mass = 1, inertia = [-0.0000009, 1, 1, 0, 0, 0] }]", ""), ("payloads = [{ link = 'rod', mass = 1, inertia = [0, 1, 1, 0, 0, 0] }]", ""),
        ("external = [{ link = 'rod', wrench = [0,0,0,0,0,0], order = 'xyz' }]", "order 'xyz'"),
        ("stop = { time = 1, step = 0 }", "step 0; expected seconds"), ("stop = { time = 0 }", "time 0; expected"),
        ("stop = { time = 1, from = 0 }", ""), ("stop = { time = 1, from = 3 }", ""), ("stop = { time = 1, from = 3.01 }", "the motion is from 0 s to 3 s"),
    ],
)  # fmt: skip
def test_what_a_case_takes(robot, tmp_path, keys, says):
    m = robot(ROD)
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 2},{k / 9}\n" for k in range(7)))
    read = lambda: cases_of_text(m, f"[cases.a]\nmotion = 'm.csv'\n{keys}\n", str(tmp_path / "c.toml"))
    if not says:
        assert len(read()) == 1
        return
    with pytest.raises(CaseError, match=says):
        read()


@pytest.mark.parametrize(("mass", "doubted"), [(9.99, False), (10.01, True)])
def test_a_payload_of_five_times_the_robot_is_suspected(robot, mass, doubted):
    m = robot(ROD)
    case = LoadCase(m.with_payload("rod", mass, (0, 0, 0)), Motion(np.zeros(1), *np.zeros((3, 1, 1))), payloads=[Payload("rod", mass, (0.0, 0.0, 0.0))])
    said = [line for line in compute(case).doubts if line.startswith("the payload on rod has")]
    assert bool(said) == doubted and all(f"{mass:g} kg, 5 times the robot's own 2 kg" in line for line in said)


@pytest.mark.parametrize(("count", "lines"), [(4, 4), (5, 1)])
def test_many_files_are_one_line(count, lines):
    files = [InputFile("mesh", f"{k}.stl", None if k == 0 else "00") for k in range(count)]
    case = {"name": "a", "kind": "motion", "motion": "", "format": None, "samples": 3, "step": 0.5, "start": 0.0, "end": 1.0, "gravity": [0, 0, -9.81],
            "payloads": [], "physics": [], "external": []}  # fmt: skip
    said = Provenance("r", [], [case], files).lines()
    assert [name for name, _ in said if name.startswith("mesh")] == (["mesh file"] * 4 if lines == 4 else ["mesh files"])
    assert dict(said)["physics of joints"] == dict(said)["external wrenches"] == dict(said)["payloads"] == dict(said)["options"] == "none"
    assert lines == 4 or dict(said)["mesh files"].endswith(f"from 0.stl to 4.stl, SHA-256 of their hashes {hashlib.sha256(b'00' * 4).hexdigest()}")
    assert dict(said)["motion"] == "arrays, 3 samples, median step 0.5 s, from 0 s to 1 s"
    assert [name for name, _ in Provenance("r", [], [case, case | {"name": "b"}]).lines()][:2] == ["case a", "case b"]
    assert "what" not in dict(said) and dict(Provenance("r", [], [case | {"kind": "held at rest"}]).lines())["what"] == "held at rest"


def test_a_payload_on_a_robot_without_masses_is_none_of_grams(robot):
    m = robot(
        '<robot name="r"><link name="wall"/><link name="rod"/><joint name="pin" type="continuous"><parent link="wall"/><child link="rod"/><axis xyz="0 0 1"/></joint></robot>',
        masses="optional",
    )
    case = LoadCase(m.with_payload("rod", 500, (0, 0, 0)), Motion(np.zeros(1), *np.zeros((3, 1, 1))), payloads=[Payload("rod", 500.0, (0.0, 0.0, 0.0))])
    assert not [line for line in compute(case).doubts if "grams" in line]


def test_numbers_of_a_row_that_are_zero_or_none():
    assert [number({"x": x}, "x") for x in (0.0, None, 0.05, -3)] == [0.0, 0.0, 0.05, -3.0]


def test_rates_of_a_table_are_taken_if_all_are_there(robot):
    """Otherwise they are differentiated; here they are none of the positions."""
    joints = HINGE.format("p", "continuous", "wall", "b", "") + HINGE.format("q", "continuous", "b", "c", "")
    m, t = robot(f'<robot name="r"><link name="wall"/>{BODY.format("b")}{BODY.format("c")}{joints}</robot>'), np.linspace(0, 1, 30)
    table = {"time": t, "p": t, "q": 2 * t, "p.v": 7 + 0 * t, "q.v": 8 + 0 * t, "p.a": 5 + 0 * t}
    whole, part = (motion_given(m, pa.table({name: x for name, x in table.items() if name != left_out})) for left_out in ("p.a", "q.v"))
    assert whole.v[3].tolist() == [7, 8] and part.v[3] == pytest.approx([1, 2], abs=1e-9)
    both = motion_given(m, pa.table(table | {"q.a": 6 + 0 * t}))
    assert both.v[3].tolist() == [7, 8] and both.a[3].tolist() == [5, 6] and np.abs(whole.a).max() < 1e-6


def test_arrays_of_a_motion(robot):
    m, t, x = robot(ROD), np.arange(2.0), np.zeros((2, 1))
    assert motion_given(m, (t, x, x, x)).q.shape == (2, 1)
    for wrong in ((t,), (t, x, x, x, x), 3):
        with pytest.raises(MotionError, match="expected a file, a table with the column `time`"):
            motion_given(m, wrong)
    with pytest.raises(MotionError, match="sample 2: time 0 after 0; times must increase: sort the samples"):
        motion_given(m, (np.zeros(2), x, x, x))
    with pytest.raises(MotionError, match="sample 5: time 0 after 3; times must increase: 2 recordings follow one another, the first in 4 samples"):
        motion_given(m, (np.tile(np.arange(4.0), 2), np.zeros((8, 1))))


@pytest.mark.parametrize("rows", [1 << 17, 4])
@pytest.mark.parametrize("sample", [0, 3])
def test_numbers_beyond_the_range_name_sample_and_quantity(robot, monkeypatch, sample, rows):
    """An acceleration that is an effort, and with its speed a power that is none; and a speed whose square is none.  In one block or in several."""
    monkeypatch.setattr(load_case, "BLOCK_ROWS", rows)
    for speed, acceleration, said in ((1e100, 1e250, "power of pin is not finite"), (1e300, 0.0, "inverse_dynamics_with_reactions: ")):
        v, a = (np.where(np.arange(5) == sample, x, 0.0)[:, None] for x in (speed, acceleration))
        with pytest.raises(MotionError, match=rf"motion: sample {sample + 1} \(time {sample}\): {said}"):
            compute(LoadCase(robot(ROD), Motion(np.arange(5.0), np.zeros((5, 1)), v, a)))


def test_a_balance_beyond_the_range_is_refused(robot):
    """A speed that ends at once: wrenches and energies are numbers, and the rate of the energy is none."""
    v = np.where(np.arange(8) < 4, 1e74, 0.0)[:, None]
    with pytest.raises(MotionError, match="motion: power balance: energy or power of all joints is not finite"):
        compute(LoadCase(robot(ROD), Motion(1e-170 * np.arange(8), np.zeros((8, 1)), v, np.zeros((8, 1)))))


# what few cases use


def test_a_wrench_is_held_during_a_stop(robot):
    """Nothing moves: the effort is minus the moment at the start, which is largest at the third sample."""
    m = robot(ROD)
    moment = WrenchOverTime("rod", np.arange(4.0), np.outer([1.0, -2, 7, -6], [0, 0, 0, 0, 0, 1]), "hold", "link", (0, 0, 0))
    still = Motion(np.arange(4.0), *np.zeros((3, 4, 1)))
    assert worst_start(m, still, Stop(0.5), [moment]) == 2
    floating = robot(f'<robot name="f">{BODY.format("b")}</robot>', floating_base=True)
    q = np.tile([0.0, 0, 0, 0, 0, 0, 1], (3, 1))
    for size in (1.0, 1e-3):
        v = np.outer([1.0, -9, 2], [0, 0, 0, 0, 0, size])
        weightless = floating.with_gravity((0.0, 0.0, 0.0))
        assert worst_start(weightless, Motion(np.arange(3.0), q, v, np.zeros((3, 6))), Stop(0.5), []) == 1, "no joint has one coordinate"
    limit = '<limit effort="9" velocity="9"/>'
    hinged = robot(f'<robot name="f">{BODY.format("b")}{BODY.format("c")}{HINGE.format("p", "continuous", "b", "c", limit)}</robot>', floating_base=True)
    assert pose_of(hinged, {"p": 0.5}).tolist() == [0, 0, 0, 0, 0, 0, 1, 0.5], "its quaternion ends before the hinge"
    q, v = np.hstack([q, np.zeros((3, 1))]), np.outer([2.0, 0, 0], [0, 0, 9, 0, 0, 0, 0]) + np.outer([0.0, 1, 3], [0, 0, 0, 0, 0, 0, 1])
    assert worst_start(hinged, Motion(np.arange(3.0), q, v, np.zeros((3, 7))), Stop(0.5), []) == 2, "of the hinge, and not of the base"


@pytest.mark.parametrize("shape", [(6,), (1, 6), (3, 6)])
def test_wrenches_for_all_samples(shape):
    wrench = np.arange(1.0, 1 + np.prod(shape)).reshape(shape)
    assert wrenches_of_arrays({"rod": wrench}, 3)["rod"].tolist() == np.broadcast_to(wrench, (3, 6)).tolist()


@pytest.mark.parametrize(("quantity", "value"), [("force", 2 * 9.81), ("moment", 9.81), ("fz", 2 * 9.81), ("fx", 0.0), ("axial_moment", 0.0)])
def test_the_worst_of_every_quantity(robot, quantity, value):
    """A rod that turns about the vertical: its weight acts 0.5 m off the axis in any pose."""
    found = worst_pose(robot(ROD), "pin", quantity, Placement(), np.zeros(1), set())
    assert found.value == pytest.approx(value, abs=1e-12) and found.refined > 0 and (value == 0 or found.agree == found.refined)


def test_a_pose_within_one_bound():
    for lower, upper, at in ((None, -1.5, -1.5), (None, 1.5, 0), (0.5, None, 0.5), (-0.5, None, 0)):
        assert neutral(SimpleNamespace(nq=1, joints=(joint(limits=((lower, upper),)),), joint_names=("pin",))).tolist() == [at]
    planar = Joint("p", "planar", "a", "b", 3, 3, 1, 1, (0.0, 0.0, 1.0), limits=((1.0, 2.0), (None, -3.0), (4.0, 4.0)))
    assert neutral(SimpleNamespace(nq=4, joints=(planar,), joint_names=("p",))).tolist() == [0, 1, -3, 0]


def test_a_simulation_under_a_wrench_and_its_error(robot):
    m = robot(ROD)
    moment = WrenchOverTime("rod", np.zeros(1), np.array([[0.0, 0, 0, 0, 0, 0.5]]), "hold", "link", (0, 0, 0))
    how = Simulated(start=1.0, until=3.0, pose={"pin": 0.25}, rate=50.0)
    motion, words = simulated_motion(m, how, None, [moment])
    assert motion.q[:, 0] == pytest.approx(0.25 + (motion.time - 1) ** 2 / 2) and words == "simulated without drives", "0.5 N m turn 0.5 kg m²"
    coarse = simulated_motion(m, replace(how, method="rk4", step=0.02), None, [moment])[0]
    assert coarse.resolution[0] < 1e-11 < 1e-9 * 50 < motion.resolution[0], "dop853 alone controls its error"
    with pytest.raises(MotionError, match="axes 'world' turn with the simulated motion"):
        simulated_motion(m, how, None, [replace(moment, axes="world")])


def test_the_coupling_of_a_joint_that_turns(robot):
    """0.5 kg m², at twice the acceleration of its leader."""
    joints = HINGE.format("p", "continuous", "wall", "b", "") + HINGE.format("q", "continuous", "wall", "c", '<mimic joint="p" multiplier="2"/>')
    m = robot(f'<robot name="r"><link name="wall"/>{BODY.format("b")}{BODY.format("c")}{joints}</robot>')
    motion = motion_given(m, (np.arange(3.0), np.zeros((3, 1)), [1.0], [3.0]))
    assert motion.v[:, 0].tolist() == [1, 1, 1] and motion.a[:, 0].tolist() == [3, 3, 3], "one row for all samples"
    (block,) = LoadCase(m, motion).blocks()
    assert block.coupling[:, 0] == pytest.approx(3.0) and block.tau[:, 0] == pytest.approx(0.5 * 3 + 2 * 3)


@pytest.mark.parametrize(
    ("pose", "nearest", "angle", "loses"),
    [
        (7.0, 7 - math.tau, True, 1.0), (13.0, 13 - 2 * math.tau, True, 1.0), (-6.0, math.tau - 6, True, 1.0), (-12.2, 2 * math.tau - 12.2, True, 1.0), (2.0, 2.0, True, 1.0),
        (7.0, 7.0, False, 1.0), (7.0, 0.1, True, 0.9e-9), (7.0, 7 - math.tau, True, 1.1e-9), (19.5, 19.5 - 2 * math.tau, True, 1.0),
    ],
)  # fmt: skip
def test_a_pose_without_needless_turns(pose, nearest, angle, loses):
    """At most two turns less or more, within the bounds; and where the joint is, if that makes no more than a billionth less of the quantity."""
    kind = {} if angle else {"kind": "prismatic", "angle": False}
    size = lambda poses: 5 * np.where(np.abs(np.sin((poses[:, 0] - pose) / 2)) < 1e-9, 1.0, 1 - loses) if angle else 5 * np.where(poses[:, 0] == pose, 1.0, 0.0)
    assert _nearest(np.array([pose]), np.array([0.1]), [(joint(**kind), (-20.0, 20.0))], size)[0] == pytest.approx(nearest)
    assert _nearest(np.array([7.0]), np.array([0.1]), [(joint(), (5.0, 9.0))], size)[0] == 7, "beyond the bounds"
    if angle and loses == 1:
        nearer = _nearest(np.array([pose]), np.array([-3.0]), [(joint(), (-99.0, 99.0))], size)[0]
        assert nearer == pytest.approx(min((pose + k * math.tau for k in (-2, -1, 0, 1, 2)), key=lambda x: abs(x + 3)))


@pytest.mark.parametrize(("most", "ok"), [(7, True), (6, False)])
def test_stops_from_every_sample(robot, tmp_path, monkeypatch, most, ok):
    m = robot(ROD)
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 2},{k / 9}\n" for k in range(7)))
    monkeypatch.setattr(case_file, "MOST_STOPS", most)
    read = lambda: cases_of_text(m, "[cases.a]\nmotion = 'm.csv'\nstop = { time = 1, from = 'all' }\n", str(tmp_path / "c.toml"))
    if ok:
        assert [case.name for case in read()] == [f"a {k / 2:g} s" for k in range(7)]
        return
    with pytest.raises(CaseError, match="case a: stop: 7 starts, at most 6; give a longer step"):
        read()


@pytest.mark.parametrize(("samples", "balanced"), [(5, False), (6, True)])
def test_balances_of_short_motions(robot, samples, balanced):
    t = np.arange(float(samples))
    found = compute(LoadCase(robot(ROD), Motion(t, t[:, None] ** 2, 2 * t[:, None], np.full((samples, 1), 2.0)))).balance
    assert (found is not None) == balanced and (not balanced or found.relative_residual < 1e-9)


@pytest.mark.parametrize("mass", [2.0, 1e-3])
@pytest.mark.parametrize("before", [True, False])
def test_a_power_balance_at_a_jump_of_the_acceleration(robot, before, mass):
    """The sample there may have the acceleration of either side."""
    t = np.linspace(0, 2, 41)
    v = np.where(t < 1, t, 1 - 3 * (t - 1))
    q, a = np.where(t < 1, t**2 / 2, 1 / 2 + (t - 1) - 1.5 * (t - 1) ** 2), np.where((t < 1) | (before & (t == 1)), 1.0, -3.0)
    m = robot(ROD.replace('mass value="2"', f'mass value="{mass}"'))
    balance = compute(LoadCase(m, Motion(t, q[:, None], v[:, None], a[:, None], corner_times=np.array([1.0])))).balance
    assert balance.relative_residual < 1e-9 and balance.largest_power == pytest.approx(0.25 * mass * np.abs(a * v).max())


@pytest.mark.parametrize(("events", "more"), [(12, ""), (13, " and 1 more")])
def test_what_is_said_of_a_simulation(events, more):
    """Losses and changes are the largest magnitudes; twelve events are named."""
    happened = [SimpleNamespace(what="brakes", joint="", time=0.0), *(SimpleNamespace(what="sticks", joint="pin", time=k / 8) for k in range(1, events))]
    drift = SimpleNamespace(energy=np.array([0.0, -3e-7, 1e-7]), closure=np.array([0.0, 2e-9, np.nan]))
    run = SimpleNamespace(drift=drift, energy=np.array([5.0, 2.0, 6.0]), steps=7, events=happened)
    said = _notes(run, Simulated())
    assert said[0] == "7 steps of dop853; energy lost by integration 3e-07 J, where energy changed by 3 J" and said[1].startswith(
        "loops opened by 2e-09 m at most"
    )
    assert said[2] == "events: brakes engage at 0 s; " + "; ".join(f"sticks of pin at {k / 8:.6g} s" for k in range(1, 12)) + more and len(said) == 3


def test_a_case_as_it_is_described(robot):
    m = robot(ROD)
    for time, step in ((np.array([4.0]), 0.0), (np.array([4.0, 4.25, 5.0, 5.25]), 0.25)):
        (case,) = provenance_of([LoadCase(m, Motion(time, *np.zeros((3, len(time), 1)), resolution=np.array([-0.5])))]).cases
        assert (case["step"], case["samples"], case["start"], case["end"], case["resolution"]) == (step, len(time), 4.0, time[-1], {"pin": 0.5})


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "helical", "fixed"])
@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (0.6, 0.0, 0.8)])
def test_quantities_are_open_where_a_pattern_changes_them(kind, axis):
    """Patterns along and across the axis, of forces, moments and both: what they do to the quantities of a wrench."""
    j = Joint("j", kind, "a", "b", *([1, 1] if kind != "fixed" else [0, 0]), 0, 0, axis, has_axis=kind != "fixed", has_angle=kind in ("revolute", "helical"))
    wrench, lines = np.arange(1.0, 7)[None], [np.array(axis), np.cross(axis, [0.3, 0.1, 0.9])]
    for pattern in (np.hstack([f, m]) for f in (*lines, np.zeros(3)) for m in (*lines, np.zeros(3))):
        before, after = (joint_loads(j, w, None, None).wrench for w in (wrench, wrench + 0.5 * pattern))
        for patterns in (pattern[None], np.array([np.zeros(6), pattern])):
            assert {n for n in before if abs(before[n][0] - after[n][0]) > 1e-9} == set(_quantities(j, patterns, 1e-9))


@pytest.mark.parametrize(
    ("placement", "payload", "said"),
    [
        ({"at": (0, 0, 0.99)}, None, ""), ({"at": (0, 0, -1.01)}, None, "the point of the moments is 1.01 m from the joint's origin"), ({"at": "world"}, None, ""),
        ({"points": {"pin": (0.0, 1.01, 0.0)}}, None, "the point of the moments of pin is 1.01 m"), ({"points": {"pin": (0.0, 0.99, 0.0)}}, None, ""),
        ({}, {"center": (0.0, 0.0, -0.99)}, ""), ({}, {"center": (0.8, 0.8, 0.0)}, "the payload on rod is 1.13137 m from the link's origin"),
        ({}, {"center": (0.0, 0.0, 0.0), "inertia": (0.99, 0, 0, 0, 0.99, 0, 0, 0, 0.99)}, ""),
        ({}, {"center": (0.0, 0.0, 0.0), "inertia": (1.03, 0, 0, 0, 1.03, 0, 0, 0, 1.03)}, "the inertia of the payload on rod is that of a body with a radius of 1.015 m"),
    ],
)  # fmt: skip
def test_lengths_beyond_twice_the_extent_are_doubted(robot, placement, payload, said):
    """Of a rod of 0.5 m: points of moments, payloads, and the radius √(I/m) of their inertia."""
    m, carried = robot(ROD), [Payload("rod", 1.0, **payload)] if payload else []
    for p in carried:
        m = m.with_payload(p.link, p.mass, p.center, None if p.inertia is None else np.reshape(p.inertia, (3, 3)))
    case = LoadCase(m, Motion(np.zeros(1), *np.zeros((3, 1, 1))), Placement(**placement), payloads=carried)
    doubts = [line for line in compute(case).doubts if "robot's extent" in line]
    assert len(doubts) == bool(said) and all(line.startswith(said) for line in doubts)


@pytest.mark.parametrize(("file", "named"), [("m.csv", "m.csv"), ("", "lift")])
def test_errors_name_the_file_of_a_motion_or_its_case(robot, file, named):
    far = Motion(np.zeros(1), np.zeros((1, 1)), np.full((1, 1), 1e300), np.zeros((1, 1)))
    for motion, said in ((far, "sample 1 "), (replace(far, v=np.full((1, 1), 1e200), a=np.full((1, 1), 1e200)), "sample 1 ")):
        with pytest.raises(MotionError, match=f"^{named}: {said}"):
            compute(LoadCase(robot(ROD), motion, name="lift", motion_file=file))


def test_closed_mechanisms_in_words(robot):
    """The largest error of closure, its time, and its case where there are several; no closure where positions were not closed."""
    m = robot(FOURBAR, drives=["A"])
    q = m.close(m.neutral(), hold=["A"]).q[None]
    cases = [
        LoadCase(m, Motion(np.zeros(1), q, *np.zeros((2, 1, 3)), closing=x and Closing(("A",), *x, (), 1)), name=name)
        for name, x in (("none", None), ("small", (1e-12, 0.25)), ("large", (3e-11, 0.75)))
    ]
    found = [closed_mechanism(some) for some in (cases[:1], cases[2:], cases)]
    assert [(x.held, x.error, x.error_time, x.error_case) for x in found] == [((), 0.0, 0.0, ""), (("A",), 3e-11, 0.75, ""), (("A",), 3e-11, 0.75, "large")]
    assert [dict(x.lines()).get("closure") for x in found] == [None, "largest error 3e-11 m, at 0.75 s", "largest error 3e-11 m, at 0.75 s of large"]
    assert dict(found[1].lines()) | {"closure": ""} == {
        "loops": "C, continuous, coupler → rocker", "freedoms": "1, driven by A", "positions": "given for A; all others follow", "redundant equations": "C: 3 of 5",
        "stiffnesses": "none: all joints are rigid", "closure": "",
    }  # fmt: skip
    for drives, freedoms, brake, doubted in (("A", 1, False, 0), ("AD", 1, False, 1), ("AD", 2, False, 0), ("AD", 1, True, 0)):
        motion = Motion(np.zeros(1), q, *np.zeros((2, 1, 3)), closing=Closing(("A",), 0.0, 0.0, (), freedoms))
        doubts = compute(LoadCase(robot(FOURBAR, drives=list(drives)), motion, brakes_from=0.0 if brake else 0.1)).doubts
        assert len([line for line in doubts if line.startswith("A, D: 2 drives move 1 freedom: ")]) == len(doubts) == doubted


def test_poses_within_the_limits_of_joints_that_follow(robot):
    """Up to a billionth; a position that is given for one of them may differ by a thousandth."""
    m = robot(SLIDERCRANK, drives=["A"])
    start, slide = m.close(m.neutral(), hold=["A"]).q, m.joint("S").q_index
    at = float(start[slide])
    for beyond, ok in ((0.9e-9, True), (1.1e-9, False)):
        for limit in (f'lower="0" upper="{at - beyond!r}"', f'lower="{at + beyond!r}" upper="1"'):
            narrow = robot(SLIDERCRANK.replace('lower="0" upper="1"', limit), drives=["A"])
            assert reach_of(narrow, start, set()).closed(start[None])[1].tolist() == [ok], limit
    for off, ok in ((0.9e-3, True), (-0.9e-3, True), (1.1e-3, False), (-1.1e-3, False)):
        q = start + off * np.eye(m.nq)[slide]
        if ok:
            assert closed_pose(m, q, ["A", "S"])[0] == pytest.approx(start, abs=1e-9)
            continue
        with pytest.raises(MotionError, match=f"pose: S is given {q[slide]:.6g} m, but with A = .* the loops put it at {at:.6g} m"):
            closed_pose(m, q, ["A", "S"])


def test_round_off_is_that_of_the_largest_effort(robot):
    """Of a rod that weighs a gram, and swings about a vertical axis."""
    m, t = robot(ROD.replace('mass value="2"', 'mass value="1e-3"')), np.linspace(0, 1, 30)
    q, v, a = np.sin(9 * t)[:, None], 9 * np.cos(9 * t)[:, None], -81 * np.sin(9 * t)[:, None]
    balance = compute(LoadCase(m, Motion(t, q, v, a))).balance
    kinetic, potential = m.energy(q, v)
    assert balance.round_off == pytest.approx(power_round_off(t, kinetic, potential, q, v, 1e-3 * 0.25 * np.abs(a).max()), rel=1e-9)
    assert balance.exchanged == pytest.approx(np.abs(np.gradient(kinetic, t)).max(), rel=1e-12)


def test_dampers_between_points_turn_power_into_heat(robot):
    """c l̇² and the damping of the joint: the balance closes with both, and not without."""
    damper = '<force_element name="d" damping="3"><link1 link="wall" xyz="1 0.5 0"/><link2 link="rod" xyz="0.5 0 0"/></force_element>'
    m = robot(ROD.replace("</joint>", '<dynamics damping="0.4"/></joint>').replace("</robot>", damper + "</robot>"), physics=["damping", "force elements"])
    t = np.linspace(0, 2, 400)
    q, v = np.sin(3 * t), 3 * np.cos(3 * t)
    balance = compute(LoadCase(m, Motion(t, q[:, None], v[:, None], -9 * q[:, None]))).balance
    way = 0.5 * np.column_stack([np.cos(q), np.sin(q)]) - [1, 0.5]
    rate = np.sum(way * 0.5 * np.column_stack([-np.sin(q), np.cos(q)]) * v[:, None], axis=1) / np.linalg.norm(way, axis=1)
    assert balance.dissipation == pytest.approx(0.4 * v**2 + 3 * rate**2, rel=1e-9, abs=1e-12) and balance.relative_residual < 1e-6
    case, length = LoadCase(m, Motion(t, q[:, None], v[:, None], -9 * q[:, None])), np.linalg.norm(way, axis=1)
    (found,) = element_ranges(case)
    assert (*found.length, *found.tension) == pytest.approx((length.min(), length.max(), 3 * rate.min(), 3 * rate.max()), rel=1e-9)
    for physics in ((), ("damping",)):
        assert element_ranges(replace(case, model=m.with_physics(physics))) == []


def files_beside(folder):
    """A motion of the rod with a speed of 4 rad/s at its first sample, and a table of wrenches whose last line may be cut off."""
    (folder / "m.csv").write_text("time,pin,pin.v,pin.a\n" + "".join(f"{k / 2},{k / 9},{4 - k / 2},-1\n" for k in range(7)))
    (folder / "w.csv").write_text("time,fz,tx\n0,1,2\n1,3,4")
    return lambda m, keys, name="a", **more: cases_of_text(m, f"[cases.{name}]\n{keys}\n", str(folder / "c.toml"), **more)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("external = [{ link = 'rod', file = 'w.csv' }]", ["w.csv has no line end"]), ("external = [{ link = 'rod', wrench = [0,0,1,0,0,0], point = [0, 0.8, 0.7] }]", ["the point of external wrench 1, on rod, is 1.06301 m"]),
        ("external = [{ link = 'rod', wrench = [0,0,1,0,0,0], point = [0, 0.7, 0.7] }]", []), ("hold = true", []), ("hold = false\nsimulate = false", []),
        ("external = [{ link = 'rod', wrench = [0,0,1,0,0,0] }, { link = 'rod', file = 'w.csv' }, { link = 'rod', wrench = [0,0,1,0,0,0], point = [2, 0, 0] }]", ["w.csv", "external wrench 3, on rod, is 2 m"]),
    ],
)  # fmt: skip
def test_doubts_about_what_a_case_names(robot, tmp_path, keys, said):
    """Beside those about its motion, and of this case alone."""
    read, m = files_beside(tmp_path), robot(ROD)
    (case, other) = read(m, f"motion = 'm.csv'\n{keys}\n[cases.b]\nmotion = 'm.csv'")
    assert len(case.motion.doubts) == len(said) and not other.motion.doubts
    assert all(words in line for words, line in zip(said, case.motion.doubts, strict=True)), case.motion.doubts
    assert (case.kind, case.brake, case.static) == (("held at rest by brakes", True, True) if "true" in keys else ("motion", False, False))


def test_what_held_and_stopped_motions_share(robot, tmp_path):
    """Doubts about units, and none about noise."""
    noise = np.random.default_rng(0).normal(size=300)
    (tmp_path / "m.csv").write_text("time,pin\n" + "".join(f"{k / 99},{500 * np.sin(k / 50) + x}\n" for k, x in enumerate(noise)))
    moved, held, stopped = cases_of_text(
        robot(ROD), "[defaults]\nmotion = 'm.csv'\n[cases.a]\n[cases.b]\nhold = true\n[cases.c]\nstop = { time = 1, from = 0 }\n", str(tmp_path / "c.toml")
    )
    degrees = [line for line in moved.motion.doubts if "are these degrees?" in line]
    assert len(degrees) == 1 < len(moved.motion.doubts) and held.motion.doubts == stopped.motion.doubts == degrees


@pytest.mark.parametrize(("time", "beyond"), [(3.3e-308, True), (3.4e-308, False), (1.0, False), (4.45e307, False), (4.55e307, True)])
def test_stops_within_the_range_of_numbers(robot, tmp_path, time, beyond):
    """From 4 rad/s: neither 1.5 v/T nor v T are beyond 1.8e308."""
    try:
        files_beside(tmp_path)(robot(ROD), f"motion = 'm.csv'\nstop = {{ time = {time!r}, from = 0 }}")
        said = ""
    except CaseError as e:
        said = str(e)
    assert ("from 4 rad/s or m/s the deceleration or the way is beyond the range of numbers" in said) == beyond, said


def test_keys_of_a_simulation():
    """Each of them, alone but for what it needs, and with all others, and what is taken for those that are not there."""
    given = {
        "until": 2, "from": 0.5, "pose": {"pin": 1}, "velocity": {"pin": 3}, "controller": "pd", "stiffness": 7, "damping": {"pin": 2}, "brake_at": 1, "brake": {"pin": 9}, "friction": 0.1,
        "restitution": 0.5, "rate": 100, "method": "rk4", "step": 0.01, "rtol": 1e-6, "atol": 1e-7,
    }  # fmt: skip
    names = {"start" if key == "from" else key: x for key, x in given.items()}
    assert simulated_of("x", given) == Simulated(**names) and simulated_of("x", {}) == Simulated()
    needs = {"controller": {"damping": 1}, "stiffness": {"controller": "computed torque"}, "damping": {"controller": "gravity"}, "brake": {"brake_at": 3}}
    for (key, x), name in zip(given.items(), names, strict=True):
        others = needs.get(key, {})
        assert simulated_of("x", {key: x, **others}) == Simulated(**{name: x, **others})
    usual = Simulated()
    assert (usual.controller, usual.stiffness, usual.damping, usual.rate, usual.method, usual.rtol, usual.atol) == (
        "none",
        0.0,
        0.0,
        250.0,
        "dop853",
        1e-9,
        1e-9,
    ), "docs/cases.md"
    for wrong in ({"pose": 3}, {"velocity": 3.0}, {"rate": True}, {"rate": np.inf}, {"stiffness": {"pin": "x"}}, {"method": 4}, {"until": "1"}, 3):
        with pytest.raises(CaseError, match="^x"):
            simulated_of("x", wrong)


def test_limits_of_zero_are_none_in_results():
    said = joint_description(joint(lower=-1.0, upper=None, velocity=0.0, effort=5.0))
    assert {key: said[key] for key in LIMITS} == {"lower": -1.0, "upper": None, "velocity": None, "effort": 5.0} and said["axis"] == [0, 1, 0]
    assert joint_description(joint(velocity=2.0, effort=0.0))["effort"] is None and joint_description(replace(joint(), has_axis=False))["axis"] is None


def test_physics_of_a_case(robot, tmp_path):
    """Names, or the width of friction alone; what adds joints is refused, since cases of one run have the same."""
    read = files_beside(tmp_path)
    m = robot(ROD.replace("</joint>", '<dynamics damping="0.5" rotor_inertia="0.001" gear_ratio="50"/></joint>'), physics=["damping"])
    for keys, names, width in (
        ("", ("damping",), 0.01),
        ("friction_width = 0.3", ("damping",), 0.3),
        ("physics = ['rotor']", ("rotor",), 0.01),
        ("physics = []\nfriction_width = 0.2", (), 0.2),
    ):
        (case,) = read(m, f"motion = 'm.csv'\n{keys}")
        assert (case.model.physics, case.model.friction_width) == (names, width), keys
    with pytest.raises(CaseError, match='case a: physics "rotor bodies" adds joints'):
        read(m, "motion = 'm.csv'\nphysics = ['rotor bodies']")


@pytest.mark.parametrize("axes", ["world", "ksl:world"])
def test_wrenches_in_axes_of_the_world(robot, tmp_path, axes):
    """Of a rod that has turned by 90°: the world's y is minus its x."""
    read = files_beside(tmp_path)
    (case,) = read(
        robot(ROD),
        f"hold = {{ pose = {{ pin = 1.5707963267948966 }} }}\nexternal = [{{ link = 'rod', wrench = [0, 3, 0, 0, 0, 2], axes = '{axes}', point = [0.5, 0, 0] }}]",
    )
    assert case.external["rod"][0] == pytest.approx([3, 0, 0, 0, 0, 2], abs=1e-12)


@pytest.mark.parametrize(("events", "missed"), [([], True), ([0.5, 2.5, 9.0], True), ([1.5], False), ([2.0], False), ([-1.0, 0.0], True)])
def test_energy_that_an_event_changes_is_not_missed(events, missed):
    """Of a step by 3 J between samples 1 s and 2 s."""
    time, energy = np.arange(5.0), np.array([0, 0, 3.0, 3, 3])
    found = untold(time, energy, 0 * time, np.array(events), 0.0)
    assert (found is not None) == missed and (not missed or (found.begin, found.end, found.change, found.by_powers) == (1, 2, 3, 0))
