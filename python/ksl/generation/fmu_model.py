"""`fmu_model.h`: what the C of `fmi3/` needs to know of one mechanism: where its numbers lie, start values, and calls of the generated functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ksl._core import QUATERNION_ROUNDING
from ksl.generation.fmu_variables import Kind, Layout

if TYPE_CHECKING:
    from ksl.model.model import Model

MOST_STEPS = 10_000_000
"""So many steps one communication step has at most, as a run of `m.simulate` has."""


@dataclass(frozen=True)
class FmuModel:
    """name: prefix of the generated functions; flat: do positions move by addition?"""

    model: Model
    name: str
    kind: Kind
    layout: Layout
    method: str
    flat: bool
    first_line: str

    def header(self, token: str) -> str:
        starts = ", ".join(repr(v.start) for v in self.layout.variables)
        places = "".join(f"#define FMU_{group.upper()} {place}\n" for group, place in self.layout.places.items())
        return f"""\
/* {self.first_line} */
#ifndef KSL_FMU_MODEL_H
#define KSL_FMU_MODEL_H

#include "{self.name}.h"

#define FMU_TOKEN "{token}"
#define FMU_NQ {self.model.nq}
#define FMU_NV {self.model.nv}
#define FMU_NUMBERS {len(self.layout.variables)}
#define FMU_FIRST_INPUT {self.layout.first("input")}
#define FMU_FIRST_OUTPUT {self.layout.first("output")}
{places}
static const double fmu_starts[FMU_NUMBERS] = {{
    {starts}}};

{self.judged()}{self.in_motion() if self.kind == "forward" else self.given()}
#endif
"""

    def judged(self) -> str:
        """What is wrong with numbers that were set, or NULL."""
        quaternions = f"""\
  static const int quaternions[] = {{{", ".join(map(str, self.layout.quaternions))}}};
  size_t k;
  for (k = 0; k < sizeof quaternions / sizeof *quaternions; ++k) {{
    const double *const c = x + quaternions[k];
    if (!(fabs(c[0] * c[0] + c[1] * c[1] + c[2] * c[2] + c[3] * c[3] - 1) <= {2 * QUATERNION_ROUNDING!r}))
      return "a quaternion, qx qy qz qw, is not of unit length";
  }}
"""  # fmt: skip
        step = '  if (!(x[FMU_STEP] > 0))\n    return "the parameter step must be above zero";\n'
        return f"""\
static const char *fmu_wrong(const double *x) {{
  (void)x;
{step if self.kind == "forward" else ""}{quaternions if self.layout.quaternions else ""}  return NULL;
}}

"""

    def reactions(self) -> str:
        return f"  {self.name}_reactions(x + FMU_Q, x + FMU_V, x + FMU_A, x + FMU_REACTIONS);\n" if "reactions" in self.layout.places else ""

    def given(self) -> str:
        """The motion is an input."""
        return f"""\
static void fmu_begin(double *x) {{ (void)x; }}

static void fmu_compute(double *x) {{
  {self.name}_inverse_dynamics(x + FMU_Q, x + FMU_V, x + FMU_A, x + FMU_TAU);
{self.reactions()}}}

static int fmu_go(double *x, double begin, double length) {{
  (void)x, (void)begin, (void)length;
  return 1;
}}
"""

    def in_motion(self) -> str:
        """The motion follows from efforts.  Steps are counted as m.simulate counts those between two times."""
        move = "  int i;\n  for (i = 0; i < FMU_NQ; ++i)\n    out[i] = q[i] + u[i];\n" if self.flat else f"  {self.name}_integrate(q, u, out);\n"
        return f"""\
#define FMU_RK4 {int(self.method == "rk4")}
#define FMU_FLAT {int(self.flat)}

static void fmu_accelerate(const double *q, const double *v, const double *tau, double *a) {{
  {self.name}_forward_dynamics(q, v, tau, a);
}}

static void fmu_move(const double *q, const double *u, double *out) {{
{move}}}

#include "fixed_step.h"

static void fmu_begin(double *x) {{
  memcpy(x + FMU_Q, x + FMU_Q_START, FMU_NQ * sizeof *x);
  memcpy(x + FMU_V, x + FMU_V_START, FMU_NV * sizeof *x);
}}

static void fmu_compute(double *x) {{
  fmu_accelerate(x + FMU_Q, x + FMU_V, x + FMU_TAU, x + FMU_A);
{self.reactions()}}}

/* Goes on by a communication step; 0 where numbers are no longer finite. */
static int fmu_go(double *x, double begin, double length) {{
  const double end = begin + length, larger = fabs(begin) > fabs(end) ? fabs(begin) : fabs(end);
  const double exact = (length - 2 * DBL_EPSILON * larger) / x[FMU_STEP] * (1 - 1e-12);
  const double steps = exact > 1 ? ceil(exact) : 1;
  long s;
  int k, finite = 1;
  if (!(steps <= {MOST_STEPS}))
    return 0;
  for (s = 0; s < (long)steps; ++s) {{
    fmu_accelerate(x + FMU_Q, x + FMU_V, x + FMU_TAU, x + FMU_A);
    fmu_fixed_step(length / steps, x + FMU_Q, x + FMU_V, x + FMU_TAU, x + FMU_A);
  }}
  for (k = FMU_Q; k < FMU_V + FMU_NV; ++k)
    finite &= isfinite(x[k]) != 0;
  return finite;
}}
"""
