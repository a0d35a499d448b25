"""Pages of the documentation as their readers use them: blocks of commands and code, and the folder that they run in."""

import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LANGUAGES = ("sh", "python", "c", "cpp")
TUTORIALS = ROOT / "docs" / "tutorials"


@dataclass(frozen=True)
class Block:
    """A fenced block: its language (`text` is what the block before it prints), its content, and the line of its fence.

    `marks` are those of the comment above it: <!-- status: 2 --> the exit status, <!-- needs: chromium duckdb --> programs and packages,
    <!-- tested: test/file.py --> the test that runs it.
    """

    language: str
    code: str
    line: int
    marks: dict[str, str]


def blocks_of(path: Path) -> list[Block]:
    text = path.read_text(encoding="utf-8")
    found = []
    for match in re.finditer(r"((?:^<!-- .*? -->\n)*)^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        marks = dict(re.findall(r"<!-- (\w+): (.*?) -->", match[1]))
        found.append(Block(match[2], match[3], text.count("\n", 0, match.start(2)) + 1, marks))
    return found


def set_up(folder: Path, program: Path = Path(sys.executable).parent) -> Path:
    """The examples where README expects them, and a .venv that is this Python's, with the `ksl` of warm_ksl.py in the folder `program`."""
    shutil.copytree(ROOT / "examples", folder / "examples")
    (folder / ".venv" / "bin").mkdir(parents=True)
    (folder / ".venv" / "bin" / "activate").write_text(f'PATH="{program}:{Path(sys.executable).parent}:$PATH"\n')
    return folder


def environment() -> dict[str, str]:
    return {k: v for k, v in os.environ.items() if k != "KSL_ISA"}


INTERPRETER = """
import ast, json, sys
names = {"__name__": "__main__"}
for line in sys.stdin:
    tree = ast.parse(json.loads(line))
    last = ast.Expression(tree.body.pop().value) if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "block", "exec"), names)
    if last is not None:
        sys.displayhook(eval(compile(last, "block", "eval"), names))
    print("\\0", flush=True)
"""
"""Runs blocks one after the other, with the same variables, and shows the value of the last line, as notebooks do."""


class Walk:
    """A page whose blocks run in order, in one folder.  Python blocks share their variables."""

    def __init__(self, page: Path, folder: Path, program: Path = Path(sys.executable).parent) -> None:
        self.page, self.folder = page, set_up(folder, program)
        self.blocks = blocks_of(page)
        self.printed: dict[int, str] = {}
        """What blocks have printed, by their place among the blocks."""
        self.left_out: dict[int, str] = {}
        """Why blocks were not run."""
        self._python: subprocess.Popen[str] | None = None

    def until(self, last: int) -> None:
        """Runs the blocks up to this one that have not been run."""
        for k in range(len(self.printed) + len(self.left_out), last + 1):
            block = self.blocks[k]
            missing = [name for name in block.marks.get("needs", "").split() if not there(name)]
            if missing:
                self.left_out[k] = f"{', '.join(missing)} is missing"
            elif block.language == "sh":
                self.printed[k] = self._shell(block)
            elif block.language == "python":
                self.printed[k] = self._cell(block)
            else:
                self.printed[k] = ""

    def _shell(self, block: Block) -> str:
        command = ["sh", "-eu", "-c", f". .venv/bin/activate\n{block.code}"]
        done = subprocess.run(
            command, cwd=self.folder, text=True, env=environment(), timeout=300, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
        )
        wanted = int(block.marks.get("status", "0"))
        assert done.returncode == wanted, f"{self.page.name}:{block.line} ended with {done.returncode}, not {wanted}\n{done.stdout}"
        return done.stdout

    def _cell(self, block: Block) -> str:
        if self._python is None:
            self._python = subprocess.Popen(
                [sys.executable, "-u", "-c", INTERPRETER],
                cwd=self.folder,
                text=True,
                env=environment(),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
            )
        assert self._python.stdin and self._python.stdout
        self._python.stdin.write(json.dumps(block.code) + "\n")
        self._python.stdin.flush()
        lines = []
        for line in self._python.stdout:
            if line == "\0\n":
                return "".join(lines)
            lines.append(line)
        raise AssertionError(f"{self.page.name}:{block.line}\n{''.join(lines)}")

    def close(self) -> None:
        if self._python is not None:
            self._python.kill()
            self._python.communicate()


def there(name: str) -> bool:
    """Whether a program or an installed package has this name."""
    try:
        return shutil.which(name) is not None or bool(importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        return False
