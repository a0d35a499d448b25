"""`NAME_test.c`: a program that calls each function in a few states, and ends with status 1 where a result differs from that of the library."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ksl.generation.arguments import OF_MODELS, some_numbers
from ksl.generation.c99 import Printer
from ksl.generation.open_reactions import closed_position
from ksl.generation.requests import Function
from ksl.generation.words import WIDTH
from ksl.mechanism.freedoms import idle_bodies

if TYPE_CHECKING:
    from ksl.model.model import Model

Numbers = NDArray[np.floating[Any]]
STATES = 3
TRIES = 20
"""So many states are tried for one that code of a closed mechanism has results of."""
TOLERANCE = {"double": 1e-12, "float": 1e-4}
"""The bound, relative to the largest number of a result: for compilers that fuse products and sums, too."""


@dataclass(frozen=True)
class SelfTest:
    """name: of the files; first_line: of all of them; lanes: of the functions of many states, 0 without."""

    model: Model
    name: str
    scalar: str
    lanes: int
    functions: Sequence[Function]
    first_line: str

    @property
    def prefix(self) -> str:
        return f"{self.name}_"

    def text(self) -> str:
        tests, calls = [], []
        for f in self.functions:
            text, call = self._test_of(f)
            tests.append(text)
            calls.append(call)
        return f"""\
/* {self.first_line}

   Every function in {STATES} states, against what KSL computes in {self.scalar} precision.  Ends with status 1 where a result differs. */
#include "{self.name}.h"
{f'#include "{self.name}_lanes.h"' if self.lanes else ""}
#include <math.h>
#include <stdio.h>

static int faults = 0;

static void compare(const char *what, int state, const {self.scalar} *found, const {self.scalar} *expected, int n) {{
  double largest = 0.0, worst = 0.0;
  int k;
  for (k = 0; k < n; ++k) {{
    const double size = fabs((double)expected[k]), error = fabs((double)found[k] - (double)expected[k]);
    largest = size > largest ? size : largest;
    worst = error <= worst ? worst : error; /* NaN is an error */
  }}
  if (worst <= {TOLERANCE[self.scalar]!r} * (largest + 1e-30))
    return;
  printf("%s, state %d: differs by %g of %g\\n", what, state, worst, largest);
  ++faults;
}}

{"".join(tests)}
int main(void) {{
{"".join(calls)}  printf(faults ? "%d results differ\\n" : "all results agree%.0d\\n", faults);
  return faults != 0;
}}
"""

    def _test_of(self, f: Function) -> tuple[str, str]:
        """Definitions and the lines of main of one function."""
        name, r = f"{self.prefix}{f.name}", f.recording
        written = np.split(r.outputs >= 0, np.cumsum(r.sizes())[:-1])  # what isn't stays zero in the program
        states = [self.served_state(f, k, written) for k in range(STATES)]
        expected = [[np.where(to, np.ravel(x), 0) for x, to in zip(f.results(self.model, state), written)] for state in states]
        printer = Printer(r, self.prefix)
        tables = [*zip([n for n, _ in r.inputs], zip(*states)), *((f"expected_{n}", [e[k] for e in expected]) for k, (n, _) in enumerate(r.results))]
        text = ""
        for what, rows in tables:
            size = max(1, len(rows[0]))
            numbers = ",\n".join("    {" + ", ".join(printer.literal(float(x)) for x in row) + "}" for row in rows)
            text += f"static const {self.scalar} {f.name}_{what}[{STATES}][{size}] = {{\n{_wrapped(numbers)}}};\n"
        sizes = [max(1, prod(shape)) for _, shape in r.results]
        found = "".join(f"  static {self.scalar} {n}[{size}];\n" for (n, _), size in zip(r.results, sizes))
        arguments = ", ".join([*(f"{f.name}_{n}[k]" for n, _ in r.inputs), *(n for n, _ in r.results)])
        checks = "".join(f'    compare("{f.name}: {n}", k, {n}, {f.name}_expected_{n}[k], {size});\n' for (n, _), size in zip(r.results, sizes))
        many = self._test_of_many(f, sizes) if self.lanes else ""
        body = (
            f"\nstatic void test_{f.name}(void) {{\n{found}  int k;\n  for (k = 0; k < {STATES}; ++k) {{\n    {name}({arguments});\n{checks}  }}\n{many}}}\n\n"
        )
        return text + body, f"  test_{f.name}();\n"

    def _test_of_many(self, f: Function, sizes: list[int]) -> str:
        """Lines that compute the states again and again, so many that lanes are full and some are left."""
        n = 2 * self.lanes + STATES
        inputs = [(name, max(1, size)) for name, size in f.recording.inputs]
        results = [(name, size) for (name, _), size in zip(f.recording.results, sizes)]
        arrays = "".join(f"    static {self.scalar} {name}_n[{n}][{size}];\n" for name, size in inputs + results)
        copies = "".join(f"      for (c = 0; c < {size}; ++c)\n        {name}_n[k][c] = {f.name}_{name}[k % {STATES}][c];\n" for name, size in inputs)
        checks = "".join(
            f'      compare("{f.name} in lanes: {name}", k % {STATES}, {name}_n[k], {f.name}_expected_{name}[k % {STATES}], {size});\n'
            for name, size in results
        )
        arguments = ", ".join(f"&{name}_n[0][0]" for name, _ in inputs + results)
        counter = "    int c;\n" if inputs else ""
        loop = f"for (k = 0; k < {n}; ++k) {{\n"
        return f"  {{\n{arrays}{counter}    {loop}{copies}    }}\n    {self.prefix}lanes_{f.name}({n}, {arguments});\n    {loop}{checks}    }}\n  }}\n"

    def served_state(self, f: Function, number: int, written: Sequence[NDArray[np.bool_]]) -> list[Numbers]:
        """The state of this number; of closed mechanisms the next one that the pivots of the plan serve, since results are NaN elsewhere."""
        for k in range(number, number + TRIES * STATES, STATES):
            state = self.state_of(f, k)
            if not self.model.loops or all(np.isfinite(x[to]).all() for x, to in zip(f.recording.play(state), written)):
                break
        return state

    def state_of(self, f: Function, number: int) -> list[Numbers]:
        """Numbers of each input of a state of the self-test.  The first is at rest; those of closed mechanisms are closed."""
        rng = np.random.default_rng(number + 1)
        dtype = np.float64 if self.scalar == "double" else np.float32
        given: dict[str, Numbers] = {}
        for k, (name, size) in enumerate(f.recording.inputs):
            if name in ("q", "q0", "q1"):
                x = closed_position(self.model, rng) if self.model.loops else self.model.random(number + 10 * k)
            elif name == "fraction":
                x = np.array([0.25 * (number + 1)])
            elif name in OF_MODELS:
                x = some_numbers(self.model, f.arguments, name, number)
            else:
                x = rng.normal(size=size) * (number > 0 or name.endswith(("_dot", "_bar")))
            given[name] = x
        if self.model.loops and "v" in given:
            # idle bodies have no spin: efforts are there without moments about their lines alone
            free = self.model.drives if self.model.drives and idle_bodies(self.model) else self.model.independent(given["q"])
            given["v"] = self.model.consistent_velocity(given["q"], given["v"], given=free)
            if "a" in given:
                given["a"] = self.model.consistent_acceleration(given["q"], given["v"], given["a"], given=free)
        return [np.asarray(x, dtype) for x in given.values()]


def _wrapped(text: str) -> str:
    """Rows of numbers in lines."""
    return "\n".join(
        "\n".join(textwrap.wrap(line, WIDTH, initial_indent="    ", subsequent_indent="     ", break_long_words=False)) for line in text.splitlines()
    )
