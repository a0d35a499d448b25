"""The promises of test/trust/promises.toml, and the records of their last runs."""

import json
from pathlib import Path

import run_facts

try:
    import tomllib
except ImportError:  # Python 3.10
    import tomli as tomllib

FOLDER = run_facts.ROOT / "test/trust"
TESTS = "-tests"  # results/NAME-tests.json is the record that `make trust` writes of the tests of a promise


def read(folder=FOLDER):
    """The promises, in the order of the file; `runs` of each: its records by name, None where one is missing."""
    promises = tomllib.loads((Path(folder) / "promises.toml").read_text(encoding="utf-8"))["promise"]
    for promise in promises:
        promise["runs"] = {name: record(name, folder) for name in expected(promise)}
    return promises


def expected(promise):
    """The names of the records that show whether a promise is kept."""
    names = promise.get("records", [promise["name"]]) if "command" in promise else []
    return [*names, *([promise["name"] + TESTS] if has_tests(promise) else [])]


def covered(promise, name):
    """The patterns of the files that a record of this promise is about, and of the tests that it ran."""
    tests = promise.get("pytest", []) if name.endswith(TESTS) else []
    return [*promise.get("covers_of", {}).get(name, promise["covers"]), *tests]


def age(promise, name, page_of):
    """What has become of the commit that a record names, seen from the commit `page_of`, in a sentence; nothing where it can't be told."""
    commit = promise["runs"][name]["commit"][:40]
    if not page_of or not run_facts.has_history():
        return ""
    if not run_facts.is_in_history(commit, page_of):
        return "That commit is not in the history any more: commits were replaced when branches were rebased. What has changed since is not known."
    changed = run_facts.commits_since(commit, page_of, covered(promise, name))
    if not changed:
        return "The code that it covers has not changed since."
    return f"The code that it covers has changed since, in {changed} commit{'s' if changed > 1 else ''}."


def has_tests(promise):
    return bool(promise.get("pytest") or promise.get("ctest"))


def record(name, folder=FOLDER):
    path = Path(folder) / "results" / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def state(promise):
    """In a word or two: kept, in part, not kept, not shown."""
    runs = promise["runs"].values()
    if not any(runs):
        return "not shown"
    if any(run and not run["kept"] for run in runs):
        return "not kept"
    return "in part" if None in runs or any(run.get("in part") for run in runs) or promise.get("shortfall") else "kept"
