#!/usr/bin/env python3
"""Try the KSL that is installed, as its first user does: import it, check a robot, and compute a report.  Says how long each took, and where the
system counts it (not on Windows) the processor's time.

    python scripts/dist/try_wheel.py examples [--sets x86_64_v3]     the sets of `dist.py --sets`, if the wheel has not all"""

import argparse
import os
import platform
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path

OLDER = "x86_64_v2;x86_64_v3"  # of a wheel with all sets: what processors without AVX-512 run

# Where Python has no lock of its own, importing KSL must not give it one, and results of threads that compute at once are those of one thread.
WITHOUT_LOCK = """
import sys, threading
import numpy as np
import ksl, ksl.ufuncs
if sys._is_gil_enabled():
    sys.exit("importing ksl has switched the interpreter's lock on")
m = ksl.load({robot!r})
q, v, a = np.random.default_rng(1).uniform(-1, 1, (3, 2000, m.nv))
poses, twists = q.repeat(70, 0)[:, :1, None] + np.zeros((4, 3)), v.repeat(70, 0)
def computed():
    batches = [m.inverse_dynamics(q, v, a), m.mass_matrix(q), m.forward_dynamics(q, v, a), ksl.ufuncs.product_Ads(poses, twists)]
    states = [m.inverse_dynamics(*state) for state in zip(q, v, a)] + [m.mass_matrix(one) for one in q]
    return b"".join(x.tobytes() for x in batches + states)
alone, found, start = computed(), [], threading.Barrier(8)
def compute():
    start.wait()
    found.extend(computed() for _ in range(5))
threads = [threading.Thread(target=compute) for _ in range(8)]
for thread in threads: thread.start()
for thread in threads: thread.join()
if found != [alone] * 40:
    sys.exit(f"{{sum(x != alone for x in found)}} results of {{len(found)}}, of 40 expected, are not those of one thread")
"""


def used():
    """Processor time, s, of the programs that have ended."""
    times = os.times()
    return times.children_user + times.children_system


def timed(what, command, **options):
    start, before = time.monotonic(), used()
    done = subprocess.run(command, capture_output=True, text=True, **options)
    print(f"{time.monotonic() - start:6.1f} s, processor {used() - before:5.1f} s  {what}")
    if done.returncode != 0:
        sys.exit(f"{what} ended with {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("examples", type=Path)
    parser.add_argument("--sets", default=OLDER if platform.machine() in ("x86_64", "AMD64") else "", help="instruction sets that are tried beside the one that KSL takes")
    given = parser.parse_args()
    examples = given.examples.resolve()
    robot = examples / "robots/ur5.urdf"
    with tempfile.TemporaryDirectory() as folder:  # and not the source tree, whose ksl has no extension
        ksl = [sys.executable, "-m", "ksl"]
        lines = f"import ksl; m = ksl.load({str(robot)!r}); print(ksl.__version__, ksl._core.instruction_set(), *m.gravity_torque([0.0] * m.nq).round(2))"
        print(timed("import, load, compute", [sys.executable, "-c", lines], cwd=folder), end="")
        for name in filter(None, given.sets.replace("_", "-").split(";")):
            timed(f"the same with {name}", [sys.executable, "-c", lines], cwd=folder, env=os.environ | {"KSL_ISA": name})
        if sysconfig.get_config_var("Py_GIL_DISABLED"):
            timed("eight threads without the interpreter's lock", [sys.executable, "-c", WITHOUT_LOCK.format(robot=str(robot))], cwd=folder)
        timed("ksl check", [*ksl, "check", str(robot), "--ignore", "root-inertial"], cwd=folder)
        timed("ksl loads", [*ksl, "loads", str(robot), str(examples / "motions/ur5_pick.csv"), "-o", "out"], cwd=folder)
        report = Path(folder, "out/report.html")
        if not report.read_text(encoding="utf-8").lower().startswith("<!doctype html"):
            sys.exit("report.html is no page")
        print(f"{report.stat().st_size / 1e6:.1f} MB of report")


if __name__ == "__main__":
    main()
