"""How noisy the samples of a motion are, and what that does to accelerations and efforts.

Differences of high order leave nothing of a smooth motion and all of the noise.  They are scaled such that white noise gives the same
number in every order; what a coarse but smooth motion leaves becomes smaller from one order to the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ksl.mechanism.calls import Calls
from ksl.mechanism.states import Array
from ksl.motions.signal.corners import normalised_differences

ORDERS = (8, 10)
PLATEAU = 0.8
"""Differences of these orders, scaled, are as large as each other where there is noise, to this share.

Of a sine of frequency f they are sin²(π f h) as large: 0.8 is that of 2.8 samples in a period."""

MEDIAN = 0.6745
"""Half of normally distributed numbers are smaller than this share of their standard deviation."""

BLOCK, BLOCKS = 64, 200
"""Samples in a block, and how many blocks, at most, are looked at."""

FEWEST = 16
"""With fewer differences than this, noise can't be told from a coarse motion."""

ROUND_OFF = 20 * float(np.finfo(float).eps)
"""What is smaller than this share of the numbers is their rounding in memory."""

SHARE = 0.1
"""Noise matters if errors of an effort reach this share of its peak …"""

LARGEST = 3.0
"""… errors of so many standard deviations, which one in 370 samples has."""

STATES = 300
"""At how many samples of a motion efforts are compared with their errors."""


def first_derivative_noise() -> float:
    """Standard deviation of the first derivative of a quintic spline at its samples, for white noise of 1 and steps of 1."""
    return _spline_noise(1)


def second_derivative_noise() -> float:
    return _spline_noise(2)


def _spline_noise(order: int) -> float:
    """By the spectrum of the spline: its samples and derivatives are those of the quintic B-spline (de Boor, A practical guide to splines)."""
    w = np.linspace(0, np.pi, 2001)
    values = (66 + 52 * np.cos(w) + 2 * np.cos(2 * w)) / 120
    slopes = (20 * np.sin(w) + 2 * np.sin(2 * w)) / 24 if order == 1 else (-6 + 4 * np.cos(w) + 2 * np.cos(2 * w)) / 6
    return float(np.sqrt(np.mean((slopes / values) ** 2)))


def step_of(x: Array) -> float:
    """The step of which all numbers x (n) are multiples, but for a constant: of decimals, or counts of an encoder; 0 if there is none."""
    some = x[:: max(1, len(x) // 1000)]
    for digits in range(10):
        scaled = some * 10.0**digits
        if (np.abs(scaled - np.round(scaled)) <= 1e-12 + 8 * np.finfo(float).eps * np.abs(scaled)).all():
            return float(10.0**-digits)
    apart = np.diff(np.unique(some))
    apart = apart[apart > 1e-9 * np.abs(some).max(initial=0.0)]
    if not len(apart):
        return 0.0
    counts = (some - some[0]) / apart.min()
    return float(apart.min()) if (np.abs(counts - np.round(counts)) < 1e-3).all() else 0.0


def white_noise(time: Array, x: Array, steps: Array) -> Array:
    """Standard deviations (c) of white noise in the columns of x (n, c); 0 where there is none.

    steps (c): as :func:`step_of` finds them.  Of blocks in which something moves a quarter must be noisy.
    Medians within blocks, so that single corners and bad samples don't matter.  O(c), for at most 200 blocks of 64 samples.
    """
    highest = ORDERS[-1]
    n = len(time) - highest
    if n < FEWEST:
        return np.zeros(x.shape[1])
    block = min(BLOCK, n)
    starts = np.unique(np.linspace(0, n - block, min(BLOCKS, n // block)).astype(int))
    found = np.empty((2, len(starts), x.shape[1]))
    spread, round_off, moves = np.empty((len(starts), x.shape[1])), np.empty((len(starts), x.shape[1])), np.empty((len(starts), x.shape[1]), dtype=bool)
    for k, start in enumerate(starts):
        part = slice(start, start + block + highest)
        for i, order in enumerate(ORDERS):
            y = normalised_differences(time[part], x[part], order)
            found[i, k] = np.median(np.abs(y), axis=0) / MEDIAN
        spread[k] = np.sqrt(np.mean(y * y, axis=0))
        moves[k] = np.ptp(x[part], axis=0) > 0
        round_off[k] = ROUND_OFF * np.abs(x[part]).max(axis=0)
    lower, higher = found
    # where nothing moves, or nothing for most of a block, differences are rounding in memory: as large in every order, and no noise
    flat = np.where((higher > PLATEAU * lower) & (higher > round_off) & moves, higher, 0.0)
    noisy = flat > 0
    out = np.array([np.median(c[y]) if 0 < np.sum(m) <= 4 * np.sum(y) else 0.0 for c, y, m in zip(flat.T, noisy.T, moves.T, strict=True)])
    # a slow motion that was rounded stays where it is for many samples, and then jumps by a step: most differences are zero
    typical = np.array([_upper_quartile(c[m]) if m.any() else 0.0 for c, m in zip(spread.T, moves.T, strict=True)])
    rounded = np.minimum(typical, steps / np.sqrt(12))
    deviation: Array = np.maximum(out, np.where(rounded > 0.1 * steps, rounded, 0.0))
    return np.where(deviation > ROUND_OFF * np.abs(x).max(axis=0), deviation, 0.0)


def _upper_quartile(x: Array) -> float:
    return float(np.sort(x)[(3 * len(x)) // 4])


@dataclass(frozen=True)
class EffortErrors:
    """What noise of the accelerations does to efforts, (nv) each."""

    deviation: Array
    """Standard deviation at the worst sample, N m or N."""
    peak: Array
    """Largest effort, but at least a hundredth of the joint's limit, and a thousandth of the largest of all: less doesn't matter."""
    cause: Array
    """Index of the coordinate whose noise is most of it."""

    @property
    def share(self) -> Array:
        out: Array = np.divide(LARGEST * self.deviation, self.peak, out=np.zeros_like(self.peak), where=self.peak > 0)
        return out


def effort_by_acceleration(model: Calls, q: Array, v: Array, a: Array) -> Array:
    """(n, nv, nv): how much effort each acceleration needs: the mass matrix; of closed mechanisms along their freedoms, zero elsewhere."""
    if not (model.loops and isinstance(model, Calls)):
        return model.mass_matrix(q)
    by_a = model.inverse_dynamics_derivatives(q, v, a)[2]
    out = np.zeros((len(q), model.nv, model.nv))
    out[:, :, model.independent(q[0])] = by_a
    return out


def effort_errors(model: Calls, q: Array, v: Array, a: Array, deviation: Array) -> EffortErrors:
    """Errors of efforts from independent errors of accelerations with standard deviations (nv), through the mass matrix.

    At 300 samples of the motion q (n, nq), v, a (n, nv).
    """
    some = np.unique(np.linspace(0, len(q) - 1, min(len(q), STATES)).astype(int))
    parts = np.abs(effort_by_acceleration(model, q[some], v[some], a[some])) * deviation  # (k, nv, nv): effort i from acceleration j
    effort = np.sqrt(np.sum(parts**2, axis=2))
    worst = np.argmax(effort, axis=0)
    rows = np.arange(model.nv)
    peak = np.abs(model.inverse_dynamics(q[some], v[some], a[some])).max(axis=0)
    for joint in model.joints:
        if joint.nv == 1 and joint.effort:
            peak[joint.v_index] = max(peak[joint.v_index], 0.01 * joint.effort)
    peak = np.maximum(peak, np.maximum(1e-3 * peak.max(initial=0.0), effort[worst, rows]))
    return EffortErrors(effort[worst, rows], peak, np.argmax(parts[worst, rows], axis=1))
