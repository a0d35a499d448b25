"""The results of `ksl actuation`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ksl.base.files_read import InputFile
from ksl.drivetrain.actuation import Actuation
from ksl.drivetrain.judged_limits import JudgedLimit
from ksl.drivetrain.serial import SerialErrors
from ksl.mechanism.states import Array
from ksl.model.model import Model


@dataclass(frozen=True)
class JointCurves:
    """The map along one joint, the others at the place that is looked at."""

    joint: str
    unit: str
    q: Array
    """(n, joints), of which this joint's column increases."""
    motors: Array
    """(n, motors), rad or m."""
    ratios: Array
    """(n, motors): motors' velocities for one of this joint."""
    effort: Array | None
    """(n) of this joint alone, and of the largest box; None without limits of the motors, as what follows."""
    effort_box: Array | None
    velocity: Array | None
    velocity_box: Array | None
    rotors: Array
    """(n): what rotors feel like at the joint, kg m² or kg."""
    rods: Array
    distance: Array
    """(n): det of motors' rates by joints' rates, relative to that at the place: 0 where motors hold nothing, large near the end of reach."""


@dataclass(frozen=True)
class MotionThrough:
    """A motion of the joints, and what it needs of motors and rods."""

    time: Array
    motors: Array
    """(n, motors) positions, then velocities."""
    speeds: Array
    efforts: Array
    """(n, motors), rotors included."""
    static: Array
    """(n, motors): what a static map of the serial model's efforts says."""
    forces: Array
    """(n, loops), N."""
    errors: SerialErrors
    doubts: tuple[str, ...] = ()
    """Why the motion's numbers may be wrong, as `Motion.doubts` says it."""


@dataclass(frozen=True)
class ActuationResults:
    """What `ksl actuation` computes."""

    actuation: Actuation
    at: Array
    """(joints): the place that curves go through, and at which the serial model is exact."""
    curves: Sequence[JointCurves]
    limits: Sequence[JudgedLimit]
    serial: Model
    errors: SerialErrors
    """Efforts of the serial model over the range."""
    motion: MotionThrough | None
    inputs: Sequence[InputFile]
    command: str = ""
