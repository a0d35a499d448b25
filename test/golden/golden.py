"""The same bits everywhere: builds the golden programs with each compiler, level of optimisation and instruction set, and compares their
hashes with the tables: api/functions.tsv of the algebra, hashes.tsv of algorithms and kinds of joints.

A line of a table is a function or algorithm, in double and in single precision, the hashes of both, and the functions of the C library that
they call.  The last bits of these depend on the C library.  So the golden programs replace them (make_programs.py), and each line is the same with every C library.

usage: golden.py [--compilers gcc,clang] [--levels 0,1,2,3] [--sets x86-64-v2,…,neon] [--parts algebra,engine] [--flags FLAGS] [--update]
                 [--library FOLDER] [--record]

--library: takes the engine of a build, its libksl.a, instead of compiling it.  --record: writes test/trust/results/same-bits.json."""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
TABLE = HERE / "hashes.tsv"
SETS = ("x86-64-v2", "x86-64-v3", "x86-64-v4", "neon")
# The library's kernels are compiled with these, too.  Where gcc 12 puts scalars together to vectors, it fuses multiplications with sums and
# differences, whatever -ffp-contract says: docs/algebra.md, "Promises".
STRICT = {"gcc": ["-ffp-contract=off", "-fno-tree-slp-vectorize"], "clang": ["-ffp-contract=off", "-fno-slp-vectorize"]}
COMPILERS = {"gcc": (["gcc"], ["g++"]), "clang": (["clang"], ["clang++"])}
CROSS = "aarch64-linux-gnu"
ARM_COMPILERS = {
    "gcc": ([f"{CROSS}-gcc"], [f"{CROSS}-g++"]),
    "clang": (["clang", f"--target={CROSS}"], ["clang++", f"--target={CROSS}"]),  # with gcc's C and C++ libraries for that target
}
ALGORITHMS = sorted((ROOT / "src/engine/kernels/algorithms").glob("*.cpp"))
sys.path[:0] = [str(HERE), str(ROOT / "scripts")]
from engine_sources import engine_sources
from make_programs import algebra, functions, libm, wrapped

WRAP = [f"-Wl,--wrap={name}" for name in wrapped()]


class Broken(Exception):
    """A program can't be built or run."""


def run(*command: object, folder: Path | None = None, timeout: float = 3600) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=timeout, cwd=folder)
    if done.returncode:
        raise Broken(f"{shlex.join(map(str, command))}: status {done.returncode}\n{done.stderr[-3000:]}")
    return done.stdout


class Build:
    """The golden programs of one compiler, level and set."""

    def __init__(self, folder: Path, compiler: str, level: str, isa: str, flags: list[str]) -> None:
        self.folder, self.isa, self.name = folder, isa, f"{compiler} -O{level} {isa}"
        arm = isa == "neon"
        self.c, self.cpp = ARM_COMPILERS[compiler] if arm else COMPILERS[compiler]
        self.march = [] if arm else [f"-march={isa}"]
        self.flags = [f"-O{level}", *STRICT[compiler], *flags, "-w", "-I", ROOT / "include", "-I", ROOT / "src", "-I", HERE]
        self.runner = ["qemu-aarch64"] if arm else []
        self.static = ["-static"] if arm else []
        self.ccache = ["ccache"] if shutil.which("ccache") else []

    def compiled(self, source: Path, out: str, *flags: object) -> Path:
        path = self.folder / out
        compiler, standard = (self.c, "-std=c11") if source.suffix == ".c" else (self.cpp, "-std=c++20")
        named = source.name if source.parent == self.folder else source  # ccache knows texts by the names that they are given by
        run(*self.ccache, *compiler, standard, *self.flags, *flags, "-c", named, "-o", path, folder=self.folder)
        return path

    def algebra(self) -> str:
        (self.folder / "algebra.c").write_text(algebra())
        objects = [self.compiled(s, s.stem + ".o", *self.march) for s in (self.folder / "algebra.c", ROOT / "src/ksl.c")]
        return self.linked("algebra", objects, self.c)

    def engine(self, library: Path | None) -> str:
        isa = self.isa.replace("-", "_")
        program = self.compiled(HERE / "engine.cpp", "engine.o")  # as all but the kernels, for any processor
        if library:
            return self.linked("engine", [program, library / "libksl.a"], self.cpp, "-lpugixml", "-pthread")
        kernels = [(f, [f"-DKSL_ISA={isa}", *self.march]) for f in ALGORITHMS]
        kernels += [(ROOT / "src/engine/kernels/finite.cpp", [f"-DKSL_ISA={isa}", f"-DKSL_TABLE=ksl_finite_{isa}", *self.march])]
        kernels += [(ROOT / "src" / f, [f"-DKSL_HAS_{isa}"] if "dispatch" in f else []) for f in engine_sources()]
        with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            part = lambda f: ".".join(f.relative_to(ROOT).with_suffix(".part.o").parts)  # files in two folders have the same names
            objects = list(pool.map(lambda k: self.compiled(k[0], part(k[0]), "-DNDEBUG", *k[1]), kernels))
        # readers of robot files and array functions are left out: nothing here calls them
        return self.linked("engine", [program, *objects], self.cpp, "-pthread", "-Wl,--unresolved-symbols=ignore-all")

    def linked(self, name: str, objects: list[Path], compiler: list[str], *flags: str) -> str:
        (self.folder / "libm.c").write_text(libm())
        run(*compiler, *objects, self.compiled(self.folder / "libm.c", "libm.o"), *WRAP, *self.static, *flags, "-lm", "-o", self.folder / name)
        return run(*self.runner, self.folder / name)


def rows(text: str) -> dict[str, tuple[str, str]]:
    """{function: (hash, functions of the C library that it calls)}."""
    out = {}
    for line in text.splitlines():
        if line and not line.startswith("#"):
            names, hashes, *called = line.split("\t")
            out |= {name: (hash_, called[0] if called else "") for name, hash_ in zip(names.split(", "), hashes.split(", "), strict=True)}
    return out


def of_tables() -> dict[str, tuple[str, str]]:
    """The same of both tables."""
    algebra = [(row.names, *row.golden) for row in functions.rows_of_functions() if row.golden]
    return rows("\n".join("\t".join((", ".join(names), *golden)) for names, *golden in algebra)) | rows(TABLE.read_text())


def differences(found: dict[str, tuple[str, str]], parts: list[str]) -> list[str]:
    """Names whose hash is not that of the table, names that were not found, and names that the table lacks."""
    of_engine = lambda name: name.startswith(("algorithm ", "kind "))
    expected = {name: row for name, row in of_tables().items() if ("engine" if of_engine(name) else "algebra") in parts}
    return sorted(name for name in {*expected, *found} if expected.get(name, ("",))[0] != found.get(name, ("",))[0])


def write_tables(found: dict[str, tuple[str, str]]) -> None:
    known = of_tables() | found
    head, *lines = functions.TABLE.read_text().splitlines()
    for k, line in enumerate(lines):
        columns, names = line.split("\t")[:9], line.split("\t")[1].split(", ")
        if names[0] in known:
            hashes, called = zip(*(known.pop(name) for name in names), strict=True)
            assert len(set(called)) == 1, f"{names}: these call other functions of the C library, so each needs a row of its own"
            lines[k] = "\t".join([*columns, ", ".join(hashes), called[0]]).rstrip("\t")
    functions.TABLE.write_text("\n".join([head, *lines]) + "\n")
    head, together = TABLE.read_text().splitlines()[0], {}
    for name, (hash_, called) in known.items():
        together.setdefault((name.removesuffix(" float").removesuffix(" double"), called), []).append((name, hash_))
    lines = ["\t".join((*map(", ".join, zip(*twins)), called)).rstrip("\t") for (_, called), twins in together.items()]
    TABLE.write_text("\n".join([head, *lines]) + "\n")


PLANTED = "-ffp-contract=on"
"""A fault: products and sums that are rounded once instead of twice.  clang does that without optimisation too, which compiles faster."""
NOTICED = 100
"""Functions at least whose hashes it must change."""


def planted() -> str:
    """Whether the table tells a build of the algebra with the fault."""
    with tempfile.TemporaryDirectory() as folder:
        found = rows(Build(Path(folder), "clang", "0", "x86-64-v3", [PLANTED]).algebra())
    return "caught" if len(differences(found, ["algebra"])) > NOTICED else "missed"


def record(kept: list[str], ok: bool, fault: str) -> None:
    figures = [word for figure in kept for word in ("--figure", figure)]
    to_record("--kept" if ok else "--broken", *figures, "--planted", f"the algebra built with {PLANTED}={fault}")


def to_record(*arguments: str) -> None:
    subprocess.run([sys.executable, str(ROOT / "scripts/trust/record.py"), "same-bits", "--command", "make golden", *arguments], check=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    comma = lambda text: text.split(",")
    parser.add_argument("--compilers", type=comma, default=["gcc", "clang"])
    parser.add_argument("--levels", type=comma, default=["0", "1", "2", "3"])
    parser.add_argument("--sets", type=comma, default=list(SETS))
    parser.add_argument("--parts", type=comma, default=["algebra", "engine"])
    parser.add_argument("--flags", type=shlex.split, default=[])
    parser.add_argument("--library", type=Path)
    parser.add_argument("--update", action="store_true", help="write the hashes of the first build into the tables")
    parser.add_argument("--record", action="store_true", help="of the whole alone: with none of the options above")
    given = parser.parse_args()
    chosen = [name for name in ("compilers", "levels", "sets", "parts", "flags", "library") if getattr(given, name) != parser.get_default(name)]
    if given.record and (chosen or given.update):
        parser.error(f"a part of the builds is not recorded: leave out --record, or {', '.join(chosen) or 'update'}")
    if given.record:
        to_record("--begun")
    cases = [(c, o, s) for c in given.compilers for o in given.levels for s in given.sets]
    wrong, kept = 0, []
    for compiler, level, isa in cases:
        with tempfile.TemporaryDirectory() as folder:
            build = Build(Path(folder), compiler, level, isa, given.flags)
            found: dict[str, tuple[str, str]] = {}
            for part in given.parts:
                found |= rows(build.algebra() if part == "algebra" else build.engine(given.library))
        if given.update:
            write_tables(found)
            given.update = False
        other = differences(found, given.parts)
        wrong += bool(other)
        kept.append(f"{build.name}, {' and '.join(given.parts)}={'same' if not other else f'{len(other)} other'}")
        print(f"{build.name}: {len(found)} hashes, {len(other)} differ{': ' if other else ''}{', '.join(other[:5])}", flush=True)
    if given.record:
        fault = planted()
        wrong += fault != "caught"
        record(kept, not wrong, fault)
    return 1 if wrong else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Broken as error:
        sys.exit(f"golden: {error}")
