"""The model and the motion of one case of a sweep."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ksl.base.errors import SweepError
from ksl.load_cases.case_result import heavy
from ksl.load_cases.case_files.simulated import samples_of, simulated_motion
from ksl.mechanism.lengths import extent, far, far_point, strong_gravity
from ksl.robot_files.loading import load
from ksl.model.model import Model
from ksl.robot_files.stiffness_file import stiff_by
from ksl.mechanism.states import Array
from ksl.model.surgery import under_gravity
from ksl.motions.motion import Motion
from ksl.motions.reading import read_motion
from ksl.sweeps.description import EvenlySpaced, Parameter, Sweep
from ksl.sweeps.given_model import GivenModel


class Variants:
    """Makes the variants of a robot and of its motions.  Files are read once; a variant takes some microseconds."""

    def __init__(self, robot: str | os.PathLike[str] | GivenModel, sweep: Sweep) -> None:
        self.sweep = sweep
        self.model = _base(robot, sweep)
        reading = dict(sweep.reading)
        if isinstance(reading.get("map"), str):
            reading["map"] = sweep.path(reading["map"])
        self._of_simulation: list[str] = []
        """Doubts of the first motion that is simulated."""
        self.motions = {name: read_motion(self.model, sweep.path(name), **reading) for name in sweep.motions}
        for p in sweep.parameters:
            if p.link is not None and p.link not in self.model.link_names:
                _no_link(sweep, p, self.model)

    @cached_property
    def extent(self) -> float:
        """How far the robot reaches, m, by which lengths are judged."""
        return extent(self.model)

    def doubts(self) -> list[str]:
        """What is doubtful about the motions, and units of the sweep that can't be: of lengths, payloads and gravity."""
        found = [f"{self.sweep.path(name)}: {doubt}" for name, motion in self.motions.items() for doubt in motion.doubts] + self._of_simulation
        for p in self.sweep.parameters:
            where = f"{self.sweep.file}: parameter {p.name}:"
            if p.kind == "payload":
                found += far_point(f"{where} the payload is", p.center, self.extent)
                found += heavy(f"{where} the payload has up to", _most(p), self.model.mass)
            elif p.kind == "center":
                found += far(f"{where} it moves a centre of mass by", _most(p), self.extent)
        return [*strong_gravity(self.model.gravity), *found]

    def case(self, values: Mapping[str, Any]) -> tuple[Model, Motion]:
        """Model and motion for these values of the parameters."""
        model, file, factor = self.model, self.sweep.motion, 1.0
        changed: dict[str, Array] = {}
        for p in self.sweep.parameters:
            value = values[p.name]
            if p.kind == "motion":
                file = str(value)
            elif p.kind == "speed":
                factor = float(value)
            elif p.kind == "tilt":
                model = under_gravity(model, _turned(model.gravity, p.axis, -math.radians(float(value))))
            else:
                _change(changed, self.model, p, float(value))
        if changed:
            model = model.with_parameters(changed)
        motion = None if file is None else self.motions[file]
        if self.sweep.simulated is not None:
            simulated = simulated_motion(model, self.sweep.simulated, motion, [])[0]
            self._of_simulation = self._of_simulation or [doubt for doubt in simulated.doubts if motion is None or doubt not in motion.doubts]
            return model, simulated
        assert motion is not None  # sweep_from has refused what has none
        return model, _faster(motion, factor)

    @property
    def most_samples(self) -> int:
        """Samples of the longest motion."""
        how = self.sweep.simulated
        if how is None:
            return max(len(motion.time) for motion in self.motions.values())
        return max((samples_of(how, motion) for motion in self.motions.values()), default=0) or samples_of(how, None)


def _most(p: Parameter) -> float:
    """The largest magnitude of the values of a parameter."""
    ends = (p.values.lower, p.values.upper) if isinstance(p.values, EvenlySpaced) else p.values
    return max(abs(float(x)) for x in (p.lower, p.upper, *ends))


def _base(robot: str | os.PathLike[str] | GivenModel, sweep: Sweep) -> Model:
    try:
        base = dict(sweep.base)
        stiffness = base.pop("stiffness", None)
        if isinstance(base.get("loops"), str) and base["loops"] != "cut":
            base["loops"] = sweep.path(base["loops"])
        if isinstance(base.get("packages"), Mapping):
            base["packages"] = {name: sweep.path(str(folder)) for name, folder in base["packages"].items()}
        model = robot.model(base, sweep.file) if isinstance(robot, GivenModel) else load(robot, **base)
        return model if stiffness is None else _stiff(model, sweep, stiffness)
    except SweepError:
        raise
    except (TypeError, ValueError) as error:
        raise SweepError(f"{sweep.file}: the robot can't be loaded as [base] says: {error}") from None


def _stiff(model: Model, sweep: Sweep, stiffness: Any) -> Model:
    """With the stiffnesses of a file, or of a table {joint: …}."""
    if not isinstance(stiffness, (str, Mapping)):
        raise SweepError(
            f"{sweep.file}: [base] stiffness = {stiffness!r}; expected the name of a file, or a table with axial, radial and tilting for each joint"
        )
    try:
        return stiff_by(model, stiffness if isinstance(stiffness, Mapping) else sweep.path(stiffness))[0]
    except ValueError as error:
        raise SweepError(f"{sweep.file}: [base] stiffness: {error}") from None


def _no_link(sweep: Sweep, p: Parameter, model: Model) -> None:
    try:
        model.link(str(p.link))
    except ValueError as error:
        raise SweepError(f"{sweep.file}: parameter {p.name}: {error}") from None


def _change(changed: dict[str, Array], model: Model, p: Parameter, value: float) -> None:
    """Changes the ten numbers of links, as parameters of the kinds payload, mass and center say."""
    for link in model.links if p.link is None else (model.link(p.link),):
        ten = changed.get(link.name)
        ten = np.array(link.parameters) if ten is None else ten
        if p.kind == "payload":
            ten = ten + point_mass(value, p.center)
        elif p.kind == "mass":
            ten = ten * value
        else:
            ten = shifted(ten, value * np.array(p.axis) / np.linalg.norm(p.axis))
        changed[link.name] = ten


def point_mass(mass: float, at: tuple[float, float, float]) -> Array:
    """The ten numbers of a point mass: m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the origin."""
    x, y, z = at
    return mass * np.array([1, x, y, z, y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y])


def shifted(ten: Array, by: Array) -> Array:
    """A body's ten numbers after it was moved by a vector (3), m, without turning (parallel axes, Steiner)."""
    mass, first = ten[0], ten[1:4]
    x, y, z = by
    # of -(m [c+s]² − m [c]²) = −([h][s] + [s][h] + m [s]²), [.] being the matrix of a cross product
    hx, hy, hz = 2 * first + mass * by
    cx, cy, cz = first + mass * by / 2
    inertia = np.array([hy * y + hz * z, -(cx * y + cy * x), hx * x + hz * z, -(cx * z + cz * x), -(cy * z + cz * y), hx * x + hy * y])
    return np.concatenate([[mass], first + mass * by, ten[4:] + inertia])


def _turned(vector: Array, axis: tuple[float, float, float], angle: float) -> Array:
    """A vector turned about an axis by an angle (Rodrigues)."""
    e = np.array(axis) / np.linalg.norm(axis)
    turned: Array = vector * math.cos(angle) + np.cross(e, vector) * math.sin(angle) + e * (e @ vector) * (1 - math.cos(angle))
    return turned


def _faster(motion: Motion, factor: float) -> Motion:
    """The motion along the same path in 1/factor of the time."""
    if factor == 1.0:
        return motion
    with np.errstate(over="ignore", invalid="ignore"):  # results that are not finite are refused
        slow = motion.resolution
        faster = None if slow is None else slow * factor
        times = {name: getattr(motion, name) / factor for name in ("time", "corner_times", "break_times")}
        return replace(motion, v=motion.v * factor, a=motion.a * factor * factor, resolution=faster, **times)
