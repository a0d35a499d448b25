"""Quantities for sizing joints: loads over time, their peaks and means, and the power balance."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.calls import Calls
from ksl.mechanism.joint_kinds import has_one_coordinate
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.states import EFFORT_PARTS, Array

UNITS = {"axial_force": "N", "radial_force": "N", "bending_moment": "N m", "axial_moment": "N m", "force": "N", "moment": "N m", "power": "W"}
"""Units of all quantities but effort, its parts, coupling, position, speed and acceleration, which depend on the kind of joint: see `unit`."""

COMPARED = ("axial_force", "radial_force", "bending_moment", "axial_moment", "force", "moment", "effort", "brake", "coupling", "speed", "power")
"""Quantities whose peaks are compared over load cases."""


SIGNED = ("axial_force", "axial_moment", "effort", "brake", "coupling", *EFFORT_PARTS)
"""Quantities along or about the axis: QUANTITY_at_peak is the value at the peak with its sign, positive along the axis: of a cylinder, push or pull."""
LOADS = (*(q for q in COMPARED if q not in ("speed", "power")), *EFFORT_PARTS)
"""Quantities in N or N m."""
ROUND_OFF_OF_LOADS = 1e-12
"""A share of the largest load of a run: what is below is zero by the axes of joints."""


def round_off_of(loads: Iterable[object], weight: float) -> float:
    """Forces and moments below it are round-off, in a machine of any size; weight: its own, N, since some joints may carry nothing."""
    return ROUND_OFF_OF_LOADS * max(weight, *(abs(x) for x in loads if isinstance(x, float)), 0.0)


def round_off_in(rows: Iterable[Mapping[str, object]], weight: float) -> float:
    """Forces and moments of a summary below it are round-off; weight: as :func:`round_off_of` has it."""
    return round_off_of((row.get(f"{q}_peak") for row in rows for q in LOADS), weight)


def weight_of(model: Calls) -> float:
    """The weight of a machine, N; without gravity, its mass times 1 m/s²."""
    return model.mass * max(1.0, math.hypot(*model.gravity))


def unit(quantity: str, joint: Joint) -> str:
    """Unit of a quantity for a joint."""
    if quantity in ("effort", "brake", "coupling", *EFFORT_PARTS):
        return "N m" if joint.has_angle else "N"
    if quantity == "position":
        return joint.unit
    if quantity in ("speed", "acceleration"):
        return f"{joint.unit}/s" if quantity == "speed" else f"{joint.unit}/s²"
    return UNITS[quantity]


@dataclass(frozen=True)
class JointLoads:
    """Curves of one joint along a motion, each (n)."""

    joint: Joint
    wrench: dict[str, Array]
    """Quantities of the wrench at the chosen point and side.  With one axis: axial_force (signed, along the axis), radial_force
    (across it), bending_moment (across), axial_moment (signed, about the line through the point along the axis).
    Otherwise force and moment, magnitudes."""
    speed: Array | None
    """Speed of joints with one coordinate, rad/s or m/s."""
    effort: Array | None
    """Effort of the drive, N m or N: the transmitted effort Sᵀ f of the joint, and of the mimic joints that it leads, and what the
    physics of joints needs besides.  Independent of the chosen point, side and axes.  Mimic joints have none."""
    coupling: Array | None = None
    """The coupling of mimic joints: the effort Sᵀ f, N m or N, by which the coupling with its leader moves the joint."""
    parts: dict[str, Array] = field(default_factory=dict)
    """What the effort consists of, by the names of `EFFORT_PARTS`; empty for models without physics of joints."""
    position: Array | None = None
    """Position of joints with one coordinate, rad or m."""
    acceleration: Array | None = None
    """rad/s² or m/s²."""
    brake: Array | None = None
    """Effort of the brake, N m or N, in load cases in which brakes supply it; zero while the drive does."""

    @property
    def power(self) -> Array | None:
        """Power of the drive, W."""
        return None if self.effort is None or self.speed is None else self.effort * self.speed


@dataclass(frozen=True)
class Untold:
    """Samples that are too far apart: by how much energy changes between two of them, and what it would by the powers at both, J."""

    begin: float
    end: float
    """s."""
    change: float
    by_powers: float

    def __str__(self) -> str:
        return (
            f"samples are too far apart: between {self.begin:.6g} s and {self.end:.6g} s energy changes by {self.change:.3g} J, by the powers at both by "
            f"{self.by_powers:.3g} J, and peaks there are in no result; simulate at a higher rate"
        )


def untold(time: Array, energy: Array, rate: Array, events: Array, least: float) -> Untold | None:
    """Where trapezoids of the rate (n) of an energy (n) miss its change most, unless that is little, or an event is between.  least: J, below
    which energies are rounding."""
    change, by_powers = np.diff(energy), (rate[:-1] + rate[1:]) / 2 * np.diff(time)
    missed = np.abs(change - by_powers)
    missed[np.unique(np.clip(np.searchsorted(time, events) - 1, 0, len(missed) - 1))] = 0.0
    k = int(np.argmax(missed))
    if missed[k] <= max(LARGE_RESIDUAL * float(np.ptp(energy)), least):
        return None
    return Untold(float(time[k]), float(time[k + 1]), float(change[k]), float(by_powers[k]))


@dataclass(frozen=True)
class PowerBalance:
    """Drive power + power of external wrenches − dissipation against the rate of change of energy, each (n), W."""

    drive: Array
    external: Array
    energy: Array
    """Kinetic + potential, rotors and springs included where the physics of joints names them, J."""
    energy_rate: Array
    """The derivative of the energy, from a spline through the samples: independent of the dynamics.  Of simulated motions it is the derivative along their velocities
    and accelerations, which are exact."""
    round_off: float = 0.0
    """Power that rounding errors alone may cause, W; see `power_round_off`."""
    dissipation: Array | None = None
    """What damping and friction turn into heat; None for models without physics of joints."""
    exchanged: float = 0.0
    """The largest rate of the kinetic energy, W: what potential and kinetic energy exchange where nothing is supplied."""
    integrated: bool = False
    """Is the energy rate that of a simulated motion?"""
    untold: Untold | None = None
    """The energy that the samples of a simulated motion don't tell, if that is much."""

    @property
    def supplied(self) -> Array:
        """Drive + external − dissipation, (n), W."""
        return self.drive + self.external - (0.0 if self.dissipation is None else self.dissipation)

    @property
    def residual(self) -> Array:
        """What is supplied less the energy rate, (n), W; zero if the efforts are those of the motion."""
        return self.supplied - self.energy_rate

    @property
    def largest_power(self) -> float:
        """The largest power that enters the balance, W."""
        return max(float(np.max(np.abs(x))) for x in (self.drive, self.external, self.energy_rate, self.dissipation) if x is not None)

    @property
    def at_rest(self) -> bool:
        """No power except rounding errors: nothing moves, or the motion takes no power."""
        return self.largest_power <= self.round_off

    @property
    def doubtful(self) -> bool:
        """Whether the residual is so large that wrenches and motion can't belong together."""
        return not self.at_rest and not self.relative_residual <= LARGE_RESIDUAL

    @property
    def relative_residual(self) -> float:
        """Largest residual divided by the largest power that enters the balance, or by `round_off` or a small share of `exchanged` if these are larger."""
        scale = max(self.largest_power, self.round_off, LEAST_SHARE * self.exchanged)
        return float(np.max(np.abs(self.residual))) / scale if scale > 0 else 0.0


LARGE_RESIDUAL = 1e-2
"""Residual, relative to the largest power, from which on the numbers of a run are doubted."""
LEAST_SHARE = 1e-3
"""A mechanism that swings freely takes no power but errors, which are judged by this share of what its energies exchange."""
LEAST_ENERGY = 1e-9
"""Energies below this share of the largest potential energy are of what hardly moves."""
CAUSES_OF_RESIDUALS = (
    "positions, velocities and accelerations of the motion disagree, or it jumps, or its positions are rounded or noisy, or its samples are too far apart"
)
ROUND_OFF_OF_ENERGY = 1e-12
"""Relative error of the energies, some thousand units in the last place: rounding of sums over bodies, amplified by the spline."""


ROUND_OFF_OF_POSITIONS = 3e-14
"""Relative error of positions that are differentiated twice: some hundred units in the last place."""


def power_round_off(time: Array, kinetic: Array, potential: Array, q: Array, v: Array, largest_effort: float) -> float:
    """Power, W, that rounding alone can cause in a power balance of samples at `time` (n).

    Kinetic and potential energies (n) are rounded by u |E| each, which differentiation divides by a time step; their sum
    alone would not do, since it is constant in a free fall.  A position q (n, nq) is rounded by u |q|, which makes a speed
    u |q| / dt, and against the largest effort a power; energy alone would not do, since it may be zero by the choice of the
    origin, where efforts are largest.  It also makes an acceleration u |q| / dt², whose inertial effort acts along the speed
    v (n, nv): with the momentum 2 K / v this is a power u |q| / dt² · 2 K / v.
    """
    dt = float(np.min(np.diff(time)))
    largest = [float(np.max(np.abs(x), initial=0.0)) for x in (kinetic, potential, q, v)]
    momentum = 2 * largest[0] / largest[3] if largest[3] > 0 else 0.0
    of_energies = ROUND_OFF_OF_ENERGY * (largest[0] + largest[1] + largest[2] * largest_effort) / dt
    return of_energies + ROUND_OFF_OF_POSITIONS * largest[2] / dt / dt * momentum


def along(x: Array, axis: Array) -> Array:
    """Components (…) of vectors (…, 3) along an axis (…, 3): the same bits for any layout in memory, unlike a matrix product."""
    component: Array = x[..., 0] * axis[..., 0] + x[..., 1] * axis[..., 1] + x[..., 2] * axis[..., 2]
    return component


def length(x: Array) -> Array:
    """Lengths (…) of vectors (…, 3)."""
    return np.sqrt(along(x, x))


def joint_loads(joint: Joint, wrench: Array, speed: Array | None, effort: Array | None, without_axial_effort: bool = False) -> JointLoads:
    """Curves of a joint from its wrench (n, 6), linear first, in the joint's axes.

    without_axial_effort: the component along its motion is zero by definition, and what the wrench has there is rounding.
    """
    force, moment = wrench[:, :3], wrench[:, 3:]
    if not has_one_coordinate(joint.kind):
        return JointLoads(joint, {"force": length(force), "moment": length(moment)}, None, None)
    axis = np.array(joint.axis)
    axial, about_axis = along(force, axis), along(moment, axis)
    if without_axial_effort:
        (about_axis if joint.has_angle else axial)[:] = 0.0
    curves = {
        "axial_force": axial,
        "radial_force": length(force - axial[:, None] * axis),
        "bending_moment": length(moment - about_axis[:, None] * axis),
        "axial_moment": about_axis,
    }
    return JointLoads(joint, curves, speed, effort)


def integral(time: Array, x: Array) -> Array:
    """∫ x dt of curves x (…, n) by trapezoids: (…)."""
    sums: Array = np.sum((x[..., :-1] + x[..., 1:]) / 2 * np.diff(time), axis=-1)
    return sums


def rms(time: Array, x: Array) -> Array:
    """Roots (…) of the time mean of x² (…, n); samples are weighted by the duration they represent.  Of one sample its magnitude."""
    means: Array = np.abs(x[..., 0]) if len(time) == 1 else np.sqrt(integral(time, x * x) / (time[-1] - time[0]))
    return means


def work(time: Array, power: Array) -> tuple[Array, Array]:
    """Positive and negative work (…) of powers (…, n) that are linear between samples, J."""
    p0, p1 = power[..., :-1], power[..., 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        triangle = np.maximum(p0, p1) ** 2 / np.abs(p1 - p0) / 2  # where the sign changes between two samples
    positive: Array = np.sum(np.where(p0 * p1 < 0, triangle, np.maximum((p0 + p1) / 2, 0)) * np.diff(time), axis=-1)
    return positive, integral(time, power) - positive


UNDETERMINED = "undetermined"
"""The quantities of a row, separated by blanks, that use components which rigid bodies leave open; of closed mechanisms."""
SummaryRow = dict[str, "float | str | None"]
"""A joint's row of the summary."""


def summarise(time: Array, loads: JointLoads) -> SummaryRow:
    """One row of the summary: peaks (of the magnitude) with their times and, of `SIGNED` quantities, their signs, time-weighted rms, work.

    Forces and moments are those of the wrench at the chosen point; effort, speed, power and work are the drive's.  A mimic
    joint has no drive: its row has the effort of the coupling and the speed; that of a joint without a motor in a closed mechanism the speed.  With physics of joints, the parts of the effort follow it.
    """
    row: dict[str, float | str | None] = {"joint": loads.joint.name, "kind": loads.joint.kind}
    for name, x in loads.wrench.items():
        row |= _peak(time, name, x) | {f"{name}_rms": float(rms(time, x))}
    if loads.effort is not None and loads.speed is not None and loads.power is not None:
        row |= _peak(time, "effort", loads.effort) | {"effort_rms": float(rms(time, loads.effort))}
        for name, x in loads.parts.items():
            row |= _peak(time, name, x) | {f"{name}_rms": float(rms(time, x))}
        if loads.brake is not None:
            row |= _peak(time, "brake", loads.brake) | {"brake_rms": float(rms(time, loads.brake))}
        row |= _peak(time, "speed", loads.speed)
        row |= _peak(time, "power", loads.power)
        positive, negative = map(float, work(time, loads.power))
        duration = float(time[-1] - time[0])
        row |= {"power_mean": (positive + negative) / duration if duration > 0 else float(loads.power[0]), "work_positive": positive, "work_negative": negative}
    if loads.coupling is not None and loads.speed is not None:
        row |= _peak(time, "coupling", loads.coupling) | {"coupling_rms": float(rms(time, loads.coupling))}
    if loads.effort is None and loads.speed is not None:
        row |= _peak(time, "speed", loads.speed)
    if loads.position is not None:
        lowest, highest = (first_extreme(sign * loads.position) for sign in (-1, 1))
        row |= {"position_lowest": float(loads.position[lowest]), "position_lowest_time": float(time[lowest])}
        row |= {"position_highest": float(loads.position[highest]), "position_highest_time": float(time[highest])}
    if loads.acceleration is not None:
        row |= _peak(time, "acceleration", loads.acceleration)
    return row


CONSTANT = 1e-9
"""A curve that varies by no more than this, relative to its size or in SI units, is constant: the rest is round-off."""


def first_extreme(x: Array) -> int:
    """Index of the largest x (n), and of the first sample if x is constant up to round-off, or reaches its largest value there."""
    return int(first_extremes(x))


def first_extremes(x: Array) -> NDArray[np.intp]:
    """Indices of the first extremes of curves x (…, n), along the last axis."""
    largest, least = x.max(axis=-1), x.min(axis=-1)
    first: NDArray[np.intp] = np.argmax(x >= (largest - 1e-14 * np.abs(largest))[..., None], axis=-1)
    return np.where(largest - least <= CONSTANT * np.maximum(np.abs(largest), 1.0), 0, first)


def _peak(time: Array, name: str, x: Array) -> dict[str, float]:
    magnitude = np.abs(x)
    k = first_extreme(magnitude)
    found = {f"{name}_peak": float(magnitude.max()), f"{name}_peak_time": float(time[k])}
    return found | ({f"{name}_at_peak": math.copysign(found[f"{name}_peak"], x[k])} if name in SIGNED else {})


def signed_peak(row: Mapping[str, Any], key: str) -> Any:
    """A number of a row, of peaks with the sign that the quantity has there."""
    return row.get(f"{key.removesuffix('_peak')}_at_peak", row.get(key)) if key.endswith("_peak") else row.get(key)
