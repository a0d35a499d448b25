"""Arrays that have DLPack's protocol and no array interface: what a capsule says.  (DLPack 0.8, dlpack.h.)"""

from __future__ import annotations

import ctypes
from math import prod
from typing import Any

from ksl.base.errors import ArgumentError

CUDA = 2
"""The kind of device that a card is."""
FLOATS = 2
"""The code of types that floating-point numbers have."""
DEFAULT_STREAM = 1
"""CUDA's legacy default stream, which waits for all others that don't say otherwise."""


class _Tensor(ctypes.Structure):
    _fields_ = (
        ("data", ctypes.c_void_p), ("device", ctypes.c_int32), ("number", ctypes.c_int32), ("axes", ctypes.c_int32), ("code", ctypes.c_uint8),
        ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16), ("shape", ctypes.POINTER(ctypes.c_int64)), ("strides", ctypes.POINTER(ctypes.c_int64)),
        ("offset", ctypes.c_uint64),
    )  # fmt: skip


_pointer_in = ctypes.pythonapi.PyCapsule_GetPointer
_pointer_in.argtypes, _pointer_in.restype = [ctypes.py_object, ctypes.c_char_p], ctypes.c_void_p


def described(x: Any) -> tuple[int, tuple[int, ...], tuple[int, ...], str, int, Any]:
    """Pointer, shape, strides in numbers, type, stream, and what owns the memory.  The library makes the numbers ready on the default stream."""
    capsule = x.__dlpack__(stream=DEFAULT_STREAM)  # frees its part when it is collected, since nobody takes it over
    tensor = ctypes.cast(_pointer_in(capsule, b"dltensor"), ctypes.POINTER(_Tensor)).contents
    if tensor.code != FLOATS or tensor.lanes != 1:
        raise ArgumentError(f"an array of {type(x).__name__} holds no floating-point numbers; expected float32 or float64")
    shape = tuple(tensor.shape[k] for k in range(tensor.axes))
    strides = tuple(tensor.strides[k] for k in range(tensor.axes)) if tensor.strides else tuple(prod(shape[k + 1 :]) for k in range(len(shape)))
    return (tensor.data or 0) + tensor.offset, shape, strides, f"<f{tensor.bits // 8}", DEFAULT_STREAM, (capsule, x)
