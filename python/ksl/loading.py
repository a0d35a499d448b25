"""Models from robot files: the reader that a file's root element asks for."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal
from xml.etree import ElementTree

from ksl import _core, given
from ksl.errors import DescriptionError, DescriptionWarning
from ksl.model import Model
from ksl.requests import one_of, three_numbers


def load(
    path: str | bytes | os.PathLike[str] | os.PathLike[bytes],
    floating_base: bool = False,
    mimic: Literal["coupled", "independent"] = "coupled",
    strict: bool = False,
    gravity: Sequence[float] | None = None,
    payloads: Mapping[str, tuple[float, Sequence[float]]] | None = None,
    masses: Literal["optional"] | None = None,
    model: str | None = None,
    physics: str | Iterable[str] | None = None,
    friction_width: float = 0.01,
) -> Model:
    """Reads a robot file: URDF, SDF, or MJCF, which needs the extra `ksl[mjcf]`.  Its root element says which it is.

    floating_base: the root link floats; the first joint is then `floating_base` (`floating_root`, with a warning, if the
    file has a joint of that name).  SDF and MJCF files say themselves what floats: there it is an error if nothing does.
    mimic: a joint that mimics another is "coupled" to it: it has no numbers in q and v, and its position is multiplier ×
    the other's + offset; "independent" gives it a coordinate of its own.
    strict: an inertia that no rigid body can have, or a moving link with geometry and no mass, is an error instead of a
    :class:`DescriptionWarning`.
    gravity: in world axes, m/s²; None is that of an SDF or MJCF file that gives one, and (0, 0, −9.81) otherwise.
    payloads: {link name: (mass in kg, point in the link's frame in m)}: point masses fixed to links.
    masses: None refuses a robot none of whose moving links has a mass; "optional" accepts it, for kinematics.
    model: which model of an SDF file that has several; None is the only one that is not static.
    physics, friction_width: which physics of joints the model has, as :meth:`Model.with_physics` takes them; none by default.
    Raises :class:`DescriptionError`, which names file, line, link or joint, what is wrong and how to mend it.
    """
    one_of(mimic, "mimic", "coupled", "independent")
    if masses is not None:
        one_of(masses, "masses", "optional")
    floating_base, strict = given.flag(floating_base, "floating_base"), given.flag(strict, "strict")
    file, loads = os.fsdecode(path), given.payload_points(payloads)
    given_gravity = None if gravity is None else list(three_numbers(gravity, "gravity"))
    if _root_element(file) == "mujoco":
        from ksl import mjcf

        if model:
            raise DescriptionError(f'{file}: model "{model}" is asked for, but only SDF files hold several; leave that option out')
        loaded = mjcf._load(file, floating_base, mimic == "independent", strict, given_gravity, payloads, masses)
        if physics is not None or friction_width != loaded.friction_width:
            loaded = loaded.with_physics(physics, friction_width)
    else:
        options = (floating_base, mimic == "independent", strict, given_gravity, loads, masses is not None, model or "", given.physics(physics, friction_width))
        loaded = Model(_core.load(file, *options), (os.path.abspath(file), *options))
    for line in loaded.warnings:
        warnings.warn(line, DescriptionWarning, stacklevel=2)
    return loaded


def _root_element(file: str) -> str | None:
    """The name of a file's first element; None if it can't be read, which the reader then explains."""
    try:
        with open(file, "rb") as text:
            return next((element.tag for _, element in ElementTree.iterparse(text, events=("start",))), None)
    except (OSError, ElementTree.ParseError, ValueError, LookupError):
        return None
