"""Text in cells of CSV files, which spreadsheets must not take for formulas.

A spreadsheet runs a cell that begins with one of `= + - @`, a tab or a carriage return, quoted or not.  Such texts, names of joints
or load cases, are written with an apostrophe before them, by which spreadsheets know text; readers of KSL remove it again.
A text that already has apostrophes before such a sign gets one more, so that every name reads back as it was.
(OWASP, CSV injection.)  Numbers are written as they are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ksl.printable import one_line

if TYPE_CHECKING:
    import pyarrow as pa

_SIGNS = "=+\\-@\t\r\uff1d\uff0b\uff0d\uff20"
_FORMULA = re.compile(f"'*[{_SIGNS}]")
_GUARDED = re.compile(f"'+[{_SIGNS}]")

_IN_COMMENT = re.compile(r"([,;|]\s*)(?=[=@\uff1d\uff20]|[-+\uff0b\uff0d](?!\d*\.?\d+(?:[eE][-+]?\d+)?\s*(?:[,;|\])}]|$)))")
"""A separator, with a sign behind it that does not begin a plain number."""


def csv_text(text: str) -> str:
    """A text as it stands in a cell."""
    return f"'{text}" if _FORMULA.match(text) else text


def text_of_cell(cell: str) -> str:
    """The inverse of :func:`csv_text`."""
    return cell[1:] if _GUARDED.match(cell) else cell


def csv_comment(text: str) -> str:
    """A line of text above a table, which spreadsheets split at separators, too: what would be a formula behind one is guarded."""
    return _IN_COMMENT.sub(r"\1'", one_line(" ".join(text.split())))


def csv_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row by names, for csv.DictWriter."""
    return {csv_text(name): csv_text(x) if isinstance(x, str) else x for name, x in row.items()}


def csv_table(table: pa.Table) -> pa.Table:
    """A table whose texts and names of columns are those of cells."""
    import pyarrow as pa
    import pyarrow.compute as pc

    def cells(words: Any) -> Any:
        if isinstance(words, pa.ChunkedArray):
            return pa.chunked_array([cells(chunk) for chunk in words.chunks], words.type)
        if isinstance(words, pa.DictionaryArray):  # each word once
            return pa.DictionaryArray.from_arrays(words.indices, cells(words.dictionary))
        if not (pa.types.is_string(words.type) or pa.types.is_large_string(words.type)):
            return words
        return pc.replace_substring_regex(words, pattern=f"^('*[{_SIGNS}])", replacement="'\\1")

    return pa.table([cells(column) for column in table.columns], [csv_text(name) for name in table.column_names])
