"""The load spectra of one joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import SizingError, unknown_name
from ksl.mechanism.states import Array
from ksl.sizing.fatigue import ROUND_OFF, Cycles, rainflow_cycles, without_round_off
from ksl.sizing.life import mean_load
from ksl.sizing.results import WRENCH
from ksl.sizing.samples import JointSamples
from ksl.sizing.spectra.bearing_classes import BearingLoads, Equivalent, bearing_axes, bearing_classes
from ksl.sizing.spectra.classes import edges_given


QUANTITIES = {"radial": "radial_force", "axial": "axial_force", "tilting": "bending_moment"}
"""{load of a bearing: quantity of the samples}."""


@dataclass(frozen=True, repr=False)
class Spectra:
    """How long a joint has which torque and speed, its cycles, and the loads of its bearing.  Times, revolutions and cycles are of one pass through all
    load cases with their repetitions; of one hour where they have shares of the time."""

    samples: JointSamples
    """Wrenches on the child about the point of the bearing, in the joint's axes or those that stay with the parent."""
    torque_edges: Array
    """N m; N where the joint slides.  A class holds its lower edge, the last one its upper edge, too."""
    speed_edges: Array
    """rad/s; m/s where the joint slides."""
    of_one_hour: bool = False

    @property
    def joint(self) -> str:
        return self.samples.joint.name

    @property
    def oscillates(self) -> bool:
        """Whether the joint turns less than one revolution each way, so that lives by ISO 281 are an indication only."""
        return self.samples.oscillates

    @cached_property
    def torque(self) -> Array:
        """(n): see `torque_of`."""
        return torque_of(self.samples)

    @property
    def seconds(self) -> Array:
        """(n): the time that each sample stands for."""
        return self._per_pass * self.samples.weight

    @property
    def duration(self) -> Array:
        """(torque classes, speed classes) s.  Raises SizingError where the joint neither turns nor slides along one axis."""
        return self._in_classes(self.seconds)

    @property
    def revolutions(self) -> Array:
        """(torque classes, speed classes): turns, without their sign.  Raises SizingError where the joint slides."""
        self._needs_turning("revolutions")
        return self._in_classes(np.abs(self.samples.speed) * self.seconds / (2 * np.pi))

    @property
    def outside(self) -> float:
        """Seconds in none of the classes of torque and speed: 0 with round edges."""
        return float(self.seconds.sum() - self.duration.sum())

    def equivalent(self, p: float) -> float:
        """Torque of the same effect, (Σ |T|^p |n| Δt / Σ |n| Δt)^(1/p), N m; NaN where nothing turns."""
        return mean_load(self.torque, self.samples.speed, self.samples.weight, p)

    def rainflow(self, component: str) -> Cycles:
        """Cycles of a component, fx … tz or effort: ranges, means and counts, each (n).

        By ASTM E1049-85, 5.4.4: each case by itself, what it leaves open are half cycles; counts × how often the case occurs.  Needs the package rainflow.
        """
        x = self._component(component)
        largest = float(np.abs(x).max())
        found = [(without_round_off(rainflow_cycles(x[rows]), largest), times * self._per_pass) for rows, times in self.samples.passes() if times > 0]
        parts = [np.concatenate(column) for column in zip(*((c.ranges, c.means, times * c.counts) for c, times in found))] if found else [np.zeros(0)] * 3
        return Cycles(*parts)

    def rainflow_matrix(self, component: str, range_edges: ArrayLike | None = None, mean_edges: ArrayLike | None = None) -> Array:
        """Cycles by range and mean, (range classes, mean classes); edges as those of the torque, round ones by default."""
        cycles = self.rainflow(component)
        return cycles_in_classes(cycles, *self.rainflow_edges(cycles, range_edges, mean_edges))

    def rainflow_edges(self, cycles: Cycles, range_edges: ArrayLike | None = None, mean_edges: ArrayLike | None = None) -> tuple[Array, Array]:
        """The edges that `rainflow_matrix` takes."""
        return edges_given(range_edges, cycles.ranges, "range_edges", signed=False), edges_given(mean_edges, cycles.means, "mean_edges")

    def bearing_equivalent(self, p: float) -> Equivalent:
        """Radial and axial force, N, and tilting moment, N m, of the same effect, each by itself, as `equivalent` does for the torque."""
        return self._bearing.equivalent(p)

    def bearing(self, classes: int = 20) -> dict[str, Array]:
        """The bearing's loads in at most so many classes: columns share (of the time), Fx, Fy, Fz, My, Mz and speed_rpm, the longest class first.

        x is along the joint's axis; of an axis z, (x, y, z) are (z, x, y) of the joint's frame.  Forces and moments are those on the child, N, N m.
        The classes keep the equivalent radial, axial and tilting loads to 1 % for p = 3 and 10/3, and the revolutions.
        Raises SizingError where so few can't, and says how many can.  O(samples · classes).
        """
        return bearing_classes(self._bearing, classes)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader should know, without the joint's name."""
        found = ["oscillates, less than one revolution each way: lives by ISO 281 are an indication only"] if self._turns and self.oscillates else []
        if self.samples.joint.driven and self.outside > ROUND_OFF * float(self.seconds.sum()):
            found.append(f"{self.outside:.4g} s are outside of the classes of torque and speed")
        if self.samples.undetermined:
            found.append(f"rigid bodies leave {' '.join(self.samples.undetermined)} open; their values need stiffnesses of joints")
        return tuple(found)

    @property
    def left_open(self) -> tuple[str, ...]:
        """Which of the loads radial, axial and tilting rigid bodies leave open: their numbers are those of least norm."""
        found = self.samples.open_quantities() if self.samples.undetermined else []
        return tuple(name for name, quantity in QUANTITIES.items() if quantity in found)

    def __repr__(self) -> str:
        turned = f", {self.revolutions.sum():.4g} revolutions" if self._turns else ""
        return f"<ksl spectra of {self.joint}: {self.seconds.sum():.4g} s{turned}>"

    @property
    def _turns(self) -> bool:
        return self.samples.joint.turns

    @property
    def _per_pass(self) -> float:
        total = float(self.samples.weight.sum())
        return 3600.0 / total if self.of_one_hour and total > 0 else 1.0

    @cached_property
    def _bearing(self) -> BearingLoads:
        self._needs_turning("the bearing's loads")
        s, axes = self.samples, bearing_axes(self.samples.axis)
        force, moment = s.force @ axes.T, s.moment @ axes.T
        return BearingLoads(force[:, 0], force[:, 1:], moment[:, 1:], s.speed, s.weight)

    def _in_classes(self, of: Array) -> Array:
        if not self.samples.joint.driven:
            raise SizingError(f"{self.joint} is {self.samples.joint.kind}: classes of torque and speed need a joint that turns or slides along one axis")
        return np.histogram2d(self.torque, self.samples.speed, (self.torque_edges, self.speed_edges), weights=of)[0]

    def _component(self, name: str) -> Array:
        if name not in (*WRENCH, "effort"):
            raise SizingError(unknown_name("rainflow", "component", name, (*WRENCH, "effort")))
        x = self.samples.supplied if name == "effort" else np.concatenate([self.samples.force, self.samples.moment], axis=1)[:, WRENCH.index(name)]
        if not np.isfinite(x).all():
            raise SizingError(f"rainflow: {self.joint} has no effort, since no drive is on it; take fx, fy, fz, tx, ty or tz")
        return x

    def _needs_turning(self, what: str) -> None:
        if not self._turns:
            raise SizingError(f"{self.joint} is {self.samples.joint.kind}: {what} need a joint that turns about one axis")


def torque_of(samples: JointSamples) -> Array:
    """(n): effort at the output of the gear, with its sign; where no drive is on the joint, the moment about its axis, or the force along it."""
    load = samples.load_effort
    if np.isfinite(load).all():
        return load
    return samples.axial_moment if samples.joint.turns else samples.axial_force


def cycles_in_classes(cycles: Cycles, range_edges: Sequence[float] | Array, mean_edges: Sequence[float] | Array) -> Array:
    """Counts by range and mean, (range classes, mean classes)."""
    return np.histogram2d(cycles.ranges, cycles.means, (range_edges, mean_edges), weights=cycles.counts)[0]
