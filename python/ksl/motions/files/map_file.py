"""Files that hold maps of columns, TOML or CSV, and maps that a program gives."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Iterator, Mapping

from ksl.base.csv_cells import text_of_cell
from ksl.base.errors import MotionError, near_names
from ksl.base.files_read import being_read
from ksl.base.toml_files import read_text, toml_of
from ksl.motions.columns.column_map import ColumnMap, ColumnRule
from ksl.motions.files.csv_form import doubts_about_end, form_of

KEYS = ("to", "unit", "sign", "scale", "offset")
TABLES = ("columns", "ignore", "constants", "rated")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
"""A number in a CSV map.  Python's `float` also takes `1_0`, and digits of other scripts."""


def read_map(given: str | os.PathLike[str] | Mapping[str, object]) -> ColumnMap:
    """A map from a TOML file, a CSV file `from,to[,unit,sign,scale,offset]`, or a mapping {column: name or rule}.  Raises MotionError.

    A TOML file has the table [columns], with lines `"column in the file" = "joint"` or
    `"column" = { to = "joint", unit = "deg", sign = -1, scale = 0.1, offset = 90 }`; and, if wanted, the list `ignore` of
    columns to leave out; the table [constants], with positions of joints that the file doesn't have (rad, m); and the table [rated], with the efforts
    of joints that are 1000 ‰ of measured ones (N m, N).
    """
    if isinstance(given, Mapping):
        return _of_tables("map", {"columns": given} if not set(given) & set(TABLES) else given)
    file = os.fspath(given)
    with being_read("map", file, MotionError):
        text = read_text(file, MotionError, "give a map of columns, a TOML or a CSV file")
    return map_of(text, file)


def map_of(text: str, file: str = "map") -> ColumnMap:
    """A map from the text of such a file, which messages call by this name.  Raises MotionError."""
    if not _is_toml(text):
        return _of_rows(file, text)
    table = toml_of(text, file, MotionError)
    return _of_tables(file, {"columns": table} if not set(table) & set(TABLES) else table)


def _is_toml(text: str) -> bool:
    lines = [line.strip() for line in text.splitlines()]
    return any("=" in line.split(",")[0] or line.startswith("[") for line in lines if line and not line.startswith("#"))


def _of_tables(file: str, table: Mapping[str, object]) -> ColumnMap:
    for key in table:
        if key not in TABLES:
            known = f"{near_names(key, TABLES)}known: {', '.join(TABLES)}"
            raise MotionError(f"{file}: unknown table {key!r}; {known}; a map of columns has its lines in [columns]")
    rules, ignored, constants, rated = table.get("columns", {}), table.get("ignore", []), table.get("constants", {}), table.get("rated", {})
    if not isinstance(rules, Mapping) or not isinstance(constants, Mapping) or not isinstance(rated, Mapping):
        raise MotionError(f"{file}: [columns], [constants] and [rated] are tables, with lines `name = …`")
    if not isinstance(ignored, list) or not all(isinstance(n, str) for n in ignored):
        raise MotionError(f'{file}: ignore is a list of columns: ignore = ["name", …]')
    for joint, value in constants.items():
        if not _is_number(value):
            raise MotionError(f"{file}: constants.{joint} is {value!r}; expected a position, a number in rad or m")
    for joint, value in rated.items():
        if not _is_number(value) or value <= 0:
            raise MotionError(f"{file}: rated.{joint} is {value!r}; expected the effort that is 1000 ‰, N m or N")
    found = {column: _rule(file, column, value) for column, value in _flat(rules)}
    return _checked(ColumnMap(file, found, tuple(ignored), {j: float(x) for j, x in constants.items()}, {j: float(x) for j, x in rated.items()}))


def _flat(table: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Lines of a table.  `hip.v = "x"` is a table in a table for TOML, but here a column `hip.v`."""
    for name, value in table.items():
        if isinstance(value, Mapping) and "to" not in value and not set(value) & set(KEYS):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _rule(file: str, column: str, value: object) -> ColumnRule:
    if isinstance(value, str):
        return ColumnRule(value)
    if not isinstance(value, Mapping):
        raise MotionError(f'{file}: column {column!r} is {value!r}; expected "name", or {{ to = "name", unit = …, sign = …, scale = …, offset = … }}')
    for key in value:
        if key not in KEYS:
            raise MotionError(f"{file}: column {column!r} has the unknown key {key!r}; {near_names(key, KEYS)}known: {', '.join(KEYS)}")
    to, unit = value.get("to", column), value.get("unit", "")
    if not isinstance(to, str) or not isinstance(unit, str):
        raise MotionError(f"{file}: column {column!r}: `to` and `unit` are texts")
    sign, scale, offset = (_number(file, column, key, value.get(key, default)) for key, default in (("sign", 1.0), ("scale", 1.0), ("offset", 0.0)))
    if sign not in (1.0, -1.0):
        raise MotionError(f"{file}: column {column!r} has sign {sign:g}; expected 1 or -1 (scale takes other numbers)")
    if scale == 0:
        raise MotionError(f"{file}: column {column!r} has scale 0; for a joint at rest give its position in [constants]")
    return ColumnRule(to, unit, sign, scale, offset)


def _is_number(x: object) -> bool:
    return isinstance(x, (int, float)) and not isinstance(x, bool) and math.isfinite(x)


def _number(file: str, column: str, key: str, value: object) -> float:
    if not isinstance(value, (int, float)) or not _is_number(value):
        raise MotionError(f"{file}: column {column!r} has {key} {value!r}; expected a number")
    return float(value)


def _of_rows(file: str, text: str) -> ColumnMap:
    """A CSV table: column of the file, column of the motion, and if wanted unit, sign, scale, offset."""
    form = form_of(file, text.encode(), "utf-8")
    if len(form.names) < 2:
        raise MotionError(f"{file}: expected a TOML file with [columns], or a CSV table with the columns from,to,unit,sign,scale,offset")
    rows = [_fields(f"{file}:{n}", line, form.separator) for n, line in enumerate(re.split("\r\n|\n|\r", text), 1)]
    keys = ["from", "to"]
    named = {n.strip().lower() for n in form.names} <= {"from", *KEYS}
    if named:
        keys = [n.strip().lower() for n in form.names]
    elif len(form.names) > 2:
        raise MotionError(f"{file}:{form.header_line}: expected the columns from,to,unit,sign,scale,offset; found {', '.join(form.names)}")
    rules: dict[str, ColumnRule] = {}
    for line, row in enumerate(rows, 1):
        if line < form.header_line + named or not any(x.strip() for x in row) or row[0].lstrip().startswith("#"):
            continue
        where = f"{file}:{line}"
        cells = {k: x.strip() for k, x in zip(keys, row) if x.strip()}
        if "from" not in cells or "to" not in cells:
            raise MotionError(f"{where}: expected a column of the file and a column of the motion, separated by a comma")
        values: dict[str, object] = dict(cells)
        for key in ("sign", "scale", "offset"):
            if key in cells:
                if _NUMBER.fullmatch(cells[key]) is None:
                    raise MotionError(f"{where}: {key} is {cells[key]!r}; expected a number")
                values[key] = float(cells[key])
        column = text_of_cell(str(values.pop("from")))
        values["to"] = text_of_cell(cells["to"])
        if column in rules:
            raise MotionError(f"{where}: column {column!r} stands in the map twice; remove one line")
        rules[column] = _rule(where, column, values)
    return _checked(ColumnMap(file, rules, doubts=tuple(doubts_about_end(file, text.encode()))))


def _fields(where: str, line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a field of more than 128 KiB
        raise MotionError(f"{where}: can't be split into columns; expected a column of the file and a column of the motion, separated by a comma") from None


def _checked(columns: ColumnMap) -> ColumnMap:
    seen: dict[str, str] = {}
    for column, rule in columns.rules.items():
        if rule.to in seen:
            both = f"columns {seen[rule.to]!r} and {column!r}"
            raise MotionError(f"{columns.file}: {both} are both to be {rule.to!r}; a column of the motion comes from one of the file")
        seen[rule.to] = column
    for joint in columns.constants:
        if joint in seen:
            raise MotionError(f"{columns.file}: {joint!r} is a constant, and comes from column {seen[joint]!r} too; remove one of them")
    return columns
