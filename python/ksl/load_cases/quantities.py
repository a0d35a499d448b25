"""Quantities for sizing joints: loads over time, their peaks and means, and the power balance."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ksl.mechanism import Joint
from ksl.states import Array

EFFORT_PARTS = ("transmitted", "damping", "friction", "rotor", "spring")
"""What the efforts of motors consist of, in the order of `Model.effort_parts`."""

UNITS = {
    "axial_force": "N",
    "radial_force": "N",
    "bending_moment": "N m",
    "axial_moment": "N m",
    "force": "N",
    "moment": "N m",
    "power": "W",
}
"""Units of all quantities but effort, its parts, coupling and speed, whose units depend on the kind of joint: see `unit`."""


def unit(quantity: str, joint: Joint) -> str:
    """Unit of a quantity for a joint."""
    if quantity in ("effort", "coupling", *EFFORT_PARTS):
        return "N m" if joint.has_angle else "N"
    if quantity == "speed":
        return f"{joint.unit}/s"
    return UNITS[quantity]


@dataclass(frozen=True)
class JointLoads:
    """Curves of one joint along a motion, each (n)."""

    joint: Joint
    wrench: dict[str, Array]
    """Of the wrench at the chosen point and side.  With one axis: axial_force (signed, along the axis), radial_force
    (across it), bending_moment (across), axial_moment (signed, about the line through the point along the axis).
    Otherwise force and moment, magnitudes."""
    speed: Array | None
    """Speed of joints with one coordinate, rad/s or m/s."""
    effort: Array | None
    """Effort of the drive, N m or N: the transmitted effort Sᵀ f of the joint, and of the mimic joints that it leads, and what the
    physics of joints needs besides.  Independent of the chosen point, side and axes.  Mimic joints have none."""
    coupling: Array | None = None
    """Of mimic joints: the effort Sᵀ f, N m or N, by which the coupling with its leader moves the joint."""
    parts: dict[str, Array] = field(default_factory=dict)
    """What the effort consists of, by the names of `EFFORT_PARTS`; empty for models without physics of joints."""

    @property
    def power(self) -> Array | None:
        """Power of the drive, W."""
        return None if self.effort is None or self.speed is None else self.effort * self.speed


@dataclass(frozen=True)
class PowerBalance:
    """Drive power + power of external wrenches − dissipation against the rate of change of energy, each (n), W."""

    drive: Array
    external: Array
    energy: Array
    """Kinetic + potential, rotors and springs included where the physics of joints names them, J."""
    energy_rate: Array
    """Its derivative, from a spline through the samples: independent of the dynamics."""
    round_off: float = 0.0
    """Power that rounding errors alone may cause, W; see `power_round_off`."""
    dissipation: Array | None = None
    """What damping and friction turn into heat; None for models without physics of joints."""

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
    def relative_residual(self) -> float:
        """Largest residual divided by the largest power that enters the balance, or by `round_off` if that is larger."""
        scale = max(self.largest_power, self.round_off)
        return float(np.max(np.abs(self.residual))) / scale if scale > 0 else 0.0


ROUND_OFF_OF_ENERGY = 1e-12
"""Relative error of the energies, some thousand units in the last place: rounding of sums over bodies, amplified by the spline."""


def power_round_off(time: Array, energy: Array, q: Array, largest_effort: float) -> float:
    """Power, W, that rounding alone can cause in a power balance of samples at `time` (n).

    An energy E (n) is rounded by u |E|, which differentiation divides by a time step; a position q (n, nq) by u |q|,
    which makes a speed u |q| / dt, and against the largest effort a power.  E alone would not do: it may be zero by the
    choice of the origin, where efforts are largest.
    """
    work = float(np.max(np.abs(energy))) + float(np.max(np.abs(q), initial=0.0)) * largest_effort
    return ROUND_OFF_OF_ENERGY * work / float(np.min(np.diff(time)))


def joint_loads(joint: Joint, wrench: Array, speed: Array | None, effort: Array | None) -> JointLoads:
    """Curves of a joint from its wrench (n, 6), linear first, in the joint's axes."""
    force, moment = wrench[:, :3], wrench[:, 3:]
    if not joint.one_coordinate:
        return JointLoads(joint, {"force": np.linalg.norm(force, axis=1), "moment": np.linalg.norm(moment, axis=1)}, None, None)
    axis = np.array(joint.axis)
    axial, about_axis = force @ axis, moment @ axis
    curves = {
        "axial_force": axial,
        "radial_force": np.linalg.norm(force - axial[:, None] * axis, axis=1),
        "bending_moment": np.linalg.norm(moment - about_axis[:, None] * axis, axis=1),
        "axial_moment": about_axis,
    }
    return JointLoads(joint, curves, speed, effort)


def integral(time: Array, x: Array) -> float:
    """∫ x dt by trapezoids."""
    return float(np.sum((x[:-1] + x[1:]) / 2 * np.diff(time)))


def rms(time: Array, x: Array) -> float:
    """Root of the time mean of x²; samples are weighted by the duration they represent."""
    return float(np.sqrt(integral(time, x * x) / (time[-1] - time[0])))


def work(time: Array, power: Array) -> tuple[float, float]:
    """Positive and negative work of a power that is linear between samples, J."""
    p0, p1 = power[:-1], power[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        triangle = np.maximum(p0, p1) ** 2 / np.abs(p1 - p0) / 2  # where the sign changes between two samples
    positive = float(np.sum(np.where(p0 * p1 < 0, triangle, np.maximum((p0 + p1) / 2, 0)) * np.diff(time)))
    return positive, integral(time, power) - positive


SummaryRow = dict[str, "float | str | None"]
"""A joint's row of the summary."""


def summarise(time: Array, loads: JointLoads) -> SummaryRow:
    """One row of the summary: peaks (of the magnitude) with their times, time-weighted rms, work.

    Forces and moments are those of the wrench at the chosen point; effort, speed, power and work are the drive's.  A mimic
    joint has no drive: its row has the effort of the coupling and the speed.  With physics of joints, the parts of the effort follow it.
    """
    row: dict[str, float | str | None] = {"joint": loads.joint.name, "kind": loads.joint.kind}
    for name, x in loads.wrench.items():
        row |= _peak(time, name, x) | {f"{name}_rms": rms(time, x)}
    if loads.effort is not None and loads.speed is not None and loads.power is not None:
        row |= _peak(time, "effort", loads.effort) | {"effort_rms": rms(time, loads.effort)}
        for name, x in loads.parts.items():
            row |= _peak(time, name, x) | {f"{name}_rms": rms(time, x)}
        row |= _peak(time, "speed", loads.speed)
        row |= _peak(time, "power", loads.power)
        positive, negative = work(time, loads.power)
        row |= {"power_mean": (positive + negative) / float(time[-1] - time[0]), "work_positive": positive, "work_negative": negative}
    if loads.coupling is not None and loads.speed is not None:
        row |= _peak(time, "coupling", loads.coupling) | {"coupling_rms": rms(time, loads.coupling)}
        row |= _peak(time, "speed", loads.speed)
    return row


def _peak(time: Array, name: str, x: Array) -> dict[str, float]:
    k = int(np.argmax(np.abs(x)))
    return {f"{name}_peak": float(abs(x[k])), f"{name}_peak_time": float(time[k])}
