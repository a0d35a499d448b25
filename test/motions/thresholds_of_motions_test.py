"""Thresholds of readers, filters and generators of motions, each just below and just above, and curves in closed form."""

import gzip
import io
import re
import zipfile
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
import scipy.signal
from scipy.fft import dst
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

import ksl
from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.mechanism.lengths import extent
from ksl.mechanism.mechanism import Joint
from ksl.motions.columns.units import Unit, factor, unit_of
from ksl.motions.files.csv_form import _lines, doubts_about_end
from ksl.motions.generate import Waypoints, chirp, excitation, minimum_jerk, trapezoid
from ksl.motions.generate.excitation import Series, _Search
from ksl.motions.generate.generated import check_duration, effort_stretch, limits_of, sample_times, worst_rate, worst_use
from ksl.motions.generate.profiles import _Path, _fastest, _instants, _trapezoids
from ksl.motions.generate.waypoints import read_waypoints
from ksl.motions.motion import Motion, complete
from ksl.motions.reading import read_external, read_motion
from ksl.motions.signal.corners import (
    Found,
    Jumps,
    _best_of_neighbours,
    _polynomial,
    _snapped,
    evenly_spaced,
    find_jumps,
    jumps_at,
    noise_of_jumps,
    normalised_differences,
    one_sided,
)
from ksl.motions.signal.gaps import doubts_about_gaps
from ksl.motions.signal.noise import step_of, white_noise
from ksl.motions.signal.ordered import check_restart, ordered
from ksl.motions.signal.quality import _all_jumps, sentences_about_jumps
from ksl.motions.signal.resampling import on_spline, resampled
from ksl.motions.signal.smoothing import attenuation, noise_after, smoothed, suitable_cutoff
from ksl.motions.signal.standing import WINDOW, standing_of_integrated
from ksl.motions.signal.suspicions import suspicions, suspicions_of_pose

SLIDE = Joint("slide", "prismatic", "a", "b", 1, 1, 0, 0, (0.0, 0.0, 1.0), has_axis=True, has_angle=False)
MASS = '<inertial><origin xyz="0.3 0 0"/><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'


def robot_of(robot, *joints):
    """A chain of joints: (name, kind, limits)."""
    links = "".join(f'<link name="l{k}">{MASS}</link>' for k in range(1, len(joints) + 1))
    moved = "".join(
        f'<joint name="{name}" type="{kind}"><parent link="l{k}"/><child link="l{k + 1}"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>{limits}</joint>'
        for k, (name, kind, limits) in enumerate(joints)
    )
    return robot(f'<robot name="r"><link name="l0"/>{links}{moved}</robot>')


def limit(lower, upper, velocity=2, effort=100):
    return f'<limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="{effort}"/>'


def test_noise_of_extrapolations_in_closed_form():
    """Through one, two and three samples at 1/2, 3/2, 5/2 on each side, from there to the middle."""
    assert noise_of_jumps(1) == pytest.approx([np.sqrt(2)])
    assert noise_of_jumps(2) == pytest.approx([np.sqrt(2 * (9 + 1) / 4), 2])
    assert noise_of_jumps(3) == pytest.approx([np.sqrt(2 * (225 + 100 + 9)) / 8, np.sqrt(2 * (4 + 9 + 1)), np.sqrt(2 * (1 + 4 + 1))])


# units that are suspected


@pytest.mark.parametrize(
    ("kind", "limits", "least", "most"),
    [
        ("revolute", limit(-1, 1), 3.0, 3.0 * 180 / np.pi), ("revolute", limit(-4, -1), 6.0, 6.0 * 180 / np.pi), ("revolute", limit(1, 4), 6.0, 6.0 * 180 / np.pi),
        ("continuous", "", 100.0, 100 * 180 / np.pi), ("prismatic", limit(-2, 1), 4.5, 4500.0), ("prismatic", limit(0, 0.2), 1.0, 300.0), ("prismatic", limit(0, 0), None, None),
    ],
)  # fmt: skip
def test_positions_of_another_unit(robot, kind, limits, least, most):
    """Beyond 1.5 times the limits or their range, 100 rad, or 20 times the robot's extent, 1 m at least; and possible in the smaller unit."""
    m = robot_of(robot, ("j", kind, limits))
    least, most = (20 * extent(m), 20e3 * extent(m)) if least is None else (least, most)
    word = "millimetres" if kind == "prismatic" else "degrees"
    for x, said in ((0.999 * least, False), (1.001 * least, True), (0.999 * most, True), (1.001 * most, False)):
        for found in (suspicions_of_pose(m, np.array([-x])), suspicions(m, np.arange(3.0), np.array([[0.0], [x], [0]]), np.ones((3, 1)))):
            assert [f"j reaches {x:.4g} " in line and word in line for line in found] == [True] * said


def one_sided_joints():
    for both in ((-1, None), (None, 1)):
        b = ksl.Builder("a").add_link("l0").add_link("l1", 1.0, (0, 0, 0.1), 0.1 * np.eye(3))
        yield b.add_joint("p", "revolute", "l0", "l1", axis=(1, 0, 0), limits=both).build()


def test_joints_with_one_limit_are_as_those_without():
    for m in one_sided_joints():
        assert [bool(suspicions_of_pose(m, np.array([x]))) for x in (99.0, 101.0)] == [False, True]


@pytest.mark.parametrize(
    ("speed", "step", "said"),
    [
        (2e-3, 0.5, "milliseconds? Then add --time-unit ms"), (2.01e-3, 0.5, ""), (4.02e-5, 0.5, "--time-unit ms"), (3.98e-5, 0.5, ""), (2e-3, 0.0999, ""), (2e-3, 0.1001, "ms"),
        (2e-3, 999.0, "ms"), (2e-3, 1001.0, ""), (2e-6, 1001.0, "microseconds? Then add --time-unit us"), (2e-9, 2e6, "nanoseconds? Then add --time-unit ns"), (4.02e-8, 0.5, "us"), (3.98e-8, 0.5, ""),
        (4.02e-11, 0.5, "ns"), (3.98e-11, 0.5, ""), (0.0, 0.5, ""),
        (201.0, 0.99e-4, "times its limit: check"), (199.0, 0.99e-4, ""), (201.0, 1.01e-4, ""),
    ],
)  # fmt: skip
@pytest.mark.parametrize("limits", [limit(-9, 9), ""])
def test_times_of_another_unit(robot, speed, step, said, limits):
    m = robot_of(robot, ("j", "revolute" if limits else "continuous", limits))
    found = suspicions(m, step * np.arange(5), np.zeros((5, 1)), np.linspace(0, -speed, 5)[:, None])
    assert [(said if limits else said.replace("its limit", "2 rad/s or m/s")) in line for line in found] == [True] * bool(said)
    long = suspicions(m, np.linspace(0, 0.1001, 5000), np.zeros((5000, 1)), np.full((5000, 1), 201.0))
    assert long == [] and len(suspicions(m, np.linspace(0, 0.0999, 5000), np.zeros((5000, 1)), np.full((5000, 1), 201.0))) == 1


def test_instants_are_between_waypoints():
    path = _Path("trapezoid", None, None, np.array([0.0, 1.0, 4.0]), None, np.zeros(0))
    assert [path.where(share, 8.0) for share in (0.2, 0.3)] == [
        "trapezoid: between waypoints 1 and 2, at 1.6 s",
        "trapezoid: between waypoints 2 and 3, at 2.4 s",
    ]


# samples


def test_jumps_of_a_curve_and_of_its_slope_add_up():
    time = np.linspace(0, 4, 41)
    found = Found(Jumps(2, np.array([3.0]), np.array([4.0])), [(0, 1.0, 2.0), (1, 2.0, 3.0)])
    expected = 2 * (time >= 1) + 3 * np.maximum(time - 2, 0) + 2 * np.maximum(time - 3, 0) ** 2
    assert _all_jumps(found, time) == pytest.approx(expected, abs=1e-12)


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


@pytest.mark.parametrize(("share", "stands"), [(0.99, True), (1.01, False)])
def test_a_drift_of_twice_the_resolution_is_no_stand(share, stands):
    """Within the middle half of forty samples, 19 steps, though eight of them in a row always keep within it."""
    x = share * 2e-3 / 19 * np.arange(40)
    both = tuple(replace(SLIDE, name=name, q_index=k, v_index=k) for k, name in enumerate("ab"))
    found = standing_of_integrated(both, 0.1 * np.arange(40), np.column_stack([5 * np.arange(40.0), x]), np.ones((40, 2)), 1e-3, 0.0)
    assert found.stands[:, 1].all() == found.held[:, 1].all() == stands and found.stands[:, 1].any() == stands and not found.stands[:, 0].any()


@pytest.mark.parametrize("given", [[None, None], ["v", None], [None, "a"]])
def test_six_samples_are_needed_to_differentiate(leg, given):
    rates = [None if x is None else np.zeros((5, 1)) for x in given]
    with pytest.raises(MotionError, match="5 samples, but differentiating hip needs at least 6; add samples, or give the columns hip.v and hip.a"):
        complete(leg, np.arange(5.0), np.zeros((5, 2)), [rates, [np.zeros((5, 1))] * 2])
    rates = [None if x is None else np.zeros((6, 1)) for x in given]
    assert not complete(leg, np.arange(6.0), np.zeros((6, 2)), [rates, [np.zeros((6, 1))] * 2]).v.any()
    assert complete(leg, np.arange(2.0), np.zeros((2, 2)), [[np.zeros((2, 1))] * 2] * 2).q.shape == (2, 2)


@pytest.mark.parametrize(
    ("times", "at"),
    [
        ([0, 1, 0.5, 2], None),
        ([0, 1, 0.4999, 2], 2),
        ([0, 1, 1, 1], 2),
        ([0, 1, 2, 2, 2.5], None),
        ([0, 0, 0, 1], 1),
        ([0, 0, 1, 1], 1),
        ([0, 0, 1, 1, 2], None),
        ([3.0], None),
    ],
)
def test_times_that_go_back_or_stand_still(times, at):
    assert check_restart(np.array(times, dtype=float)) == at


@pytest.mark.parametrize(("share", "left"), [(0.0099, 9), (0.0101, 10)])
def test_samples_closer_than_a_hundredth_of_the_step_are_one(share, left):
    time = np.array([0.0, 1, 2, 3, 3 + share, 4, 5, 6, 7, 8])
    found = ordered("f", [SLIDE], time, {"slide": np.arange(10.0)}, np.arange(10))
    assert len(found.time) == left and bool(found.notes) == (left == 9)
    assert found.rows.tolist() == [k for k in range(10) if k != 3 or left == 10], "the last of them is used"


def test_which_joints_are_never_recorded_together():
    """The one that ends first, and the one that begins last: not `often`, which begins early and goes on."""
    joints = [replace(SLIDE, name=name, q_index=k, v_index=k) for k, name in enumerate(("early", "often", "late"))]
    time = np.arange(20.0)
    there = {"early": (time > 1) & (time < 9), "often": time != 3, "late": time > 10}
    with pytest.raises(MotionError, match="f: early and late are never recorded at the same time; record them together"):
        ordered("f", joints, time, {name: np.where(there[name], 1.0, np.nan) for name in there}, np.arange(20))


@pytest.mark.parametrize(("moved", "used"), [(0.00099, True), (0.00101, False)])
def test_velocities_that_are_all_zero_were_not_measured(moved, used):
    values = {"slide": np.array([0.0, moved, 0]), "slide.v": np.zeros(3)}
    assert ("slide.v" in ordered("f", [SLIDE], np.arange(3.0), values, np.arange(3)).values) == used


@pytest.mark.parametrize(
    ("x", "step"),
    [
        ([0.123, 1.5, -7.001], 1e-3), ([1.0, 5.0], 1.0), ([0.1, 0.25], 0.01), (0.0123 * np.arange(7) ** 2 + 1 / 3, 0.0123), (np.full(5, 1 / 3), 0.0),
        (np.array([0, 1, 2.0009, 5]) * 0.017 + 1 / 3, 0.017), (np.array([0, 1, 2.0011, 5]) * 0.017 + 1 / 3, 0.0), (np.sqrt(np.arange(9)), 0.0), ([0.123456789, 0.1], 1e-9), ([0.1234567891, 0.1], 0.0234567891),
    ],
)  # fmt: skip
def test_the_step_of_which_numbers_are_multiples(x, step):
    assert step_of(np.asarray(x, dtype=float)) == pytest.approx(step, rel=1e-9)


def test_multiples_are_such_to_rounding():
    """Of decimals to 1e-12; counts of an encoder that are a billionth of the largest number apart are one."""
    assert step_of(np.array([5.0, 1 + 0.95e-12])) == 1 and step_of(np.array([5.0, 1 + 1.05e-12])) == pytest.approx(4)
    assert [step_of(2.0**30 * np.array([0, 1 + k * np.finfo(float).eps])) == 1 for k in (8, 9)] == [True, False], "of large ones to eight of their last digits"
    for scale in (1.0, 2.0**-36):
        counts = np.sqrt(2) * scale * np.arange(7.0)
        near = lambda off: np.append(counts, counts[1] + off * counts[-1])
        assert step_of(near(0.95e-9)) == pytest.approx(counts[1]) and step_of(near(1.05e-9)) == 0


@pytest.mark.parametrize("n", [25, 26, 2000])
def test_noise_that_can_be_told(n):
    """Sixteen differences of the tenth order at least; a sine without noise has none."""
    rng = np.random.default_rng(1)
    t = np.arange(n) * 0.01
    x = np.column_stack([np.sin(t), np.sin(t) + 1e-3 * rng.normal(size=n), np.zeros(n)])
    found = white_noise(t, x, np.zeros(3))
    assert found[[0, 2]].tolist() == [0, 0] and (found[1] > 0) == (n > 25) and (n < 2000 or found[1] == pytest.approx(1e-3, rel=0.1))


@pytest.mark.parametrize(("width", "stands"), [(0.99, True), (1.01, False)])
def test_a_position_stands_within_the_error_of_its_integration(width, stands):
    """1e-3 + 1e-2 |q|, for eight samples."""
    x = 2.0 - 0.021 * width * (np.arange(40) % 2)
    found = standing_of_integrated([SLIDE], 0.1 * np.arange(40), x[:, None], np.ones((40, 1)), 1e-3, 1e-2)
    assert found.stands.all() == stands and found.stands.any() == stands and found.rate[0] == pytest.approx(0.21)
    eight = standing_of_integrated(
        [SLIDE], np.arange(30.0), np.concatenate([np.arange(11.0), np.full(8, 11.5), np.arange(12.0, 23)])[:, None], np.ones((30, 1)), 1e-3, 0
    )
    assert np.flatnonzero(eight.stands[:, 0]).tolist() == list(range(11, 19)) and not eight.held.any()
    long = np.concatenate([np.arange(11.0), np.full(30, 11.5), np.arange(12.0, 23)])[:, None]
    held = standing_of_integrated([SLIDE], np.arange(52.0), long, np.ones((52, 1)), 1e-3, 0).held
    assert np.flatnonzero(held[:, 0]).tolist() == list(range(11 + WINDOW, 41 - WINDOW)), "but for those near its ends"


@pytest.mark.parametrize(("rate", "ok"), [(0.0999, False), (0.1001, True), (2.0, True), (2.001e6, False), (0.0, False), (np.inf, False)])
def test_rates_of_resampling(rate, ok):
    time = np.linspace(3, 13, 11)
    make = lambda: resampled("f", [SLIDE], time, (time**2)[:, None], [[None, None]], rate, str)
    if not ok:
        with pytest.raises(MotionError, match="--resample"):
            make()
        return
    at, q, _, note = make()
    assert at == pytest.approx(3 + np.arange(int(10 * rate + 1e-9) + 1) / rate) and q[:, 0] == pytest.approx(at**2)
    few = lambda n: resampled("f", [SLIDE], time[:n], (time[:n] ** 2)[:, None], [[None, None]], 1.0, str)
    assert len(few(6)[0]) == 6
    with pytest.raises(MotionError, match="f: 5 samples, but resampling needs at least 6"):
        few(5)
    for n, degree in ((2, 1), (3, 1), (4, 3), (5, 3), (6, 5), (9, 5)):
        x = np.arange(n + 0.0) ** np.arange(degree + 1)[:, None]
        between = np.linspace(0, n - 1, 17)
        assert on_spline(np.arange(n + 0.0), x.T, between) == pytest.approx((between ** np.arange(degree + 1)[:, None]).T, abs=1e-8)
        bent = on_spline(np.arange(n + 0.0), np.arange(n + 0.0)[:, None] ** (degree + 1), np.array([0.5]))
        assert n == 2 or abs(bent[0, 0] - 0.5 ** (degree + 1)) > 1e-3, "no higher degree"
    b = (
        ksl.Builder("arm")
        .add_link("a")
        .add_link("b", 1.0, (0, 0, 0), np.eye(3))
        .add_link("c", 1.0, (0, 0, 0), np.eye(3))
        .add_link("d", 1.0, (0, 0, 0), np.eye(3))
    )
    b.add_joint("one", "continuous", "a", "b", axis=(0, 0, 1)).add_joint("ball", "spherical", "b", "c").add_joint("two", "continuous", "c", "d", axis=(0, 0, 1))
    exact = lambda t: np.column_stack([9 + t, np.outer(np.sin(t / 4), [1 / 3, 2 / 3, 2 / 3]), np.cos(t / 4), 7 - t])
    joints, sign = b.build().joints[:3], np.array([1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1])[:, None]  # quaternions of either sign
    signs = np.hstack([np.ones((11, 1)), np.repeat(sign, 4, axis=1), np.ones((11, 1))])
    now, states, *_ = resampled("f", joints, time, exact(time) * signs, [[None, None]] * 3, 2.0, str)
    assert states == pytest.approx(exact(now), abs=1e-5) and np.linalg.norm(states[:, 1:5], axis=1) == pytest.approx(1, abs=1e-14)
    for off, count in ((-0.4e-6, 11), (-0.6e-6, 10), (0.0, 11), (0.4e-6, 11)):  # a last sample that is missing by less than half a millionth of a step
        assert len(resampled("f", [SLIDE], time, (time**2)[:, None], [[None, None]], 1 + off / 10, str)[0]) == count
    assert note.startswith(f"resampled to {rate:g} Hz ({len(at)} samples) from 11 samples with a median step of 1 s")


# filters


def test_what_a_filter_leaves():
    assert attenuation(np.array([0.0, 1, 2, 4]), 2.0) == pytest.approx([1, 1 / (1 + 0.5**8), 0.5, 1 / 257])
    t = np.arange(2001) / 100
    for cutoff, ok in ((49.99, True), (50.0, False), (1.01e-4, True), (0.99e-4, False), (0.0, False)):
        if ok:
            assert np.isfinite(smoothed(t, np.sin(t)[:, None], cutoff)).all()
            continue
        with pytest.raises(MotionError, match="--smooth"):
            smoothed(t, np.sin(t)[:, None], cutoff)
    waves = np.sin(2 * np.pi * t[:, None] * [1, 3])
    assert smoothed(t, waves, 3.0)[200:-200] == pytest.approx(waves[200:-200] * attenuation(np.array([1.0, 3]), 3.0), abs=2e-4)


@pytest.mark.parametrize(("off", "even"), [(0.99e-5, True), (1.01e-5, False)])
def test_steps_that_a_filter_takes_as_even(off, even):
    """To 1e-5 of the mean: others are interpolated first, and back."""
    t = np.arange(200) * 0.01
    t[100:] += off / (1 - off / 199) * 0.01
    x = np.sin(7 * t) + np.cos(61 * t)
    plain = scipy.signal.sosfiltfilt(scipy.signal.butter(4, 9.0, fs=199 / t[-1], output="sos"), x, padtype="odd", padlen=int(np.ceil(3 * 199 / t[-1] / 9.0)))
    assert np.array_equal(smoothed(t, x[:, None], 9.0)[:, 0], plain) == even
    far = 0.01 * np.arange(200) * (1 + np.arange(200) / 500)  # by not-a-knot cubics
    regular = np.linspace(0, far[-1], 200)
    y = scipy.signal.sosfiltfilt(
        scipy.signal.butter(4, 9.0, fs=199 / far[-1], output="sos"), CubicSpline(far, x)(regular), padtype="odd", padlen=int(np.ceil(3 * 199 / far[-1] / 9.0))
    )
    assert smoothed(far, x[:, None], 9.0)[:, 0] == pytest.approx(CubicSpline(regular, y)(far), abs=1e-9)


@pytest.mark.parametrize("derivative", [0, 1, 2])
@pytest.mark.parametrize("cutoff", [3.0, 40.0, 49.0])
def test_noise_behind_a_filter_is_an_integral(cutoff, derivative):
    """Of the spectrum up to half the sampling rate, 100 Hz."""
    power = lambda f: (2 * np.pi * f) ** (2 * derivative) / (1 + (f / cutoff) ** 8) ** 2
    assert noise_after(cutoff, 0.01, derivative) == pytest.approx(np.sqrt(0.02 * quad(power, 0, 50)[0]), rel=1e-5)


@pytest.mark.parametrize("seed", range(27))
def test_a_suitable_cutoff_is_that_of_the_least_error(seed):
    """By a sine transform of its own, and 60 candidates that are tried one by one."""
    rng = np.random.default_rng(seed)
    n, h, noise, weight = (
        400 + 37 * seed if seed < 6 else 9001 if seed < 7 else 9 + seed,
        0.004,
        np.array([1e-4, 3e-5]) * 10.0 ** rng.uniform(-1, 1, 2),
        np.array([2.0, 0.5]),
    )
    t = h * np.arange(n)
    x = np.column_stack([np.sin(2 * np.pi * (1 + seed) * t), 0.3 * np.cos(9 * t)]) * (1 if seed < 7 else 1e-3) + noise * rng.normal(size=(n, 2))
    rest = x - x[0] - np.linspace(0, 1, n)[:, None] * (x[-1] - x[0])
    power = dst(rest[1:-1], type=1, axis=0) ** 2 / (2 * (n - 1))
    power = np.vstack([power, np.zeros((1, 2))])  # the last is zero for any odd continuation
    mean = np.array([power[max(0, k - 4) : k + 5].mean(axis=0) for k in range(len(power))])
    signal = np.where(mean > 3 * noise**2, np.maximum(power - noise**2, 0), 0)
    f = np.arange(1, len(power) + 1) / (2 * t[-1])
    cost = lambda H: np.sum(((1 - H) ** 2)[:, None] * signal * weight**2 * f[:, None] ** 4) + np.sum((H**2 * f**4)[:, None] * noise**2 * weight**2)
    tried = np.geomspace(max(2 * f[0], f[-1] / 1000), 0.8 * f[-1], 60)
    best = tried[np.argmin([cost(1 / (1 + (f / c) ** 8)) for c in tried])]
    assert suitable_cutoff(t, x, noise, weight) == suitable_cutoff(t + 64, x, noise, weight) == float(f"{best:.2g}")


# corners


def corner(at=0.503, off=0.0, left=0.0, right=0.0, step=0.01):
    """A motion whose acceleration jumps by 2 rad/s² at `at`, and its position by `off`; jerks on both sides."""
    t = step * np.arange(101)
    u = t - at
    return t, 0.2 * t + 0.3 * t**2 + np.where(u > 0, off + u**2 + right * u**3 / 6, left * u**3 / 6)


@pytest.mark.parametrize(
    ("most", "how"),
    [
        (0.03 * 2e-4, {"off": 1.0}), (0.2 / (0.015 - 0.0002), {"right": 1.0}), (0.2 / (0.015 + 0.0002), {"right": -1.0}),
        (0.2 / (0.01 - 0.0004), {"left": -1.0, "right": 1.0}),
    ],
    ids=str,
)  # fmt: skip
def test_what_is_a_jump_of_acceleration(most, how):
    """The sides meet to 3 % of J h².  Quadratics and cubics, 1.5 steps apart, agree to 10 % of J, which is taken 0.2 steps behind the jump; and
    within a step the acceleration of either side changes by less than that: where the jerks are opposite, both curves agree."""
    for share, found in ((0, True), (0.99, True), (1.02, False)):
        t, x = corner(**{name: share * most * sign for name, sign in how.items()})
        (one,) = find_jumps(t, x[:, None])
        assert (len(one.jumps.times) == 1) == found
        if share == 0:
            assert one.jumps.times == pytest.approx([0.503], abs=1e-9) and one.jumps.sizes == pytest.approx([2.0])


def test_a_jump_needs_five_samples_on_each_side():
    for n in range(2, 16):
        t = np.arange(float(n))
        (one,) = find_jumps(t, np.maximum(t - n / 2 + 0.4, 0)[:, None] ** 2)
        assert len(one.jumps.times) == (n >= 10) and not one.impossible


@pytest.mark.parametrize(("second", "count"), [(0.0197, 1), (0.0203, 2)])
def test_small_jumps_beside_large_ones_do_not_matter(second, count):
    """Less than 2 % of the largest acceleration; here 1 rad/s² after the first jump."""
    t = 0.01 * np.arange(201)
    x = np.maximum(t - 0.503, 0) ** 2 / 2 - second * np.maximum(t - 1.504, 0) ** 2 / 2
    (one,) = find_jumps(t, x[:, None])
    assert len(one.jumps.times) == count and one.impossible == []


@pytest.mark.parametrize(("at", "snapped"), [(0.500009, 0.5), (0.500011, 0.500011), (0.499991, 0.5), (0.499989, 0.499989)])
def test_times_beside_samples(at, snapped):
    """A thousandth of the step from a sample is at the sample."""
    t, x = corner(at=at)
    (one,) = find_jumps(t, x[:, None])
    assert one.jumps.times == pytest.approx([snapped], abs=1e-8)


@pytest.mark.parametrize("order", [2, 1])
@pytest.mark.parametrize("rows", [slice(None), slice(None, None, -1)])
def test_slow_motions_that_were_rounded_jump(order, rows):
    """By a step of rounding; by more than three also numbers that are multiples of one."""
    k = np.arange(101)
    for steps in (2, 2.99, 3.01):
        (one,) = find_jumps(0.01 * k, (1e-3 * (k + steps * (k > 50)))[rows, None], order, np.array([1e-3]))
        assert [f[0] for f in one.impossible] == [0] * (steps > 3) and len(one.jumps.times) == 0


@pytest.mark.parametrize("order", [2, 1])
def test_jumps_that_are_impossible_have_time_and_size(order):
    t = 0.01 * np.arange(101)
    smooth = np.sin(t)
    spike = smooth + 0.01 * (np.arange(101) == 40)
    (one,) = find_jumps(t, spike[:, None], order)
    ((kind, time, size),) = one.impossible
    assert (kind, time) == (-1, pytest.approx(0.4)) and size == pytest.approx(0.01, rel=1e-3) and len(one.jumps.times) == 0
    (one,) = find_jumps(t, (smooth + 0.5 * (t > 0.605))[:, None], order)
    assert [(k, pytest.approx(time, abs=0.006), pytest.approx(size, rel=1e-2)) for k, time, size in one.impossible] == [(0, 0.605, 0.5)]
    if order == 2:
        (one,) = find_jumps(t, (smooth + 3 * np.maximum(t - 0.603, 0))[:, None], order)
        assert [(k, pytest.approx(time, abs=1e-3), pytest.approx(size, rel=1e-2)) for k, time, size in one.impossible] == [(1, 0.603, 3.0)]


# generators


def test_trapezoids_in_closed_form():
    """From 1 to 3 in 4 s, ramps of a quarter: 1 s up to 2/3 a second, 2 s steady, 1 s down; then back by 1 in 2 s with ramps of a half."""
    times, positions, ramps = np.array([0.0, 4, 6]), np.array([[1.0], [3], [2]]), np.array([0.25, 0.5])
    t = np.array([0.0, 0.5, 1, 2, 3, 3.5, 4, 4.5, 5.5, 6])
    q, v, a = (x[:, 0] for x in _trapezoids(t, times, positions, ramps))
    assert q == pytest.approx([1, 1 + 1 / 12, 4 / 3, 2, 8 / 3, 3 - 1 / 12, 3, 2.875, 2.125, 2])
    assert v == pytest.approx([0, 1 / 3, 2 / 3, 2 / 3, 2 / 3, 1 / 3, 0, -0.5, -0.5, 0])
    assert a == pytest.approx([2 / 3, 2 / 3, 0, 0, -2 / 3, -2 / 3, -1, -1, 1, 0])
    duration, share = _fastest(np.array([2.0, 9.0]), np.array([8.0, 4.0]))
    assert duration == pytest.approx([0, 0.75, 1.75]) and share == pytest.approx([1 / 3, 0.5]), "1/v + v/a; the second is a triangle"
    instants = _instants(times, ramps)
    assert (np.diff(instants) >= 0).all() and instants[[0, -1]].tolist() == [0, 1] and len(instants) >= 1900
    assert all(np.sum((instants > a) & (instants < b)) >= 300 for a, b in ((0, 1 / 6), (1 / 6, 1 / 2), (1 / 2, 2 / 3), (2 / 3, 5 / 6), (5 / 6, 1)))


@pytest.mark.parametrize(("make", "speed"), [(minimum_jerk, 15 / 8), (trapezoid, 1.5)])
def test_the_shortest_time_by_hand(robot, make, speed):
    """2 rad with at most 1 rad/s: 80 % of it without a time, all of it with one that is given."""
    m, points = robot_of(robot, ("j", "revolute", limit(-2, 2, 1))), Waypoints(np.array([[-1.0], [1.0]]))
    assert make(m, points).motion.time[-1] == pytest.approx(2 * speed / 0.8, rel=1e-4)
    assert make(m, points, duration=2 * speed * 1.0001).motion.time[-1] == 2 * speed * 1.0001
    shortest = 2 * speed * (1 + 1e-6)  # a millionth more, so that rounding takes nothing beyond a limit
    assert make(m, points).motion.time[-1] == pytest.approx(shortest / 0.8, rel=5e-8)
    make(m, points, duration=shortest * (1 - 0.95e-5))
    with pytest.raises(MotionError, match=f"the shortest time within all limits is {2 * speed:.4g} s"):
        make(m, points, duration=shortest * (1 - 1.05e-5))
    stays = make(m, Waypoints(np.array([[-1.0], [-1.0], [1.0], [1.0]]))).motion  # a thousandth of the longest time, where waypoints are the same
    assert np.interp([1 / 1002, 1001 / 1002], stays.time / stays.time[-1], stays.q[:, 0]) == pytest.approx([-1, 1], abs=2e-3)


@pytest.mark.parametrize("make", [minimum_jerk, trapezoid])
@pytest.mark.parametrize(("side", "end"), [(1, "upper"), (-1, "lower")])
def test_waypoints_at_a_limit(robot, make, side, end):
    """Beyond it by less than a millionth of half the range is at it."""
    m = robot_of(robot, ("j", "revolute", limit(-2, 2)))
    assert make(m, Waypoints(np.array([[0.0], [side * (2 + 1.9e-6)]]))).motion.q[-1, 0] == pytest.approx(2 * side)
    with pytest.raises(MotionError, match=f"between waypoints 1 and 2, at 100 % of the time, j goes to {2 * side} rad, beyond its {end} limit {2 * side} rad"):
        make(m, Waypoints(np.array([[0.0], [side * (2 + 2.1e-6)]])))


@pytest.mark.parametrize(("effort", "time"), [(1e9, 2.5 * (1 + 1e-4)), (1.05, 2.5 + 0.8 / 3), (0.35, 2.5 + 0.8), (0.035, 2 * np.sqrt(2 / 0.1))])
@pytest.mark.parametrize("acceleration", [5.0, 1e3, 1e8])
def test_the_fastest_trapezoid_within_efforts(robot, monkeypatch, effort, time, acceleration):
    """2 rad at 0.8 rad/s, about the vertical, with 0.28 kg m²: the acceleration that 80 % of the effort gives is the best one that is allowed, however much is.
    It makes d/v + v/a, or a triangle, 2 √(d/a); and without a limit of the effort the time for a ramp is a ten-thousandth of that of steady speed."""
    m, points = robot_of(robot, ("j", "revolute", limit(-2, 2, 1, effort))), Waypoints(np.array([[-1.0], [1.0]]))
    made = trapezoid(m, points, acceleration=acceleration).motion
    expected = max(time, 2.5 + 0.8 / acceleration)
    assert made.time[-1] == pytest.approx(expected, rel=3e-6 if effort > 100 else 1e-4)
    assert np.abs(m.inverse_dynamics(made.q, made.v, made.a)).max() <= 0.8 * effort * (1 + 1e-5)
    if effort > 100:  # nothing is searched where efforts ask for nothing, whatever waypoints there are
        monkeypatch.setattr("ksl.motions.generate.profiles.require", None)
        assert trapezoid(m, Waypoints(np.array([[-1.0], [1.0], [-1.0]])), acceleration=acceleration).motion.time[-1] == pytest.approx(2 * expected, rel=1e-5)


@pytest.mark.parametrize("effort", [0.2, 1.0])
def test_an_excitation_beyond_efforts_is_slowed_down(robot, effort):
    """As a whole: its rates stay its derivatives, its samples the same, and the effort that is used most is at 80 %."""
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3, effort)), ("b", "revolute", limit(-0.5, 0.5, 2, 100)))
    made = excitation(m, iterations=3, rate=100.0)
    t, q, v, a = made.motion.time, made.motion.q, made.motion.v, made.motion.a
    assert made.facts["period"] == t[-1] > 10 and made.facts["rate"] * t[-1] == pytest.approx(1000) and len(t) == 1001
    assert CubicSpline(t, q)(t, 1) == pytest.approx(v, abs=1e-5 * np.abs(v).max()) and CubicSpline(t, v)(t, 1) == pytest.approx(a, abs=1e-4 * np.abs(a).max())
    assert np.abs(m.inverse_dynamics(q, v, a))[:, 0].max() == pytest.approx(0.8 * effort)


@pytest.mark.parametrize(("root", "condition"), [(1e-6, 1e6), (0.95e-7, 1e7), (1.05e-7, 1 / 1.05e-7), (0.0, 1e7)])
def test_condition_numbers_end_where_motions_excite_nothing(robot, root, condition):
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3, 1e9)))
    limits = limits_of(m)
    base = type("Base", (), {"links": None, "__len__": lambda self: 2, "regressor": lambda self, full: np.diag([1.0, root])})()
    search = _Search(m, limits, base, Series(limits, 5.0), 0)
    assert search._cost(np.random.default_rng(0).normal(size=12)) == pytest.approx(condition, rel=1e-6)


def test_a_chirp_in_closed_form(robot):
    """Phase 2π (low t + (high − low) t² / 2T), the second joint 7 % faster; quintic ends of a twentieth of the time."""
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3, 1e6)), ("b", "revolute", limit(-0.5, 0.5, 1, 1e6)))
    made = chirp(m, duration=10.0, low=0.2, high=1.5, rate=100.0, acceleration=20.0)
    t = np.linspace(0, 10, 1001)[:, None]
    faster = np.array([1.0, 1.07])
    w = 2 * np.pi * (0.2 + 0.13 * t) * faster
    x = np.clip(np.minimum(t, 10 - t) / 0.5, 0, 1)
    amplitude = ((1 / np.array([1.5, 0.5])) ** 4 + (w / np.array([3.0, 1.0])) ** 4 + (w**2 / 20) ** 4) ** -0.25
    expected = np.array([0.5, 0]) + made.facts["share"] * (10 * x**3 - 15 * x**4 + 6 * x**5) * amplitude * np.sin(2 * np.pi * (0.2 * t + 0.065 * t**2) * faster)
    assert made.motion.q == pytest.approx(expected, abs=1e-9)
    assert worst_use(limits_of(m, 20.0), made.motion.q, made.motion.v, made.motion.a).share == pytest.approx(0.8, rel=0.06) and made.facts["share"] <= 0.8
    for low, high in ((0.0, 1.0), (1.0, 1.0), (1.0, 10.0)):
        with pytest.raises(MotionError, match="chirp from"):
            chirp(m, low=low, high=high, rate=100.0)


def test_a_chirp_within_efforts(robot):
    """Amplitudes are reduced by a twentieth at a time, forty times at most.  About the vertical, efforts are in proportion to them."""
    of = lambda effort: robot_of(robot, ("a", "revolute", limit(-1, 1, 1e3, effort)))
    plain = chirp(of(1e9), duration=10.0, rate=100.0)
    assert plain.facts["share"] == 0.8
    peak = np.abs(of(1e9).inverse_dynamics(plain.motion.q, plain.motion.v, plain.motion.a)).max() / 0.8
    for times in (0.0, 1.0, 7.0, 39.0):
        assert chirp(of(peak * 0.95 ** (times - 0.01)), duration=10.0, rate=100.0).facts["share"] == pytest.approx(0.8 * 0.95**times)
    with pytest.raises(MotionError, match="efforts are beyond their limits even at small amplitudes"):
        chirp(of(peak * 0.95**39.01), duration=10.0, rate=100.0)


@pytest.mark.parametrize("seed", range(3))
def test_any_candidate_of_a_search_keeps_to_the_limits(robot, seed):
    """A share s of one of them is used: 90 % of the range, and 78.8 % of the speed; it begins at rest, and its rates are its derivatives."""
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3)), ("b", "revolute", limit(-0.5, 0.5, 0.3)))
    limits = limits_of(m, 5.0)
    series, x = Series(limits, 7.0), np.random.default_rng(seed).normal(size=24) * 2
    q, v, a = series(x, series.times)
    assert series.times == pytest.approx(np.arange(100) * (7.0 / 5 / 20)), "twenty in the shortest period"
    used = np.maximum.reduce(
        [np.ptp(q, axis=0) / (2 * 0.9 * limits.half), np.abs(v).max(axis=0) / (0.985 * 0.8 * limits.velocity), np.abs(a).max(axis=0) / (0.985 * 5)]
    )
    share = 1 / (1 + np.exp(-3 - x.reshape(2, 12)[:, -2]))
    assert used == pytest.approx(share) and (q >= limits.middle - 0.9 * limits.half - 1e-12).all() and (q <= limits.middle + 0.9 * limits.half + 1e-12).all()
    t, h = np.linspace(0, 14, 200), 1e-5
    (q0, v0, _), (q1, v1, _), (_, vt, at) = series(x, t - h), series(x, t + h), series(x, t)
    assert (q1 - q0) / (2 * h) == pytest.approx(vt, abs=1e-6) and (v1 - v0) / (2 * h) == pytest.approx(at, abs=1e-6)
    assert vt[0] == pytest.approx(0, abs=1e-12) and at[0] == pytest.approx(0, abs=1e-12) and vt[-1] == pytest.approx(0, abs=1e-10)
    room = limits.middle + (0.9 * limits.half - np.ptp(q, axis=0) / 2) * np.tanh(x.reshape(2, 12)[:, -1])
    assert (q.max(axis=0) + q.min(axis=0)) / 2 == pytest.approx(room)


def test_durations_rates_and_numbers_of_samples():
    for x in (1e-6, 1e9):
        check_duration(x)
    for x in (0.99e-6, 1.01e9):
        with pytest.raises(MotionError, match="expected a positive number, 1e-06 s to 1e"):
            check_duration(x)
        with pytest.raises(MotionError, match="samples a second: expected a positive number"):
            sample_times(1.0, x)
    assert len(sample_times(2.0, 250.0)) == 501 and len(sample_times(1.0, 1.0)) == 7
    with pytest.raises(MotionError, match="10,000,001 samples"):
        sample_times(10_000_001.0, 1.0)


def test_limits_that_generators_take(robot):
    """Mimic joints limit their leaders; what the file does not say is said."""
    m = robot_of(
        robot,
        ("a", "revolute", limit(-1, 2, 3, 7)),
        ("b", "prismatic", limit(0, 1, 0, 0)),
        ("c", "revolute", limit(-5, 5, 0.5) + '<mimic joint="a" multiplier="-2"/>'),
    )
    limits = limits_of(m)
    assert [j.name for j in limits.joints] == ["a", "b"] and limits.velocity.tolist() == [0.25, 0.25] and limits.effort.tolist() == [7, np.inf]
    assert (
        limits.middle.tolist() == [0.5, 0.5]
        and limits.half.tolist() == [1.5, 0.5]
        and limits.notes == ["the file gives no limits of speed for b: 1 rad/s and 0.25 m/s were taken"]
    )
    assert [limits_of(one).unbounded for one in one_sided_joints()] == [("p",)] * 2
    use = worst_rate(limits_of(m, 4.0), np.array([[0.1, 0], [0, -0.2]]), np.array([[1.0, 1], [1, 2]]))
    assert (use.quantity, use.joint.name, use.sample, use.share, use.of_limit) == ("speed", "b", 1, 0.8, "of its limit 0.25 m/s")
    use = worst_rate(limits_of(m, 4.0), np.array([[0.1, 0], [0, 0.2]]), np.array([[-5.0, 1], [1, 2]]))
    assert (use.quantity, use.joint.name, use.sample, use.share, use.of_limit) == ("acceleration", "a", 0, 1.25, "of its limit 4 rad/s²")


@pytest.mark.parametrize(
    ("effort", "acceleration", "stretch"), [(40.0, 10.0, 1.0), (10.0, 10.0, np.sqrt(2.8)), (10.0, -10.0, np.sqrt(2.8)), (20.0, 10.0, np.sqrt(1.4))]
)
def test_how_much_slower_a_motion_must_be(robot, effort, acceleration, stretch):
    """Turning about the vertical, 0.28 kg m² · 100 rad/s² … of the joint alone: efforts are as the square of the time."""
    m = robot_of(robot, ("j", "revolute", limit(-1, 1, 1, effort)))
    motion = Motion(np.arange(2.0), np.zeros((2, 1)), np.zeros((2, 1)), np.array([[0.0], [10 * acceleration]]))
    assert effort_stretch(m, limits_of(m), motion) == (pytest.approx(stretch), [])
    assert effort_stretch(m, limits_of(m), motion, 0.5)[0] == pytest.approx(max(1.0, np.sqrt(28 / (0.5 * effort))))


@pytest.mark.parametrize(("iterations", "reason"), [(41, "improving"), (4, "improving")])
def test_a_search_that_has_just_begun_is_not_at_its_end(robot, iterations, reason):
    m = robot_of(robot, ("a", "revolute", limit(-1, 2, 3)), ("b", "revolute", limit(-0.5, 0.5, 2)))
    facts = excitation(m, iterations=iterations, rate=20.0).facts
    assert facts["iterations"] == iterations and facts["reason"] in (reason, "converged") and facts["condition"] <= facts["first"]
    assert (facts["condition"] == facts["first"]) or iterations > 40


# columns


NAMES_OF_UNITS = {
    ("time", 1.0): "s sec secs second seconds", ("time", 60.0): "min", ("time", 3600.0): "h", ("time", 1e-3): "ms msec", ("time", 1e-6): "us µs μs", ("time", 1e-9): "ns nsec",
    ("angle", 1.0): "rad rads radian radians", ("angle", 1e-3): "mrad", ("angle", 2 * np.pi): "rev turn turns", ("angle", np.pi / 180): "deg degs degree degrees °",
    ("length", 1.0): "m", ("length", 1e-2): "cm", ("length", 1e-3): "mm", ("length", 1e-6): "um µm μm", ("length", 0.0254): "in inch",
}  # fmt: skip
ENDS = ("", "/s /sec s^-1 ·s^-1 *s^-1".split(), "/s² /s^2 /s2 /(s^2) s^-2 /s/s /sec^2 /s**2".split())


@pytest.mark.parametrize(("quantity", "factor"), NAMES_OF_UNITS, ids=str)
def test_units_of_columns(quantity, factor):
    """With rates of all but times, in brackets and capitals."""
    for name in NAMES_OF_UNITS[quantity, factor].split():
        for per_time in (0, 1, 2):
            for end in ENDS[per_time] or ("",):
                expected = None if quantity == "time" and per_time else Unit(quantity, per_time, pytest.approx(factor, rel=1e-15))
                for text in (
                    name + end,
                    f"[{name}{end}]",
                    f"( {name} {end})",
                    f"<{name}{end}>",
                    (name + end).upper() if (name + end).isascii() else name + end,
                ):
                    assert unit_of(text) == expected, text


@pytest.mark.parametrize("text", ["rpm", "1/min", "U/min", "r/min"])
def test_turns_a_minute(text):
    assert unit_of(text) == Unit("angle", 1, pytest.approx(np.pi / 30)) and [unit_of(x) for x in ("-", "1", "none", "", "[]")] == [Unit("plain", 0, 1.0)] * 5


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (b"a\n1\n2", 3), (b"a\n1\n2\n", None), (b"a,b", None), (b"a\n1\n  ", None), (b"a\n1\n # end", None), (b"a\n1\n%", None), (b"a\n1\n// x", None), (b"a\r1\r2", 3), (b"a\r\n1\r\n2\r\n3", 4),
        (b"a\r\n1\r\n", None), (b"a\r1", 2),
    ],
)  # fmt: skip
def test_a_last_line_without_an_end(data, line):
    assert [f"the last line ({line}) of f has no line end" in said for said in doubts_about_end("f", data)] == [True] * bool(line)


def test_a_line_may_have_so_many_bytes(monkeypatch):
    """Also the last one, without an end."""
    for text, lines in ((b"x" * 64, 1), (b"x" * 63 + b"\n" + b"y" * 64, 2), (b"x" * 63 + b"\ny\n", 2)):
        monkeypatch.setattr(limits, "LINE_BYTES", 64)
        assert len(list(_lines("f", text, "ascii"))) == lines
        monkeypatch.setattr(limits, "LINE_BYTES", 63)
        with pytest.raises(MotionError, match="a line of more than"):
            list(_lines("f", text, "ascii"))


def test_units_that_are_none():
    assert [unit_of(x) for x in ("s/s", "furlong", "deg/m", "kg")] == [None] * 4


# files

K = np.arange(9.0)
COLUMNS = {"time": K, "hip": 0.1 * K, "slide": 0.01 * K**2}
"""Three columns with nine rows, 27 numbers, and `slide` as the longest name."""


def as_csv() -> bytes:
    return "\n".join([",".join(COLUMNS), *(",".join(map(repr, row)) for row in np.column_stack(list(COLUMNS.values())).tolist())]).encode() + b"\n"


def as_npz() -> bytes:
    np.savez(file := io.BytesIO(), **COLUMNS)
    return file.getvalue()


def as_parquet() -> bytes:
    pq.write_table(pa.table(COLUMNS), file := io.BytesIO())
    return file.getvalue()


def as_workbook(empty: int = 0) -> bytes:
    book = pytest.importorskip("openpyxl").Workbook()
    for row in [*[["Test 7"], *[[]] * empty] * bool(empty), list(COLUMNS), *np.column_stack(list(COLUMNS.values())).tolist()]:
        book.active.append(row)
    book.save(file := io.BytesIO())
    return file.getvalue()


def as_mat(packed: bool) -> bytes:
    scipy.io.savemat(file := io.BytesIO(), COLUMNS, do_compression=packed)
    return file.getvalue()


def unpacked(archive: bytes) -> int:
    with zipfile.ZipFile(io.BytesIO(archive)) as inside:
        return sum(each.file_size for each in inside.infolist())


FORMS = {
    "m.csv": as_csv, "m.csv.gz": lambda: gzip.compress(as_csv()), "m.npz": as_npz, "m.parquet": as_parquet, "m.xlsx": as_workbook,
    "empty.xlsx": lambda: as_workbook(3), "m.mat": lambda: as_mat(False), "packed.mat": lambda: as_mat(True),
}  # fmt: skip
LAST = [
    *((form, "COLUMNS", lambda _: 3) for form in ("m.csv", "m.npz", "m.parquet", "m.xlsx", "m.mat")),
    *((form, "NAME_LENGTH", lambda _: 5) for form in ("m.csv", "m.npz", "m.parquet", "m.xlsx")),
    *((form, "MOTION_NUMBERS", lambda _: 27) for form in FORMS), ("empty.xlsx", "EMPTY_ROWS", lambda _: 2 * 3),
    *((form, "MOTION_BYTES", len) for form in ("m.csv", "m.mat")),
    ("m.csv.gz", "MOTION_BYTES", lambda _: len(as_csv())), ("m.xlsx", "WORKBOOK_BYTES", unpacked), ("m.xlsx", "WORKBOOK_CELLS", lambda _: 30),
    ("packed.mat", "MOTION_BYTES", lambda _: len(as_mat(False)) - 128),
]  # fmt: skip
"""Form, limit, and the least value of it with which this file is read: by its rows, columns, names and bytes."""


@pytest.mark.parametrize(("form", "limit", "least"), LAST, ids=lambda x: x if isinstance(x, str) else "")
def test_a_file_at_a_limit_is_read_and_one_beyond_it_is_refused(leg, written, monkeypatch, form, limit, least):
    path = written(FORMS[form](), form)
    most = least(path.read_bytes())
    monkeypatch.setattr(limits, limit, most)
    motion = read_motion(leg, path)
    assert motion.time == pytest.approx(K) and motion.q == pytest.approx(np.column_stack([COLUMNS["hip"], COLUMNS["slide"]]))
    monkeypatch.setattr(limits, limit, most - 1)
    with pytest.raises(MotionError, match=re.escape(path.name)):
        read_motion(leg, path)


@pytest.mark.parametrize(("form", "limit", "most", "longest"), [("m.npz", "LINE_BYTES", 2 * 4 * 20, 20), ("m.mat", "COLUMNS", 3, 3 * 64 // 2)])
def test_names_of_joints_have_limits(leg, written, monkeypatch, form, limit, most, longest):
    """The bytes of an array, four a character; in MATLAB's, 64 characters for each column that there may be."""
    q = np.column_stack([COLUMNS["hip"], COLUMNS["slide"]])
    monkeypatch.setattr(limits, limit, most)
    for length in (longest, longest + 1):
        file, names = io.BytesIO(), np.array([name.ljust(length) for name in ("hip", "slide")], f"<U{length}")
        if form == "m.npz":
            np.savez(file, time=K, q=q, joints=np.char.strip(names).astype(names.dtype))
        else:
            scipy.io.savemat(file, {"time": K, "q": q, "joints": names})
        path = written(file.getvalue(), form)
        if length == longest:
            assert read_motion(leg, path).q == pytest.approx(q)
            continue
        with pytest.raises(MotionError, match="names"):
            read_motion(leg, path)


@pytest.mark.parametrize("end", [0, 1])
def test_waypoints_may_stand_at_limits(robot, written, end):
    """And a rounding error beyond them: a billionth of half the range, or of 1 rad."""
    for size in (0.5, 40.0):
        m = robot_of(robot, ("j", "revolute", limit(-size, size)))
        bound, room = (-size, size)[end], 1e-9 * max(1.0, size)
        for beyond, allowed in ((0.0, True), (0.95 * room, True), (1.05 * room, False)):
            path = written(f"j\n0\n{float(bound + np.copysign(beyond, bound))!r}\n")
            if allowed:
                assert read_waypoints(m, limits_of(m), path).positions[1, 0] == pytest.approx(bound)
                continue
            with pytest.raises(MotionError, match=f"waypoint 2: j .* is beyond its {('lower', 'upper')[end]} limit"):
                read_waypoints(m, limits_of(m), path)


def test_a_part_of_a_trapezoid_is_that_of_the_whole():
    """It ends at rest, and a part that is cut before the end is still in its ramp."""
    times, positions, ramps = np.array([0.0, 1.0, 3.0, 4.0]), np.array([[0.0, 1.0], [2.0, 1.5], [-1.0, 0.0], [0.0, 4.0]]), np.array([0.2, 0.3, 0.25])
    t = np.linspace(0, 4, 161)
    whole = _trapezoids(t, times, positions, ramps)
    assert not whole[2][-1].any() and whole[2][-2].any()
    for n in range(3, 161):
        for x, of in zip(_trapezoids(t[:n], times, positions, ramps), whole, strict=True):
            assert np.array_equal(x, of[:n])


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_arrays_of_each_version_of_numpys_form(leg, written, version):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, x in COLUMNS.items():
            with archive.open(f"{name}.npy", "w") as one:
                np.lib.format.write_array(one, x, version)
    assert read_motion(leg, written(file.getvalue(), "m.npz")).q[:, 1] == pytest.approx(COLUMNS["slide"])


@pytest.mark.parametrize(("rule", "where"), [({"to": "hip"}, "m.csv"), ({"to": "hip", "unit": "mm"}, "map")])
def test_a_unit_that_does_not_fit_is_where_it_was_given(leg, written, rule, where):
    """In the file, or in the map that names the column."""
    path = written("time,x,slide\ns,mm,mm\n0,0,0\n1,0,0\n" if where == "m.csv" else "time,x,slide\n0,0,0\n1,0,0\n", "m.csv")
    with pytest.raises(MotionError, match="column 'x' is in 'mm', but expected rad") as e:
        read_motion(leg, path, map={"x": rule})
    assert str(e.value).startswith(str(path) if where == "m.csv" else "map")


def samples(first: float, scale: float, angle: float = 0.1) -> str:
    return "time,hip,slide\n" + "".join(f"{first + scale * k!r},{angle if k == 4 else 0.1},0\n" for k in range(9))


@pytest.mark.parametrize("named", ["", "own", "other"])
@pytest.mark.parametrize(("unit", "size"), [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)])
def test_times_from_2000_to_2100_are_dates(leg, written, unit, size, named):
    """9.4e8 s to 4.2e9 s since 1970, in the unit in which they are that, unless their column says another one."""
    said = {"": "", "own": unit, "other": "ms" if unit == "ns" else "ns"}[named]
    for seconds, is_date in ((9.39e8, False), (9.41e8, True), (4.19e9, True), (4.21e9, False)):
        text = samples(round(seconds / size), 512 / size).replace("time", f"time [{said}]" if said else "time", 1)
        motion = read_motion(leg, written(text))
        date = f"times are {unit} since 1970; time 0 is {np.datetime64(int(seconds), 's')}.000 UTC"
        if is_date and named != "other":
            assert motion.source.notes == [*([f"column 'time [{said}]' is taken as the time"] if said else []), date]
            assert motion.time == pytest.approx(512 * K)
        else:
            assert not any("1970" in note for note in motion.source.notes)
            assert np.diff(motion.time) == pytest.approx(512 / (size if not said else 1 if named == "own" else size * {"ns": 1e9, "ms": 1e3}[said]))


@pytest.mark.parametrize(("first", "is_date"), [(0, False), (9.39e8, False), (9.41e8, True), (4.19e9, True), (4.21e9, False)])
def test_dates_of_seconds_and_nanoseconds(leg, written, first, is_date):
    """As they are, where they are none."""
    motion = read_motion(leg, written("sec,nanosec,hip,slide\n" + "".join(f"{round(first) + k},{250 * 10**6},0.1,0\n" for k in range(9))))
    assert motion.time == pytest.approx((0 if is_date else first) + 0.25 + K, abs=1e-12)
    assert any("times are s since 1970" in note for note in motion.source.notes) == is_date


@pytest.mark.parametrize(("angle", "refused"), [(999.9, False), (1000.1, True)])
def test_angles_that_no_joint_has(leg, robot, written, angle, refused):
    """A thousand rad, or a hundred times the limit, whichever is more."""
    far = robot_of(robot, ("hip", "revolute", limit(-20, 3)), ("slide", "prismatic", limit(-9, 9)))
    for model, x in ((leg, angle), (far, 2 * angle), (far, -2 * angle)):
        path = written(samples(0.0, 0.1, x))
        if not refused:
            assert read_motion(model, path).q[4, 0] == x
            continue
        with pytest.raises(
            MotionError, match=rf"motion.csv:6: joint hip is at {x:.6g} rad, where its limit is {9 if model is leg else 20} rad; did you mean --degrees"
        ):
            read_motion(model, path)
    free = robot_of(robot, ("hip", "continuous", ""), ("slide", "prismatic", limit(-9, 9)))
    assert read_motion(free, written(samples(0.0, 0.1, 1e5).replace(",0\n", ",5000\n"))).q[4].tolist() == [1e5, 5000.0], "of neither is anything known"


def test_a_window_takes_samples_that_are_a_billionth_off(leg, written):
    path = written(samples(0.0, 0.125))
    part = lambda start, stop: read_motion(leg, path, start=start, stop=stop).time.tolist()
    assert part(0.125 + 0.9e-9, 1.0) == [0.125 * k for k in range(1, 9)] and part(0.125 + 1.1e-9, 1.0) == [0.125 * k for k in range(2, 9)]
    for ends, said in (({"start": 0.125}, True), ({"start": 0.0}, False), ({"stop": 9.0}, True)):
        assert any("used is the part from " in note for note in read_motion(leg, path, **ends).source.notes) == said
    assert part(0.0, 0.875 - 0.9e-9) == [0.125 * k for k in range(8)] and part(0.0, 0.875 - 1.1e-9) == [0.125 * k for k in range(7)]


@pytest.mark.parametrize("step", [1.0, 0.05])
@pytest.mark.parametrize(("off", "ok"), [(0.95, True), (1.05, False)])
def test_times_of_external_wrenches_are_those_of_the_motion(leg, written, off, ok, step):
    """To a billionth of 1 s, or of the largest time."""
    time = step * (2.0 + np.arange(9))
    off *= 1e-9 * max(1.0, float(time[-1]))
    path = written("time,c.fy\n" + "".join(f"{t + (off if k == 3 else 0)!r},{k}\n" for k, t in enumerate(time.tolist())))
    if ok:
        (wrench,) = read_external(leg, path, time).values()
        assert wrench[:, 1].tolist() == list(range(9)) and not wrench[:, [0, 2, 3, 4, 5]].any()
        return
    with pytest.raises(MotionError, match="its times are not those of the motion"):
        read_external(leg, path, time)


@pytest.mark.parametrize(("more", "said"), [(0.052, False), (0.0533, True), (-0.0495, False), (-0.0505, True)])
def test_rates_that_differ_by_a_twentieth_contradict(leg, more, said):
    """Of the larger of both, at a steady speed of 2 rad/s."""
    t = np.arange(40) * 0.1
    q, v, none = np.column_stack([2 * t, 0 * t]), np.full((40, 1), 2 * (1 + more)), np.zeros((40, 1))
    found = complete(leg, t, q, [[v, none], [none, none]]).contradictions
    assert [line.startswith("hip.v at ") and f"is {2 * (1 + more):.4g} rad/s, but the position of hip changes at 2 rad/s" in line for line in found] == [
        True
    ] * said


# helpers of corners, by what polynomials are


def test_jumps_of_long_motions_that_were_rounded():
    """Of these not each difference is looked at to tell whether they were."""
    t = 0.01 * np.arange(9001)
    x = np.round(np.sin(0.3 * t), 4) + 1e-12 * np.arange(9001)
    jump = np.where(t > 45.003, (t - 45.003) ** 2, 0)
    for step, count in ((0.0, 0), (1e-4, 0)):
        assert [len(f.jumps.times) for f in find_jumps(t, x[:, None], 2, np.array([step]))] == [count]
    (one,) = find_jumps(t, (np.sin(0.3 * t) + jump)[:, None], 2, np.array([1e-9]))
    assert one.jumps.times == pytest.approx([45.003], abs=1e-5) and one.jumps.sizes == pytest.approx([2.0], rel=1e-3)


@pytest.mark.parametrize(("speed", "most"), [(0.04, 1e-5), (5.0, 5e-5)])
def test_a_contradiction_needs_a_way(leg, speed, most):
    """An integral of more than 1e-5 of the largest position or rate, or of 1."""
    t = np.arange(24) * 0.1
    for share, said in ((0.95, False), (1.05, True)):
        v = np.zeros((24, 1)) + share * most / 0.6
        none = np.zeros((24, 1))
        q = np.column_stack([speed * np.ones(24), 0 * t])
        lines = complete(leg, t, q, [[v, none], [none, none]]).contradictions
        assert [line.startswith("hip.v at ") for line in lines] == [True] * said


def test_even_steps():
    """To a thousandth of the mean: the last of three steps is longer by e, and so 2 e / 3 longer than the mean."""
    e = 1e-3 / (2 / 3 - 1e-3 / 3)
    assert [evenly_spaced(np.array([0.0, 1, 2, 3 + x])) for x in (0.999 * e, 1.001 * e, -1.001e-3 / (2 / 3 + 1e-3 / 3))] == [True, False, False]


@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("order", [1, 4, 8])
def test_differences_leave_nothing_of_polynomials_and_all_of_noise(order, even):
    """The squares of the weights, which unit impulses show, have the sum 1."""
    t = np.arange(24.0) if even else np.cumsum(np.random.default_rng(order).uniform(0.5, 2, 24))
    assert normalised_differences(t, (t[:, None] / 10) ** np.arange(order), order) == pytest.approx(0, abs=1e-6)
    weights = normalised_differences(t, np.eye(24), order)
    assert weights.shape == (24 - order, 24) and (weights**2).sum(axis=1) == pytest.approx(1)
    assert all(np.flatnonzero(row).tolist() == list(range(k, k + order + 1)) for k, row in enumerate(weights))
    steps = np.round(t * 2**20) / 2**20
    for other in (steps + 2.0**30, steps * 2.0**-60):  # from another time on, and in another unit
        assert normalised_differences(other, np.eye(24), order) == pytest.approx(weights, abs=1e-5)


def test_polynomials_on_one_side():
    rng = np.random.default_rng(3)
    t, c = np.cumsum(rng.uniform(0.5, 2, 30)), rng.normal(size=4)
    p = np.polynomial.Polynomial(c)
    at, first = np.array([2.5, 9.1, 20.0]), np.array([0, 7, 22])
    found = one_sided(t, p(t), first, 4, at)
    assert found == pytest.approx(np.column_stack([p.deriv(k)(at) if k else p(at) for k in range(4)]), rel=1e-6, abs=1e-6)
    s = np.array([0.3, -2.0, 1.0])
    assert _polynomial(found, s) == pytest.approx(p(at + s), rel=1e-6, abs=1e-6)


def test_neighbours_are_one_jump_and_times_beside_samples_are_theirs():
    cost = np.array([2.0, 1, 3, 0.5, np.inf])
    assert _best_of_neighbours(np.array([0, 3, 4, 8, 20]), cost).tolist() == [1, 3] and _best_of_neighbours(np.array([0, 4, 8, 12, 20]), cost).tolist() == [
        0,
        1,
        2,
        3,
    ]
    gaps, tau = np.zeros(6, dtype=int), np.array([0.019, 0.021, 0.39, 0.41, 1.59, 1.61])
    assert _snapped(np.array([0.0, 2, 4]), gaps, tau, np.array([0.01, 0.01, 1, 1, 1, 1])).tolist() == [0, 0.021, 0, 0.41, 1.59, 2]


@pytest.mark.parametrize("at", [0.5, 0.503])
def test_jumps_at_known_times(at):
    """Of both derivatives, exactly for quartics; with fewer than three samples to the next jump there is none."""
    t = 0.01 * np.arange(101)
    x = t**4 - t**2 + np.where(t > at, 0.7 * (t - at) - 1.5 * (t - at) ** 2, 0)
    first, second = jumps_at(t, x, np.array([at, 0.99]))
    assert first.sizes == pytest.approx([0.7, 0], abs=1e-7) and second.sizes == pytest.approx([-3, 0], abs=1e-4) and (first.order, second.order) == (1, 2)
    assert [j.sizes.tolist() for j in jumps_at(t, x, np.array([1.7]))] == [[0], [0]], "behind the last sample"
    close = jumps_at(t, np.maximum(t - 0.5, 0), np.array([0.5, 0.515]))[0]
    assert close.sizes[0] == 0 and jumps_at(t, np.maximum(t - 0.5, 0), np.array([0.5, 0.525]))[0].sizes == pytest.approx([1, 0])


@pytest.mark.parametrize("rows", [slice(None), slice(None, None, -1)])
@pytest.mark.parametrize(("off", "said"), [(0.0149, False), (0.0151, True), (-0.0151, True)])
def test_an_end_that_is_off_by_more_than_one_and_a_half_steps(off, said, rows):
    t = np.arange(40) * 0.1
    x = (0.1 * t + off * (np.arange(40) == 0))[rows]
    (one,) = find_jumps(t, x[:, None])
    ends = [(-1, pytest.approx(0.0 if rows == slice(None) else 3.9), pytest.approx(off))] if said else []
    assert one.impossible == ends
    (one,) = find_jumps(t, (x[rows] - 0.025 * np.maximum(t - 2.03, 0) ** 2)[rows, None])  # with a corner inside
    assert one.impossible == ends and len(one.jumps.times) == 1


@pytest.mark.parametrize(("apart", "times"), [(0.19, 1), (0.21, 2)])
def test_corners_within_a_fifth_of_a_step_are_one(apart, times):
    found = {name: Found(Jumps(2, np.array([t]), np.ones(1))) for name, t in (("hip", 0.5), ("slide", 0.5 + 0.1 * apart))}
    notes, at, doubts = sentences_about_jumps((SLIDE,), found, {}, 0.1 * np.arange(9))
    assert len(at) == times and at[0] == 0.5 and doubts == []
    assert notes[0].startswith(f"accelerations of hip and 1 more jump {'once' if times == 1 else '2 times, first'} at 0.5 s")


@pytest.mark.parametrize(("size", "turn"), [(2 * np.pi * 1.0099, True), (-2 * np.pi * 0.9901, True), (2 * np.pi * 1.0101, False), (2 * np.pi * 0.9899, False)])
def test_a_full_turn_is_one_to_a_hundredth(size, turn):
    hip = Joint("hip", "revolute", "a", "b", 1, 1, 0, 0, (0.0, 0.0, 1.0), has_axis=True, has_angle=True)
    for joint in (hip, SLIDE):
        found = {joint.name: Found(Jumps(2, np.empty(0), np.empty(0)), [(0, 0.5, size), (0, 0.9, size)])}
        assert " at 0.5 s (2 such jumps)" in sentences_about_jumps((joint,), found, {}, 0.1 * np.arange(9))[2][0]
        found = {joint.name: Found(Jumps(2, np.empty(0), np.empty(0)), [(0, 0.5, size)])}
        (said,) = sentences_about_jumps((joint,), found, {}, 0.1 * np.arange(9))[2]
        assert (
            said.startswith(f"{joint.name} jumps by {size:.4g} at 0.5 s") and "such" not in said and ("a full turn. Unwrap" in said) == (turn and joint is hip)
        )


@pytest.mark.parametrize(
    ("tried", "gain", "smallest", "reason"),
    [
        (100, 0.0099, 50.0, "converged"), (100, 0.0101, 50.0, "improving"), (41, 0.0, 50.0, "converged"), (40, 0.0, 50.0, "improving"), (100, 0.0, 1.001e7, "singular"),
        (100, 0.0, 0.999e7, "converged"), (3, 1.0, 50.0, "improving"),
    ],
)  # fmt: skip
def test_when_a_search_is_at_its_end(tried, gain, smallest, reason):
    """The number fell by less than a hundredth in the last quarter; forty random candidates are no search, and 1e7 is no number."""
    search = object.__new__(_Search)
    search.tried, search.smallest = tried, smallest
    search._after = [smallest / (1 - gain) * (1 + abs(k - (3 * tried // 4 - 1))) if tried > 3 else smallest for k in range(tried)]
    assert search.progress() == {"gain": pytest.approx(gain), "converged": reason == "converged", "reason": reason}


def test_units_of_rates():
    assert (
        factor("f", "c", "deg", "angle", 1, True) == pytest.approx(np.pi / 180) == factor("f", "c", "deg/s", "angle", 1)
        and factor("f", "c", "-", "angle", 1) == 1
    )
    for wrong in (("deg", "angle", 1), ("deg/s^2", "angle", 1, True), ("m", "angle", 0), ("m", "angle", 1, True)):
        with pytest.raises(MotionError, match="but expected"):
            factor("f", "c", *wrong)
    with pytest.raises(MotionError, match="no unit that KSL knows; did you mean 'deg'"):
        factor("f", "c", "degg", "angle", 0)


@pytest.mark.parametrize("kind", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"])
def test_numbers_of_matlab_of_every_type(leg, written, kind):
    scipy.io.savemat(file := io.BytesIO(), {"time": K.astype(kind), "hip": (2 * K).astype(kind), "slide": K[::-1].astype(kind)})
    motion = read_motion(leg, written(file.getvalue(), "m.mat"))
    assert motion.time == pytest.approx(K) and motion.q == pytest.approx(np.column_stack([2 * K, K[::-1]]))


def test_a_gap_before_the_last_sample():
    time, q = np.array([0.0, 1, 2, 3, 9]), np.array([0.0, 0, 0, 0, 1])[:, None]
    (said,) = doubts_about_gaps((SLIDE,), time, q)
    assert said.startswith("no samples between 3 s and 9 s, 6 median steps, while slide moves by 1 m")


def test_where_rates_contradict_most(leg):
    """A tenth more in the second half, and most at 6.3 s; faults of one kind are counted."""
    t = np.arange(80) * 0.1
    v, none = np.where(t > 4, 2.2, 2.0) + 0.1 * (np.arange(80) == 63), np.zeros((80, 1))
    said, *_ = complete(leg, t, np.column_stack([2 * t, 0 * t]), [[v[:, None], none], [none, none]]).contradictions
    assert said.startswith("hip.v at 6.3 s is 2.3 rad/s, but the position of hip changes at 2 rad/s")
    for many, often in ((1, ""), (2, " (2 such samples)")):
        found = {"slide": Found(Jumps(2, np.empty(0), np.empty(0)), [(-1, 0.5 + k, 0.25) for k in range(many)])}
        assert sentences_about_jumps((SLIDE,), found, {}, t)[2][0].startswith(f"the sample of slide at 0.5 s is 0.25 off those around it{often}: efforts")
        found = {"slide": Found(Jumps(2, np.empty(0), np.empty(0)), [(1, 0.5 + k, 0.25) for k in range(many)])}
        assert sentences_about_jumps((SLIDE,), found, {}, t)[2][0].startswith(
            f"the rate of slide jumps by 0.25 at 0.5 s{often.replace('samples', 'jumps')}, which"
        )
    for many, often in ((1, ""), (2, " (2 such jumps)")):
        found = {"slide": Found(Jumps(2, np.empty(0), np.empty(0)), [(0, 0.5 + k, 0.25) for k in range(many)])}
        assert sentences_about_jumps((SLIDE,), found, {}, t)[2][0].startswith(f"slide jumps by 0.25 at 0.5 s{often}, which no force can do")
