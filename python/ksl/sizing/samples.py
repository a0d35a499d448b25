"""All samples of a joint: its wrenches, motion and effort, and how much each sample weighs in the load spectrum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ksl.mechanism.joint_kinds import KINDS, has_one_coordinate
from ksl.mechanism.states import Array


@dataclass(frozen=True)
class ResultJoint:
    """What the results say of a joint."""

    name: str
    kind: str
    axis: tuple[float, float, float]
    """Unit vector in the joint's axes.  Fixed joints and those with several axes have z here."""
    has_axis: bool
    parent: str | None = None
    child: str = ""

    @property
    def turns(self) -> bool:
        """Whether the joint has one coordinate, which is an angle."""
        return self.driven and KINDS[self.kind].angle is not None

    @property
    def driven(self) -> bool:
        """Whether the joint has one coordinate."""
        return has_one_coordinate(self.kind)


@dataclass(frozen=True)
class Spectrum:
    """How often each load case occurs: repetitions, or shares of the operating time."""

    repetitions: Mapping[str, float] = field(default_factory=dict)
    """How often the named cases occur; others occur once.  0: an exceptional event, which counts for peaks and not for life."""
    shares: Mapping[str, float] = field(default_factory=dict)
    """Shares of time, if these are given; cases without one have 0."""

    def scale(self, case: str, length: float) -> float:
        """Factor of the durations of a case that lasts `length` seconds, more than 0."""
        if self.shares:
            return self.shares.get(case, 0.0) / length
        return self.repetitions.get(case, 1.0)


@dataclass(frozen=True)
class JointSamples:
    """All samples of one joint, cases one after the other.  n samples; SI units."""

    joint: ResultJoint
    cases: tuple[str, ...]
    case_index: np.ndarray
    """(n): which case each sample is of."""
    time: Array
    weight: Array
    """(n): seconds that each sample stands for in the spectrum: half the steps to its neighbours × repetitions."""
    force: Array
    """(n, 3): on the child, in the joint's axes."""
    moment: Array
    """(n, 3): about `point`."""
    position: Array
    speed: Array
    acceleration: Array
    effort: Array
    """(n): of the drive; NaN where the joint has none, zero where brakes supply the efforts."""
    resolution: float = 0.0
    """Speeds up to this can't be told from zero, and are zero in `speed`: the resolution of the positions over the step between samples."""
    rotor: Array | None = None
    """(n): the part of the effort that accelerates a rotor which the robot's file describes."""
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """About which the moments are: from the joint's origin, in its axes, m."""

    undetermined: tuple[str, ...] = ()
    """Components among fx … tz that rigid bodies leave open, of the force and of the moment about `point`."""
    brake: Array | None = None
    """(n): effort of the brake, as the joint feels it; NaN in load cases whose efforts drives supply.  None: all are such."""

    def about(self, point: Sequence[float] | Array) -> JointSamples:
        """These samples with wrenches about another point, given from the joint's origin in its axes, m."""
        move = np.array(self.point) - np.asarray(point, dtype=float)
        moment = self.moment + np.cross(move, self.force) if move.any() else self.moment
        x, y, z = (float(c) for c in point)
        return replace(self, moment=moment, point=(x, y, z), undetermined=moved(self.undetermined, move))

    def fixed_to_parent(self, point: Sequence[float]) -> JointSamples:
        """These samples with wrenches about a point of the parent, in axes that stay with it: the joint's axes where its position is zero.

        point: from the joint's origin there, m.  Of joints that turn or slide along one axis, and of fixed ones.
        """
        q, k = np.nan_to_num(self.position), self.axis
        if not self.joint.driven:
            return self.about(point)
        if self.joint.turns:  # Rodrigues' formula: from the axes of the child
            c, s = np.cos(q)[:, None], np.sin(q)[:, None]
            force, moment = (np.asarray(c * x + s * np.cross(k, x) + (1 - c) * (x @ k)[:, None] * k, dtype=float) for x in (self.force, self.moment))
            mixed = self._mixed_across(self.undetermined)
            return replace(self, force=force, moment=moment, undetermined=mixed).about(point)
        moment = self.moment + np.cross(q[:, None] * k - np.asarray(point, dtype=float), self.force)
        x, y, z = (float(c) for c in point)
        move = np.abs(q).max() * np.abs(k) + np.abs(np.asarray(point, dtype=float))
        return replace(self, moment=moment, point=(x, y, z), undetermined=moved(self.undetermined, move))

    def _mixed_across(self, names: Sequence[str]) -> tuple[str, ...]:
        """What is open in axes that turn against those of the joint: where one component across the axis is open, all are."""
        found = set(names)
        across = [c for c, share in zip("xyz", np.abs(self.axis)) if share != 1]
        for letter in "ft":
            if any(f"{letter}{c}" in found for c in across):
                found |= {f"{letter}{c}" for c in across}
        return tuple(name for name in ("fx", "fy", "fz", "tx", "ty", "tz") if name in found)

    def open_quantities(self) -> list[str]:
        """The quantities, among those of this class, that use components which rigid bodies leave open."""
        force, moment = (np.array([f"{letter}{c}" in self.undetermined for c in "xyz"]) for letter in "ft")
        along, across = self.axis != 0, np.abs(self.axis) != 1  # components with a share along, and across the axis
        found = {"axial_force": force & along, "radial_force": force & across, "axial_moment": moment & along, "bending_moment": moment & across}
        return [name for name, is_open in found.items() if is_open.any()]

    @cached_property
    def axis(self) -> Array:
        return np.array(self.joint.axis)

    @cached_property
    def axial_force(self) -> Array:
        """(n): signed, along the axis."""
        return np.asarray(self.force @ self.axis)

    @cached_property
    def radial_force(self) -> Array:
        return _length(self.force - self.axial_force[:, None] * self.axis)

    @cached_property
    def axial_moment(self) -> Array:
        """(n): signed, about the line through the point along the axis."""
        return np.asarray(self.moment @ self.axis)

    @cached_property
    def bending_moment(self) -> Array:
        return _length(self.moment - self.axial_moment[:, None] * self.axis)

    @cached_property
    def braked(self) -> np.ndarray:
        """(n): whether a brake and not the drive supplies the effort."""
        return np.zeros(len(self.time), dtype=bool) if self.brake is None else np.isfinite(self.brake)

    @cached_property
    def supplied(self) -> Array:
        """(n): effort of the drive or of the brake."""
        return self.effort if self.brake is None else np.where(self.braked, self.brake, self.effort)

    @cached_property
    def load_effort(self) -> Array:
        """(n): effort at the output of the gear, behind which drive and brake are: what they supply less what accelerates the rotor."""
        return self.supplied if self.rotor is None else self.supplied - self.rotor

    @cached_property
    def stands(self) -> np.ndarray:
        """(n): whether the joint stands.  The sign of its speed is then none, and friction helps to hold it, which sizing leaves out."""
        return np.asarray(self.speed == 0)

    @cached_property
    def oscillates(self) -> bool:
        """Whether the joint never turns a whole revolution in any case of the cycle."""
        return all(np.ptp(self.position[part]) < 2 * np.pi for _, part in self.slices() if part.stop > part.start and self.weight[part.start] > 0)

    @property
    def repeated(self) -> np.ndarray:
        """(n): whether the sample belongs to the cycle, and not to an exceptional event."""
        return np.asarray(self.weight > 0)

    def where(self, k: int) -> tuple[str, float]:
        """Case and time of sample k."""
        return self.cases[int(self.case_index[k])], float(self.time[k])

    def governing_case(self, contribution: Array) -> str:
        """The case that contributes most to a sum over samples (n)."""
        return self.cases[int(np.argmax(np.bincount(self.case_index, contribution, len(self.cases))))]

    def slices(self) -> list[tuple[str, slice]]:
        """Each case with its samples."""
        edges = np.searchsorted(self.case_index, np.arange(len(self.cases) + 1))
        return [(case, slice(int(edges[i]), int(edges[i + 1]))) for i, case in enumerate(self.cases)]

    def each_alone(self) -> list[JointSamples]:
        """Each case by itself."""
        names = ("case_index", "time", "weight", "force", "moment", "position", "speed", "acceleration", "effort", "rotor", "brake")
        columns = {name: x for name in names if (x := getattr(self, name)) is not None}
        return [replace(self, **{name: x[part] for name, x in columns.items()}) for _, part in self.slices() if part.stop > part.start]

    def passes(self) -> list[tuple[slice, float]]:
        """The samples of each case, and how often it is passed through in the spectrum: never, if it lasts no time."""
        found = []
        for _, part in self.slices():
            lasts = float(np.diff(self.time[part]).sum())
            found.append((part, float(self.weight[part].sum()) / lasts if lasts > 0 else 0.0))
        return found


def moved(undetermined: Sequence[str], move: Array) -> tuple[str, ...]:
    """What is open of a wrench after its moment was moved by move × force: moments that get a share of an open force are open, too."""
    found = set(undetermined)
    for k, name in enumerate("xyz"):
        i, j = (k + 1) % 3, (k + 2) % 3
        if (move[i] and f"f{'xyz'[j]}" in found) or (move[j] and f"f{'xyz'[i]}" in found):
            found.add(f"t{name}")
    return tuple(name for name in ("fx", "fy", "fz", "tx", "ty", "tz") if name in found)


def _length(x: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", x, x)))
