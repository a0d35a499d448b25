"""`NAME_lanes.h` and `NAME_lanes.c`: the same functions of many states, which are computed in the compiler's vectors."""

from __future__ import annotations

from collections.abc import Sequence

from ksl.base.errors import ArgumentError, of_argument
from ksl.generation.batches import INCLUDED, Batch, definitions, in_words
from ksl.generation.c99 import NOT_FUSED
from ksl.generation.requests import Function

POSSIBLE = (2, 4, 8, 16)
"""Numbers of a vector."""
LARGEST_STACK = 4 << 20
"""Bytes that a function takes at most: half of what a program's first thread has on Linux."""


def lanes_header(first_line: str, name: str, scalar: str, lanes: int, batches: Sequence[Batch]) -> str:
    declared = "".join(
        f"/* {batch.bytes():,} bytes of stack, and what its steps take. */\nvoid {name}_lanes_{batch.function.name}({parameters(batch.function, scalar)});\n"
        for batch in batches
    )
    return f"""\
/* {first_line}

   The functions of {name}.h for n states, {lanes} at a time.  Arrays have a row for each state, one behind the other, and each row is as there.  A result
   may lie where an input of the same length is.  States are computed one by one as there, with the same results. */
#ifndef {name.upper()}_LANES_H
#define {name.upper()}_LANES_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {{
#endif

{declared}
#ifdef __cplusplus
}}
#endif

#endif
"""


def parameters(function: Function, scalar: str) -> str:
    recording = function.recording
    return ", ".join(["size_t n", *(f"const {scalar} *{name}" for name, _ in recording.inputs), *(f"{scalar} *{name}" for name, _ in recording.results)])


def lanes_files(first_line: str, name: str, scalar: str, lanes: int, functions: Sequence[Function], contract: bool) -> dict[str, str]:
    prefix = f"{name}_"
    batches = [Batch(function, number, prefix, scalar, lanes, of_library=False) for number, function in enumerate(functions)]
    parts = [f'/* {first_line} */\n#include "{name}_lanes.h"\n', INCLUDED, "" if contract else NOT_FUSED, definitions(batches, judged=False)]
    for batch in batches:
        parts += [batch.text(), call_of(batch, scalar, lanes)]
        if batch.bytes() > LARGEST_STACK:
            more = f": {batch.function.name} of this robot takes {batch.bytes():,} bytes of stack for so many states at a time, more than {LARGEST_STACK:,}; ask for fewer lanes, or for 0"
            raise of_argument(ArgumentError, "lanes", more, lanes)
    return {f"{name}_lanes.h": lanes_header(first_line, name, scalar, lanes, batches), f"{name}_lanes.c": "\n".join(parts)}


def call_of(batch: Batch, scalar: str, lanes: int) -> str:
    """The function that a program calls: rows lie one behind the other, and memory is on the stack."""
    given = ", ".join(f"{{(REAL *){name}, {size}}}" for name, size, _ in batch.inputs)
    wanted = ", ".join(f"{{{name}, {size}}}" for name, size, _ in batch.results)
    text = f"""\
void @lanes_{batch.function.name}($PARAMETERS$) {{
  const @rows inputs[] = {{{given}}}, results[] = {{{wanted}}};
  @lanes memory[{max(batch.kept, 1)}];
  @states_{batch.number}(n, inputs, results, memory);
}}
"""
    return in_words(text, batch.prefix, scalar, lanes).replace("$PARAMETERS$", parameters(batch.function, scalar))
