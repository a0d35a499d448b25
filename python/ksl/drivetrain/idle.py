"""Rods that turn idly about their own lines: bodies that move alone while motors and all other bodies stand still, as the engine finds them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ksl.drivetrain.parts import Part
from ksl.mechanism.calls import Calls
from ksl.mechanism.freedoms import lone_bodies
from ksl.mechanism.states import Array


@dataclass(frozen=True)
class IdleRod:
    """A link that can turn about a line that is fixed in it."""

    link: str
    direction: Array
    """A unit vector (3) along the line, in the link's axes."""


def idle_rods(m: Calls, part: Part) -> list[IdleRod]:
    """The idle rods of a part.  Their mass may be to one side of the line: they have no spin all the same, and what turns them counts for nothing."""
    moved = {*part.joints, *part.motors, *part.followers}
    above = [(m.joint_above(body.link), body) for body in lone_bodies(m)]
    return [IdleRod(body.link, np.array(body.direction)) for joint, body in above if (joint.leader or joint.name) in moved]
