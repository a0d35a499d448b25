"""Runs of commands as a user runs them, a small robot, and what a refusal is."""

import csv
import os
import shutil
import subprocess
import sys
from pathlib import Path

from ksl_command import run_ksl

SLIDE = """<robot name="two"><link name="rail"/><link name="cart"><inertial><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="rail"/><child link="cart"/>
  <limit lower="-9" upper="9" effort="900" velocity="9"/></joint></robot>"""


def console_script() -> str:
    """The console script beside this Python."""
    found = shutil.which("ksl", path=str(Path(sys.executable).parent))
    assert found, "the command ksl is not installed beside this Python"
    return found


def ordinary(**more: str) -> dict[str, str]:
    """The environment without what changes how the command behaves, and with more."""
    return {k: v for k, v in os.environ.items() if k not in ("KSL_ISA", "COLUMNS", "FORCE_COLOR") and not k.startswith("PYTHON")} | more


def run(*arguments, **environment: str) -> subprocess.CompletedProcess:
    """In a copy of this process, or, with variables of the environment, by the console script."""
    if not environment:
        return run_ksl(*arguments)
    return subprocess.run([console_script(), *map(str, arguments)], capture_output=True, text=True, env=ordinary(**environment), timeout=120)


def summary(out: Path) -> dict[str, dict[str, str]]:
    with open(out / "summary.csv", newline="", encoding="utf-8") as f:
        return {row["joint"]: row for row in csv.DictReader(line for line in f if not line.startswith("# "))}


def refused(tmp_path: Path, process: subprocess.CompletedProcess, *words: str) -> None:
    """Exit 2, one line on stderr that begins with the command and has the words, nothing on stdout, no folder left."""
    assert process.returncode == 2, (process.returncode, process.stdout, process.stderr)
    assert process.stderr.startswith("ksl: ") and process.stderr.count("\n") == 1, process.stderr
    assert all(w in process.stderr for w in words), process.stderr
    assert process.stdout == ""
    assert not [f for f in tmp_path.iterdir() if f.is_dir() and f.name.startswith((".", "q"))], "something was left behind"
