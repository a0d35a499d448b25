"""Functions of one state for a card: the statements of C99 (c99.py), whose arrays are a thread's own."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ksl.generation.c99 import Printer
from ksl.generation.cuda.order import ordered
from ksl.generation.recording import Recording
from ksl.generation.requests import Function
from ksl.generation.sine_cosine import sine_cosine

STRAIGHT = 16000
"""So many statements are one function, which is a part of its kernel: a humanoid's forward dynamics."""
PART = 2000
"""So many statements a part of a longer one has at most."""

INTEGERS = """\
#ifdef __CUDACC_RTC__ /* NVRTC has no headers */
typedef int int32_t;
typedef unsigned int uint32_t;
typedef long long int64_t;
typedef unsigned long long uint64_t;
#define UINT32_C(number) number##U
#define UINT64_C(number) number##ULL
#else
#include <math.h>
#include <stdint.h>
#endif
"""


class DevicePrinter(Printer):
    """Prints one function of one state.  Its arrays are pointers, or what has `[k]` besides: those of the coalesced layout (turning.py)."""

    def __init__(self, of: Recording, prefix: str) -> None:
        super().__init__(of if len(of.operations) > STRAIGHT else ordered(of), prefix)
        classes = f"template <class Inputs = const {self.real} *, class Results = {self.real} *> static __device__ "
        self.straight, self.part, self.storage, self.storage_of_parts = STRAIGHT, PART, f"{classes}__forceinline__ ", f"{classes}__noinline__ "

    def declared(self, read: list[str], written: list[str]) -> list[str]:
        return [*(f"Inputs {name}" for name in read), *(f"Results {name}" for name in written)]


def definitions(functions: Sequence[Function], prefix: str, scalar: str) -> str:
    """What functions of one state call."""
    parts = [INTEGERS]
    if any(f.recording.angles for f in functions):
        parts.append(on_device(sine_cosine(f"{prefix}math_", scalar), prefix))
    return "\n".join(parts)


def on_device(text: str, prefix: str) -> str:
    """The C of sine and cosine as functions of a card.  What serves angles beyond 2^18 stays apart, since it is long and hardly ever called."""
    text = re.sub(r"^static const ", "static __device__ const ", text, flags=re.MULTILINE)
    text = re.sub(r"^static (?=[^_])", "static __device__ __forceinline__ ", text, flags=re.MULTILINE)
    text = text.replace(f"__forceinline__ int {prefix}math_reduce_large", f"__noinline__ int {prefix}math_reduce_large")
    return text.replace("#if defined(FP_FAST_FMAF)", "#if defined(__CUDACC__) || defined(FP_FAST_FMAF)")


def device_functions(functions: Sequence[Function], prefix: str) -> str:
    return "\n".join(DevicePrinter(f.recording, prefix).function(f"{prefix}{f.name}") for f in functions)
