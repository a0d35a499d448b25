"""Life of rolling bearings: the mean load over a cycle, the rating life L10, and the factor for other reliabilities."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ksl.mechanism.states import Array
from ksl.sizing.figures import Formula

BALL, ROLLER = 3.0, 10.0 / 3.0
"""Exponents of the life equation for ball bearings and for roller bearings, ISO 281:2007, 5.3 and 6.3."""

MEAN_LOAD = Formula("Pm = (Σ P^p |n| Δt / Σ |n| Δt)^(1/p)", "ISO 281:2007 with the catalogues' mean load; the weight is revolutions, standstill weighs nothing")
RATING_LIFE = Formula("L10 = a1 (C/Pm)^p million revolutions", "ISO 281:2007, 5.3 (ball, p = 3) and 6.3 (roller, p = 10/3)")
LIFE_HOURS = Formula("L10h = L10 · 10⁶ / (60 n_m), n_m the mean of |n| with pauses", "ISO 281:2007, 5.3 and 6.3")

SLOW = "indication only: ISO 281 does not cover slow oscillation; the joint turns less than one revolution each way"
"""Said beside lives of joints that never turn a whole revolution."""

RELIABILITY = {
    2007: {90.0: 1.0, 95.0: 0.64, 96.0: 0.55, 97.0: 0.47, 98.0: 0.37, 99.0: 0.25},
    1990: {90.0: 1.0, 95.0: 0.62, 96.0: 0.53, 97.0: 0.44, 98.0: 0.33, 99.0: 0.21},
}
"""Factors a1 by edition of ISO 281 and reliability in per cent; 2007: Table 12."""


def reliability_factor(reliability: float, edition: int = 2007) -> float:
    """Life adjustment factor a1 for a reliability in per cent.

    edition: of ISO 281, 2007 or 1990, whose values differ.  Raises ValueError for other editions, and for
    reliabilities that the table doesn't have.  Source: ISO 281:2007, Table 12; ISO 281:1990.
    """
    if edition not in RELIABILITY:
        raise ValueError(f"ISO 281:{edition} is unknown; expected one of the editions {', '.join(map(str, RELIABILITY))}")
    table = RELIABILITY[edition]
    if reliability not in table:
        raise ValueError(f"ISO 281:{edition} has no a1 for a reliability of {reliability:g} %; it has {', '.join(f'{r:g}' for r in table)} %")
    return table[reliability]


def mean_load(load: ArrayLike, speed: ArrayLike, duration: ArrayLike, exponent: float = BALL) -> float:
    """Mean of a load over a cycle, weighted with revolutions: (Σ |P|^p |n| t / Σ |n| t)^(1/p).

    load (n), N or N m; speed (n), in any unit, of any sign; duration (n), s, that each of them lasts; exponent p: 3 for balls
    and for cubic means of torques, 10/3 for rollers.  NaN where nothing turns.  O(n).  Source: ISO 281:2007, catalogues.
    """
    p, weight = (np.abs(np.asarray(load, dtype=float)), np.abs(np.asarray(speed, dtype=float)) * np.asarray(duration, dtype=float))
    turned = float(weight.sum())
    if turned <= 0:
        return float("nan")
    largest = float(p[weight > 0].max())
    if largest == 0:
        return 0.0
    mean = float(np.sum((p / largest) ** exponent * weight)) / turned  # of loads relative to the largest: no overflow
    return float(largest * mean ** (1.0 / exponent))


def mean_speed(speed: ArrayLike, duration: ArrayLike) -> float:
    """Mean of |n| over a cycle, pauses included, in the unit of speed (n); duration (n), s."""
    t = np.asarray(duration, dtype=float)
    total = float(t.sum())
    return float(np.sum(np.abs(np.asarray(speed, dtype=float)) * t)) / total if total > 0 else 0.0


def rating_life(C: float, load: ArrayLike, exponent: float = BALL, a1: float = 1.0) -> Array:
    """Rating life in million revolutions: a1 (C/P)^p; infinite without load.

    C: basic dynamic load rating, N; load: equivalent load P, N, of any shape.  Source: ISO 281:2007, 5.3 and 6.3.
    """
    with np.errstate(divide="ignore"):
        return a1 * (C / np.asarray(load, dtype=float)) ** exponent


def hours(million_revolutions: ArrayLike, rpm: ArrayLike) -> Array:
    """Hours that a life in million revolutions takes at a speed in r/min; infinite at rest."""
    with np.errstate(divide="ignore"):
        return np.asarray(million_revolutions, dtype=float) * 1e6 / (60.0 * np.asarray(rpm, dtype=float))
