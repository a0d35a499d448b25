"""Types of arguments, and their conversion to arrays that the compiled calls can read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ksl.base.errors import near_names
from ksl.base.real_arrays import real_array
from ksl.mechanism.joint_columns import Endings, KindNames, by_name, column_names, endings_of

Array = NDArray[np.floating]


class OnLink(Protocol):
    """A wrench that knows its frame: :class:`ksl.Wrench`."""

    def on_link(self, link: str, axes: str) -> Array:
        """The wrench's numbers (…, 6) on a link, force first, in the axes of "link" or "world".  Raises FrameError."""


External = Mapping[str, ArrayLike | OnLink]
ExternalAxes = Literal["link", "world"]
Side = Literal["child", "parent"]
Order = Literal["lin_ang", "ang_lin"]
Expressed = Literal["frame", "world"]
Acceleration = Literal["spatial", "classical", "rate"]
Triangle = Literal["both", "upper"]
Undetermined = Literal["refuse", "nan"]
"""What derivatives of reactions give for components that rigid bodies leave open: an error, or NaN."""
Part = Literal["total", "constraint", "actuation", "coupling"]
EFFORT_PARTS = ("transmitted", "damping", "friction", "rotor", "spring")
"""What the efforts of motors consist of, in the order of `Model.effort_parts`."""
Point = str | Sequence[float]
"""'joint', 'world', a link's name, or three numbers: an offset from the joint's origin in the joint's axes, m."""
JOINT_AND = "joint + "
"""How the words of a point begin that is given by its offset from the joint's origin, in the joint's axes, m."""


_ENDINGS: dict[str, Endings] = {}
"""Endings of names for each kind of joint, taken from the first model that is asked."""


class InWorldAxes:
    """External wrenches in the axes of the world."""

    def __init__(self, external: External) -> None:
        self.wrenches = external


def external_in(external: Any, axes: str) -> Any:
    """External wrenches with the axes that they are given in, as the compiled calls take them."""
    if not isinstance(axes, str) or axes not in ("link", "world"):
        raise ValueError(f"external_axes={axes!r}; {near_names(axes, ('link', 'world'))}expected one of 'link', 'world'")
    return external if external is None or axes == "link" else InWorldAxes(external)


def as_arrays(
    inputs: list[ArrayLike], roles: list[tuple[str, int]], model: HasJoints, external: Any
) -> tuple[list[NDArray[Any]], dict[str, NDArray[Any]], bool]:
    """Converts arguments to NumPy arrays of any type; the compiled calls check them.

    roles: of each input its name, "q" say, and how many numbers it has for each state.  The last of the results says whether wrenches
    are in world axes.
    """
    in_world = isinstance(external, InWorldAxes)
    items = items_of(external.wrenches if in_world else external, "world" if in_world else "link")
    arrays = [argument(x, name, columns, model) for x, (name, columns) in zip(inputs, roles)]
    wrenches = {link: real_array(wrench, f"external[{link!r}]") for link, wrench in items}
    are_plain = [type(x) in (int, float) for x in inputs]  # they have no precision of their own, as NumPy has it
    others = [x for x, is_plain in zip(arrays, are_plain) if not is_plain] + list(wrenches.values())
    if others and all(x.dtype == np.float32 for x in others):
        arrays = [x.astype(np.float32) if is_plain else x for x, is_plain in zip(arrays, are_plain)]
    return arrays, wrenches, in_world


class NamedKind(KindNames, Protocol):
    """A kind of joint with its name."""

    @property
    def name(self) -> str: ...


class HasJoints(Protocol):
    """What is asked of a compiled model: its joints, how many of them move, and the kinds of joints."""

    @property
    def joints(self) -> Sequence[Mapping[str, Any]]: ...
    @property
    def moving_joints(self) -> int: ...
    @property
    def joint_kinds(self) -> Sequence[NamedKind]: ...


def argument(x: Any, name: str, columns: int, model: HasJoints) -> NDArray[Any]:
    """An argument as an array: a table by the names of its columns, one number as one for each coordinate, others as they are."""
    array = real_array(in_order(x, name, model), name)
    return np.full(columns, array) if array.ndim == 0 and array.dtype.kind in "fiu" else array


def argument_rows(x: Any, name: str, columns: int, model: HasJoints) -> Array:
    """An argument as doubles (…, columns), all of them finite.  Raises ValueError that names the number or the shape."""
    return finite_rows(argument(x, name, columns, model), name, columns)


def finite_rows(x: ArrayLike, name: str, columns: int) -> Array:
    """Real numbers as doubles (…, columns), all of them finite.  Raises ValueError that names the number or the shape."""
    array: Array = np.asarray(real_array(x, name), dtype=float)
    if array.ndim == 0 or array.shape[-1] != columns:
        raise ValueError(f"{name} has shape {array.shape}; expected (…, {columns})")
    if not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0].tolist()
        raise ValueError(f"{name}{where} is {array[tuple(where)]}; every number must be finite")
    return array


def leading_shape(arrays: Mapping[str, Array]) -> tuple[int, ...]:
    """The leading shape that arguments (…, numbers) have in common.  Raises ValueError where they don't broadcast."""
    try:
        return np.broadcast_shapes(*(array.shape[:-1] for array in arrays.values()))
    except ValueError:
        found = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise ValueError(f"leading shapes don't broadcast: {found}") from None


def in_order(x: Any, name: str, model: HasJoints) -> Any:
    """A table by the names of its columns as an array; what is none as it is."""
    names = column_names(x)
    if names is None:
        return x
    if not _ENDINGS:
        _ENDINGS.update((kind.name, endings_of(kind)) for kind in model.joint_kinds)
    return by_name(x, names, name, [(joint["name"], _ENDINGS[joint["kind"]]) for joint in model.joints[: model.moving_joints]])


def items_of(external: External | None, axes: str = "link") -> list[tuple[str, ArrayLike]]:
    """Links' names and the numbers of their wrenches.  Raises ValueError for what is no mapping."""
    if external is None:
        return []
    if not hasattr(external, "items"):
        raise ValueError(f"external is {type(external).__name__}; expected a mapping {{link name: (…, 6)}}, force first, or {{link name: ksl.Wrench}}")
    return [(link, wrench.on_link(link, axes) if hasattr(wrench, "on_link") else wrench) for link, wrench in external.items()]


def as_rows(inputs: list[NDArray[Any]], wrenches: list[NDArray[Any]], leading: tuple[int, ...]) -> tuple[list[Array], list[Array]]:
    """Arrays in their full leading shape, contiguous and of one precision: float32 if all are, otherwise float64.

    Wrenches are always copied, since a result may be written into their memory.
    """
    single = all(x.dtype.newbyteorder("=") == np.float32 for x in (*inputs, *wrenches))
    dtype = np.float32 if single else np.float64
    rows = [np.require(np.broadcast_to(x, (*leading, x.shape[-1])), dtype, ["C", "A"]) for x in inputs]
    return rows, [np.array(np.broadcast_to(w, (*leading, 6)), dtype, order="C") for w in wrenches]


def numbers(x: ArrayLike) -> NDArray[Any]:
    """Numbers (…), one for each state, as rows (…, 1)."""
    return real_array(x, "fraction")[..., np.newaxis]


def offset_in(point: str) -> list[float] | None:
    """The offset that the words of a point say, m; None for origins of joints, links and the world.  Raises ValueError for what is no number."""
    return [float(x) for x in point.removeprefix(JOINT_AND).split()] if point.startswith(JOINT_AND) else None
