"""Runs all benchmarks and prints their tables: `make bench`, or run.py BUILD_DIR [--only STEP,...] [--isa SET,...] [--docs].

Steps: robots, kinds, threads, sizes, scaling, python, for each instruction set that this processor runs; flops, loads, algebra once.  Each
leaves its figures in BUILD_DIR/parts, in a folder for each set (the last only prints them); all together go to BUILD_DIR/results.json.
--docs also draws the plots and puts the tables into docs/performance.md.  Sections of sets that were not measured stay there as they are.
"""

import argparse
import datetime
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import tables

ROOT = Path(__file__).resolve().parent.parent
ROBOTS = ["ur5", "panda", "solo12", "talos"]
BODIES = [4, 8, 16, 32, 64, 128]
LONG = ["chain250", "chain500", "chain1000"]
BATCHES = [1, 4, 16, 64, 256, 1024, 4096, 16384, 65536]
SETS = ["x86-64-v4", "x86-64-v3"]  # the baseline beside them is compiled to be small
ONCE = ["flops", "loads", "algebra"]  # not for each set


class Bench:
    """The programs in a build folder, an instruction set, and the files for its figures."""

    def __init__(self, build: Path, isa: str) -> None:
        self.build, self.isa, self.parts = build.resolve(), isa, build.resolve() / "parts" / isa
        self.parts.mkdir(parents=True, exist_ok=True)

    def compare(self, part: str, robots: list[str], *options: str, quiet: bool = False) -> dict[str, Any]:
        path = self.parts / f"{part}.json"
        output = subprocess.DEVNULL if quiet else None
        subprocess.run([self.build / "compare", *robots, *options, "--isa", self.isa, "--json", path], check=True, stdout=output)
        return json.loads(path.read_text())

    def robots(self) -> None:
        self.compare("robots", ROBOTS)

    def kinds(self) -> None:
        """Joints of several axes beside chains of one-axis joints.  Times of two robots are not taken in turns: the least of three runs."""
        runs = [self.compare("kinds", ["kinds", "kinds_by_axes"], "--libraries", "KSL", "--seconds", "0.5", quiet=True) for _ in range(3)]
        for name, robot in runs[0]["robots"].items():
            for i, time in enumerate(robot["times"]):
                time["minimum_ns"] = min(run["robots"][name]["times"][i]["minimum_ns"] for run in runs)
        (self.parts / "kinds.json").write_text(json.dumps(runs[0]))

    def threads(self) -> None:
        self.compare("threads", ["ur5", "talos"], "--ops", "rnea,aba", "--libraries", "KSL", "--many", "20000", quiet=True)

    def sizes(self) -> None:
        options = ["--ops", "rnea", "--libraries", "KSL", "--seconds", "0.5"]
        runs = {n: self.compare("sizes", ["ur5", "talos"], *options, "--many", str(n), quiet=True) for n in BATCHES}
        (self.parts / "sizes.json").write_text(json.dumps({n: run["robots"] for n, run in runs.items()}))

    def scaling(self) -> None:
        """Chains and trees; the longest without Pinocchio, whose workspace grows with the third power of the joints."""
        few = ["--few", "32", "--many", "256", "--seconds", "0.5"]
        names = [f"{shape}{n}" for shape in ("chain", "tree") for n in BODIES]
        run = self.compare("scaling", names, "--ops", "rnea,aba,crba,crba_upper,crba_tree,fk", "--libraries", "KSL,Pinocchio", *few, quiet=True)
        run["robots"] |= self.compare("scaling", LONG, "--ops", "rnea,fk", "--libraries", "KSL,KDL", *few, quiet=True)["robots"]
        for name, robot in self.compare("scaling", LONG, "--ops", "aba", "--libraries", "KSL", *few, quiet=True)["robots"].items():
            run["robots"][name]["times"] += robot["times"]
        (self.parts / "scaling.json").write_text(json.dumps(run))

    def flops(self) -> None:
        rows = [line.split(maxsplit=2) for line in (self.build / "robots.txt").read_text().splitlines()]
        names = [f"{name}={path}{':floating' if base == 'floating' else ''}" for name, base, path in rows]
        counts = subprocess.run([self.build / "flops", *names], check=True, capture_output=True, text=True).stdout
        (self.parts.parent / "flops.json").write_text(counts)

    def python(self) -> None:
        """KSL as it is installed, which need not have every set."""
        environment = os.environ | {"KSL_ISA": self.isa}
        if subprocess.run([sys.executable, "-c", "from ksl._core import instruction_set as name; name()"], env=environment, capture_output=True).returncode:
            print(f"not measured: the installed KSL has no kernels for {self.isa}")
            return
        subprocess.run([sys.executable, ROOT / "bench/python_level.py", self.build, self.parts / "python.json"], check=True, env=environment)

    def loads(self) -> None:
        subprocess.run([sys.executable, ROOT / "bench/loads.py", self.parts / "loads.json"], check=True)

    def algebra(self) -> None:
        subprocess.run([self.build / "gcc/bench/algebra_bench"], check=True)


def sets(build: Path, wanted: str) -> list[str]:
    """The sets to measure, best first: those wanted, or those of SETS that are built and run here, or the one that runs here."""
    if wanted:
        return wanted.split(",")
    show = [build / "compare", "--show-isa"]
    found = [isa for isa in SETS if not subprocess.run([*show, "--isa", isa], capture_output=True).returncode]
    return found or [subprocess.run(show, check=True, capture_output=True, text=True).stdout.strip()]


def collect(build: Path, names: list[str]) -> dict[str, Any]:
    """All figures of the sets of these names, from the files of the parts: results.json."""

    def read(folder: Path) -> dict[str, Any]:
        return {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))}

    common = read(build / "parts")
    results = {isa: common | read(build / "parts" / isa) for isa in names}
    (build / "results.json").write_text(json.dumps(results, indent=1))
    return results


def machine() -> dict[str, str]:
    info = Path("/proc/cpuinfo")
    models = [line.split(":")[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")] if info.exists() else []
    first = {name: subprocess.run([name, "--version"], capture_output=True, text=True).stdout.split("\n")[0] for name in ("g++", "clang++")}
    return {
        "processor": models[0] if models else platform.processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "gcc": first["g++"],
        "clang": first["clang++"],
        "python": platform.python_version(),
        "date": f"{datetime.date.today():%d %B %Y}".lstrip("0"),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=Path)
    parser.add_argument("--only", default="algebra,robots,kinds,threads,sizes,scaling,flops,python,loads", help="steps to run; may be empty")
    parser.add_argument("--isa", default="", help="instruction sets, instead of all that run here")
    parser.add_argument("--docs", action="store_true", help="draw the plots and renew the tables of docs/performance.md")
    arguments = parser.parse_args()
    build, steps = arguments.build.resolve(), [step for step in arguments.only.split(",") if step]
    names = sets(build, arguments.isa)
    for isa in names:
        bench = Bench(build, isa)
        for step in steps:
            if isa == names[0] or step not in ONCE:
                print(f"-- {step}, {isa}", flush=True)
                work: Callable[[], None] = getattr(bench, step)
                work()
        if steps:
            (bench.parts / "machine.json").write_text(json.dumps(machine()))
    results = collect(build, names)
    for isa in names:
        print(f"\n{tables.everything(results[isa])}")
    if arguments.docs:
        for isa in names:
            if "robots" not in results[isa]:
                raise SystemExit(f"docs/performance.md stays as it is: the step robots has not been measured for {isa}")
            plots = [build / "venv/bin/python", ROOT / "bench/plots.py", build / "results.json", isa, ROOT / "docs/images"]
            subprocess.run(plots, check=True)
            tables.renew(ROOT / "docs/performance.md", isa, tables.everything(results[isa]) + tables.images(isa, ROOT / "docs"))


if __name__ == "__main__":
    main()
