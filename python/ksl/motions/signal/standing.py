"""Where joints stand: what can be told of a rate, and below what it is none.

A position is known up to its resolution δ: the rounding in memory, the step to which it was rounded, or what its noise spans.  A rate that
comes from positions is known up to δ / h, h being the step between samples.  Below that its sign is that of the noise.  Whatever depends on
the sign, the share or the count of a motion then takes the joint to stand: friction, efficiencies of gears, powers, revolutions.

Noise alone can't be told from a slow motion by single samples.  So a joint whose positions are noisy or rounded stands only if, besides, its
position keeps within δ for eight samples, and doesn't drift by more than that in the end: rates down to δ / (7 h) are seen, and slower ones
if they last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ksl.base.rounding import OF_POSITIONS
from ksl.mechanism.joint_kinds import KINDS
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.joint_kinds import units_of
from ksl.mechanism.states import Array
from ksl.motions.signal.noise import step_of, white_noise
from ksl.motions.signal.quality import Samples

DEVIATIONS = 8.0
"""Noise spans so many of its standard deviations: a million samples of normal noise span ten, eight of them seldom five."""

INTEGRATED = 1e-9
"""A share of a radian, or of the robot's extent, and of the position: what programs that integrate are off, KSL's simulation as it is set.  Nothing that moves a
machine is as small."""

WINDOW = 8
"""Samples for which a position must keep within its resolution."""

NOTED = 1e-3
"""Rates that can't be told from zero are worth a line from this share of the largest rate on."""

COARSEST = {"rad": 0.02, "m": 0.002}
"""Coarser positions are no measurement of a joint that stands: steps and noise beyond this are motion."""


@dataclass(frozen=True)
class Standing:
    """Which samples are at a stand, and what can be told of rates."""

    stands: NDArray[np.bool_]
    """(n, nv)."""
    held: NDArray[np.bool_]
    """(n, nv): samples among these in stands of noise or rounding, whose differentiated accelerations are none, either.  At single samples
    a joint may begin to move."""
    rate: Array
    """(nv): rates up to this are not told from zero, rad/s or m/s."""
    noisy: dict[str, float]
    """{joint: δ, rad or m}: joints that stand somewhere although their numbers are not still, which is worth a line."""


def standing_of(joints: Sequence[Joint], measured: Samples, time: Array, q: Array, v: Array, smooth: float | None = None, reach: float = 0.0) -> Standing:
    """Stands in a motion q (n, nq), v (n, nv) at `time`; measured: as it was before it was resampled or smoothed, which decides.
    smooth: at how many Hz it was.  reach: the robot's extent, m, by which positions of slides are judged.

    O(n nv), besides an estimate of noise for joints that turn back and forth within small ranges.
    """
    found = _rounded(joints, time, q, v)
    for joint, (given_v, given_a) in zip(joints, measured.given, strict=True):
        if KINDS[joint.kind].velocity_is_rate:
            for k in range(joint.nv):
                _add_noisy(found, joint, k, measured, given_v, (time, q, v), 0.0 if smooth is None else 1 / smooth)
                _add_integrated(found, joint, k, measured, given_v, time, reach)
            if given_a is not None:
                found.held[:, joint.v_index : joint.v_index + joint.nv] = False
    return found


def standing_of_integrated(joints: Sequence[Joint], time: Array, q: Array, v: Array, absolute: float, relative: float) -> Standing:
    """Stands in a motion that was integrated with an error of absolute + relative |q| in each step: a position that keeps within that is one.

    The error of stiff gains is larger in rates than in positions, and of either sign.
    """
    found = _rounded(joints, time, q, v)
    for joint in joints:
        for k in range(joint.nv if KINDS[joint.kind].velocity_is_rate else 0):
            x, column = q[:, joint.q_index + k], joint.v_index + k
            resolution = absolute + relative * float(np.abs(x).max())
            here = _kept(time, time, x, resolution)
            found.stands[:, column] |= here
            found.held[:, column] = _inside(time, here, 0.0)
            found.rate[column] = max(found.rate[column], resolution / float(np.median(np.diff(time))))
    return found


def _rounded(joints: Sequence[Joint], time: Array, q: Array, v: Array) -> Standing:
    """Stands by the rounding of positions in memory alone."""
    steps = np.diff(time)
    beside = np.minimum(np.append(steps[:1], steps), np.append(steps, steps[-1:]))  # the shorter of the steps before and after a sample
    rounded = np.zeros(v.shape[1])
    for j in joints:
        rounded[j.v_index : j.v_index + j.nv] = OF_POSITIONS * np.abs(q[:, j.q_index : j.q_index + j.nq]).max(initial=0.0)
    return Standing(np.abs(v) <= rounded / beside[:, None], np.zeros(v.shape, dtype=bool), rounded / np.median(steps), {})


def with_means(q: Array, held: NDArray[np.bool_], joints: Sequence[Joint]) -> Array:
    """Positions q (n, nq) with the mean of each stand in place of its samples; held (n, nv)."""
    out = q.copy()
    for joint in joints:
        for k in range(joint.nv):
            first, last = _runs(held[:, joint.v_index + k])
            if len(first):
                x = out[:, joint.q_index + k]
                sums = np.concatenate([[0.0], np.cumsum(x - x[0])])
                means = x[0] + (sums[last] - sums[first]) / (last - first)
                x[held[:, joint.v_index + k]] = np.repeat(means, last - first)
    return out


def _runs(chosen: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Where runs of chosen samples begin and end: the first of each, and the one behind its last."""
    edges = np.diff(np.concatenate([[0], chosen.astype(int), [0]]))
    return np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)


def _add_noisy(found: Standing, joint: Joint, k: int, measured: Samples, given_v: Array | None, motion: tuple[Array, Array, Array], blur: float) -> None:
    """Adds where the coordinate k of a joint stands although its numbers are not still.  blur: s, over which a filter spread what moves."""
    column, (time, q, v) = joint.v_index + k, motion
    x, coarsest = q[:, joint.q_index + k], COARSEST[units_of(joint)[0][k]]
    moving = np.where(found.stands[:, column], 0.0, v[:, column])
    turns = np.flatnonzero(moving[1:] * moving[:-1] < 0)
    if not (np.abs(np.diff(x[turns])) <= coarsest).any():  # a smooth motion goes further before it turns back
        return
    given = measured.q[:, joint.q_index + k]
    resolution = _resolution(measured.time, given)
    resolution = max(resolution if resolution <= coarsest else 0.0, OF_POSITIONS * float(np.abs(given).max()))
    slowest = resolution / float(np.median(np.diff(measured.time))) if given_v is None else _resolution(measured.time, given_v[:, k])
    # a spline through such positions has rates of their noise, and at its ends larger ones: only those that are given must be slow
    here = _kept(time, measured.time, given, resolution, None if given_v is None else np.abs(given_v[:, k]) <= slowest)
    inside = _inside(time, here, blur)
    here = inside if blur else here  # what a filter has spread into the ends of a stand moves
    if (here & ~found.stands[:, column]).any():
        found.stands[:, column] |= here
        found.held[:, column] = inside
        found.rate[column] = max(found.rate[column], slowest)
        if found.rate[column] > NOTED * np.abs(v[:, column]).max():
            found.noisy[joint.name] = resolution


def _add_integrated(found: Standing, joint: Joint, k: int, measured: Samples, given_v: Array | None, time: Array, reach: float) -> None:
    """Adds where the coordinate k of a joint keeps within what a program that integrates may be off: its rates are then that, too."""
    x, column = measured.q[:, joint.q_index + k], joint.v_index + k
    resolution = INTEGRATED * ((1.0 if units_of(joint)[0][k] == "rad" else reach) + float(np.abs(x).max()))
    if given_v is None and np.ptp(x) > resolution < step_of(x):  # positions that were rounded are the same where the joint moves slowly
        return
    slowest = resolution / float(np.median(np.diff(measured.time)))
    here = _kept(time, measured.time, x, resolution, None if given_v is None else np.abs(given_v[:, k]) <= slowest)
    if (here & ~found.stands[:, column]).any():
        found.stands[:, column] |= here
        found.held[:, column] |= _inside(time, here, 0.0)
        found.rate[column] = max(found.rate[column], slowest)


def _kept(time: Array, of: Array, x: Array, width: float, slow: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
    """(n): whether a position, x at the times `of`, keeps within a width around each time, and doesn't drift.  slow: where its rates allow that."""
    here = _keeps_within(x, width, min(WINDOW, len(x)))
    if slow is not None:
        here &= slow
    return _at(time, of, here & ~_drifts(x, here, 2 * width))


def _resolution(time: Array, x: Array) -> float:
    """What samples x (n) can't tell: the step to which they are rounded, or what their noise spans."""
    step = step_of(x)
    deviation = float(white_noise(time, x[:, None], np.array([step]))[0])
    return max(1.001 * step, DEVIATIONS * deviation)


def _inside(time: Array, chosen: NDArray[np.bool_], blur: float) -> NDArray[np.bool_]:
    """The chosen samples but for those near the ends of their runs, where a joint comes to a stand and begins to move."""
    n, (first, last) = len(time), _runs(chosen)
    begin = np.where(first > 0, np.searchsorted(time, time[np.minimum(first + WINDOW, n - 1)] + blur), 0)
    end = np.where(last < n, np.searchsorted(time, time[np.maximum(last - WINDOW, 0)] - blur), n)
    return _in_runs(begin, np.maximum(begin, end), n)


def _in_runs(first: NDArray[np.intp], last: NDArray[np.intp], n: int) -> NDArray[np.bool_]:
    """(n): whether the sample is in one of the runs, which don't overlap."""
    edges = np.zeros(n + 1, dtype=int)
    np.add.at(edges, first, 1)
    np.add.at(edges, last, -1)
    return np.cumsum(edges[:-1]) > 0


def _at(time: Array, of: Array, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether the samples of a time series on both sides of each time are chosen."""
    last = len(of) - 1
    before = np.clip(np.searchsorted(of, time, side="right") - 1, 0, last)
    after = np.clip(np.searchsorted(of, time), 0, last)
    return chosen[before] & chosen[after]


def _keeps_within(x: Array, width: float, window: int) -> NDArray[np.bool_]:
    """(n): whether the sample is one of `window` neighbours that differ by no more than the width."""
    views = np.lib.stride_tricks.sliding_window_view(x, window)
    within = (views.max(axis=1) - views.min(axis=1) <= width).astype(int)
    return np.convolve(within, np.ones(window, dtype=int)) > 0


def _drifts(x: Array, chosen: NDArray[np.bool_], width: float) -> NDArray[np.bool_]:
    """(n): whether the sample is of a run of chosen ones in whose middle half x moves by more than the width.

    At its ends a joint may still come to a stand, or begin to move.
    """
    first, last = _runs(chosen)
    if not len(first):
        return np.zeros_like(chosen)
    quarter = (last - first) // 4
    middle = np.column_stack([first + quarter, last - quarter]).ravel()
    padded = np.append(x, x[0])  # behind the end of a run that ends with the samples
    spans = (np.maximum.reduceat(padded, middle) - np.minimum.reduceat(padded, middle))[::2]
    far = spans > width
    return _in_runs(first[far], last[far], len(x))
