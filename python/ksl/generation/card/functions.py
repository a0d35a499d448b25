"""Functions of a mechanism on cards: machine code in the cache, modules on the cards that need them, and launches."""

from __future__ import annotations

import ctypes
import hashlib
import threading
from collections.abc import Sequence
from ctypes import byref, c_int, c_int64, c_void_p
from functools import cached_property
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ksl import _core
from ksl.base.errors import CompilerError
from ksl.generation.cache import CARD_SUFFIX, cached
from ksl.generation.card.driver import MULTIPROCESSORS, Driver
from ksl.generation.cuda import nvrtc
from ksl.generation.cuda.turning import WARP

if TYPE_CHECKING:
    from ksl.generation.cuda.kernels import Kernel

REGISTERS, LOCAL_BYTES = 4, 3
"""Attributes of a kernel: registers, and bytes of memory of a thread, of what registers don't hold."""


class Code:
    """The kernels of one text, compiled for an architecture and loaded on a card when the card first needs them."""

    def __init__(self, text: str, driver: Driver) -> None:
        self.text, self.driver = text, driver
        self._modules: dict[int, int] = {}
        self._lock = threading.Lock()

    def handle(self, name: str, card: int) -> int:
        """The kernel of this name on a card.  Raises CompilerError."""
        function = c_void_p()
        with self.driver.on(card):
            self.driver.check("cuModuleGetFunction", byref(function), self._module(card), name.encode())
        assert function.value is not None
        return function.value

    def _module(self, card: int) -> int:
        """The compiled module on a card.  It stays loaded: a kernel may still run."""
        with self._lock:
            if card not in self._modules:
                module = c_void_p()
                self.driver.check("cuModuleLoadData", byref(module), machine_code(self.text, self.driver.architecture(card), self.driver.version))
                assert module.value is not None
                self._modules[card] = module.value
            return self._modules[card]


def machine_code(text: str, architecture: str, serves: int) -> bytes:
    """A text for an architecture, from the cache if it is there.  serves: the version of CUDA that the driver serves.  Raises CompilerError."""

    def make(_: Path, made: Path, kept: Path) -> None:
        major, minor = nvrtc.find().version
        if major > serves // 1000:
            older = f"pip install 'nvidia-cuda-nvrtc-cu{serves // 1000}'"
            raise CompilerError(
                f"NVRTC {major}.{minor} makes code for drivers that serve CUDA {major}, and this machine's serves {serves // 1000}: update the driver, or {older}"
            )
        made.write_bytes(nvrtc.compile(text, architecture))

    key = hashlib.sha256("\0".join([text, architecture, *nvrtc.EXACT]).encode()).hexdigest()
    return cached(key, make, "", CARD_SUFFIX).read_bytes()


class CardFunction:
    """A compiled function: what it computes, and its launches."""

    def __init__(self, asked: str, kernel: Kernel, code: Code) -> None:
        self.asked, self.kernel, self._code = asked, kernel, code
        function = kernel.function
        self.row, self.derivative, self.request, self.keywords = function.row, function.derivative, function.request, function.keywords
        self.external, self.parameters = function.arguments.external, function.arguments.parameters
        self.inputs, self.results = kernel.inputs, kernel.results
        self.scalar: str = kernel.scalar
        self.driver = code.driver
        self._handles: dict[int, tuple[int, int, int]] = {}
        """What `on` returns for each card."""
        self._given = threading.local()
        """Memory of arguments, which a launch copies: one for each thread."""

    def on(self, card: int) -> tuple[int, int, int]:
        """The kernel on a card, loaded if it isn't there yet, the threads of a block that occupy it best, and its multiprocessors.  Raises CompilerError."""
        if card not in self._handles:
            handle, least, best = self._code.handle(self.kernel.name, card), c_int(), c_int()
            with self.driver.on(card):
                self.driver.check("cuOccupancyMaxPotentialBlockSize", byref(least), byref(best), handle, None, 0, self.kernel.threads)
            self._handles[card] = handle, best.value, self.driver.attribute(card, MULTIPROCESSORS)
        return self._handles[card]

    def launch(self, card: int, stream: int, states: int, rows: Sequence[int]) -> None:
        """Starts the kernel on a stream, and waits for nothing.

        rows: a pointer and a stride for each input, and then for each result: as :mod:`ksl.generation.cuda.kernels` has them; of a run, what
        :mod:`ksl.generation.cuda.simulation` has.  Raises CompilerError."""
        if states == 0:
            return
        handle, best, multiprocessors = self._handles.get(card) or self.on(card)
        threads = threads_of(states, best, multiprocessors)
        try:
            values, pointers, current, of_current = self._given.memory
        except AttributeError:
            values, pointers, current, of_current = self._given.memory = self._memory()
        values[:] = (states, *rows)
        driver, blocks = self.driver, -(-states // threads)
        if driver.get_current(of_current) == 0 and current.value == driver.context(card):  # as torch leaves it
            code = driver.launch_kernel(handle, blocks, 1, 1, threads, 1, 1, 0, stream, pointers, None)
        else:
            with driver.on(card):
                code = driver.launch_kernel(handle, blocks, 1, 1, threads, 1, 1, 0, stream, pointers, None)
        if code:
            raise driver.error(code)

    def _memory(self) -> tuple[Any, Any, c_void_p, Any]:
        """Arguments of a launch, their addresses, a context, and its reference."""
        values = (c_int64 * (1 + self.kernel.scalars + 2 * (len(self.inputs) + len(self.results))))()
        current = c_void_p()
        return values, (c_void_p * len(values))(*(ctypes.addressof(values) + 8 * k for k in range(len(values)))), current, byref(current)

    @cached_property
    def for_programs(self) -> Any:
        """The kernel as programs of JAX name it, loaded on all cards that the driver has."""
        functions = [
            self.driver.address(name)
            for name in ("cuLaunchKernel", "cuStreamGetCtx", "cuCtxGetCurrent", "cuCtxPushCurrent_v2", "cuCtxPopCurrent_v2", "cuGetErrorName")
        ]
        on = [
            (handle, self.driver.context(card), best, multiprocessors) for card in range(self.driver.cards) for handle, best, multiprocessors in [self.on(card)]
        ]
        widths = [*(size for _, size in self.inputs), *(prod(shape) for _, shape in self.results)]
        return _core.CardKernel(functions, on, widths, len(self.inputs), self.scalar == "float")

    def attribute(self, which: int, card: int = 0) -> int:
        """REGISTERS or LOCAL_BYTES of it."""
        value = c_int()
        with self.driver.on(card):
            self.driver.check("cuFuncGetAttribute", byref(value), which, self.on(card)[0])
        return value.value


def threads_of(states: int, best: int, multiprocessors: int) -> int:
    """Threads of a block: `best`, or fewer where some multiprocessors would have no block then; whole warps."""
    return max(1, min(best // WARP, states // (WARP * multiprocessors))) * WARP
