#!/usr/bin/env python3
"""Write the result of a check to test/trust/results/NAME.json, with date, commit and machine, and docs/trust.md, which shows it.

    scripts/trust/record.py coverage --command "make coverage" --kept --figure "lines, algebra=100 %" \\
        --planted "a line that no test runs=caught"

NAME is that of a promise in test/trust/promises.toml, or begins with it and a hyphen: fuzz-urdf belongs to fuzz.
A record is written whether the promise is kept or not, and is to be committed."""

import argparse
import json
import os
import sys
from pathlib import Path

import page
import run_facts

RESULTS = run_facts.ROOT / "test/trust/results"
WRITTEN = ("test/trust/results/", "docs/trust.md", "test/mutate/results.md")
"""What checks write: it may differ from the commit that is tested."""


def pair(text):
    """The texts before and after the last "="."""
    name, equals, value = text.rpartition("=")
    if not equals or not name or not value:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form NAME=VALUE")
    return name.strip(), value.strip()


def write(name, command, kept, figures, planted=(), notes=(), results=RESULTS, in_part=False):
    """Write a record: the whole file or nothing.  figures: (name, value); planted: (fault, whether it was caught).  in_part: it found nothing, and is not all."""
    record = {
        "name": name,
        "kept": kept,
        "command": command,
        "date": run_facts.date(),
        "commit": run_facts.commit(WRITTEN),
        "machine": run_facts.machine(),
        "figures": dict(figures),
    }
    record |= {key: x for key, x in (("planted", dict(planted)), ("notes", list(notes)), ("in part", in_part)) if x}
    path = Path(results) / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_suffix(".new")
    fresh.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    os.replace(fresh, path)
    if results == RESULTS:
        page.write()
    return path


def begin(name, command, results=RESULTS):
    """Write that a check has begun.  What it finds takes the place of this; if it ends before that, the promise is not kept."""
    write(name, command, False, [], notes=["The check began and has written no result."], results=results)


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name")
    parser.add_argument("--command", required=True, help="what a reader types to run the check again")
    kept = parser.add_mutually_exclusive_group(required=True)
    kept.add_argument("--kept", action="store_true", help="the promise is kept")
    kept.add_argument("--in-part", action="store_true", help="it found nothing, and did less than is promised; the figures say how much")
    kept.add_argument("--begun", action="store_true", help="the check begins: not kept until it writes what it has found")
    kept.add_argument("--broken", action="store_true", help="it is not; the figures say by how much")
    parser.add_argument("--figure", action="append", type=pair, default=[], metavar="NAME=VALUE")
    planted = "a fault that was planted, and whether the check caught it"
    parser.add_argument("--planted", action="append", type=pair, default=[], metavar="FAULT=OUTCOME", help=planted)
    parser.add_argument("--note", action="append", default=[], help="a sentence for the page")
    parser.add_argument("--results", default=RESULTS, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.begun:
        begin(given.name, given.command, given.results)
        return
    kept = given.kept or given.in_part
    print(write(given.name, given.command, kept, given.figure, given.planted, given.note, given.results, given.in_part))


if __name__ == "__main__":
    main(sys.argv[1:])
