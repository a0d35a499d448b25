"""What scripts/generate.py makes is what is checked in."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import generate  # noqa: E402


def test_generated_files_are_what_the_rows_give():
    files = generate.files()
    assert len(files) > 10
    for path, text in files.items():
        assert (ROOT / path).read_text(encoding="utf-8") == text, f"{path} is stale: run scripts/generate.py"


def test_no_generated_file_is_left_of_an_algorithm_that_is_gone():
    assert generate.stale() == []


def test_every_generated_file_says_so():
    for path, text in generate.files().items():
        assert "scripts/generate.py" in text.split("\n", 3)[0] + text.split("\n", 3)[2], path
