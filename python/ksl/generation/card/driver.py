"""The driver of graphics cards (CUDA's libcuda), by ctypes: the calls that compiled kernels need, and what errors mean.

A card's primary context is that of torch, CuPy and JAX, too, so that their arrays and streams serve.
"""

from __future__ import annotations

import ctypes
import sys
import threading
from ctypes import POINTER, byref, c_char_p, c_int, c_size_t, c_uint, c_void_p
from functools import cache
from typing import Any

from ksl.base.errors import CompilerError

LIBRARIES = ("nvcuda.dll",) if sys.platform == "win32" else ("libcuda.so.1", "libcuda.so")
"""What the driver brings; no package does."""
OLDEST = 12000
"""The oldest driver, as it counts: 1000 major + 10 minor of the newest CUDA that it serves."""

COMPUTE_MAJOR, COMPUTE_MINOR, MULTIPROCESSORS = 75, 76, 16
"""Attributes of a card: its architecture, and how many multiprocessors it has."""
MEMORY_TYPE, DEVICE_ORDINAL = 2, 9
"""Attributes of a pointer."""
ON_DEVICE = 2
"""The value of MEMORY_TYPE of the card's memory."""

_FUNCTIONS: dict[str, list[Any]] = {
    "cuInit": [c_uint],
    "cuDriverGetVersion": [POINTER(c_int)],
    "cuGetErrorName": [c_int, POINTER(c_char_p)],
    "cuGetErrorString": [c_int, POINTER(c_char_p)],
    "cuDeviceGetCount": [POINTER(c_int)],
    "cuDeviceGet": [POINTER(c_int), c_int],
    "cuDeviceGetName": [c_char_p, c_int, c_int],
    "cuDeviceGetAttribute": [POINTER(c_int), c_int, c_int],
    "cuDevicePrimaryCtxRetain": [POINTER(c_void_p), c_int],
    "cuCtxGetCurrent": [POINTER(c_void_p)],
    "cuCtxPushCurrent_v2": [c_void_p],
    "cuCtxPopCurrent_v2": [POINTER(c_void_p)],
    "cuModuleLoadData": [POINTER(c_void_p), c_char_p],
    "cuModuleGetFunction": [POINTER(c_void_p), c_void_p, c_char_p],
    "cuFuncGetAttribute": [POINTER(c_int), c_int, c_void_p],
    "cuStreamGetCtx": [c_void_p, POINTER(c_void_p)],
    "cuOccupancyMaxPotentialBlockSize": [POINTER(c_int), POINTER(c_int), c_void_p, c_void_p, c_size_t, c_int],
    "cuPointerGetAttribute": [c_void_p, c_int, c_void_p],
    "cuLaunchKernel": [c_void_p, *[c_uint] * 7, c_void_p, c_void_p, c_void_p],
}
"""Types of arguments; all return a code, 0 for success."""

_MENDS = {
    2: "the card's memory is full; free arrays, or call with fewer states",
    3: "the driver isn't initialised in this process, which was forked after it was; start workers by multiprocessing's method 'spawn'",
    100: "there is no card that the driver can use; `nvidia-smi` shows those there are, and CUDA_VISIBLE_DEVICES may hide them",
    200: "the code isn't for this card; empty the cache that the variable KSL_CACHE names, and compile again",
    209: "the code isn't for this card; empty the cache that the variable KSL_CACHE names, and compile again",
    400: "a stream or a kernel is of another card, or is gone; call on a stream of the card that the arrays are on",
    700: "an array's memory isn't what the array says, or was freed; the process must be started again before it can use the card",
    701: "a block of this kernel wants more registers or shared memory than the card has; compile for float, or fewer results in one algorithm",
    702: "the card's watchdog ended the kernel, since a display runs on the card; call with fewer states",
    719: "a kernel failed on the card; the process must be started again before it can use the card",
    802: "the system of cards isn't ready yet; its fabric manager may not run",
    803: "the driver and its library are of different versions, as after an update; start the machine again",
    804: "the library of the driver is newer than the driver of the system serves; remove CUDA's compatibility package from the library path",
    900: "the stream is being captured, which this call can't be part of; call once before the capture",
    901: "the capture of the stream was ended by an earlier error",
}
"""What to do about codes that a user can meet."""


class Driver:
    """The functions of a driver's library, which raise CompilerError.

    library: a path, or None for the driver of the system.
    """

    def __init__(self, library: str | None = None) -> None:
        self._library = _opened(LIBRARIES if library is None else (library,))
        self._call = {name: self._declared(name, types) for name, types in _FUNCTIONS.items()}
        version = c_int()
        self.check("cuDriverGetVersion", byref(version))
        self.version = version.value
        if self.version < OLDEST:
            raise CompilerError(
                f"the driver of the card serves CUDA {_dotted(self.version)}; KSL needs one that serves {_dotted(OLDEST)}, of December 2022 or newer: update the driver"
            )
        self.check("cuInit", 0)
        count = c_int()
        self.check("cuDeviceGetCount", byref(count))
        self.cards = count.value
        if not self.cards:
            raise CompilerError(f"no card: {_MENDS[100]}")
        self._devices = [self._device(card) for card in range(self.cards)]
        self.launch_kernel, self.get_current = self._call["cuLaunchKernel"], self._call["cuCtxGetCurrent"]
        self._contexts: dict[int, int] = {}
        self._lock = threading.Lock()

    def _declared(self, name: str, types: list[Any]) -> Any:
        try:
            function = getattr(self._library, name)
        except AttributeError:
            raise CompilerError(f"the driver of the card has no {name}; KSL needs one that serves CUDA {_dotted(OLDEST)}: update the driver") from None
        function.argtypes, function.restype = types, c_int
        return function

    def address(self, name: str) -> int:
        """Where a function is, for code in C."""
        return ctypes.cast(self._call[name], c_void_p).value or 0

    def _device(self, card: int) -> int:
        device = c_int()
        self.check("cuDeviceGet", byref(device), card)
        return device.value

    def check(self, name: str, *arguments: Any) -> None:
        """Calls a function.  Raises CompilerError that says what its code means."""
        if code := self._call[name](*arguments):
            raise self.error(code)

    def error(self, code: int) -> CompilerError:
        """What a code means, and what to do about it."""
        said = []
        for function in ("cuGetErrorName", "cuGetErrorString"):
            text = c_char_p()
            if self._call[function](code, byref(text)) == 0 and text.value:
                said.append(text.value.decode("utf-8", "replace"))
        mend = f"; {_MENDS[code]}" if code in _MENDS else ""
        return CompilerError(f"the card's driver reports {': '.join(said) or 'an unknown error'} ({code}){mend}")

    def attribute(self, card: int, which: int) -> int:
        value = c_int()
        self.check("cuDeviceGetAttribute", byref(value), which, self._devices[card])
        return value.value

    def architecture(self, card: int) -> str:
        """As compilers name it: "sm_90"."""
        return f"sm_{self.attribute(card, COMPUTE_MAJOR)}{self.attribute(card, COMPUTE_MINOR)}"

    def name(self, card: int) -> str:
        name = ctypes.create_string_buffer(256)
        self.check("cuDeviceGetName", name, len(name), self._devices[card])
        return name.value.decode("utf-8", "replace")

    def context(self, card: int) -> int:
        """The card's primary context, kept for as long as the process lives."""
        if card not in self._contexts:
            with self._lock:
                if card not in self._contexts:
                    context = c_void_p()
                    self.check("cuDevicePrimaryCtxRetain", byref(context), self._devices[card])
                    self._contexts[card] = context.value or 0
        return self._contexts[card]

    def card_of(self, pointer: int) -> int | None:
        """The card whose memory a pointer is of; None for that of the processor."""
        kind, card = c_uint(), c_int()
        if self._call["cuPointerGetAttribute"](byref(kind), MEMORY_TYPE, pointer) or kind.value != ON_DEVICE:
            return None
        self.check("cuPointerGetAttribute", byref(card), DEVICE_ORDINAL, pointer)
        return card.value

    def on(self, card: int) -> _Current:
        """A context manager, in which the card's primary context is the thread's."""
        return _Current(self, self.context(card))


class _Current:
    """Makes a context the thread's, and afterwards the one before it, unless it is that already."""

    def __init__(self, driver: Driver, context: int) -> None:
        self._driver, self._context, self._pushed = driver, context, False

    def __enter__(self) -> None:
        current = c_void_p()
        self._driver.check("cuCtxGetCurrent", byref(current))
        if current.value != self._context:
            self._driver.check("cuCtxPushCurrent_v2", self._context)
            self._pushed = True

    def __exit__(self, *_: object) -> None:
        if self._pushed:
            self._driver.check("cuCtxPopCurrent_v2", byref(c_void_p()))


def _opened(names: tuple[str, ...]) -> ctypes.CDLL:
    for name in names:
        try:
            return ctypes.CDLL(name)
        except OSError as error:
            said = error
    raise CompilerError(f"no driver of a card: {said}; device='cuda' needs an NVIDIA card and its driver, which brings {names[0]}")


def _dotted(version: int) -> str:
    return f"{version // 1000}.{version % 1000 // 10}"


@cache
def system_driver() -> Driver:
    """This machine's driver, opened when it is first used."""
    return Driver()
