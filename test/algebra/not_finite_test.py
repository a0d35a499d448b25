"""api/functions.tsv says of every function of the algebra and of all algorithms what NaN, infinities and subnormal numbers give.

A function that the table lacks, or whose row is not what happens, fails.  `python test/algebra/not_finite_test.py` adds what is lacking and renews these columns.
test/mechanism/not_finite_calls_test.py tests the algorithms.

NaN: "propagates": nan_test.py tests it for every number.  "documented": functions of dense equations, as docs/algebra.md says; dense_not_finite_test.py tests it.
"-": the function takes no numbers, or prints or allocates.
Infinity, in each number of each argument in turn: "not finite" if all results that depend on the number are infinite or NaN; "some finite" if one
can be finite, as those of atan2, of a quotient, or of a choice.
Subnormal: "kept" if a subnormal argument comes back as a result; "computed" where results are not proportional to arguments."""

import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

sys.path[:0] = map(str, Path(__file__).parents[:2])
from every_number import FUNCTIONS, NOT_HERE, arguments, changes, differ, is_number, results, varied, with_numbers
from functions import TABLE, everything, rows_of_functions

ALGORITHMS = "every algorithm"
"""The name of a row: test/mechanism/not_finite_calls_test.py tries each of them."""
TESTED = {f.name for f in with_numbers()}
ELSEWHERE = {
    "inertia_factor": "refused", "inertia_rank": "refused", "larger_q": "a choice", "atEnd_q": "a choice",
    "mat3x3_toQuaternionRay": "a choice", "axis_getIndices": "-", "joint_space_setCoordinate": "-",
}  # fmt: skip
"""Functions that return a status or a choice: errata_test.py and the functions that use them."""


ROWS = list(rows_of_functions())
DENSE = {name for row in ROWS if row.header in ("linalg.h", "array.h") for name in row.names}
"""Functions of arrays of any size: docs/algebra.md says what pivots that are NaN give; linalg_test.py."""


def short(name: str) -> str:
    f = FUNCTIONS.get(name)
    return (f.double or name).removeprefix("ksl_") if f else name


def of_infinity(ksl, f) -> str:
    args = arguments(f, np.random.default_rng(zlib.crc32(f.name.encode())))
    before, found = results(ksl, f, args), False
    for _, after in varied(ksl, f, args, lambda x: [*changes(x)[::3], np.inf]):
        depends = differ(before, after[:-1])
        if (depends & np.isfinite(after[-1])).any():
            return "some finite"
        found |= depends.any()
    return "not finite" if found else "-"


def of_subnormals(ksl, f) -> str:
    """All numbers of the arguments but one are zero, and that one is subnormal: products of it with 0 and ±1 are exact."""
    args = arguments(f, np.random.default_rng(3))
    zeros = [np.zeros_like(x) if is_number(t) else x for t, x in zip(f.args, args)]
    tiny = lambda x: np.finfo(x.dtype).smallest_subnormal * 8
    found = varied(ksl, f, zeros, lambda x: [tiny(x)])
    return "kept" if any((np.abs(after) == float(tiny(zeros[k]))).any() for (k, _), after in found) else "computed"


def row_of(ksl, name: str) -> tuple[str, str, str]:
    f = FUNCTIONS.get(name)
    if name in DENSE:
        return ("documented", "documented", "computed")
    if name not in TESTED:
        return (ELSEWHERE.get(short(name), "-"), "-", "-")
    with np.errstate(all="ignore"):
        return "propagates", of_infinity(ksl, f), of_subnormals(ksl, f)


def lacking() -> dict[tuple[str, str], list[str]]:
    """Functions that the table has no row for: {(header, name in double precision): a function and its twin}."""
    known, twins = {name for row in ROWS for name in row.names}, {}
    for f in everything().values():
        if f.name not in known:
            twins.setdefault((f.header, f.double), []).append(f.name)
    return twins


def test_every_function_is_in_the_table():
    assert not lacking(), "python test/algebra/not_finite_test.py adds them"
    names = [name for row in ROWS for name in row.names]
    assert len(names) == len(set(names)) and names[-1] == ALGORITHMS


def test_what_is_tested_elsewhere_is_named():
    """Every function that takes numbers is either tested for NaN, or is one of the few that return a status or a choice."""
    assert set(ELSEWHERE) == NOT_HERE


@pytest.mark.parametrize("part", range(8))
def test_the_table_says_what_happens(ksl, part):
    wrong = {name: (row.not_finite, found) for row in ROWS[part:-1:8] for name in row.names if (found := row_of(ksl, name)) != row.not_finite}
    assert not wrong


def main() -> None:
    from library import Library

    library = Library()
    head, *lines, algorithms = TABLE.read_text().splitlines()
    lines += ["\t".join((header, ", ".join(names), "", "", "no", "no" if FUNCTIONS[names[0]].helper else "yes")) for (header, _), names in lacking().items()]
    for k, line in enumerate(lines):
        columns = line.split("\t")
        found = {row_of(library, name) for name in columns[1].split(", ")}
        if len(found) > 1:
            sys.exit(f"{columns[1]}: what these give differs, so each needs a row of its own")
        lines[k] = "\t".join([*columns[:6], *found.pop(), *columns[9:]])
    TABLE.write_text("\n".join([head, *lines, algorithms]) + "\n")


if __name__ == "__main__":
    main()
