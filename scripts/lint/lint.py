#!/usr/bin/env python3
"""Run compilers and analysers over all of C, C++ and Python.  Whatever they say is an error.  Each must also find a fault in faults/.

    scripts/lint/lint.py [--record] [--all] [TOOL…]        gcc clang headers clang-tidy cppcheck analyzer ruff mypy; without a name all

What a compiler or analyser says is printed below the name of its job; the last lines are the counts.  --record writes
test/trust/results/static-analysis.json.  --all also reads what takes too long for the tests: every kernel with clang-tidy, and
every public header alone with gcc as C++.  The variable LINT_TIMES names a file for the seconds that each job took."""

import argparse
import concurrent.futures
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "trust")]
import record as trust_record
from units import BUILD, COMPILERS, ROOT, command, units
from warning_options import options

NAME = "static-analysis"  # of the record

FAULTS = ROOT / "scripts/lint/faults"
PYTHON = ["python", "scripts", "test", "bench", "examples", "docs", "fuzz"]
CPPCHECK = ["cppcheck", "--quiet", "--error-exitcode=1", "--enable=warning,performance,portability", "--inline-suppr",
            f"--suppressions-list={ROOT}/scripts/lint/cppcheck.txt", "-D__x86_64__", "-D__GNUC__=12", "-DKSL_ISA=isa", "-DKSL_TABLE=table"]
GENERATED = ["engine_calls.cpp"]
TOOLS = ["gcc", "clang", "headers", "clang-tidy", "cppcheck", "analyzer", "ruff", "mypy"]


@dataclass(frozen=True)
class Job:
    tool: str
    name: str
    command: list[str]
    expected: str = ""  # of a fault: what has to be said of it


@dataclass(frozen=True)
class Outcome:
    job: Job
    said: str
    ok: bool
    seconds: float


def compile_jobs(every):
    """All units with both compilers.  gcc reads the kernels for AVX2 and clang those for AVX-512, which have code of their own."""
    for family, march in (("gcc", "-march=x86-64-v3"), ("clang", "-march=x86-64-v4")):
        for unit in every:
            if unit.march in ("", march):
                chosen = [*options(family, unit.language, unit.is_test), "-Werror", "-fsyntax-only"]
                yield Job(family, unit.name, command(unit, family, *chosen))


def header_jobs(everything):
    """Each public header alone, as a user's program includes it: those in C as C11 and C++20.  gcc reads C++ headers in all units too, so
    clang is enough to tell whether each includes what it needs, unless everything is wanted."""
    folder = BUILD / "headers"
    folder.mkdir(parents=True, exist_ok=True)
    headers = {path.relative_to(ROOT / "include") for path in (ROOT / "include/ksl").rglob("*") if path.suffix in (".h", ".hpp")}
    headers -= {header for header in headers if header.parts[1] == "detail" or header.stem.endswith("_calls")}  # parts of others
    for language, suffix in (("c", "c"), ("c++", "cpp")):
        files = []
        for header in sorted(headers if language == "c++" else (h for h in headers if h.suffix == ".h")):
            file = folder / f"{'_'.join(header.parts).replace('.', '_')}.{suffix}"
            text = f"#include <{header}>\nextern int {file.stem}_included;\n"
            if not file.exists() or file.read_text() != text:
                file.write_text(text)
            files.append(str(file))
        for family in COMPILERS if everything or language == "c" else ["clang"]:
            standard = "-std=c11" if language == "c" else "-std=c++20"
            parts = [files[i : i + 24] for i in range(0, len(files), 24)]
            for i, part in enumerate(parts):
                yield Job("headers", f"{family} {standard} {i + 1} of {len(parts)}",
                          [COMPILERS[family][language], standard, "-fsyntax-only", *options(family, language), "-Werror", f"-I{ROOT}/include",
                           f"-I{ROOT}/include/ksl/compat", *part])


def tidy_jobs(every, everything):
    """Sources, with the headers that they include; kernels for one instruction set, and unless everything is wanted the derivatives alone,
    which include most headers.

    The static analyser, which follows paths, is off for kernels: each is one long path of arithmetic, which takes it minutes.  It is off
    too for the generated calls of all algorithms, which have one form and take minutes together.  Sanitizers see what the tests run of
    both.  Lanes of numbers in kernels are counted by sizeof(P) / sizeof(T), which are one type where a number has one lane."""
    for unit in every:
        if unit.is_test or unit.march not in ("", "-march=x86-64-v3"):
            continue
        if unit.is_kernel and not everything and "unity_derivatives" not in unit.name:
            continue
        left_out = "-clang-analyzer-*,-bugprone-sizeof-expression" if unit.is_kernel else "-clang-analyzer-*" if unit.file.name in GENERATED else ""
        checks = [f"--checks={left_out}"] if left_out else []
        flags = [*unit.options, *([unit.march] if unit.march else [])]
        headers = f"--header-filter=^{ROOT}/(include/ksl|src|python)/"
        yield Job("clang-tidy", unit.name, ["clang-tidy", "--quiet", *checks, headers, str(unit.file), "--", *flags])


def cppcheck_jobs():
    """C with its headers.  C++ without those of include/, whose templates cppcheck 2.10 can't parse: it ends at some of them with a
    segmentation fault.  Compilers and clang-tidy read them.  Files have relative paths, as in the list of what is not to be reported."""
    files = sorted(path for folder in ("src", "python") for path in (ROOT / folder).rglob("*"))
    for name, suffixes, chosen in (("C++", (".cpp", ".hpp"), ["--std=c++20", "--language=c++"]), ("C", (".c",), ["--std=c11", "-Iinclude"])):
        yield Job("cppcheck", name, [*CPPCHECK, *chosen, *(str(file.relative_to(ROOT)) for file in files if file.suffix in suffixes)])


def analyzer_jobs(every):
    """gcc's analyser, of C; of C++ it says itself that it doesn't understand it."""
    for unit in every:
        if unit.language == "c":
            yield Job("analyzer", unit.name, command(unit, "gcc", "-O1", "-fanalyzer", "-Werror", "-c", "-o", os.devnull))


def python_jobs():
    folders = [folder for folder in PYTHON if (ROOT / folder).exists()]
    yield Job("ruff", "all Python", [sys.executable, "-m", "ruff", "check", "--quiet", *folders])
    yield Job("mypy", "python/ksl", [sys.executable, "-m", "mypy"])


def fault_jobs():
    """Of each tool, files with a fault, and a word of what it has to say."""
    strictly = ["-Werror", "-fsyntax-only"]
    for family, compilers in COMPILERS.items():
        yield Job(family, "faults/conversion.c", [family, *options(family, "c"), *strictly, str(FAULTS / "conversion.c")], "float-conversion")
        yield Job(family, "faults/shadow.cpp", [compilers["c++"], *options(family, "c++"), *strictly, str(FAULTS / "shadow.cpp")], "shadow]")
    yield Job("headers", "faults/user.c", ["gcc", "-std=c11", *options("gcc", "c"), *strictly, f"-I{FAULTS}", str(FAULTS / "user.c")], "fault.h")
    for check in ("bugprone-use-after-move", "clang-analyzer-core.NullDereference"):
        yield Job("clang-tidy", f"faults/tidy.cpp, {check}", ["clang-tidy", "--quiet", str(FAULTS / "tidy.cpp"), "--", "-std=c++20"], check)
    yield Job("cppcheck", "faults/cppcheck.c", [*CPPCHECK, str(FAULTS / "cppcheck.c")], "out of bounds")
    yield Job("analyzer", "faults/analyzer.c", ["gcc", "-O1", "-fanalyzer", "-Werror", "-c", "-o", os.devnull, str(FAULTS / "analyzer.c")], "double-free")
    yield Job("ruff", "faults/ruff_fault.py", [sys.executable, "-m", "ruff", "check", "--quiet", "--no-cache", str(FAULTS / "ruff_fault.py")], "F821")
    yield Job("mypy", "faults/mypy_fault.py", [sys.executable, "-m", "mypy", str(FAULTS / "mypy_fault.py")], "no-untyped-def")


def run(job):
    start = time.monotonic()
    done = subprocess.run(job.command, cwd=ROOT, capture_output=True, text=True)
    said = done.stdout + done.stderr
    if job.tool == "clang-tidy" and not done.returncode:
        said = ""  # it counts the warnings of others' headers
    ok = bool(done.returncode) and job.expected in said if job.expected else not done.returncode
    return Outcome(job, said, ok, time.monotonic() - start)


def jobs(tools, everything=False):
    every = units() if {"gcc", "clang", "clang-tidy", "analyzer"} & set(tools) else []
    slow_first = [*tidy_jobs(every, everything), *python_jobs(), *cppcheck_jobs()]
    all_jobs = [*slow_first, *compile_jobs(every), *header_jobs(everything), *analyzer_jobs(every), *fault_jobs()]
    return [job for job in all_jobs if job.tool in tools]


def record(outcomes, seconds, everything):
    checks = [outcome for outcome in outcomes if not outcome.job.expected]
    figures = [(f"{tool}: runs with nothing to say", f"{sum(o.ok for o in checks if o.job.tool == tool)} of {sum(o.job.tool == tool for o in checks)}")
               for tool in TOOLS]
    figures.append(("time", f"{seconds:.0f} s"))
    planted = [(f"{o.job.tool}: {o.job.name}", "caught" if o.ok else "missed") for o in outcomes if o.job.expected]
    notes = ["gcc's analyser is run on C alone: that of gcc 12 doesn't support C++.",
             "clang-tidy follows no paths through kernels nor through the generated calls in C; sanitizers see what the tests run of them.",
             "cppcheck reads C++ without the headers of include/, which it can't parse."]
    if not everything:
        notes.append("clang-tidy reads one group of kernels of ten; make lint LINT_OPTIONS=--all reads every one.")
    kept = all(outcome.ok for outcome in outcomes) and all(any(o.job.tool == tool for o in checks) for tool in TOOLS)
    trust_record.write(NAME, "make lint LINT_OPTIONS=--all" if everything else "make lint", kept, figures, planted, notes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tools", nargs="*", default=TOOLS, metavar="TOOL")
    parser.add_argument("--record", action="store_true", help="write the record, if all tools are run")
    parser.add_argument("--all", action="store_true", help="every kernel with clang-tidy, every header in C++ with gcc")
    given = parser.parse_args()
    if unknown := set(given.tools) - set(TOOLS):
        parser.error(f"no tool {', '.join(sorted(unknown))}; there are {', '.join(TOOLS)}")
    recorded = given.record and set(given.tools) == set(TOOLS)
    if recorded:
        trust_record.begin(NAME, "make lint")
    start = time.monotonic()
    outcomes = []
    with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or os.cpu_count())) as pool:
        for outcome in pool.map(run, jobs(given.tools, given.all)):
            outcomes.append(outcome)
            if not outcome.ok:
                missed = f": said nothing of {outcome.job.expected}" if outcome.job.expected else ""
                print(f"---- {outcome.job.tool}: {outcome.job.name}{missed}\n{outcome.said}", flush=True)
    if os.environ.get("LINT_TIMES"):
        Path(os.environ["LINT_TIMES"]).write_text("".join(f"{o.seconds:.1f} {o.ok} {o.job.tool} {o.job.name}\n" for o in outcomes))
    for tool in given.tools:
        own = [outcome for outcome in outcomes if outcome.job.tool == tool]
        print(f"{tool}: {sum(o.ok for o in own)} of {len(own)} as they should be, {sum(o.seconds for o in own):.0f} s")
    if recorded:
        record(outcomes, time.monotonic() - start, given.all)
    sys.exit(not all(outcome.ok for outcome in outcomes))


if __name__ == "__main__":
    main()
