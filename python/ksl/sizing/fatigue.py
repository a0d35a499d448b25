"""Fatigue of any component of the wrench: rainflow count, mean-stress correction, Miner's sum over an S–N line."""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from ksl.mechanism.states import Array
from ksl.sizing.figures import Formula

Residue = Literal["half cycles", "repeating"]
MeanStress = Literal["none", "goodman", "goodman in tension"]
BelowKnee = Literal["elementary", "haibach", "original"]

RESIDUES, MEAN_STRESSES, BELOW_KNEES = get_args(Residue), get_args(MeanStress), get_args(BelowKnee)

ROUND_OFF = 1e-6
"""Cycles below this share of a stress are rounding or noise of a joint that is held; a cycle of the whole stress does 10¹⁸ times their damage
with a slope of 3."""

RAINFLOW = "rainflow count of ASTM E1049-85 (2023)"
DAMAGE = Formula("D = Σ c/N, N = N_k (S_k/S_a)^k, S_a = range/2", RAINFLOW + ", 5.4; Palmgren–Miner")
EQUIVALENT = Formula("S_eq = (Σ c S_a^k / N_k)^(1/k), which does the same damage N_k times", "Palmgren–Miner")
GOODMAN = "S_a/(1 − S_m/S_u) (Goodman)"


class Cycles(NamedTuple):
    """Counted cycles, each array (n): ranges (twice the amplitude), means, and counts, 1 or 0.5."""

    ranges: Array
    means: Array
    counts: Array


def turning_points(series: ArrayLike) -> Array:
    """The first and last sample of a series (n), and between them those where it turns; plateaus count once."""
    x = np.asarray(series, dtype=float)
    x = np.asarray(x[np.concatenate([[True], np.diff(x) != 0])]) if len(x) else x
    if len(x) < 3:
        return x
    slope = np.diff(x) > 0
    return np.asarray(x[np.concatenate([[True], slope[1:] != slope[:-1], [True]])])


def rainflow_cycles(series: ArrayLike, residue: Residue = "half cycles") -> Cycles:
    """Counts the cycles of a series (n) by ASTM E1049-85 (2023).

    residue: what is left open at the end are half cycles (5.4.4), or the history repeats, and is counted from its largest
    magnitude on until all cycles close (5.4.5).  Needs the package rainflow.  O(n).
    """
    import rainflow

    points = turning_points(series)
    if residue == "repeating" and len(points) > 1:
        k = int(np.argmax(np.abs(points)))
        points = turning_points(np.concatenate([points[k:], points[: k + 1]]))
    found = [(size, mean, count) for size, mean, count, _, _ in rainflow.extract_cycles(points)]
    table = np.array(found, dtype=float).reshape(-1, 3)
    return Cycles(table[:, 0], table[:, 1], table[:, 2])


def without_round_off(cycles: Cycles, largest: float) -> Cycles:
    """The cycles whose range is more than rounding and noise make of a stress of this magnitude: 10⁻⁶ of it."""
    kept = cycles.ranges > ROUND_OFF * largest
    return Cycles(cycles.ranges[kept], cycles.means[kept], cycles.counts[kept])


def corrected_amplitude(amplitude: ArrayLike, mean: ArrayLike, method: MeanStress = "none", ultimate: float | None = None) -> Array:
    """Amplitudes that do the same damage about a mean of zero, same unit.

    goodman: S_a/(1 − S_m/S_u) with the ultimate strength S_u, infinite from S_m = S_u on, smaller for means in compression;
    "goodman in tension": without that credit.
    """
    Sa, Sm = np.asarray(amplitude, dtype=float), np.asarray(mean, dtype=float)
    if method == "none":
        return Sa
    if ultimate is None:
        raise ValueError("Goodman's correction needs the ultimate strength")
    left = 1.0 - (Sm if method == "goodman" else np.maximum(Sm, 0.0)) / ultimate
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(left > 0, Sa / left, np.where(Sa > 0, np.inf, 0.0))


def cycles_to_failure(amplitude: ArrayLike, k: float, knee_amplitude: float, knee_cycles: float, below: BelowKnee = "elementary") -> Array:
    """Cycles that an amplitude may be repeated: N = N_k (S_k/S_a)^k above the knee.

    below the knee: the same slope (elementary), 2k − 1 (haibach), or no damage (original).
    """
    with np.errstate(divide="ignore"):
        x = knee_amplitude / np.asarray(amplitude, dtype=float)
    low = x > 1.0
    slope = np.where(low, 2.0 * k - 1.0 if below == "haibach" else k, k)
    with np.errstate(over="ignore"):
        N = knee_cycles * x**slope
    return np.where(low, np.inf, N) if below == "original" else N


def miner_sum(amplitude: ArrayLike, count: ArrayLike, k: float, knee_amplitude: float, knee_cycles: float, below: BelowKnee = "elementary") -> float:
    """Damage D = Σ c/N of amplitudes (n) with counts (n); 1 is failure.  Palmgren–Miner."""
    with np.errstate(divide="ignore"):  # what can't be borne once
        return float(np.sum(np.asarray(count, dtype=float) / cycles_to_failure(amplitude, k, knee_amplitude, knee_cycles, below)))


def equivalent_amplitude(amplitude: ArrayLike, count: ArrayLike, k: float, cycles: float) -> float:
    """Amplitude that does the damage of all in a given number of cycles, on a line without a knee: (Σ c S^k / N)^(1/k)."""
    S, c = np.asarray(amplitude, dtype=float), np.asarray(count, dtype=float)
    largest = float(S.max(initial=0.0))
    return largest * float((np.sum(c * (S / largest) ** k) / cycles) ** (1.0 / k)) if largest > 0 else 0.0
