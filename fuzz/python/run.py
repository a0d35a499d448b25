#!/usr/bin/env python3
"""Runs fuzz targets of the Python readers: run.py [TARGET ...] --seconds N | --runs N [--corpus FOLDER] [--planted] [--record]

TARGET: csv, csv_form, map, cases, components, sweep, check; all without one.  Seeds are in fuzz/corpus/TARGET; what a run finds new goes to
FOLDER/TARGET, build/fuzz/corpus by default, and a text that breaks a promise to build/fuzz/found/TARGET.  --planted: before each run every
fault of target.py is planted, and must be found within a minute.  --record: the figures are recorded as fuzz-python-TARGET.
Ends with status 1 where a promise is broken or a fault is missed."""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FAULTS = ("raw error", "control character", "slow", "not finite")  # of target.py, which needs atheris to be imported
SEEDS = {"csv_form": "csv"}
LONGEST = 1500
"""Bytes of a text: short ones show what long ones do, in less time."""


def targets() -> list[str]:
    return [file.stem.removeprefix("fuzz_") for file in sorted(HERE.glob("fuzz_*.py"))]


def run(name: str, limit: str, corpus: Path, fault: str = "") -> tuple[int, int, float, str]:
    """Status, executions, seconds, and what was printed."""
    kept, found = corpus / name, ROOT / "build/fuzz" / ("found_planted" if fault else "found") / name
    for folder in (kept, found):
        folder.mkdir(parents=True, exist_ok=True)
    words = ROOT / f"fuzz/{SEEDS.get(name, name)}.dict"
    command = [sys.executable, HERE / f"fuzz_{name}.py", limit, f"-max_len={LONGEST}", "-timeout=20", "-rss_limit_mb=3072", "-print_final_stats=1"]
    command += [f"-artifact_prefix={found}/", *([f"-dict={words}"] if words.exists() else [])]
    seeds = ROOT / "fuzz/corpus" / SEEDS.get(name, name)
    environment = os.environ | {"KSL_FUZZ_FAULT": fault}
    start = time.monotonic()
    done = subprocess.run([*map(str, command), str(kept), str(seeds)], capture_output=True, text=True, errors="backslashreplace", env=environment)
    said = done.stdout + done.stderr
    executed = re.findall(r"stat::number_of_executed_units: *(\d+)|^#(\d+)\s+DONE", said, re.MULTILINE)
    return done.returncode, int("".join(executed[-1])) if executed else 0, time.monotonic() - start, said


def missed_faults(name: str, corpus: Path) -> list[str]:
    missed = []
    for fault in FAULTS:
        status, _, seconds, said = run(name, "-max_total_time=60", corpus, fault)
        caught = status != 0 and "broken promise" in said
        print(f"{name}: planted {fault}: {'caught' if caught else 'missed'} in {seconds:.0f} s", flush=True)
        missed += [] if caught else [fault]
    return missed


def record(name: str, executions: int, seconds: float, kept: bool, planted: bool) -> None:
    command = [sys.executable, ROOT / "scripts/trust/record.py", f"fuzz-python-{name.replace('_', '-')}", "--command", "make fuzz"]
    command += ["--kept" if kept else "--broken", "--figure", f"executions={executions:,}", "--figure", f"hours={seconds / 3600:.2f}"]
    for fault in FAULTS if planted else ():
        command += ["--planted", f"{fault}=caught"]
    subprocess.run(command, check=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", nargs="*", choices=[*targets(), []])
    amount = parser.add_mutually_exclusive_group(required=True)
    amount.add_argument("--seconds", type=int)
    amount.add_argument("--runs", type=int)
    parser.add_argument("--corpus", type=Path, default=ROOT / "build/fuzz/corpus")
    parser.add_argument("--planted", action="store_true")
    parser.add_argument("--record", action="store_true")
    asked = parser.parse_args()
    broken = False
    for name in asked.target or targets():
        missed = missed_faults(name, asked.corpus) if asked.planted else []
        status, executions, seconds, said = run(name, f"-max_total_time={asked.seconds}" if asked.seconds else f"-runs={asked.runs}", asked.corpus)
        kept = status == 0 and not missed
        rate = executions / max(seconds, 1e-9)
        print(f"{name}: {executions:,} executions in {seconds:.0f} s, {rate:,.0f} a second: {'kept' if kept else 'broken'}", flush=True)
        if status:
            print("\n".join(said.splitlines()[-40:]), flush=True)
        if asked.record:
            record(name, executions, seconds, kept, asked.planted)
        broken |= not kept
    sys.exit(int(broken))


if __name__ == "__main__":
    main()
