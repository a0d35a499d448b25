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


def _git(*arguments):
    """What git says, or None: no git, no repository, or nothing of that name."""
    try:
        return subprocess.run(["git", "-C", str(ROOT), *arguments], check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def head():
    """The commit that the working tree stands on, or nothing."""
    return _git("rev-parse", "HEAD") or ""


def has_history():
    """Is all of the history here, so that a commit that is not has been replaced."""
    return _git("rev-parse", "--is-shallow-repository") == "false"


def is_in_history(commit, of):
    return _git("merge-base", "--is-ancestor", commit, of) is not None


def commits_since(commit, until, globs):
    """How many commits between these two have changed files that these patterns of git's name."""
    return int(_git("rev-list", "--count", f"{commit}..{until}", "--", *(f":(top,glob){glob}" for glob in globs)) or 0)


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
