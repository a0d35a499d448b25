#!/usr/bin/env python3
"""Runs fuzz targets, as many at a time as there are cores, and writes a record of each.

    run.py --short [--record] | --seconds N | --runs N [--only NAME ...]

--short replays the seeds and goes on for as many texts as take about 16 s where a reader has changed since it was last recorded to run
(test/trust/read/fuzz.txt); --record writes there what has run.  The texts are those of one seed and of the files of the repository: the same commit
runs the same ones, unless a target takes far longer than usual and is stopped.  So where the record has a reader, it has had these texts, and a
sixteenth of them shows that it and the packages that it reads with still work together.

A target is a program build/fuzz/fuzz/fuzz_NAME, or a file fuzz/python/fuzz_NAME.py; both take the arguments of libFuzzer.
Its seeds are in fuzz/corpus/FORMAT, where NAME begins with FORMAT, or fuzz/packed_seeds.py makes them.  fuzz/words.py has words of some formats.  Texts
that run new code are kept in build/fuzz/corpus/NAME for the next run.  Texts that break a promise are kept in build/fuzz/found/NAME.

A program fuzz_NAME_with_FAULT has a planted fault, which it must find.  Targets in Python have the faults of
fuzz/python/target.py, which a variable of the environment plants.  With --runs, targets with faults are run too, and records
are written: fuzz-NAME.json.  A run of fewer executions than are promised is recorded as one that shows the promise in part."""

import argparse
import json
import os
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "scripts/lint"))
import changes
from words import WORDS, dictionary

BUILD = ROOT / "build/fuzz"
PROGRAMS = BUILD / "fuzz"
PATIENCE = 300
"""Seconds in which a fault that was planted must be found."""
PROMISED, OF_PACKED = 10_000_000, 1_000_000
"""Executions of each target, and of those whose texts take milliseconds each: files that are packed, and what makes a model of each text."""
PACKED = ("npz", "parquet", "mcap", "ros1", "ros2", "xlsx", "mat")
SLOW = (*PACKED, "usd", "loops")
SHORT = {
    "cases": 40_000, "check": 15_000, "check_rules": 5_000, "components": 40_000, "csv": 20_000, "csv_form": 60_000, "loops": 2_000, "map": 40_000,
    "mat": 2_000, "mcap": 2_000, "mjcf": 5_000,
    "npz": 2_500, "parquet": 1_500, "ros1": 1_500, "ros2": 1_000, "sdf": 15_000, "sweep": 50_000, "urdf": 30_000, "urdf_round_trip": 30_000,
    "usd": 1_000, "xlsx": 200,
}  # fmt: skip
"""Texts that take about 4 s, of each target."""
USUAL, CHANGED, RECORDED = 10_000, 4, 1 / 4
"""Texts of a target that isn't named there; how many times as many where its reader has changed, and where it has not."""
CEILING, PATIENT = 60, 100
"""Seconds after which a short run ends all the same, with what it has found, and after which a text never ends: CI's machines are busy."""
LONGEST, LONGEST_PACKED = 1500, 1 << 14
"""Bytes of a text.  Longer ones take more time and show little more, but a database has some pages."""


PYTHON_FAULTS = ("raw error", "control character", "slow", "not finite", "text that is taken")
"""Faults that fuzz/python/target.py names, which can't be imported where Atheris is not installed."""
MUCH = "much memory"
"""The fault of targets whose memory is bounded."""


ENDED = []
"""(line of readers_of, is it to be recorded) of each target that found nothing."""


@dataclass(frozen=True)
class Target:
    name: str
    command: list[str]
    fault: str = ""  # that was planted

    @property
    def environment(self):
        return os.environ | ({"KSL_FUZZ_FAULT": self.fault} if self.fault in (*PYTHON_FAULTS, MUCH) else {})


def targets():
    found = []
    for program in sorted(PROGRAMS.glob("fuzz_*")):
        if program.is_file() and os.access(program, os.X_OK):
            name, _, fault = program.name.removeprefix("fuzz_").partition("_with_")
            found.append(Target(name, [str(program)], fault.replace("_", " ")))
    for file in sorted((ROOT / "fuzz/python").glob("fuzz_*.py")):
        name = file.stem.removeprefix("fuzz_")
        faults = ("", *PYTHON_FAULTS, MUCH) if name in PACKED else ("", *PYTHON_FAULTS)
        found += [Target(name, [sys.executable, str(file)], fault) for fault in faults]
    return found


def format_of(name):
    return next((folder.name for folder in sorted((ROOT / "fuzz/corpus").iterdir(), reverse=True) if name.startswith(folder.name)), name)


def seeds_of(name):
    """Folders of seeds: ours, those that a script makes, and real robots where their package is."""
    format = format_of(name)
    if name in PACKED:
        made = BUILD / "packed_seeds" / name
        if not made.exists():
            subprocess.run([sys.executable, ROOT / "fuzz/packed_seeds.py", name, made], check=True)
        return [made]
    folders = [ROOT / "fuzz/corpus" / format]
    if format in ("urdf", "sdf"):
        real = BUILD / "real_robots" / format
        if not real.exists():
            subprocess.run([sys.executable, ROOT / "fuzz/real_robots.py", format, real, "--most", "900"], check=True)
        folders.append(real)
    return [folder for folder in folders if folder.exists()]


def readers_of(target):
    """The line of the list of readers for a target: a digest of the code whose branches its fuzzer counts, and of its own."""
    if target.command[0] == sys.executable:
        own = Path(target.command[1])
        named = re.search(r"^guide\(([^)]*)\)", own.read_text(encoding="utf-8"), re.MULTILINE)[1]
        files = {own, ROOT / "fuzz/python/mutate.py", ROOT / "fuzz/python/target.py"}
        beside = (own.with_name(f"{module}.py") for module in re.findall(r"^from (\w+) import", own.read_text(encoding="utf-8"), re.MULTILINE))
        files |= {file for file in beside if file.exists() and file.name != "guided.py"}
        for module in re.findall(r'"(ksl[\w.]*)"', named):  # others' packages are not ours to be read
            place = ROOT / "python" / module.replace(".", "/")
            files |= set(place.rglob("*.py")) if place.is_dir() else {place.with_suffix(".py")}
    else:
        listed = json.loads((BUILD / "compile_commands.json").read_text(encoding="utf-8"))
        compiled = {Path(entry["file"]) for entry in listed}
        files = {file for each in compiled if each.exists() and BUILD not in each.parents for file in changes.closure(each)}
    return f"{changes.digest_of(files)} {target.name}"


def run(target, limits, texts=None):
    """Executions, seconds, and what the target says at the end.  texts: of a short run, beyond the seeds; it keeps none for the next one."""
    name = target.name
    kept = BUILD / "corpus" / (f"{name} with {target.fault}".replace(" ", "_") if target.fault else name)
    found = BUILD / "found" / kept.name
    for folder in (kept, found):
        folder.mkdir(parents=True, exist_ok=True)
    words = kept.with_suffix(".dict")
    arguments = [
        f"-max_len={LONGEST_PACKED if name in PACKED else LONGEST}",
        f"-timeout={PATIENT if texts else 10}",
        "-rss_limit_mb=2048",
        "-print_final_stats=1",
        "-entropic=0",
        f"-artifact_prefix={found}/",
        *limits,
    ]
    if format_of(name) in WORDS:
        words.write_text(dictionary(format_of(name)), encoding="utf-8")
        arguments.append(f"-dict={words}")
    environment = target.environment
    if texts is None:
        arguments += [kept, *seeds_of(name)]
    else:
        # A folder is read in the order of its file system.
        seeds = sorted(str(file) for folder in seeds_of(name) for file in folder.rglob("*") if file.is_file())
        listed = kept.with_suffix(".seeds")
        listed.write_text(",".join(seeds), encoding="utf-8")
        arguments += [f"-seed_inputs=@{listed}", "-seed=1", f"-runs={len(seeds) + texts}"]
        environment["PYTHONHASHSEED"] = "0"  # of which the order of sets depends
    start = time.monotonic()
    done = subprocess.run(
        [*target.command, *arguments], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="backslashreplace"
    )
    executed = re.findall(r"stat::number_of_executed_units: *(\d+)", done.stdout)
    return {"ok": done.returncode == 0, "executions": int(executed[-1]) if executed else 0, "seconds": time.monotonic() - start, "said": done.stdout}


def faults_of(target, all_targets):
    """{fault: was it found}.  A fault is found if the target ends with a report."""
    outcome = {}
    for other in all_targets:
        if other.name == target.name and other.fault:
            result = run(other, [f"-max_total_time={PATIENCE}"])
            caught = not result["ok"] and re.search(r"ERROR: |broken promise: |runtime error: ", result["said"])
            outcome[other.fault] = "caught" if caught else "missed"
    return outcome


def promised(name):
    return OF_PACKED if name in SLOW else PROMISED


def record(name, result, faults):
    executions, seconds = result["executions"], result["seconds"]
    found_nothing = result["ok"] and set(faults.values()) == {"caught"}
    state = "--broken" if not found_nothing else "--kept" if executions >= promised(name) else "--in-part"
    figures = (
        f"executions={executions:,}",
        f"hours={seconds / 3600:.2f}",
        f"texts that broke a promise={int(not result['ok'])}",  # it ends at the first
    )
    to_record(
        name,
        state,
        *(word for figure in figures for word in ("--figure", figure)),
        *(word for fault, outcome in faults.items() for word in ("--planted", f"{fault}={outcome}")),
    )


def to_record(name, *arguments):
    record = [sys.executable, ROOT / "scripts/trust/record.py", f"fuzz-{name.replace('_', '-')}", "--command", "make fuzz"]
    subprocess.run([*record, *arguments], check=True)


def work(target, asked, all_targets):
    if asked.runs:
        to_record(target.name, "--begun")
    faults = faults_of(target, all_targets) if asked.runs else {}
    line = readers_of(target)
    if asked.short:
        texts = int(SHORT.get(target.name, USUAL) * (RECORDED if line in changes.read("fuzz") else CHANGED))
        result = run(target, [f"-max_total_time={CEILING}"], texts)
    else:
        result = run(target, [f"-runs={min(asked.runs, promised(target.name))}" if asked.runs else f"-max_total_time={asked.seconds}"])
    if asked.runs:
        record(target.name, result, faults)
    if result["ok"] and "missed" not in faults.values() and not asked.seconds:
        ENDED.append((line, asked.record or (asked.runs or 0) >= promised(target.name)))
    planted = "; ".join(f"{fault}: {outcome}" for fault, outcome in faults.items()) or "no planted fault was run"
    print(f"fuzz-{target.name}: {result['executions']:,} executions in {result['seconds']:.0f} s; {planted}", flush=True)
    if not result["ok"]:
        print("\n".join(result["said"].splitlines()[-40:]), flush=True)
    return result["ok"] and "missed" not in faults.values()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    amount = parser.add_mutually_exclusive_group(required=True)
    amount.add_argument("--short", action="store_true")
    amount.add_argument("--seconds", type=int)
    amount.add_argument("--runs", type=int)
    parser.add_argument("--record", action="store_true", help="of short runs: note which readers have run")
    parser.add_argument("--only", nargs="*", default=[], metavar="NAME")
    asked = parser.parse_args()
    all_targets = targets()
    chosen = [target for target in all_targets if not target.fault and (not asked.only or target.name in asked.only)]
    if not chosen:
        sys.exit("there is no such target; make fuzz-build makes them")
    for target in chosen:
        seeds_of(target.name)  # made before the targets share the machine
    with ThreadPoolExecutor(int(os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or len(os.sched_getaffinity(0)))) as pool:
        ended = list(pool.map(lambda target: work(target, asked, all_targets), chosen))
    for recorded in (False, True):
        changes.renew("fuzz", [line for line, lasting in ENDED if lasting == recorded], recorded)
    print(f"fuzz: {sum(ended)} of {len(ended)} targets found nothing", flush=True)
    sys.exit(not all(ended))


if __name__ == "__main__":
    main()
