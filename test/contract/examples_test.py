"""The programs in examples/c and examples/cpp build without a warning, with both compilers, and print what they should.
examples/embedded is in single_header_test.py."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "algebra"))
from library import find

FLAGS = ["-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I", ROOT / "include"]
COMPILERS = {"c": ("gcc -std=c11", "clang -std=c11"), "cpp": ("g++ -std=c++20", "clang++ -std=c++20")}
PRINTED = {
    "tool_wrench.c": [
        "pressed, at the sensor       force   1.500   0.000   9.629 N, moment -0.1500  0.3000 -0.0300 N m",  # 0.8 N + 0.9 kg · 9.81 m/s²
        "9.745 N along an axis 0.0356 m from the tip, with -0.0527 N m about it",
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
    linked = [library, f"-Wl,-rpath,{library.parent}"] if "ksl/dynamics.hpp" in source.read_text() else []
    built = subprocess.run([*compiler, *FLAGS, source, *linked, "-lm", "-o", tmp_path / "example"], capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    done = subprocess.run([tmp_path / "example"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert [text for text in PRINTED[source.name] if text not in done.stdout] == [], done.stdout
