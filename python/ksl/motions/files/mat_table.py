"""MATLAB's files of version 5 to 7.2: `time` and `q` (n, nq), or a variable for each column."""

from __future__ import annotations

import math
import struct
from typing import BinaryIO

from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.base.words import listed
from ksl.motions.columns.recorded import check_columns, check_numbers
from ksl.motions.files.mat_elements import Variable, variables
from ksl.motions.files.npz_table import NAMES, NpzTable, table_of_arrays

NUMBERS = ("double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
"""MATLAB's classes of numbers."""
TEXTS = ("char", "cell")
MEND = "save arrays: save('motion.mat', 'time', 'q')"


def mat_table(file: str, source: BinaryIO) -> NpzTable:
    """The variables of a file.  Raises MotionError: for structs and objects too, before any number is converted."""
    with source:
        data = source.read()
    try:
        found = variables(file, data)
        _check(file, found)
        lists = {each.name: _names(file, each) for each in found if each.name in NAMES and each.kind in TEXTS}
        arrays = {each.name: each.numbers() for each in found if each.kind in NUMBERS and not each.is_complex}
    except (ValueError, KeyError, IndexError, StopIteration, struct.error) as e:
        if isinstance(e, MotionError):
            raise
        raise MotionError(f"{file}: is a MATLAB file, but truncated or damaged; save it again, or write it by writetable(…, 'motion.csv')") from None
    alone = [each.name for each in found if each.kind in NUMBERS and math.prod(each.shape) == 1]  # holds for the whole motion, the rate say
    left_out = {*lists, *alone}
    others = {
        each.name: "" if each.name in arrays else f"a {each.kind}" + " of complex numbers" * each.is_complex for each in found if each.name not in left_out
    }
    table = table_of_arrays(file, "MATLAB file", others, arrays, lists, squares_are_clear=False)
    table.kinds = {each.name: "complex numbers" for each in found if each.is_complex}
    if alone:
        table.notes.append(f"left out, since they are single numbers: {listed(alone)}")
    return table


def _check(file: str, found: list[Variable]) -> None:
    """Raises MotionError for files without arrays, and for more than is read."""
    check_columns(file, len(found))
    if not any(each.kind in NUMBERS for each in found):
        held = listed([f"{each.name} ({each.kind})" for each in found]) or "nothing"
        raise MotionError(f"{file}: holds no arrays of numbers, but {held}; {MEND}")
    check_numbers(file, sum(math.prod(each.shape) for each in found if each.kind in NUMBERS))
    seen: set[str] = set()
    for each in found:
        if each.name in seen:
            raise MotionError(f"{file}: two variables are named {each.name!r}; save one of them")
        seen.add(each.name)
        if each.name in NAMES and each.kind in TEXTS and math.prod(each.shape) > limits.COLUMNS * 64:
            raise MotionError(f"{file}: {each.name} holds {math.prod(each.shape):,} characters or cells, which are no names of joints")


def _names(file: str, given: Variable) -> list[str]:
    """Names in a cell array of texts, or in rows of characters, which MATLAB fills with blanks."""
    if given.kind == "char":
        return given.rows()
    names: list[str] = []
    for cell in given.cells():
        if cell.kind != "char":
            raise MotionError(f"{file}: {given.name} holds {cell.kind} in a cell; expected the names of joints, texts")
        names.append("".join(cell.rows()))
    return names
