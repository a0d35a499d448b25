#!/usr/bin/env python3
"""Run the tests that promises name, and record the results: one record for each promise.

scripts/trust/prove.py BUILD…          folders of CMake builds in which ctest runs, as build/gcc"""

import subprocess
import sys
import tempfile
from pathlib import Path

import junit
import promises
import record
import run_facts


def run_pytest(paths, folder):
    report = folder / "pytest.xml"
    subprocess.run([sys.executable, "-m", "pytest", "-q", "-n", "2", "--dist", "loadfile", f"--junitxml={report}", *paths], cwd=run_facts.ROOT, check=False)
    return junit.cases(report)


def run_ctest(pattern, build, folder):
    report = folder / "ctest.xml"
    report.unlink(missing_ok=True)
    subprocess.run(["ctest", "--test-dir", str(build), "-R", pattern, "--output-junit", str(report)], check=False)
    return junit.cases(report)


def of_files(found, paths):
    """pytest's cases that stand in these files or folders."""
    names = tuple(path.removesuffix(".py").replace("/", ".").rstrip(".") for path in paths)
    return [case for case in found if any(f"{case.get('classname')}.".startswith(f"{name}.") for name in names)]


def groups_of(promise, of_pytest, builds, folder):
    """(name, tests): each file that the promise names, and its programs in each build that has one."""
    for path in promise.get("pytest", []):
        yield path, of_files(of_pytest, [path])
    if promise.get("ctest"):
        found = {f"ctest, {build.name}": run_ctest(promise["ctest"], build, folder) for build in builds}
        yield from {name: cases for name, cases in found.items() if cases}.items() or [("ctest", [])]


def prove(promise, of_pytest, builds, folder, results=record.RESULTS):
    """Run what pytest hasn't run, and write the record of one promise.  It is kept if each file has a test that passed, programs passed, and
    none failed."""
    figures, kept, skipped = [], True, []
    for name, found in groups_of(promise, of_pytest, builds, folder):
        count = {word: len(junit.named(found, word)) for word in ("passed", "skipped", "failed")}
        kept = kept and count["passed"] > 0 and count["failed"] == 0
        figures.append((name, ", ".join(f"{number} {word}" for word, number in count.items() if number or word == "passed")))
        figures += [(f"failed, {name}", case.get("name")) for case in junit.named(found, "failed")]
        skipped += [case.get("name") for case in junit.named(found, "skipped")]
    notes = [f"Skipped on this machine: {', '.join(skipped)}."] if skipped else []
    record.write(promise["name"] + promises.TESTS, "make trust", kept, figures, notes=notes, results=results)
    return kept


def main(arguments):
    if not arguments:
        sys.exit(__doc__)
    builds = [Path(argument) for argument in arguments]
    tested = [promise for promise in promises.read() if promises.has_tests(promise)]
    paths = sorted({path for promise in tested for path in promise.get("pytest", [])})
    with tempfile.TemporaryDirectory() as folder:
        of_pytest = run_pytest(paths, Path(folder)) if paths else []
        kept = [prove(promise, of_pytest, builds, Path(folder)) for promise in tested]
    sys.exit(0 if all(kept) else 1)


if __name__ == "__main__":
    main(sys.argv[1:])
