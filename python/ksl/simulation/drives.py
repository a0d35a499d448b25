"""What drives the joints of a simulation: controllers, and brakes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from numpy.typing import ArrayLike

Gains: TypeAlias = "float | Mapping[str, float] | ArrayLike"
"""One number for all driven coordinates, {joint: number}, or one for each coordinate (nv)."""


@dataclass(frozen=True)
class Reference:
    """The motion that a controller follows, at times (n), s, increasing; before and after these it stands at its ends.

    Between the times positions are cubic, with the velocities at both ends, and accelerations lie on straight lines.
    """

    times: ArrayLike
    q: ArrayLike
    """(n, nq), or (…, n, nq) with one for each run."""
    v: ArrayLike | None = None
    """(n, nv); by default zero: the motion then stops at each time."""
    a: ArrayLike | None = None
    """(n, nv); by default zero.  Only computed torque uses them."""


@dataclass(frozen=True)
class PD:
    """tau = stiffness (q_d ⊖ q) + damping (v_d − v) + feed_forward, within ± limit.

        m.simulate(q, v, times, efforts=PD(reference, stiffness=400.0, damping=40.0, gravity=True))

    reference: a :class:`Reference`, or a position (nq) to hold.  stiffness: N m/rad or N/m.  damping: N m s/rad or N s/m.
    Driven are the joints of `drives` where the model names them, else all but floating ones.
    """

    reference: Reference | ArrayLike
    stiffness: Gains
    damping: Gains
    feed_forward: tuple[ArrayLike, ArrayLike] | ArrayLike | None = None
    """Efforts (nv), or (times (n), efforts (n, nv)) with straight lines between."""
    gravity: bool = False
    """Is :meth:`Model.gravity_torque` added."""
    limit: Gains | None = None
    """Largest efforts; "effort limits" of the file are `m.effort_limit`.  By default there are none."""


@dataclass(frozen=True)
class GravityCompensation:
    """tau = gravity_torque(q) − damping v, within ± limit: the mechanism floats.

    m.simulate(q, v, times, efforts=GravityCompensation(damping=2.0))
    """

    damping: Gains = 0.0
    limit: Gains | None = None


@dataclass(frozen=True)
class ComputedTorque:
    """tau = inverse dynamics of the acceleration a_d + stiffness (q_d ⊖ q) + damping (v_d − v), within ± limit.

        m.simulate(q, v, times, efforts=ComputedTorque(reference, stiffness=100.0, damping=20.0))

    stiffness: 1/s², damping: 1/s; with damping² = 4 stiffness errors die out without swinging.  Of a mechanism with loops the
    accelerations of the drives are those, and the others follow.
    """

    reference: Reference | ArrayLike
    stiffness: Gains = 0.0
    damping: Gains = 0.0
    feed_forward: tuple[ArrayLike, ArrayLike] | ArrayLike | None = None
    limit: Gains | None = None


@dataclass(frozen=True)
class Brake:
    """Brakes that engage at a time: dry friction that holds up to its effort, by the exact law.

    m.simulate(q, v, times, efforts=controller, brake=Brake({"shoulder": 120.0, "elbow": 40.0}, at=0.8))
    """

    effort: Gains
    """N m or N."""
    at: float
    """s."""
    cut: bool = True
    """Are the drives without effort from then on."""


Controller: TypeAlias = "PD | GravityCompensation | ComputedTorque"
