"""Times without samples in which a joint moves forbid a green verdict; those in which all stand don't."""

from dataclasses import replace

import numpy as np
import pytest

import ksl
from chains import SLIDE
from ksl.mechanism.joint_kinds import columns_of
from ksl.motions.reading import read_motion
from ksl.motions.signal.gaps import doubts_about_gaps

T = np.arange(0, 4, 0.01)
N_EVEN = np.arange(len(T)) % 2 == 0


def doubts(leg, tmp_path, keep, hip, rates=False):
    t, q = T[keep], hip(T[keep])
    names, columns = ["time", "hip", "slide"], [t, q, np.zeros_like(t)]
    if rates:
        v = np.gradient(hip(T), T)
        a = np.gradient(v, T)
        names, columns = [*names, "hip.v", "slide.v", "hip.a", "slide.a"], [*columns, v[keep], 0 * t, a[keep], 0 * t]
    file = tmp_path / "m.csv"
    np.savetxt(file, np.column_stack(columns), delimiter=",", header=",".join(names), comments="", fmt="%.17g")
    return [d for d in read_motion(leg, file).doubts if "no samples between" in d]


def swing(t):
    return 0.3 * np.sin(2 * np.pi * t)


@pytest.mark.parametrize("rates", [False, True], ids=["differentiated", "rates given"])
def test_a_gap_of_a_motion_is_said(leg, tmp_path, rates):
    (said,) = doubts(leg, tmp_path, (T <= 1.1) | (T >= 1.8), swing, rates)
    assert said.startswith("no samples between 1.1 s and 1.8 s, 70 median steps, while hip moves by 0.462 rad")


@pytest.mark.parametrize(("column", "said"), [(0, "floating_base.x moves by 0.995 m:"), (5, "floating_base.qz moves by 0.995:")])
def test_lengths_have_a_unit_and_quaternions_have_none(flying, column, said):
    t = np.array([0.0, 0.01, 0.02, 0.03, 0.03 + np.arcsin(0.995), 1.6, 1.61, 1.62])
    q = np.zeros((8, 7))
    q[:, column], q[:, 6] = np.where(t > 0.1, 0.995, 0.0), 1.0
    (found,) = doubts_about_gaps(flying.joints[:1], t, q)
    assert said in found


@pytest.mark.parametrize("moves", ["before", "after", "nowhere"])
def test_rates_on_either_side_of_a_gap_say_that_a_joint_moved(leg, moves):
    """Of a joint that is where it was, and moved just before the gap, or does so just behind it."""
    t = np.array([0.0, 0.1, 0.2, 0.3, 1.3, 1.4, 1.5, 1.6])
    q = {
        "before": [0.3, 0.3, 0.2, 0.1, 0.1, 0.1, 0.1, 0.1],
        "after": [0.1, 0.1, 0.1, 0.1, 0.1, 0.2, 0.3, 0.3],
        "nowhere": [0.1, 0.3, 0.1, 0.1, 0.1, 0.1, 0.3, 0.1],
    }[moves]
    assert len(doubts_about_gaps(leg.joints[:2], t, np.column_stack([q, 0 * t]))) == (moves != "nowhere")


def test_the_longest_of_several_is_named(leg, tmp_path):
    (said,) = doubts(leg, tmp_path, ((T <= 1.1) | (T >= 1.3)) & ((T <= 2.1) | (T >= 2.9)), swing)
    assert said.startswith("no samples between 2.1 s and 2.9 s, 80 median steps (2 such gaps, this is the longest)")


def test_the_coordinate_that_moves_in_a_gap_is_named(robot):
    """Of a joint with several, and behind another joint."""
    part = '<link name="{0}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    kinds = (("turn", "continuous", "a", "b"), ("table", "planar", "b", "c"))
    joints = "".join(f'<joint name="{n}" type="{k}"><parent link="{p}"/><child link="{c}"/><axis xyz="0 0 1"/></joint>' for n, k, p, c in kinds)
    m = robot(f'<robot name="r">{"".join(map(part.format, "abc"))}{joints}</robot>')
    keep = (T <= 1.1) | (T >= 1.8)
    q = np.zeros((keep.sum(), 4))
    columns = [column for joint in m.joints[:2] for column in columns_of(joint)[0]]
    for k, column in enumerate(columns):
        q[:] = 0.0
        q[:, k] = swing(T[keep])
        (said,) = doubts_about_gaps(m.joints[:2], T[keep], q)
        assert f" while {column} moves by 0.462" in said


def test_a_joint_that_never_moves_is_not_named(leg):
    """The other one moves in the gap by a little more than what counts, 5 % of its way."""
    keep = (T <= 1.1) | (T >= 1.4)
    slide = np.where(T <= 1.1, np.clip(2 * T, 0, 1), 0.93)[keep]
    (said,) = doubts_about_gaps(leg.joints[:2], T[keep], np.column_stack([np.full(keep.sum(), 0.3), slide]))
    assert " while slide moves by " in said


def test_a_part_without_the_gap(leg, tmp_path):
    doubts(leg, tmp_path, (T <= 1.1) | (T >= 1.8), swing)
    assert not any("no samples" in d for d in read_motion(leg, tmp_path / "m.csv", stop=1.1).doubts)


def test_the_verdict_is_not_green(leg):
    keep = (T <= 1.1) | (T >= 1.8)
    q = np.column_stack([swing(T), np.zeros_like(T)])
    levels = []
    for rows in (slice(None), keep):
        run = ksl.compute_loads(leg, [T[rows], q[rows]])
        levels.append([r for r in run.verdict.reasons if "no samples between" in r])
    assert levels[0] == [] and len(levels[1]) == 1 and ksl.compute_loads(leg, [T[keep], q[keep]]).verdict.level != "green"


@pytest.mark.parametrize(("gap", "way", "said"), [(5.0, 0.5, False), (5.01, 0.5, True), (6.0, 0.0499, False), (6.0, 0.0501, True)])
def test_gaps(gap, way, said):
    """Longer than five median steps, while the joint moves by more than a twentieth of its travel, 1 m; it rests before and after."""
    time = np.cumsum([0.0] + [1.0] * 6 + [gap] + [1.0] * 6)
    q = np.repeat([0.0, way, 1.0], [7, 4, 3])[:, None]
    found = doubts_about_gaps((SLIDE,), time, q)
    assert bool(found) == said and all(
        f"no samples between 6 s and {6 + gap:.6g} s, {gap:.3g} median steps, while slide moves by {way:.3g} m" in line for line in found
    )
    assert doubts_about_gaps((SLIDE,), time[5:8], q[5:8]) == []
    way = np.append(0.1 * np.arange(11), 0.1 * np.arange(10, -1, -1))  # what moves beside a gap has moved in it, though it is back
    (said,) = doubts_about_gaps((SLIDE,), np.append(np.arange(11.0), 16 + np.arange(11.0)), way[:, None])
    assert "no samples between 10 s and 16 s" in said


def test_the_joint_that_a_gap_hides_most_of():
    """By the share of its travel, not by its way."""
    time = np.array([0.0, 1, 2, 3, 10, 11, 12])
    far, near = np.array([0.0, 0, 0, 0, 10, 10, 100]), np.array([0.0, 0, 0, 0, 0.5, 0.5, 1])
    joints = tuple(replace(SLIDE, name=name, q_index=k, v_index=k) for k, name in enumerate(("far", "near", "still")))
    (said,) = doubts_about_gaps(joints, time, np.column_stack([far, near, 0 * near]))
    assert "while near moves by 0.5 m" in said
    (said,) = doubts_about_gaps(joints[:1], time, far[:, None])
    assert "while far moves by 10 m" in said and "7 median steps, while" in said


def test_a_gap_before_the_last_sample():
    time, q = np.array([0.0, 1, 2, 3, 9]), np.array([0.0, 0, 0, 0, 1])[:, None]
    (said,) = doubts_about_gaps((SLIDE,), time, q)
    assert said.startswith("no samples between 3 s and 9 s, 6 median steps, while slide moves by 1 m")


def test_gaps_of_one_joint_beside_samples_of_others(leg, tmp_path):
    """Of its own samples: the spline in it is nobody's motion.  Where the recording pauses, the gap is everybody's, and is told once."""
    hip = swing(T)
    hip[(T > 1.1) & (T < 1.8)] = np.nan
    for moving, keep, words in (
        (hip, T < 9, ["no samples of hip between 1.1 s and 1.8 s, 70 median steps, while it moves by 0.462 rad"]),
        (np.where(np.isnan(hip), hip, 0.2 + 0 * T), T < 9, []),
        (np.where(N_EVEN, swing(T), np.nan), (T <= 1.1) | (T >= 1.8), ["no samples between 1.1 s and 1.8 s, 70 median steps, while hip moves by 0.462 rad"]),
    ):
        file = tmp_path / "m.csv"
        np.savetxt(file, np.c_[T, moving, 0.1 * np.cos(T)][keep], delimiter=",", header="time,hip,slide", comments="")
        found = [d for d in read_motion(leg, file).doubts if "no samples" in d]
        assert [d[: len(w)] for d, w in zip(found, words, strict=True)] == words
