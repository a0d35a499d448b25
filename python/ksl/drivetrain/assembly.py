"""Positions of a part on one assembly, followed from a start along a straight line of the given coordinates, joints' or motors'.

A step is an Euler step along the closed positions and Newton's corrections.  A determinant that changes its sign within a step says that the
step has passed a dead centre, beyond which there is another assembly; the path is then followed in finer steps.
"""

from __future__ import annotations

from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from ksl.drivetrain.equations import Equations
from ksl.mechanism.states import Array

LONGEST, SHORTEST = 0.2, 1e-3
"""Steps along a path, of the given coordinates, rad or m: shorter where a step fails, and given up below the shortest, unless only other coordinates went too far: a screw turns them by much."""
LARGEST, ALIKE = 1.0, 0.3
"""The largest step of another coordinate, rad or m, and the least cosine between rates before a step and after it."""
CORRECTIONS, LAST = 30, 1e-9


def follow(equations: Equations, start: Array, held: list[int], targets: Array, detours: bool = True) -> Array:
    """Positions (n, nq) whose coordinates `held` are targets (n, held), on the assembly of start (nq); NaN where there are none.

    detours: whether targets that the straight line doesn't reach are tried one coordinate after the other.
    """
    Q = _walk(equations, np.repeat(start[None], len(targets), axis=0), held, targets)
    first = start[positions_of(equations, held)]
    for order in permutations(range(len(held))) if detours and 1 < len(held) < 4 else ():
        left = np.flatnonzero(np.isnan(Q[:, 0]))
        at, goal = np.repeat(start[None], len(left), axis=0), np.repeat(first[None], len(left), axis=0)
        for k in order:
            goal[:, k] = targets[left, k]
            sound = ~np.isnan(at[:, 0])
            at[sound] = _walk(equations, at[sound], held, goal[sound])
        Q[left] = at
    return Q


def _walk(equations: Equations, start: Array, held: list[int], targets: Array) -> Array:
    """Along straight lines; each state has steps of its own."""
    index, others = positions_of(equations, held), equations.part.without(held)
    Q, way = start.copy(), targets - start[:, index]
    size = np.abs(way).max(axis=1, initial=0.0)
    done, step = np.zeros(len(Q)), np.minimum(1.0, LONGEST / np.maximum(size, 1e-300))
    rate, side = _rates(equations, Q, held, way)
    left = np.arange(len(Q))
    while len(left):
        to = np.minimum(done[left] + step[left], 1.0)
        to[to > 1.0 - 1e-12] = 1.0
        dV = np.zeros((len(left), equations.m.nv))
        dV[:, held] = start[left[:, None], index] + way[left] * to[:, None] - Q[left[:, None], index]
        dV[:, others] = rate[left] * (to - done[left])[:, None]
        sound: NDArray[np.bool_] = np.asarray((np.abs(dV[:, others]) < LARGEST).all(axis=1))  # not where they are NaN
        too_far = ~sound & np.isfinite(dV).all(axis=1)
        ahead = equations.m.integrate(Q[left], np.where(sound[:, None], dV, 0.0))
        tried = np.flatnonzero(sound)
        sound[tried], ahead[tried] = _corrected(equations, ahead[tried], others)
        after, now = _rates(equations, ahead, held, way[left])
        sound &= (now == side[left]) & _go_on(rate[left], after)
        went = left[sound]
        Q[went], rate[went], done[went] = ahead[sound], after[sound], to[sound]
        step[went] = np.minimum(2 * step[went], LONGEST / np.maximum(size[went], 1e-300))
        step[left[~sound]] /= 4
        left = left[(done[left] < 1.0) & (too_far | (step[left] * size[left] >= np.minimum(SHORTEST, size[left] / 8)))]
    Q[done < 1.0] = np.nan
    ended = np.flatnonzero(done >= 1.0)
    Q[ended[:, None], index] = targets[ended]  # the last of the steps is off by rounding
    return Q


def _rates(equations: Equations, Q: Array, held: list[int], way: Array) -> tuple[Array, Array]:
    """How the other coordinates (n, others) move along the way (n, held), and the sign (n) of the determinant."""
    G = equations.jacobian(Q)
    rates = -equations.solve(G, held, np.einsum("nrh,nh->nr", G[:, :, held], way)[..., None])[..., 0]
    return rates, equations.sign(G, held)


def _go_on(before: Array, after: Array) -> NDArray[np.bool_]:
    """Whether rates (n, others) before and after a step are in one direction: where two dead centres are passed at once, no sign changes, but rates turn back."""
    sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return np.asarray(np.einsum("ni,ni->n", before, after) >= ALIKE * sizes - 1e-12)


def _corrected(equations: Equations, Q: Array, others: list[int]) -> tuple[NDArray[np.bool_], Array]:
    """Newton's corrections of positions (n, nq) by these coordinates: whether each is closed, and the positions.

    They end with a correction below LAST, whose square is below rounding, or where they stop to decrease.
    """
    closed, left, before = np.zeros(len(Q), dtype=bool), np.arange(len(Q)), np.full(len(Q), np.inf)
    held = [i for i in equations.part.all if i not in others]
    for k in range(CORRECTIONS):
        dV = np.zeros((len(left), equations.m.nv))
        dV[:, others] = -equations.solve(equations.jacobian(Q[left]), held, equations.errors(Q[left])[..., None])[..., 0]
        sizes = np.abs(dV).max(axis=1, initial=0.0)
        sound = (sizes < LARGEST) & ((sizes < 0.9 * before[left]) | (sizes < LAST) | (k < 2))  # not where they are NaN
        left, dV, sizes = left[sound], dV[sound], sizes[sound]
        if not len(left):
            break
        Q[left], before[left] = equations.m.integrate(Q[left], dV), sizes
        closed[left[sizes < LAST]] = True
        left = left[sizes >= LAST]
    return closed, Q


def positions_of(equations: Equations, coordinates: list[int]) -> list[int]:
    """Where the positions of coordinates, of joints without quaternions, are in q."""
    m = equations.m
    own = {joint.v_index + i: joint.q_index + i for joint in m.joints if joint.nv and joint.quaternion is None for i in range(joint.nv)}
    return [own[i] for i in coordinates]
