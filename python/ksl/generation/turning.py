"""C text that turns rows of numbers into lanes, and back.

LANES rows that begin `stride` numbers apart become vectors of one column each.  K columns are turned at a time.  Vector j takes K numbers each of the
rows j, j + K, j + 2 K, …; then it consists of blocks of K × K numbers, one behind the other, with the same block of the K - 1 vectors after it, and each
is transposed by swapping halves, quarters, … of two vectors:

    a0 a1 | …      a0 b0 | …
    b0 b1 | …      a1 b1 | …
"""

from __future__ import annotations

from collections.abc import Iterator

HEAD = """\
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ < 12
#error "lanes need clang, or gcc 12 or newer"
#endif
"""


def types(prefix: str, scalar: str, lanes: int) -> str:
    """Vectors of fewer numbers than lanes; `u`: at any address."""
    text, length = "", 2
    while length <= lanes:
        size = f"{length} * sizeof({scalar})"
        text += f"typedef {scalar} {prefix}v{length} __attribute__((vector_size({size})));\n"
        text += f"typedef {scalar} {prefix}u{length} __attribute__((vector_size({size}), aligned(sizeof({scalar})), may_alias));\n"
        length *= 2
    return text


def _joined(prefix: str, of: list[str], length: int) -> str:
    """The vector of several of `length` numbers."""
    while len(of) > 1:
        places = ", ".join(str(k) for k in range(2 * length))
        of = [f"__builtin_shufflevector({a}, {b}, {places})" for a, b in zip(of[::2], of[1::2])]
        length *= 2
    return of[0]


def _transposed(names: list[str], lanes: int, vector: str) -> Iterator[str]:
    """Lines that transpose each block of as many vectors as there are names."""
    half = 1
    while half < len(names):
        for j, name in enumerate(names):
            if j % (2 * half) < half:
                other = names[j + half]
                low = [k - k % (2 * half) + k % half + (0 if k % (2 * half) < half else lanes) for k in range(lanes)]
                yield f"  {{\n    const {vector} low = __builtin_shufflevector({name}, {other}, {', '.join(map(str, low))});\n"
                yield f"    {other} = __builtin_shufflevector({name}, {other}, {', '.join(str(k + half) for k in low)});\n    {name} = low;\n  }}\n"
        half *= 2


def _loading(prefix: str, scalar: str, lanes: int, columns: int) -> str:
    """A function that loads so many columns of rows."""
    vector = f"{prefix}lanes"
    lines = []
    for j in range(columns):
        rows = [f"rows + {row} * stride" for row in range(j, lanes, columns)]
        if columns == 1:
            lines.append(f"  {vector} c{j} = {{{', '.join(f'*({row})' for row in rows)}}};\n")
        else:
            parts = [f"*(const {prefix}u{columns} *)({row})" for row in rows]
            lines.append(f"  {vector} c{j} = {_joined(prefix, parts, columns)};\n")
    names = [f"c{j}" for j in range(columns)]
    body = "".join(lines) + "".join(_transposed(names, lanes, vector)) + "".join(f"  out[{j}] = {name};\n" for j, name in enumerate(names))
    return f"static inline void {prefix}load_{columns}(const {scalar} *rows, ptrdiff_t stride, {vector} *out) {{\n{body}}}\n"


def _storing(prefix: str, scalar: str, lanes: int, columns: int, chosen: bool) -> str:
    """A function that stores so many columns; chosen: those that a table names."""
    vector = f"{prefix}lanes"
    names = [f"c{j}" for j in range(columns)]
    body = "".join(f"  {vector} {name} = in[{f'at[{j}]' if chosen else j}];\n" for j, name in enumerate(names)) + "".join(_transposed(names, lanes, vector))
    for j, name in enumerate(names):
        for i, row in enumerate(range(j, lanes, columns)):
            if columns == 1:
                body += f"  rows[{row} * stride] = {name}[{i}];\n"
            else:
                places = ", ".join(str(k) for k in range(i * columns, (i + 1) * columns))
                body += f"  *({prefix}u{columns} *)(rows + {row} * stride) = __builtin_shufflevector({name}, {name}, {places});\n"
    name, table = ("chosen", "const int *at, ") if chosen else ("store", "")
    return f"static inline void {prefix}{name}_{columns}(const {vector} *in, {table}{scalar} *rows, ptrdiff_t stride) {{\n{body}}}\n"


def turning(prefix: str, scalar: str, lanes: int, plain: bool, chosen: bool) -> str:
    """Definitions of `PREFIXload(rows, stride, columns, out)`; plain: and of `PREFIXstore(in, columns, rows, stride)`; chosen: and of
    `PREFIXstore_chosen(in, at, columns, rows, stride)`, whose table says which of the vectors is each column."""
    text, chunk = HEAD + types(prefix, scalar, lanes) + "\n", max(1, lanes // 2 if lanes > 2 else lanes)
    chunks = []
    while chunk:
        chunks.append(chunk)
        chunk //= 2
    text += "\n".join(_loading(prefix, scalar, lanes, k) for k in chunks) + "\n"
    inlined, rest = "static inline __attribute__((always_inline)) void", f"{scalar} *rows, ptrdiff_t stride"

    def loop(call: str) -> str:
        return "  int c = 0;\n" + "".join(f"  for (; columns - c >= {k}; c += {k})\n    {prefix}{call.format(k)};\n" for k in chunks)

    text += f"{inlined} {prefix}load(const {rest}, int columns, {prefix}lanes *out) {{\n{loop('load_{}(rows + c, stride, out + c)')}}}\n"
    for wanted, name, table, call in (
        (plain, "store", "", "store_{}(in + c, rows + c, stride)"),
        (chosen, "store_chosen", "const int *at, ", "chosen_{}(in, at + c, rows + c, stride)"),
    ):
        if wanted:
            text += "\n" + "\n".join(_storing(prefix, scalar, lanes, k, bool(table)) for k in chunks)
            text += f"\n{inlined} {prefix}{name}(const {prefix}lanes *in, {table}int columns, {rest}) {{\n{loop(call)}}}\n"
    return text
