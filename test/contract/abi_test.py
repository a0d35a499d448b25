"""What a version number says: the versions that follow from changes of the C interface.
`make abi` compares the interface itself with that of the last release."""

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts" / "abi"))
from abi import ADDED, BROKEN, NONE, last_release, needed, numbers, objections, version_of_project


@pytest.mark.parametrize(
    "old, change, least",
    [
        ("0.1.0", NONE, "0.1.0"),
        ("0.1.0", ADDED, "0.1.1"),
        ("0.1.4", BROKEN, "0.2.0"),
        ("1.2.3", NONE, "1.2.3"),
        ("1.2.3", ADDED, "1.3.0"),
        ("1.2.3", BROKEN, "2.0.0"),
    ],
)
def test_the_least_version_after_a_change(old, change, least):
    assert needed(old, change) == least
    assert list(objections(old, least, change, announced=True)) == []


def test_a_version_that_says_too_little_is_refused():
    (said,) = objections("1.2.3", "1.2.4", ADDED, announced=True)
    assert "version 1.2.4 must be 1.3.0 or above" in said
    assert list(objections("1.9.0", "1.10.0", ADDED, announced=True)) == [], "10 is above 9"


def test_what_breaks_must_be_announced():
    (said,) = objections("1.2.3", "2.0.0", BROKEN, announced=False)
    assert "API_CHANGES.md needs a section 2.0.0" in said


def test_the_version_is_one():
    """In the package, in both change logs, and not below the interface on record.  Headers: compat_test.py."""
    version = version_of_project()
    for file in ("pyproject.toml", "CMakeLists.txt", "CITATION.cff"):  # they take it from the header, or leave it out
        assert version not in (ROOT / file).read_text(encoding="utf-8")
    assert re.search(rf"^## {re.escape(version)}\b", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert re.search(rf"^## {re.escape(version)}\b", (ROOT / "API_CHANGES.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert numbers(version) >= numbers(last_release())
