"""Polytopes of efforts and velocities that limits of motors leave at the joints, and the largest boxes in them."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import ResultError
from ksl.mechanism.states import Array

ITERATIONS = 200
GAP = 1e-13
WORST = 1e12
"""The condition of motors above which they move joints along fewer directions together."""


def corners(to_joints: Array, limits: Array) -> Array:
    """Vertices (n, 2^motors, joints) of what joints get, to_joints (n, joints, motors) times motors' numbers within ± limits (motors)."""
    signs = np.array(list(product((-1.0, 1.0), repeat=len(limits))))
    vertices: Array = np.einsum("njm,cm->ncj", to_joints, signs * limits)
    return vertices


def sides(to_joints: Array, limits: Array) -> tuple[Array, Array]:
    """Rows (n, sides, joints) and their limits (sides), 1, of the polytope whose points are to_joints (n, joints, motors) times motors' numbers within ± limits.

    It is a zonotope: each side is along joints − 1 of the motors' columns, and as far away as all motors together reach across it (Ziegler, Lectures on Polytopes, 1995, 7.3).
    """
    columns = to_joints * limits
    joints, motors = columns.shape[1:]
    rows = []
    for some in combinations(range(motors), joints - 1):
        minors = [np.linalg.det(np.delete(columns[:, :, list(some)], j, axis=1)) if some else np.ones(len(columns)) for j in range(joints)]
        across = np.stack(minors, axis=1) * (-1.0) ** np.arange(joints)
        size = np.abs(np.einsum("nj,njm->nm", across, columns)).sum(axis=1, keepdims=True)
        rows.append(np.divide(across, size, out=np.zeros_like(across), where=size > 0))  # columns that are parallel have no side
    return np.stack(rows, axis=1), np.ones(len(rows))


def crossings(to_motors: Array, limits: Array) -> Array:
    """Points (n, points, joints) whose convex hull are the joints' numbers for which motors, to_motors (n, motors, joints) times these, keep ± limits.

    At a vertex as many motors as joints are at their limits.  Where such a point is beyond the limit of another motor, the one on the way to it that keeps all is taken.
    """
    rows = to_motors / limits[None, :, None]
    joints, found = rows.shape[2], []
    signs = np.array(list(product((-1.0, 1.0), repeat=joints)))
    for some in combinations(range(rows.shape[1]), joints):
        square = rows[:, list(some)]
        sound = np.linalg.cond(square) < WORST
        inverse = np.linalg.inv(np.where(sound[:, None, None], square, np.eye(joints)))
        point = np.einsum("njm,cm->ncj", inverse, signs)
        beyond = np.maximum(np.abs(np.einsum("nmj,ncj->ncm", rows, point)).max(axis=2, keepdims=True), 1.0 * sound[:, None, None])
        found.append(point / beyond)
    return np.concatenate(found, axis=1)


def half_widths(to_motors: Array, limits: Array) -> Array:
    """Half widths b (n, joints) of the largest box by volume for which motors, to_motors (n, motors, joints) times joints' numbers, keep limits (motors).

    The corner that is worst for a motor has |to_motors| b, so that the box solves: largest Σ log b with |to_motors| b ≤ limits.  It is unique.
    Primal–dual interior point (Boyd and Vandenberghe, Convex Optimization, 11.7).
    """
    A = np.abs(to_motors) / limits[None, :, None]
    n, motors, joints = A.shape
    scale = A.max(axis=1)  # columns of size one: units of the joints don't matter
    scale[scale == 0] = np.nan
    A = A / scale[:, None]
    b, multiplier, left = np.full((n, joints), 0.5 / joints), np.ones((n, motors)), np.arange(n)
    for _ in range(ITERATIONS):
        if not len(left):
            break
        b[left], multiplier[left], ended = _iteration(A[left], b[left], multiplier[left])
        left = left[~ended]
    if len(left):
        raise ResultError(
            f"the largest box of state {left[0]} is not found in {ITERATIONS} iterations: motors' limits there differ by more than the precision; it is near where motors hold nothing"
        )
    half: Array = b / scale
    return half


def _iteration(A: Array, b: Array, multiplier: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """A step towards the box, and whether it was there."""
    slack = 1.0 - np.einsum("nmj,nj->nm", A, b)
    gap = np.einsum("nm,nm->n", slack, multiplier) / A.shape[1]
    gradient = -1.0 / b + np.einsum("nmj,nm->nj", A, multiplier)
    ended = (gap < GAP) & (np.abs(gradient * b).max(axis=1) < 1e-9)
    goal = 0.1 * gap[:, None]
    H = np.einsum("nmj,nm,nmi->nji", A, multiplier / slack, A)
    H[:, np.arange(b.shape[1]), np.arange(b.shape[1])] += 1.0 / b**2
    right = -(gradient + np.einsum("nmj,nm->nj", A, goal / slack - multiplier))
    db = np.linalg.solve(H, right[..., None])[..., 0]
    ds = -np.einsum("nmj,nj->nm", A, db)
    dm = (goal - multiplier * ds) / slack - multiplier
    step = np.minimum(1.0, 0.95 * np.minimum(np.minimum(_room(b, db), _room(slack, ds)), _room(multiplier, dm)))[:, None]
    return b + step * db, multiplier + step * dm, ended


def _room(x: Array, dx: Array) -> Array:
    """The largest step (n) for which x + step dx stays positive."""
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.where(dx < 0, -x / dx, np.inf)
    room: Array = steps.min(axis=1)
    return room
