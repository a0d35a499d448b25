"""Positions that a mechanism can use: within all limits, in reach, and on the side of `hold` on which the motors pull as at the start."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ksl.drivetrain.assembly import follow, positions_of
from ksl.drivetrain.motion import MotionMap
from ksl.drivetrain.ranges import range_of_column
from ksl.mechanism.states import Array

DRAWN_BACK = 0.05
"""The share of a range, next to an end by reach or hold, in which positions are left out: efforts or velocities have no bound there."""
NOTHING, FEW = 1e-6, 20
"""A range that is shorter, rad or m, has its start beyond a limit; a share of positions, one in so many, below which limits of motors don't count."""
WEAKEST = 0.1
"""Determinants of motors' rates by joints' rates that are smaller, relative to that at the middle, are left out, and 1 / this for larger ones."""


def usable_ranges(a: MotionMap, at: Array) -> Array:
    """Lower and upper ends (joints, 2) of each joint from `at`, the others kept; drawn back from reach and hold; a turn where nothing ends it.

    Where `at` itself is beyond a limit, those of motors don't count.
    """
    found = []
    for k, centre in enumerate(at):
        r = range_of_column(a, k, at, limits=True)
        own = (-np.inf, np.inf)
        if r.upper - r.lower < NOTHING:
            i = a.of_joints[k]
            r, own = range_of_column(a, k, at, limits=False), (min(a.model.lower[i], centre), max(a.model.upper[i], centre))
        ends = np.array([max(r.lower, centre - np.pi), min(r.upper, centre + np.pi)])
        back = DRAWN_BACK * (ends[1] - ends[0])
        ends = ends + np.where([r.lower_by in ("reach", "hold"), r.upper_by in ("reach", "hold")], [back, -back], 0.0)
        found.append(np.clip(ends, *own))
    return np.array(found)


def within(a: MotionMap, q: Array, limits: bool = True) -> NDArray[np.bool_]:
    """Which positions q (n, joints) reach and hold allow, and limits of joints and motors."""
    equations = a.equations
    part, m = equations.part, equations.m
    Q = follow(equations, a.start, part.of_joints, q, detours=False)
    allowed: NDArray[np.bool_] = np.asarray(~np.isnan(Q).any(axis=1))
    if limits:
        index = [k for joint in m.joints if joint.nv and joint.v_index in part.all for k in range(joint.q_index, joint.q_index + joint.nq)]
        allowed[allowed] &= ((Q[allowed][:, index] >= m.lower[index] - 1e-9) & (Q[allowed][:, index] <= m.upper[index] + 1e-9)).all(axis=1)
        for swing in a.swings if allowed.any() else []:
            allowed[allowed] &= swing.beyond(equations, Q[allowed]) <= 1e-9
    if allowed.any():
        determinants = a.holding(a.motor_jacobian(q[allowed])) / a.holding(a.motor_jacobian(a.start[positions_of(equations, part.of_joints)]))
        allowed[allowed] &= (determinants > WEAKEST) & (determinants < 1 / WEAKEST)
    return allowed


def usable_positions(a: MotionMap, at: Array, count: int, seed: int = 0) -> Array:
    """At most `count` random positions (n, joints), uniform over the ranges, of which those that aren't allowed are left out."""
    ends = usable_ranges(a, at)
    q = np.random.default_rng(seed).uniform(ends[:, 0], ends[:, 1], (count, len(ends)))
    for limits in (True, False):
        found: Array = q[within(a, q, limits)]
        if len(found) > count // FEW:
            return found
    return found if len(found) else at[None]
