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

PROMISE = '[[promise]]\nname = "fuzz"\npromise = "P."\nfigure = "F"\ncommand = "make fuzz"\nrecords = ["fuzz-a", "fuzz-b"]\n'


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


def test_a_shortfall_is_on_the_page(folder):
    run(folder, "fuzz-a", True), run(folder, "fuzz-b", True)
    (folder / "promises.toml").write_text(PROMISE + 'shortfall = "Too slow."\n')
    text = page.page(promises.read(folder))
    assert "| F | in part |" in text and "**What falls short:** Too slow." in text


def test_the_page_shows_figures_faults_and_what_was_not_run(folder):
    run(folder, "fuzz-a", False)
    text = page.page(promises.read(folder))
    assert "| executions | 10 |" in text and "| overrun | caught |" in text and "**not kept**" in text
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
    assert page.PAGE.read_text(encoding="utf-8") == page.page(promises.read())


def test_every_record_belongs_to_a_promise_and_every_test_file_exists():
    read = promises.read()
    names = {name for promise in read for name in promises.expected(promise)}
    assert {path.stem for path in (promises.FOLDER / "results").glob("*.json")} <= names
    assert all((ROOT / path).exists() for promise in read for path in [*promise.get("pytest", []), promise.get("details", "")])
