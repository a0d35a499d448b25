"""One instruction set's code never ends up in another's: symbols of the kernel objects, and the library on an old processor."""

import json
import os
import platform
import re
import shutil
import subprocess
from collections import Counter
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
LEVELS = ("x86-64-v2", "x86-64-v3", "x86-64-v4")
TABLES = (
    "ksl_array_kernels",
    "ksl_finite",
    "ksl_kernels_inverse_kinematics",
    *(
        f"ksl_kernels_{name}"
        for file in (ROOT / "src/engine/kernels/algorithms").glob("*.cpp")
        for name in re.findall(r"^KSL_KERNELS\((\w+)\)", file.read_text(), re.M)
    ),
)
"""The tables of functions that are compiled once for each level."""

pytestmark = pytest.mark.skipif(platform.machine() != "x86_64", reason="there is one instruction set only on this processor")


def built(compiler: str) -> Path:
    """Where `make test` has built the library with this compiler: clang's is the one that KSL_LIBRARY names."""
    library = os.environ.get("KSL_LIBRARY")
    assert library, "KSL_LIBRARY names the library that make test builds"
    return Path(library).parent.parent / compiler


def levels_of(compiler: str) -> list[str]:
    """The sets that it has, as CMake has resolved them."""
    folders = (built(compiler) / "CMakeFiles").glob("ksl_kernels_*.dir")
    return sorted(folder.stem.removeprefix("ksl_kernels_").replace("_", "-") for folder in folders)


def objects_of(compiler: str, target: str) -> list[Path]:
    """Those that are compiled now, as CMake lists them: a folder keeps what was compiled before."""
    commands = json.loads((built(compiler) / "compile_commands.json").read_text())
    named = (re.search(r" -o (CMakeFiles/(\w+)\.dir/\S+)", entry["command"]) for entry in commands)
    return [built(compiler) / found[1] for found in named if found and re.fullmatch(target, found[2])]


def kernels_of(compiler: str, level: str) -> list[Path]:
    return objects_of(compiler, f"ksl(_array)?_kernels_{level.replace('-', '_')}")


def symbols(paths: list[Path]) -> list[tuple[str, str]]:
    """(kind, name) of everything that the linker sees of objects; lower-case letters are local, but for u, v, w."""
    lines = subprocess.run(["nm", "--print-file-name", *paths], capture_output=True, text=True, check=True).stdout.splitlines()
    return [tuple(line.split()[-2:]) for line in lines]


BUILDS = ("clang", "gcc")
"""An optimised build, and a debug build, in which templates are out of line, so that weak symbols are many."""


@pytest.fixture(scope="module")
def kernels() -> dict[str, dict[str, list[tuple[str, str]]]]:
    """{build: {level: symbols of its kernels}}; level "baseline" is the rest of the library, which uses the same templates."""
    found = {}
    for compiler in BUILDS:
        files = {level: kernels_of(compiler, level) for level in levels_of(compiler)}
        files["baseline"] = objects_of(compiler, "ksl_objects")
        found[compiler] = {level: symbols(own) for level, own in files.items()}
    return found


def weak_symbols(found: list[tuple[str, str]]) -> set[str]:
    """All but DW.ref.…, pointers to the runtime's handler of exceptions, no code."""
    return {name for kind, name in found if kind in "WVuwv" and not name.startswith("DW.ref.")}


def strong_symbols(found: list[tuple[str, str]]) -> list[str]:
    return sorted(name for kind, name in found if kind in "TDRBGSAC")


def test_every_build_is_looked_at(kernels):
    """`make test` builds two sets with each compiler."""
    assert len(kernels["gcc"]) > 2 and len(kernels["clang"]) > 2


@pytest.mark.parametrize("build", BUILDS)
def test_kernel_objects_export_their_tables_and_nothing_else(kernels, build):
    for level in kernels[build].keys() - {"baseline"}:
        assert strong_symbols(kernels[build][level]) == sorted(f"{table}_{level.replace('-', '_')}" for table in TABLES)


@pytest.mark.parametrize("build", BUILDS)
def test_a_weak_symbol_of_a_kernel_object_bears_the_sets_name(kernels, build):
    """So no other set's object can have it."""
    for level in kernels[build].keys() - {"baseline"}:
        name = level.replace("-", "_")
        strangers = {symbol for symbol in weak_symbols(kernels[build][level]) if f"{len(name)}{name}" not in symbol}
        assert not strangers, f"{len(strangers)} weak symbols are not in the namespace {name}, {sorted(strangers)[:3]} among them"


@pytest.mark.parametrize("build", BUILDS)
def test_no_two_sets_share_a_weak_symbol(kernels, build):
    """The linker keeps one copy of a weak symbol: which one, an old processor would find out."""
    for one, other in combinations(kernels[build], 2):
        shared = weak_symbols(kernels[build][one]) & weak_symbols(kernels[build][other])
        assert not shared, f"{one} and {other} share {len(shared)} symbols, {sorted(shared)[:3]} among them"


def test_a_large_function_is_compiled_once_for_a_set():
    """The linker keeps one copy, with the options of one file or of another as it happens: src/engine/kernels/compiled_once/ has what several kernels call."""
    for level in levels_of("clang"):
        command = ["nm", "--print-file-name", "--print-size", "--defined-only", *kernels_of("clang", level)]
        lines = [line.rsplit(maxsplit=3) for line in subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()]
        found = {(line[0].partition(":")[0], line[3]): int(line[1], 16) for line in lines if len(line) == 4 and line[2] in "WV"}
        objects, sizes = Counter(name for _, name in found), {name: size for (_, name), size in found.items()}
        assert sizes, f"no object of {level} has a weak symbol"
        several = {name: objects[name] for name, size in sizes.items() if size > 10_000 and objects[name] > 1}
        assert not several, f"{level}: {len(several)} functions are in several objects, add them to compiled_once.hpp: {several}"


def test_weak_symbols_are_there_to_be_looked_at(kernels):
    """If none were found, the tests above would test nothing."""
    assert all(len(weak_symbols(found)) > (100 if build == "gcc" else 0) for build in BUILDS for level, found in kernels[build].items() if level != "baseline")
    assert all(len(weak_symbols(kernels[build]["baseline"])) > 100 for build in BUILDS)


PROGRAM = """
#include <ksl/dynamics.hpp>
#include <cstdio>
int main(int, char **argv) {
  const ksl::model m = ksl::load(argv[1]);
  ksl::data d(m);
  std::printf("%s\\n", ksl::instruction_set());
  for (int k = 0; k < 5; ++k) {
    double x[18], tau[6], w[48];
    for (int i = 0; i < 18; ++i)
      x[i] = 0.1 * i - 0.7 * k;
    ksl::inverse_dynamics(m, d, x, x + 6, x + 12, tau);
    int links[8];
    for (int i = 0; i < 8; ++i)
      links[i] = i;
    ksl::reaction_request request;
    request.n = 8;
    request.link = links;
    request.at = request.axes = ksl::wrench_frame::world;
    ksl::reactions(m, d, request, w);
    for (double y : tau)
      std::printf("%.17g\\n", y);
    for (double y : w)
      std::printf("%.17g\\n", y);
    double kinetic, potential;
    ksl::energy(m, d, x, x + 6, &kinetic, &potential);
    std::printf("%.17g\\n%.17g\\n", kinetic, potential);
  }
}
"""


def link(folder: Path, library: Path) -> Path:
    command = [
        "g++",
        "-std=c++20",
        "-O1",
        "-I",
        ROOT / "include",
        folder / "program.cpp",
        library / "libksl.a",
        "-lpugixml",
        "-pthread",
        "-o",
        folder / "program",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "program"


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Path:
    """A program linked with the static library, as CMake builds it."""
    folder = tmp_path_factory.mktemp("program")
    (folder / "program.cpp").write_text(PROGRAM)
    return link(folder, built("clang"))


def run(program: Path, *launcher: str, **environment: str) -> tuple[str, np.ndarray]:
    env = {k: v for k, v in os.environ.items() if k != "KSL_ISA"} | environment
    done = subprocess.run([*launcher, program, ROOT / "examples" / "robots" / "ur5.urdf"], capture_output=True, text=True, env=env)
    assert done.returncode == 0, f"{launcher} ended with {done.returncode}: {done.stderr}"
    name, *numbers = done.stdout.split()
    return name, np.array(numbers, dtype=float)


def test_the_library_runs_on_an_old_processor(program):
    """A processor of 2008, emulated: it ends with an illegal instruction if anything above x86-64-v2 is run."""
    emulator = shutil.which("qemu-x86_64")
    assert emulator, "qemu-x86_64 is not there; on Debian and Ubuntu: apt install qemu-user"
    here, numbers = run(program)
    name, old = run(program, emulator, "-cpu", "Nehalem")
    assert name == "x86-64-v2" and here in LEVELS
    assert len(old) == 5 * (6 + 48 + 2) and np.isfinite(old).all()
    assert np.abs(old - numbers).max() < 1e-12 * np.abs(numbers).max()


def test_all_sets_that_run_here_agree(program):
    best, numbers = run(program)
    for level in levels_of("clang"):
        if LEVELS.index(level) > LEVELS.index(best):
            continue
        name, found = run(program, KSL_ISA=level)
        assert name == level and np.abs(found - numbers).max() < 1e-12 * np.abs(numbers).max()


def test_a_set_that_does_not_run_is_refused(program):
    emulator = shutil.which("qemu-x86_64")
    assert emulator, "qemu-x86_64 is not there; on Debian and Ubuntu: apt install qemu-user"
    env = os.environ | {"KSL_ISA": "x86-64-v4"}
    done = subprocess.run([emulator, "-cpu", "Nehalem", program, ROOT / "examples" / "robots" / "ur5.urdf"], capture_output=True, text=True, env=env)
    assert done.returncode != 0 and "KSL_ISA=x86-64-v4" in done.stderr and "known: x86-64-v2;" in done.stderr
