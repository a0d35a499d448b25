"""Counts instructions on an emulated Arm processor: `make bench-arm`, or count.py BUILD_DIR.

Figures go to BUILD_DIR/arm/counts.json and, as a table, into docs/performance.md.  They are those of compilers and sources: of no machine.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "bench"))

import tables  # noqa: E402

OPERATIONS = {
    "rnea": "RNEA",
    "aba": "ABA",
    "crba": "CRBA",
    "crba_upper": "CRBA, upper triangle",
    "inverse_dynamics_derivatives": "derivatives of inverse dynamics",
}


def count(folder: Path) -> dict[str, Any]:
    """Runs the program for Arm; the plug-in writes a count for each line that it prints."""
    counts, peers = folder / "counts.txt", folder / "peers"
    describing = sorted(peers.glob("ksl_*.so"))[0].name
    emulator = ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu", "-plugin", f"{folder}/count_instructions.so,counts={counts}"]
    program = [folder / "count", peers, describing, *(folder / "robots.txt").read_text().split()]
    printed = subprocess.run([*map(str, emulator), *map(str, program)], check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    robots: dict[str, Any] = {}
    for line, instructions in zip(printed, counts.read_text().split(), strict=True):
        row = json.loads(line)
        row["instructions"] = row["median_ns"] = int(instructions) / row["states"]  # so that tables.best finds the least
        robots.setdefault(row["robot"], {"times": []})["times"].append(row)
    (folder / "counts.json").write_text(json.dumps(robots, indent=1))
    return robots


def rows(robots: dict[str, Any], compiler: str) -> list[list[str]]:
    """KSL and Pinocchio by one compiler; of Pinocchio the way with the fewest instructions."""
    written = []
    for operation, label in OPERATIONS.items():
        for name, robot in robots.items():
            theirs = {"times": [t for t in robot["times"] if t["peer"].startswith(f"Pinocchio, {compiler}")]}
            rival = tables.best(theirs, "Pinocchio", tables.BESIDE.get(operation, operation))
            one, batch, single = (tables.ns(robot, f"KSL, {compiler}", operation, *kind) for kind in ((), (1,), (1, 1)))
            if not rival or not one or not batch:
                continue
            least = rival["median_ns"]
            ratios = [tables.cell(one, 0), tables.cell(one / least), tables.cell(batch, 0), tables.cell(batch / least), tables.cell(single, 0)]
            written.append([f"{label}, {name}", tables.cell(least, 0), *ratios, tables.way(rival)])
    return written


def version(*command: str) -> str:
    return subprocess.run([*command, "--version"], check=True, capture_output=True, text=True).stdout.splitlines()[0]


def text(robots: dict[str, Any]) -> str:
    compilers = {"clang": version("clang++"), "gcc": version("aarch64-linux-gnu-g++")}
    head = ["Pinocchio, instructions", "KSL, one state", ": Pinocchio", "KSL, batch", ": Pinocchio", "batch, float", "fewest of Pinocchio"]
    parts = [
        f"*aarch64, both compiled by {named}, counted under {version('qemu-aarch64')}:*\n\n" + tables.table(["instructions a state", *head], found)
        for compiler, named in compilers.items()
        if (found := rows(robots, compiler))
    ]
    return "\n\n".join(parts)


def main(build: str) -> None:
    table = text(count(Path(build).resolve() / "arm"))
    print(table)
    tables.renew(ROOT / "docs/performance.md", "Arm", table)


if __name__ == "__main__":
    main(*sys.argv[1:])
