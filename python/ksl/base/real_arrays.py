"""What counts as numbers where a function takes an array.  In one place, so that all functions refuse the same.

NumPy silently converts much to floats: dates to nanoseconds, texts to the numbers that they spell, complex numbers to their real
parts, and masked arrays to the numbers below the mask.  None of these were meant as numbers.
"""

from __future__ import annotations

from decimal import Decimal
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

_ELSEWHERE = (
    "which this call can't reach; m.compile([…], device='cuda') makes calls that do, or move it to the processor's memory: .cpu() in torch, .get() in CuPy"
)
_WORDS = {"M": "dates", "m": "durations", "S": "bytes", "U": "texts", "V": "records"}


class _NotNumbers(ValueError):
    """What an array holds instead."""


class _Complex(ValueError):
    """Complex numbers, of this type."""


def real_array(x: Any, what: str) -> NDArray[Any]:
    """An array of bool, integer or floating type, of any shape.  Raises ValueError for all else; what: its name in the message.

    Taken are lists, tuples, and arrays of any library with DLPack or NumPy's protocol; objects if each is a real number (Decimal, Fraction).
    """
    if type(x) is np.ndarray and x.dtype.kind == "f":  # as most are
        return x
    try:
        array = np.from_dlpack(x) if hasattr(x, "__dlpack__") and not hasattr(x, "__array__") else np.asarray(x)
        return _real(x, array)
    except _Complex as e:
        raise ValueError(f"{what} is complex ({e}); expected real numbers: .real takes the real parts") from None
    except _NotNumbers as e:
        raise ValueError(f"{what} holds {e}; expected numbers") from None
    except (TypeError, ValueError, BufferError, OverflowError, RecursionError, RuntimeError):
        if _is_differentiated(x):
            mend = "ksl.torch.differentiable(model) and ksl.jax.differentiable(model) have calls that differentiate"
            raise ValueError(f"{what} is differentiated or traced by torch or JAX, for which it would be a constant here; {mend}") from None
        if (device := getattr(x, "device", None)) is not None and "cpu" not in str(device).lower():
            raise ValueError(f"{what} is on {device}, {_ELSEWHERE}") from None
        if hasattr(x, "__cuda_array_interface__"):
            raise ValueError(f"{what} is on a card, {_ELSEWHERE}") from None
        shown = repr(x)
        shown = shown if len(shown) <= 60 and shown.isprintable() else type(x).__name__
        raise ValueError(f"{what} is {shown}; expected numbers, in an array or what can become one") from None


def _real(x: Any, array: NDArray[Any]) -> NDArray[Any]:
    if isinstance(x, np.ma.MaskedArray):
        raise _NotNumbers("a mask: .filled() or .compressed() take the numbers that are meant")
    if isinstance(x, (list, tuple)) and _has_masked(x):
        raise _NotNumbers("masked arrays: .filled() or .compressed() take the numbers that are meant")
    if array.dtype.kind in "fiub" and not isinstance(x, (bytes, bytearray)):
        return array
    if array.ndim == 0 and array.dtype.kind in "OSU" and not isinstance(x, (np.ndarray, Real, Decimal)):
        raise TypeError  # one text, or anything that is no array at all
    if array.dtype.kind == "O":
        others = [type(each).__name__ for each in array.flat if not isinstance(each, (Real, Decimal))]
        if others:
            raise _NotNumbers(f"objects ({others[0]})")
        return array.astype(float)
    if array.dtype.kind == "c":
        raise _Complex(array.dtype)
    raise _NotNumbers(_WORDS.get(array.dtype.kind, f"{array.dtype}"))


def _is_differentiated(x: Any) -> bool:
    """Is it, or does a list of it hold, a tensor that requires a gradient, or an array that JAX traces?"""
    if isinstance(x, (list, tuple)):
        return any(map(_is_differentiated, x))
    return getattr(x, "requires_grad", False) is True or any(each.__name__ == "Tracer" for each in type(x).__mro__)


def _has_masked(x: Any) -> bool:
    """Whether a list, or a list in its first rows, holds masked arrays."""
    return any(isinstance(each, np.ma.MaskedArray) or (k < 8 and isinstance(each, (list, tuple)) and _has_masked(each)) for k, each in enumerate(x))
