"""The coverage gate on sources with planted faults: a line that no test runs, a branch that goes one way only, a template that
nothing instantiates, a discarded branch, exclusions that exclude nothing."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
import gate
import source_text

HEADER = """#pragma once
// A template with two instantiations: each runs one of the branches that its argument selects.
template <bool square> int power(int x) {
  if constexpr (square) {
    return x * x;
  } else {
    return x;
  }
}
template <class T> T larger(T a, T b) {
  if (a < b)
    return b;
  return a;
}
#if defined(NEVER_DEFINED)
inline int other_processor() { return 1; }
#endif
"""
PROGRAM = """#include "toy.hpp"
int main() {
  const double sum = power<true>(2) + power<false>(-4) + larger(1, 2) + larger(2.0, 1.0);
  return sum < 0;
}
"""
SOURCE = "include/ksl/engine/toy.hpp"


def links(folder):
    """Whether clang links a program that writes a profile: Debian's clang comes without the library, libclang-rt holds it."""
    if not all(shutil.which(tool) for tool in ("clang++", "llvm-cov", "llvm-profdata")):
        return False
    command = ["clang++", "-fprofile-instr-generate", "-x", "c++", "-", "-o", folder / "program"]
    return not subprocess.run(command, input=b"int main() {}\n", capture_output=True).returncode


@pytest.fixture(scope="module")
def compiler(tmp_path_factory):
    if not links(tmp_path_factory.mktemp("clang")):
        pytest.skip("clang's coverage is not installed; `make coverage` installs it and runs this test")


compiled = pytest.mark.usefixtures("compiler")


def export(folder, header, program=PROGRAM):
    """Compiles and runs the program in a folder like KSL's; the path of what llvm-cov exports."""
    source = folder / SOURCE
    source.parent.mkdir(parents=True)
    (folder / "src").mkdir()
    source.write_text(header)
    (folder / "main.cpp").write_text(program)
    run = {"check": True, "cwd": folder}
    subprocess.run(["clang++", "-std=c++20", "-fprofile-instr-generate", "-fcoverage-mapping", "-I", source.parent, "main.cpp", "-o", "toy"], **run)
    subprocess.run(["./toy"], check=True, cwd=folder, env={"LLVM_PROFILE_FILE": "toy.profraw"})
    subprocess.run(["llvm-profdata", "merge", "toy.profraw", "-o", "toy.profdata"], **run)
    with (folder / "toy.json").open("w") as out:
        subprocess.run(["llvm-cov", "export", "./toy", "-instr-profile=toy.profdata"], stdout=out, **run)
    return folder / "toy.json"


def passes(folder, header, program=PROGRAM, exclusions=""):
    """The gate's status."""
    path = export(folder, header, program)
    (folder / "exclusions.toml").write_text(exclusions)
    return gate.main([str(path), "--root", str(folder), "--exclusions", str(folder / "exclusions.toml")])


@compiled
def test_what_some_instantiation_runs_counts(tmp_path, capsys):
    assert passes(tmp_path, HEADER) == 0
    assert "engine          8        0    100.00         2        0      100.00" in capsys.readouterr().out


@compiled
@pytest.mark.parametrize(
    "fault, found",
    [
        ("inline int unused(int x) { return x; }\n", "toy.hpp:18: never ran"),
        ("template <class T> T nobody(T x) {\n  return x;\n}\n", "toy.hpp:19: never ran"),
        ("template <class T> T half(T x) {\n  if constexpr (sizeof(T) > 64)\n    return x / 2;\n  return x;\n}\n", "toy.hpp:20: never ran"),
    ],
    ids=["a function", "a template", "a discarded branch"],
)
def test_what_nothing_runs_is_found(tmp_path, capsys, fault, found):
    program = PROGRAM.replace("sum = ", "sum = half(0) + " if "half" in fault else "sum = ")
    assert passes(tmp_path, HEADER + fault, program) == 1
    printed = capsys.readouterr()
    assert found in printed.out and "engine: " in printed.err


@compiled
def test_a_branch_that_goes_one_way_is_found(tmp_path, capsys):
    assert passes(tmp_path, HEADER, PROGRAM.replace("larger(2.0, 1.0)", "larger(1.0, 2.0)")) == 1
    assert "toy.hpp:11:7: never false" in capsys.readouterr().out


EXCLUDED = '[[exclusion]]\nfile = "include/ksl/engine/toy.hpp"\ntext = "{}"\nreason = "a test of the gate"\n'


@compiled
@pytest.mark.parametrize(
    "text, status, sentence",
    [
        ("int unused(", 0, ""),
        ("return x * x", 1, "tests run all of it; remove the exclusion"),
        ("no such text", 1, "0 lines match, expected one"),
        ("return", 1, "lines match, expected one"),
    ],
    ids=["right", "of what runs", "of nothing", "of several lines"],
)
def test_exclusions(tmp_path, capsys, text, status, sentence):
    fault = "inline int unused(int x) { return x; }\n"
    assert passes(tmp_path, HEADER + (fault if not status else ""), exclusions=EXCLUDED.format(text)) == status
    assert sentence in capsys.readouterr().err


def test_exclusions_are_few_and_have_reasons(tmp_path, capsys):
    path = tmp_path / "exclusions.toml"
    path.write_text(EXCLUDED.format("x").replace("a test of the gate", " "))
    with pytest.raises(SystemExit, match="an exclusion has file, text and reason"):
        gate.read_exclusions(path)
    path.write_text("\n".join(EXCLUDED.format(f"line {i}") for i in range(21)))
    assert any("21 exclusions, expected at most 20" in sentence for sentence in gate.exclude({}, gate.read_exclusions(path), tmp_path))
    own = gate.read_exclusions(HERE / "exclusions.toml")
    assert len(own) <= 20 and all((gate.ROOT / e["file"]).read_text(encoding="utf-8").count(e["text"]) >= 1 for e in own)


def test_blocks_of_the_text():
    text = "// {\nint f(int x) noexcept {\n  switch (x) {\n  case 1: return '{';\n  }\n  const int y[] = {1, 2};\n  if (x)\n    return 0;\n  return y[0];\n}\n"
    assert source_text.block_ends(text) == {(2, 23): 10}
    assert source_text.code_lines(text) == {2, 3, 4, 6, 7, 8, 9}
    assert source_text.block_ends("template <class T>\nconcept c = requires(T t) { t + t; };\n") == {}
    assert [list(r) for r in source_text.conditional_sections("#if A\nx\n#else\ny\n#endif\n")] == [[1, 2], [3, 4]]


@pytest.mark.parametrize(
    "path, part",
    [
        ("include/ksl/detail/plucker.inc", "algebra"),
        ("include/ksl/pack.hpp", "algebra"),
        ("include/ksl/engine/model/model.hpp", "engine"),
        ("include/ksl/model.hpp", "engine"),
        ("src/print.c", "algebra"),
        ("src/engine/building/model.cpp", "engine"),
        ("src/text/xml.cpp", "loader"),
        ("src/batch/threads.cpp", "batch"),
        ("src/c_api/calls.cpp", "c_api"),
        ("src/engine/kernels/algorithms/mass_1.cpp", "engine"),
    ],
)
def test_every_file_belongs_to_a_part(path, part):
    assert gate.part_of(path) == part
