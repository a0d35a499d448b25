#!/usr/bin/env python3
"""The gate of `make coverage`: every line and nearly every branch of algebra, engine, loader, batches and C API is run by tests.

    gate.py EXPORT...   files of `llvm-cov export`, one for each instrumented program

Prints lines, branches and what no test runs, as file:line.  The exit status is 1 if figures are missed or exclusions are wrong.
--record NAME writes the figures with scripts/trust/record.py."""

import argparse
import fnmatch
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import regions
import source_text

try:
    import tomllib
except ImportError:  # Python 3.10
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
# The first pattern that matches says to which part a file belongs.
PARTS = {
    "loader": ["src/text/*", "src/description/*", "src/load/*"],
    "batch": ["src/batch/*"],
    "c_api": ["src/c_api/*"],
    "algebra": [
        "include/ksl/detail/*",
        "include/ksl/compat/*",
        "include/ksl/*.h",
        "src/*.c",
        "src/print.inc",
        *(f"include/ksl/{name}.hpp" for name in ("algebra", "pack", "dual", "spatial")),
    ],
    "engine": ["include/ksl/engine/*", "src/engine/*", "include/ksl/*.hpp"],
}
LINES, BRANCHES, MOST_EXCLUSIONS = 100.0, 98.0, 20


def part_of(path):
    """The part that a file belongs to, or None."""
    if path.startswith("src/") and path.count("/") == 1 and not path.endswith((".c", ".inc")):
        return None
    return next((part for part, patterns in PARTS.items() if any(fnmatch.fnmatch(path, p) for p in patterns)), None)


@dataclass
class Count:
    """Of a file or part: how many lines and outcomes of branches there are, and which never ran."""

    lines: int = 0
    outcomes: int = 0
    unrun: list = field(default_factory=list)  # (path, line)
    untaken: list = field(default_factory=list)  # (path, line, column, outcome)

    def add(self, other):
        self.lines += other.lines
        self.outcomes += other.outcomes
        self.unrun += other.unrun
        self.untaken += other.untaken

    def figures(self):
        """Percent of lines and of outcomes that ran; all if there are none."""
        return (100 * (1 - len(self.unrun) / self.lines) if self.lines else 100.0, 100 * (1 - len(self.untaken) / self.outcomes) if self.outcomes else 100.0)


def count_file(path, text, file):
    """The Count of one file.  file: what ran of it; None if it is in no program."""
    file = file or regions.File()
    code, starts = source_text.code_lines(text), file.starts
    begun = {line for line, _ in starts}
    for section in source_text.conditional_sections(text):
        if not begun & set(section):  # for another processor or build
            code -= set(section)
    lines = {line: runs for line, runs in file.lines.items() if line in code}
    for (line, column), end in source_text.block_ends(text).items():
        if (line, column) not in starts:  # no instantiation has this block
            for inside in range(line if end == line else line + 1, end + 1):
                if inside in code:
                    lines[inside] = 0
    count = Count(lines=len(lines), unrun=[(path, line) for line in sorted(lines) if not lines[line]])
    for (line, column, _, _), branch in sorted(file.branches.items()):
        if branch.counts():
            count.outcomes += 2
            count.untaken += [(path, line, column, outcome) for outcome in branch.missing()]
    return count


def read_exclusions(path):
    """The list of exclusions: each with file, text of the line, number of lines from there on, and reason."""
    entries = tomllib.loads(Path(path).read_text(encoding="utf-8")).get("exclusion", [])
    for e in entries:
        unknown = e.keys() - {"file", "text", "lines", "reason"}
        if unknown or not all(isinstance(e.get(key), str) and e[key].strip() for key in ("file", "text", "reason")):
            raise SystemExit(f"{path}: an exclusion has file, text and reason, and lines if there are several; found {e}")
    return entries


def exclude(counts, exclusions, root):
    """Remove what is excluded from the counts (path → Count).  Returns what is wrong with the exclusions."""
    wrong = []
    if len(exclusions) > MOST_EXCLUSIONS:
        wrong.append(f"{len(exclusions)} exclusions, expected at most {MOST_EXCLUSIONS}")
    for e in exclusions:
        name = f"exclusion of {e['file']}: {e['text']!r}"
        path = Path(root) / e["file"]
        text = path.read_text(encoding="utf-8").split("\n") if path.exists() else []
        found = [number for number, line in enumerate(text, 1) if e["text"] in line]
        if len(found) != 1 or e["file"] not in counts:
            wrong.append(f"{name}: {len(found)} lines match, expected one")
            continue
        lines = range(found[0], found[0] + e.get("lines", 1))
        count = counts[e["file"]]
        unrun = [x for x in count.unrun if x[1] not in lines]
        untaken = [x for x in count.untaken if x[1] not in lines]
        if (len(unrun), len(untaken)) == (len(count.unrun), len(count.untaken)):
            wrong.append(f"{name}: tests run all of it; remove the exclusion")
        count.lines -= len(count.unrun) - len(unrun)
        count.outcomes -= len(count.untaken) - len(untaken)
        count.unrun, count.untaken = unrun, untaken
    return wrong


def measure(exports, root):
    """Path → Count, of all files that belong to a part."""
    found = regions.read(exports, root)
    counts = {}
    for folder in ("include", "src"):
        for path in sorted((Path(root) / folder).rglob("*")):
            name = str(path.relative_to(root))
            if path.is_file() and part_of(name):
                counts[name] = count_file(name, path.read_text(encoding="utf-8"), found.get(name))
    return counts


def by_part(counts):
    """Part → Count, the sum over its files."""
    parts = {part: Count() for part in sorted(PARTS)}
    for path, count in counts.items():
        parts[part_of(path)].add(count)
    return parts


def report(parts):
    """Prints what never ran, and the figures."""
    for count in parts.values():
        for path, line in count.unrun:
            print(f"{path}:{line}: never ran")
        for path, line, column, outcome in count.untaken:
            print(f"{path}:{line}:{column}: never {outcome}")
    print(f"\n{'part':8}  {'lines':>7}  {'not run':>7}  {'lines %':>8}  {'outcomes':>8}  {'missing':>7}  {'branches %':>10}")
    for part, count in parts.items():
        lines, branches = count.figures()
        print(f"{part:8}  {count.lines:7}  {len(count.unrun):7}  {lines:8.2f}  {count.outcomes:8}  {len(count.untaken):7}  {branches:10.2f}")


def record(name, parts, exclusions, kept):
    """Writes the figures where docs/trust.md finds them."""
    figures = []
    for part, count in parts.items():
        lines, branches = count.figures()
        figures += ["--figure", f"lines, {part}={lines:.2f} % of {count.lines}", "--figure", f"branches, {part}={branches:.2f} % of {count.outcomes}"]
    subprocess.run(
        [
            sys.executable,
            ROOT / "scripts/trust/record.py",
            name,
            "--command",
            "make coverage",
            "--kept" if kept else "--broken",
            *figures,
            "--figure",
            f"exclusions={len(exclusions)} (test/coverage/exclusions.toml)",
            "--planted",
            "a line and a branch that no test runs, a template that nothing instantiates=caught (test/coverage/coverage_gate_test.py)",
            "--note",
            "A line or a branch of a template counts if any instantiation runs it. "
            "Conditions that are constant in each instantiation are no branches; what they select counts as lines.",
        ],
        check=True,
    )


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("export", nargs="+")
    parser.add_argument("--root", default=ROOT, help="folder with include/ and src/")
    parser.add_argument("--exclusions", default=Path(__file__).with_name("exclusions.toml"))
    parser.add_argument("--record", metavar="NAME")
    given = parser.parse_args(arguments)
    counts, exclusions = measure(given.export, given.root), read_exclusions(given.exclusions)
    wrong = exclude(counts, exclusions, given.root)
    parts = by_part(counts)
    report(parts)
    for part, count in parts.items():
        lines, branches = count.figures()
        if given.record and not (count.lines and count.outcomes):
            wrong.append(f"{part}: no lines or no branches were found; look at PARTS in gate.py")
        if count.unrun:
            wrong.append(f"{part}: {lines:.2f} % of lines, expected {LINES:g} %")
        if branches < BRANCHES:
            wrong.append(f"{part}: {branches:.2f} % of branches, expected {BRANCHES:g} %")
    for sentence in wrong:
        print(sentence, file=sys.stderr)
    if given.record:
        record(given.record, parts, exclusions, not wrong)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
