"""`NAME.cuh` and `NAME.cu`: the functions of one state for a card, and kernels of many; what README.md says of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

from ksl.base.errors import CompilerError
from ksl.generation.cuda.device import definitions, device_functions
from ksl.generation.cuda.figures import Figures, figures
from ksl.generation.cuda.kernels import THREADS, Kernel, arrays, kernels_text, parameters, signatures
from ksl.generation.cuda.nvrtc import Nvrtc, find
from ksl.generation.cuda.simulation import StepFunctions, simulation_parameters
from ksl.generation.requests import Function

LAYOUTS: tuple[Literal["rows"], Literal["soa"]] = ("rows", "soa")
ARCHITECTURE = "sm_90"
"""Figures in README.md are for it: H100, H200."""


def cuda_header(
    first_line: str,
    name: str,
    scalar: Literal["double", "float"],
    functions: Sequence[Function],
    contract: bool,
    documented: Callable[[Function], str],
    motion: StepFunctions | None,
) -> str:
    """motion: that of the kernel of many steps, if there is one."""
    prefix, macro = f"{name}_", name.upper()
    exact = "" if contract else EXACT
    wrappers = "\n".join(f"{documented(f)}{_of_pointers(f, prefix, scalar)}" for f in functions)
    of_kernels = "".join(_declared(k) for k in signatures(functions, prefix, scalar, LAYOUTS))
    if motion:
        said = IN_MOTION.replace(" */", f"{CLOSED} */") if motion.loops else IN_MOTION
        of_kernels += (
            f'{said}#define {macro}_SIMULATE_THREADS {THREADS}\nextern "C" __global__ void {prefix}simulate({simulation_parameters(motion, scalar)});\n'
        )
    return f"""\
/* {first_line}

   Functions of one state for a thread of a card, and kernels of many states, one thread a state.  SI units and radians; six-vectors are linear first.
   A function reads and writes arrays of its thread; results lie apart from inputs.

   Of a kernel each array has a stride, in numbers.  NAME_rows: number k of state s is at [s * stride + k]; NAME_soa: at [k * stride + s], stride >= n.
   An input whose stride is 0 has one row for all states.  A result may lie where an input with the same stride and as many numbers does.  Blocks have
   NAME_THREADS threads, or fewer, a multiple of 32, and the grid has blocks for n of them.  Numbers aren't checked: where they aren't finite, nor are results. */
#ifndef {macro}_CUH
#define {macro}_CUH

{exact}{definitions(functions, prefix, scalar)}
{device_functions(functions, prefix)}
{wrappers}
{of_kernels}
#endif
"""


# Passes for the processor, and clang, have no such macros, or others' values of them.
EXACT = """\
/* Results are those of KSL on a processor: compile with --fmad=false, too, which no macro tells of. */
#if defined(__CUDA_ARCH__) && (defined(__NVCC__) || defined(__CUDACC_RTC__)) && (__CUDA_FTZ || !__CUDA_PREC_DIV || !__CUDA_PREC_SQRT || __USE_FAST_MATH__)
#error "fast mathematics: results would not be KSL's; leave --use_fast_math, --ftz, --prec-div and --prec-sqrt out, or generate with --contract"
#endif

"""


IN_MOTION = """
/* So many steps of h seconds by semi-implicit Euler, from q and v to q1 and v1: v + h a(q, v), then positions by this velocity.  Efforts of step k begin
   tau_step * k numbers behind the first; 0: they are constant. */
"""
CLOSED = """  After each step the mechanism is moved to the nearest closed position and velocity.  A run
   that begins open, or comes where the fixed pivots don't serve or nothing closed is near, ends in NaN."""


def _of_pointers(function: Function, prefix: str, scalar: str) -> str:
    """The function of a thread's arrays, whatever of them is const."""
    recording = function.recording
    typed = [f"const {scalar} *{name}" for name, _ in recording.inputs] + [f"{scalar} *{name}" for name, _ in recording.results]
    given = ", ".join(name for name, _ in arrays(function))
    called = f"{prefix}{function.name}<const {scalar} *, {scalar} *>({given});"
    return f"static __device__ __forceinline__ void {prefix}{function.name}({', '.join(typed)}) {{\n  {called}\n}}\n"


def _declared(kernel: Kernel) -> str:
    macro = "" if kernel.coalesced else f"#define {kernel.name.removesuffix('_rows').upper()}_THREADS {kernel.threads}\n"
    return f'{macro}extern "C" __global__ void {kernel.name}({parameters(kernel.function, kernel.scalar)});\n'


def cuda_source(first_line: str, name: str, scalar: Literal["double", "float"], functions: Sequence[Function], in_motion: str) -> str:
    """in_motion: the kernel of many steps, or nothing."""
    return f'/* {first_line} */\n#include "{name}.cuh"\n\n{kernels_text(functions, f"{name}_", scalar, LAYOUTS)}\n{in_motion}'


def of_the_card(name: str, scalar: Literal["double", "float"], functions: Sequence[Function], contract: bool, header: str, source: str) -> str:
    """What README.md says of kernels.  header, source: their text."""
    first = signatures(functions[:1], f"{name}_", scalar, ("rows",))[0]
    macro, flag = f"{name}_{functions[0].name}".upper() + "_THREADS", "" if contract else " --fmad=false"
    given = ", ".join(f"{x}, {size}" for x, size in arrays(functions[0]))
    bits = "Products and sums may be fused." if contract else "Results have the bits of KSL's own on a processor with `--fmad=false`, arctangents apart."
    return f"""\
## On a graphics card

`{name}.cuh` has the functions of one state for a thread, and `{name}.cu` kernels of many states in the device's memory, one thread a state:

    nvcc{flag} -c {name}.cu
    {first.name}<<<(n + {macro} - 1) / {macro}, {macro}>>>(n, {given});

Each array has a stride behind it. `{name}.cuh` says what strides are, and that of the kernels `NAME_soa`, whose arrays hold one number of all states after the other. {bits}

{_table(text=_joined(header, source, name), flag=contract)}
"""


def _joined(header: str, source: str, name: str) -> str:
    """Both files as one text."""
    return header + source.replace(f'#include "{name}.cuh"\n', "")


def _table(text: str, flag: bool) -> str:
    """Registers and spills, where a compiler is there to count them."""
    try:
        nvrtc = find()
        found = figures(nvrtc, text, ARCHITECTURE, ["--fmad=true"] if flag else [])
    except CompilerError:
        return "`nvcc -Xptxas -v` says how many registers each kernel takes; `pip install 'ksl[cuda]'` lets `ksl generate` write them here."
    rows = "".join(_row(name, of) for name, of in sorted(found.items()))
    return f"What a thread of each takes, by NVRTC {_version(nvrtc)} for {ARCHITECTURE}; shared memory is a block's:\n\n| | registers | bytes spilled | bytes of stack | shared | instructions | of local memory |\n|---|---|---|---|---|---|---|\n{rows}"


def _version(nvrtc: Nvrtc) -> str:
    return ".".join(map(str, nvrtc.version))


def _row(name: str, of: Figures) -> str:
    return f"| `{name}` | {of.registers} | {of.spilled} | {of.stack} | {of.shared} | {of.instructions} | {of.local} |\n"
