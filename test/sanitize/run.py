#!/usr/bin/env python3
"""Build with a sanitizer (presets of CMakePresets.json), run the tests with it, count its reports, and record the result.

    test/sanitize/run.py address|thread|valgrind|valgrind-python [--without-python] [--tests FILE…]

Before the tests it runs planted.cpp, which has the faults that the sanitizer must see, one of them in a Python test.  A part of the tests
is not recorded."""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT / "scripts/trust"))
import junit
import record

REPORT = re.compile(
    r"ERROR: (?:Address|Leak)Sanitizer|runtime error:|WARNING: ThreadSanitizer|== (?:Invalid|Conditional jump|Use of uninit|Syscall param)|<error>"
)
REPORTS = "reports"
"""Files that sanitizers write while Python tests run begin with this."""
LEAKS = "definite,indirect"
VALGRIND = ["valgrind", "-q", "--error-exitcode=99", "--leak-check=full", f"--show-leak-kinds={LEAKS}", f"--errors-for-leak-kinds={LEAKS}"]
VALGRIND_OF_PYTHON = ["valgrind", "-q", "--leak-check=no", "--xml=yes", "--child-silent-after-fork=yes"]
OURS = re.compile(r"<obj>[^<]*/(?:_core|libksl|planted)[^</]*</obj>")
"""An object of a frame of a report that counts: Python and other packages have reports of their own."""


@dataclass(frozen=True)
class Kind:
    """A sanitizer: how tests are run with it, which Python tests, and the faults of planted.cpp that it must report."""

    faults: tuple[str, ...]
    environment: dict[str, str]
    python_tests: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    left_out_cases: dict[str, tuple[str, ...]] = field(default_factory=dict)  # of programs in C++; without names, the whole program
    preloaded: tuple[str, ...] = ()  # compiler and name of the sanitizer's library, which must be in the interpreter from the start
    before: list[str] = field(default_factory=list)  # what the command line of a program begins with
    before_python: list[str] = field(default_factory=list)  # and that of Python
    build: str = ""  # another kind whose build this one shares: it runs Python tests alone


KINDS = {
    # Only programs in C and C++ are searched for leaks: Python itself keeps memory until its end.
    # Left out: tests that compile, start browsers or look at builds, and those that compare bits of instruction sets, since this build has
    # one.  They run no code of ours that other tests don't.  Printing and arrays are always tested under sanitizers, by programs of their
    # own.  Ray's own programs hang with a preloaded library.
    "address": Kind(
        ("heap", "leak", "shift", "truncation", "float-cast"),
        {"ASAN_OPTIONS": "detect_leaks=1:allocator_may_return_null=1", "UBSAN_OPTIONS": "print_stacktrace=1"},
        ("test",),
        (
            "test/contract",
            "test/viewer",
            "test/report/html/browser_test.py",
            "test/cli",
            "test/trust",
            "test/golden",
            "test/coverage",
            "test/mechanism/batch_test.py::test_every_instruction_set_gives_the_same_bits",
            "test/algebra/print_test.py",
            "test/algebra/array_test.py",
            "test/sweeps/sweep_workers_test.py::test_on_ray_the_bits_are_the_same_and_a_lost_worker_costs_its_partition_only",
        ),
        preloaded=("clang", "libclang_rt.asan-x86_64.so"),
    ),
    # The tests of batches and threads alone: code without instrumentation, as in other packages, is reported where it is right.
    # ThreadSanitizer allows no threads after a fork.  clang's library of it crashes in programs that were not linked with it; that of gcc has
    # the same functions.
    "thread": Kind(
        ("race",),
        {"TSAN_OPTIONS": f"exitcode=66:suppressions={HERE / 'thread.supp'}"},
        ("test/mechanism/threads_test.py", "test/mechanism/batch_test.py"),
        (
            "test/mechanism/batch_test.py::test_every_instruction_set_gives_the_same_bits",
            "test/mechanism/threads_test.py::test_a_child_of_a_fork_has_threads_of_its_own",
            "test/mechanism/threads_test.py::test_children_of_children_too",
        ),
        preloaded=("gcc", "libtsan.so"),
    ),
    # valgrind can't run AVX-512, and computes long double in double precision.  It takes the place of operator new, so that no test can count
    # allocations or make them fail.  Two tests end while threads compute, whose memory nothing frees then.
    "valgrind": Kind(
        ("heap", "uninitialised", "leak"),
        {"KSL_ISA": "x86-64-v3"},
        before=VALGRIND,
        left_out_cases={
            "load": ("hostile: the work is in proportion to the size",),
            "engine_test": ("the calls of C++ that are written by hand allocate nothing", "sine and cosine err by less than one unit*"),
            "faults_allocation_failure_test": (),
            "faults_threads_fault_test": ("exit while new threads make their first batches*", "a thread's first batch after the library has deleted*"),
        },
    ),
    # The same build, of which the programs run above.  With Python's own allocator valgrind would not see the ends of arrays.  Left out: a
    # test that compares bits of instruction sets, since this build has one, and those that need modes and flags of floating-point
    # arithmetic, which valgrind lacks.  A flag is how numpy's linear algebra says that a matrix has no factor.
    "valgrind-python": Kind(
        ("heap",),
        {"KSL_ISA": "x86-64-v3", "PYTHONMALLOC": "malloc"},
        (
            "test/mechanism",
            "test/model",
            "test/robot_files",
            "test/simulation",
            "test/engine",
            "test/base",
            "test/identify",
            "test/arrays",
            "test/load_cases/loads_test.py",
            "test/viewer/notebook_test.py",
            "test/cli/info_test.py",
        ),
        (
            "test/mechanism/batch_test.py::test_every_instruction_set_gives_the_same_bits",
            "test/mechanism/not_finite_calls_test.py::test_a_mode_that_the_caller_sets_stays_and_ordinary_results_are_the_same_bits",
            "test/identify/consistency_test.py::test_log_cholesky_and_back",
            "test/identify/identification_test.py::test_parameters_of_other_shapes_are_refused",
        ),
        before_python=VALGRIND_OF_PYTHON,
        build="valgrind",
    ),
}


def run(command, **more):
    print("+", " ".join(map(str, command)), flush=True)
    return subprocess.run(command, cwd=ROOT, **more)


def said_by(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def build(name):
    """The folder of the build: libraries, tests, and the Python package in site/."""
    folder = ROOT / "build" / name
    options = {
        "nanobind_DIR": said_by(sys.executable, "-m", "nanobind", "--cmake_dir"),
        "Python_EXECUTABLE": sys.executable,
        "Python3_EXECUTABLE": sys.executable,
        "CMAKE_MAKE_PROGRAM": Path(sys.executable).with_name("ninja"),
    }
    run(["cmake", "--preset", name, *(f"-D{key}={value}" for key, value in options.items())], check=True, stdout=subprocess.DEVNULL)
    run(["cmake", "--build", folder, "--", "--quiet"], check=True, env=os.environ | {"ASAN_OPTIONS": "detect_leaks=0"})
    shutil.rmtree(folder / "site", ignore_errors=True)
    shutil.copytree(ROOT / "python/ksl", folder / "site/ksl")
    for module in folder.glob("python/_core*.so"):
        shutil.copy(module, folder / "site/ksl")
    return folder


def library(kind):
    compiler, name = kind.preloaded
    return said_by(compiler, f"-print-file-name={name}")


def environment(kind):
    shared = {"LD_LIBRARY_PATH": str(Path(library(kind)).parent)} if kind.preloaded else {}
    return os.environ | shared | kind.environment


def for_python(kind, folder):
    """The environment of Python with the instrumented library and module.  Reports go to files: pytest keeps what a test writes, and no status
    of a process that pytest starts need reach it.  They have no symbols: the program that looks them up can hang where it gets the
    preloaded library, too."""
    env = environment(kind) | {"PYTHONPATH": str(folder / "site"), "KSL_LIBRARY": str(folder / "libksl.so")}
    if kind.preloaded:
        env["LD_PRELOAD"] = library(kind)
    of_python = f":detect_leaks=0:symbolize=0:log_path={folder / REPORTS}"
    return env | {name: env.get(name, "") + of_python for name in ("ASAN_OPTIONS", "TSAN_OPTIONS", "UBSAN_OPTIONS")}


def pytest_command(kind, folder, written, workers, *arguments):
    """Runs Python tests; reports of an earlier run are removed.  Only what runs tests is run with `before_python`, and not what tests start."""
    for old in folder.glob(f"{REPORTS}.*"):
        old.unlink()
    python = sys.executable
    if kind.before_python:
        python = folder / "python_in_valgrind"
        python.write_text(f'#!/bin/sh\nexec {" ".join(kind.before_python)} --xml-file={folder / REPORTS}.%p.xml {sys.executable} "$@"\n', encoding="utf-8")
        python.chmod(0o755)
    return [sys.executable, "-m", "pytest", "-q", f"--junitxml={written}", "--tx", f"{workers}*popen//python={python}", "--dist", "loadfile", *arguments]


def reports(text):
    return len(REPORT.findall(text))


def in_files(folder):
    """What sanitizers have written while Python tests ran."""
    texts = [file.read_text(encoding="utf-8", errors="replace") for file in sorted(folder.glob(f"{REPORTS}.*"))]
    of_valgrind = [error for text in texts for error in re.findall("<error>.*?</error>", text, re.DOTALL) if OURS.search(error)]
    return "\n".join([*(text for text in texts if not text.startswith("<?xml")), *of_valgrind])


def planted(kind, folder):
    """Each fault of planted.cpp, as a program and, where Python's tests are run, the first one in Python; and whether it was reported."""
    cache = (folder / "CMakeCache.txt").read_text(encoding="utf-8")
    flags = re.search(r"^CMAKE_CXX_FLAGS:\w+=(.*)$", cache, re.MULTILINE)[1].split()
    program = folder / "planted"
    compiler = "clang++" if kind.preloaded else "g++"
    run([compiler, *flags, "-O0", "-std=c++20", HERE / "planted.cpp", "-o", program, "-pthread"], check=True)
    for fault in () if kind.build else (*kind.faults, "none"):
        done = run([*kind.before, program, fault], capture_output=True, text=True, env=environment(kind))
        reported = done.returncode != 0 and bool(kind.before or REPORT.search(done.stderr))
        right = reported == (fault != "none")
        yield fault, ("caught" if reported else "no report") if right else f"wrong: status {done.returncode}\n{done.stderr}"
    if kind.python_tests:
        shared = program.with_suffix(".so")
        run([compiler, *flags, "-O0", "-std=c++20", "-fPIC", "-shared", HERE / "planted.cpp", "-o", shared, "-pthread"], check=True)
        test = folder / "planted_test.py"
        call = f"ctypes.CDLL('{shared}').main(2, (ctypes.c_char_p * 2)(b'', b'{kind.faults[0]}'))"
        test.write_text(f"import ctypes\n\n\ndef test_planted():\n    {call}\n", encoding="utf-8")
        command = pytest_command(kind, folder, folder / "planted.xml", 1, "-p", "no:cacheprovider", test)
        done = run(command, capture_output=True, text=True, env=for_python(kind, folder))
        yield f"{kind.faults[0]}, in a Python test", "caught" if reports(in_files(folder)) else f"wrong: status {done.returncode}\n{done.stdout}{done.stderr}"


def outcome_of(path):
    """(passed, names of failed) of a file that ctest or pytest wrote."""
    found = junit.cases(path)
    return len(junit.named(found, "passed")), [case.get("name") for case in junit.named(found, "failed")]


def programs(kind, folder, log):
    """The tests in C and C++."""
    if not kind.before:
        written = folder / "ctest.xml"
        written.unlink(missing_ok=True)
        ctest = ["ctest", "--test-dir", folder, "--output-on-failure", "--timeout", "3000", "-j2", "--output-junit", written]
        run(ctest, env=environment(kind), stdout=log, stderr=log)
        return outcome_of(written)
    listed = json.loads(said_by("ctest", "--test-dir", str(folder), "--show-only=json-v1"))["tests"]
    tests = [test for test in listed if kind.left_out_cases.get(test["name"]) != ()]

    def outcome(test):
        cases = kind.left_out_cases.get(test["name"])
        without = [f"--test-case-exclude={','.join(cases)}"] if cases else []
        return run([*kind.before, *test["command"], *without], env=environment(kind), text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(outcome, tests))
    log.writelines(done.stdout for done in outcomes)
    bad = [test["name"] for test, done in zip(tests, outcomes) if done.returncode]
    return len(tests) - len(bad), bad


def python(kind, folder, files, log):
    """The tests in Python, against the instrumented library and module."""
    written = folder / "pytest.xml"
    written.unlink(missing_ok=True)
    left_out = [f"--{'deselect' if '::' in path else 'ignore'}={path}" for path in kind.left_out]
    run(pytest_command(kind, folder, written, 2, *left_out, *files), env=for_python(kind, folder), stdout=log, stderr=log)
    log.write(in_files(folder))
    return outcome_of(written)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--without-python", action="store_true", help="programs in C and C++ alone")
    parser.add_argument("--tests", nargs="+", help="Python tests, instead of all that this sanitizer is for")
    given = parser.parse_args()
    kind, whole, name = KINDS[given.kind], not (given.without_python or given.tests), f"sanitizers-{given.kind}"
    if kind.build and given.without_python:
        parser.error(f"{given.kind} runs Python tests alone")
    if whole:
        record.begin(name, f"make sanitize-{given.kind}")
    folder = build(kind.build or given.kind)
    faults = list(planted(kind, folder))
    with (folder / "tests.log").open("w") as log:
        parts = {} if kind.build else {"tests in C and C++": programs(kind, folder, log)}
        if kind.python_tests and not given.without_python:
            parts["tests in Python"] = python(kind, folder, given.tests or kind.python_tests, log)
    found = reports((folder / "tests.log").read_text(encoding="utf-8", errors="replace"))
    kept = not found and all(good and not bad for good, bad in parts.values()) and not any(said.startswith("wrong") for _, said in faults)
    figures = [(part, f"{good} passed" + (f", failed: {', '.join(bad)}" if bad else "")) for part, (good, bad) in parts.items()]
    print(*figures, ("reports", found), *faults, sep="\n")
    if whole:
        record.write(name, f"make sanitize-{given.kind}", kept, [*figures, ("reports", str(found))], faults)
    sys.exit(0 if kept else f"see {folder / 'tests.log'}")


if __name__ == "__main__":
    main()
