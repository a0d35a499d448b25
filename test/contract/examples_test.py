"""The programs in examples/c and examples/cpp (of "embedded.md" and others) build without a warning, with both compilers, and print what they should.
examples/embedded is in single_header_test.py."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "algebra"))
from library import find

FLAGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I", ROOT / "include"]
COMPILERS = {"c": ("gcc -std=c11", "clang -std=c11"), "cpp": ("g++ -std=c++20", "clang++ -std=c++20")}
PRINTED = {
    "tool_wrench.c": [
        "pressed, at the sensor       force   1.500   0.000   9.629 N, moment -0.1500  0.3000 -0.0300 N m",  # 0.8 N + 0.9 kg · 9.81 m/s²
        "9.745 N along an axis 0.0356 m from the tip, with -0.0527 N m about it",
    ],
    "payload_limit.c": [
        "luff (revolute, carries boom and 25 kg): 318.8 N m of 900 N m",  # 9.81 m/s² (20 kg · 1 m + 5 kg · 2.5 m)
        "29.43 N m more for each kilogram",  # 9.81 m/s² · 3 m
        "fold (revolute, carries jib and 5 kg): 24.5 N m of 200 N m",  # 9.81 m/s² · 5 kg · 0.5 m
        "the hook holds 17.89 kg",  # (200 − 24.525) / 9.81, less than (900 − 318.825) / 29.43
    ],
    "joint_loads.c": [
        "base               motor    0.000 N m, bearings  163.75 N",  # 9.81 m/s² times the sum of the file's masses
        "panda_flange_joint motor    0.000 N m, bearings    0.00 N",
        "motor 107.72 N m at most, bearings 291.2 N; they differ by 0e+00 N m about the axis",
    ],
    "frames.cpp": [
        "power of the rope: 49.050 W, seen from the world: 49.050 W",  # 50 kg · 9.81 m/s² · 0.2 m · 0.5 rad/s
        "about the world's origin: moment 98.100 N m",
    ],
    "hold_still.cpp": ["wrist_3", "base                    206.4897 N"],  # 9.81 m/s² times the sum of the file's masses
}


def sources():
    return [p for kind in COMPILERS for p in sorted((ROOT / "examples" / kind).iterdir())]


def test_every_example_is_known():
    assert {p.name for p in sources()} == set(PRINTED)


@pytest.mark.parametrize("which", [0, 1], ids=["gcc", "clang"])
@pytest.mark.parametrize("source", sources(), ids=lambda p: p.name)
def test_example(source, which, tmp_path):
    library = find()
    compiler = COMPILERS[source.suffix[1:]][which].split()
    linked = [library, f"-Wl,-rpath,{library.parent}"] if "ksl/dynamics.hpp" in source.read_text() or "ksl/engine.h" in source.read_text() else []
    built = subprocess.run([*compiler, *FLAGS, source, *linked, "-lm", "-o", tmp_path / "example"], capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    done = subprocess.run([tmp_path / "example"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert [text for text in PRINTED[source.name] if text not in done.stdout] == [], done.stdout


@pytest.mark.parametrize("source", sources(), ids=lambda p: p.name)
def test_commands_of_the_comment_run_as_printed(source, tmp_path):
    """In the root of a checkout whose library is built in build/release."""
    for name in ("include", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "build").mkdir()
    (tmp_path / "build/release").symlink_to(find().parent)
    comment = source.read_text().partition("#include")[0]
    commands = re.findall(r"^(?://)? +((?:cc|c\+\+|\./a\.out) ?[^*\n]*)", comment, re.MULTILINE)
    assert commands, "the comment says no command"
    done = subprocess.run(["sh", "-eu", "-c", "\n".join(commands)], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert [text for text in PRINTED[source.name] if text not in done.stdout] == [], done.stdout
