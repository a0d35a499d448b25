"""What scripts/generate.py makes is what is checked in."""

import re
import sys
from dataclasses import fields
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import generate
import pytest
from generator.rows import ALGORITHMS, DEFAULTS, Algorithm


def test_generated_files_are_what_the_rows_give():
    files = generate.files()
    assert len(files) > 10
    for path, text in files.items():
        assert (ROOT / path).read_text(encoding="utf-8") == text, f"{path} is stale: run scripts/generate.py"


@pytest.mark.parametrize("row", ALGORITHMS, ids=lambda row: row.name)
def test_a_row_says_one_thing_in_all_languages(row):
    """Costs, and places in books, of Python's text are those of the others."""
    said = re.compile(r"O\([^)]*\)|(?:table|section|eq\.) \(?\d+\.\d+")
    assert set(said.findall(row.python)) <= set(said.findall(row.text))


def test_headers_say_what_options_are_by_default_and_what_may_be_null():
    c, cpp = ((ROOT / f"include/ksl/{name}").read_text(encoding="utf-8") for name in ("engine_calls.h", "dynamics_calls.hpp"))
    plain = lambda text: re.sub(r"[\s/*]+", " ", text)
    for row in ALGORITHMS:
        if "c" not in row.faces:
            continue
        (of_c,) = re.findall(rf"/\*\*((?:(?!\*/).)*)\*/\nKSL_EXPORT ksl_status_t ksl_{row.name}\(", c, re.S)
        (of_cpp,) = re.findall(rf"((?:/// .*\n)+)template <class S>\nKSL_EXPORT void {row.name}\(", cpp)
        assert ("external may be NULL" in plain(of_c)) == bool(row.external), row.name
        assert ("options may be NULL" in plain(of_c)) == (row.request in DEFAULTS), row.name
        for text in (of_c, of_cpp) if row.request in DEFAULTS else ():
            assert DEFAULTS[row.request] in plain(text), row.name


def test_no_generated_file_is_left_of_an_algorithm_that_is_gone():
    assert generate.stale() == []


def test_every_generated_file_says_so():
    for path, text in generate.files().items():
        assert "scripts/generate.py" in text.split("\n", 3)[0] + text.split("\n", 3)[2], path


@pytest.mark.parametrize("column", ["mimic", "elements", "loops"])
def test_a_row_says_what_mimic_joints_force_elements_and_loops_do_in_it(column):
    """Without a default: a new algorithm would leave out springs, say, and nobody would see it."""
    row = {field.name: getattr(ALGORITHMS[0], field.name) for field in fields(ALGORITHMS[0])}
    assert Algorithm(**row) == ALGORITHMS[0]
    with pytest.raises(TypeError, match=f"'{column}'"):
        Algorithm(**{name: value for name, value in row.items() if name != column})
