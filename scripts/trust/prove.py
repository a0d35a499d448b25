#!/usr/bin/env python3
"""Run the tests that promises name, and record the results: one record for each promise.

    scripts/trust/prove.py BUILD…          folders of CMake builds in which ctest runs, as build/gcc"""

import subprocess
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree

import promises
import record
import run_facts


def cases(path):
    return list(ElementTree.parse(path).iter("testcase")) if path.exists() else []


def outcome(case):
    """passed, skipped or failed."""
    if case.find("failure") is not None or case.find("error") is not None or case.get("status") == "fail":
        return "failed"
    return "skipped" if case.find("skipped") is not None or case.get("status") in ("notrun", "disabled") else "passed"


def run_pytest(paths, folder):
    report = folder / "pytest.xml"
    subprocess.run([sys.executable, "-m", "pytest", "-q", "-n", "2", "--dist", "loadfile", f"--junitxml={report}", *paths], cwd=run_facts.ROOT, check=False)
    return cases(report)


def run_ctest(pattern, build, folder):
    report = folder / "ctest.xml"
    report.unlink(missing_ok=True)
    subprocess.run(["ctest", "--test-dir", str(build), "-R", pattern, "--output-junit", str(report)], check=False)
    return cases(report)


def of_files(found, paths):
    """Those of pytest's cases that stand in these files or folders."""
    names = tuple(path.removesuffix(".py").replace("/", ".").rstrip(".") for path in paths)
    return [case for case in found if any(f"{case.get('classname')}.".startswith(f"{name}.") for name in names)]


def prove(promise, of_pytest, builds, folder):
    """Run what pytest hasn't run, and write the record of one promise."""
    groups = {"pytest": of_files(of_pytest, promise["pytest"])} if promise.get("pytest") else {}
    for build in builds if promise.get("ctest") else []:
        groups[f"ctest, {build.name}"] = run_ctest(promise["ctest"], build, folder)
    figures, kept = [], True
    for name, found in groups.items():
        count = {word: sum(outcome(case) == word for case in found) for word in ("passed", "skipped", "failed")}
        kept = kept and count["passed"] > 0 and count["failed"] == 0
        figures.append((name, ", ".join(f"{number} {word}" for word, number in count.items() if number or word == "passed")))
        figures += [(f"failed, {name}", case.get("name")) for case in found if outcome(case) == "failed"]
    record.write(promise["name"] + promises.TESTS, "make trust", kept and bool(groups), figures)
    return kept


def main(arguments):
    builds = [Path(argument) for argument in arguments]
    tested = [promise for promise in promises.read() if promises.has_tests(promise)]
    paths = sorted({path for promise in tested for path in promise.get("pytest", [])})
    with tempfile.TemporaryDirectory() as folder:
        of_pytest = run_pytest(paths, Path(folder)) if paths else []
        kept = [prove(promise, of_pytest, builds, Path(folder)) for promise in tested]
    sys.exit(0 if all(kept) else 1)


if __name__ == "__main__":
    main(sys.argv[1:])
