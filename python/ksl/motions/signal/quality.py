"""What is doubtful about the samples of a motion: noise that efforts show, and jumps that no force can cause."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.calls import Calls
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.joint_kinds import columns_of, units_of
from ksl.mechanism.states import Array
from ksl.motions.signal.corners import Found, Jumps
from ksl.motions.signal.noise import (
    SHARE,
    EffortErrors,
    effort_by_acceleration,
    effort_errors,
    first_derivative_noise,
    second_derivative_noise,
    step_of,
    white_noise,
)
from ksl.motions.signal.smoothing import noise_after, suitable_cutoff


@dataclass(frozen=True)
class Samples:
    """A motion as it was given, before it was resampled or smoothed: time (n), q (n, nq), and [v, a] of each moving joint, (n, nv) or None."""

    time: Array
    q: Array
    given: list[list[Array | None]]


@dataclass(frozen=True)
class Noise:
    """The noise of what accelerations are differentiated from, for each velocity coordinate (nv)."""

    deviation: Array
    """Standard deviation, rad or m; of velocities, rad/s or m/s, where those are given.  0 where accelerations are given."""
    step: Array
    """To which step the numbers were rounded; 0 where they are not."""
    order: Array
    """How often they are differentiated: 2, or 1 where velocities are given."""
    curves: Array
    """What is differentiated (n, nv); of quaternions, twice the vector part."""


def noise_of(joints: tuple[Joint, ...], measured: Samples, found: Mapping[str, Found]) -> Noise:
    """Noise of positions, or of velocities where those are given and accelerations are not.

    found: by column, the jumps that are not noise.
    """
    nv = sum(j.nv for j in joints)
    curves, order = np.zeros((len(measured.time), nv)), np.full(nv, 2)
    used = np.zeros(nv, dtype=bool)
    for joint, (given_v, given_a) in zip(joints, measured.given, strict=True):
        cols = slice(joint.v_index, joint.v_index + joint.nv)
        used[cols] = given_a is None
        if given_v is not None:
            curves[:, cols], order[cols] = given_v, 1
        else:
            q = measured.q[:, joint.q_index : joint.q_index + joint.nq]
            curves[:, cols] = q if joint.quaternion is None else np.hstack([q[:, : joint.quaternion], 2 * q[:, -4:-1]])
        for k, column in enumerate(columns_of(joint)[0 if given_v is None else 1][: joint.nv]):
            if column in found:
                curves[:, joint.v_index + k] -= _all_jumps(found[column], measured.time)
    steps = np.array([step_of(curves[:, c]) if used[c] else 0.0 for c in range(nv)])
    deviation = np.zeros(nv)
    deviation[used] = white_noise(measured.time, curves[:, used], steps[used])
    return Noise(deviation, steps, order, curves)


def _all_jumps(found: Found, time: Array) -> Array:
    """What jumps contribute to a curve, possible or not."""
    total = found.jumps(time)
    for order in (0, 1):
        these = [(t, size) for r, t, size in found.impossible if r == order]
        if these:
            times, sizes = np.array(these).T
            total = total + Jumps(order, times, sizes)(time)
    return total


def doubts_about_noise(
    model: Calls,
    joints: tuple[Joint, ...],
    measured: Samples,
    found: Mapping[str, Found],
    motion: tuple[Array, Array, Array],
    smooth: float | None,
    held: NDArray[np.bool_],
) -> list[str]:
    """One sentence if noise of the samples may change an effort by a tenth of its peak; otherwise none.

    motion: q (n, nq), v, a (n, nv), smoothed at `smooth` Hz unless that is None.  held (nv): coordinates that stand throughout, without accelerations.
    """
    q, v, a = motion
    if model.nv == 0 or max(np.abs(x).max(initial=0.0) for x in (q, v, a)) > 1e100:
        return []
    noise = noise_of(joints, measured, found)
    if not noise.deviation.any():
        return []
    h = float(np.median(np.diff(measured.time)))
    if smooth is None:
        factor = {1: first_derivative_noise() / h, 2: second_derivative_noise() / h**2}
    else:
        factor = {d: noise_after(smooth, h, d) for d in (1, 2)}
    of_acceleration = noise.deviation * np.where(noise.order == 1, factor[1], factor[2]) * ~held
    errors = effort_errors(model, q, v, a, of_acceleration)
    if not (errors.share > SHARE).any():
        return []
    some = slice(None, None, max(1, len(q) // 50))
    weight = np.sqrt(np.mean(np.sum(effort_by_acceleration(model, q[some], v[some], a[some]) ** 2, axis=1), axis=0))
    positions = np.flatnonzero((noise.order == 2) & (noise.deviation > 0))
    proposed = suitable_cutoff(measured.time, noise.curves[:, positions], noise.deviation[positions], weight[positions]) if len(positions) else None
    return [_sentence(joints, noise, of_acceleration, errors, smooth, proposed)]


def _sentence(joints: tuple[Joint, ...], noise: Noise, of_acceleration: Array, errors: EffortErrors, smooth: float | None, proposed: float | None) -> str:
    worst = int(np.argmax(errors.share))
    cause = int(errors.cause[worst])
    joint, moved = _joint_of(joints, cause), _joint_of(joints, worst)
    unit, effort = _unit(joint, cause), "N m" if _unit(moved, worst) == "rad" else "N"
    what, per = ("positions", unit) if noise.order[cause] == 2 else ("velocities", f"{unit}/s")
    if noise.step[cause] > 0 and noise.deviation[cause] < noise.step[cause]:
        source = f"{what} of {joint.name} are rounded to {noise.step[cause]:.3g} {per}"
    else:
        source = f"{what} of {joint.name} have noise of {noise.deviation[cause]:.2g} {per} (standard deviation)"
    after = "" if smooth is None else f", also after smoothing at {smooth:g} Hz"
    share = f"may be {100 * errors.share[worst]:.0f} % noise" if errors.share[worst] < 1 else "are noise"
    result = (
        f"{source}: differentiated{after}, that makes errors of ±{of_acceleration[cause]:.3g} {unit}/s² in accelerations, and of "
        f"±{errors.deviation[worst]:.3g} {effort} in efforts of {moved.name}, whose peak is {errors.peak[worst]:.3g} {effort}; peaks {share}"
    )
    if proposed is None:
        return f"{result}. Give accelerations, or smooth with --smooth HZ"
    return f"{result}. Smooth the positions{'' if smooth is None else ' more'}: --smooth {proposed:g}"


def _joint_of(joints: tuple[Joint, ...], coordinate: int) -> Joint:
    return next(j for j in joints if j.v_index <= coordinate < j.v_index + j.nv)


def _unit(joint: Joint, coordinate: int) -> str:
    return units_of(joint)[1][coordinate - joint.v_index]


def sentences_about_jumps(joints: tuple[Joint, ...], found: Mapping[str, Found], given: Mapping[str, Found], time: Array) -> tuple[list[str], Array, list[str]]:
    """A note on where splines are split; the times of all jumps, increasing; and doubts about jumps that can't be.

    found, given: by column, of what was differentiated, and of velocities whose accelerations are given.
    """
    both = {**found, **given}
    jumping = {column: f.jumps.times for column, f in both.items() if len(f.jumps.times)}
    notes, times = [], np.empty(0)
    if jumping:
        all_times = np.unique(np.concatenate(list(jumping.values())))
        step = float(np.median(np.diff(time)))
        # joints that start together may be found a rounding error apart: these are one corner of the energy
        times = all_times[np.concatenate([[True], np.diff(all_times) > 0.2 * step])]
    split = {column: t for column, t in jumping.items() if column in found}
    if split:
        first = min(split, key=lambda c: split[c][0])
        of = first if len(split) == 1 else f"{first} and {len(split) - 1} more"
        often = "once" if len(times) == 1 else f"{len(times)} times, first"
        notes = [f"accelerations of {of} jump {often} at {split[first][0]:.6g} s: splines are split there, so that they don't overshoot"]
    angles = {c for j in joints for group, units in zip(columns_of(j), units_of(j)) for c, unit in zip(group, units) if unit == "rad"}
    doubts = [_about_impossible(column, column in angles, f.impossible) for column, f in both.items() if f.impossible]
    return notes, times, doubts


def _about_impossible(column: str, is_angle: bool, jumps: list[tuple[int, float, float]]) -> str:
    order, time, size = min(jumps, key=lambda j: abs(j[0]))
    often = f" ({len(jumps)} such jumps)" if len(jumps) > 1 else ""
    if order == -1:
        many = f" ({len(jumps)} such samples)" if len(jumps) > 1 else ""
        return f"the sample of {column} at {time:.6g} s is {size:.4g} off those around it{many}: efforts there are those of a bad sample. Remove or mend it"
    if order == 0 and is_angle and abs(abs(size) - 2 * np.pi) < 0.01 * 2 * np.pi:
        return f"{column} jumps by {size:.4g} at {time:.6g} s{often}: a full turn. Unwrap the angle: give it without jumps"
    if order == 0:
        return f"{column} jumps by {size:.4g} at {time:.6g} s{often}, which no force can do: efforts there depend on the step alone. Check the samples"
    return (
        f"the rate of {column} jumps by {size:.4g} at {time:.6g} s{often}, which no force can do: an impact can, and a brake that holds within one sample. "
        "Efforts there depend on the step alone. Give the profile ramps of velocity, or finer samples"
    )
