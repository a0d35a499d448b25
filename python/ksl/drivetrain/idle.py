"""Rods that turn idly about their own lines: bodies that move alone while motors and all other bodies stand still."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ksl.drivetrain.parts import Part
from ksl.mechanism.calls import Calls
from ksl.mechanism.states import Array

ALONE = 1e-8
"""Rates of bodies, relative to the largest of the freedom, below which they stand still."""


@dataclass(frozen=True)
class IdleRod:
    """A link that can turn about a line that is fixed in it."""

    link: str
    direction: Array
    """A unit vector (3) along the line, in the link's axes."""


def idle_rods(m: Calls, tree: Calls, q: Array, part: Part) -> list[IdleRod]:
    """The idle freedoms of a part at a closed position q (nq), one rod for each.

    Freedoms that are left with the motors held are split by bodies: a body turns idly if a combination of these freedoms moves it alone.
    Freedoms that move several bodies are no rod's, and stay.
    """
    free = _left(m, q, part)
    if not free.shape[1]:
        return []
    ends = {link for loop in part.loops for link in (loop.predecessor, loop.successor)}
    bodies = _bodies(tree, part)
    twists = {top: tree.jacobian(q, top)[:, part.all] @ free for top in bodies}
    counted = [top for top, welded in bodies.items() if welded & ends or any(tree.link(link).mass > 0 for link in welded)]
    found: list[IdleRod] = []
    for top in counted:  # links between the hinges of a ball have no mass, and no loop ends at them: they may move
        others = np.vstack([np.zeros((1, free.shape[1])), *(x for name, x in twists.items() if name in counted and name != top)])
        for k in _null(others).T:
            turning = (twists[top] @ k)[3:]
            if np.linalg.norm(turning) > ALONE:
                found.append(IdleRod(top, turning / np.linalg.norm(turning)))
    return found


def _left(m: Calls, q: Array, part: Part) -> Array:
    """A basis (coordinates, freedoms) of what moves while the motors are held."""
    held = np.zeros((len(part.of_motors), m.nv))
    held[np.arange(len(part.of_motors)), part.of_motors] = 1.0
    return _null(np.vstack([m.loop_jacobian(q), held])[:, part.all])


def _null(A: Array) -> Array:
    if not A.shape[0]:
        return np.eye(A.shape[1])
    _, s, Vt = np.linalg.svd(A)
    rank = int(np.count_nonzero(s > ALONE * max(float(s.max(initial=0.0)), ALONE)))
    basis: Array = Vt[rank:].T
    return basis


def _bodies(tree: Calls, part: Part) -> dict[str, set[str]]:
    """For each joint of the part the link that it carries, and with this the links welded to it."""
    moved = {*part.joints, *part.motors, *part.followers}
    tops = [joint.child for joint in tree.joints if (joint.leader or joint.name) in moved]
    bodies: dict[str, set[str]] = {top: {top} for top in tops}
    for link in tree.links:
        top: str | None = link.name
        while top is not None and top not in bodies and not tree.joint_above(top).nv and tree.joint_above(top).leader is None:
            top = tree.parent(top)
        if top in bodies:
            bodies[top].add(link.name)
    return bodies
