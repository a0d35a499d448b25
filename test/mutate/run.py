"""`make mutate`: how many sign, index and operator mutants the tests notice.

    run.py algebra small_motions … [--fraction 0.25 | --each 8] [--only closing] [--seed 11] [--jobs 2] [--cpp] [--list] [--write]

Each scope is compiled once with all its mutants (build.py).  The run begins with its own proof: in the same kind of process, order and
limits, tests pass without a mutant, and mutants that are known to be wrong die.  Then every mutant, or a random part of them, is activated in turn.  Equivalent mutants,
which compute the same, are listed in equivalent.toml with the reason; an entry that fits no mutant, or one that died, is an error.

--list prints the mutants that were not noticed.  --write writes results.md and the record."""

import argparse
import hashlib
import json
import os
import random
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass

import python_mutator
from build import HERE, ROOT, WORK, Build, files

try:
    import tomllib
except ImportError:  # Python 3.10
    import tomli as tomllib

SECONDS = 10  # a run with a mutant may take ten times as long as the tests take without it, and so many seconds more
# Mutants that are wrong beyond doubt, by file, code and change.
KNOWN = {
    "algebra": [("include/ksl/detail/vec3.inc", "a.y * b.z - a.z * b.y", "- → +")],
    "engine": [("include/ksl/engine/model/plane_rotation.hpp", "cs + cs", "+ → -")],
    "load": [("src/load/sdf_values.cpp", "n[3] * unit", "* → /")],
    "batch": [("src/batch/batch.cpp", "row.request != request_kind::reactions", "!= → ==")],
    "sizing": [("python/ksl/sizing/motor.py", "T / ratio * factor", "* → /"), ("python/ksl/sizing/life.py", "0.47", "a tenth more")],
    "load_cases": [("python/ksl/load_cases/case_files/case_values.py", "x * y - z * w", "- → +")],
    "motions": [("python/ksl/motions/signal/rates.py", "cosine * x[:, 0] + sine * x[:, 1]", "+ → -")],
    "sweeps": [("python/ksl/sweeps/variants.py", "y * y + z * z", "+ → -")],
    "checks": [("python/ksl/checks/extent.py", "bounds[1] - bounds[0]", "- → +")],
    "mechanism": [("python/ksl/mechanism/lengths.py", "trace / 2 / mass", "/ → *")],
    "simulation": [("python/ksl/simulation/simulate.py", "energy - energy[..., :1]", "- → +")],
    "model": [("python/ksl/model/section.py", "origin - at", "- → +")],
    "robot_files": [("python/ksl/robot_files/mjcf_loops.py", "y0 + free - multiplier * x0", "- → +")],
    "comparison": [("python/ksl/comparison/bodies.py", "mass * np.outer(centroid, centroid)", "* → /")],
    "generation": [("python/ksl/generation/turning.py", "k - k % (2 * half)", "- → +")],
    "drivetrain": [("python/ksl/drivetrain/equations.py", "len(part.all) - len(self.rows)", "- → +")],
    "small_motions": [("python/ksl/small_motions/modes.py", "R - Z @ np.linalg.solve(kzz, Z.T @ K @ R)", "- → +")],
    "parts": [("python/ksl/parts/bodies.py", "m * acceleration + np.cross(turn, h)", "+ → -")],
}
PROGRAMS = {
    "engine": ("engine_test", "interfaces_test"),
    "load": ("load_test",),
    "batch": ("threads_test", "threads_fault_test", "engine_test", "interfaces_test"),
}
FOLDERS = {"load_test": "test/load", "threads_fault_test": "test/faults"}
IN_PYTHON = {
    "engine": ["test/laws"],
    "batch": ["test/mechanism/threads_test.py", "test/model/processes_test.py", "test/engine/elements/force_elements_test.py"],
    "load": [
        f"test/{name}_test.py"
        for name in (
            "model/model",
            "model/physics",
            "mechanism/joint_kinds",
            "engine/elements/force_elements",
            "robot_files/loops_file",
            "robot_files/assembly",
        )
    ]
    + ["test/reference/readers_test.py"],
}
"""Tests that meet the mutated module, after the first program."""
PYTHON = python_mutator.ROOMS
BESIDE = {
    "simulation": [f"test/{name}_test.py" for name in ("laws/simulation", "laws/limits", "engine/elements/force_elements")],
    "model": ["test/laws/section_test.py", "test/mechanism"],
    "drivetrain": ["test/report/actuation_report_test.py"],
    "generation": ["test/drivetrain/c_maps_test.py", "test/drivetrain/compiled_maps_test.py"],
    "mechanism": [f"test/laws/{name}_test.py" for name in ("closed", "inverse_kinematics")] + ["test/engine/loops"],
}
"""Tests of a room of Python that stand elsewhere."""
NONE = 0  # the number of a run without a mutant
NOTICED = ("failed", "crashed", "timeout")
PROMISED = {"algebra": 0.95, "engine": 0.95}  # of the mutants of each scope; of the others
PROMISED_ELSEWHERE = 0.90


class Results:
    """{number: (how, seconds, test)} in a file.  What an earlier run found with the same program and tests is kept, so that a run
    of hours can be stopped and goes on.  So is the file that says which tests reach which mutants."""

    def __init__(self, path, program, tests, reached):
        self.path, self.more, key = path, path.with_suffix(".more"), path.with_suffix(".key")
        digest = hashlib.sha256()
        for f in [program, *sorted(tests)]:
            digest.update(f.read_bytes())
        if not key.exists() or key.read_text() != digest.hexdigest():
            for old in (path, self.more, reached):
                old.unlink(missing_ok=True)
            key.write_text(digest.hexdigest())

    def read(self):
        """All results, with those of the last run, whether it came to its end or not."""
        lines = self.more.read_text().splitlines(keepends=True) if self.more.exists() else []
        with open(self.path, "a") as out:
            out.writelines(line for line in lines if line.endswith("\n"))
        self.more.unlink(missing_ok=True)
        return read(self.path)


def as_without(results, name):
    """The results, where the run of mutant 0, that is of none, is as it must be.  Otherwise tests fail because of how they are run here, and every
    mutant that they reach would seem noticed."""
    if results[NONE][0] != "survived":
        sys.exit(f"{name}: without a mutant, in a process of their own, tests end so: {results[NONE]}")
    return results


def engine_tests(build, program, numbers, jobs):
    """{number: (how, seconds, test)} by one C++ program, and the numbers that its tests reach."""
    path = build.out / FOLDERS.get(program, "test/engine") / program
    reached, wanted = (build.folder / f"{program}_{name}" for name in ("reached.tsv", "wanted.txt"))
    results = Results(build.folder / f"{program}_results.tsv", path, [], reached)
    if not reached.exists():
        new = reached.with_suffix(".new")
        if subprocess.run([path, new], stdout=subprocess.DEVNULL).returncode:
            bad = [row.split("\t")[2] for row in new.read_text().splitlines() if row.split("\t")[1] == "1"]
            sys.exit(f"C++ tests fail without a mutant: {bad}")
        new.rename(reached)
    done = results.read()
    wanted.write_text("\n".join(str(n) for n in [NONE, *numbers] if n not in done))
    subprocess.run([path, reached, wanted, results.more, str(jobs), str(SECONDS)], check=True, stdout=subprocess.DEVNULL)
    return as_without(results.read(), program), {int(n) for row in reached.read_text().splitlines() for n in row.split("\t")[3].split()}


def python_tests(build, library, folders, numbers, jobs, packages=()):
    """The same by Python tests; library: the mutated one, or none where Python itself is mutated."""
    reached = build.folder / "reached.json"
    sources = [f for folder in (*folders, "python/ksl") for f in ([ROOT / folder] if folder.endswith(".py") else (ROOT / folder).rglob("*.py"))]
    own = [HERE / name for name in ("python_tests.py", "python_mutator.py", "mutants.py")]
    results = Results(build.folder / "python_results.tsv", library or own[1], [*own, *sources], reached)
    done = results.read()
    settings = {
        **({"library": str(library)} if library else {"scope": build.scope, "root": str(ROOT)}),
        "mutants": [n for n in [NONE, *numbers] if n not in done],
        "results": str(results.more),
        "reached": str(reached),
        "jobs": jobs,
        "seconds": SECONDS,
        "reuse": reached.exists(),
    }
    path = [str(HERE), *map(str, packages), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"KSL_MUTATE": json.dumps(settings), "PYTHONPATH": os.pathsep.join(path)}
    environment |= {"KSL_LIBRARY": str(library)} if library else {}
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "python_tests", "-p", "no:cacheprovider", *folders],
        cwd=ROOT,
        env=environment,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    found, rows = as_without(results.read(), " ".join(folders)), json.loads(reached.read_text())
    met, joined = ({n for row in rows for n in row[how]} for how in ("reached", "joined"))
    return found | {n: ("no mutant", 0, "") for n in joined - met if n in found}, met


def all_tests(build, numbers, jobs, laws):
    """Of the engine, first the C++ tests, which are fast; then Python's laws, and those of all interfaces, for what is left."""
    if build.scope in PYTHON:
        return python_tests(build, None, [f"test/{build.scope}", *BESIDE.get(build.scope, [])], numbers, jobs)
    if build.scope == "algebra":
        return python_tests(build, build.folder / "libksl_algebra.so", ["test/algebra"], numbers, jobs)
    results, reached = dict.fromkeys(numbers, ("unreached", 0, "")), set()
    stages = [lambda left, p=p: engine_tests(build, p, left, jobs) for p in PROGRAMS[build.scope]]
    if laws and build.scope in IN_PYTHON:
        packages = [build.folder / "package"]
        stages.insert(1, lambda left: python_tests(build, build.module(), IN_PYTHON[build.scope], left, jobs, packages))
    for stage in stages:
        left = [n for n in numbers if results[n][0] not in NOTICED]
        more, also = stage(left)
        results |= {n: more[n] for n in left if n in more and more[n][0] != "unreached"}
        reached |= also
    return results, reached


class PythonBuild:
    """What Build is for mutants of Python, which need no compiler."""

    def __init__(self, scope):
        self.scope, self.folder, self.mutants = scope, WORK / scope, []
        self.dropped_file = self.folder / "dropped.json"

    def write_tree(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self.mutants = python_mutator.mutated(ROOT, self.scope)[1]


def read(path):
    rows = (line.split("\t") for line in path.read_text().splitlines())
    return {int(r[0]): (r[1], float(r[2]), r[3]) for r in rows}


def equivalent_mutants(scope, mutants):
    """{number: reason}, and the entries of equivalent.toml that fit no mutant of the scope, nor belong to another."""
    sources, found, stale = {}, {}, []
    others = {str(f.relative_to(ROOT)) for other in KNOWN if other != scope for f in (python_mutator.files(ROOT, other) if other in PYTHON else files(other))}
    listed = tomllib.loads((HERE / "equivalent.toml").read_text())
    for entry in [{"file": file, **entry} for file, entries in listed.items() if file not in others for entry in entries]:
        lines = sources.setdefault(entry["file"], (ROOT / entry["file"]).read_text().splitlines())
        one_of = lambda value: value if isinstance(value, list) else [value]
        fits = [
            m
            for m in mutants
            if m.file == entry["file"]
            and m.change in one_of(entry.get("change", m.change))
            and m.code in one_of(entry.get("code", m.code))
            and entry["line"] in lines[m.line - 1]
        ]
        if not fits:
            stale.append(entry)
        found |= {m.number: entry["reason"] for m in fits}
    return found, stale


@dataclass
class Result:
    """What became of the mutants of one scope."""

    scope: str
    mutants: dict  # number → mutant, of the whole scope
    chosen: list  # numbers of those that were run
    results: dict  # number → (how, seconds, test)
    equivalent: dict  # number → reason
    known: list  # the mutants that had to be noticed
    dropped: int  # that did not compile
    faults: int  # entries of equivalent.toml that are wrong
    fraction: float
    compiled: float  # seconds
    seconds: float

    def counts(self, numbers):
        """How often each outcome came, how many mutants were noticed, and of how many: all but equivalent ones."""
        outcomes = Counter("equivalent" if n in self.equivalent else self.results[n][0] for n in numbers)
        return outcomes, sum(outcomes[how] for how in NOTICED), len(numbers) - outcomes["equivalent"]

    def not_noticed(self):
        return [n for n in self.chosen if self.results[n][0] not in NOTICED and n not in self.equivalent]


def compile_all(build, laws):
    if build.scope == "algebra":
        build.compile_algebra()
    elif build.scope not in PYTHON:
        build.configure()
        build.compile(*PROGRAMS[build.scope], *(["_core"] if laws and build.scope in IN_PYTHON else []))


def is_no_mutant(n, mutants, results, reached):
    """The boundary of a comparison is moved between integers alone.  So a moved boundary that no test reaches, beside a comparison that tests
    do reach, is one of real numbers."""
    if results[n][0] == "no mutant":  # of what joins lists or texts, there is no other operation
        return True
    m, before = mutants[n], mutants.get(n - 1)
    same_place = before is not None and n - 1 in reached and (before.code, before.line) == (m.code, m.line)
    return results[n][0] == "unreached" and same_place and m.change[0] in "<>"


def sample(chosen, mutants, fraction, each, seed):
    """A random part of the numbers, or so many of each file."""
    if each:
        files = {}
        for n in chosen:
            files.setdefault(mutants[n].file, []).append(n)
        return sorted(n for file, numbers in files.items() for n in random.Random(f"{seed} {file}").sample(numbers, min(each, len(numbers))))
    return sorted(random.Random(seed).sample(chosen, round(fraction * len(chosen)))) if fraction < 1 else chosen


def run(scope, fraction, seed, jobs, laws=True, only="", each=0):
    """The Result of one scope.  Ends the program if a mutant that is known to be wrong is not noticed."""
    start = time.time()
    build = PythonBuild(scope) if scope in PYTHON else Build(scope)
    build.write_tree()
    compile_all(build, laws)
    compiled = time.time() - start
    mutants = {m.number: m for m in build.mutants}
    known = [next(m.number for m in build.mutants if (m.file, m.code, m.change) == k) for k in KNOWN[scope]]
    chosen = sorted(n for n, m in mutants.items() if only in m.file)
    chosen = sample(chosen, mutants, fraction, each, seed)
    results, reached = all_tests(build, [*known, *(n for n in chosen if n not in known)], jobs, laws)
    for n in known:
        if results[n][0] not in NOTICED:
            sys.exit(f"{scope}: a mutant that is known to be wrong was not noticed: {mutants[n].text()}")
    chosen = [n for n in chosen if not is_no_mutant(n, mutants, results, reached)]
    equal, stale = equivalent_mutants(scope, build.mutants)
    for entry in stale:
        print(f"equivalent.toml: fits no mutant: {entry}")
    wrong = [mutants[n] for n in chosen if n in equal and results[n][0] in NOTICED]
    for m in wrong:
        print(f"equivalent.toml: is noticed, so not equivalent: {m.text()}")
    dropped = len(json.loads(build.dropped_file.read_text())) if build.dropped_file.exists() else 0
    faults = len(stale) + len(wrong)
    return Result(scope, mutants, chosen, results, equal, [mutants[n] for n in known], dropped, faults, fraction, compiled, time.time() - start)


def table(result):
    c, noticed, counted = result.counts(result.chosen)
    part = "all" if result.fraction == 1 else f"a random {result.fraction:.0%} of all"
    lines = [
        f"## {result.scope.capitalize()}: {noticed / counted:.1%} noticed",
        "",
        f"{counted} mutants, {part} {len(result.mutants)}: {noticed} noticed ({c['failed']} by a failed test, {c['crashed']} by a "
        f"crash, {c['timeout']} by a time-out), {c['survived']} not, {c['unreached']} not reached by any of these tests.  "
        f"Besides: {c['equivalent']} equivalent ones; {result.dropped} did not compile and were left out.",
        "",
        "| kind | mutants | noticed |",
        "|---|---|---|",
    ]
    for kind in ("sign", "index", "operator", "number"):
        _, k, n = result.counts([m for m in result.chosen if result.mutants[m].kind == kind])
        if not n:
            continue
        lines.append(f"| {kind} | {n} | {f'{k / n:.1%}' if n else ''} |")
    lines += ["", "| file | mutants | noticed | not | not reached |", "|---|---|---|---|---|"]
    whole = []
    for file in sorted({m.file for m in result.mutants.values()}):
        fc, k, n = result.counts([m for m in result.chosen if result.mutants[m].file == file])
        if n and k == n:
            whole.append(n)
        elif n:
            lines.append(f"| `{file}` | {n} | {k / n:.0%} | {fc['survived'] or ''} | {fc['unreached'] or ''} |")
    return [*lines, f"| {len(whole)} other files | {sum(whole)} | 100% |  |  |"]


def write(results, figures, kept):
    """results.md, and the record of the promise."""
    head = [
        "# Mutants: faults planted in the code, and how many the tests notice",
        "",
        "Written by `make mutate`.  [README.md](README.md) says what a mutant is and how they are run.",
        "",
    ]
    pages = [line for result in results for line in [*table(result), ""]]
    (HERE / "results.md").write_text("\n".join(head + pages).rstrip() + "\n")
    planted = [f"{m.text()}=caught" for result in results for m in result.known]
    arguments = [a for f in figures for a in ("--figure", f)] + [a for p in planted for a in ("--planted", p)]
    to_record("--kept" if kept else "--broken", *arguments)


def to_record(*arguments):
    subprocess.run([sys.executable, ROOT / "scripts/trust/record.py", "mutation", "--command", "make mutate", *arguments], check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scopes", nargs="+", choices=list(KNOWN))
    parser.add_argument("--fraction", type=float, default=1.0, help="of the mutants, chosen at random")
    parser.add_argument("--each", type=int, default=0, help="so many mutants of each file, chosen at random")
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default="", help="mutants of files with this in their names")
    parser.add_argument("--cpp", action="store_true", help="of the engine, the C++ tests alone")
    parser.add_argument("--list", action="store_true", help="print the mutants that were not noticed")
    parser.add_argument("--write", action="store_true", help="write results.md and the record")
    options = parser.parse_args()
    if options.write and (set(options.scopes) != set(KNOWN) or options.fraction != 1 or options.each or options.cpp or options.only):
        parser.error("a part of the mutants or of the tests is not recorded: leave out --write")
    if options.write:
        to_record("--begun")
    results = [run(scope, options.fraction, options.seed, options.jobs, not options.cpp, options.only, options.each) for scope in options.scopes]
    figures, kept = [], True
    for result in results:
        outcomes, noticed, counted = result.counts(result.chosen)
        kept &= noticed >= PROMISED.get(result.scope, PROMISED_ELSEWHERE) * counted and not result.faults
        of = "" if result.fraction == 1 else f", a random {result.fraction:.0%} of all"
        figures.append(f"noticed, {result.scope}={noticed / counted:.1%} of {counted} mutants{of}")
        print(f"{figures[-1]}; {dict(outcomes)}; compiled in {result.compiled:.0f} s, {result.seconds:.0f} s in all")
        for n in result.not_noticed() if options.list else ():
            print(f"{result.results[n][0]:9} {result.mutants[n].text()}")
    if options.write:
        write(results, figures, kept)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
