"""Time and memory of whole processes: `ksl loads` and the import.  `loads.py JSON`, run with the Python that has KSL.

Times are wall-clock, memory is the largest resident set.
"""

import json
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


def run(command: list[str | Path]) -> tuple[float, float]:
    """Seconds and MB of one process."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{' '.join(map(str, command))} failed")
    return time.perf_counter() - start, usage.ru_maxrss / 1024


def measure(command: list[str | Path]) -> dict[str, float]:
    run(command)  # warm the file cache
    seconds, memory = zip(*(run(command) for _ in range(RUNS)))
    return {"median_s": statistics.median(seconds), "minimum_s": min(seconds), "memory_MB": max(memory)}


def long_motion(path: Path) -> None:
    """100,000 samples at 250 Hz within the Panda's limits."""
    t = np.arange(SAMPLES) * 0.004
    middle = np.array([0, 0, 0, -1.5, 0, 1.8, 0])
    q = middle + 0.5 * np.sin(np.outer(t, np.linspace(0.5, 1.3, 7)))
    header = ",".join(["time", *(f"panda_joint{i}" for i in range(1, 8))])
    np.savetxt(path, np.column_stack([t, q]), delimiter=",", header=header, comments="", fmt="%.9g")


def main(result: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        motion = Path(folder) / "motion.csv"
        long_motion(motion)
        figures = {
            "ksl loads, 7 joints, 100,000 samples": measure([Path(sys.executable).parent / "ksl", "loads", PANDA, motion, "-o", Path(folder) / "out"]),
            "import numpy": measure([sys.executable, "-c", "import numpy"]),
            "import ksl": measure([sys.executable, "-c", "import ksl"]),
        }
    Path(result).write_text(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main(*sys.argv[1:])
