"""A plugin of pytest: Python tests in a mutated build.  It finds which tests reach which mutants, and then activates one
mutant after the other, each in a fork of this process, and runs the tests that reach it until one fails or MOST seconds are spent.
Short tests that reach few mutants come first: they notice most.

    KSL_MUTATE='{"library": "libksl_algebra.so", "mutants": [17, 18], "results": "results.tsv", "reached": "reached.json",
                 "jobs": 2, "seconds": 10}' python -m pytest -p python_tests test/algebra"""

import ctypes
import importlib
import json
import mmap
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SETTINGS = json.loads(os.environ["KSL_MUTATE"])
ROOM = 20002  # numbers of mutants, as in numbers.cpp
MOST = 10  # seconds of tests with one mutant, by the time that they take without one
BROKEN = 3  # status of a child in which not a test failed, but what runs tests
FEW = 20  # random cases of a test, where it takes thousands elsewhere
# Tests that compile programs from the sources, which are not mutated, that compare declarations, or whose work is done by a cluster of other processes.
LEFT_OUT = ("exports_test", "headers_test", "print_test", "array_functions_test", "nan_test", "test_on_ray")

IMPORTER = None
if "scope" in SETTINGS:  # mutants of Python, in place before a test imports what they are in
    import mutants

    IMPORTER = mutants.install(Path(SETTINGS["root"]), SETTINGS["scope"])

failed = False


def pytest_runtest_logreport(report):
    global failed
    failed |= report.failed


def without_programs(*_, **__):
    pytest.skip("compiles or starts another program, in which no mutant would be active")


def pytest_collection_modifyitems(config, items):
    """Tests take FEW random cases: most mutants show in any of them."""
    for module in {i.module for i in items} | {m for n, m in sys.modules.items() if n in ("cases", "random_cases")}:
        for name in ("CASES", "MANY", "WITNESSED", "FEW", "N"):
            if isinstance(getattr(module, name, None), int) and getattr(module, name) > (FEW if name != "N" else 1000):
                setattr(module, name, FEW)
    if SETTINGS.get("scope") not in ("generation", "drivetrain"):  # there the compiler meets the code that mutants wrote
        subprocess.run = without_programs
    items[:] = [i for i in items if not any(f"/{name}" in str(i.path) or i.name.startswith(name) for name in LEFT_OUT)]


class Mutated:
    def __init__(self):
        self.dll = ctypes.CDLL(SETTINGS["library"])
        self.number = ctypes.c_int.in_dll(self.dll, "ksl_mutant")
        self.reached = (ctypes.c_ubyte * ROOM).in_dll(self.dll, "ksl_mutant_reached")

    def clear(self):
        ctypes.memset(self.reached, 0, ROOM)

    def tests_of(self, number, order):
        return within(MOST, order)

    def activate(self, number):
        self.number.value = number


class MutatedPython:
    """The same of Python.  What modules computed when they were imported is reached by all tests: all are imported before the first one,
    but those that need packages which aren't there, as their tests do."""

    def __init__(self):
        for module in IMPORTER.trees:
            try:
                importlib.import_module(module)
            except ModuleNotFoundError as missing:
                if missing.name.partition(".")[0] == "ksl":
                    raise
        self.reached = mutants.reached
        self.imported = {m.number for m in IMPORTER.mutants if m.statement is not None and self.reached[m.number] == mutants.RUN}

    def clear(self):
        self.forget()
        self.reached[:] = bytes(len(self.reached))
        for number in self.imported:
            self.reached[number] = 1

    def forget(self):
        """What functions have computed and kept: each test reaches it anew, and with the mutant."""
        for module in IMPORTER.trees.keys() & sys.modules.keys():
            for kept in [x.cache_clear for x in vars(sys.modules[module]).values() if hasattr(x, "cache_clear")]:
                kept()

    def tests_of(self, number, order):
        """All tests reach what was computed by imports: those that run code of the same file come first, and then, for as long, those that may only look into a table of it."""
        if number not in self.imported:
            return within(MOST, order)
        own = {m.number for m in IMPORTER.mutants if m.file == IMPORTER.by_number[number].file} - self.imported
        return [pair for others in (False, True) for pair in within(MOST, [pair for pair in order if own.isdisjoint(pair[0]["reached"]) == others])]

    def activate(self, number):
        self.forget()
        mutants.active = number
        if number in self.imported:
            IMPORTER.recompute(number)


def in_child(function, *arguments):
    """The process that runs function(*arguments), and ends."""
    process = os.fork()
    if process:
        return process
    try:
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, 1), os.dup2(nothing, 2)
        os._exit(function(*arguments))
    finally:
        os._exit(BROKEN)


def run(items):
    """For each test in turn: did it fail?"""
    global failed
    for item, following in zip(items, [*items[1:], None]):
        failed = False
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        yield failed


def seconds_used():
    """By this process and those that it has waited for, as commands have one of their own."""
    return sum(os.times()[:4])


class Fixtures:
    """What fixtures reach that several tests share: each of these reaches it, though only the first one makes the fixture."""

    def __init__(self, mutated):
        self.mutated, self.made = mutated, {}  # made: name → seconds, and what was reached

    @pytest.hookimpl(hookwrapper=True)
    def pytest_fixture_setup(self, fixturedef):
        if fixturedef.scope == "function":
            yield
            return
        before, start = bytes(self.mutated.reached), seconds_used()
        self.mutated.clear()
        yield
        during, name = bytes(self.mutated.reached), f"{fixturedef.baseid} {fixturedef.argname}"
        seconds, reached = self.made.get(name, (float("inf"), bytes(len(during))))
        self.made[name] = min(seconds, seconds_used() - start), merged(reached, during)  # the first of several may import modules
        self.mutated.reached[:] = before

    def of(self, item):
        """{name: seconds}, and all that they reach."""
        used = [f"{of[-1].baseid} {of[-1].argname}" for of in item._fixtureinfo.name2fixturedefs.values()]
        found = {name: self.made[name] for name in used if name in self.made}
        whole = bytes(len(self.mutated.reached))
        for _, reached in found.values():
            whole = merged(whole, reached)
        return {name: seconds for name, (seconds, _) in found.items()}, whole


def merged(a, b):
    """Of two records, what either reached: 1; or else what was joined in either: 2."""
    return bytes(1 if 1 in pair else max(pair) for pair in zip(a, b)) if any(a) and any(b) else b if any(b) else a


def record(session, mutated, path):
    """Runs all tests without a mutant."""
    rows, fixtures = [], Fixtures(mutated)
    session.config.pluginmanager.register(fixtures)
    mutated.clear()
    start = seconds_used()
    for item, bad in zip(session.items, run(session.items)):
        of_fixtures, reached = fixtures.of(item)
        reached = merged(bytes(mutated.reached), reached)
        rows.append(
            {
                "test": item.nodeid,
                "seconds": seconds_used() - start,
                "fixtures": of_fixtures,
                "failed": bad,
                "reached": [i for i, x in enumerate(reached) if x == 1],
                "joined": [i for i, x in enumerate(reached) if x == 2],
            }
        )
        mutated.clear()
        start = seconds_used()
    Path(path).write_text(json.dumps(rows))
    return 0


def kill(session, mutated, number, order, seconds, killer):
    """1 if a test fails that mutant `number` reaches, 0 if all pass."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
    limit = int(seconds + 10 * sum(alone(r) for r, _ in order)) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1))
    signal.alarm(8 * limit)
    try:
        mutated.activate(number)
    except Exception:  # a module that can't be imported fails its tests
        return 1
    outcomes = run([item for _, item in order])
    for place in range(len(order)):
        killer[4 * number : 4 * number + 4] = place.to_bytes(4, "little")
        if next(outcomes):
            return 1
    return 0


def tests_in_order(session, mutated):
    """(row of the record, test) of all tests that pass without a mutant, the short and special ones first."""
    if not SETTINGS.get("reuse"):
        os.waitpid(in_child(record, session, mutated, SETTINGS["reached"]), 0)
    rows = json.loads(Path(SETTINGS["reached"]).read_text())
    bad = [r["test"] for r in rows if r["failed"]]  # some tests need the number of cases that they were written for
    if len(bad) > 0.01 * len(rows):
        raise SystemExit(f"tests fail without a mutant: {bad}")
    print(f"{len(bad)} of {len(rows)} tests fail with {FEW} cases, and are left out: {bad}", file=sys.stderr)
    return sorted(((r, i) for r, i in zip(rows, session.items) if not r["failed"]), key=lambda pair: alone(pair[0]) * len(pair[0]["reached"]))


def alone(row):
    """Seconds that a test takes with its fixtures, which the record may have counted for it already."""
    return max(row["seconds"], sum(row["fixtures"].values()))


def within(seconds, order):
    """The tests from the beginning of the order that take so long, one at least; fixtures are made once."""
    kept, made, spent = [], set(), 0.0
    for row, item in order:
        spent += max(row["seconds"], sum(x for name, x in row["fixtures"].items() if name not in made))
        made |= row["fixtures"].keys()
        if spent <= seconds:
            kept.append((row, item))
    return kept or order[:1]


class Children:
    """Processes that run tests with a mutant each, some at a time."""

    def __init__(self, out):
        self.out = out  # gets a line for each mutant: number, what became of it, seconds, the test that noticed it
        self.running = {}  # process → number, start, order of its tests
        self.killer = mmap.mmap(-1, 4 * ROOM)  # shared: of each mutant, the place of the test that is running

    def start(self, session, mutated, number, order):
        while len(self.running) >= SETTINGS["jobs"]:
            self.wait()
        process = in_child(kill, session, mutated, number, order, SETTINGS["seconds"], self.killer)
        self.running[process] = number, time.perf_counter(), order

    def wait(self):
        process, status = os.wait()
        number, start, order = self.running.pop(process)
        place = int.from_bytes(self.killer[4 * number : 4 * number + 4], "little")
        code = os.waitstatus_to_exitcode(status)
        timed_out = -code in (signal.SIGXCPU, signal.SIGALRM, signal.SIGKILL)
        how = {0: "survived", 1: "failed", BROKEN: "error"}.get(code) or ("timeout" if timed_out else "crashed")
        name = "" if code == 0 else order[place][0]["test"]
        self.out.write(f"{number}\t{how}\t{time.perf_counter() - start:.3f}\t{name}\n")
        self.out.flush()


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session):
    mutated = Mutated() if IMPORTER is None else MutatedPython()
    if "library" in sys.modules:  # the algebra's: helpers are symbols of the mutated library
        sys.modules["library"].Library.helpers = property(lambda self: mutated.dll)
    ordered = tests_in_order(session, mutated)
    reaching = {}
    for row, item in ordered:
        for number in row["reached"]:
            reaching.setdefault(number, []).append((row, item))
    with open(SETTINGS["results"], "w") as out:
        children = Children(out)
        for number in SETTINGS["mutants"]:
            order = ordered if number == 0 else mutated.tests_of(number, reaching.get(number, []))  # 0: no mutant, all tests
            if order:
                children.start(session, mutated, number, order)
            else:
                out.write(f"{number}\tunreached\t0\t\n")
        while children.running:
            children.wait()
    return True
