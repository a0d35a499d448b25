"""Mutated copies of the project, and their compilation."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

from mutator import Mutator

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WORK = ROOT / "build" / "mutate"

SCOPES = {
    "algebra": ["include/ksl/detail/*.inc"],
    "engine": [
        "include/ksl/engine/**/*.hpp",
        "src/engine/mimic/*",
        "src/engine/run/section.hpp",
        "src/engine/model/canonical_axes.cpp",
        "src/engine/model/joint_physics.cpp",
        "src/engine/building/model_builder.cpp",
    ],
    "load": ["src/load/*.cpp"],
    "batch": ["src/batch/*.cpp"],
}
# Printed text and declarations compute nothing; memory is tested by programs under sanitizers.
LEFT_OUT = {"include/ksl/detail/print.inc", "include/ksl/detail/types.inc", "include/ksl/detail/array2D.inc"}
# Written by Build.write_tree itself.
CHANGED = {"python/CMakeLists.txt", "test/main.cpp"}
# Optimised, but with functions left out of line that a release inlines everywhere: mutated, they would not compile in an hour.
FLAGS = f"-O1 -U__OPTIMIZE__ -w -fmax-errors=0 -include {HERE / 'mutants.hpp'}"


def files(scope):
    return [f for p in SCOPES[scope] for f in sorted(ROOT.glob(p)) if f.is_file() and str(f.relative_to(ROOT)) not in LEFT_OUT]


def write_if_changed(path, data):
    if not path.exists() or path.read_bytes() != data:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


class Build:
    """The mutated copy of one scope in build/mutate/NAME: tree/ its sources, out/ what is compiled."""

    def __init__(self, scope):
        self.scope, self.folder = scope, WORK / scope
        self.tree, self.out = self.folder / "tree", self.folder / "out"
        self.dropped_file = self.folder / "dropped.json"
        self.mutants = []

    def write_tree(self):
        """Copies all sources; those of the scope are mutated."""
        dropped = set()
        if self.dropped_file.exists():
            dropped = {tuple(d) for d in json.loads(self.dropped_file.read_text())}
        mutator, mutated = Mutator(), {}
        for f in files(self.scope):
            name = str(f.relative_to(ROOT))
            mutated[name] = mutator.file(name, f.read_bytes(), dropped)
        self.mutants = mutator.mutants
        wanted = set()
        for top in (
            "include",
            "src",
            "cmake",
            "test/engine",
            "test/batch",
            "test/c_api",
            "test/description",
            "test/load",
            "test/text",
            "test/algebra",
            "test/faults",
            "api",
            "python",
            "scripts",
        ):
            for f in (ROOT / top).rglob("*"):
                if f.is_file() and "__pycache__" not in f.parts:
                    name = str(f.relative_to(ROOT))
                    if name not in CHANGED:
                        write_if_changed(self.tree / name, mutated.get(name, f.read_bytes()))
                    wanted.add(self.tree / name)
        for f in (self.tree / "src").rglob("*"):
            if f.is_file() and f not in wanted:
                f.unlink()
        for name in ("CMakeLists.txt", "test/CMakeLists.txt"):
            write_if_changed(self.tree / name, (ROOT / name).read_bytes())
        cmake = (ROOT / "python/CMakeLists.txt").read_text().replace("core.cpp ufuncs.cpp)", f"core.cpp ufuncs.cpp {HERE / 'numbers.cpp'})")
        write_if_changed(self.tree / "python/CMakeLists.txt", cmake.encode())
        write_if_changed(self.tree / "test/main.cpp", (HERE / "driver.cpp").read_bytes())
        if not (self.tree / "examples").exists():
            (self.tree / "examples").symlink_to(ROOT / "examples")
        (self.folder / "mutants.json").write_text(json.dumps([asdict(m) for m in self.mutants], ensure_ascii=False, indent=0))

    def configure(self):
        """For the C++ tests and the Python module."""
        nanobind = subprocess.run([sys.executable, "-m", "nanobind", "--cmake_dir"], check=True, capture_output=True, text=True).stdout.strip()
        python = [
            "-DKSL_PYTHON=ON",
            f"-Dnanobind_DIR={nanobind}",
            f"-DPython_EXECUTABLE={sys.executable}",
            f"-DPython3_EXECUTABLE={sys.executable}",
            "-DSKBUILD_PROJECT_NAME=ksl",
        ]
        beside = Path(sys.executable).with_name("ninja")  # of a virtual environment
        python += [f"-DCMAKE_MAKE_PROGRAM={beside}"] if beside.exists() else []
        launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
        subprocess.run(
            [
                "cmake",
                "-G",
                "Ninja",
                "-S",
                self.tree,
                "-B",
                self.out,
                "-DCMAKE_BUILD_TYPE=Mutated",
                "-DKSL_TESTS=ON",
                "-DKSL_INSTRUCTION_SETS=x86_64_v3",
                f"-DCMAKE_CXX_FLAGS={FLAGS}",
                "-DCMAKE_C_FLAGS=-O1",
                *launcher,
                *python,
            ],
            check=True,
            stdout=subprocess.DEVNULL,
        )

    def compile(self, *targets):
        """Compiles; mutants that do not compile are dropped, until all others do.  The rest is compiled as far as it goes each
        time, so that few rounds are needed."""
        self.until_it_compiles(["cmake", "--build", self.out, "--target", *targets, "--", "-k", "0"])

    def module(self):
        """The mutated extension module, in a copy of the package."""
        package = self.folder / "package" / "ksl"
        shutil.rmtree(package, ignore_errors=True)
        package.mkdir(parents=True)
        built = next((self.out / "python").glob("_core*.so"))
        for f in [*(ROOT / "python/ksl").iterdir(), built]:
            if f == built or f.name not in ("__pycache__", built.name):
                (package / f.name).symlink_to(f)
        return package / built.name

    def compile_algebra(self):
        """The library of the algebra, with its helpers as symbols.  It is compiled as C++, since mutants.hpp is that."""
        library = self.folder / "libksl_algebra.so"
        sources = [self.tree / "src/ksl.c", self.tree / "src/print.c"]
        self.until_it_compiles(
            [
                "g++",
                "-x",
                "c++",
                "-std=c++20",
                *FLAGS.split(),
                "-fkeep-inline-functions",
                "-ffp-contract=off",
                "-fPIC",
                "-shared",
                "-DKSL_INLINE_HELPER=inline KSL_EXPORT",
                "-I",
                self.tree / "include",
                "-I",
                self.tree / "src",
                *sources,
                HERE / "numbers.cpp",
                "-o",
                library,
            ]
        )
        return library

    def until_it_compiles(self, command):
        for _ in range(12):
            done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"LC_ALL": "C"})
            if done.returncode == 0:
                return
            (self.folder / "errors.txt").write_text(done.stdout + done.stderr)
            if not self.drop(done.stdout + done.stderr):
                sys.exit(f"the mutated {self.scope} does not compile: see {self.folder / 'errors.txt'}")
            self.write_tree()
        sys.exit("mutants that do not compile are still found after 12 rounds")

    def drop(self, output):
        """Drops the mutants of the lines in which an error was found, or from which the function with the error was called; if a
        member is missing, only those that take it."""
        places, waiting = set(), set()
        for text in output.splitlines():
            found = re.match(r"([./]\S+?):(\d+):(?:\d+:)?\s+(.*)", text)
            if not found:
                continue
            path, message = Path(os.path.normpath(self.out / found[1])), found[3]  # ccache makes paths relative
            here = (str(path.relative_to(self.tree)), int(found[2])) if path.is_relative_to(self.tree) else None
            if "required from" in message:
                waiting.add(here)
            elif "error:" in message:
                missing = re.search(r"no member named '(\w+)'", message)
                for place in {here} if here else waiting:
                    places.add((place, missing and missing[1]))
                waiting = set()
        wrong = lambda m, place, member: (m.file, m.line) == place and (not member or m.change.endswith(f"→ .{member}"))
        old = {tuple(d) for d in json.loads(self.dropped_file.read_text())} if self.dropped_file.exists() else set()
        by_file = {}
        for place, member in places:
            if place:
                by_file.setdefault(place[0], []).append((place, member))
        new = {(m.file, m.line, m.code, m.change) for m in self.mutants if any(wrong(m, *p) for p in by_file.get(m.file, []))}
        self.dropped_file.write_text(json.dumps(sorted(old | new), ensure_ascii=False, indent=0))
        print(f"{len(new - old)} mutants dropped that do not compile", flush=True)
        return new - old
