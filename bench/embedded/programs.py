"""A program for a microcontroller: calls each generated function, and shows what it takes and computes."""

import re
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from targets import Target

from ksl import Model
from ksl.generation.arguments import arguments_given
from ksl.generation.files import Code
from ksl.generation.self_test import STATES
from ksl.generation.requests import Function, functions_of

LARGE = 1e6
"""An angle that takes the way of large ones: deeper in the stack, and longer."""


@dataclass
class Measured:
    """One function on one target."""

    instructions: int
    """Of a call, the most of the states of the self-test."""
    stack: int
    """Bytes below the caller, with those of the compiler's library, of angles small and large."""
    declared: int
    """Bytes of the frames of the function and of all that it may call of the generated file."""


def code_of(model: Model, name: str, scalar: str, algorithms: list[str]) -> Code:
    return Code(model, name, scalar, False, functions_of(model, algorithms, arguments_given(model, ()), scalar == "float", "refuse"))


def write(code: Code, folder: Path) -> Path:
    """The generated files, and `measure.c`.  Returns the generated source."""
    folder.mkdir(parents=True, exist_ok=True)
    for file, text in code.files().items():
        (folder / file).write_text(text)
    (folder / "measure.c").write_text(program(code))
    return folder / f"{code.name}.c"


def program(code: Code) -> str:
    """Text of the program, whose first pair of marks has nothing between.  Inputs are those of the self-test, which it runs at the end."""
    calls = "".join(_calls(code, f) for f in code.functions)
    large = ", ".join([f"{LARGE}f" if code.scalar == "float" else f"{LARGE}"] * code.model.nq)
    return f"""\
#define main self_test
#include "{code.name}_test.c"
#undef main
#include "probe.h"

static const {code.scalar} large[] = {{{large}}};

int main(void) {{
  int k;
  mark(), mark();
{calls}  return self_test();
}}
"""


def _calls(code: Code, f: Function) -> str:
    results = "".join(f"    static {code.scalar} {name}[{max(1, prod(shape))}];\n" for name, shape in f.recording.results)
    out = ", ".join(name for name, _ in f.recording.results)
    call = f"{code.function(f)}({', '.join(f'{f.name}_{name}[k]' for name, _ in f.recording.inputs)}, {out});"
    at_large = call.replace(f"{f.name}_q[k]", "large")
    shown = "".join(f'      print_bytes("{f.name}", k, {name}, sizeof {name});\n' for name, _ in f.recording.results)
    return f"""\
  {{
{results}    for (k = 0; k < {STATES}; ++k) {{
      mark(); {call} mark();
{shown}    }}
    k = 0;
    paint(); {call} {at_large} printf("stack {f.name} %u\\n", touched());
    k = {STATES};
{shown}  }}
"""


def measured(target: Target, code: Code, folder: Path, plugin: Path) -> dict[str, Measured]:
    """Compiles and runs it, compares every bit of the results with the engine's, and returns what each function takes."""
    source = write(code, folder)
    obj, elf = folder / "code.o", folder / "measure.elf"
    target.compile(source, obj)
    target.link(elf, [folder / "measure.c", obj], [folder])
    printed, counts = target.emulated(elf, plugin)
    compare(code, printed)
    _, nothing, *rest = counts
    calls, found = iter(rest[1::2]), {}
    for f in code.functions:
        instructions = max(next(calls) for _ in range(STATES)) - nothing
        found[f.name] = Measured(instructions, int(match(rf"stack {f.name} (\d+)", printed)), declared(folder / "code.su", code, f))
    return found


def compare(code: Code, printed: str) -> None:
    """Raises RuntimeError where a result doesn't have the engine's bits, or the self-test didn't end well."""
    kind = np.float32 if code.scalar == "float" else np.float64
    match("(all results agree)", printed)
    for f in code.functions:
        for k in range(STATES + 1):
            lines = re.findall(rf"bytes {f.name} {k} (\w+)", printed)
            for line, expected in zip(lines, f.results(code.model, state_of(code, f, k)), strict=True):
                found = np.frombuffer(bytes.fromhex(line), kind)
                if not np.array_equal(found, np.asarray(expected, kind).reshape(-1)):
                    raise RuntimeError(f"{f.name}, state {k}: bits of {code.scalar} differ from the engine's: {found} instead of {expected}")


def state_of(code: Code, f: Function, k: int) -> list[Any]:
    """The self-test's states; after these its first state with large angles."""
    if k < STATES:
        return code.self_test.state_of(f, k)
    inputs = dict(zip((name for name, _ in f.recording.inputs), code.self_test.state_of(f, 0)))
    return [np.full_like(x, LARGE) if name == "q" else x for name, x in inputs.items()]


def match(pattern: str, text: str) -> str:
    found = re.search(pattern, text)
    if not found:
        raise RuntimeError(f"the program didn't print {pattern}: {text}")
    return found[1]


def declared(usage: Path, code: Code, f: Function) -> int:
    """What -fstack-usage says of the function and of all helpers, which are those of its sine."""
    frames = {line.split(":")[-1].split()[0]: int(line.split("\t")[1]) for line in usage.read_text().splitlines()}
    public = {code.function(g) for g in code.functions}
    return frames[code.function(f)] + sum(size for name, size in frames.items() if name not in public)
