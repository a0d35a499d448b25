"""Freedoms of closed mechanisms, and the joints that say where all others are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ksl.mechanism.calls import Calls
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.stiffness import ways_of

GENERIC = 4
"""So many random positions say how many freedoms there are where no position is singular."""


def freedoms(model: Calls) -> int:
    """The freedoms of the closed mechanism, where no position is singular: the fewest of some closed positions."""
    tried = model.close(np.vstack([model.neutral(), model.random(0, size=GENERIC)]))
    return min((model.mobility(q).mobility for q in tried.q[tried.converged]), default=0)


def leads(model: Mechanism, joint: Joint) -> bool:
    """Whether the position of a joint is given and not found from those of others: drives of a closed mechanism whose drives are known, and what floats freely."""
    return joint.name in (model.drives or ()) or floats_freely(model, joint)


@dataclass(frozen=True)
class LoneBody:
    """A link that turns alone about a line that is fixed in it, while the drives and all other bodies stand still."""

    link: str
    direction: tuple[float, float, float]
    """A unit vector along the line, in the link's axes."""
    is_even: bool
    """Whether its mass is the same all round the line: then it is idle, and needs no drive."""


def lone_bodies(model: Mechanism) -> list[LoneBody]:
    """The lone bodies of a mechanism whose drives are known; none of a tree."""
    return [LoneBody(model.link_names[link], (x, y, z), even) for link, (x, y, z), even in model._core.lone_bodies()]


def idle_bodies(model: Mechanism) -> int:
    """How many bodies turn idly about their own lines, as rods with balls at both ends, and need no drive."""
    return sum(body.is_even for body in lone_bodies(model))


def freedoms_to_drive(model: Calls) -> int:
    """The freedoms but for the turning of idle bodies."""
    return freedoms(model) - idle_bodies(model)


def are_enough(model: Mechanism, given: Iterable[Joint]) -> bool:
    """Whether as many leading joints are given as the closed mechanism has freedoms to drive.  Where it has more drives than that, some of them follow."""
    lead = sum(joint.nv for joint in given if leads(model, joint))
    return lead > 0 and isinstance(model, Calls) and lead >= freedoms_to_drive(model)


def floats_freely(model: Mechanism, joint: Joint) -> bool:
    """Whether a joint is floating, and no loop ties its link to what doesn't float: the platform of a parallel robot on the ground follows its legs."""
    if joint.kind != "floating":
        return False
    floating = {j.name for j in model.joints if j.kind == "floating"}
    for loop in model.loops:
        one, other = ways_of(model, loop)
        if joint.name in other:
            one, other = other, one
        if joint.name in one and floating.isdisjoint(other):
            return False
    return True
