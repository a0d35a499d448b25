"""docs/check.md: its tables are what the rules declare and find, and its examples run."""

import importlib.metadata
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import check_page
from ksl_command import run_ksl

PAGE = (ROOT / "docs" / "check.md").read_text(encoding="utf-8")


def test_the_table_of_rules_is_what_the_rules_declare():
    assert check_page.written(PAGE, rules=check_page.rules()) == PAGE, "run scripts/check_page.py"


def test_the_findings_in_real_robots():
    try:
        there = importlib.metadata.version("example-robot-data")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    if f"example-robot-data {there}:" not in PAGE:
        pytest.skip(f"the page is about another version of example-robot-data than {there}")
    assert check_page.written(PAGE, findings=check_page.findings()) == PAGE, "run scripts/check_page.py"


def test_the_examples(tmp_path, monkeypatch):
    """The file, both commands with what they print, and the program, in one folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lever.urdf").write_text(re.search(r"```xml\n(.*?)```", PAGE, re.DOTALL)[1])
    for example in re.findall(r"```console\n\$ ksl (.*?)\n(.*?)```", PAGE, re.DOTALL):
        done = run_ksl(*example[0].split())
        assert done.stdout == example[1], example[0]
    exec(re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)[1], {})
