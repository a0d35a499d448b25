"""Lengths that people type, judged by the extent of the robot: a payload at 50 that is meant in millimetres is beyond any robot."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ksl.mechanism.payload import Carried as Carried

if TYPE_CHECKING:
    from ksl.mechanism.calls import Calls

FAR = 2.0
"""Lengths of more than so many times the robot's extent are suspected to be in millimetres."""
ROUND_OFF = 1e-9
"""A share of a link's mass, and of its moments: what is left of them without payloads is round-off up to there."""
HEAVY_GRAVITY = 1000.0
"""m/s²; that of the earth is 9807 mm/s², and that of the moon 1625."""


def extent(model: Calls, carried: Iterable[Carried] = ()) -> float:
    """How far the robot reaches, m: the longest way from its root along the origins of joints to a link, and on to that link's mass.

    carried: payloads that the model has, whose places and inertias don't count.  Ways are those of the neutral position; slides count with their limits.
    0 where all is at one point.  O(links).
    """
    links = model.links
    whole = {link.name: np.array([link.mass, link.inertia[0] + link.inertia[1] + link.inertia[2]]) for link in links}
    own = {name: x.copy() for name, x in whole.items()}
    for name, mass, point, moments in carried:
        own[model.link(name).name] -= mass, 2 * mass * float(np.dot(point, point)) + moments
    origins = model.frame_poses(model.neutral(), [f"link:{link.name}" for link in links])[:, :3, 3]
    at = {link.name: i for i, link in enumerate(links)}
    reach: dict[str, float] = {}
    farthest = 0.0
    for link in links:  # parents first
        joint = model.joint_above(link.name)
        travel = max((abs(x) for x in (joint.lower, joint.upper) if x is not None and math.isfinite(x)), default=0.0) if joint.kind == "prismatic" else 0.0
        way = 0.0 if joint.parent is None else reach[joint.parent] + float(np.linalg.norm(origins[at[link.name]] - origins[at[joint.parent]]))
        reach[link.name] = way + travel
        mass, trace = own[link.name]
        is_left = (own[link.name] > ROUND_OFF * whole[link.name]).all()  # without payloads
        radius = math.sqrt(trace / 2 / mass) if is_left else 0.0  # of gyration about the link's origin
        farthest = max(farthest, reach[link.name] + radius)
    return farthest if math.isfinite(farthest) else 0.0


def far(what: str, length: float, reach: float, origin: str = "", times: float = FAR) -> list[str]:
    """A sentence about a length, m, beyond what a robot of this extent makes likely; none otherwise.

    times: so many times the extent are likely.
    what: begins the sentence, as "the payload on hand is"; origin: what it is counted from, as "the link's origin".
    """
    if not (reach > 0 and math.isfinite(length) and length > times * reach):
        return []
    meant = (
        f"are these millimetres? Lengths are in m: {length:g} mm are {length / 1000:g}"
        if length / 1000 <= times * reach
        else "check its unit: lengths are in m"
    )
    counted = f" from {origin}" if origin else ""
    return [f"{what} {length:.6g} m{counted}, {length / reach:.3g} times the robot's extent of {reach:.3g} m: {meant}"]


def far_point(what: str, point: Sequence[float], reach: float, origin: str = "the link's origin") -> list[str]:
    """A sentence about a point that is too far away: three numbers, m, from an origin of the robot."""
    return far(what, math.hypot(*(float(x) for x in point)), reach, origin)


def far_inertia(what: str, mass: float, moments: Sequence[float], reach: float) -> list[str]:
    """A sentence about a body's moments of inertia about its centre of mass, kg m², whose radius of gyration, a length, is too large."""
    largest = max((abs(float(x)) for x in moments), default=0.0)
    if not (mass > 0 and reach > 0 and math.isfinite(largest)):
        return []
    radius = math.sqrt(largest / mass)
    if radius <= FAR * reach:
        return []
    meant = "are these kg mm²? Then divide by 1e6: moments are in kg m²" if radius / 1000 <= FAR * reach else "check its unit: moments are in kg m²"
    return [f"{what} is that of a body with a radius of {radius:.4g} m, {radius / reach:.3g} times the robot's extent of {reach:.3g} m: {meant}"]


def strong_gravity(gravity: Iterable[float]) -> list[str]:
    """A sentence about gravity that is likely in mm/s²."""
    g = math.hypot(*(float(x) for x in gravity))
    return [f"gravity is {g:.6g} m/s²: is that in mm/s²? That of the earth is 9.81"] if HEAVY_GRAVITY < g <= 30 * HEAVY_GRAVITY else []
