"""A run of many steps in one kernel, as `m.simulate` takes it (src/simulate/methods/): semi-implicit Euler, v' = v + h a(q, v), q' = q moved by h v', or rk4.

A thread takes its state through all steps, so that nothing but its efforts is read between them.

    extern "C" __global__ void k_simulate(long long n, long long steps, float h, const float *q, long long q_stride, const float *v, long long v_stride,
                                          const float *tau, long long tau_stride, long long tau_step, float *q1, long long q1_stride, float *v1, long long v1_stride)

Rows are those of kernels (kernels.py), read without turning.  Efforts of step k begin tau_step * k numbers behind the first; 0: they are constant.  Inputs of forward
dynamics besides (external, gravity, payload, parameters) come behind tau_step, and are constant in a run.

A closed mechanism is moved to the nearest closed position and velocity after each step, by the text that closes loops of FMUs (../fmus/fmi3/closing.h).  A run that begins
open, or comes where fixed pivots don't serve or nothing closed is near, ends in NaN.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from ksl.generation.cuda.device import device_functions
from ksl.generation.cuda.kernels import THREADS, Kernel
from ksl.generation.fmus.fmu_variables import moving_joints
from ksl.generation.fmus.open_states import CLOSING, TOLERANCES, OpenStates, open_states

if TYPE_CHECKING:
    from ksl.generation.requests import Function
    from ksl.model.model import Model


METHODS = ("semi_implicit_euler", "rk4")
"""Methods of simulation that kernels have, as `m.simulate` names them."""


@dataclass(frozen=True)
class StepFunctions:
    """What a kernel of many steps calls."""

    dynamics: Function
    sizes: tuple[int, int]
    """nq, nv."""
    flat: bool
    """Do positions move by addition?"""
    loops: OpenStates | None


def motion_of(model: Model, functions: Sequence[Function]) -> StepFunctions | None:
    """None without functions for a step: what moves positions is `integrate`, where joints have several coordinates.  Raises ArgumentError for loops whose equations aren't found."""
    asked = {f.row: f for f in functions if not f.derivative}
    flat = all(joint.one_coordinate for joint in moving_joints(model))
    if "forward_dynamics" not in asked or not (flat or "integrate" in asked):
        return None
    dynamics, sizes = asked["forward_dynamics"], (model.nq, model.nv)
    if not model.loops:
        return StepFunctions(dynamics, sizes, flat, None)
    recording = dynamics.recording  # without sizes of pivots
    loops = open_states(model, replace(dynamics, recording=replace(recording, results=recording.results[:1], outputs=recording.outputs[: model.nv])))
    return StepFunctions(
        replace(loops.dynamics, name="forward_dynamics_between_steps"), sizes, flat, replace(loops, equations=replace(loops.equations, name="loops"))
    )


def simulated(motion: StepFunctions, scalar: Literal["double", "float"], method: str) -> Kernel:
    """The kernel of runs, as calls of a model take it: steps, their length, and the distance between efforts are numbers."""
    (nq, nv), function = motion.sizes, replace(motion.dynamics, name="simulate", row="simulate", request=None, keywords={"method": method})
    return Kernel(
        f"k_{_names(method)}",
        function,
        (("q", nq), ("v", nv), ("efforts", nv), *motion.dynamics.recording.inputs[3:]),
        (("q1", (nq,)), ("v1", (nv,))),
        scalar,
        THREADS,
        False,
        3,
    )


def simulation_parameters(motion: StepFunctions, scalar: str) -> str:
    """The kernel's parameters, as its declaration has them."""
    besides = "".join(f", const {scalar} *{name}, long long {name}_stride" for name, _ in motion.dynamics.recording.inputs[3:])
    given = ", ".join(f"const {scalar} *{name}, long long {name}_stride" for name in ("q", "v", "tau"))
    return (
        f"long long n, long long steps, {scalar} h, {given}, long long tau_step{besides}, {scalar} *q1, long long q1_stride, {scalar} *v1, long long v1_stride"
    )


def _names(method: str) -> str:
    """The kernel of a method."""
    return "simulate" if method == METHODS[0] else f"simulate_{method}"


def simulation(motion: StepFunctions, prefix: str, scalar: str, methods: Sequence[str] = METHODS[:1]) -> str:
    """The kernels PREFIXsimulate and PREFIXsimulate_METHOD, behind the functions of one state, and what they call besides."""
    closing = _closing(motion, motion.loops, prefix) if motion.loops else ""
    return _move(motion, prefix, scalar) + "\n" + closing + "\n".join(_kernel(motion, prefix, scalar, method) for method in methods)


def _kernel(motion: StepFunctions, prefix: str, scalar: str, method: str) -> str:
    nq, nv = motion.sizes
    besides = "".join(f", {name} + state * {name}_stride" for name, _ in motion.dynamics.recording.inputs[3:])
    begin, goes, close, end = "", "", "", "at[k]"
    if motion.loops:
        begin, goes, close = f"  bool closed = {prefix}is_closed(at, rate);\n", "closed && ", f"    closed = {prefix}close(at, rate);\n"
        end = "closed ? at[k] : nan"
    accelerate = f"{prefix}{motion.dynamics.name}<const {scalar} *, {scalar} *>"
    given = f"tau + state * tau_stride + step * tau_step{besides}"
    stages, taken = _rk4(motion, prefix, scalar, accelerate, given) if method == "rk4" else _euler(motion, prefix, scalar, accelerate, given)
    return f"""\
extern "C" __global__ void __launch_bounds__({THREADS}) {prefix}{_names(method)}({simulation_parameters(motion, scalar)}) {{
  const long long state = (long long)blockIdx.x * blockDim.x + threadIdx.x;
  if (state >= n)
    return;
  {scalar} at[{nq}], rate[{nv}], moved[{nv}], {stages};
  for (int k = 0; k < {nq}; ++k)
    at[k] = q[state * q_stride + k];
  for (int k = 0; k < {nv}; ++k)
    rate[k] = v[state * v_stride + k];
{begin}#pragma unroll 1
  for (long long step = 0; {goes}step < steps; ++step) {{
{taken}{close}  }}
{"  const double nan = 0.0 / 0.0;" + chr(10) if motion.loops else ""}  for (int k = 0; k < {nq}; ++k)
    q1[state * q1_stride + k] = {end};
  for (int k = 0; k < {nv}; ++k)
    v1[state * v1_stride + k] = {end.replace("at", "rate")};
}}
"""


def _euler(motion: StepFunctions, prefix: str, scalar: str, accelerate: str, given: str) -> tuple[str, str]:
    """Arrays of a step, and a step of semi-implicit Euler."""
    nv = motion.sizes[1]
    return (
        f"acceleration[{nv}]",
        f"""\
    {accelerate}(at, rate, {given}, acceleration);
#pragma unroll
    for (int k = 0; k < {nv}; ++k) {{
      rate[k] += h * acceleration[k];
      moved[k] = h * rate[k];
    }}
    {prefix}move(at, moved, at);
""",
    )


def _rk4(motion: StepFunctions, prefix: str, scalar: str, accelerate: str, given: str) -> tuple[str, str]:
    """Arrays of a step, and a step of rk4 (src/simulate/methods/rk4.cpp): the four stages are turns of one loop, so that dynamics is there once."""
    nq, nv = motion.sizes
    sums = {"moved": ("v", "h / 6", "h / 3", "h / 3", "h / 6")}
    if not motion.flat:
        sums = {"moved": ("v", "h / 4", "h / 6", "h / 6", "-h / 12"), "then": ("v", "-h / 12", "h / 6", "h / 6", "h / 4")}
    sums["change"] = ("a", "h / 6", "h / 3", "h / 3", "h / 6")
    added = "".join(f"      {name}[k] = {' + '.join(f'{c} * {of}s[{j}][k]' for j, c in enumerate(cs))};\n" for name, (of, *cs) in sums.items())
    arrays = f"place[{nq}], half[{nq}], vs[4][{nv}], as[4][{nv}], change[{nv}]" + ("" if motion.flat else f", then[{nv}]")
    return (
        arrays,
        f"""\
    for (int k = 0; k < {nq}; ++k)
      place[k] = at[k];
    for (int k = 0; k < {nv}; ++k)
      vs[0][k] = rate[k];
#pragma unroll 1
    for (int stage = 0; stage < 4; ++stage) {{
      {accelerate}(place, vs[stage], {given}, as[stage]);
      if (stage == 3)
        break;
      for (int k = 0; k < {nv}; ++k) {{
        moved[k] = stage < 2 ? h / 2 * vs[stage][k] : h * vs[2][k] + -h / 2 * rate[k];
        vs[stage + 1][k] = rate[k] + (stage < 2 ? h / 2 : h) * as[stage][k];
      }}
      {prefix}move(stage < 2 ? at : half, moved, place);
      for (int k = 0; stage == 0 && k < {nq}; ++k)
        half[k] = place[k];
    }}
#pragma unroll
    for (int k = 0; k < {nv}; ++k) {{
{added}    }}
    {prefix}move(at, moved, at);
{"" if motion.flat else f"    {prefix}move(at, then, at);" + chr(10)}    for (int k = 0; k < {nv}; ++k)
      rate[k] += change[k];
""",
    )


def _move(motion: StepFunctions, prefix: str, scalar: str) -> str:
    """Positions moved by a displacement, which may lie where they were."""
    nq, (first, sum_) = motion.sizes[0], ("", "q[k] + u[k]")
    if not motion.flat:
        first, sum_ = f"  {scalar} next[{nq}];\n  {prefix}integrate<const {scalar} *, {scalar} *>(q, u, next);\n", "next[k]"
    return f"""\
static __device__ __forceinline__ void {prefix}move(const {scalar} *q, const {scalar} *u, {scalar} *out) {{
{first}#pragma unroll
  for (int k = 0; k < {nq}; ++k)
    out[k] = {sum_};
}}
"""


def _closing(motion: StepFunctions, loops: OpenStates, prefix: str) -> str:
    """What closes loops after a step: closing.h, in the words of a card, which has no headers."""
    text = CLOSING.read_text(encoding="ascii")
    text = re.sub("^static ", "static __device__ __noinline__ ", text[text.index("#define FMU_MOST") : text.rindex("#endif")], flags=re.MULTILINE)
    nq, nv = motion.sizes
    words = {
        "FMU_NQ": nq, "FMU_NV": nv, "FMU_LOOPS": loops.rows, "FMU_LENGTH": loops.length, "FMU_ACCEPTED": loops.accepted, "FMU_CLOSED": loops.closed_within,
        "FMU_RANK": TOLERANCES["rank"], "DBL_EPSILON": 2.0**-52, "HUGE_VAL": 1e308, "FMU_": prefix.upper(), "fmu_": prefix,
    }  # fmt: skip
    for word, meaning in words.items():
        text = text.replace(word, str(meaning))
    return f"""\
{device_functions([loops.equations, motion.dynamics], prefix)}
static __device__ __noinline__ void {prefix}opening(const double *q, const double *v, double *error, double *rate) {{
  {prefix}loops<const double *, double *>(q, v, error, rate);
}}

{text}"""
