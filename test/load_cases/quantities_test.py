"""Quantities of load cases by hand: where a curve is largest, rows of a summary, units, and which cases govern."""

from types import SimpleNamespace

import numpy as np
import pytest

from hinged_rods import BODY, HINGE, joint_of, use
from ksl.load_cases.case_files.motion_given import motion_given
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.quantities import first_extreme, joint_loads, rms, summarise, unit, work
from ksl.load_cases.ranking import Ranking
from ksl.load_cases.summary_table import worst_rows
from ksl.load_cases.undetermined import _quantities
from ksl.mechanism.mechanism import Joint


def test_units():
    slide, pin = joint_of(kind="prismatic", angle=False), joint_of()
    assert [unit(x, slide) for x in ("position", "acceleration", "brake", "coupling", "friction")] == ["m", "m/s²", "N", "N", "N"]
    assert [unit(x, pin) for x in ("position", "acceleration", "brake", "coupling", "damping")] == ["rad", "rad/s²", "N m", "N m", "N m"]


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
    held = summarise(one, joint_loads(joint_of(), np.zeros((1, 6)), np.array([-2.0]), np.array([3.0])))
    assert (held["power_mean"], held["power_peak"], held["work_positive"]) == (-6.0, 6.0, 0.0)
    moved = summarise(three, joint_loads(joint_of(), np.zeros((3, 6)), np.ones(3), np.array([2.0, -2.0, -4.0])))
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


def test_the_coupling_of_a_joint_that_turns(robot):
    """0.5 kg m², at twice the acceleration of its leader."""
    joints = HINGE.format("p", "continuous", "wall", "b", "") + HINGE.format("q", "continuous", "wall", "c", '<mimic joint="p" multiplier="2"/>')
    m = robot(f'<robot name="r"><link name="wall"/>{BODY.format("b")}{BODY.format("c")}{joints}</robot>')
    motion = motion_given(m, (np.arange(3.0), np.zeros((3, 1)), [1.0], [3.0]))
    assert motion.v[:, 0].tolist() == [1, 1, 1] and motion.a[:, 0].tolist() == [3, 3, 3], "one row for all samples"
    (block,) = LoadCase(m, motion).blocks()
    assert block.coupling[:, 0] == pytest.approx(3.0) and block.tau[:, 0] == pytest.approx(0.5 * 3 + 2 * 3)


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
