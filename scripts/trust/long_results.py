#!/usr/bin/env python3
"""Write the result of `make test-long`, with its date and commit, from what pytest and ctest have written.

scripts/trust/long_results.py OUTPUT.md long_pytest.xml long_gcc-x86-64-v2.xml …"""

import sys
from collections import defaultdict
from pathlib import Path

import junit
import run_facts


def largest(cases, *names):
    """The largest number that tests recorded under these names, or nothing."""
    found = [float(p.get("value")) for case in cases for p in case.iter("property") if p.get("name") in names]
    return f"{max(found):.3g}" if found else ""


def compiled(paths):
    """A line for each file of ctest's: compiler and instruction set are in its name."""
    for path in paths:
        found = junit.cases(path)
        bad = [case.get("name") for case in junit.named(found, "failed")]
        yield f"| {path.stem.removeprefix('long_')} | {len(junit.named(found, 'passed'))} | {', '.join(bad)} |"


def page(of_pytest, of_ctest):
    """The text of the page; the numbers are those of the files."""
    cases = junit.cases(of_pytest)
    passed, failed, skipped = (junit.named(cases, word) for word in ("passed", "failed", "skipped"))
    by_file = defaultdict(list)
    for case in cases:
        by_file[case.get("classname").replace(".", "/") + ".py"].append(case)
    lines = [
        "# The last run of `make test-long`",
        "",
        "Written by scripts/trust/long_results.py. 100,000 random cases where `make test` takes 10,000. Errors are in units of the",
        "unit roundoff u, or shares of what the test allows.",
        "",
        f"* date: {run_facts.date()}",
        f"* commit: {run_facts.commit(['test/long_results.md'])}",
        f"* processor: {run_facts.processor()}",
        f"* passed: {len(passed)}, failed: {len(failed)}, skipped: {len(skipped)}",
        f"* time of the tests, one after the other: {sum(float(c.get('time')) for c in cases):.0f} s",
        "",
        "| file | tests | largest error, u | largest share of the bound |",
        "|---|---|---|---|",
    ]
    lines += [f"| {name} | {len(own)} | {largest(own, 'worst_u')} | {largest(own, 'worst')} |" for name, own in sorted(by_file.items())]
    lines += ["", "Programs in C and C++, with the kernels of each instruction set:", "", "| build | passed | failed |", "|---|---|---|", *compiled(of_ctest)]
    if failed:
        lines += ["", "Failed:", "", *(f"* `{case.get('classname')}::{case.get('name')}`" for case in failed)]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    given = [Path(name) for name in sys.argv[2:]]
    (of_pytest,) = (path for path in given if path.stem == "long_pytest")
    Path(sys.argv[1]).write_text(page(of_pytest, [path for path in given if path != of_pytest]), encoding="utf-8")
