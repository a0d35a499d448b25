"""Numbers that a program describes a mechanism with, checked and as lists for the compiled calls."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.real_arrays import real_array
from ksl.base.rotations import rotation_of_quaternion, rotation_of_rpy
from ksl.mechanism.requests import three_numbers

Mass = tuple[float, list[float], list[float]]
"""Mass, centre of mass, inertia about it by rows."""

Physics = tuple[list[str], float]
"""Names of the physics of joints, and the width of friction."""

Loop = tuple[str, str, str, str, list[float], list[float], list[float] | None, list[float] | None, float | None]
"""A joint that closes a loop: name, kind, predecessor, successor, its frames on both by rows, axis, axis2, pitch."""

ForceElement = tuple[str, str, str, list[float], list[float], list[float], list[float | None], float]
"""A force element: name, links, points on both; stiffness, free length, damping, preload; limits; stop stiffness."""


@runtime_checkable
class TypedPose(Protocol):
    """A :class:`ksl.Pose`, whose module imports more than models need."""

    def array_in(self, to: str | None = None) -> np.ndarray: ...


PoseLike = ArrayLike | TypedPose
"""A matrix (4, 4), or a :class:`ksl.Pose`."""
OF_LINKS = {"external": (6, "force, then moment"), "parameters": (10, "m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz")}
"""What calls are given of links besides their inputs, {link: (…, numbers)}: how many numbers, and which; in the order of generated kernels."""


def number(x: Any, what: str) -> float:
    if type(x) is float:  # as most are
        return x
    if isinstance(x, (str, bytes, bytearray, complex, np.complexfloating, np.ma.core.MaskedConstant, np.datetime64, np.timedelta64)):
        raise ValueError(f"{what} is {x!r}; expected a number")
    try:
        return float(x)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{what} is {x!r}; expected a number") from None


def threads(x: object) -> int:
    """How many threads at most; 0 is all cores.  As the compiled calls take it."""
    most = 0 if x is None else int(x) if isinstance(x, (int, np.integer)) and is_index(x) else -1
    if most < 0:
        raise ValueError(f"threads={x!r}; expected how many threads to use at most, or None or 0 for all cores")
    return min(most, 1 << 30)


def is_index(x: object) -> bool:
    """Whether it is a whole number, and no truth value."""
    return isinstance(x, (int, np.integer)) and not isinstance(x, bool)


def name(x: object, what: str) -> str:
    if not isinstance(x, str) or (not x.isascii() and any("\ud800" <= character <= "\udfff" for character in x)):  # halves of surrogate pairs are no text
        raise ValueError(f"{what} is {x!r}; expected a name")
    return x


def flag(x: object, what: str) -> bool:
    if not isinstance(x, (bool, np.bool_)):
        raise ValueError(f"{what}={x!r}; expected True or False")
    return bool(x)


def mapping(x: Any, what: str, of: str) -> list[tuple[Any, Any]]:
    """The items of a mapping.  Raises ValueError for what is none."""
    if not hasattr(x, "items"):
        raise ValueError(f"{what} is {type(x).__name__}; expected a mapping {of}")
    return list(x.items())


def numbers(x: ArrayLike, what: str) -> np.ndarray:
    """An array of any shape."""
    return np.asarray(real_array(x, what), dtype=float)


def array(x: ArrayLike, shape: tuple[int, ...], what: str) -> np.ndarray:
    found = numbers(x, what)
    if found.shape != shape:
        raise ValueError(f"{what} has shape {found.shape}; expected {shape}")
    return found


def pose(x: PoseLike | None, what: str, to: str | None = None) -> list[float]:
    """A (4, 4) matrix by rows, the identity for None.  The compiled code checks that it is rigid.  to: the frame that a :class:`ksl.Pose` must be in."""
    if not isinstance(x, np.ndarray) and isinstance(x, TypedPose):  # a protocol, which takes long to be asked for
        x = x.array_in(to)
    if x is None:
        return [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    matrix = array(x, (4, 4), what)
    if not (matrix[3] == (0.0, 0.0, 0.0, 1.0)).all():
        raise ValueError(f"{what}: its last row is {matrix[3].tolist()}; a pose has 0 0 0 1 there")
    found: list[float] = matrix.ravel().tolist()
    return found


def mass(of: str, kilograms: float, center_of_mass: ArrayLike, inertia: ArrayLike | None) -> Mass:
    """The mass of a link or a payload, with centre and inertia.  `inertia` None is that of a point mass.  The compiled code checks that a body can have it."""
    tensor = np.zeros((3, 3)) if inertia is None else array(inertia, (3, 3), f"{of}: its inertia")
    center = three_numbers(center_of_mass, f"{of}: its centre of mass")
    return number(kilograms, f"{of}: its mass"), list(center), tensor.ravel().tolist()


def pose_of(what: str, pose: PoseLike | None, xyz: ArrayLike | None, rpy: ArrayLike | None, quaternion: ArrayLike | None) -> PoseLike | None:
    """The pose that is given as a matrix or :class:`ksl.Pose`, or by its translation with angles or a quaternion."""
    given_too = [name for name, x in (("xyz", xyz), ("rpy", rpy), ("quaternion", quaternion)) if x is not None]
    if not given_too:
        return pose
    if pose is not None or (rpy is not None and quaternion is not None):
        both = ["pose", *given_too] if pose is not None else given_too
        raise ValueError(f"{what} is given twice: {' and '.join(both)}; give pose, or xyz with rpy or quaternion")
    matrix = np.eye(4)
    matrix[:3, 3] = three_numbers(xyz, f"{what}: xyz") if xyz is not None else 0.0
    if rpy is not None:
        matrix[:3, :3] = rotation_of_rpy(np.array(three_numbers(rpy, f"{what}: rpy")))
    elif quaternion is not None:
        numbers_given = array(quaternion, (4,), f"{what}: quaternion")
        try:
            matrix[:3, :3] = rotation_of_quaternion(numbers_given)
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None
    return matrix


Drives = str | Iterable[str] | Mapping[str, float]
"""Names of joints that have a motor, or {name: weight}: of the squares of efforts, where drives are more than the freedoms."""


def drives(given: Any) -> tuple[list[str], list[float]]:
    """Names and weights; no weights if none are given."""
    if not isinstance(given, Mapping):
        return names(given, "drives"), []
    return names(list(given), "drives"), [number(weight, f"drive {joint}: its weight") for joint, weight in given.items()]


def names(x: str | Iterable[str], what: str) -> list[str]:
    """A list of names; one name stands for itself."""
    if not isinstance(x, (str, Iterable)):
        raise ValueError(f"{what}={x!r}; expected a list of names")
    one = f"one of {what}"
    return [name(word, one) for word in ([x] if isinstance(x, str) else x)]


def direction(x: ArrayLike | None, what: str) -> list[float] | None:
    return None if x is None else list(three_numbers(x, what))


def loop(
    name_of: object, kind: object, predecessor: object, successor: object,
    predecessor_pose: PoseLike | None, successor_pose: PoseLike | None, axis: ArrayLike | None, axis2: ArrayLike | None, pitch: float | None,
) -> Loop:  # fmt: skip
    """A joint that closes a loop.  The compiled code checks kind and links, and that nothing is missing which the kind needs."""
    own = name(name_of, "the name of the loop joint")
    who = f"loop joint {own}"
    words = [name(word, f"{who}: its {what}") for word, what in ((kind, "kind"), (predecessor, "predecessor"), (successor, "successor"))]
    sides = ((predecessor_pose, "predecessor", words[1]), (successor_pose, "successor", words[2]))
    poses = [pose(x, f"{who}: its frame on the {what}", link) for x, what, link in sides]
    axes = [direction(x, f"{who}: its {what}") for x, what in ((axis, "axis"), (axis2, "axis2"))]
    return own, words[0], words[1], words[2], poses[0], poses[1], axes[0], axes[1], None if pitch is None else number(pitch, f"{who}: its pitch")


def force_element(
    name_of: object, link1: object, point1: ArrayLike, link2: object, point2: ArrayLike,
    stiffness: float, free_length: float, damping: float, preload: float, limits: Sequence[float | None] | None, stop_stiffness: float,
) -> ForceElement:  # fmt: skip
    """A spring, damper or cylinder between two points.  The compiled code checks its links and its numbers."""
    own = name(name_of, "the name of the force element")
    who = f"force element {own}"
    links = [name(word, f"{who}: its {what}") for word, what in ((link1, "link1"), (link2, "link2"))]
    points = [list(three_numbers(x, f"{who}: its {what}")) for x, what in ((point1, "point1"), (point2, "point2"))]
    numbers = {"stiffness": stiffness, "free length": free_length, "damping": damping, "preload": preload}
    both = [None, None] if limits is None else list(limits) if isinstance(limits, Iterable) else []
    if len(both) != 2:
        raise ValueError(f"{who}: its limits are {limits!r}; expected (lower, upper), m, each may be None")
    bounds = [None if x is None else number(x, f"{who}: its limits") for x in both]
    plain = [number(x, f"{who}: its {what}") for what, x in numbers.items()]
    return own, links[0], links[1], points[0], points[1], plain, bounds, number(stop_stiffness, f"{who}: its stop stiffness")


def physics(names: str | Iterable[str] | None, friction_width: float) -> Physics:
    """Names of the physics of joints.  The compiled code refuses unknown ones, and a width that is no speed."""
    if names is not None and not isinstance(names, (str, Iterable)):
        raise ValueError(f"physics={names!r}: expected names, for example ('damping', 'friction'), or 'all'")
    given = [] if names is None else [names] if isinstance(names, str) else list(names)
    for word in given:
        if not isinstance(word, str) or not word.isascii():
            raise ValueError(f"physics={names!r}: expected names, for example ('damping', 'friction'), or 'all'")
    return given, number(friction_width, "friction_width")


def payload_points(payloads: Mapping[str, tuple[float, Sequence[float]]] | None) -> list[tuple[str, float, list[float]]]:
    """Point masses {link: (mass, point)}."""
    given = [] if payloads is None else mapping(payloads, "payloads", "{link: (mass in kg, (x, y, z) in the link's frame in m)}")
    return [_payload(link, load) for link, load in given]


def _payload(link: str, load: tuple[float, Sequence[float]]) -> tuple[str, float, list[float]]:
    name(link, "the link of a payload")
    try:
        kilograms, point = load
        kilograms = number(kilograms, "mass")
    except (TypeError, ValueError):
        raise ValueError(f"payload on {link}: found {load!r}; expected (mass in kg, (x, y, z) in the link's frame in m)") from None
    if not (math.isfinite(kilograms) and kilograms >= 0):
        raise ValueError(f"payload on {link}: mass {kilograms} kg; expected a number that is not negative")
    return link, kilograms, list(three_numbers(point, f"payload on {link}: payload point"))
