"""Kernels of one mechanism: its algorithms for many states on a graphics card, one thread a state.

`kernels(m, ["inverse_dynamics"], "float")` gives the text, which :func:`ksl.generation.cuda.nvrtc.compile` turns into machine code, and what each kernel takes:

    extern "C" __global__ void k_inverse_dynamics_rows(long long n, const float *q, long long q_stride, const float *v, long long v_stride,
                                                       const float *a, long long a_stride, float *tau, long long tau_stride)

* First the number of states n, then for each input in the order of the row its pointer and its stride, then the same for each result.  Inputs besides those of
  rows (external, gravity, payload, parameters) come after those of the row, as in C.  All are in the device's memory, in one precision.
* `NAME_rows`: number k of state s lies at `q[s * q_stride + k]`; strides count numbers.  A stride of 0 is one row for all states; results have none such.
* `NAME_soa`, the coalesced form: number k of state s at `q[k * q_stride + s]`, q_stride >= n; 0 is one row, without gaps, for all states.
* A result may lie where an input with the same stride and as many columns does.
* Blocks have at most `threads` threads, a multiple of 32, and the grid has as many of them in x as n states need.  No dynamic shared memory.
* A state whose numbers aren't finite gives NaN or infinities; nothing is checked and nothing is said.  Of a closed mechanism results are NaN where the fixed
  pivots don't serve.

Results have the engine's bits where the text is compiled by `nvrtc.compile` as it is, in double and in float; arctangents agree to rounding, and `--fmad=true` lets
products and sums be fused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from ksl.generation.arguments import Arguments, arguments_given
from ksl.generation.cuda.device import definitions, device_functions
from ksl.generation.cuda.turning import PIECE, WARP, in_tiles, tile_numbers, turning
from ksl.generation.open_reactions import Undetermined
from ksl.generation.requests import Function, functions_of, refuse_unwritten

if TYPE_CHECKING:
    from ksl.model.model import Model

PREFIX = "k_"
"""All names in a text for a process begin with it."""
THREADS = 128
SHARED_BYTES = 48 << 10
"""Shared memory that a block has without being asked for more."""


@dataclass(frozen=True)
class Kernel:
    """What a kernel takes."""

    name: str
    function: Function
    """The row that the kernel computes, its request and its steps."""
    inputs: tuple[tuple[str, int], ...]
    """Names, and how many numbers a state has of each."""
    results: tuple[tuple[str, tuple[int, ...]], ...]
    """Names, and the shape of each for one state; () is one number."""
    scalar: Literal["double", "float"]
    threads: int
    """A block has at most so many; a multiple of 32."""
    coalesced: bool
    """Is it `NAME_soa`?"""
    scalars: int = 0
    """How many numbers it takes besides arrays and the number of states."""


def kernels(
    model: Model,
    algorithms: Sequence[str],
    scalar: Literal["double", "float"] = "double",
    arguments: Arguments | Sequence[str] = (),
    layouts: Sequence[Literal["rows", "soa"]] = ("rows",),
    undetermined: Undetermined = "least-norm",
) -> tuple[str, list[Kernel]]:
    """The text of a translation unit with a kernel for each algorithm and layout, and what they take, in the order of the algorithms.

    algorithms, arguments, undetermined: as those of :func:`ksl.generate`.  Raises ArgumentError as that does."""
    given = arguments if isinstance(arguments, Arguments) else arguments_given(model, arguments)
    functions = functions_of(model, list(algorithms), given, scalar == "float", undetermined)
    refuse_unwritten(functions, "has no kernel; the whole matrix has one")
    text = "\n".join([definitions(functions, PREFIX, scalar), device_functions(functions, PREFIX), kernels_text(functions, PREFIX, scalar, layouts)])
    return text, signatures(functions, PREFIX, scalar, layouts)


def signatures(functions: Sequence[Function], prefix: str, scalar: Literal["double", "float"], layouts: Sequence[str]) -> list[Kernel]:
    return [
        Kernel(f"{prefix}{f.name}_{layout}", f, f.recording.inputs, f.recording.results, scalar, threads(f, scalar), layout == "soa")
        for f in functions
        for layout in layouts
    ]


def threads(function: Function, scalar: str) -> int:
    """A block has at most so many: THREADS, or fewer where their tiles would be too large."""
    tiles = tile_numbers([size for _, size in arrays(function)]) * (8 if scalar == "double" else 4)
    return WARP * max(1, min(THREADS // WARP, SHARED_BYTES // tiles))


def arrays(function: Function) -> list[tuple[str, int]]:
    """Names of inputs and results, and how many numbers a state has of each."""
    recording = function.recording
    return [*recording.inputs, *((name, size) for (name, _), size in zip(recording.results, recording.sizes()))]


def kernels_text(functions: Sequence[Function], prefix: str, scalar: str, layouts: Sequence[str]) -> str:
    """The kernels that call the functions of one state."""
    parts = [turning(prefix, scalar, "rows" in layouts, "soa" in layouts)]
    parts += [_kernel(function, prefix, scalar, layout == "soa") for function in functions for layout in layouts]
    return "\n".join(parts)


def parameters(function: Function, scalar: str) -> str:
    """A kernel's parameters, as its declaration has them."""
    recording = function.recording
    pointers = [f"const {scalar} *{name}, long long {name}_stride" for name, _ in recording.inputs]
    pointers += [f"{scalar} *{name}, long long {name}_stride" for name, _ in recording.results]
    return ", ".join(["long long n", *pointers])


def _kernel(function: Function, prefix: str, scalar: str, coalesced: bool) -> str:
    many = threads(function, scalar)
    layout, body = ("soa", _coalesced(function, prefix)) if coalesced else ("rows", _rows(function, prefix, scalar, many))
    state = "  const long long state = (long long)blockIdx.x * blockDim.x + threadIdx.x;\n"
    return f'extern "C" __global__ void __launch_bounds__({many}) {prefix}{function.name}_{layout}({parameters(function, scalar)}) {{\n{state}{body}}}\n'


def _coalesced(function: Function, prefix: str) -> str:
    """The body of a kernel that reads and writes the caller's arrays where it needs them."""
    given = [f"{prefix}inputs{{{name} + ({name}_stride ? state : 0), {name}_stride ? {name}_stride : 1}}" for name, _ in function.recording.inputs]
    given += [f"{prefix}results{{{name} + state, {name}_stride}}" for name, _ in function.recording.results]
    return "  if (state >= n)\n    return;\n" + _call(function, prefix, given)


HEAD = """\
  const int lane = threadIdx.x & 31;
  const long long first = state - lane, left = n - first; /* the state of the warp's first thread, and how many there are from it on */
  if (left <= 0)
    return;
  const int row = lane < left ? lane : (int)left - 1; /* threads without a state compute the last one, too, and write nothing */
"""


def _rows(function: Function, prefix: str, scalar: str, many: int) -> str:
    """The body of a kernel that turns rows."""
    listed = arrays(function)
    stay = in_tiles([size for _, size in listed])
    tiles = [(f"{name}_tile", size | 1) for (name, size), stays in zip(listed, stay) if stays] + [("piece", PIECE | 1)] * (not all(stay))
    text = HEAD + "".join(
        f"  __shared__ {scalar} {name}s[{many // WARP}][{WARP * numbers}];\n  {scalar} *const {name} = {name}s[threadIdx.x / 32];\n" for name, numbers in tiles
    )
    text += "".join(f"  {scalar} {name}_own[{size}];\n" for (name, size), stays in zip(listed, stay) if not stays)
    given, after = [], ""
    for k, ((name, size), stays) in enumerate(zip(listed, stay)):
        is_input = k < len(function.recording.inputs)
        rows = f"{name} + first * {name}_stride, {name}_stride, left"
        if stays:
            given.append(f"{name}_tile + {prefix}row_at<{size}>({'row' if is_input else 'lane'})")
            copied = f"  {prefix}copy<{size}, {'true' if is_input else 'false'}>({f'({scalar} *)' if is_input else ''}{rows}, {name}_tile);\n" if size else ""
        else:
            given.append(f"{name}_own")
            copied = f"  {prefix}take<{size}>({rows}, row, piece, {name}_own);\n" if is_input else f"  {prefix}give<{size}>({rows}, piece, {name}_own);\n"
        if is_input:
            text, given[-1] = text + copied, f"(const {scalar} *)({given[-1]})"
        else:
            after += copied
    return f"{text}  __syncwarp();\n{_call(function, prefix, given)}  __syncwarp();\n{after}"


def _call(function: Function, prefix: str, given: Sequence[str]) -> str:
    return f"  {prefix}{function.name}({', '.join(given)});\n"
