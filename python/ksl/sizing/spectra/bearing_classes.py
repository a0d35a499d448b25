"""The loads of a joint's bearing in a few classes that keep its equivalent loads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ksl.base.errors import SizingError
from ksl.mechanism.states import Array
from ksl.sizing.fatigue import ROUND_OFF
from ksl.sizing.life import BALL, ROLLER, mean_load

COLUMNS = {"share": "", "Fx": "N", "Fy": "N", "Fz": "N", "My": "N m", "Mz": "N m", "speed_rpm": "r/min"}
"""Columns and units, in the order in which they are written."""
KEPT = 0.01
"""How far the equivalent loads of the classes may be from those of the samples, relative to these."""
BETWEEN = (BALL * ROLLER) ** 0.5
"""The exponent of the mean load of a class: between those of balls and rollers, so that both are met."""
STRETCH = (0.25, 64.0)
"""Exponents by which loads of classes may be stretched."""
MOST = 4096
"""Classes that are tried, at most, to say how many are needed."""
RPM = 30.0 / np.pi


class Equivalent(NamedTuple):
    """Mean loads over revolutions, one number each: N, N, N m."""

    radial: float
    axial: float
    tilting: float


@dataclass(frozen=True)
class BearingLoads:
    """Loads of a bearing at n samples: axial (n), radial (n, 2) and tilting (n, 2) in its axes, speed (n), rad/s, and weight (n), s."""

    axial: Array
    radial: Array
    tilting: Array
    speed: Array
    weight: Array

    @property
    def turned(self) -> Array:
        return np.asarray(np.abs(self.speed) * self.weight)

    @property
    def magnitudes(self) -> tuple[Array, Array, Array]:
        """Radial, axial and tilting, each (n)."""
        return np.hypot(*self.radial.T), np.abs(self.axial), np.hypot(*self.tilting.T)

    def equivalent(self, p: float) -> Equivalent:
        """(Σ |X|^p |n| Δt / Σ |n| Δt)^(1/p) of each; NaN where nothing turns."""
        return Equivalent(*(mean_load(x, self.speed, self.weight, p) for x in self.magnitudes))


def bearing_axes(axis: Array) -> Array:
    """Axes x, y, z of a joint's bearing, the rows of (3, 3): x along the joint's axis.

    Of an axis z, (x, y, z) are (z, x, y) of the joint's frame, and so on in cyclic order.  Of another axis, y is next to the coordinate
    axis that follows in this order on the one which the joint's axis is nearest to.
    """
    follows = np.eye(3)[(int(np.argmax(np.abs(axis))) + 1) % 3]
    y = follows - (follows @ axis) * axis
    y /= np.linalg.norm(y)
    return np.array([axis, y, np.cross(axis, y)])


def bearing_classes(loads: BearingLoads, classes: int) -> dict[str, Array]:
    """The columns `COLUMNS` of at most so many classes, the longest first.  Raises SizingError where they don't keep the equivalent loads.

    Samples that stand are one class.  The others are split where loads or speed differ most until there are enough.  The load of a class is the
    mean load of its samples, in their mean direction, and its speed their mean speed; what the means have lost of the peaks, `_stretched` gives back.  O(n · classes).
    """
    if not isinstance(classes, int) or classes < 1:
        raise SizingError(f"classes={classes!r}: expected a whole number, 1 or more")
    if not loads.weight.sum() > 0:
        raise SizingError("the bearing's classes are shares of time, and no case of the cycle lasts any time")
    found, needed = _reduced(loads, classes), classes
    error = _error(loads, found)
    if error <= KEPT:
        return found
    said = f"classes={classes}: they keep the equivalent loads to {error:.1%}, and {KEPT:.0%} is asked for"
    while needed < MOST:
        needed *= 2
        if _error(loads, _reduced(loads, needed)) <= KEPT:
            raise SizingError(f"{said}; {needed} classes do")
    raise SizingError(f"{said}; {needed} classes don't, give more")


def _reduced(loads: BearingLoads, classes: int) -> dict[str, Array]:
    turns = loads.turned > 0
    stands = (loads.weight > 0) & ~turns
    groups: list[np.ndarray] = [np.flatnonzero(stands)] if stands.any() and (classes > 1 or not turns.any()) else []
    if turns.any():
        groups += _split(loads, np.flatnonzero(turns), classes - len(groups))
    counted = np.flatnonzero(loads.weight > 0)
    rows = [_row(loads, group, counted if len(groups) == 1 else group) for group in groups]
    table = _stretched(loads, np.array(sorted(rows, key=lambda row: -row[0])))
    return dict(zip(COLUMNS, table.T.copy(), strict=True))


def _split(loads: BearingLoads, rows: np.ndarray, classes: int) -> list[np.ndarray]:
    """Samples in groups of like loads: again and again, that with the largest spread is split at the mean of what is spread most."""
    scale = [x or 1.0 for x in loads.equivalent(BETWEEN)]
    radial, axial, tilting = (x / of for x, of in zip(loads.magnitudes, scale, strict=True))
    features = np.column_stack([
        radial, axial, tilting,
        0.5 * loads.radial / scale[0], 0.5 * loads.axial / scale[1], 0.5 * loads.tilting / scale[2], 0.5 * loads.speed / np.abs(loads.speed).max(),
    ])  # fmt: skip
    ones = np.ones(len(radial))  # the mean of |x|^p of a class errs by p (p − 1)/2 |x|^(p − 2) times its spread: about |x| for p = 3
    weight = loads.turned[:, None] * np.column_stack([radial, axial, tilting, radial, radial, axial, tilting, tilting, ones])

    def spread(group: np.ndarray) -> tuple[float, int, float]:
        x, w = features[group], weight[group]
        mean = (w * x).sum(axis=0) / np.maximum(w.sum(axis=0), np.finfo(float).tiny)
        variance = (w * (x - mean) ** 2).sum(axis=0)
        k = int(np.argmax(variance))
        return float(variance[k]), k, float(mean[k])

    groups = [(spread(rows), rows)]
    floor = ROUND_OFF**2 * groups[0][0][0]
    while len(groups) < classes:
        worst = max(range(len(groups)), key=lambda i: groups[i][0][0])
        (size, k, mean), group = groups[worst]
        above = features[group, k] > mean
        if size <= floor or above.all() or not above.any():
            break
        groups[worst : worst + 1] = [(spread(part), part) for part in (group[above], group[~above])]
    return [group for _, group in groups]


def _row(loads: BearingLoads, group: np.ndarray, lasting: np.ndarray) -> list[float]:
    """A class: loads from the samples of the group; share of time and speed from the samples `lasting`."""
    w = loads.turned[group] if loads.turned[group].any() else loads.weight[group]

    def mean(x: Array) -> float:
        return float((w @ np.abs(x) ** BETWEEN / w.sum()) ** (1 / BETWEEN))

    along = np.sign(w @ loads.axial[group]) or 1.0
    t = loads.weight[lasting]
    way = np.sign(t @ loads.speed[lasting]) or 1.0
    speed = way * float(t @ np.abs(loads.speed[lasting])) / float(t.sum()) * RPM
    radial, tilting = (mean(np.hypot(*x[group].T)) * _direction(x[group], w) for x in (loads.radial, loads.tilting))
    return [float(t.sum() / loads.weight.sum()), along * mean(loads.axial[group]), *radial, *tilting, speed]


def _stretched(loads: BearingLoads, table: Array) -> Array:
    """The classes with their radial, axial and tilting loads x as a x^b, where a and b, near 1, make both equivalent loads those of the samples."""
    few = BearingLoads(table[:, 1], table[:, 2:4], table[:, 4:6], table[:, -1], table[:, 0])
    turned = few.turned
    if not turned.any():
        return table
    balls, rollers = loads.equivalent(BALL), loads.equivalent(ROLLER)
    for x, ball, roller, columns in zip(few.magnitudes, balls, rollers, (slice(2, 4), slice(1, 2), slice(4, 6)), strict=True):
        used = (turned > 0) & (x > 0)
        if not ball > 0:
            continue
        b = _exponent(x[used] / ball, turned[used], roller / ball)
        means = [mean_load((x[used] / ball) ** b, turned[used], np.ones(int(used.sum())), p) for p in (BALL, ROLLER)]
        a = ball / (means[0] * means[1] * ball / roller) ** 0.5  # of both: what is left of the ratio is shared
        table[used, columns] *= (a * (x[used] / ball) ** b / x[used])[:, None]
    return table


def _exponent(x: Array, turned: Array, ratio: float) -> float:
    """b that gives x^b the ratio of the mean loads of rollers and balls, which grows with b; 1 where none of `STRETCH` does."""

    def off(b: float) -> float:
        y = x**b
        return mean_load(y, turned, np.ones(len(y)), ROLLER) / mean_load(y, turned, np.ones(len(y)), BALL) - ratio

    low, high = STRETCH
    if not off(low) < 0 < off(high):
        return 1.0
    for _ in range(52):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if off(middle) < 0 else (low, middle)
    return 0.5 * (low + high)


def _direction(x: Array, w: Array) -> Array:
    """The unit vector of the mean of vectors (n, 2); of the largest one where they cancel."""
    mean = w @ x / w.sum()
    largest = x[int(np.argmax(np.hypot(*x.T)))]
    chosen = mean if np.hypot(*mean) > ROUND_OFF * np.hypot(*largest) else largest
    return np.asarray(chosen / np.hypot(*chosen)) if chosen.any() else np.array([1.0, 0.0])


def _error(loads: BearingLoads, classes: dict[str, Array]) -> float:
    """How far the equivalent loads of the classes are from those of the samples, relative to these: the largest."""
    if not loads.turned.any():
        return 0.0
    c = classes
    few = BearingLoads(c["Fx"], np.column_stack([c["Fy"], c["Fz"]]), np.column_stack([c["My"], c["Mz"]]), c["speed_rpm"], c["share"])
    pairs = [pair for p in (BALL, ROLLER) for pair in zip(loads.equivalent(p), few.equivalent(p), strict=True)]
    return max((abs(y - x) / x for x, y in pairs if x > 0), default=0.0)
