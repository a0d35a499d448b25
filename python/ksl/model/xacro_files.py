"""Xacro files, which are programs: the package xacro runs them, where the caller asks for it."""

from __future__ import annotations

import contextlib
import io
import os
import re
from collections.abc import Mapping
from typing import NamedTuple

from ksl.base.errors import DescriptionError, near_names
from ksl.base.files_read import InputFile, note, state_of
from ksl.base.printable import sentence
from ksl.base.words import listed

EXPANDED = " (expanded by xacro)"
"""After the name of the file, in messages, whose lines are those of the text that xacro made."""
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*")
_MOST_SAID = 20


class Asked(dict[str, str]):
    """Arguments of a xacro file, which gives defaults of more, and those names that it asks for."""

    def __init__(self, given: Mapping[str, str]) -> None:
        super().__init__(given)
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> str:
        self.names.add(name)
        return super().__getitem__(name)

    def __contains__(self, name: object) -> bool:
        self.names.add(str(name))
        return super().__contains__(name)


class Expanded(NamedTuple):
    """What xacro made of a file."""

    name: str
    """As messages call it."""
    contents: bytes
    inputs: tuple[InputFile, ...]
    """The file, and those that it includes."""
    said: tuple[str, ...]
    """Warnings of xacro, and arguments that it didn't ask for, which it takes without a word."""


def arguments(given: object) -> dict[str, str]:
    """{name: value} for a xacro file, from a mapping.  Raises ValueError."""
    if not isinstance(given, Mapping):
        raise ValueError(f"xacro is {given!r}; expected the arguments of a xacro file, {{name: value}}, or {{}} for none")
    found = {}
    for name, value in given.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise ValueError(f"xacro: {name!r} is no name of an argument; expected letters, digits and _")
        if not isinstance(value, (str, int, float)):  # truth values are ints
            raise ValueError(f"xacro: argument {name!r} is {type(value).__name__}; expected text, a number, True or False")
        found[name] = str(value).lower() if isinstance(value, bool) else str(value)
    return found


def expanded(file: str, given: Mapping[str, object]) -> Expanded:
    """Runs a xacro file with these arguments.  Raises DescriptionError: also without the package, and where xacro refuses the file.

    A xacro file may read other files, variables of the environment and folders of packages: run those of people you trust.
    """
    values = Asked(arguments(given))
    try:
        import xacro
    except ModuleNotFoundError as e:
        if e.name not in ("xacro", "yaml"):
            raise
        raise DescriptionError(f"{file}: xacro files are run by the package xacro; install it: pip install 'ksl[xacro]'") from None
    if not os.path.isfile(file):
        raise DescriptionError(f"{file}: is no file; give a xacro file, or leave xacro out")
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
            text = xacro.process_file(file, mappings=values).toprettyxml(indent="  ", encoding="utf-8")
    except MemoryError:
        raise
    except Exception as e:  # expressions of the file raise whatever Python raises
        raise DescriptionError(f"{file}: xacro refuses the file: {sentence(' '.join(str(e).split()))[:1000] or type(e).__name__}{_mend(str(e))}") from None
    except SystemExit:
        raise DescriptionError(f"{file}: xacro refuses the file: {sentence(' '.join(said.getvalue().split()))[:1000]}") from None
    included = [str(name) for name in getattr(xacro, "all_includes", ())]
    unused = tuple(_unused(file, name, values.names) for name in given if name not in values.names)
    return Expanded(file + EXPANDED, text, _inputs(file, included), unused + _lines(file, said.getvalue()))


def _unused(file: str, name: str, asked: set[str]) -> str:
    known = sorted(asked)
    return sentence(f"{file}: xacro argument {name!r} changes nothing: {near_names(name, known)}the file {'asks for ' + listed(known) if known else 'asks for no argument'}")


def _mend(text: str) -> str:
    if "Undefined substitution argument" in text or "is not defined" in text:
        return "; give the argument: --xacro 'NAME:=VALUE' (xacro={\"NAME\": \"VALUE\"})"
    if "resource not found" in text or "package" in text.lower():
        return "; packages are looked for where ROS does: source the workspace's setup file first"
    return ""


def _inputs(file: str, included: list[str]) -> tuple[InputFile, ...]:
    import hashlib

    found = []
    for role, path in [("robot", file), *(("included", path) for path in dict.fromkeys(included) if os.path.isfile(path))]:
        with open(path, "rb") as opened:
            digest = hashlib.sha256(opened.read()).hexdigest()
        found.append(InputFile(role, path, digest if state_of(path) is not None else None))
        note(found[-1], DescriptionError)
    return tuple(found)


def _lines(file: str, text: str) -> tuple[str, ...]:
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)
    return tuple(f"{file}: xacro says: {line.strip()}" for line in plain.splitlines() if line.strip())[:_MOST_SAID]
