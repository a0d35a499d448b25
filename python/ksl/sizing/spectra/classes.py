"""Edges of classes: those that are given, checked, and round ones."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import SizingError
from ksl.mechanism.states import Array
from ksl.sizing.fatigue import ROUND_OFF

MOST = 24
"""Classes of round edges, at most."""


def edges_given(edges: ArrayLike | None, x: Array, what: str, signed: bool = True) -> Array:
    """Edges as an array (k + 1); None: round ones for the values x (n).  Raises SizingError where they don't increase; what: the argument."""
    if edges is None:
        return round_edges(x, signed)
    try:
        found = np.asarray(edges, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.ndim != 1 or len(found) < 2 or not np.isfinite(found).all() or not (np.diff(found) > 0).all():
        raise SizingError(f"{what}: expected two numbers or more that increase, the edges of the classes")
    return found


def round_edges(x: Array, signed: bool = True, most: int = MOST) -> Array:
    """Edges (k + 1) of equal classes of a round width, 1, 2, 2.5 or 5 times a power of ten, which hold all values x (n); at most `most` classes.

    A class lies about zero: what stands is in a class of its own, and noise about it doesn't fall to two sides.  Values without a sign begin at zero.
    """
    low, high = (float(x.min()) if signed else 0.0, float(x.max())) if len(x) else (0.0, 0.0)
    magnitude = max(abs(low), abs(high))
    span = high - low if high - low > ROUND_OFF * magnitude else magnitude or 1.0
    power, shift = 10.0 ** math.floor(math.log10(span / most)), 0.5 if signed else 0.0
    for factor in (1.0, 2.0, 2.5, 5.0, 10.0, 20.0):
        first, last = (math.floor(end / (factor * power) + shift) for end in (low, high))
        if last - first + 1 <= most:
            break
    edges = factor * (np.arange(first, last + 2) - shift) * power
    return np.asarray(np.round(edges, max(0, 3 - math.floor(math.log10(power)))), dtype=float)
