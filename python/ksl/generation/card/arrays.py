"""Arrays in a card's memory: where their numbers are, whoever made them, and memory for results.

Nothing here copies numbers to or from a card, and nothing waits for one.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

from ksl.base.errors import ArgumentError
from ksl.generation.card.dlpack import CUDA, described
from ksl.generation.card.driver import Driver

TYPES = {"<f8": "double", "<f4": "float"}
"""Precision of numbers, as the array interface writes them."""

NUMPY = {"double": "float64", "float": "float32"}
NAMES_STREAMS = 3
"""The version of the array interface since which arrays name a stream.  Of older ones nobody knows when they are ready, and DLPack is asked."""
LEGACY_STREAM = 1
"""What arrays call the default stream, which torch has as 0."""


@dataclass(slots=True)
class CardArray:
    """An array on a card."""

    pointer: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    """In numbers."""
    scalar: str
    """"double" or "float"."""
    card: int
    stream: int | None
    """Where its numbers will be ready, as the driver has streams; None where they are already."""
    of: Any
    """What it was given as: it owns the memory."""


def card_of_tensor(x: Any) -> int | None:
    """The card that a tensor of torch is on; None for other memory."""
    return x.get_device() if x.is_cuda else None


def is_tensor(x: Any) -> bool:
    """Is it a tensor of torch, which is not imported for it?"""
    torch = sys.modules.get("torch")
    return torch is not None and isinstance(x, torch.Tensor)


def is_on_card(x: Any) -> bool:
    """Is it an array on a card?  Cheap for what is none."""
    if isinstance(x, (float, int, np.ndarray, list, tuple)):
        return False
    if is_tensor(x):
        return card_of_tensor(x) is not None
    return hasattr(x, "__cuda_array_interface__") or (hasattr(x, "__dlpack_device__") and x.__dlpack_device__()[0] == CUDA)


def key_of_tensors(given: Sequence[Any]) -> tuple[Any, ...] | None:
    """What checks of plain tensors depend on; None where one is something else."""
    torch = sys.modules.get("torch")
    if torch is None:
        return None
    key: list[Any] = []
    for x in given:
        if type(x) is not torch.Tensor or x.layout is not torch.strided or x.is_neg() or (x.requires_grad and torch.is_grad_enabled()):
            return None
        key += (x.dtype, x.device, x.shape, x.stride())
    return tuple(key)


def array_of(x: Any, what: str, driver: Driver) -> CardArray:
    """Raises ArgumentError for what isn't on a card, is differentiated, or holds other numbers than float32 and float64."""
    if is_tensor(x):
        return _of_tensor(x, what)
    interface = getattr(x, "__cuda_array_interface__", None)
    if interface is not None and (interface.get("version", 0) >= NAMES_STREAMS or not hasattr(x, "__dlpack__")):
        pointer, shape, strides, typestr, stream = _of_interface(interface, what)
    elif is_on_card(x):
        pointer, shape, strides, typestr, stream, x = described(x)
    else:
        raise ArgumentError(f"{what} is in the processor's memory, and other arguments are on a card; move all to one place")
    if typestr not in TYPES:
        raise ArgumentError(f"{what} holds numbers of type {typestr}; expected float32 or float64")
    card = driver.card_of(pointer) if prod(shape) else 0
    if card is None:
        raise ArgumentError(f"{what} says that it is on a card, and its memory isn't")
    return CardArray(pointer, shape, strides, TYPES[typestr], card, stream, x)


def _of_tensor(x: Any, what: str) -> CardArray:
    torch = sys.modules["torch"]
    card = card_of_tensor(x)
    if card is None:
        raise ArgumentError(f"{what} is on {x.device}, and other arguments are on a card; move it by .to('cuda')")
    if x.dtype is not torch.float32 and x.dtype is not torch.float64:
        raise ArgumentError(f"{what} holds numbers of type {x.dtype}; expected torch.float32 or torch.float64")
    if x.requires_grad and torch.is_grad_enabled():
        raise ArgumentError(
            f"{what} is differentiated by torch, for which it would be a constant here; ksl.torch.differentiable(model) has calls that differentiate, and .detach() gives the numbers"
        )
    if x.layout is not torch.strided:
        raise ArgumentError(f"{what} is a tensor of {x.layout}; expected a dense one, by .to_dense()")
    if x.is_neg():
        x = x.resolve_neg()
    try:
        pointer = x.data_ptr()
    except RuntimeError:
        raise ArgumentError(f"{what} is mapped or traced by torch, and has no numbers yet; ksl.torch.differentiable(model) has calls for it") from None
    return CardArray(pointer, tuple(x.shape), x.stride(), "float" if x.dtype is torch.float32 else "double", card, None, x)


def _of_interface(interface: Mapping[str, Any], what: str) -> tuple[int, tuple[int, ...], tuple[int, ...], str, int | None]:
    """Pointer, shape, strides in numbers, type and stream of an array interface, version 3 or older.  Raises ArgumentError for strides of parts of a number."""
    shape, typestr, strides = tuple(interface["shape"]), interface["typestr"], interface.get("strides")
    size = max(int(typestr[2:]), 1)
    if strides is not None and any(s % size for s in strides):
        raise ArgumentError(f"{what} has strides of {tuple(strides)} bytes, which are not whole numbers of {size} bytes; give a C-contiguous array")
    return interface["data"][0] or 0, shape, c_strides(shape) if strides is None else tuple(s // size for s in strides), typestr, interface.get("stream")


def c_strides(shape: Sequence[int]) -> tuple[int, ...]:
    """Strides of an array whose numbers lie one behind the other."""
    return tuple(prod(shape[k + 1 :]) for k in range(len(shape)))


def is_contiguous(array: CardArray) -> bool:
    """Do its numbers lie one behind the other?"""
    return prod(array.shape) == 0 or all(size == 1 or own == c for size, own, c in zip(array.shape, array.strides, c_strides(array.shape)))


def row_stride(array: CardArray, leading: tuple[int, ...], width: int) -> int | None:
    """Numbers from row to row of an array (…, width) that stands for rows (leading, width); 0 for one row for all, None where rows aren't at equal distances."""
    if width > 1 and array.strides[-1] != 1:
        return None
    own = len(array.shape) - 1
    step, rows = None, 1
    for k in range(1, len(leading) + 1):
        size = leading[-k]
        if size == 1:
            continue
        stride = array.strides[own - k] if k <= own and array.shape[own - k] != 1 else 0
        if step is None:
            step = stride
        elif stride != step * rows:
            return None
        rows *= size
    return step or 0


def copied(array: CardArray, leading: tuple[int, ...], width: int, what: str) -> CardArray:
    """An array with its rows one behind the other.  torch copies, on its stream; of other libraries' arrays this is asked for."""
    if not is_tensor(array.of):
        raise ArgumentError(f"{what}: rows of shape {array.shape} with strides {array.strides} aren't at equal distances; give a C-contiguous array")
    whole = array.of.expand(*leading, width).contiguous()
    return CardArray(whole.data_ptr(), tuple(whole.shape), whole.stride(), array.scalar, array.card, None, whole)


def concatenated(arrays: Sequence[CardArray], leading: tuple[int, ...], what: str) -> CardArray:
    """Arrays (…, numbers) behind each other in one (leading, all numbers)."""
    first = arrays[0]
    shapes = [(*leading, array.shape[-1]) for array in arrays]
    if all(is_tensor(array.of) for array in arrays):
        whole = sys.modules["torch"].cat([array.of.expand(shape) for array, shape in zip(arrays, shapes)], dim=-1)
    elif (concatenate := _function(first.of, "concatenate")) is None or (broadcast_to := _function(first.of, "broadcast_to")) is None:
        raise ArgumentError(f"{what}: what several links are given is joined by torch or CuPy; compile for one link, or give arrays of these")
    else:
        whole = concatenate([broadcast_to(array.of, shape) for array, shape in zip(arrays, shapes)], axis=-1)
    shape = (*leading, sum(array.shape[-1] for array in arrays))
    pointer = whole.data_ptr() if is_tensor(whole) else _pointer(whole)
    return CardArray(pointer, shape, c_strides(shape), first.scalar, first.card, first.stream, whole)


def filled(number: float, width: int, like: CardArray) -> CardArray:
    """One row of a number, for arguments that stand for each coordinate."""
    if not is_tensor(like.of):
        if (full_like := _function(like.of, "full_like")) is None:
            raise ArgumentError("one number stands for each coordinate in calls with arrays of torch and CuPy; give an array on the card")
        return CardArray(_pointer(row := full_like(like.of, number, shape=(width,))), (width,), (1,), like.scalar, like.card, None, row)
    row = like.of.new_full((width,), number)
    return CardArray(row.data_ptr(), (width,), (1,), like.scalar, like.card, None, row)


def empty(shape: tuple[int, ...], like: CardArray, call: str) -> Any:
    """Memory for a result, of the library of an argument and on its card."""
    if is_tensor(like.of):
        return like.of.new_empty(shape)
    if (empty_like := _function(like.of, "empty_like")) is None:
        of_jax = "; ksl.jax.differentiable(model) has the calls for arrays of JAX" if type(like.of).__module__.partition(".")[0] in ("jax", "jaxlib") else ""
        raise ArgumentError(f"{call}: out is missing; results of {type(like.of).__name__} need an array on the card that takes them, of shape {shape}{of_jax}")
    return empty_like(like.of, shape=shape)


def _function(x: Any, name: str) -> Any:
    """A function of the library of an array, as CuPy has NumPy's."""
    library = type(x).__module__.partition(".")[0]
    return getattr(sys.modules.get(library), name, None)


def _pointer(x: Any) -> int:
    return int(x.__cuda_array_interface__["data"][0])


def stream_of_torch(card: int) -> int:
    return int(sys.modules["torch"].cuda.current_stream(card).cuda_stream)


def is_read_only(x: Any) -> bool:
    """Does it say that nobody may write to it?"""
    interface = None if is_tensor(x) else getattr(x, "__cuda_array_interface__", None)
    return interface is not None and bool(interface["data"][1])


def stream_of(arrays: Sequence[tuple[str, CardArray]], call: str) -> int:
    """The stream that the caller's library works on now: torch's own, or that which arrays name; the default one if none does.

    Raises ArgumentError where arrays, results among them, are worked on in several."""
    named = {array.stream: what for what, array in arrays if array.stream}
    tensor = next((what for what, array in arrays if is_tensor(array.of)), None)
    own = None if tensor is None else stream_of_torch(arrays[0][1].card)
    if own is not None and tensor is not None:
        named = {own or LEGACY_STREAM: tensor} | {stream: what for stream, what in named.items() if stream != (own or LEGACY_STREAM)}
    if len(named) > 1:
        raise ArgumentError(f"{call}: {' and '.join(named.values())} are worked on in different streams; make them ready in one")
    return own if own is not None else next(iter(named), 0)
