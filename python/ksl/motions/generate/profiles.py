"""Motions through waypoints: of least jerk, and with trapezoids of velocity; and the template of a motion's table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ksl.base.errors import MotionError
from ksl.base.extras import require
from ksl.model.model import Model
from ksl.mechanism.states import Array
from ksl.motions.closed_motion import leading
from ksl.motions.closing import home
from ksl.motions.generate.generated import (
    ROUND_OFF,
    SHARE,
    Generated,
    Limits,
    check_duration,
    effort_stretch,
    limits_of,
    sample_times,
    whole_motion,
    worst_effort,
    worst_rate,
)
from ksl.motions.generate.waypoints import Waypoints, between_limits
from ksl.motions.motion import Motion

Curve = Callable[[Array], tuple[Array, Array, Array]]
"""Positions, velocities and accelerations (n, m) at times (n)."""

FINE = 2001
"""Instants at which peaks are looked for, or more where there are many waypoints."""

SHORTEST_RAMP = 1e-4
"""The shortest ramp, as a share of the time between two waypoints where that is longest: more acceleration would make the motion shorter by less than that."""

SEARCHED = 24
"""Accelerations that are tried, from that with which no speed is reached to the given one."""

SHARE_OF_ACCELERATION = 1 / 3
"""The ramp's share of the time between two waypoints, where no acceleration is given: a third each for acceleration, steady speed and deceleration."""


def template(model: Model) -> Generated:
    """One row: the neutral position, brought into the limits where these exclude it.  The columns are those of a motion."""
    q, moved = home(model, [j.name for j in leading(model)]) if model.loops else model.neutral(), []
    lower, upper = model.position_ranges
    for joint in model.joints[: len(model.joint_names)]:
        k = joint.q_index
        if joint.nv == 1 and joint.has_limits and not lower[k] <= q[k] <= upper[k]:
            q[k] = np.clip(q[k], lower[k], upper[k])
            moved.append(joint.name)
    notes = [f"the limits of {', '.join(moved)} exclude zero: at the nearest limit"] if moved else []
    return Generated(Motion(np.zeros(1), q[None], np.zeros((1, model.nv)), np.zeros((1, model.nv))), notes, {"kind": "template"})


def minimum_jerk(
    model: Model, waypoints: Waypoints | None = None, duration: float | None = None, rate: float = 250.0, acceleration: float | None = None
) -> Generated:
    """Through waypoints without stopping, at rest at both ends, with the least integral of squared jerk.

    That is the quintic spline through the waypoints with zero velocity and acceleration at its ends (Flash, Hogan, The coordination of arm
    movements, J. Neuroscience 5, 1985, for one segment).
    duration: s; otherwise the shortest that uses 80 % of the limits of speed and effort, and keeps to `acceleration`, if that is given (rad/s², m/s²).
    waypoints: positions (k, m), with times or without: then durations are those of the joint that needs longest.
    Raises MotionError if the motion can't keep to the limits.
    """
    limits = limits_of(model, acceleration)
    points = between_limits(limits) if waypoints is None else waypoints
    times = _relative_times(limits, points)

    require("a quintic spline", "scipy")
    from scipy.interpolate import make_interp_spline

    ends = [(1, np.zeros(len(limits.joints))), (2, np.zeros(len(limits.joints)))]
    spline = make_interp_spline(times / times[-1], points.positions, k=5, bc_type=(ends, ends))

    def at(total: float) -> Curve:
        return lambda t: (spline(t / total), spline(t / total, nu=1) / total, spline(t / total, nu=2) / total**2)

    path = _Path("minjerk", limits, points, times, at, np.linspace(0, 1, max(FINE, 8 * len(times))))
    return _finished(model, path, duration, rate)


def trapezoid(
    model: Model, waypoints: Waypoints | None = None, duration: float | None = None, rate: float = 250.0, acceleration: float | None = None
) -> Generated:
    """From waypoint to waypoint, stopping at each: constant acceleration, steady speed, constant deceleration, all joints in step.

    Arguments and errors as :func:`minimum_jerk`.  With an acceleration, and neither duration nor times, each segment is as fast as speed and
    acceleration allow (Siciliano et al., Robotics: modelling, planning and control (2009), section 4.2.1).  Where efforts would be beyond their
    limits, less acceleration is used: that with which the motion is shortest.
    """
    limits = limits_of(model, acceleration)
    points = between_limits(limits) if waypoints is None else waypoints
    times = _relative_times(limits, points)
    ramps = np.full(len(times) - 1, SHARE_OF_ACCELERATION)
    if acceleration is not None and points.times is None:
        times, ramps = _fastest_within_efforts(model, limits, points)
    path = _Path("trapezoid", limits, points, times, _stretched(times, points, ramps), _instants(times, ramps))
    return _finished(model, path, duration, rate)


def _relative_times(limits: Limits, points: Waypoints) -> Array:
    """Times as given, or in proportion to how long the slowest joint needs at its limit of speed."""
    if points.times is not None:
        return points.times
    needed = (np.abs(np.diff(points.positions, axis=0)) / limits.velocity).max(axis=1)
    if not needed.any():
        raise MotionError("all waypoints are the same position; give at least two that differ")
    out: Array = np.concatenate([[0.0], np.cumsum(np.maximum(needed, 1e-3 * needed.max()))])
    return out


def _fastest_within_efforts(model: Model, limits: Limits, points: Waypoints) -> tuple[Array, Array]:
    """Times of waypoints, and shares of acceleration, of the trapezoids that are fastest within the limits of efforts, too.

    Efforts beyond their limits are mended by slowing down the whole motion, its steady speed as well.  So less acceleration may be faster.
    """
    speed, acceleration = _on_path(limits, points)

    def trapezoids(logarithm: float) -> tuple[Array, Array]:
        return _fastest(speed, acceleration * np.exp(logarithm))

    def lasts(logarithm: float) -> float:
        times, ramps = trapezoids(logarithm)
        return _shortest(model, _Path("trapezoid", limits, points, times, _stretched(times, points, ramps), _instants(times, ramps)), None)[0]

    times, ramps = trapezoids(0.0)
    if lasts(0.0) <= times[-1] * (1 + 1e-5):
        return times, ramps
    require("a search within limits of efforts", "scipy")
    from scipy.optimize import minimize_scalar

    tried = np.linspace(min(0.0, float(np.log((speed**2 / acceleration).min()))), 0.0, SEARCHED)
    best = int(np.argmin([lasts(x) for x in tried]))
    around = tried[max(0, best - 1)], tried[min(SEARCHED - 1, best + 1)]
    refined = float(minimize_scalar(lasts, bounds=around, method="bounded", options={"xatol": 1e-4}).x) if around[0] < around[1] else around[0]
    return trapezoids(min(refined, float(tried[best]), key=lasts))


def _on_path(limits: Limits, points: Waypoints) -> tuple[Array, Array]:
    """The largest speed, 1/s, and acceleration, 1/s², of each segment's path from 0 to 1."""
    distance = np.maximum(np.abs(np.diff(points.positions, axis=0)), 1e-12)
    speed = (SHARE * limits.velocity / distance).min(axis=1)
    acceleration = (np.minimum(limits.acceleration, 1e200) / distance).min(axis=1)
    longest = (speed**2 / (SHORTEST_RAMP * acceleration))[distance.max(axis=1) > 1e-9].max(initial=0.0)
    return speed, acceleration * min(1.0, longest)


def _fastest(speed: Array, acceleration: Array) -> tuple[Array, Array]:
    """Times of waypoints, and shares of acceleration, of the fastest trapezoids with these largest speeds and accelerations of each segment's path."""
    speed = np.minimum(speed, np.sqrt(acceleration))  # a triangle where the speed isn't reached
    duration = 1 / speed + speed / acceleration
    return np.concatenate([[0.0], np.cumsum(duration)]), speed / acceleration / duration


def _stretched(times: Array, points: Waypoints, ramps: Array) -> Callable[[float], Curve]:
    """Trapezoids through the waypoints that last as long as is asked for."""
    return lambda total: lambda t: _trapezoids(t, times * (total / times[-1]), points.positions, ramps)


def _instants(times: Array, ramps: Array) -> Array:
    """Instants from 0 to 1, in each acceleration, steady speed and deceleration as many: a short ramp has its peak, too."""
    T = np.diff(times)
    corners = np.sort(np.concatenate([times, times[:-1] + ramps * T, times[1:] - ramps * T])) / times[-1]
    within = np.linspace(1e-6, 1 - 1e-6, max(3, FINE // (len(corners) - 1)))
    out: Array = (corners[:-1, None] + np.diff(corners)[:, None] * within).ravel()
    return np.concatenate([[0.0], out, [1.0]])


def _trapezoids(t: Array, times: Array, positions: Array, ramps: Array) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations (n, m): between two waypoints all joints follow s(u), 0 to 1, with ramps of that share."""
    k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
    T, r = np.diff(times)[k], ramps[k]
    u = np.clip((t - times[k]) / T, 0.0, 1.0)
    peak = 1 / (1 - r)  # of ds/du
    first, last = u < r, u >= 1 - r
    s = np.where(first, peak * u**2 / (2 * r), np.where(last, 1 - peak * (1 - u) ** 2 / (2 * r), peak * (u - r / 2)))
    s1 = np.where(first, peak * u / r, np.where(last, peak * (1 - u) / r, peak)) / T
    s2 = np.where(first, peak / r, np.where(last, -peak / r, 0.0)) / T**2
    s2[-1] = 0.0 if t[-1] >= times[-1] else s2[-1]  # at rest at the end
    step = np.diff(positions, axis=0)[k]
    return positions[k] + s[:, None] * step, s1[:, None] * step, s2[:, None] * step


@dataclass(frozen=True)
class _Path:
    """A motion of the joints that lead, of any duration."""

    kind: str
    limits: Limits
    points: Waypoints
    times: Array
    """Times of the waypoints, up to a factor."""
    at: Callable[[float], Curve]
    """The motion that lasts so long, s."""
    instants: Array
    """From 0 to 1, at which peaks are looked for."""

    def where(self, share: float, duration: float | None) -> str:
        """An instant in words; share: from 0 to 1."""
        k = int(np.clip(np.searchsorted(self.times / self.times[-1], share, side="right"), 1, len(self.times) - 1))
        when = f"{100 * share:.4g} % of the time" if duration is None else f"{share * duration:.6g} s"
        return f"{self.kind}: between waypoints {k} and {k + 1}, at {when}"


def _finished(model: Model, path: _Path, duration: float | None, rate: float) -> Generated:
    """The motion of the given duration, or of the times of the waypoints, or else of the shortest within all limits."""
    limits, points = path.limits, path.points
    given = duration if duration is not None else None if points.times is None else float(points.times[-1])
    if given is not None:
        check_duration(given)
    _check_range(path, given)  # a longer time doesn't mend it
    shortest, notes = _shortest(model, path, given)
    total = shortest if given is None else given
    if given is not None and total < shortest * (1 - 1e-5):
        raise MotionError(f"{path.kind}: in {total:.6g} s {_too_fast(model, path, total)}; the shortest time within all limits is {shortest:.4g} s")
    t = sample_times(total, rate)
    motion = whole_motion(model, limits, t, *path.at(total)(t), lambda k: f"{path.kind}: sample {k + 1} (time {t[k]:.9g})")
    return Generated(motion, [*limits.said(points.are_given), *points.notes, *notes], {"kind": path.kind, "duration": total, "rate": rate})


def _check_range(path: _Path, duration: float | None) -> None:
    """Refuses positions beyond limits.  Joints without limits go where waypoints are, and otherwise stay within the range that is taken for them."""
    limits, q = path.limits, path.at(1.0)(path.instants)[0]
    for m, joint in enumerate(limits.joints):
        if joint.name in limits.unbounded and path.points.are_given:
            continue
        slack = 1e-6 * max(limits.half[m], 1e-300)
        for end, bound, k in (("lower", limits.lower[m], int(q[:, m].argmin())), ("upper", limits.upper[m], int(q[:, m].argmax()))):
            if (q[k, m] - bound) * (1 if end == "upper" else -1) > slack:
                where = path.where(float(path.instants[k]), duration)
                whose = (
                    f"its {end} limit {bound:.6g} {joint.unit}"
                    if joint.name not in limits.unbounded
                    else f"{bound:.6g} {joint.unit}, the {end} end of the range of joints without limits"
                )
                raise MotionError(f"{where}, {joint.name} goes to {q[k, m]:.6g} {joint.unit}, beyond {whose}; add waypoints, or move them away from the limits")


def _too_fast(model: Model, path: _Path, total: float) -> str:
    """What would be beyond its limit, and when."""
    use = worst_rate(path.limits, *path.at(total)(total * path.instants)[1:])
    if use.share <= 1 + ROUND_OFF:
        time = total * path.instants
        use = worst_effort(model, path.limits, whole_motion(model, path.limits, time, *path.at(total)(time)))
    return f"the {use.quantity} of {use.joint.name} would be {use.share:.3g} {use.of_limit}, at {total * path.instants[use.sample]:.4g} s"


def _shortest(model: Model, path: _Path, given: float | None) -> tuple[float, list[str]]:
    """The shortest duration within the limits, or within a share of those of speed and effort where none is given; and notes.

    Peaks of speed are as 1/T, of acceleration as 1/T².
    """
    limits, instants, use = path.limits, path.instants, SHARE if given is None else 1.0
    q, v, a = path.at(1.0)(instants)
    total = max(float((np.abs(v).max(axis=0) / (use * limits.velocity)).max()), float(np.sqrt((np.abs(a).max(axis=0) / limits.acceleration).max())))
    motion = whole_motion(model, limits, total * instants, q, v / total, a / total**2, lambda k: path.where(float(instants[k]), given))
    stretch, notes = effort_stretch(model, limits, motion, use)
    return total * stretch * (1 + 1e-6), notes
