"""Few samples that stand for many: whatever linear function of a vector is asked for, one of those kept has at least a share of its largest magnitude.

The kept vectors k and their negatives span a convex hull, whose gauge of w is

    γ(w) = min Σ |λ_k|   with   Σ λ_k k = w.                                                         (1)

No linear function is larger at w than γ(w) times its largest magnitude at the kept, and one is as large (duality), so that the share is the least
1/γ(w) of all samples.  It doesn't depend on units.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import ResultError
from ksl.base.extras import require
from ksl.mechanism.states import Array

RANK = 1e-9
"""Singular values below this share of the largest are directions that no sample has."""
NOISE = 1e-13
"""Components that are never above this share of the largest are round-off: a planar mechanism has them in half of the directions."""
INSIDE = 1e-9
"""Samples whose gauge is above 1 by no more are in the hull."""
SWAPS = 200
"""So many exchanges at most when the first samples are chosen; each makes the volume that they span larger by a hundredth or more."""


def extremes(vectors: Array, most: int | None = None) -> tuple[NDArray[np.intp], float]:
    """Indices of samples that are kept, increasing, and the share that they keep.

    vectors (n, d).  most: so many samples at most; None: as many as keep all of it.  Fewer than the vectors have dimensions keep nothing: share 0.
    Kept first are d samples that span a large volume, none of which has coordinates above 1.01 in the others, so that they keep 1 / (1.01 d) at least;
    then that with the largest gauge, again and again.  A linear program for each sample that is looked at.
    """
    require("a share of stresses", "scipy")
    points = _in_own_space(vectors)
    if points.shape[1] == 0:  # nothing acts at any time
        return np.zeros(1, dtype=np.intp), 1.0
    kept = _spanning(points)
    if most is not None and most < len(kept):
        return np.sort(kept[:most]), 0.0
    chosen = list(kept)
    bounds: Array = np.abs(np.linalg.solve(points[kept].T, points.T)).sum(axis=0)  # gauges only fall as samples are added
    while True:
        worst, gauge, direction = _worst(points, chosen, bounds)
        if gauge <= 1 + INSIDE or (most is not None and len(chosen) >= most):
            return np.sort(np.array(chosen, dtype=np.intp)), 1 / max(gauge, 1.0)
        chosen.append(worst if most is not None else _vertex(points, direction, chosen))


def _in_own_space(vectors: Array) -> Array:
    """(n, rank) coordinates in the space that the samples span; columns of one size."""
    largest = np.abs(vectors).max(axis=0, initial=0)
    there = largest > NOISE * largest.max(initial=0)
    scaled = vectors[:, there] / largest[there]
    if not scaled.size:
        return np.zeros((len(vectors), 0))
    s, basis = np.linalg.svd(scaled, full_matrices=False)[1:]
    return np.asarray(scaled @ basis[: int((s > RANK * s[0]).sum())].T)


def _spanning(points: Array) -> NDArray[np.intp]:
    """As many samples as there are dimensions, by pivoting and then by exchanges (Goreinov et al. 2010, maxvol)."""
    from scipy.linalg import qr

    kept = np.asarray(qr(points.T, mode="r", pivoting=True)[1][: points.shape[1]], dtype=np.intp)
    for _ in range(SWAPS):
        coordinates = np.linalg.solve(points[kept].T, points.T)
        place, sample = np.unravel_index(np.abs(coordinates).argmax(), coordinates.shape)
        if abs(coordinates[place, sample]) <= 1.01:
            break
        kept[place] = sample
    return kept


def _worst(points: Array, chosen: list[int], bounds: Array) -> tuple[int, float, Array]:
    """The sample with the largest gauge, its gauge and the direction in which it sticks out.  bounds: of the gauges, made sharper on the way."""
    bounds[chosen] = np.minimum(bounds[chosen], 1.0)
    direction: Array = np.zeros(points.shape[1])
    best, largest = int(chosen[0]), 1.0
    for k in np.argsort(-bounds, kind="stable"):
        if bounds[k] <= largest + INSIDE:
            break
        bounds[k], y = _gauge(points[chosen], points[k])
        if bounds[k] > largest:
            best, largest, direction = int(k), float(bounds[k]), y
    return best, largest, direction


def _gauge(kept: Array, w: Array) -> tuple[float, Array]:
    """(1), by its dual: the largest y·w with |y·k| ≤ 1 for all kept."""
    from scipy.optimize import linprog

    found = linprog(-w, A_ub=np.vstack([kept, -kept]), b_ub=np.ones(2 * len(kept)), bounds=(None, None), method="highs")
    if found.status != 0:
        raise ResultError(f"share of stresses: a linear program found no optimum ({found.message}); ask for another number of cases")
    return float(-found.fun), np.asarray(found.x)


def _vertex(points: Array, direction: Array, chosen: list[int]) -> int:
    """The sample that sticks out most: a vertex of the hull of all."""
    reach = np.abs(points @ direction)
    reach[chosen] = -1.0
    return int(reach.argmax())
