"""Runs all benchmarks and prints their tables: `make bench`, or run.py BUILD_DIR [--only STEP,...] [--docs].

Steps: robots, kinds, threads, sizes, scaling, flops, python, loads, algebra.  Each leaves its figures in BUILD_DIR/parts (the last
only prints them); all together go to BUILD_DIR/results.json.  --docs also draws the plots and puts the tables into docs/performance.md.
"""

import argparse
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
ROBOTS = ["ur5", "panda", "solo12", "anymal", "talos"]
BODIES = [4, 8, 16, 32, 64, 128]
LONG = ["chain250", "chain500", "chain1000"]
BATCHES = [1, 4, 16, 64, 256, 1024, 4096, 16384, 65536]


class Bench:
    """The programs in a build folder, and the files for their figures."""

    def __init__(self, build: Path) -> None:
        self.build, self.parts = build.resolve(), build.resolve() / "parts"
        self.parts.mkdir(parents=True, exist_ok=True)

    def compare(self, part: str, robots: list[str], *options: str, quiet: bool = False) -> dict[str, Any]:
        path = self.parts / f"{part}.json"
        output = subprocess.DEVNULL if quiet else None
        subprocess.run([self.build / "compare", *robots, *options, "--json", path], check=True, stdout=output)
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
        (self.parts / "flops.json").write_text(counts)

    def python(self) -> None:
        subprocess.run([sys.executable, ROOT / "bench/python_level.py", self.build, self.parts / "python.json"], check=True)

    def loads(self) -> None:
        subprocess.run([sys.executable, ROOT / "bench/loads.py", self.parts / "loads.json"], check=True)

    def algebra(self) -> None:
        subprocess.run([self.build / "gcc/bench/algebra_bench"], check=True)

    def results(self) -> dict[str, Any]:
        results = {path.stem: json.loads(path.read_text()) for path in sorted(self.parts.glob("*.json"))}
        results["machine"] = machine()
        (self.build / "results.json").write_text(json.dumps(results, indent=1))
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
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=Path)
    parser.add_argument("--only", default="algebra,robots,kinds,threads,sizes,scaling,flops,python,loads", help="steps to run; may be empty")
    parser.add_argument("--docs", action="store_true", help="draw the plots and renew the tables of docs/performance.md")
    arguments = parser.parse_args()
    bench = Bench(arguments.build)
    for step in filter(None, arguments.only.split(",")):
        print(f"-- {step}", flush=True)
        work: Callable[[], None] = getattr(bench, step)
        work()
    results = bench.results()
    print(tables.everything(results))
    if arguments.docs:
        tables.renew(ROOT / "docs/performance.md", results)
        plots = [bench.build / "venv/bin/python", ROOT / "bench/plots.py", bench.build / "results.json", ROOT / "docs/images"]
        subprocess.run(plots, check=True)


if __name__ == "__main__":
    main()
