"""The compiler of C that turns a text into a library of this process."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from ksl import _core
from ksl.base.errors import CompilerError

VARIABLE = "KSL_CC"
"""The variable of the environment that names a compiler."""
CANDIDATES = ("clang", "gcc", "cc")
"""Tried in this order: clang takes a third of gcc's time for long functions, and its lanes are no slower (docs/decisions/0028-compiled-models.md)."""
BRING = "install one, as by `apt install clang`, or `pip install 'ksl[compile]'`, which brings one along; or name one in the variable KSL_CC"
PLAIN = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fPIC", "-shared", "-w")
MOST_SECONDS = 600
SHOWN_LINES = 6
"""So many of what a compiler says are shown."""


@dataclass(frozen=True)
class Compiler:
    command: tuple[str, ...]
    version: str
    """The first line of what it says of itself."""

    def flags(self) -> list[str]:
        """Results keep the engine's bits: nothing is fused.  Code is for the instruction set whose kernels run, and no other."""
        return [*PLAIN, *self._instructions()]

    def portable_flags(self) -> list[str]:
        """For every processor of this machine's kind; only what is declared for export is visible in the library."""
        return [*PLAIN, "-fvisibility=hidden", *(["-mcpu=baseline"] if self._is_zig() else [])]

    def _is_zig(self) -> bool:
        return "zig" in self.version or "ziglang" in self.command

    def _instructions(self) -> list[str]:
        instructions = _core.instruction_set()
        if self._is_zig():
            target = [f"-mcpu={instructions.replace('-', '_')}"] if instructions.startswith("x86") else []
        else:
            target = [f"-march={instructions}"] if instructions.startswith("x86") else []
        if instructions == "x86-64-v4":
            target.append("-mprefer-vector-width=512")  # clang takes half registers otherwise, and twice the time for a humanoid
        return target

    def compile(self, source: Path, library: Path, kept: Path) -> None:
        """Raises CompilerError with the first lines that the compiler says.  kept: where the source is found afterwards."""
        self.build([source], library, self.flags(), f"{kept}, which is kept")

    def build(self, sources: Sequence[Path], library: Path, flags: Sequence[str], named: str) -> None:
        """A library of several sources.  named: what they are in the message of a CompilerError, which has the first lines that the compiler says."""
        command = [*self.command, *flags, *map(str, sources), "-o", str(library), "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, timeout=MOST_SECONDS, cwd=library.parent, check=False)
        except subprocess.TimeoutExpired:
            raise CompilerError(f"{self.command[0]} took more than {MOST_SECONDS} s; compile fewer algorithms at once") from None
        except OSError as error:
            raise CompilerError(f"{self.command[0]}: {error.strerror}; {BRING}") from None
        if done.returncode or not library.exists():
            said = [line for line in done.stderr.decode("utf-8", "replace").splitlines() if line.strip()][:SHOWN_LINES]
            ended = f"was ended by signal {-done.returncode}" if done.returncode < 0 else f"ended with status {done.returncode}"
            raise CompilerError("\n    ".join([f"{self.command[0]} {ended} for {named}:", *said]))


def find_compiler(name: str | None = None) -> Compiler:
    """The compiler of this name, of KSL_CC, or the first of clang, gcc, cc, and that of the package ziglang.  Raises CompilerError."""
    named = name or os.environ.get(VARIABLE) or ""
    if named:
        command = tuple(shlex.split(named))
        if not command or shutil.which(command[0]) is None:
            raise CompilerError(f"there is no compiler {named!r}; {BRING}")
        return _asked(command)
    for candidate in CANDIDATES:
        if path := shutil.which(candidate):
            return _asked((path,))
    if find_spec("ziglang") is not None:
        return _asked((sys.executable, "-m", "ziglang", "cc"))
    raise CompilerError(f"code of a mechanism needs a compiler of C, and there is none: {BRING}")


def _asked(command: tuple[str, ...]) -> Compiler:
    try:
        done = subprocess.run([*command, "--version"], capture_output=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired):
        done = None
    if done is None or done.returncode:
        raise CompilerError(f"{' '.join(command)} doesn't say its version, and seems to be no compiler; {BRING}")
    return Compiler(command, done.stdout.decode("utf-8", "replace").partition("\n")[0])
