"""Motions that programs make: through waypoints, sweeps of frequency, and motions that excite inertial parameters."""

from ksl.motions.generate.excitation import excitation
from ksl.motions.generate.generated import Generated
from ksl.motions.generate.profiles import minimum_jerk, template, trapezoid
from ksl.motions.generate.sweep import chirp
from ksl.motions.generate.waypoints import Waypoints, read_waypoints
from ksl.motions.generate.writing import write_motion

__all__ = ["Generated", "Waypoints", "chirp", "excitation", "minimum_jerk", "read_waypoints", "template", "trapezoid", "write_motion"]
