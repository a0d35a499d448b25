"""The text of CasADi's external interface: functions, their Jacobians, and what CasADi asks about them.

Written after the C that CasADi 3.8 generates, and the page "Function objects" of its manual, section "Generating code".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ksl.base.errors import ArgumentError, of_argument
from ksl.generation.c99 import NOT_FUSED, Printer
from ksl.generation.casadi_blocks import CasadiFunction, functions_for_casadi
from ksl.generation.open_reactions import Undetermined
from ksl.generation.recording import Recording
from ksl.generation.requests import MOST_STATEMENTS, Function
from ksl.generation.sine_cosine import sine_cosine

if TYPE_CHECKING:
    from ksl.model.model import Model

HEAD = """\
#include <math.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

"""
SYMBOLS = """\
#ifndef casadi_real
#define casadi_real double
#endif
#ifndef casadi_int
#define casadi_int long long int
#endif

#if defined(_WIN32)
#define @EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define @EXPORT __attribute__((visibility("default")))
#else
#define @EXPORT
#endif

/* Parts of long functions stay apart: compilers take more than linear time for one function. */
#if defined(__GNUC__)
#define @PART __attribute__((noinline))
#else
#define @PART
#endif
"""
KINDS = ("jac_adj1_", "adj1_", "jac_")
FOOT = """
#ifdef __cplusplus
}
#endif
"""


class _Printer(Printer):
    """Prints functions that no other file calls."""

    def __init__(self, of: Recording, prefix: str) -> None:
        super().__init__(of, prefix)
        self.storage = "static "


def checked_derivatives(order: int) -> int:
    if order not in (1, 2):
        raise of_argument(ArgumentError, "derivatives", ": expected 1 for Jacobians, or 2 for second derivatives, too", order)
    return order


def casadi_source(model: Model, functions: Sequence[Function], first_line: str, prefix: str, shown: str, derivatives: int, undetermined: Undetermined) -> str:
    """prefix: of names inside; shown: that of functions.  Raises what `functions_for_casadi` raises, and ArgumentError where one would be too long."""
    every = [made for function in functions for made in functions_for_casadi(model, function, derivatives, undetermined)]
    for made in every:
        statements = sum(len(part.recording.operations) for part in made.parts)
        if statements > MOST_STATEMENTS:
            less = "ask for first derivatives alone" if made.name.startswith("jac_adj1_") else "call the library for it"
            raise ArgumentError(
                f"algorithms: {made.name} of this robot is {statements:,} statements, more than the {MOST_STATEMENTS:,} that are written; {less}"
            )
    longest = max((_elements(sparsity) for made in every for _, sparsity in made.inputs), default=1)
    zeros = f"/* What an input that isn't given is. */\nstatic const casadi_real {prefix}zeros[{max(longest, 1)}] = {{0}};\n"
    sine = sine_cosine(f"{prefix}math_", "double") if any(part.recording.angles for made in every for part in made.parts) else ""
    head = (HEAD + NOT_FUSED + SYMBOLS).replace("@", prefix.upper())
    title = f"/* {first_line} */\n" if first_line else ""
    return "\n".join([f"{title}{head}", sine, zeros, *(_text_of(made, prefix, shown) for made in every)]) + FOOT


def _elements(sparsity: Sequence[int]) -> int:
    """How many elements are stored."""
    rows, columns = sparsity[:2]
    return rows * columns if len(sparsity) == 3 else sparsity[2 + columns]


def _text_of(of: CasadiFunction, prefix: str, shown: str) -> str:
    kind = next((kind for kind in KINDS if of.name.startswith(kind)), "")  # CasADi looks for it before all of the name
    name = f"{kind}{shown}{of.name.removeprefix(kind)}"
    steps = [f"{prefix}{of.name}_steps{k + 1}" for k in range(len(of.parts))]
    computed = [_Printer(part.recording, prefix).function(f) for f, part in zip(steps, of.parts) if part.recording.results]
    calls = "".join(_call(f, of, k) for k, f in enumerate(steps) if of.parts[k].recording.results)
    export = f"{prefix.upper()}EXPORT"
    signature = "const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem"
    body = f"{export} int {name}({signature}) {{\n  (void)arg;\n  (void)res;\n  (void)iw;\n  (void)w;\n  (void)mem;\n{calls}  return 0;\n}}\n"
    return "\n".join([*computed, body, _answers(of, name, export)])


def _call(steps: str, of: CasadiFunction, number: int) -> str:
    """The call of a part, if any of its results is wanted.  Those that aren't wanted go to w, one over the other."""
    recording, prefix = of.parts[number].recording, steps.removesuffix(f"{of.name}_steps{number + 1}")
    inputs, results = ([name for name, _ in named] for named in (of.inputs, of.results))
    wanted = [f"res[{results.index(name)}]" for name, _ in recording.results]
    given = [f"{x} ? {x} : {prefix}zeros" for x in (f"arg[{inputs.index(name)}]" for name, _ in recording.inputs)]
    arguments = ", ".join([*given, *(f"{x} ? {x} : w" for x in wanted)])
    return f"  if ({' || '.join(wanted)})\n    {steps}({arguments});\n"


def _answers(of: CasadiFunction, name: str, export: str) -> str:
    """What CasADi asks about a function."""
    scratch = max((_elements(sparsity) for _, sparsity in of.results), default=0)
    sizes = (len(of.inputs), len(of.results), 0, scratch)
    kinds = ("const casadi_real *", "casadi_real *", "casadi_int", "casadi_real")
    pointers = ("sz_arg", "sz_res", "sz_iw", "sz_w")
    parameters = ", ".join(f"casadi_int *{p}" for p in pointers)
    work = "".join(f"  if ({p})\n    *{p} = {size};\n" for p, size in zip(pointers, sizes))
    work_bytes = "".join(f"  if ({p})\n    *{p} = {size} * (casadi_int)sizeof({kind});\n" for p, size, kind in zip(pointers, sizes, kinds))
    asked = [
        f"casadi_int {name}_n_in(void) {{ return {len(of.inputs)}; }}",
        f"casadi_int {name}_n_out(void) {{ return {len(of.results)}; }}",
        _chosen(f"const char *{name}_name_in", [f'"{x}"' for x, _ in of.inputs]),
        _chosen(f"const char *{name}_name_out", [f'"{x}"' for x, _ in of.results]),
        _sparsities(f"{name}_sparsity_in", [sparsity for _, sparsity in of.inputs]),
        _sparsities(f"{name}_sparsity_out", [sparsity for _, sparsity in of.results]),
        f"casadi_real {name}_default_in(casadi_int i) {{\n  (void)i;\n  return 0;\n}}",
        f"int {name}_work({parameters}) {{\n{work}  return 0;\n}}",
        f"int {name}_work_bytes({parameters}) {{\n{work_bytes}  return 0;\n}}",
        *(f"int {name}_{what}(void) {{ return 0; }}" for what in ("alloc_mem", "checkout")),
        f"int {name}_init_mem(int mem) {{\n  (void)mem;\n  return 0;\n}}",
        *(f"void {name}_{what}(int mem) {{ (void)mem; }}" for what in ("free_mem", "release")),
        *(f"void {name}_{what}(void) {{}}" for what in ("incref", "decref")),
    ]
    return "\n".join(f"{export} {text}" for text in asked) + "\n"


def _chosen(head: str, values: Sequence[str]) -> str:
    """A function of i that returns the i-th of these."""
    cases = "".join(f"  case {k}: return {value};\n" for k, value in enumerate(values))
    return f"{head}(casadi_int i) {{\n  switch (i) {{\n{cases}  default: return 0;\n  }}\n}}"


def _sparsities(name: str, of: Sequence[Sequence[int]]) -> str:
    tables = "".join(f"  static const casadi_int s{k}[] = {{{', '.join(map(str, sparsity))}}};\n" for k, sparsity in enumerate(of))
    text = _chosen(f"const casadi_int *{name}", [f"s{k}" for k in range(len(of))])
    head, brace, rest = text.partition("{\n")
    return f"{head}{brace}{tables}{rest}"
