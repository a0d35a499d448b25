#!/usr/bin/env python3
"""Formats C and C++ as .clang-format says, but for what .clang-format-ignore lists.

scripts/format.py [--check] [FILE…]    without a file all; --check changes none, and ends with status 1 if one differs
scripts/format.py --version            says which version it uses; status 1 where that is not installed"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VERSION = "23.1.5"
"""Of the package clang-format on PyPI.  Other versions break some lines elsewhere."""
FOLDERS = ("include", "src", "python", "test", "bench", "examples", "fuzz")
SUFFIXES = (".c", ".h", ".cpp", ".hpp", ".inc")


def program():
    """The program of that version, beside this Python or on the path."""
    for command in (Path(sys.executable).parent / "clang-format", "clang-format"):
        try:
            said = subprocess.run([command, "--version"], capture_output=True, text=True, check=True).stdout
        except (OSError, subprocess.CalledProcessError):
            continue
        if f" {VERSION}" in said:
            return str(command)
    sys.exit(f"clang-format {VERSION} is needed: make format installs it (clang-format=={VERSION} from PyPI)")


def files():
    return sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in SUFFIXES and ROOT / "test/data" not in path.parents)


def main(arguments):
    if arguments == ["--version"]:
        print(f"{program()} {VERSION}")
        return
    check = "--check" in arguments
    given = [Path(argument) for argument in arguments if argument != "--check"] or files()
    options = ["--dry-run", "--Werror"] if check else ["-i"]
    done = subprocess.run([program(), "--style=file", *options, *map(str, given)], capture_output=True, text=True)
    differ = sorted({line.split(":", 1)[0] for line in done.stderr.splitlines() if "clang-formatted" in line})
    if differ:
        print(f"{len(differ)} of {len(given)} files are not formatted; make format does it:")
        print("\n".join(f"  {Path(file).resolve().relative_to(ROOT)}" for file in differ))
    elif done.returncode:
        print(done.stderr)
    sys.exit(done.returncode)


if __name__ == "__main__":
    main(sys.argv[1:])
