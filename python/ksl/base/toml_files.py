"""TOML files that people write: read, or refused with a sentence."""

from __future__ import annotations

import os
import re
import sys
from typing import Any

from ksl.base import limits
from ksl.base.input_files import Unreadable, contents, text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*"""
_BARE_PART = r"[\w-]+[ \t]*\.[ \t]*"
_LONG_KEY = re.compile(rf"^[ \t]*(?:\[{{1,2}}[ \t]*)?(?:{_PART}){{{limits.TOML_DEPTH}}}|[{{,][ \t]*(?:{_BARE_PART}){{{limits.TOML_DEPTH}}}", re.MULTILINE)
"""No two repetitions of blanks stand side by side, since the time would be quadratic in their number."""

_LONG_NUMBER = re.compile(r"\d\w{17}")
"""What may be a whole number of more than 64 bits: 19 digits, or 0x and 17."""


def read_toml(path: str | os.PathLike[str], error: type[ValueError], what: str) -> dict[str, Any]:
    """The tables of a TOML file.  Raises `error` for a file that can't be read; what: what it should hold, in words."""
    file = os.fspath(path)
    return toml_of(read_text(file, error, f"give a TOML file that describes {what}"), file, error)


def read_text(file: str, error: type[ValueError], mend: str) -> str:
    """The text of a file that people write.  Raises `error`."""
    try:
        return text(contents(file, limits.TOML_BYTES))
    except Unreadable as e:
        raise error(f"{file}: {e}; {mend}") from None


def toml_of(given: str, file: str, error: type[ValueError]) -> dict[str, Any]:
    """The tables of a text, which messages call by the name of a file.  Raises `error`; time is linear in the length."""
    plain = given.replace("\r\n", "\n")
    if "\r" in plain:
        raise error(f"{file}: is not TOML: its line ends are carriage returns alone, or lines hold some; save it with the line ends of Unix or Windows")
    found = _LONG_KEY.search(plain)
    if found:  # the parser takes quadratic time for them
        line = plain.count("\n", 0, found.end()) + 1
        raise error(f"{file}:{line}: a key of more than {limits.TOML_DEPTH} names with dots between them; put names that hold dots into quotes")
    try:
        tables = tomllib.loads(plain)
    except tomllib.TOMLDecodeError as e:
        raise error(f"{file}: is not TOML: {e}") from None
    except RecursionError:
        raise error(f"{file}: is not TOML that can be read: lists or tables stand inside each other too often") from None
    except (ValueError, OverflowError):  # dates that no calendar has, integers of thousands of digits
        raise error(f"{file}: is not TOML: a number or a date in it is out of range") from None
    if _LONG_NUMBER.search(plain) and _has_long_number(tables):
        raise error(f"{file}: is not TOML: it has a whole number of more than 64 bits")
    return tables


def _has_long_number(tables: dict[str, Any]) -> bool:
    """Whether there is a whole number of more than 64 bits, which TOML doesn't have.  Not all of them are floating-point numbers."""
    waiting: list[Any] = [tables]
    while waiting:
        x = waiting.pop()
        if isinstance(x, dict):
            waiting += x.values()
        elif isinstance(x, list):
            waiting += x
        elif isinstance(x, int) and not -(1 << 63) <= x < 1 << 63:
            return True
    return False
