"""What ran, from the JSON that `llvm-cov export` writes: the union over all instantiations and programs.

A template is compiled once for each set of its arguments, and each of these instantiations has counters of its own.  A line
counts as run if any instantiation ran it.  A condition counts as true, or as false, if it was so in any instantiation.

A condition that is a constant in an instantiation (a template argument, `if constexpr`) is no branch there: no instruction
decides it.  What it selects are lines, and they count as lines.  A branch that is constant wherever it is reached doesn't count."""

import json
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

CODE, EXPANSION, SKIPPED, GAP = range(4)  # kinds of regions in LLVM's coverage mapping


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
    """A source file: regions and branches by where they begin and end (line, column, line, column)."""

    regions: dict = field(default_factory=lambda: defaultdict(int))  # (place, is it a gap) → how often it ran
    branches: dict = field(default_factory=lambda: defaultdict(Branch))  # place → Branch

    def starts(self):
        """(line, column) at which a region begins."""
        return {place[:2] for (place, gap) in self.regions if not gap}


def innermost(regions, line, column):
    """How often the innermost of a function's regions that holds a place ran."""
    best, count = None, 0
    for ls, cs, le, ce, runs in regions:
        if (ls, cs) <= (line, column) < (le, ce) and (best is None or (ls, cs) >= best):
            best, count = (ls, cs), runs
    return count


def add_function(function, files, path_of):
    """Adds the regions and branches of one instantiation."""
    names = [path_of(name) for name in function["filenames"]]
    own = defaultdict(list)
    for ls, cs, le, ce, count, file, _, kind in function["regions"]:
        if kind != SKIPPED and names[file] is not None:
            files[names[file]].regions[(ls, cs, le, ce), kind == GAP] += count
        if kind == CODE or kind == EXPANSION:
            own[file].append((ls, cs, le, ce, count))
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
    known = {}

    def path_of(name):
        if name not in known:
            path = Path(name).resolve()
            known[name] = str(path.relative_to(root)) if path.is_relative_to(root) else None
        return known[name]

    for export in exports:
        for data in json.loads(Path(export).read_bytes())["data"]:
            for function in data["functions"]:
                add_function(function, files, path_of)
    return files


def run_lines(file):
    """Line → how often it ran, for every line of a region.  As in llvm-cov, a line on which regions begin ran as often as the
    one of them that ran most, or as what goes on from the line before."""
    inherited, begun = {}, defaultdict(int)
    # The innermost region comes last and wins.
    for ((ls, _, le, _), gap), count in sorted(file.regions.items(), key=lambda r: (r[0][0][:2], [-x for x in r[0][0][2:]])):
        for line in range(ls + 1, le + 1):
            inherited[line] = count
        if not gap:
            begun[ls] = max(begun[ls], count)
    return {line: max(inherited.get(line, 0), begun.get(line, 0)) for line in inherited.keys() | begun.keys()}
