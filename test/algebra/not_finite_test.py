"""api/not_finite.tsv says of every function of the algebra and of all algorithms what NaN, infinities and subnormal numbers give.
A function in single precision stands beside its twin in double where both give the same.

A function that the table lacks, or whose row is not what happens, fails.  `python test/algebra/not_finite_test.py` writes the table.
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

sys.path.insert(0, str(Path(__file__).parent))
from every_number import FUNCTIONS, NOT_HERE, arguments, changes, differ, is_number, results, varied, with_numbers
from functions import everything, published

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "api/not_finite.tsv"
ALGORITHMS = "every algorithm"
"""The name of a row: test/mechanism/not_finite_calls_test.py tries each of them."""
HEAD = "names\tNaN\tinfinity\tsubnormal numbers"
TESTED = {f.name for f in with_numbers()}
ELSEWHERE = {
    "inertia_factor": "refused", "inertia_rank": "refused", "larger_q": "a choice", "atEnd_q": "a choice",
    "mat3x3_toQuaternionRay": "a choice", "axis_getIndices": "-", "joint_space_setCoordinate": "-",
}  # fmt: skip
"""Functions that return a status or a choice: errata_test.py and the functions that use them."""


DENSE = {f.name for f in published() if f.header in ("linalg.h", "array.h")}
"""Functions of arrays of any size: docs/algebra.md says what pivots that are NaN give; linalg_test.py."""


def every_name() -> list[str]:
    return list(dict.fromkeys([f.name for f in published()] + list(everything())))


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


def table() -> dict[str, tuple[str, ...]]:
    lines = TABLE.read_text().splitlines()
    assert lines[0] == HEAD
    return {name: tuple(rest) for names, *rest in (line.split("\t") for line in lines[1:]) for name in names.split(", ")}


def lines_of(rows: dict[str, tuple[str, ...]]) -> list[str]:
    """Lines of the table, of twins with the same row in the place of the first."""
    together: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for name, row in rows.items():
        f = FUNCTIONS.get(name)
        together.setdefault((f.double or name if f else name, row), []).append(name)
    return ["\t".join((", ".join(names), *row)) for (_, row), names in together.items()]


def test_every_function_is_in_the_table():
    wanted = [*every_name(), ALGORITHMS]
    assert set(table()) == set(wanted) and TABLE.read_text().splitlines()[1:] == lines_of({name: table()[name] for name in wanted}), (
        "python test/algebra/not_finite_test.py writes the table"
    )


def test_what_is_tested_elsewhere_is_named():
    """Every function that takes numbers is either tested for NaN, or is one of the few that return a status or a choice."""
    assert set(ELSEWHERE) == NOT_HERE


@pytest.mark.parametrize("part", range(8))
def test_the_table_says_what_happens(ksl, part):
    rows = table()
    wrong = {name: (rows[name], found) for name in every_name()[part::8] if (found := row_of(ksl, name)) != rows.get(name)}
    assert not wrong


def main() -> None:
    from library import Library

    library = Library()
    rows = {name: row_of(library, name) for name in every_name()}
    refused = "ValueError in Python; KSL_BAD_ARGUMENT in C for one state; passed on in C batches and C++"
    rows[ALGORITHMS] = (refused, refused, "computed")
    TABLE.write_text("\n".join([HEAD, *lines_of(rows)]) + "\n")


if __name__ == "__main__":
    main()
