"""Functions of many states: rows are turned into lanes, computed, and turned back.

A function takes the rows of inputs and results, and stops before the first block of lanes that has a result that isn't ordinary (src/engine/states/machine_code.hpp).
The states that are left at the end are copied into rows of their own, whose last ones are the same.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from ksl.generation.lanes import LanesPrinter, support
from ksl.generation.recording import Operation
from ksl.generation.requests import Function
from ksl.generation.rows import ROWS
from ksl.generation.sine_cosine import sine_cosine
from ksl.generation.turning import turning
from ksl.generation.words import WIDTH

MOST_LOCAL = 512
"""So many numbers in lanes are on the stack, 32 KB; more are in the caller's memory."""
MOST_STACK = 1 << 20
"""Bytes, where the caller's memory is on the stack, too: fewer blocks are computed at a time there, but for one."""
LARGEST = {False: {"double": 1e300, "float": 1e38}, True: {"double": 1e20, "float": 1e20}}
"""{squares are summed: what sums of ordinary results are below}, as the engine's kernels have it."""

INCLUDED = "#include <float.h>\n#include <math.h>\n#include <stddef.h>\n#include <stdint.h>\n"
ROWS_TYPE = """\
typedef struct {
  REAL *first;
  ptrdiff_t stride;
} @rows;

/* Rows of the states that are left; the last one again where lanes are without a state. */
static void @copy_last(const REAL *rows, ptrdiff_t stride, int columns, size_t states, REAL *out) {
  size_t k;
  int c;
  for (k = 0; k < LANES; ++k)
    for (c = 0; c < columns; ++c)
      out[k * (size_t)columns + (size_t)c] = rows[(ptrdiff_t)(k < states ? k : states - 1) * stride + c];
}

static void @copy_back(const REAL *rows, int columns, size_t states, REAL *out, ptrdiff_t stride) {
  size_t k;
  int c;
  for (k = 0; k < states; ++k)
    for (c = 0; c < columns; ++c)
      out[(ptrdiff_t)k * stride + c] = rows[k * (size_t)columns + (size_t)c];
}
"""


ORDINARY = """\
/* Are the results finite, and not large?  Their sum is. */
static inline int @ordinary(const @lanes *x, int n, REAL most, int of_squares) {
  @lanes sum[4] = {@all(ZERO), @all(ZERO), @all(ZERO), @all(ZERO)};
  @lanes all;
  int k;
  for (k = 0; k < n; ++k)
    sum[k & 3] += of_squares ? x[k] * x[k] : x[k];
  all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
  return @holds(@absolute(all) < @all(most)); /* false for NaN */
}

"""
LOOP = """\
static size_t @states_$NUMBER$(size_t n, const @rows *inputs, const @rows *results, @lanes *memory) {
$MEMORY$  size_t k, first;
  int b, blocks;
  (void)memory;
  for (first = 0; first < n; first = k) {
    for (k = first, blocks = 0; blocks < $BLOCKS$ && k < n; ++blocks, k += LANES) {
      const size_t left = n - k;
$GIVEN$      if (left < LANES) {
$LAST$      }
$LOAD$    }
    @steps_$NUMBER$($LISTED$, blocks);
    for (k = first, b = 0; b < blocks; ++b, k += LANES) {
      const size_t left = n - k;
$STOP$$WANTED$      if (left < LANES) {
$OWN$      }
$STORE$      if (left < LANES) {
$BACK$      }
    }
  }
  return n;
}
"""
INPUT = {
    "GIVEN": "      const REAL *X_k = inputs[K].first + (ptrdiff_t)k * inputs[K].stride;\n      ptrdiff_t X_d = inputs[K].stride;\n",
    "LAST": "        @copy_last(X_k, X_d, SIZE, left, X_last);\n        X_k = X_last;\n        X_d = SIZE;\n",
    "LOAD": "      @load(X_k, X_d, SIZE, PLACE);\n",
}
"""What the loop has of each input X."""
RESULT = {
    "WANTED": "      REAL *X_k = results[K].first ? results[K].first + (ptrdiff_t)k * results[K].stride : 0;\n      ptrdiff_t X_d = results[K].stride;\n",
    "OWN": "        if (X_k) {\n          X_k = X_last;\n          X_d = SIZE;\n        }\n",
    "STORE": "      if (X_k)\n        @STORED(PLACE, CHOSENSIZE, X_k, X_d);\n",
    "BACK": "        if (X_k)\n          @copy_back(X_last, SIZE, left, results[K].first + (ptrdiff_t)k * results[K].stride, results[K].stride);\n",
}


class Batch:
    """The function of many states for one recorded function.

    of_library: the library calls it: it stops before a block with a result that isn't ordinary, and each wrench has rows of its own.
    closed: the function is of a closed mechanism, whose large results the library looks at again."""

    def __init__(self, function: Function, number: int, prefix: str, scalar: str, lanes: int, of_library: bool = True, closed: bool = False) -> None:
        self.function, self.number, self.prefix, self.scalar, self.lanes, self.of_library = function, number, prefix, scalar, lanes, of_library
        self.judges_squares = of_library and (closed or ROWS[function.row].needs_mass)
        recording = function.recording
        self.printer, self.kept = LanesPrinter(recording, prefix), 0
        self.inputs: list[tuple[str, int, str]] = []
        """Names, numbers, and where their lanes go."""
        for name, size in recording.inputs:
            apart = name == "external" and of_library
            block = f"{name}_l + blocks * {size}"
            self.inputs += [(f"{name}{k}", 6, f"{block} + {6 * k}") for k in range(size // 6)] if apart else [(name, size, block)]
        self.distinct = [self.printer.sizes[name] for name, _ in recording.results]
        """So many numbers each result has in lanes."""
        self.results = [(name, size, f"{name}_l + b * {distinct}") for (name, _), size, distinct in zip(recording.results, recording.sizes(), self.distinct)]
        self.tables = {f"{name}_at": places for (name, _, _), places in zip(self.results, self.printer.columns) if places != list(range(len(places)))}
        """Which of them each number of a result is, where that isn't the same."""

    def memory(self) -> str:
        """Declarations of what has lanes or rows.  kept: so many packs of the caller's memory are taken."""
        lanes, (packs, rows) = f"{self.prefix}lanes", self.arrays()
        if sum(size for _, size in packs) <= MOST_LOCAL:
            text = "".join(f"  {lanes} {name}_l[{max(size, 1)}];\n" for name, size in packs)
            return text + "".join(f"  {self.scalar} {name}[{max(size, 1) * self.lanes}];\n" for name, size in rows)
        text = ""
        for name, size in packs:
            text += f"  {lanes} *const {name}_l = memory + {self.kept};\n"
            self.kept += size
        for name, size in rows:
            text += f"  {self.scalar} *const {name} = ({self.scalar} *)(memory + {self.kept});\n"
            self.kept += size
        return text

    def arrays(self) -> tuple[list[tuple[str, int]], list[tuple[str, int]]]:
        """What has lanes, for all blocks, and what has rows."""
        packs = [*self.function.recording.inputs, *((name, size) for (name, _, _), size in zip(self.results, self.distinct)), ("w", self.printer.kept)]
        rows = [(f"{name}_last", size) for name, size, _ in (*self.inputs, *self.results)]
        return [(name, size * self.printer.blocks) for name, size in packs], rows

    def bytes(self) -> int:
        """So many all of them have."""
        return sum(size for of in self.arrays() for _, size in of) * self.lanes * (8 if self.scalar == "double" else 4)

    def text(self) -> str:
        """The function in C: its steps, and the loop over states."""
        steps = self.printer.function(f"{self.prefix}steps_{self.number}")
        while not self.of_library and self.printer.blocks > 1 and self.bytes() > MOST_STACK:
            self.printer.blocks //= 2
        text = {"MEMORY": self.memory()}  # after the steps, whose parts keep numbers in w
        given = [name for name, _ in self.function.recording.inputs] + [name for name, _, _ in self.results]
        text["BLOCKS"] = str(self.printer.blocks)
        text["LISTED"] = ", ".join(f"{name}_l" for name in (*given, "w"))
        squares = self.judges_squares
        most = LARGEST[squares][self.scalar]
        ordinary = " && ".join(
            f"@ordinary({place}, {size}, {self.printer.literal(most)}, {int(squares)})" for (_, _, place), size in zip(self.results, self.distinct)
        )
        text["STOP"] = f"      if (!({ordinary}))\n        return k;\n" if self.of_library else ""
        text["MEMORY"] = "".join(map(_table, self.tables, self.tables.values())) + text["MEMORY"]
        for templates, all_ in ((INPUT, self.inputs), (RESULT, self.results)):
            for part, template in templates.items():
                text[part] = text.get(part, "") + "".join(
                    template.replace("STORED", "store_chosen" if f"{name}_at" in self.tables else "store")
                    .replace("CHOSEN", f"{name}_at, " if f"{name}_at" in self.tables else "")
                    .replace("SIZE", str(size))
                    .replace("PLACE", place)
                    .replace("X_", f"{name}_")
                    .replace("[K]", f"[{k}]")
                    for k, (name, size, place) in enumerate(all_)
                )
        loop = LOOP.replace("$NUMBER$", str(self.number))
        for part, lines in text.items():
            loop = loop.replace(f"${part}$", lines)
        return steps + "\n" + in_words(loop, self.prefix, self.scalar, self.lanes)


def _table(name: str, places: list[int]) -> str:
    """Which number in lanes each number of a result is."""
    lines = textwrap.wrap(", ".join(map(str, places)), WIDTH, initial_indent="    ", subsequent_indent="    ")
    return f"  static const int {name}[{len(places)}] = {{\n" + "\n".join(lines) + "};\n"


def in_words(text: str, prefix: str, scalar: str, lanes: int) -> str:
    """A text with the names and the numbers of its scalar."""
    for word, meaning in {"REAL": scalar, "ZERO": "0.0" if scalar == "double" else "0.0f", "LANES": str(lanes), "@": prefix}.items():
        text = text.replace(word, meaning)
    return text


def instruction_bytes(instructions: str) -> int:
    """Bytes of a register of the instruction set."""
    return {"x86-64-v4": 64, "x86-64-v3": 32}.get(instructions, 16)


def definitions(batches: Sequence[Batch], judged: bool) -> str:
    """What functions of many states call; judged: those of the library."""
    prefix, scalar, lanes = batches[0].prefix, batches[0].scalar, batches[0].lanes
    used = {Operation(int(what)) for batch in batches for what in set(batch.function.recording.operations.tolist())}
    parts = [f"#define {prefix.upper()}PART __attribute__((noinline))\n"]
    if used & {Operation.SINE, Operation.COSINE}:
        parts.append(sine_cosine(f"{prefix}one_", scalar))
    chosen = sum(len(batch.tables) for batch in batches)
    plain = sum(len(batch.results) for batch in batches) - chosen
    parts += [support(prefix, scalar, lanes, used, judged, f"{prefix}one_sine_cosine"), turning(prefix, scalar, lanes, plain > 0, chosen > 0)]
    return "\n".join([*parts, in_words(ROWS_TYPE + (ORDINARY if judged else ""), prefix, scalar, lanes)])


def source(functions: Sequence[Function], prefix: str, scalar: str, lanes: int, closed: bool = False) -> tuple[str, list[int]]:
    """The text of a library with a function `PREFIXcall_K` for each of the functions, and the bytes of memory that each needs."""
    batches = [Batch(function, number, prefix, scalar, lanes, closed=closed) for number, function in enumerate(functions)]
    parts = [INCLUDED, definitions(batches, judged=True)]
    for number, batch in enumerate(batches):
        parts += [
            batch.text(),
            in_words(
                f"size_t @call_{number}(size_t n, const @rows *inputs, const @rows *results, void *memory) {{\n  return @states_{number}(n, inputs, results, (@lanes *)memory);\n}}\n",
                prefix,
                scalar,
                lanes,
            ),
        ]
    return "\n".join(parts), [batch.kept * lanes * (8 if scalar == "double" else 4) for batch in batches]
