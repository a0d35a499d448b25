"""The page of promises, made of records: what it says of runs that were good, bad, or never made."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "scripts" / "trust"
sys.path.insert(0, str(SCRIPTS))
import junit
import page
import promises
import prove
import record
import run_facts

PROMISE = '[[promise]]\nname = "fuzz"\npromise = "P."\nfigure = "F"\ncovers = ["fuzz/**"]\ncommand = "make fuzz"\nrecords = ["fuzz-a", "fuzz-b"]\n'


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "promises.toml").write_text(PROMISE)
    return tmp_path


def run(folder, name, kept):
    record.write(name, "make fuzz", kept, [("executions", "10")], [("overrun", "caught")], results=folder / "results")


def test_a_promise_is_kept_if_all_its_records_say_so(folder):
    states = [promises.state(promises.read(folder)[0])]
    for name, kept in [("fuzz-a", True), ("fuzz-b", True), ("fuzz-b", False)]:
        run(folder, name, kept)
        states.append(promises.state(promises.read(folder)[0]))
    assert states == ["not shown", "in part", "kept", "not kept"]


def test_a_run_of_less_than_is_promised_shows_a_promise_in_part(folder):
    run(folder, "fuzz-a", True)
    given = [
        sys.executable,
        str(SCRIPTS / "record.py"),
        "fuzz-b",
        "--command",
        "make fuzz",
        "--in-part",
        "--figure",
        "executions=9",
        "--results",
        str(folder / "results"),
    ]
    subprocess.run(given, check=True, capture_output=True)
    read = promises.read(folder)
    assert promises.state(read[0]) == "in part" and "| fuzz-b | 9 | in part |" in page.page(read)


def test_a_shortfall_is_on_the_page(folder):
    run(folder, "fuzz-a", True), run(folder, "fuzz-b", True)
    (folder / "promises.toml").write_text(PROMISE + 'shortfall = "Too slow."\n')
    text = page.page(promises.read(folder))
    assert "| F | in part |" in text and "**What falls short:** Too slow." in text


def test_the_page_shows_figures_faults_and_what_was_not_run(folder):
    run(folder, "fuzz-a", False)
    text = page.page(promises.read(folder))
    assert "| executions | 10 |" in text and "Planted faults: caught: overrun." in text and "**not kept**" in text
    assert "`fuzz-b`: no run is on record." in text


def test_records_of_one_command_are_rows_with_their_names(folder):
    run(folder, "fuzz-a", True), run(folder, "fuzz-b", False)
    rows = [line.split(" | ")[:3] for line in page.page(promises.read(folder)).splitlines() if line.startswith("| fuzz-")]
    assert rows == [["| fuzz-a", "10", "kept"], ["| fuzz-b", "10", "**not kept**"]]


def test_a_record_has_date_commit_and_machine(folder):
    done = [sys.executable, str(SCRIPTS / "record.py"), "x", "--command", "make x", "--kept", "--figure", "a=b=1", "--results", str(folder)]
    subprocess.run(done, check=True, capture_output=True)
    written = json.loads((folder / "x.json").read_text())
    assert written["figures"] == {"a=b": "1"} and written["kept"] is True
    assert written["date"] and written["commit"] and " core" in written["machine"]


def test_failures_of_named_tests_break_a_promise(tmp_path):
    (tmp_path / "test").mkdir()
    (tmp_path / "test" / "a_test.py").write_text("def test_good(): pass\ndef test_bad(): assert False\n")
    report = tmp_path / "junit.xml"
    subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--junitxml={report}", "test"], cwd=tmp_path, capture_output=True)
    found = prove.of_files(junit.cases(report), ["test/a_test.py"])
    assert sorted(map(junit.outcome, found)) == ["failed", "passed"]
    assert prove.of_files(found, ["test/other_test.py"]) == []


def test_a_program_that_is_not_there_has_failed(tmp_path):
    (tmp_path / "CTestTestfile.cmake").write_text(f'add_test(there "{sys.executable}" "--version")\nadd_test(gone "{tmp_path}/gone")\n')
    found = prove.run_ctest("there|gone", tmp_path, tmp_path)
    assert {case.get("name"): junit.outcome(case) for case in found} == {"there": "passed", "gone": "failed"}


PROOF = {"name": "fuzz", "pytest": ["test/a_test.py", "test/b_test.py"]}


@pytest.mark.parametrize("of_b, kept", [("<skipped/>", False), ("", True), (None, False)])
def test_each_named_file_needs_a_test_that_passed(tmp_path, of_b, kept):
    of_a = '<testcase classname="test.a_test" name="a"/><testcase classname="test.a_test" name="s"><skipped/></testcase>'
    of_b = f'<testcase classname="test.b_test" name="b">{of_b}</testcase>' if of_b is not None else ""
    (tmp_path / "junit.xml").write_text(f"<testsuites>{of_a}{of_b}</testsuites>")
    assert prove.prove(PROOF, junit.cases(tmp_path / "junit.xml"), [], tmp_path, results=tmp_path) is kept
    written = json.loads((tmp_path / "fuzz-tests.json").read_text())
    assert written["kept"] is kept and written["figures"]["test/a_test.py"] == "1 passed, 1 skipped" and "s" in written["notes"][0]


def test_a_check_that_dies_keeps_nothing(folder):
    run(folder, "fuzz-a", True), run(folder, "fuzz-b", True)
    begun = [sys.executable, str(SCRIPTS / "record.py"), "fuzz-b", "--command", "make fuzz", "--begun", "--results", str(folder / "results")]
    subprocess.run(begun, check=True)
    assert promises.state(promises.read(folder)[0]) == "not kept"


def test_the_page_is_what_the_records_say():
    """What it says of history was true at the commit that it names, where that is still in the history."""
    text = page.PAGE.read_text(encoding="utf-8")
    made_at = page.commit_of(text)
    assert made_at
    if run_facts.has_history() and run_facts.is_in_history(made_at, "HEAD"):
        assert text == page.page(promises.read(), made_at)
    else:
        assert page.without_history(text) == page.page(promises.read())


def git(folder, *arguments):
    identity = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    return subprocess.run(["git", "-C", folder, *identity, *arguments], check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def history(tmp_path, monkeypatch):
    """Three commits: a file that the promise covers, another one, and a change of the first."""
    monkeypatch.setattr(run_facts, "ROOT", tmp_path)
    git(tmp_path, "init", "-q")
    for name, text in [("fuzz/a.py", "1"), ("b.py", "1"), ("fuzz/a.py", "2")]:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
        git(tmp_path, "add", name)
        git(tmp_path, "commit", "-q", "-m", name)
    return git(tmp_path, "rev-list", "--reverse", "HEAD").split()


def promise_with_records_of(commits, tmp_path):
    (tmp_path / "promises.toml").write_text(PROMISE)
    for name, commit in zip(("fuzz-a", "fuzz-b"), commits, strict=True):
        run(tmp_path, name, True)
        path = tmp_path / "results" / f"{name}.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"commit": commit}))
    return promises.read(tmp_path)


def test_the_page_says_since_when_the_code_of_a_record_has_changed(history, tmp_path):
    first, second, third = history
    read = promise_with_records_of((first, third), tmp_path)
    text = page.page(read, third)
    assert f"Made at commit {third[:12]}." in text
    assert "fuzz-a: The code that it covers has changed since, in 1 commit." in text
    assert "fuzz-b: The code that it covers has not changed since." in text
    assert "fuzz-a: The code that it covers has not changed since." in page.page(read, second)
    assert page.commit_of(text) == third[:12] and page.without_history(text) == page.page(read)


def test_the_page_says_that_a_commit_was_replaced_and_nothing_where_history_is_cut_off(history, tmp_path, monkeypatch):
    read = promise_with_records_of(("0" * 40, history[0]), tmp_path)
    text = page.page(read, history[2])
    assert "fuzz-a: That commit is not in the history any more" in text and page.without_history(text) == page.page(read)
    git(tmp_path, "clone", "-q", "--depth", "1", f"file://{tmp_path}", tmp_path / "shallow")
    monkeypatch.setattr(run_facts, "ROOT", tmp_path / "shallow")
    assert "since" not in page.page(read, history[2]).split("[SECURITY.md]")[1]


def test_every_record_belongs_to_a_promise_and_every_test_file_exists():
    read = promises.read()
    names = {name for promise in read for name in promises.expected(promise)}
    assert {path.stem for path in (promises.FOLDER / "results").glob("*.json")} <= names
    assert all((ROOT / path).exists() for promise in read for path in [*promise.get("pytest", []), promise.get("details", "")])
    covered = {glob for promise in read for name in promise["runs"] for glob in promises.covered(promise, name)}
    assert [glob for glob in sorted(covered) if not any(ROOT.glob(glob.removesuffix("/**") if glob.endswith("/**") else glob))] == []
