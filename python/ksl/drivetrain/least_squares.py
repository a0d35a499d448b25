"""Least squares with equations, of numbers that are not negative (Lawson and Hanson, Solving Least Squares Problems, 1974, chapters 20 and 23)."""

from __future__ import annotations

import numpy as np

from ksl.mechanism.states import Array

HEAVY = 1e4
"""The weight of equations, relative to the largest number, while it is searched which unknowns are zero; then they are exact."""
ROUNDING = 1e-11


def not_negative(A: Array, b: Array, equal: Array, right: Array) -> Array | None:
    """x ≥ 0 (n) with the least |A x − b|² for which `equal` x = right; None where none is found."""
    heavy = HEAVY * float(np.abs(A).max(initial=1e-300)) / float(np.abs(equal).max())
    _, R = np.linalg.qr(np.column_stack([A, b]))  # as few rows as unknowns
    x = _lawson_hanson(np.vstack([R[:, :-1], heavy * equal]), np.concatenate([R[:, -1], heavy * right]))
    kept = list(np.flatnonzero(x > 0))
    while kept:
        found = _exact(R[:, kept], R[:, -1], equal[:, kept], right)
        if np.abs(equal[:, kept] @ found - right).max() > ROUNDING * max(1.0, float(np.abs(right).max())):
            return None
        if found.min() >= 0:
            x = np.zeros(A.shape[1])
            x[kept] = found
            return x
        kept.pop(int(np.argmin(found)))
    return None


def _lawson_hanson(A: Array, b: Array) -> Array:
    n = A.shape[1]
    x, free = np.zeros(n), np.zeros(n, dtype=bool)
    tolerance = 1e-10 * float(np.abs(A.T @ b).max(initial=0.0))
    for _ in range(3 * n):
        gain = np.where(free, -np.inf, A.T @ (b - A @ x))
        if gain.max() <= tolerance:  # as where all are free
            break
        free[int(np.argmax(gain))] = True
        while True:
            trial = np.zeros(n)
            trial[free] = np.linalg.lstsq(A[:, free], b, rcond=None)[0]
            if trial[free].min(initial=1.0) > 0:
                x = trial
                break
            falling = free & (trial <= 0)
            x = x + float((x[falling] / np.maximum(x[falling] - trial[falling], 1e-300)).min()) * (trial - x)
            free &= x > 1e-14
            x[~free] = 0.0
            if not free.any():
                break
    return x


def _exact(A: Array, b: Array, equal: Array, right: Array) -> Array:
    """The least |A x − b|² with `equal` x = right: a particular solution, and the best of what leaves it."""
    base = np.linalg.lstsq(equal, right, rcond=1e-12)[0]
    _, s, Vt = np.linalg.svd(equal)
    free = Vt[int(np.count_nonzero(s > 1e-12 * s[0])) :].T
    best: Array = base + free @ np.linalg.lstsq(A @ free, b - A @ base, rcond=None)[0]
    return best
