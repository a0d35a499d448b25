"""When, on which commit and on what machine a check ran: what every record of a run says."""

import os
import platform
import subprocess
from datetime import datetime, timezone
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def commit(results=()):
    """The commit that was tested, and whether it had other files than `results`, paths of files or of folders with a slash, or changed ones."""
    try:
        git = ["git", "-C", str(ROOT)]
        name = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout.strip()
        status = [*git, "status", "--porcelain", "--untracked-files=all"]
        changed = subprocess.run(status, check=True, capture_output=True, text=True).stdout.splitlines()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    changed = [line for line in changed if not line[3:].startswith(tuple(results))]
    return name + (", with changes that were not committed" if changed else "")


def date():
    return datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC")


def processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "unknown"


def compiler(command):
    """The first line that a compiler says of itself, without its path; nothing where there is none."""
    try:
        said = subprocess.run([command, "--version"], check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return ""
    return said.splitlines()[0]


def machine():
    """Processor, cores that this process may use, system, compilers."""
    cores = len(os.sched_getaffinity(0))
    facts = [f"{processor()}, {cores} core{'s' if cores != 1 else ''}", f"{platform.system()} {platform.machine()}"]
    return "; ".join([*facts, *filter(None, map(compiler, ("gcc", "clang")))])
