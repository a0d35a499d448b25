"""Types of arguments, and their conversion to arrays that the compiled calls can read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating]
External = Mapping[str, ArrayLike]
ExternalAxes = Literal["link", "world"]
Side = Literal["child", "parent"]
Order = Literal["lin_ang", "ang_lin"]
Expressed = Literal["frame", "world"]
Acceleration = Literal["spatial", "classical", "rate"]
Part = Literal["total", "constraint", "actuation", "coupling"]
Point = str | Sequence[float]
"""'joint', 'world', a link's name, or three numbers: an offset from the joint's origin in the joint's axes, m."""


class InWorldAxes:
    """External wrenches in the axes of the world."""

    def __init__(self, external: External) -> None:
        self.wrenches = external


def external_in(external: Any, axes: str) -> Any:
    """External wrenches with the axes that they are given in, as the compiled calls take them."""
    if axes not in ("link", "world"):
        raise ValueError(f"external_axes={axes!r}; expected one of 'link', 'world'")
    return external if external is None or axes == "link" else InWorldAxes(external)


def as_arrays(inputs: list[ArrayLike], external: Any) -> tuple[list[NDArray[Any]], dict[str, NDArray[Any]], bool]:
    """Converts arguments to NumPy arrays of any type; the compiled calls check them.  The last says whether wrenches are in world axes."""
    in_world = isinstance(external, InWorldAxes)
    items = items_of(external.wrenches if in_world else external)
    return [_array(x) for x in inputs], {name: _array(wrench) for name, wrench in items}, in_world


def items_of(external: External | None) -> list[tuple[str, ArrayLike]]:
    """Links' names and their wrenches.  Raises ValueError for what is no mapping."""
    if external is None:
        return []
    if not hasattr(external, "items"):
        raise ValueError(f"external is {type(external).__name__}; expected a mapping {{link name: (…, 6)}}, force first")
    return list(external.items())


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
    return _array(x)[..., np.newaxis]


def _array(x: Any) -> NDArray[Any]:
    """Converts x to a NumPy array; `np.asarray` doesn't recognise objects that support only DLPack."""
    return np.from_dlpack(x) if hasattr(x, "__dlpack__") and not hasattr(x, "__array__") else np.asarray(x)
