"""Jumps of the acceleration within a motion, as trapezoidal profiles of velocity have them, and splines that keep to them.

A spline has continuous accelerations.  Through samples of a motion whose acceleration jumps it overshoots by about 7 % of the
jump, however close the samples are.  So the jumps are found first: J (t − τ)²/2 after each time τ is taken from the samples,
the spline goes through the rest, which is smooth, and the same is added to its derivatives.  Position and velocity stay continuous.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from math import comb, factorial

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.states import Array

Indices = NDArray[np.intp]

BLOCK = 32
"""Differences in blocks of as many samples say how large they are where nothing jumps."""

QUARTILE = 0.3186
"""A quarter of normally distributed numbers are smaller than this share of their standard deviation."""

SIGNIFICANT = 10.0
"""A jump is larger than noise and curvature make it appear, by this many standard deviations …"""

RELEVANT = 0.02
"""… and than this share of the largest acceleration: less doesn't matter."""

LIKE_DOUBLE_ROOT = 0.03
"""The two sides meet where the acceleration jumps, to this share of J h²."""

STEEP = 0.1
"""How much of the jump the derivative may change by within one step beside it."""

SIDE = 4
"""Samples on each side that say what the motion does there: cubics."""


@cache
def noise_of_jumps(count: int) -> Array:
    """(count): standard deviations of the jumps of derivatives 0 … between polynomials through `count` samples on each side of the middle
    between two samples, for white noise of 1 and steps of 1."""
    weights = np.linalg.inv((0.5 + np.arange(count))[:, None] ** np.arange(count))
    out: Array = np.linalg.norm(weights, axis=1) * [factorial(r) for r in range(count)] * np.sqrt(2)
    return out


@dataclass(frozen=True)
class Jumps:
    """Jumps of one derivative of a curve: of the second for positions, of the first for velocities."""

    order: int
    times: Array
    """Increasing, (k).  They may be between samples."""
    sizes: Array

    def __call__(self, time: Array, nu: int = 0) -> Array:
        """The nu-th derivative of Σ J (t − τ)^order / order! over the jumps before t, at increasing times (n).

        At τ itself it is the value after the jump.  A polynomial between jumps; no sum over jumps at each sample.
        """
        powers = np.zeros((self.order + 1, len(self.times) + 1))  # derivatives 0 … order where each piece begins
        powers[self.order, 1:] = np.cumsum(self.sizes)
        gaps = np.diff(self.times, prepend=self.times[:1])
        for r in range(self.order - 1, -1, -1):  # each is the integral of the next one
            grows = sum(powers[r + k, :-1] * gaps**k / factorial(k) for k in range(1, self.order - r + 1))
            powers[r, 1:] = np.cumsum(grows)
        piece = np.searchsorted(self.times, time, side="right")
        since = time - self.times[np.maximum(piece - 1, 0)] if len(self.times) else np.zeros_like(time)  # before the first one all is zero
        out: Array = np.zeros_like(time)
        for k in range(self.order - nu, -1, -1):
            out = out * since / (k + 1) + powers[nu + k][piece]
        return out


@dataclass(frozen=True)
class Found:
    """What is not smooth in one curve."""

    jumps: Jumps
    """The jumps at which a spline is split."""
    impossible: list[tuple[int, float, float]] = field(default_factory=list)
    """(order, time, size) of jumps of lower derivatives, which no force can cause: 0 is the position itself, −1 a single sample that is off."""

    @classmethod
    def nothing(cls, order: int) -> Found:
        return cls(Jumps(order, np.empty(0), np.empty(0)))


def normalised_differences(time: Array, x: Array, order: int) -> Array:
    """Differences of x (n, c) of that order, (n − order, c), whose standard deviation is that of white noise in x.

    Divided differences where steps are uneven, with weights of unit length in both cases.
    """
    if evenly_spaced(time):
        even: Array = np.diff(x, order, axis=0)
        even *= 1 / np.sqrt(comb(2 * order, order))
        return even
    windows = np.lib.stride_tricks.sliding_window_view(time, order + 1)
    scaled = (windows - windows[:, :1]) / (windows[:, -1:] - windows[:, :1])
    weights = np.empty_like(scaled)
    for j in range(order + 1):
        weights[:, j] = 1 / np.prod(np.delete(scaled[:, j : j + 1] - scaled, j, axis=1), axis=1)
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    out: Array = np.einsum("nk,nck->nc", weights, np.lib.stride_tricks.sliding_window_view(x, order + 1, axis=0))
    return out


def evenly_spaced(time: Array, tolerance: float = 1e-3) -> bool:
    """Whether all steps are the mean one, but for that share of it."""
    steps = np.diff(time)
    mean = (time[-1] - time[0]) / len(steps)
    return bool(np.abs(steps - mean).max() <= tolerance * mean)


def one_sided(time: Array, x: Array, first: Indices, count: int, at: Array) -> Array:
    """Derivatives 0 … count − 1 at the times `at` (k) of the polynomials through samples first … first + count − 1 of x (n): (k, count)."""
    index = first[:, None] + np.arange(count)
    scale = time[index[:, -1]] - time[index[:, 0]]
    u = (time[index] - at[:, None]) / scale[:, None]
    coefficients = np.linalg.solve(u[:, :, None] ** np.arange(count), x[index][:, :, None])[:, :, 0]
    out: Array = coefficients * [factorial(r) for r in range(count)] / scale[:, None] ** np.arange(count)
    return out


def find_jumps(time: Array, x: Array, order: int = 2, resolution: Array | None = None) -> list[Found]:
    """Jumps of the derivative `order` (1 or 2) of each column of x (n, c).

    resolution (c): the step to which each column was rounded; what it can cause is no jump.  O(n c), about the cost of four differences.

    Candidates are fourth differences that stand out of those around them.  At each one, polynomials through the samples on its left and
    on its right are compared: their difference is J (t − τ)²/2 where the acceleration jumps, which has a double root between two samples.
    Smooth motions don't have it, however coarse: quadratics and cubics then differ by different amounts.
    """
    nothing = [Found.nothing(order) for _ in range(x.shape[1])]
    if len(time) < 2 * SIDE + 2:
        return nothing
    resolution = np.zeros(x.shape[1]) if resolution is None else resolution
    stand_out, background = _candidates(time, x, resolution)
    for c in np.flatnonzero(stand_out.any(axis=0)):
        gaps = np.flatnonzero(stand_out[:, c])
        ends = _off_at_the_ends(time, x[:, c], background[[0, -1], c]) if gaps[0] < SIDE or gaps[-1] >= len(time) - 1 - SIDE else []
        gaps = gaps[(gaps >= SIDE - 1) & (gaps < len(time) - SIDE)]
        if 0 < len(gaps) <= max(64, len(time) // 8):  # more is no motion with corners
            nothing[c] = _tested(time, x[:, c], order, gaps, background[gaps, c], resolution[c])
        if ends:
            others = [one for one in nothing[c].impossible if all(abs(one[1] - t) > 4 * np.median(np.diff(time)) for _, t, _ in ends)]
            nothing[c] = Found(nothing[c].jumps, sorted([*ends, *others], key=lambda f: f[1]))
    return nothing


def _candidates(time: Array, x: Array, resolution: Array) -> tuple[NDArray[np.bool_], Array]:
    """Gaps between samples (n − 1, c) around which fourth differences stand out, and the standard deviation of noise that is like the rest."""
    size = np.abs(normalised_differences(time, x, 4))
    block = min(BLOCK, max(8, len(size) // 2), len(size))
    blocks = max(1, len(size) // block)
    whole = size[: blocks * block].reshape(blocks, block, -1)
    quarter = block // 4
    level = np.partition(whole, quarter, axis=1)[:, quarter] / QUARTILE
    wide = np.maximum(level, np.maximum(np.vstack([level[:1], level[:-1]]), np.vstack([level[1:], level[-1:]])))  # with both neighbours
    # numbers may be multiples of a step without having been rounded: then few differences are as large as rounding makes them
    every = max(1, len(size) // 2000)
    moves = x[4::every] != x[: len(size) : every]
    many = np.sum((size[::every] > 0.1 * resolution) & moves, axis=0) > 0.25 * np.sum(moves, axis=0)
    rounded = np.where(many, resolution, 0.0)
    floor = np.maximum(4 * np.finfo(float).eps * np.abs(x).max(axis=0), rounded / np.sqrt(12))
    level.sort(axis=0)
    np.maximum(wide, np.maximum(floor, level[len(level) // 4]), out=wide)
    out = np.zeros((len(time) - 1, x.shape[1]), dtype=bool)
    where = np.minimum(np.arange(len(size)) // block, blocks - 1)
    at, column = np.nonzero(size > 3 * wide[where])
    for k in range(4):  # the difference m spans the gaps m … m + 3
        out[at + k, column] = True
    return out, wide[np.minimum(np.maximum(np.arange(len(time) - 1) - 2, 0) // block, blocks - 1)]


def _tested(time: Array, x: Array, order: int, gaps: Indices, noise: Array, resolution: float) -> Found:
    """The jumps among candidate gaps: between samples gaps and gaps + 1, (k)."""
    middle, h = (time[gaps] + time[gaps + 1]) / 2, time[gaps + 1] - time[gaps]
    right, left = (one_sided(time, x, first, SIDE, middle) for first in (gaps + 1, gaps + 1 - SIDE))  # cubics
    fine, rough = right - left, one_sided(time, x, gaps + 1, 3, middle) - one_sided(time, x, gaps - 2, 3, middle)
    largest = np.abs(np.diff(x, order) / np.diff(time[order - 1 :])).max() / (np.median(h) ** (order - 1))
    rough_noise, fine_noise = (noise * of[order] / h**order for of in (noise_of_jumps(3), noise_of_jumps(SIDE)))
    J = np.where(np.abs(fine[:, order] - rough[:, order]) < 3 * fine_noise, rough[:, order], fine[:, order])
    use = np.where((J == rough[:, order])[:, None], np.pad(rough, ((0, 0), (0, SIDE - 3))), fine)
    with np.errstate(all="ignore"):  # what isn't finite is no jump
        s = -use[:, order - 1] / use[:, order]
        for _ in range(2):  # Newton's steps to the root of the derivative order − 1 of the difference
            s = s - _polynomial(use[:, order - 1 :], s) / _polynomial(use[:, order:], s)
        off = np.abs(_polynomial(use, s)) / (np.abs(J) * h**2) if order == 2 else np.zeros_like(s)
        like_root = np.clip(12 * noise / (np.abs(J) * h**2), LIKE_DOUBLE_ROOT, 0.2)
    agree = np.abs(fine[:, order] - rough[:, order]) <= np.maximum(0.1 * np.abs(J), 3 * fine_noise)
    good = np.isfinite(s) & (np.abs(s) <= 0.55 * h) & agree & (np.abs(J) > SIGNIFICANT * rough_noise) & (np.abs(J) > RELEVANT * largest)
    good &= off < like_root
    # on both sides the derivative changes by less within a step: coarse samples of smooth motions are no jumps
    slope = np.maximum(np.abs(left[:, order + 1]), np.abs(right[:, order + 1])) * h
    good &= slope < np.minimum(np.maximum(STEEP * np.abs(J), 3 * noise_of_jumps(SIDE)[order + 1] / np.sqrt(2) * noise / h**order), 0.5 * np.abs(J))
    best = _best_of_neighbours(gaps, np.where(good, off + 1e-6 * np.abs(s) / h, np.inf))
    tau = _snapped(time, gaps[best], middle[best] + s[best], np.maximum(1e-3, 3 * rough_noise[best] / np.abs(J[best])))
    return Found(Jumps(order, tau, J[best]), _impossible(order, time, x, gaps, fine, rough, noise, resolution, best))


def _polynomial(derivatives: Array, s: Array) -> Array:
    """Σ d_k s^k / k! of each row (k, r)."""
    out = np.zeros_like(s)
    for k in range(derivatives.shape[1] - 1, -1, -1):
        out = out * s / (k + 1) + derivatives[:, k]
    return out


def _best_of_neighbours(gaps: Indices, cost: Array) -> Indices:
    """The candidate of least cost among those within three gaps of each other, which are the same jump; none of infinite cost."""
    chosen: list[int] = []
    for k in np.argsort(cost, kind="stable"):
        if not np.isfinite(cost[k]):
            break
        if all(abs(gaps[k] - gaps[other]) > 3 for other in chosen):
            chosen.append(int(k))
    return np.array(sorted(chosen), dtype=np.intp)


def _snapped(time: Array, gaps: Indices, tau: Array, tolerance: Array) -> Array:
    """Times that are at a sample but for that share of the step: there, rounding must not decide on which side the sample is."""
    left, right = time[gaps], time[gaps + 1]
    near = np.minimum(tolerance, 0.2) * (right - left)
    out: Array = np.where(np.abs(tau - left) < near, left, np.where(np.abs(tau - right) < near, right, tau))
    return out


def _impossible(
    order: int, time: Array, x: Array, gaps: Indices, fine: Array, rough: Array, noise: Array, resolution: float, taken: Indices
) -> list[tuple[int, float, float]]:
    """Single samples that are off, and jumps of lower derivatives, which would need an infinite force: (order, time, size).

    resolution: the step of which x may be multiples.
    """
    found = _off_samples(time, x, gaps, noise)
    apart = np.concatenate([gaps[taken], *([k - 1, k] for k, _ in found)]) if len(taken) or found else np.empty(0)
    free = np.array([(np.abs(g - apart) > 4).all() for g in gaps], dtype=bool)
    impossible = [(-1, float(time[k]), size) for k, size in found]
    middle, h = (time[gaps] + time[gaps + 1]) / 2, time[gaps + 1] - time[gaps]
    for r in range(order - 1, -1, -1):
        J = rough[:, r]
        with np.errstate(divide="ignore", invalid="ignore"):
            s = -rough[:, r - 1] / J if r else np.zeros_like(J)
        good = free & (np.abs(J) > 2 * SIGNIFICANT * noise * noise_of_jumps(3)[r] / h**r) & (np.abs(fine[:, r] - J) <= 0.1 * np.abs(J)) & (np.abs(s) <= 0.6 * h)
        if r == 0:  # slow motions that were rounded jump by one step
            good &= np.abs(J) > 3 * resolution
        good &= np.abs(J) > 5 * np.abs(rough[:, r + 1]) * h  # it is this derivative that jumps, and not the next one
        for k in _best_of_neighbours(gaps, np.where(good, np.abs(s) / h, np.inf)):
            impossible.append((r, float(middle[k] + s[k]), float(J[k])))
            free &= np.abs(gaps - gaps[k]) > 4
    return sorted(impossible, key=lambda f: f[1])


def _off_samples(time: Array, x: Array, gaps: Indices, noise: Array) -> list[tuple[int, float]]:
    """Samples that are off the cubic through their four neighbours, which are not, and by how much: fourth differences like 1 −4 6 −4 1."""
    samples = gaps[gaps >= 4]  # none is among the last four
    if not len(samples):
        return []
    around = samples[:, None] + np.arange(-4, 5)
    difference = np.diff(x[around], 4, axis=1) / np.array([1, -4, 6, -4, 1])  # all are the same where one sample is off
    size = difference[:, 2]
    good = np.abs(difference - size[:, None]).max(axis=1) < 0.5 * np.abs(size)
    good &= (np.abs(difference[:, 1:4] - size[:, None]).max(axis=1) < 0.1 * np.abs(size)) & (
        np.abs(size) > 2 * SIGNIFICANT * noise[np.searchsorted(gaps, samples)]
    )
    return [(int(samples[k]), float(size[k])) for k in np.flatnonzero(good)]


def _off_at_the_ends(time: Array, x: Array, noise: Array) -> list[tuple[int, float, float]]:
    """Samples among the first and the last four that are off those further inside, or all of which beyond one are: (order, time, size).

    They have no four neighbours on both sides, so that a motion that begins there may look alike.  Only what is further than any step, and than any change
    of steps, of the motion inside is named.  noise: its standard deviation at both ends.
    """
    inside = x[SIDE:-SIDE]
    if len(inside) < 3:
        return []
    bends, step = 3 * float(np.abs(np.diff(inside, 2)).max()), 1.5 * float(np.abs(np.diff(inside)).max())
    found: list[tuple[int, float, float]] = []
    for forward, t, y, deviation in ((1, time, x, noise[0]), (-1, -time[::-1], x[::-1], noise[1])):
        head, off = y[: 2 * SIDE].copy(), []
        for k in range(SIDE - 1, -1, -1):
            size = float(head[k] - one_sided(t, head, np.array([k + 1]), SIDE, t[k : k + 1])[0, 0])
            if abs(size) > max(bends, 2 * SIGNIFICANT * np.sqrt(comb(8, 4)) * deviation):
                head[k] -= size
                off.append((k, size))
        sizes = [abs(size) for _, size in off]
        if not off or max(sizes) <= step or (len(off) == off[0][0] + 1 > 1 and min(np.diff(sizes)) > 0.1 * sizes[0]):
            continue  # the last is a motion that begins with a jump of its speed
        if len(off) == off[0][0] + 1 > 1 and max(sizes) - min(sizes) < 0.1 * sizes[0]:
            found.append((0, forward * float(t[len(off) - 1] + t[len(off)]) / 2, -forward * off[0][1]))
        else:
            found += [(-1, forward * float(t[k]), size) for k, size in off]
    return found


def jumps_at(time: Array, x: Array, times: Array) -> list[Jumps]:
    """Jumps of the first and second derivatives of x (n) at known times, from quartics on both sides.

    A jump that has less than three samples between it and the next one is left out.
    """
    after = np.searchsorted(time, times, side="left")  # the first sample at or after the jump
    exact = (after < len(time)) & (time[np.minimum(after, len(time) - 1)] == times)
    before_end = np.where(exact, after + 1, after)  # samples of the left side end before this one: one at τ belongs to both
    starts, ends = np.concatenate([[0], after[:-1]]), np.concatenate([before_end[1:], [len(time)]])
    first, second = np.zeros(len(times)), np.zeros(len(times))
    room = np.minimum(np.minimum(before_end - starts, ends - after), 5)
    for m in (3, 4, 5):
        k = np.flatnonzero(room == m)
        if len(k):
            step = one_sided(time, x, after[k], m, times[k]) - one_sided(time, x, before_end[k] - m, m, times[k])
            first[k], second[k] = step[:, 1], step[:, 2]
    return [Jumps(1, times, first), Jumps(2, times, second)]
