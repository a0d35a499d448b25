"""Xacro files, which are programs: the package xacro runs them, where the caller asks for it."""

from __future__ import annotations

import importlib.util
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ksl.base import own_process
from ksl.base.errors import DescriptionError, near_names
from ksl.base.files_read import InputFile, note, state_of
from ksl.base.printable import sentence
from ksl.base.words import listed
from ksl.robot_files.mesh_files import forget_folders, package_folders

EXPANDED = " (expanded by xacro)"
"""After the name of the file, in messages, whose lines are those of the text that xacro made."""
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*")
_MOST_SAID = 20


RUN = """
import contextlib, io
class Asked(dict):  # notes which arguments the file asks for
    names = set()
    def __getitem__(self, name):
        self.names.add(name)
        return super().__getitem__(name)
    def __contains__(self, name):
        self.names.add(str(name))
        return super().__contains__(name)
def folder_of(package):
    say(ask=package)
    found = json.loads(sys.stdin.readline())
    if found:
        return found
    try:
        from ament_index_python.packages import get_package_share_directory
        return get_package_share_directory(package)
    except Exception:
        raise LookupError("package not found: " + package) from None
import xacro
from xacro import substitution_args
substitution_args._eval_find = substitution_args._eval_dict["find"] = folder_of
said, values = io.StringIO(), Asked(given["values"])
try:
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
        text = xacro.process_file(given["file"], mappings=values).toprettyxml(indent="  ")
    say(text=text, included=[str(name) for name in getattr(xacro, "all_includes", ())], asked=sorted(values.names), said=said.getvalue())
except MemoryError:
    say(memory=True)
except Exception as e:  # expressions of the file raise whatever Python raises
    say(refused=str(e) or type(e).__name__)
except SystemExit:
    say(refused=said.getvalue())
"""
"""Runs xacro, in a process of its own: the file is a program, which may run on without end, and signals end it."""


class Arguments(dict[str, str]):
    """Arguments of a xacro file, with the folders of packages that `$(find NAME)` means."""

    def __init__(self, given: Mapping[str, str], packages: Mapping[str, str]) -> None:
        super().__init__(given)
        self.packages = dict(packages)


def with_packages(given: Mapping[str, object] | None, packages: Mapping[str, str | os.PathLike[str]] | None) -> Mapping[str, object] | None:
    """Arguments of a xacro file with folders of packages.  Raises ValueError."""
    if packages is None:
        return given
    if given is None:
        raise ValueError("packages are for a xacro file; give its arguments too, xacro={} (--xacro '') for none")
    if not isinstance(packages, Mapping):
        raise ValueError(f"packages is {packages!r}; expected {{name: folder}}")
    folders = {str(name): os.fspath(folder) for name, folder in packages.items()}
    for name, folder in folders.items():
        if not os.path.isdir(folder):
            raise ValueError(f"packages: {name} is {folder!r}, which is no folder; give that of the package")
    # xacro takes relative ones from the folder of each file that names them
    return Arguments(arguments(given), {name: os.path.abspath(folder) for name, folder in folders.items()})


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
    values = arguments(given)
    if any(importlib.util.find_spec(name) is None for name in ("xacro", "yaml")):
        raise DescriptionError(f"{file}: xacro files are run by the package xacro; install it: pip install 'ksl[xacro]'")
    if not os.path.isfile(file):
        raise DescriptionError(f"{file}: is no file; give a xacro file, or leave xacro out")
    if not own_process.is_possible():
        raise DescriptionError(
            f"{file}: xacro runs in a Python of its own, and this one, inside of another program, knows none (sys.executable); run xacro before: xacro FILE > robot.urdf"
        )
    forget_folders()
    packages = given.packages if isinstance(given, Arguments) else {}

    def folder(question: dict[str, Any]) -> str | None:
        """The folder of a package: as it was given, else around the file and where ROS has packages; None leaves it to ROS."""
        name = str(question["ask"])
        return packages.get(name) or next((str(path) for path in package_folders(name, Path(file))), None)

    try:
        made = own_process.run(RUN, {"file": file, "values": values}, folder)
    except own_process.Ended as e:
        raise DescriptionError(f"{file}: xacro didn't run to its end: {e}") from None
    if "memory" in made:
        raise MemoryError
    if "refused" in made:
        said = str(made["refused"])
        raise DescriptionError(f"{file}: xacro refuses the file: {sentence(' '.join(said.split()))[:1000]}{_mend(said)}")
    unused = tuple(_unused(file, name, set(made["asked"])) for name in given if name not in made["asked"])
    return Expanded(
        file + EXPANDED, made["text"].encode("utf-8", "replace"), _inputs(file, made["included"]), unused + _lines(file, made["said"] + "\n" + made["printed"])
    )


def _unused(file: str, name: str, asked: set[str]) -> str:
    known = sorted(asked)
    return sentence(
        f"{file}: xacro argument {name!r} changes nothing: {near_names(name, known)}the file {'asks for ' + listed(known) if known else 'asks for no argument'}"
    )


def _mend(text: str) -> str:
    if "Undefined substitution argument" in text or "is not defined" in text:
        return '; give the argument: --xacro \'NAME:=VALUE\' (xacro={"NAME": "VALUE"})'
    if "resource not found" in text or "package" in text.lower():
        return '; packages are looked for in the folders above the file and where ROS does: name the folder by --package NAME=DIR (packages={"NAME": "DIR"}), or source the workspace\'s setup file'
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
