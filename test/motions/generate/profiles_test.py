"""Trapezoids and minimum jerk by hand: the shortest times, limits that are reached, and what generators take for one."""

import numpy as np
import pytest

from chains import limit, one_sided_joints, robot_of
from ksl.base.errors import MotionError
from ksl.motions.generate import Waypoints, minimum_jerk, trapezoid
from ksl.motions.generate.generated import check_duration, effort_stretch, limits_of, sample_times, worst_rate
from ksl.motions.generate.waypoints import read_waypoints
from ksl.motions.motion import Motion


def test_trapezoids_in_closed_form(robot):
    """With 2/3 rad/s and 2/3 rad/s² from 1 to 3 in 4 s, 1 s up, 2 s steady, 1 s down; then back by 1 in 2.5 s, of which 0.5 s are steady."""
    m = robot_of(robot, ("j", "revolute", limit(-9, 9, 2 / 3 / 0.8, 1e9)))
    made = trapezoid(m, Waypoints(np.array([[1.0], [3], [2]])), acceleration=2 / 3).motion
    begin, sign = np.array([0, 3, 4, 5.5]), 2 / 3 * np.array([1, -1, -1, 1])
    t = made.time[:, None] - begin
    assert made.q[:, 0] == pytest.approx(1 + np.where(t < 1, np.maximum(t, 0) ** 2 / 2, t - 0.5) @ sign, abs=1e-5)
    assert made.v[:, 0] == pytest.approx(np.clip(t, 0, 1) @ sign, abs=1e-5)
    away = (np.minimum(np.abs(t), np.abs(t - 1)) > 1e-5).all(axis=1)
    assert away.sum() > 1600 and made.a[away, 0] == pytest.approx(((t > 0) & (t < 1))[away] @ sign, abs=1e-5)


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
