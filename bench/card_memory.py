"""Memory, streams, events and graphs of a card by its driver alone, so that a measurement needs neither torch nor a CUDA toolkit."""

import ctypes
from collections.abc import Callable
from ctypes import byref, c_float, c_int, c_size_t, c_uint, c_uint64, c_void_p

import numpy as np

from ksl.generation.card.driver import LIBRARIES, Driver

RELAXED = 2
"""Calls that allocate may come while a stream is captured."""


class Card:
    """A card, and a stream of it."""

    def __init__(self, driver: Driver, number: int = 0) -> None:
        self.driver, self.number, self.library = driver, number, ctypes.CDLL(LIBRARIES[0])
        self.call("cuCtxPushCurrent_v2", c_void_p(driver.context(number)))
        self.stream = self._made("cuStreamCreate", c_uint(1))

    def call(self, name: str, *arguments: object) -> None:
        if code := self.library[name](*arguments):
            raise self.driver.error(code)

    def _made(self, name: str, *arguments: object) -> int:
        made = c_void_p()
        self.call(name, byref(made), *arguments)
        return made.value or 0

    def array(self, x: np.ndarray) -> "Array":
        made = Array(self, x.shape, x.dtype)
        host = np.ascontiguousarray(x)
        if host.size:
            self.call("cuMemcpyHtoD_v2", c_uint64(made.pointer), c_void_p(host.ctypes.data), c_size_t(host.nbytes))
        return made

    def wait(self) -> None:
        self.call("cuStreamSynchronize", c_void_p(self.stream))

    def free_bytes(self) -> int:
        free, whole = c_size_t(), c_size_t()
        self.call("cuMemGetInfo_v2", byref(free), byref(whole))
        return free.value

    def seconds(self, run: Callable[[], object]) -> float:
        """How long the card takes for what `run` puts into the stream."""
        events = [self._made("cuEventCreate", c_uint(0)) for _ in range(2)]
        self.call("cuEventRecord", c_void_p(events[0]), c_void_p(self.stream))
        run()
        self.call("cuEventRecord", c_void_p(events[1]), c_void_p(self.stream))
        self.call("cuEventSynchronize", c_void_p(events[1]))
        took = c_float()
        self.call("cuEventElapsedTime", byref(took), c_void_p(events[0]), c_void_p(events[1]))
        for event in events:
            self.call("cuEventDestroy_v2", c_void_p(event))
        return took.value / 1e3

    def graph(self, run: Callable[[], object]) -> Callable[[], None]:
        """What `run` puts into the stream, captured as a graph: a function that launches it."""
        self.call("cuStreamBeginCapture_v2", c_void_p(self.stream), c_int(RELAXED))
        run()
        graph = c_void_p()
        self.call("cuStreamEndCapture", c_void_p(self.stream), byref(graph))
        launched = self._made("cuGraphInstantiateWithFlags", graph, c_uint64(0))
        return lambda: self.call("cuGraphLaunch", c_void_p(launched), c_void_p(self.stream))


class Array:
    """An array in a card's memory, with the array interface."""

    def __init__(self, card: Card, shape: tuple[int, ...], dtype: np.dtype) -> None:
        self.card, self.shape, self.dtype = card, tuple(shape), np.dtype(dtype)
        self.size = int(np.prod(shape, dtype=np.int64))
        pointer = c_uint64()
        if self.size:
            card.call("cuMemAlloc_v2", byref(pointer), c_size_t(self.size * self.dtype.itemsize))
        self.pointer = pointer.value

    def __del__(self) -> None:
        if self.pointer:
            self.card.library.cuMemFree_v2(c_uint64(self.pointer))

    def numpy(self) -> np.ndarray:
        self.card.wait()
        host = np.empty(self.shape, self.dtype)
        if self.size:
            self.card.call("cuMemcpyDtoH_v2", c_void_p(host.ctypes.data), c_uint64(self.pointer), c_size_t(host.nbytes))
        return host

    @property
    def __cuda_array_interface__(self) -> dict[str, object]:
        return {"version": 3, "shape": self.shape, "typestr": self.dtype.str, "data": (self.pointer, False), "stream": self.card.stream or None}
