"""Which files of ours have changed since a check last read them all and found nothing.

test/trust/read/CHECK.txt has a line for each: a digest of its text, without comments and blanks, and its name.  It is written with the check's
record; `build/` has another, of the last run that was not recorded.  Digests need no history: clones that are not complete have none, and a
rebase renames commits."""

import ast
import hashlib
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RECORDED = ROOT / "test/trust/read"
LATEST = ROOT / "build/read"
# A comment, or what might hold its marks: raw strings, strings, numbers with ' in them, characters.
TOKEN = re.compile(
    r"""//(?:[^\n\\]|\\.)*|/\*.*?\*/|R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)"|"(?:[^"\\\n]|\\.)*"|\b\d[\w.]*(?:'\w+)*|'(?:[^'\\\n]|\\.)+'""", re.DOTALL
)
TOLD = re.compile("NOLINT|cppcheck-suppress")
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*[<"]([^">]+)[">]', re.MULTILINE)


def bare(text, suffix):
    """The text without comments, docstrings and blanks; what analysers are told in comments stays."""
    if suffix in (".c", ".h", ".cpp", ".cxx", ".hpp", ".inc"):
        text = TOKEN.sub(lambda m: " " if m[0].startswith(("//", "/*")) and not TOLD.search(m[0]) else m[0], text)
        return " ".join(text.split())
    lines = text.splitlines()
    if suffix == ".py":
        for statement in ast.walk(ast.parse(text)):
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant) and isinstance(statement.value.value, str):
                lines[statement.lineno - 1 : statement.end_lineno] = [""] * (statement.end_lineno - statement.lineno + 1)
    return "\n".join(line for line in lines if line.strip() and not line.startswith("#"))


@cache
def digest(file):
    return hashlib.sha256(bare(file.read_text(encoding="utf-8"), file.suffix).encode()).hexdigest()[:16]


def digest_of(files):
    """Of several together, in the order of their names."""
    names = "".join(f"{digest(file)} {name(file)}\n" for file in sorted(files))
    return hashlib.sha256(names.encode()).hexdigest()[:16]


def name(file):
    return str(file.relative_to(ROOT))


@cache
def _by_end():
    """All of our files that may be included, by their last name."""
    found = {}
    for folder in ("include", "src", "python", "test", "bench", "fuzz"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".c", ".h", ".cpp", ".hpp", ".inc"):
                found.setdefault(path.name, []).append(path)
    return found


@cache
def included(file):
    """The files of ours that this one includes itself; every one of that name, where several have it.  Conditions are not looked at."""
    found = set()
    for given in INCLUDE.findall(file.read_text(encoding="utf-8")):
        if given.startswith("/"):
            found |= {Path(given)} if ROOT in Path(given).parents else set()
            continue
        end = "/" + given.lstrip("./")
        found |= {path for path in _by_end().get(Path(given).name, []) if str(path).endswith(end)}
    return frozenset(found)


@cache
def closure(file):
    """The file and all of ours that it includes, directly or not."""
    seen, waiting = {file}, [file]
    while waiting:
        fresh = included(waiting.pop()) - seen
        seen |= fresh
        waiting += fresh
    return frozenset(seen)


def read(check):
    """The lines of both lists, recorded and latest, without their newlines."""
    paths = [folder / f"{check}.txt" for folder in (RECORDED, LATEST)]
    return {line for path in paths if path.exists() for line in path.read_text(encoding="utf-8").splitlines()}


def write(check, lines, recorded):
    folder = RECORDED if recorded else LATEST
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{check}.txt").write_text("".join(f"{line}\n" for line in sorted(lines, key=lambda line: line.split(" ", 1)[1])), encoding="utf-8")


def renew(check, lines, recorded):
    """Lines for some names; those of others stay."""
    path = (RECORDED if recorded else LATEST) / f"{check}.txt"
    names = {line.split(" ", 1)[1] for line in lines}
    kept = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    if names:
        write(check, [*lines, *(line for line in kept if line.split(" ", 1)[1] not in names)], recorded)
