"""Motions at equal steps: quintic splines through the samples of a file."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ksl.base.errors import MotionError
from ksl.base.words import count
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import Array
from ksl.motions.signal.quaternions import continuous_unit
from ksl.motions.signal.rates import SPLINE_SAMPLES, jumps_of
from ksl.motions.signal.splines import spline_through

MOST_SAMPLES = 20_000_000
Given = list[list[Array | None]]


def resampled(
    file: str, joints: Sequence[Joint], time: Array, q: Array, given: Given, rate: float, place: Callable[[int], str]
) -> tuple[Array, Array, Given, str]:
    """Times at equal steps from the first sample on, `rate` a second, positions and given rates there, and a note.

    Positions (n, nq) and rates are values of the quintic not-a-knot splines through the samples; quaternions are made continuous
    first and of unit length afterwards.  No low-pass filter comes before: fewer samples than the file has may alias.  Raises MotionError.
    """
    if not (np.isfinite(rate) and rate > 0):
        raise MotionError(f"{file}: --resample (resample=) is {rate:g}; expected samples a second, a positive number")
    if len(time) < SPLINE_SAMPLES:
        raise MotionError(f"{file}: {count(len(time), 'sample')}, but resampling needs at least {SPLINE_SAMPLES}")
    span = float(time[-1] - time[0])
    if span * rate > MOST_SAMPLES or span * rate < 1:
        raise MotionError(f"{file}: --resample (resample=) {rate:g} Hz makes {span * rate + 1:.3g} samples of {span:.4g} s; expected 2 to {MOST_SAMPLES:,}")
    at = time[0] + np.arange(int(round(span * rate, 6)) + 1) / rate  # the last sample is one, by rounding behind it or not
    at = np.minimum(at, time[-1])
    out = q.copy()
    for joint in joints:
        if joint.quaternion is not None:
            columns = slice(joint.q_index, joint.q_index + joint.nq)
            out[:, columns] = continuous_unit(place, joint, q[:, columns])
    out = on_spline(time, out, at, 2)
    for joint in joints:
        if joint.quaternion is not None:
            columns = slice(joint.q_index + joint.quaternion, joint.q_index + joint.quaternion + 4)
            out[:, columns] /= np.linalg.norm(out[:, columns], axis=1, keepdims=True)
    rates: Given = [[None if x is None else on_spline(time, x, at, 1 if k == 0 else None) for k, x in enumerate(g)] for g in given]
    step = float(np.median(np.diff(time)))
    note = f"resampled to {rate:g} Hz ({len(at):,} samples) from {len(time):,} samples with a median step of {step:.6g} s, on quintic splines"
    return at, out, rates, note


def on_spline(time: Array, x: Array, at: Array, order: int | None = None) -> Array:
    """Values at other times of the spline through x (n, …): quintic, or of a lower degree where there are fewer than six samples.

    order: the derivative of the columns of x (n, c) that may jump, 2 for positions and 1 for velocities: the spline is then split there.
    """
    if x.shape[-1] == 0:
        return np.empty((len(at), 0))
    if len(time) == 1:
        return np.repeat(x, len(at), axis=0)
    degree = max(k for k in (1, 3, 5) if k < len(time))
    jumps = [f.jumps for f in jumps_of(time, x, order)] if order is not None else []
    if not any(len(j.times) for j in jumps):
        plain: Array = spline_through(time, x, degree)(at)
        return plain
    smooth = x - np.column_stack([j(time) for j in jumps])
    values: Array = spline_through(time, smooth, degree)(at) + np.column_stack([j(at) for j in jumps])
    return values
