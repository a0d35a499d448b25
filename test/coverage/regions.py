"""What ran, from the JSON that `llvm-cov export` writes: the union over all instantiations and programs.

A template is compiled once for each set of its arguments, and each of these instantiations has counters of its own.  A line
counts as run if any instantiation ran it.  A condition counts as true, or as false, if it was so in any instantiation.

A condition that is a constant in an instantiation (a template argument, `if constexpr`) is no branch there: no instruction
decides it.  What it selects are lines, and they count as lines.  A branch that is constant wherever it is reached doesn't count."""

import json
from collections import defaultdict
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import source_text

SKIPPED, GAP = 2, 3  # kinds of regions in LLVM's coverage mapping, besides code and expansions of macros


@dataclass
class Branch:
    """A condition, over all instantiations: how often it was true and false, and whether any instantiation reached it at all,
    and reached it as one that isn't constant."""

    true: int = 0
    false: int = 0
    constant: bool = False
    decided: bool = False

    def missing(self):
        """The outcomes that never were, in words."""
        return [word for word, count in (("true", self.true), ("false", self.false)) if not count]

    def counts(self):
        """Is it a branch: decided in an instantiation, or reached in none?"""
        return self.decided or not self.constant


@dataclass
class File:
    """A source file: how often its lines ran, branches by where they begin and end (line, column, line, column), and where regions
    begin: which blocks some instantiation has."""

    lines: dict = field(default_factory=lambda: defaultdict(int))
    branches: dict = field(default_factory=lambda: defaultdict(Branch))
    starts: set = field(default_factory=set)


def innermost(regions, line, column):
    """How often the innermost region of a function around a place ran."""
    best, count = None, 0
    for ls, cs, le, ce, runs, gap in regions:
        if not gap and (ls, cs) <= (line, column) < (le, ce) and (best is None or (ls, cs) >= best):
            best, count = (ls, cs), runs
    return count


def run_lines(own):
    """Line → how often it ran, for the regions of one instantiation in a file.  As in llvm-cov: where regions begin on a line, the one that ran
    most counts, or the region that goes on from the line before.  A gap between statements ends where a region begins; otherwise the
    region around it goes on."""
    inherited, begun, starts = {}, defaultdict(int), {r[:2] for r in own if not r[5]}
    for ls, _, le, ce, count, gap in sorted(own, key=lambda r: (r[0], r[1], -r[2], -r[3])):  # the innermost comes last and wins
        for line in range(ls + 1, le if gap and (le, ce) not in starts else le + 1):
            inherited[line] = count
        if not gap:
            begun[ls] = max(begun[ls], count)
    return {line: max(inherited.get(line, 0), begun.get(line, 0)) for line in inherited.keys() | begun.keys()}


def add_lines(own, file, blocks):
    """Add one instantiation.  A block in which no region begins is not part of it: it belongs to a lambda, or `if constexpr` discards it.
    The counts of the region around the block say nothing about it."""
    starts = {r[:2] for r in own if not r[5]}
    first, last = min(r[0] for r in own), max(r[2] for r in own)
    foreign = {line for (begin, column), end in blocks.items() if first <= begin <= last and (begin, column) not in starts
               for line in range(begin if end == begin else begin + 1, end + 1)}  # fmt: skip
    for line, count in run_lines(own).items():
        if line not in foreign or any(start[0] == line for start in starts):
            file.lines[line] += count
    file.starts |= starts


def add_function(function, files, path_of, blocks_of):
    """Adds the regions and branches of one instantiation."""
    names = [path_of(name) for name in function["filenames"]]
    own = defaultdict(list)
    for ls, cs, le, ce, count, file, _, kind in function["regions"]:
        if kind != SKIPPED and names[file] is not None:
            own[file].append((ls, cs, le, ce, count, kind == GAP))
    for file, found in own.items():
        add_lines(found, files[names[file]], blocks_of(names[file]))
    for ls, cs, le, ce, true, false, file, _, _ in function["branches"]:
        if names[file] is None:
            continue
        branch = files[names[file]].branches[ls, cs, le, ce]
        branch.true += true
        branch.false += false
        if true or false:
            branch.decided = True
        elif innermost(own[file], ls, cs) > 0:  # the place ran, and nothing was counted: a constant
            branch.constant = True


def read(exports, root):
    """Path below root → File, of the functions in all exports."""
    root = Path(root).resolve()
    files = defaultdict(File)

    @cache
    def path_of(name):
        path = Path(name).resolve()
        return str(path.relative_to(root)) if path.is_relative_to(root) else None

    @cache
    def blocks_of(name):
        return source_text.block_ends((root / name).read_text(encoding="utf-8")) if name.startswith(("include/", "src/")) else {}

    for export in exports:
        for data in json.loads(Path(export).read_bytes())["data"]:
            for function in data["functions"]:
                add_function(function, files, path_of, blocks_of)
    return files
