"""Elimination with pivots in a fixed order, for numbers and for the steps of a recording: what is solved has the same shape, and pivots that serve, at all positions of a range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ksl.generation.expressions import is_zero
from ksl.mechanism.states import Array

GOOD = 0.1
"""Pivots that are not smaller than this, relative to the best, are chosen by how few elements they fill."""
SMALLEST = 0.1
"""Pivots that are smaller, relative to the smallest over the range, don't count."""


@dataclass(frozen=True)
class PivotOrder:
    """(row, column) of each pivot, in turn."""

    places: tuple[tuple[int, int], ...]
    least: tuple[float, ...]
    """The smallest value that each has over the range, with its sign; 0 where it changes its sign."""


def pivot_order(A: Array, steps: Any) -> PivotOrder:
    """The order for matrices A (states, n, n).  steps (n, n): as they are recorded, some of which are known to be zero.

    Pivots are large in the state where they are smallest, relative to their row (threshold pivoting; Duff, Erisman, Reid, Direct Methods for Sparse Matrices, 2017,
    chapter 5), and among these fill the fewest elements (Markowitz).
    """
    A, filled, places, least = A.copy(), np.array([[not is_zero(x) for x in row] for row in steps], bool).reshape(A.shape[1:]), [], []
    rows, columns = list(range(A.shape[1])), list(range(A.shape[2]))
    while rows:
        part = A[:, rows][:, :, columns]
        sizes = np.abs(part) / np.maximum(np.abs(part).max(axis=2, keepdims=True), 1e-300)
        worst = sizes.min(axis=0)
        there = filled[np.ix_(rows, columns)]
        cost = np.outer(there.sum(axis=1) - 1, there.sum(axis=0) - 1)
        good = there & (worst >= GOOD * worst.max())
        i, j = np.unravel_index(np.argmin(np.where(good, cost - worst, np.inf)), cost.shape)
        row, column = rows.pop(int(i)), columns.pop(int(j))
        pivot = A[:, row, column]
        places.append((row, column))
        k = int(np.argmin(np.abs(pivot)))
        least.append(float(pivot[k]) if (np.sign(pivot) == np.sign(pivot[k])).all() else 0.0)
        A[:, rows] -= (A[:, rows, column] / np.where(pivot == 0, 1e-300, pivot)[:, None])[..., None] * A[:, None, row]
        filled[np.ix_([r for r in rows if filled[r, column]], filled[row])] = True
    return PivotOrder(tuple(places), tuple(least))


def solved(A: Any, B: Any, order: PivotOrder) -> tuple[Any, list[Any]]:
    """x (n, columns) of A x = B, of arrays of objects, and the pivots; zeros that are known cost nothing."""
    A, B, inverse, pivots = A.copy(), B.copy(), [], []
    left = [row for row, _ in order.places]
    for row, column in order.places:
        left.remove(row)
        pivots.append(A[row, column])
        inverse.append(1.0 / A[row, column])
        for r in left:
            if not is_zero(A[r, column]):
                factor = A[r, column] * inverse[-1]
                A[r], B[r] = A[r] - factor * A[row], B[r] - factor * B[row]
    x = np.empty((A.shape[1], B.shape[1]), object)
    for k in range(len(pivots) - 1, -1, -1):
        row, column = order.places[k]
        found = B[row]
        for _, other in order.places[k + 1 :]:
            found = found - A[row, other] * x[other]
        x[column] = found * inverse[k]
    return x, pivots


def above(pivots: Sequence[Any], order: PivotOrder) -> list[Any]:
    """Numbers that are positive where pivots have the sign that they have over the range, and are not much smaller."""
    return [pivot * np.sign(least) - SMALLEST * abs(least) for pivot, least in zip(pivots, order.least)]
