"""The limits of the robot's file, and the lines about those that a motion exceeds."""

from __future__ import annotations

from dataclasses import dataclass

from ksl.mechanism.mechanism import Joint


@dataclass(frozen=True)
class Limits:
    """Limits of a joint with one coordinate; None where none is given."""

    lower: float | None
    upper: float | None
    velocity: float | None
    effort: float | None


def limits_of(joint: Joint) -> Limits:
    """Limits that mean one: exporters write 0 for efforts and velocities that they don't know, and 0 and 0 for positions."""
    lower, upper = (joint.lower, joint.upper) if joint.has_limits else (None, None)
    if lower is not None and lower == upper:
        lower = upper = None
    velocity, effort = (x if x is not None and x > 0 else None for x in (joint.velocity, joint.effort))
    return Limits(lower, upper, velocity, effort)
