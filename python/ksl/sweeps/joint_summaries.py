"""The summary of all joints at once: what `load_cases.quantities.summarise` says of each, to the bit, for thousands of cases."""

from __future__ import annotations

import numpy as np

from ksl.load_cases.joint_limits import limits_of
from ksl.load_cases.load_case import Block
from ksl.load_cases.quantities import SIGNED, along, first_extremes, length, rms, work
from ksl.load_cases.reaction_joints import has_drive, reaction_joints
from ksl.mechanism.mechanism import Mechanism
from ksl.mechanism.states import EFFORT_PARTS, Array

WRENCH = ("axial_force", "radial_force", "bending_moment", "axial_moment", "force", "moment")


class Peaks:
    """Peaks, means and shares of limits of the joints of a robot.  Joints that don't have a quantity have NaN there."""

    def __init__(self, model: Mechanism) -> None:
        joints = reaction_joints(model)
        self._joints = joints
        self._axial = np.array([j.one_coordinate for j in joints])
        self._axes = np.array([j.axis for j in joints])[self._axial]
        self._turns = np.array([j.has_angle for j in joints])[self._axial]
        self._driven = np.array([has_drive(model, j) for j in joints])
        self._v = np.array([j.v_index for j in joints])[self._driven]
        self._follows = np.array([j.leader is not None for j in joints])
        self._followers = [j for j in joints if j.leader is not None]
        self._model = model
        limits = [limits_of(j) for j in joints if j.one_coordinate]
        self._lower, self._upper, self._speed, self._effort = (
            np.array([np.nan if x is None else x for x in (getattr(of, name) for of in limits)]) for name in ("lower", "upper", "velocity", "effort")
        )

    def names(self) -> list[str]:
        """The quantities of :meth:`of`, in order."""
        names = [f"{q}_{part}" for q in WRENCH for part in ("peak", "peak_time", "rms")]
        names += ["effort_peak", "effort_peak_time", "effort_rms"]
        if self._model.physics:
            names += [f"{q}_{part}" for q in EFFORT_PARTS for part in ("peak", "peak_time", "rms")]
        names += [f"{q}_{part}" for q in ("speed", "power") for part in ("peak", "peak_time")]
        names += ["power_mean", "work_positive", "work_negative", "acceleration_peak", "acceleration_peak_time"]
        names += [f"position_{part}" for part in ("lowest", "lowest_time", "highest", "highest_time")]
        if self._followers:
            names += [f"coupling_{part}" for part in ("peak", "peak_time", "rms")]
        names = [
            name
            for n in names
            for name in ((n, f"{n.removesuffix('_peak_time')}_at_peak") if n.endswith("_peak_time") and n.removesuffix("_peak_time") in SIGNED else (n,))
        ]
        return [*names, "position_share", "speed_share", "effort_share"]

    def of(self, block: Block) -> dict[str, Array]:
        """{quantity: its value for each joint (joints)} of one case, all of whose samples are in `block`."""
        rows: dict[str, Array] = dict.fromkeys(self.names(), np.empty(0))
        time = block.time
        by_joint = np.ascontiguousarray(np.moveaxis(block.in_joint_axes, 0, 1))  # samples of a joint are neighbours

        def put(name: str, chosen: Array, x: Array, mean: bool = True) -> None:
            """Peak, its time, the root mean square and, of `SIGNED` quantities, the value at the peak of curves x (chosen joints, samples)."""
            size = np.abs(x)
            rows[f"{name}_peak"] = self._of(chosen, size.max(axis=1, initial=0.0))
            first = first_extremes(size)
            rows[f"{name}_peak_time"] = self._of(chosen, time[first])
            if name in SIGNED:
                rows[f"{name}_at_peak"] = self._of(chosen, np.copysign(size.max(axis=1, initial=0.0), np.take_along_axis(x, first[:, None], 1)[:, 0]))
            if mean:
                rows[f"{name}_rms"] = self._of(chosen, rms(time, x))

        forces, moments = by_joint[self._axial, :, :3], by_joint[self._axial, :, 3:]
        axes = self._axes[:, None]
        axial, about_axis = along(forces, axes), along(moments, axes)
        free = block.without_axial_effort[self._axial]
        axial[free & ~self._turns], about_axis[free & self._turns] = 0.0, 0.0
        put("axial_force", self._axial, axial)
        put("radial_force", self._axial, length(forces - axial[..., None] * axes))
        put("bending_moment", self._axial, length(moments - about_axis[..., None] * axes))
        put("axial_moment", self._axial, about_axis)
        put("force", ~self._axial, length(by_joint[~self._axial, :, :3]))
        put("moment", ~self._axial, length(by_joint[~self._axial, :, 3:]))

        position, speed, acceleration = self._coordinates(block)
        put("speed", self._axial, speed, mean=False)
        put("acceleration", self._axial, acceleration, mean=False)
        for part, sign in (("lowest", -1), ("highest", 1)):
            k = first_extremes(sign * position)
            rows[f"position_{part}"] = self._of(self._axial, np.take_along_axis(position, k[:, None], 1)[:, 0])
            rows[f"position_{part}_time"] = self._of(self._axial, time[k])

        effort = np.ascontiguousarray(block.tau[:, self._v].T)
        power = effort * speed[self._driven[self._axial]]
        put("effort", self._driven, effort)
        put("power", self._driven, power, mean=False)
        if block.parts is not None:
            for i, name in enumerate(EFFORT_PARTS):
                put(name, self._driven, np.ascontiguousarray(block.parts[:, i, self._v].T))
        positive, negative = work(time, power)
        rows["power_mean"] = self._of(self._driven, (positive + negative) / (time[-1] - time[0]))
        rows["work_positive"], rows["work_negative"] = self._of(self._driven, positive), self._of(self._driven, negative)
        if self._followers:
            put("coupling", self._follows, np.ascontiguousarray(block.coupling.T))
        self._add_shares(rows, position)
        return rows

    def _coordinates(self, block: Block) -> tuple[Array, Array, Array]:
        """Position, speed and acceleration (joints with one coordinate, samples), those of mimic joints and of loops included."""
        moved = [block.motions.of(j) for j in self._joints if j.one_coordinate]
        q, v, a = (np.array([of[k] for of in moved]).reshape(len(moved), len(block.time)) for k in range(3))
        return q, v, a

    def _add_shares(self, rows: dict[str, Array], position: Array) -> None:
        """Shares of the limits of the robot's file: 1 is at the limit.  NaN where it gives none."""
        middle, half = (self._upper + self._lower) / 2, (self._upper - self._lower) / 2
        lowest, highest = position.min(axis=1), position.max(axis=1)
        both = np.max(np.abs(position - middle[:, None]), axis=1, initial=0.0) / half
        # with one bound there is no range: the distance to it counts in units of its size, or of 1 rad or m, as for the verdict
        above = 1 + (highest - self._upper) / np.maximum(np.abs(self._upper), 1.0)
        below = 1 - (lowest - self._lower) / np.maximum(np.abs(self._lower), 1.0)
        of_position = np.where(np.isnan(self._lower), above, np.where(np.isnan(self._upper), below, both))
        rows["position_share"] = self._of(self._axial, of_position)
        rows["speed_share"] = self._of(self._axial, rows["speed_peak"][self._axial] / self._speed)
        rows["effort_share"] = self._of(self._axial, rows["effort_peak"][self._axial] / self._effort)

    def _of(self, chosen: Array, x: Array) -> Array:
        """Values of the chosen joints among those of all."""
        values = np.full(len(self._joints), np.nan)
        values[chosen] = x
        return values
