"""`fmu_model.h`: what the C of `fmi3/` needs to know of one mechanism: where its numbers lie, start values, and calls of the generated functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ksl._core import QUATERNION_ROUNDING
from ksl.generation.fmus.fmu_variables import Kind, Layout
from ksl.generation.fmus.open_states import TOLERANCES, OpenStates

if TYPE_CHECKING:
    from ksl.model.model import Model

MOST_STEPS = 10_000_000
"""So many steps one communication step has at most, as a run of `m.simulate` has."""


PRECISION = {"double": ("DBL_MAX", 1e-12), "float": ("((double)FLT_MAX)", 1e-6)}
"""The largest number, and how far a step may be beyond the one that is asked for, by rounding of that."""


@dataclass(frozen=True)
class FmuModel:
    """name: prefix of the generated functions; flat: do positions move by addition?; scalar: double or float; loops: what closes those of a mechanism in motion."""

    model: Model
    name: str
    kind: Kind
    layout: Layout
    method: str
    flat: bool
    scalar: str
    loops: OpenStates | None
    first_line: str

    def header(self, token: str) -> str:
        starts = ", ".join(self.number(v.start) for v in self.layout.variables)
        places = "".join(f"#define FMU_{group.upper()} {place}\n" for group, place in self.layout.places.items())
        return f"""\
/* {self.first_line} */
#ifndef KSL_FMU_MODEL_H
#define KSL_FMU_MODEL_H

#include "{self.name}.h"

typedef {self.scalar} fmu_real;
#define FMU_LARGEST {PRECISION[self.scalar][0]}

#define FMU_TOKEN "{token}"
#define FMU_NQ {self.model.nq}
#define FMU_NV {self.model.nv}
#define FMU_NUMBERS {len(self.layout.variables)}
#define FMU_FIRST_INPUT {self.layout.first("input")}
#define FMU_FIRST_OUTPUT {self.layout.first("output")}
{places}
static const fmu_real fmu_starts[FMU_NUMBERS] = {{
    {starts}}};

{self.moved() if self.kind == "forward" else ""}{self.judged()}{self.in_motion() if self.kind == "forward" else self.given()}
#endif
"""

    def number(self, x: float) -> str:
        return repr(x) if self.scalar == "double" else f"{np.float32(x)!s}f"

    def judged(self) -> str:
        """What is wrong with numbers that were set, or NULL."""
        quaternions = f"""\
  static const int quaternions[] = {{{", ".join(map(str, self.layout.quaternions))}}};
  size_t k;
  for (k = 0; k < sizeof quaternions / sizeof *quaternions; ++k) {{
    const fmu_real *const c = x + quaternions[k];
    if (!(fabs((double)(c[0] * c[0] + c[1] * c[1] + c[2] * c[2] + c[3] * c[3] - 1)) <= {2 * QUATERNION_ROUNDING!r}))
      return "a quaternion, qx qy qz qw, is not of unit length";
  }}
"""  # fmt: skip
        step = '  if (!(x[FMU_STEP] > 0))\n    return "the parameter step must be above zero";\n'
        closed = '  if (!fmu_is_closed(x + FMU_Q_START, x + FMU_V_START))\n    return "the start opens loops of the mechanism; take a position of m.close, and velocities of m.consistent_velocity";\n'
        return f"""\
static const char *fmu_wrong(const fmu_real *x) {{
  (void)x;
{step if self.kind == "forward" else ""}{quaternions if self.layout.quaternions else ""}{closed if self.loops else ""}  return NULL;
}}

"""

    def reactions(self) -> str:
        return f"  {self.name}_reactions(x + FMU_Q, x + FMU_V, x + FMU_A, x + FMU_REACTIONS);\n" if "reactions" in self.layout.places else ""

    def given(self) -> str:
        """The motion is an input."""
        return f"""\
static void fmu_begin(fmu_real *x) {{ (void)x; }}

static void fmu_compute(fmu_real *x) {{
  {self.name}_inverse_dynamics(x + FMU_Q, x + FMU_V, x + FMU_A, x + FMU_TAU);
{self.reactions()}}}

static const char *fmu_go(fmu_real *x, double begin, double length) {{
  (void)x, (void)begin, (void)length;
  return NULL;
}}
"""

    def moved(self) -> str:
        """How positions move; of closed mechanisms how they close, too."""
        move = "  int i;\n  for (i = 0; i < FMU_NQ; ++i)\n    out[i] = q[i] + u[i];\n" if self.flat else f"  {self.name}_integrate(q, u, out);\n"
        text = f"""\
static void fmu_move(const fmu_real *q, const fmu_real *u, fmu_real *out) {{
{move}}}

"""
        return (
            text
            if self.loops is None
            else f"""\
{text}#define FMU_LOOPS {self.loops.rows}
#define FMU_LENGTH {self.loops.length!r}
#define FMU_ACCEPTED {self.loops.accepted!r}
#define FMU_CLOSED {self.loops.closed_within!r}
#define FMU_RANK {TOLERANCES["rank"]!r}

static void fmu_opening(const double *q, const double *v, double *error, double *rate) {{
  {self.name}_opening(q, v, error, rate);
}}

#include "closing.h"

"""
        )

    def in_motion(self) -> str:
        """The motion follows from efforts.  Steps are counted as m.simulate counts those between two times."""
        closed = self.loops is not None
        opened = "  for (k = FMU_A; k < FMU_A + FMU_NV && !fmu_is_closed(x + FMU_Q, x + FMU_V); ++k)\n    x[k] = (fmu_real)NAN;\n" if closed else ""
        close = (
            '    if (!fmu_close(x + FMU_Q, x + FMU_V))\n      return "no closed position is near the end of a step; take a smaller step, or smaller efforts";\n'
            if closed
            else ""
        )
        pivots = ", or its pivots are too small where this code has fixed them, and m.simulate takes others" if closed else ""
        return f"""\
#define FMU_RK4 {int(self.method == "rk4")}
#define FMU_FLAT {int(self.flat)}

static void fmu_accelerate(const fmu_real *q, const fmu_real *v, const fmu_real *tau, fmu_real *a) {{
  {self.name}_forward_dynamics(q, v, tau, a);
}}

#include "fixed_step.h"

static void fmu_begin(fmu_real *x) {{
  memcpy(x + FMU_Q, x + FMU_Q_START, FMU_NQ * sizeof *x);
  memcpy(x + FMU_V, x + FMU_V_START, FMU_NV * sizeof *x);
}}

static void fmu_compute(fmu_real *x) {{
{"  int k;" + chr(10) if closed else ""}  fmu_accelerate(x + FMU_Q, x + FMU_V, x + FMU_TAU, x + FMU_A);
{opened}{self.reactions()}}}

/* Goes on by a communication step; returns what is wrong, or NULL. */
static const char *fmu_go(fmu_real *x, double begin, double length) {{
  const double end = begin + length, larger = fabs(begin) > fabs(end) ? fabs(begin) : fabs(end);
  const double exact = (length - 2 * DBL_EPSILON * larger) / (double)x[FMU_STEP] * (1 - {PRECISION[self.scalar][1]!r});
  const double steps = exact > 1 ? ceil(exact) : 1;
  long s;
  int k;
  if (!(steps <= {MOST_STEPS}))
    return "the motion takes more than {MOST_STEPS} steps; take a smaller step of communication, or a larger parameter step";
  for (s = 0; s < (long)steps; ++s) {{
    fmu_accelerate(x + FMU_Q, x + FMU_V, x + FMU_TAU, x + FMU_A);
    fmu_fixed_step((fmu_real)(length / steps), x + FMU_Q, x + FMU_V, x + FMU_TAU, x + FMU_A);
    for (k = FMU_Q; k < FMU_V + FMU_NV; ++k)
      if (!isfinite(x[k]))
        return "the motion is no longer finite: the mechanism is singular there{pivots}; take a smaller step, or smaller efforts";
{close}  }}
  return NULL;
}}
"""
