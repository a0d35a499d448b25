"""Times of calls from Python: `python_level.py BENCH_DIR JSON`, run with the Python that has KSL.

Peers come from the benchmark's own environment.  All take turns in one process; results are compared before.
"""

import json
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import ksl
from ksl import ufuncs

STATES = 10_000
REPETITIONS = 31
Figures = dict[str, dict[str, float]]


def take_turns(work: dict[str, Callable[[], object]], items: int, repetitions: int = REPETITIONS) -> Figures:
    """ns for each of `items`: median and minimum of each piece of work.

    What says "1 thread" is timed by the clock of this thread: on a shared machine without what others took.
    """
    times: dict[str, list[float]] = {name: [] for name in work}
    for _ in range(repetitions + 1):
        for name, run in work.items():
            clock = time.thread_time if "1 thread" in name else time.perf_counter
            start = clock()
            run()
            times[name].append((clock() - start) / items * 1e9)
    return {name: {"median_ns": statistics.median(t[1:]), "minimum_ns": min(t[1:])} for name, t in times.items()}


def agree(found: np.ndarray, expected: np.ndarray, what: str, tolerance: float = 1e-9) -> None:
    error = float((np.abs(found - expected).max(axis=-1) / np.abs(expected).max(axis=-1)).max())
    if not error <= tolerance:
        sys.exit(f"DISAGREEMENT: {what}: relative difference {error:.2g}, allowed {tolerance:.0e}")


def random_states(m: ksl.Model, n: int) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    q, v, a = rng.uniform(-3, 3, (n, m.nq)), rng.normal(size=(n, m.nv)), rng.normal(size=(n, m.nv))
    for joint in m.joints:
        if joint.kind == "floating":
            quaternion = q[:, joint.q_index + 3 : joint.q_index + 7]
            quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return [q, v, a]


def in_order(m: ksl.Model, model: Any) -> tuple[np.ndarray, np.ndarray]:
    """Columns of KSL's q and v in Pinocchio's order of joints."""
    floating = m.joints[0].kind == "floating"
    rows = [m.joints[0]] if floating else []
    rows += [m.joint(name) for name in list(model.names)[1 + floating :]]
    q = [joint.q_index + k for joint in rows for k in range(joint.nq)]
    v = [joint.v_index + k for joint in rows for k in range(joint.nv)]
    return np.array(q), np.array(v)


def robot(name: str, path: str, floating: bool) -> dict[str, Any]:
    import pinocchio as pin

    m = ksl.load(path, floating_base=floating)
    model = pin.buildModelFromUrdf(path, pin.JointModelFreeFlyer()) if floating else pin.buildModelFromUrdf(path)
    data, pool = model.createData(), pin.ModelPool(model, 2)
    q, v, a = random_states(m, STATES)
    order_q, order_v = in_order(m, model)
    Q, V, A = (np.asfortranarray(x[:, order].T) for x, order in ((q, order_q), (v, order_v), (a, order_v)))
    out, tau = np.empty_like(v), np.asfortranarray(np.empty_like(V))
    single = [x.astype(np.float32) for x in (q, v, a)]
    columns = [(np.ascontiguousarray(Q[:, k]), np.ascontiguousarray(V[:, k]), np.ascontiguousarray(A[:, k])) for k in range(1000)]

    pin.rneaInParallel(1, pool, Q, V, A, tau)
    agree(m.inverse_dynamics(q, v, a)[:, order_v], tau.T, f"inverse_dynamics and rneaInParallel, {name}")
    agree(m.inverse_dynamics(*single), m.inverse_dynamics(q, v, a), f"float, {name}", 1e-3)

    batch = {
        "KSL, 1 thread": lambda: m.inverse_dynamics(q, v, a, out=out, threads=1),
        "KSL, 1 thread, new result": lambda: m.inverse_dynamics(q, v, a, threads=1),
        "KSL, 2 threads": lambda: m.inverse_dynamics(q, v, a, out=out, threads=2),
        "KSL, float, 1 thread": lambda: m.inverse_dynamics(*single, threads=1),
        "rneaInParallel, 1 thread": lambda: pin.rneaInParallel(1, pool, Q, V, A, tau),
        "rneaInParallel, 2 threads": lambda: pin.rneaInParallel(2, pool, Q, V, A, tau),
    }
    batch |= array_programs(m, model, q, v, a) if name == "ur5" else {}
    figures = {"batch": take_turns(batch, STATES)}
    states = list(zip(q[:1000], v[:1000], a[:1000]))
    figures["one state"] = take_turns(
        {
            "KSL, 1 thread": lambda: [m.inverse_dynamics(*state) for state in states],
            "pin.rnea, 1 thread": lambda: [pin.rnea(model, data, *state) for state in columns],
        },
        len(states),
    )
    return figures


def array_programs(m: ksl.Model, model: Any, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> dict[str, Callable[[], object]]:
    """The recursion over whole arrays, with NumPy and, if installed, with JAX; both on as many cores as they use."""
    import array_rnea

    bodies = array_rnea.parameters(model)
    expected = array_rnea.rnea(np, bodies, q, v, a)
    agree(m.inverse_dynamics(q, v, a), expected, "KSL and NumPy")
    programs: dict[str, Callable[[], object]] = {"NumPy, 1 thread": lambda: array_rnea.rnea(np, bodies, q, v, a)}
    try:
        import jax
    except ImportError:
        return programs
    jax.config.update("jax_enable_x64", True)
    compiled = jax.jit(lambda q, v, a: array_rnea.rnea(jax.numpy, bodies, q, v, a))
    agree(np.asarray(compiled(q, v, a)), expected, "JAX and NumPy")
    programs["JAX, compiled"] = lambda: compiled(q, v, a).block_until_ready()
    return programs


def wrenches(n: int = 1_000_000) -> Figures:
    """n wrenches, each by a pose of its own: 12 + 6 numbers read, 6 written."""
    rng = np.random.default_rng(2)
    D, c = rng.normal(size=(n, 4, 3)), rng.normal(size=(n, 6))
    out = np.zeros_like(c)

    def with_numpy() -> np.ndarray:
        f = np.einsum("nji,nj->ni", D[:, :3], c[:, :3])
        return np.concatenate([f, np.einsum("nji,nj->ni", D[:, :3], c[:, 3:]) + np.cross(D[:, 3], f)], axis=1)

    agree(ufuncs.product_CoAdc(D, c), with_numpy(), "product_CoAdc and NumPy")

    def on(threads: int, to: np.ndarray | None = None) -> np.ndarray:
        ufuncs.set_threads(threads)
        return ufuncs.product_CoAdc(D, c, out=to)

    work = {
        "KSL, 1 thread": lambda: on(1, out),
        "KSL, 1 thread, new result": lambda: on(1),
        "KSL, 2 threads": lambda: on(2, out),
        "NumPy, 1 thread": with_numpy,
    }
    return take_turns(work, n, 30)


def main(folder: str, result: str) -> None:
    peers = (Path(folder) / "venv/site").resolve()
    sys.path += [str(peers), *map(str, peers.glob("cmeel.prefix/lib/python*/site-packages"))]
    rows = [line.split(maxsplit=2) for line in (Path(folder) / "robots.txt").read_text().splitlines()]
    robots = {name: (path, base == "floating") for name, base, path in rows}
    figures: dict[str, Any] = {name: robot(name, *robots[name]) for name in ("ur5", "talos")}
    figures["10^6 wrenches by 10^6 poses"] = wrenches()
    Path(result).write_text(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main(*sys.argv[1:])
