"""`NAME_lanes.h` and `NAME_lanes.c`: the same functions of many states, which are computed in the compiler's vectors."""

from __future__ import annotations

from collections.abc import Sequence

from ksl.generation.batches import INCLUDED, Batch, definitions, in_words
from ksl.generation.c99 import NOT_FUSED
from ksl.generation.requests import Function

POSSIBLE = (2, 4, 8, 16)
"""Numbers of a vector."""


def lanes_header(first_line: str, name: str, scalar: str, lanes: int, functions: Sequence[Function]) -> str:
    declared = "".join(f"void {name}_lanes_{f.name}({parameters(f, scalar)});\n" for f in functions)
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


def lanes_source(first_line: str, name: str, scalar: str, lanes: int, functions: Sequence[Function], contract: bool) -> str:
    prefix = f"{name}_"
    batches = [Batch(function, number, prefix, scalar, lanes, of_library=False) for number, function in enumerate(functions)]
    parts = [f'/* {first_line} */\n#include "{name}_lanes.h"\n', INCLUDED, "" if contract else NOT_FUSED, definitions(batches, judged=False)]
    for batch in batches:
        parts += [batch.text(), call_of(batch, scalar, lanes)]
    return "\n".join(parts)


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
