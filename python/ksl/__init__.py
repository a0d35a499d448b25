"""KSL: every wrench in a mechanism.

    import ksl
    m = ksl.load("robot.urdf")
    tau = m.inverse_dynamics(q, v, a)                        # (…, nv)
    held = m.reactions(q, v, a, part="constraint")           # (…, joints, 6): what the structure carries

SI units, radians; six-vectors are linear first unless `order="ang_lin"`; arrays have the state on the leading axes.
"""

from typing import TYPE_CHECKING

from ksl._core import __version__
from ksl.builder import Builder
from ksl.errors import DescriptionError, DescriptionWarning, FrameError, MotionError, QuaternionWarning
from ksl.loading import load
from ksl.mechanism import Joint, Link
from ksl.model import Model

if TYPE_CHECKING:
    from ksl.spatial import Acceleration, Inertia, Momentum, Pose, Twist, Wrench

__all__ = [
    "Acceleration",
    "Builder",
    "DescriptionError",
    "DescriptionWarning",
    "FrameError",
    "Inertia",
    "Joint",
    "Link",
    "Model",
    "Momentum",
    "MotionError",
    "Pose",
    "QuaternionWarning",
    "Twist",
    "Wrench",
    "__version__",
    "load",
]


def __getattr__(name: str) -> object:
    """Loads the spatial types when they are first used, since models don't need them."""
    if name in __all__:
        from ksl import spatial

        return getattr(spatial, name)
    raise AttributeError(f"module 'ksl' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
