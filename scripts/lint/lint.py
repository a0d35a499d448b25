#!/usr/bin/env python3
"""Run compilers and analysers over C, C++ and Python.  Whatever they say is an error.  Each must also find a fault in faults/.

    scripts/lint/lint.py [--all] [--record] [--built FOLDER…] [TOOL…]
                         gcc clang headers clang-tidy cppcheck analyzer format ruff mypy; without a name all

Builds in FOLDER are up to date: what they have compiled with every warning as an error is not read again by gcc and clang.  Of the rest, and by all
tools for C and C++, what has changed since the last record is read (scripts/lint/changes.py), and where a header has changed, what includes it.
--all reads everything again, and each kernel and each header with every tool that can; it writes the record, test/trust/results/static-analysis.json,
as --record does.

What a compiler or analyser says is printed below the name of its job; the last lines are the counts, and seconds of processor time.  The variable
LINT_TIMES names a file for those of each job."""

import argparse
import concurrent.futures
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "trust")]
import changes
import record as trust_record
from units import BUILD, COMPILERS, ROOT, command, compiled, units
from warning_options import options

NAME = "static-analysis"  # of the record

FAULTS = ROOT / "scripts/lint/faults"
PYTHON = ["api", "python", "scripts", "test", "bench", "examples", "docs", "fuzz"]
SUPPRESSIONS = ROOT / "scripts/lint/cppcheck.txt"
CPPCHECK = [
    "cppcheck",
    "--quiet",
    "--error-exitcode=1",
    "--enable=warning,performance,portability",
    "--inline-suppr",
    f"--suppressions-list={SUPPRESSIONS}",
    "-D__x86_64__",
    "-D__GNUC__=12",
    "-DKSL_ISA=isa",
    "-DKSL_TABLE=table",
]
GENERATED = ["engine_calls.cpp"]
RECORDED = "recorded_rows.cpp"
"""All kernels, over a scalar that records."""
TOOLS = ["gcc", "clang", "headers", "clang-tidy", "cppcheck", "analyzer", "format", "ruff", "mypy"]
RULES = [ROOT / ".clang-tidy", ROOT / "cmake/warnings.txt"]
"""A change of these asks for all to be read again; so does another version of clang-tidy or of a compiler."""


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


class Changed:
    """What has to be read again."""

    def __init__(self, everything, candidates):
        units = {file for unit in candidates for file in changes.closure(unit.file) if "Unity" not in file.parts}
        self.files = units.union(*map(changes.closure, [*public_headers(), *own_files()]))
        rules = {line_of(file) for file in RULES} | {version(tool) for tool in ("clang-tidy", "gcc", "clang")}
        of_cppcheck = {line_of(SUPPRESSIONS), version("cppcheck")}
        self.lines = {*rules, *of_cppcheck, *map(line_of, self.files)} - {""}
        known = changes.read("lint") | {""}
        self.all = everything or not known >= rules
        self.all_of_cppcheck = self.all or not known >= of_cppcheck
        self.changed = {file for file in self.files if self.all or line_of(file) not in known}

    def reaches(self, file):
        """Has it changed, or what it includes?"""
        return not self.changed.isdisjoint(changes.closure(file))

    def chosen(self, candidates):
        """The units to read: those whose own files have changed, or include a changed header themselves.  A header that none of them has read
        is read with the smallest unit that includes it."""
        if self.all:
            return list(candidates)
        chosen = [unit for unit in candidates if any(self.changed & {member, *changes.included(member)} for member in unit.members)]
        left = self.changed - {file for unit in chosen for file in changes.closure(unit.file)}
        for unit in sorted(candidates, key=lambda unit: len(changes.closure(unit.file))):
            if left & changes.closure(unit.file):
                chosen.append(unit)
                left -= changes.closure(unit.file)
        return chosen


def line_of(file):
    return f"{changes.digest(file)} {changes.name(file)}"


def version(tool):
    """A line of the list of what was read; none where the tool isn't installed."""
    try:
        said = subprocess.run([tool, "--version"], capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return ""
    return f"{changes.hashlib.sha256(said).hexdigest()[:16]} ({tool})"


def public_headers():
    return {path for path in (ROOT / "include/ksl").rglob("*") if path.suffix in (".h", ".hpp")}


def own_files():
    """The files that cppcheck reads."""
    return {path for folder in ("src", "python") for path in (ROOT / folder).rglob("*") if path.suffix in (".c", ".cpp", ".hpp")}


def compile_jobs(every, built, changed):
    """What no build of the tests compiles with the same warnings.  gcc reads the kernels for AVX2 and clang those for AVX-512, which have code
    of their own.  A file that builds compile with a precompiled header alone, or together with others, is read by gcc as it stands."""
    done = {}
    for folder in built:
        for unit, alone in compiled(folder).items():
            done[unit] = done.get(unit, False) or alone
    for family, march in (("gcc", "-march=x86-64-v3"), ("clang", "-march=x86-64-v4")):
        left = [unit for unit in every if unit.march in ("", march) and (unit.key, family) not in done]
        if family == "gcc":
            left += [u for u in every if not u.is_kernel and (u.key, "gcc") in done and not any(done.get((u.key, f), False) for f in COMPILERS)]
        for unit in changed.chosen(left):
            chosen = [*options(family, unit.language, unit.is_test), "-Werror", "-fsyntax-only"]
            yield Job(family, unit.name, command(unit, family, *chosen))


def header_jobs(everything, changed):
    """Each public header alone, as a user's program includes it, if it or what it includes has changed: those in C as C11 and C++20.  gcc reads
    C++ headers in all units too, so clang is enough to tell whether each includes what it needs, unless everything is wanted."""
    folder = BUILD / "headers"
    folder.mkdir(parents=True, exist_ok=True)
    headers = {path.relative_to(ROOT / "include") for path in public_headers() if changed.reaches(path)}
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
                yield Job(
                    "headers",
                    f"{family} {standard} {i + 1} of {len(parts)}",
                    [
                        COMPILERS[family][language],
                        standard,
                        "-fsyntax-only",
                        *options(family, language),
                        "-Werror",
                        f"-I{ROOT}/include",
                        f"-I{ROOT}/include/ksl/compat",
                        *part,
                    ],
                )


def tidied(every):
    """Sources, with the headers that they include; kernels for one instruction set."""
    return [unit for unit in every if not unit.is_test and unit.march in ("", "-march=x86-64-v3")]


def tidy_jobs(every, changed):
    """The static analyser, which follows paths, is off for kernels: each is one long path of arithmetic, which takes it minutes.  It is off
    too for the generated calls of all algorithms, which have one form and take minutes together.  Sanitizers see what the tests run of
    both.  Lanes of numbers in kernels are counted by sizeof(P) / sizeof(T), which are one type where a number has one lane."""
    for unit in changed.chosen(tidied(every)):
        left_out = (
            "-clang-analyzer-*,-bugprone-sizeof-expression"
            if unit.is_kernel or unit.file.name == RECORDED
            else "-clang-analyzer-*"
            if unit.file.name in GENERATED
            else ""
        )
        checks = [f"--checks={left_out}"] if left_out else []
        flags = [*unit.options, *([unit.march] if unit.march else [])]
        headers = f"--header-filter=^{ROOT}/(include/ksl|src|python)/"
        yield Job("clang-tidy", unit.name, ["clang-tidy", "--quiet", *checks, headers, str(unit.file), "--", *flags])


def cppcheck_jobs(changed):
    """What has changed.  C with its headers.  C++ without those of include/, whose templates cppcheck 2.10 can't parse: it ends at some of them with a
    segmentation fault.  Compilers and clang-tidy read them.  Files have relative paths, as in the list of what is not to be reported."""
    files = sorted(file for file in own_files() if changed.all_of_cppcheck or changed.reaches(file))
    for name, suffixes, chosen in (("C++", (".cpp", ".hpp"), ["--std=c++20", "--language=c++"]), ("C", (".c",), ["--std=c11", "-Iinclude"])):
        if own := [changes.name(file) for file in files if file.suffix in suffixes]:
            yield Job("cppcheck", name, [*CPPCHECK, *chosen, *own])


def analyzer_jobs(every, changed):
    """gcc's analyser, of C that has changed; of C++ it says itself that it doesn't understand it."""
    for unit in every:
        if unit.language == "c" and changed.reaches(unit.file):
            yield Job("analyzer", unit.name, command(unit, "gcc", "-O1", "-fanalyzer", "-Werror", "-c", "-o", os.devnull))


def format_jobs():
    yield Job("format", "all C and C++", [sys.executable, str(ROOT / "scripts/format.py"), "--check"])
    yield Job("format", "all Python", [sys.executable, "-m", "ruff", "format", "--check", "--quiet", *(str(ROOT / folder) for folder in PYTHON)])


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
    yield Job("format", "faults/format.cpp", [sys.executable, str(ROOT / "scripts/format.py"), "--check", str(FAULTS / "format.cpp")], "format.cpp")
    yield Job("format", "faults/format.py", [sys.executable, "-m", "ruff", "format", "--check", "--no-cache", str(FAULTS / "format.py")], "format.py")
    yield Job("ruff", "faults/ruff_fault.py", [sys.executable, "-m", "ruff", "check", "--quiet", "--no-cache", str(FAULTS / "ruff_fault.py")], "F821")
    yield Job("mypy", "faults/mypy_fault.py", [sys.executable, "-m", "mypy", str(FAULTS / "mypy_fault.py")], "no-untyped-def")


def run(job):
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(job.command, cwd=ROOT, stdout=said, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = failed = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read()
    if job.tool == "clang-tidy" and not failed:
        text = ""  # it counts the warnings of others' headers
    ok = bool(failed) and job.expected in text if job.expected else not failed
    return Outcome(job, text, ok, used.ru_utime + used.ru_stime)


def jobs(tools, built=(), everything=False):
    """All jobs of these tools, and what the record of a later run is compared with."""
    reads = {"gcc", "clang", "clang-tidy"} & set(tools)
    every = units() if reads or "analyzer" in tools else []
    changed = Changed(everything, every if reads else [])
    slow_first = [*tidy_jobs(every, changed), *python_jobs(), *cppcheck_jobs(changed), *format_jobs()]
    all_jobs = [
        *slow_first,
        *compile_jobs(every, () if everything else built, changed),
        *header_jobs(everything, changed),
        *analyzer_jobs(every, changed),
        *fault_jobs(),
    ]
    return [job for job in all_jobs if job.tool in tools], changed


def record(outcomes, seconds, everything):
    checks = [outcome for outcome in outcomes if not outcome.job.expected]
    figures = [
        (f"{tool}: runs with nothing to say", f"{sum(o.ok for o in checks if o.job.tool == tool)} of {sum(o.job.tool == tool for o in checks)}")
        for tool in TOOLS
    ]
    figures.append(("processor time", f"{seconds:.0f} s"))
    planted = [(f"{o.job.tool}: {o.job.name}", "caught" if o.ok else "missed") for o in outcomes if o.job.expected]
    notes = [
        "gcc's analyser is run on C alone: that of gcc 12 doesn't support C++.",
        "clang-tidy follows no paths through kernels nor through the generated calls in C; sanitizers see what the tests run of them.",
        "cppcheck reads C++ without the headers of include/, which it can't parse.",
    ]
    if not everything:
        notes.append(
            "Read were the files that had changed since the record before, what includes changed headers, and with gcc and clang what "
            "the builds of the tests don't compile with the same warnings as errors; make lint LINT_OPTIONS=--all reads everything."
        )
    trust_record.write(NAME, "make lint LINT_OPTIONS=--all" if everything else "make lint", all(o.ok for o in outcomes), figures, planted, notes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tools", nargs="*", default=TOOLS, metavar="TOOL")
    parser.add_argument("--built", action="append", default=[], metavar="FOLDER", type=Path, help="a build of the tests, up to date")
    parser.add_argument("--without", action="append", default=[], metavar="TOOL", help="a tool that is not run")
    parser.add_argument("--record", action="store_true", help="write the record, if all tools are run")
    parser.add_argument("--all", action="store_true", help="read everything again, and write the record")
    given = parser.parse_args()
    if unknown := set(given.tools + given.without) - set(TOOLS):
        parser.error(f"no tool {', '.join(sorted(unknown))}; there are {', '.join(TOOLS)}")
    tools = [tool for tool in given.tools if tool not in given.without]
    recorded = (given.record or given.all) and set(tools) == set(TOOLS)
    if recorded:
        trust_record.begin(NAME, "make lint")
    wanted, changed = jobs(tools, [folder.resolve() for folder in given.built], given.all)
    outcomes = []
    with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or os.cpu_count())) as pool:
        for outcome in pool.map(run, wanted):
            outcomes.append(outcome)
            if not outcome.ok:
                missed = f": said nothing of {outcome.job.expected}" if outcome.job.expected else ""
                print(f"---- {outcome.job.tool}: {outcome.job.name}{missed}\n{outcome.said}", flush=True)
    if os.environ.get("LINT_TIMES"):
        Path(os.environ["LINT_TIMES"]).write_text("".join(f"{o.seconds:.1f} {o.ok} {o.job.tool} {o.job.name}\n" for o in outcomes))
    for tool in tools:
        own = [outcome for outcome in outcomes if outcome.job.tool == tool]
        print(f"{tool}: {sum(o.ok for o in own)} of {len(own)} as they should be, {sum(o.seconds for o in own):.0f} s")
    reading = set(TOOLS) - {"format", "ruff", "mypy"}
    if reading <= set(tools) and all(outcome.ok for outcome in outcomes if outcome.job.tool in reading):  # what they have read stays read
        changes.write("lint", changed.lines, recorded)
    if recorded:
        record(outcomes, sum(outcome.seconds for outcome in outcomes), given.all)
    sys.exit(not all(outcome.ok for outcome in outcomes))


if __name__ == "__main__":
    main()
