"""What a simulation gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.states import Array

HAPPENINGS = ("lower limit", "upper limit", "rest", "lifts", "sticks", "slips", "brakes", "singular", "event")
"""In the order of the compiled enumeration."""


@dataclass(frozen=True)
class Event:
    """What happened at an instant of a run."""

    run: int
    """Which: its number along the leading axes, flattened."""
    time: float
    """s."""
    what: str
    """"lower limit" or "upper limit", an impact; "rest", from now on the joint lies on its limit; "lifts", it leaves it;
    "sticks" and "slips", by dry friction or a brake; "brakes" engage; "singular", the loops pass a position at which they lose rank; "event", a zero of a function that was given."""
    joint: str | None
    """The joint; None for brakes, singular positions and functions."""
    coordinate: int | None
    """The joint's index in v; of an event of a function the number of the function."""
    speed: float
    """The speed of the coordinate after it, rad/s or m/s."""


@dataclass(frozen=True)
class Drift:
    """What a run lost, or gained, by its numbers: all zero for an exact integration.  Each array has the leading shape of the runs."""

    energy: Array
    """(…, times) J: energy at a time, less that at the beginning, less the work of efforts, external wrenches and dissipation."""
    momentum: Array | None
    """(…, times, 6) N s and N m s, world axes, linear first, about the centre of mass: momentum less that at the beginning, and
    less gravity's.  None where something else than floating joints carries the mechanism, or external wrenches act."""
    closure: Array | None
    """(…, times) m: the largest opening of a loop since the time before, ahead of its projection; angles times the length of the mechanism.
    None for trees."""


@dataclass(frozen=True, repr=False)
class Simulation:
    """Motions at the times that were asked for.  Rows after the end of a run are NaN.

    Each array has the leading shape … of the states that were given.
    """

    times: Array
    """(times) s."""
    q: Array
    """(…, times, nq)"""
    v: Array
    """(…, times, nv)"""
    a: Array
    """(…, times, nv)"""
    efforts: Array
    """(…, times, nv) of the drives, N m or N, without friction, brakes and limits."""
    kinetic: Array
    """(…, times) J, as :meth:`Model.energy`."""
    potential: Array
    """(…, times) J."""
    work: Array
    """(…, times) J, of efforts, external wrenches and dissipation since the first time."""
    drift: Drift
    events: tuple[Event, ...]
    complete: NDArray[np.bool_]
    """(…) Did the run reach the last time."""
    reason: NDArray[np.str_]
    """(…) "complete", or why the run ended before."""
    ended: Array
    """(…) s."""
    steps: NDArray[np.int64]
    """(…) Accepted steps."""
    rejected: NDArray[np.int64]
    """(…) Steps that were tried again."""
    evaluations: NDArray[np.int64]
    """(…) Of forward dynamics."""

    @property
    def energy(self) -> Array:
        """(…, times) J, kinetic and potential."""
        total: Array = self.kinetic + self.potential
        return total

    def __repr__(self) -> str:
        """One line: how far it came, in how many steps, what it lost."""
        lost = np.abs(self.drift.energy)
        worst = f"{np.nanmax(lost):.2g} J" if np.isfinite(lost).any() else "nothing known"
        closure = "" if self.drift.closure is None else f", closure {np.nanmax(self.drift.closure, initial=0.0):.2g} m"
        runs = "" if self.complete.ndim == 0 else f" of {self.complete.size} runs, {int(np.count_nonzero(self.complete))} complete"
        end = f"to {float(np.max(self.ended, initial=0.0)):g} s" if self.complete.ndim or self.complete else str(self.reason)
        return f"<ksl simulation{runs}: {end}, {int(self.steps.sum())} steps, {len(self.events)} events, energy lost {worst}{closure}>"
