"""Positions along a motion of a closed mechanism: those of some joints are given, and the others follow, on the branch they were on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ksl.base.words import listed
from ksl.mechanism.calls import Calls
from ksl.mechanism.loops import TOLERANCES, Closed
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import Array

STEP = 0.1
"""The largest step of a held joint between two positions that are closed one from the other, rad or m."""
MOST_STEPS = 500
"""From the neutral position to the first one, so many steps at most."""
MEET = 1e-6
"""Two ways to the same position have met if no coordinate differs by more, rad or m: another branch is further away."""


class NotClosed(Exception):
    """No closed position was found at one of several targets."""

    def __init__(self, row: int, why: str) -> None:
        super().__init__(why)
        self.row, self.why = row, why


@dataclass(frozen=True)
class Closing:
    """How the positions of a closed mechanism were found."""

    held: tuple[str, ...]
    """The joints whose positions the motion gives; all others follow."""
    error: float
    """The largest error of closed loops at any sample, m; angles times the length of the mechanism."""
    error_time: float
    """When, s."""
    compared: tuple[str, ...] = ()
    """A line for each other joint whose positions were given too: how far they are from those that follow."""
    freedoms: int = 0
    """Freedoms of the mechanism."""


@dataclass(frozen=True)
class Held:
    """Joints whose positions are given, of a closed mechanism."""

    model: Calls
    joints: tuple[Joint, ...]

    @property
    def names(self) -> list[str]:
        return [j.name for j in self.joints]

    @property
    def columns(self) -> NDArray[np.intp]:
        """Columns of q."""
        return _indices([(j.q_index, j.nq) for j in self.joints])

    @property
    def rates(self) -> NDArray[np.intp]:
        """Columns of v."""
        return _indices([(j.v_index, j.nv) for j in self.joints])

    def put(self, q: Array, target: Array) -> Array:
        """q (…, nq) with the given positions of `target`."""
        out = np.array(np.broadcast_to(q, target.shape))
        out[..., self.columns] = target[..., self.columns]
        return out

    def said(self, q: Array) -> str:
        """The given positions in words."""
        one = [f"{j.name} = {q[j.q_index]:.6g} {j.unit}" if j.one_coordinate else j.name for j in self.joints]
        return listed(one)


def _indices(places: Sequence[tuple[int, int]]) -> NDArray[np.intp]:
    return np.array([start + k for start, count in places for k in range(count)], dtype=np.intp)


def home(model: Calls, hold: Sequence[str] = ()) -> Array:
    """The closed position (nq) from which others are reached: one near the neutral position, with joints kept there if that is possible.

    Raises NotClosed.
    """
    return searched_home(model, hold)[0]


def searched_home(model: Calls, hold: Sequence[str] = ()) -> tuple[Array, int]:
    """The position of :func:`home`, and among how many assemblies it is the nearest, where it had to be searched: 0 where the neutral position leads to it."""
    start = np.clip(model.neutral(), model.lower, model.upper)
    for kept in (hold, ()) if hold else ((),):
        found = model.close(start, hold=kept, starts=1)
        if found.converged:
            return found.q, 0
        others = model.branches(start, hold=kept)
        if len(others):
            return np.array(others[0]), len(others)
    raise NotClosed(0, f"from its neutral position {_why(model, found.q, str(found.reason))}")


def determining(model: Calls, q: Array, joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """The joints, in their order, from which none before them follows at a closed position q (nq)."""
    J, rank = model.loop_jacobian(q), model.mobility(q).rank
    motions = np.linalg.svd(J)[2][rank:].T if J.size else np.eye(model.nv)
    chosen: list[Joint] = []
    for joint in joints:
        columns = _indices([(j.v_index, j.nv) for j in (*chosen, joint)])
        if np.linalg.matrix_rank(motions[columns], tol=TOLERANCES["unsure"]) == len(columns):
            chosen.append(joint)
    return tuple(chosen)


def left_moving(model: Calls, q: Array, joints: Sequence[Joint]) -> list[Joint]:
    """The joints that can move at a closed position q (nq) while some are held."""
    J, rank = model.loop_jacobian(q), model.mobility(q).rank
    motions = np.linalg.svd(J)[2][rank:].T if J.size else np.eye(model.nv)
    of_held = motions[_indices([(j.v_index, j.nv) for j in joints])]
    fixed = np.linalg.matrix_rank(of_held, tol=TOLERANCES["unsure"]) if of_held.size else 0
    kept = motions @ np.linalg.svd(of_held)[2][fixed:].T if of_held.size else motions
    moving = np.abs(kept).max(axis=1, initial=0.0) > TOLERANCES["unsure"]
    return [j for j in model.joints[: len(model.joint_names)] if moving[j.v_index : j.v_index + j.nv].any()]


def first_closed(held: Held, target: Array, start: Array | None = None) -> Array:
    """The closed position (nq) with the given positions of `target`, on the branch of `start`, or of the home position.

    The given joints go there in small steps, so that the others follow them.  Where that way is barred, the position is closed at once.
    Raises NotClosed.
    """
    model = held.model
    if start is not None:
        found = model.close(held.put(start, target), hold=held.names, starts=1)
        if found.converged:
            return found.q
    begin = home(model, held.names)
    aim = held.put(begin, target)
    way = np.abs(model.difference(begin, aim)).max(initial=0.0)
    steps = int(np.clip(np.ceil(way / STEP), 1, MOST_STEPS))
    between = model.interpolate(np.broadcast_to(begin, (steps, model.nq)), aim, np.arange(1, steps + 1) / steps)
    try:
        return np.array(_one_by_one(held, between, begin)[-1])
    except NotClosed:
        found = model.close(aim, hold=held.names, starts=1)
        if found.converged:
            return found.q
        others = model.branches(aim, hold=held.names)
        if len(others):
            return np.array(others[0])
        raise NotClosed(0, f"with {held.said(aim)} {_why(model, found.q, str(found.reason))}") from None


def closed_along(held: Held, targets: Array, first: Array) -> Array:
    """Closed positions (n, nq) with the given positions of `targets` (n, nq), each from the one before it; first (nq): closed, at targets[0].

    Every so many samples are closed one after the other.  The samples between are then closed side by side, and must come to the same
    positions: where they don't, all are closed one after the other.  Raises NotClosed.
    """
    n = len(targets)
    moved = np.abs(held.model.difference(targets[:-1], targets[1:])[:, held.rates]).max(initial=0.0)
    stride = int(min(np.sqrt(n), np.floor(2 * STEP / moved) if moved > 0 else np.sqrt(n)))
    if stride < 3:
        return _one_by_one(held, targets, first)
    anchors = np.arange(0, n, stride)
    q = np.empty((n, held.model.nq))
    try:
        q[anchors] = _one_by_one(held, targets[anchors], first)
    except NotClosed:
        return _one_by_one(held, targets, first)
    for k in range(1, stride + 1):
        rows = anchors[anchors + k < n] + k
        found = held.model.close(held.put(q[rows - 1], targets[rows]), hold=held.names, starts=1)
        if not found.converged.all() or (k == stride and np.abs(found.q - q[rows]).max(initial=0.0) > MEET):
            return _one_by_one(held, targets, first)
        q[rows] = found.q
    return q


def closed_side_by_side(held: Held, targets: Array, first: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Closed positions (m, n, nq) of m motions at once, each from its own first position (m, nq); and which of them (m, n) were found.

    Behind a position that was not found none of that motion is.
    """
    q, found = np.array(targets), np.zeros(targets.shape[:2], dtype=bool)
    last, going = np.array(first), np.ones(len(targets), dtype=bool)
    for k in range(targets.shape[1]):
        rows = np.flatnonzero(going)  # a search that fails takes long: it is made once
        if len(rows):
            closed = held.model.close(held.put(last[rows], targets[rows, k]), hold=held.names, starts=1)
            last[rows[closed.converged]] = closed.q[closed.converged]
            going[rows] = closed.converged
        q[:, k], found[:, k] = last, going
    return q, found


def _one_by_one(held: Held, targets: Array, first: Array) -> Array:
    """Closed positions (n, nq) one after the other, each from the last; a step that fails is tried once more in smaller ones."""
    q, last = np.empty((len(targets), held.model.nq)), first
    for k, target in enumerate(targets):
        found = held.model.close(held.put(last, target), hold=held.names, starts=1)
        if not found.converged:
            found = _in_small_steps(held, last, target)
        if not found.converged:
            raise NotClosed(k, f"with {held.said(target)} {_why(held.model, found.q, str(found.reason))}")
        q[k] = last = found.q
    return q


def _in_small_steps(held: Held, last: Array, target: Array) -> Closed:
    aim, q = held.put(last, target), last
    for fraction in np.arange(1, 9) / 8:
        found = held.model.close(held.put(q, held.model.interpolate(last, aim, fraction)), hold=held.names, starts=1)
        if not found.converged:
            break
        q = found.q
    return found


def _why(model: Calls, q: Array, reason: str) -> str:
    """The end of a sentence: why a search ended at q (nq) without closing the loops."""
    error, row, worst = np.abs(model.loop_error(q)), 0, ("", 0.0)
    for loop in model.loops:
        size = float(error[row : row + loop.equations].max(initial=0.0))
        worst = max(worst, (loop.name, size), key=lambda x: x[1])
        row += loop.equations
    apart = f"loop joint {worst[0]} stays open by {worst[1]:.3g} m or rad"
    return {
        "singular": f"no closed position was found: the search ended at a singular position, where {apart}",
        "nothing free": f"nothing is left that could move, and {apart}; give fewer joints, those of the drives say",
        "limits": f"no closed position was found within the limits of its joints: {apart}",
    }.get(reason, f"no closed position was found: {apart}")
