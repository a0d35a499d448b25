#!/usr/bin/env python3
"""Batches by code of one robot (`m.compile`) beside the engine's, on each instruction set, and one state of `ksl generate`'s C beside CasADi's.

    python bench/compiled.py [ROBOT.urdf ...]    default: UR5, Panda and Talos of example-robot-data

Needs ksl with the kernels of both sets, and clang or gcc; adam-robotics and casadi for CasADi's code.  Batches have 1,024 states, on one thread; turning rows
to lanes is in both times.  The two are timed in turns, and the best of many rounds counts.
"""

import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np

STATES, ROUNDS = 1024, 200
ALGORITHMS = ("inverse_dynamics", "forward_dynamics", "mass_matrix", "reactions", "inverse_dynamics_derivatives")
SETS = ("x86-64-v4", "x86-64-v3")
DRIVER = """
#include <stdio.h>
#include <time.h>
static double now(void) { struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec; }
int main(void) {
  double best = 1e9;
  static double q[64], v[64], a[64], tau[64], w[100000];
  static int iw[1000];
  const double *arg[] = {q, v, a};
  double *res[] = {tau};
  (void)w; (void)iw; (void)arg; (void)res;
  for (int k = 0; k < 64; ++k) q[k] = 0.1 * k - 1, v[k] = 0.3, a[k] = -0.2;
  for (int r = 0; r < 400; ++r) {
    const double begin = now();
    for (int k = 0; k < 1000; ++k) { q[0] += 1e-9 * tau[0]; CALL; }
    const double took = (now() - begin) / 1000;
    best = took < best ? took : best;
  }
  printf("%g", 1e9 * best);
}
"""


def robots() -> list[Path]:
    import example_robot_data as data

    folder = Path(data.__file__).parent
    names = ("ur5_robot.urdf", "panda.urdf", "talos_reduced.urdf")
    return [next(path for root in (folder, folder.parents[3] / "share") for path in root.rglob(name)) for name in names]


def in_turns(*calls, rounds=ROUNDS):
    """The best time of each call, s."""
    best = [np.inf] * len(calls)
    for _ in range(rounds):
        for k, call in enumerate(calls):
            begin = time.perf_counter()
            call()
            best[k] = min(best[k], time.perf_counter() - begin)
    return best


def batches(path: Path) -> None:
    import ksl

    try:
        instructions = ksl._core.instruction_set()
    except RuntimeError as e:
        return print(f"not measured: {e}")
    m, rng = ksl.load(path), np.random.default_rng(1)
    q = np.stack([m.random(k) for k in range(STATES)])
    v, a = rng.normal(size=(2, STATES, m.nv))
    given = {"mass_matrix": (q,)}
    print(f"\n{m.name}, {m.nv} coordinates, {instructions}")
    for name in ALGORITHMS:
        begin = time.perf_counter()
        fast = m.compile([name], compiler=os.environ.get("KSL_CC"))
        took = time.perf_counter() - begin
        arguments = given.get(name, (q, v, a))
        expected = getattr(m, name)(*arguments, threads=1)
        out = tuple(map(np.empty_like, expected)) if isinstance(expected, tuple) else np.empty_like(expected)
        slow, quick = in_turns(*(partial(getattr(of, name), *arguments, out=out, threads=1) for of in (m, fast)))
        print(f"  {name:30} engine {1e9 * slow / STATES:8.1f} ns, compiled {1e9 * quick / STATES:8.1f} ns: {slow / quick:5.2f} x; compiled in {took:.2f} s")
    slow, quick = in_turns(*(partial(of.inverse_dynamics, q[0], v[0], a[0]) for of in (m, fast)), rounds=20 * ROUNDS)
    print(f"  one state from Python: {1e9 * slow:.0f} ns, {1e9 * quick:.0f} ns by a model that is compiled: both by the engine")


def timed(folder: Path, sources: list[str], head: str, call: str, *flags: str) -> float:
    """The time of one call from C, ns."""
    (folder / "driver.c").write_text(head + DRIVER.replace("CALL", call))
    subprocess.run(["gcc", "-march=native", *flags, *sources, "driver.c", "-o", "driver", "-lm"], cwd=folder, check=True)
    return float(subprocess.run([folder / "driver"], capture_output=True, text=True, check=True).stdout)


def one_state(path: Path) -> None:
    import ksl

    m = ksl.load(path)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        ksl.generate(m, ["inverse_dynamics"], folder, name="one")
        ours = timed(folder, ["one.c"], '#include "one.h"\n', "one_inverse_dynamics(q, v, a, tau)", "-O2", "-ffp-contract=off", "-std=gnu99")
        print(f"\n{m.name}: one state of inverse dynamics from C, gcc: {ours:.0f} ns by ksl generate", end="")
        try:
            import casadi as cs
            from adam.casadi import KinDynComputations
        except ImportError:
            print("; CasADi's is not timed: adam-robotics[casadi] is missing")
            return
        robot = KinDynComputations(str(path), [name for name in m.joint_names if m.joint(name).nv])
        q, v, a = (cs.SX.sym(x, m.nv) for x in "qva")
        base, rest = cs.SX.eye(4), cs.SX.zeros(6)
        mass, bias = robot.mass_matrix_fun(), robot.bias_force_fun()
        tau = (
            (mass(base, q)[6:, 6:] @ a + bias(base, q, rest, v)[6:])
            if not hasattr(robot, "inverse_dynamics_fun")
            else robot.inverse_dynamics_fun()(base, q, rest, v, rest, a)[6:]
        )
        f = cs.Function("theirs", [q, v, a], [cs.cse(tau)])
        generator = cs.CodeGenerator("theirs.c", {"with_header": True})
        generator.add(f)
        generator.generate(f"{folder}/")
        theirs = timed(folder, ["theirs.c"], '#include "theirs.h"\n', "theirs(arg, res, (casadi_int *)iw, w, 0)", "-O3")
        print(f", {theirs:.0f} ns by adam and CasADi ({f.n_instructions()} instructions)")


def main() -> None:
    if os.environ.get("KSL_ISA"):
        for path in map(Path, sys.argv[1:]):
            batches(path)
        return
    paths = [Path(x) for x in sys.argv[1:]] or robots()
    for instructions in SETS:
        subprocess.run([sys.executable, __file__, *map(str, paths)], env={**os.environ, "KSL_ISA": instructions}, check=False)
    for path in paths:
        one_state(path)


if __name__ == "__main__":
    main()
