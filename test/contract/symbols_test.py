"""One instruction set's code never ends up in another's: symbols of the kernel objects, and the library on an old processor."""

import os
import platform
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
LEVELS = ("x86-64-v2", "x86-64-v3", "x86-64-v4")
BUILDS = {"release": ["-O3", "-DNDEBUG"], "debug": ["-O0", "-g0"]}
TABLES = {
    **{f"ksl_kernels_{file.stem}": ("ksl_kernels", f"src/engine/algorithms/{file.name}") for file in sorted((ROOT / "src/engine/algorithms").glob("*.cpp"))},
    "ksl_finite": ("ksl_kernels", "src/batch/finite.cpp"),
    "ksl_array_kernels": ("ksl_array_kernels", "src/batch/array_kernels.cpp"),
}
"""What is compiled once for each level: the table that it exports, its CMake target, and its file."""


def included(source: Path) -> set[Path]:
    """The headers of the engine that a file includes, directly or not."""
    found, pending = set(), [source]
    while pending:
        for name in re.findall(r'#include "(ksl/[^"]+|engine/[^"]+|batch/[^"]+)"', pending.pop().read_text(encoding="utf-8")):
            header = ROOT / ("include" if name.startswith("ksl/") else "src") / name
            if header not in found:
                found.add(header)
                pending.append(header)
    return found


def debug_tables() -> list[str]:
    """Few tables whose files include every header that any of them includes: a header that leaves the namespace is seen."""
    headers = {table: included(ROOT / source) for table, (_, source) in TABLES.items()}
    missing, chosen = set().union(*headers.values()), ["ksl_finite", "ksl_array_kernels"]
    while missing := missing - set().union(*(headers[table] for table in chosen)):
        chosen.append(max(headers, key=lambda table: len(headers[table] & missing)))
    return chosen


TABLES_OF = {"release": list(TABLES), "debug": debug_tables()}
"""In a debug build templates are out of line, so that weak symbols are many; its objects are compiled for this test alone."""


def built(compiler: str) -> Path | None:
    """Where `make test` has built the release with this compiler: beside the library that KSL_LIBRARY names."""
    library = os.environ.get("KSL_LIBRARY")
    folder = Path(library).parent.parent / {"g++": "gcc", "clang++": "clang"}[compiler] if library else None
    return folder if folder and (folder / "libksl.a").exists() else None


COMPILED = (("g++", "release"), ("g++", "debug"), *((("clang++", "release"),) if built("clang++") else ()))


def levels(compiler: str, build: str) -> tuple[str, ...]:
    """Of the release, those that `make test` has built with this compiler.  Two are enough to see what is shared."""
    folder = built(compiler) if build == "release" else None
    if folder:
        return tuple(level for level in LEVELS if (folder / f"CMakeFiles/ksl_kernels_{level.replace('-', '_')}.dir").exists())
    return LEVELS[1:2] if compiler == "clang++" else LEVELS[:2]


pytestmark = pytest.mark.skipif(platform.machine() != "x86_64", reason="there is one instruction set only on this processor")


def compile_object(compiler: str, flags: list[str], source: str, out: Path) -> Path:
    """With the flags that CMakeLists.txt gives."""
    common = ["-std=c++20", "-fPIC", "-fvisibility=hidden", "-fvisibility-inlines-hidden", "-I", ROOT / "include", "-I", ROOT / "src"]
    done = subprocess.run([compiler, *common, *flags, "-c", ROOT / source, "-o", out], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


def symbols(path: Path) -> list[tuple[str, str]]:
    """(kind, name) of everything that the linker sees of an object; lower-case letters are local, but for u, v, w."""
    lines = subprocess.run(["nm", path], capture_output=True, text=True, check=True).stdout.splitlines()
    return [(line.split()[-2], line.split()[-1]) for line in lines if line.split()]


def kernel_object(compiler: str, build: str, level: str, table: str, folder: Path, library: Path | None) -> Path:
    """The object out of the folder where its library was built; compiled here where there is none."""
    name, (target, source) = level.replace("-", "_"), TABLES[table]
    if library:
        return library / f"CMakeFiles/{target}_{name}.dir/{source}.o"
    own = [f"-march={level}", f"-DKSL_ISA={name}", f"-DKSL_TABLE={table}_{name}"]
    return compile_object(compiler, BUILDS[build] + own, source, folder / f"{compiler}-{build}-{level}-{table}.o")


def build_library(build_type: str, folder: Path) -> Path:
    """The folder, with the static library of such a build in it; a debug build without -g, which nothing here reads."""
    options = [f"-DCMAKE_BUILD_TYPE={build_type}", "-DCMAKE_C_COMPILER=gcc", "-DCMAKE_CXX_COMPILER=g++", "-DCMAKE_CXX_FLAGS_DEBUG=", "-DCMAKE_C_FLAGS_DEBUG="]
    configure = ["cmake", "-S", ROOT, "-B", folder, *options]
    build = ["cmake", "--build", folder, "--target", "ksl_static", "--parallel", str(len(os.sched_getaffinity(0)))]
    for step in (configure, build):
        done = subprocess.run(step, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def libraries(tmp_path_factory) -> dict[str, Path]:
    """Where the static library lies that programs are linked with, and whose objects are looked at."""
    return {"release": built("g++") or build_library("Release", tmp_path_factory.mktemp("release"))}


@pytest.fixture(scope="module")
def objects(tmp_path_factory, libraries):
    """{(compiler, build, level, table): symbols}; level "baseline" is a file of the library's that uses the same templates."""
    folder, jobs = tmp_path_factory.mktemp("kernels"), {}
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for compiler, build in COMPILED:
            library = None if build == "debug" else libraries[build] if compiler == "g++" else built(compiler)
            for level, table in product(levels(compiler, build), TABLES_OF[build]):
                jobs[compiler, build, level, table] = pool.submit(kernel_object, compiler, build, level, table, folder, library)
            jobs[compiler, build, "baseline", ""] = pool.submit(
                compile_object, compiler, BUILDS[build], "src/engine/dynamics.cpp", folder / f"{compiler}-{build}-baseline.o"
            )
    return {key: symbols(job.result()) for key, job in jobs.items()}


EVERY_OBJECT = pytest.mark.parametrize(
    ("compiler", "build", "level", "table"), [(c, b, level, t) for c, b in COMPILED for level, t in product(levels(c, b), TABLES_OF[b])]
)


def weak_symbols(found: list[tuple[str, str]]) -> set[str]:
    """All but DW.ref.…, pointers to the runtime's handler of exceptions, no code."""
    return {name for kind, name in found if kind in "WVuwv" and not name.startswith("DW.ref.")}


@EVERY_OBJECT
def test_a_kernel_object_exports_its_table_and_nothing_else(objects, compiler, build, level, table):
    strong = [name for kind, name in objects[compiler, build, level, table] if kind in "TDRBGSAC"]
    assert strong == [f"{table}_{level.replace('-', '_')}"]


@EVERY_OBJECT
def test_a_weak_symbol_of_a_kernel_object_bears_the_sets_name(objects, compiler, build, level, table):
    """So no other set's object can have it."""
    name = level.replace("-", "_")
    strangers = {symbol for symbol in weak_symbols(objects[compiler, build, level, table]) if f"{len(name)}{name}" not in symbol}
    assert not strangers, f"{len(strangers)} weak symbols are not in the namespace {name}, {sorted(strangers)[:3]} among them"


@pytest.mark.parametrize(("compiler", "build"), COMPILED)
def test_no_two_objects_share_a_weak_symbol(objects, compiler, build):
    """The linker keeps one copy of a weak symbol: which one, an old processor would find out."""
    weak = {level: set() for level in (*levels(compiler, build), "baseline")}
    for (c, b, level, _), found in objects.items():
        if (c, b) == (compiler, build):
            weak[level] |= weak_symbols(found)
    for i, one in enumerate(weak):
        for other in list(weak)[i + 1 :]:
            shared = weak[one] & weak[other]
            assert not shared, f"{one} and {other} share {len(shared)} symbols, {sorted(shared)[:3]} among them"


def test_weak_symbols_are_there_to_be_looked_at(objects):
    """In a debug build templates are out of line: if none were found, the tests above would test nothing."""
    assert all(weak_symbols(objects["g++", "debug", level, table]) for level, table in product(levels("g++", "debug"), TABLES_OF["debug"]) if table != "ksl_finite")


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
    command = ["g++", "-std=c++20", "-O1", "-I", ROOT / "include", folder / "program.cpp", library / "libksl.a", "-lpugixml", "-pthread", "-o", folder / "program"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "program"


@pytest.fixture(scope="module")
def program(tmp_path_factory, libraries) -> Path:
    """A program linked with the static library, as CMake builds it."""
    folder = tmp_path_factory.mktemp("program")
    (folder / "program.cpp").write_text(PROGRAM)
    return link(folder, libraries["release"])


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
    for level in levels("g++", "release"):
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
