"""Prints the figures that KSL promises at this stage, each beside its mark: `make bench`, or run.py BUILD_DIR.

Times are wall-clock of whole processes, the median and the least of a few runs; memory is the largest resident set.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
PANDA = ROOT / "examples/robots/panda.urdf"
SAMPLES = 100_000
RUNS = 5


def run(command):
    """Seconds and MB of one process."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{' '.join(map(str, command))} failed")
    return time.perf_counter() - start, usage.ru_maxrss / 1024


def report(what, command, mark):
    run(command)  # warm the file cache
    figures = [run(command) for _ in range(RUNS)]
    seconds, memory = zip(*figures)
    print(f"{what:<52} median {statistics.median(seconds):6.3f} s, least {min(seconds):6.3f} s, memory {max(memory):4.0f} MB   (mark: {mark})")


def long_motion(path):
    """100,000 samples at 250 Hz within the Panda's limits."""
    t = np.arange(SAMPLES) * 0.004
    middle = np.array([0, 0, 0, -1.5, 0, 1.8, 0])
    q = middle + 0.5 * np.sin(np.outer(t, np.linspace(0.5, 1.3, 7)))
    header = ",".join(["time", *(f"panda_joint{i}" for i in range(1, 8))])
    np.savetxt(path, np.column_stack([t, q]), delimiter=",", header=header, comments="", fmt="%.9g")


def main(build):
    bin_dir = Path(sys.executable).parent
    with tempfile.TemporaryDirectory() as folder:
        motion = Path(folder) / "motion.csv"
        long_motion(motion)
        report("ksl loads, 7 joints, 100,000 samples", [bin_dir / "ksl", "loads", PANDA, motion, "-o", Path(folder) / "out"], "4 s, 600 MB")
    bare = [sys.executable, "-c", "import numpy"]
    report("import numpy, to compare with", bare, "none")
    report("import ksl, interpreter included", [sys.executable, "-c", "import ksl"], "0.3 s")
    print("one state in C++ (mark for the Panda: 700 ns)", flush=True)
    subprocess.run([Path(build) / "bench/dynamics_bench", PANDA, ROOT / "examples/robots/ur5.urdf", "--benchmark_repetitions=5", "--benchmark_report_aggregates_only=true"], check=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
