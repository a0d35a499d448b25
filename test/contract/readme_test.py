"""What README and docs show is run as it stands."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from pages import LANGUAGES, ROOT, TUTORIALS, blocks_of, environment, set_up

sys.path.insert(0, str(ROOT / "test" / "algebra"))
from library import find
from warm_ksl import waiting

SETS_UP = re.compile(r"^make (demo|test|bench)", re.MULTILINE)
"""Blocks with these set up the whole project; they are what runs the tests."""


def blocks() -> list:
    """Those that run on their own.  tutorials_test.py runs the pages whose blocks follow each other; marks name other tests that run a block."""
    found = []
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        if path.parent != TUTORIALS:
            for block in blocks_of(path):
                if block.language in LANGUAGES and not SETS_UP.search(block.code) and "tested" not in block.marks:
                    found.append(pytest.param(block.language, block.code, id=f"{path.relative_to(ROOT)}:{block.line}-{block.language}"))
    return found


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    with waiting(tmp_path_factory.mktemp("ksl")) as folder:
        yield folder


@pytest.fixture
def checkout(tmp_path, program) -> Path:
    return set_up(tmp_path, program)


def run(command: list, folder: Path) -> subprocess.CompletedProcess:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment(), timeout=300)
    assert done.returncode == 0, f"{command[0]} ended with {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done


def run_c(code: str, folder: Path) -> None:
    """With gcc and clang, without a warning; what has a main is run."""
    (folder / "example.c").write_text(code)
    flags = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-I", ROOT / "include", "example.c"]
    run(["clang", *flags, "-fsyntax-only"], folder)
    run(["gcc", *flags, *(["-lm", "-o", "example"] if "int main(" in code else ["-fsyntax-only"])], folder)
    if "int main(" in code:
        assert run([folder / "example"], folder).stdout, "the example prints nothing"


def run_cpp(code: str, folder: Path) -> None:
    """With g++ and clang++, without a warning; with the library where the example loads a model."""
    (folder / "example.cpp").write_text(code)
    linked = [find(), f"-Wl,-rpath,{find().parent}"] if "ksl/dynamics.hpp" in code else []
    flags = ["-std=c++20", "-Wall", "-Wextra", "-Werror", "-I", ROOT / "include", "example.cpp"]
    run(["clang++", *flags, "-fsyntax-only"], folder)
    run(["g++", *flags, *linked, "-o", "example"], folder)
    assert run([folder / "example"], folder).stdout, "the example prints nothing"


def bare(code: str) -> str:
    """Without comments and blanks."""
    return re.sub(r"\s+", "", re.sub(r"/\*.*?\*/|//[^\n]*", "", code, flags=re.DOTALL))


def as_function(code: str) -> str:
    """Statements beside the header of models and dynamics."""
    return "#include <ksl/engine.h>\n#include <stdio.h>\nint excerpt(void);\nint excerpt(void) {\n" + code + "return 0;\n}\n"


def is_excerpt(code: str) -> bool:
    return "#include" not in code


@pytest.mark.parametrize(("language", "code"), blocks())
def test_block_runs(checkout, program, language, code):
    if language == "c" and is_excerpt(code):
        if code.startswith("ksl_model_t"):
            return run_c(as_function(code), checkout)
        sources = [bare(f.read_text(encoding="utf-8")) for f in (ROOT / "include").rglob("*") if f.is_file()]
        parts = [part + ";" for part in bare(code).split(";")[:-1]] if code.startswith("ksl_status_t") else [bare(code)]
        for part in parts:
            assert any(part in source for source in sources), f"an excerpt that is nowhere in include/: {part}"
    elif language == "c":
        run_c(code, checkout)
    elif language == "cpp":
        run_cpp(code, checkout)
    elif language == "python":
        run([program / "ksl", "-c", code], checkout)
    else:
        run(["sh", "-eu", "-c", code], checkout)


def test_blocks_that_are_run_elsewhere_are():
    """A mark names a test that reads the page."""
    for path in sorted((ROOT / "docs").rglob("*.md")):
        for block in blocks_of(path):
            if "tested" in block.marks:
                assert f'"{path.name}"' in (ROOT / block.marks["tested"]).read_text(encoding="utf-8")


def test_readme_has_a_block_of_each_language():
    assert [p.values[0] for p in blocks() if p.id.startswith("README")] == ["sh", "python"]


def test_readme_takes_two_minutes():
    """Ten lines of Python, and no more words than are read in that time; the rest is in docs/."""
    (code,) = (p.values[1] for p in blocks() if p.id.startswith("README") and p.values[0] == "python")
    assert len(code.splitlines()) <= 10
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) < 500


def test_the_shell_example_writes_what_readme_says(checkout):
    (code,) = (p.values[1] for p in blocks() if p.id.startswith("README") and p.values[0] == "sh")
    out = run(["sh", "-eu", "-c", code], checkout).stdout
    assert "open out/ur5/report.html" in out and "joint,kind," in out
    assert sorted(f.name for f in (checkout / "out" / "ur5").iterdir()) == ["report.html", "summary.csv", "wrenches.parquet"]


def test_the_c_example_prints_the_wrench_it_explains(checkout):
    """10 N along x of a frame turned by 90° about z and shifted by 1 along x: 10 N along y, 10 N m about z."""
    (code,) = (p.values[1] for p in blocks() if p.id.startswith("docs/start/embedded.md") and "int main" in p.values[1])
    run_c(code, checkout)
    numbers = [float(x) for x in re.findall(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", run([checkout / "example"], checkout).stdout)]
    assert numbers == pytest.approx([0, 10, 0, 0, 0, 10], abs=1e-12)


def test_links_lead_somewhere():
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]:
        prose = re.sub(r"```.*?```|`[^`\n]*`(?!\])", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", prose):
            assert "://" in target or (path.parent / target).exists(), f"{path.name} links to {target}, which is not there"
