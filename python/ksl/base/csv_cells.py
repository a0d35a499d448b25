"""Text in cells of CSV files, which spreadsheets must not take for formulas (OWASP, CSV injection).

A spreadsheet runs a cell that begins with one of `= + - @`, a tab or a carriage return, quoted or not.  Names of joints and load cases
that begin so are written with an apostrophe before them, which marks text for spreadsheets.  The readers of KSL remove it.  A name that
already has apostrophes before such a sign gets one more, so that every name reads back as it was.  Numbers are written as they are.

A spreadsheet may split at semicolons or tabs instead of commas.  It then finds cells inside a name, where quotes around the whole name don't
help.  So a sign that follows a semicolon, a tab or a line end in the name, with blanks or quotes between, gets its apostrophe too.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ksl.base.printable import one_line

if TYPE_CHECKING:
    import pyarrow as pa

_INNER_SIGNS = "=+\\-@\uff1d\uff0b\uff0d\uff20"
_SIGNS = f"{_INNER_SIGNS}\t\r"
_FORMULA = re.compile(f"'*[{_SIGNS}]")
_GUARDED = re.compile(f"'+[{_SIGNS}]")
_INNER = f"([;\t\r\n])('*[ \"]*[{_INNER_SIGNS}])"
"""A formula inside a text, for programs that split there.  Without looking ahead, so that pyarrow can use it too."""
_INNER_FORMULA = re.compile(_INNER)
_INNER_GUARDED = re.compile(f"([;\t\r\n])'('*[ \"]*[{_INNER_SIGNS}])")

_IN_COMMENT = re.compile(r"([,;|][\s\"]*)(?=[=@\uff1d\uff20]|[-+\uff0b\uff0d](?!(?:\d+(?:\.\d+)?|\.\d+)(?:[eE][-+]?\d+)?\s*(?:[,;|\])}]|$)))")
"""A separator before a sign that does not begin a plain number."""


def csv_text(text: str) -> str:
    """A text as it is written into a cell."""
    text = _INNER_FORMULA.sub(r"\1'\2", text)
    return f"'{text}" if _FORMULA.match(text) else text


def text_of_cell(cell: str) -> str:
    """The inverse of :func:`csv_text`."""
    cell = cell[1:] if _GUARDED.match(cell) else cell
    return _INNER_GUARDED.sub(r"\1\2", cell)


def csv_comment(text: str) -> str:
    """A comment above a table, as one line.  Spreadsheets split it at separators, so what follows one gets an apostrophe where it is a formula."""
    return _IN_COMMENT.sub(r"\1'", one_line(" ".join(text.split())))


def csv_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row for csv.DictWriter: names of columns and texts as they are written into cells."""
    return {csv_text(name): csv_text(x) if isinstance(x, str) else x for name, x in row.items()}


def csv_table(table: pa.Table) -> pa.Table:
    """The table with its texts and names of columns as they are written into cells."""
    import pyarrow as pa
    import pyarrow.compute as pc

    def cells(words: Any) -> Any:
        if isinstance(words, pa.ChunkedArray):
            return pa.chunked_array([cells(chunk) for chunk in words.chunks], words.type)
        if isinstance(words, pa.DictionaryArray):  # each word once
            return pa.DictionaryArray.from_arrays(words.indices, cells(words.dictionary))
        if not (pa.types.is_string(words.type) or pa.types.is_large_string(words.type)):
            return words
        words = pc.replace_substring_regex(words, pattern=_INNER, replacement="\\1'\\2")
        return pc.replace_substring_regex(words, pattern=f"^('*[{_SIGNS}])", replacement="'\\1")

    return pa.table([cells(column) for column in table.columns], [csv_text(name) for name in table.column_names])
