#!/usr/bin/env python3
"""One mechanism on a graphics card: tests, and what a state costs, beside others and beside the processor.  `make card`.

    python bench/card.py [ROBOT.urdf ...] [-o build/card]    default: Panda and UR5 of the examples, and Talos where example-robot-data is installed

Needs a card, ksl with NVRTC (`ksl[cuda]`, or torch), and no network; ten minutes at most.  Without a card it says so, and ends with status 2.

Arrays are on the card.  kernel: the mean of many launches between two events; call: from Python until the stream is done, the median; graph: the same launches from a
CUDA graph.  Each result is compared with the engine's before it is timed.  Others, where they are installed: the recursion over arrays in JAX (array_rnea.py), frax,
and KSL's batches on up to 16 threads.  compute-sanitizer looks at one robot's kernels, where it is installed.  All is written to card.json, with card, driver,
date and commit.
"""

import argparse
import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "bench"), str(ROOT / "scripts/trust")]
import run_facts  # noqa: E402
from card_memory import Array, Card  # noqa: E402

import ksl  # noqa: E402
from ksl.base.errors import CompilerError  # noqa: E402
from ksl.generation.card.driver import system_driver  # noqa: E402
from ksl.generation.card.functions import LOCAL_BYTES, REGISTERS  # noqa: E402
from ksl.generation.cuda import nvrtc  # noqa: E402
from ksl.model.model import code_on_card  # noqa: E402

NO_CARD = 2
STATES = (4096, 65536, 1048576)
ROWS = ("inverse_dynamics", "forward_dynamics", "reactions", "inverse_dynamics_derivatives")
LARGEST = 32
"""Coordinates beyond which inverse dynamics alone is measured: others take NVRTC minutes."""
BOUND = {"double": 1e-11, "float": 2e-3}
"""The largest difference from the engine in double, of the largest number: round-off of each precision."""
MOST_SECONDS = 540
"""No measurement begins later."""
MOST_BYTES = 8 << 30
SANITIZER_SECONDS = 60
"""For each of its tools, which slow kernels down by much."""


def robots() -> list[Path]:
    found = [ROOT / "examples/robots" / f"{name}.urdf" for name in ("panda", "ur5")]
    try:
        import example_robot_data as data
    except ImportError:
        return found
    folder = Path(data.__file__).parent
    return found + [path for root in (folder, folder.parents[3] / "share") for path in root.rglob("talos_reduced.urdf")][:1]


def tests() -> str:
    """How the tests on the card ended."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(ROOT / "test/generation/card/on_card_test.py")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    said = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    print("\n".join(said[-12:]))
    return said[-1] if said else f"status {done.returncode}"


def sanitized() -> dict[str, str]:
    """What NVIDIA's compute-sanitizer says of kernels of one robot: accesses outside of arrays, and races in shared memory.  Where the machine has none, that."""
    program = shutil.which("compute-sanitizer") or shutil.which("compute-sanitizer", path="/usr/local/cuda/bin")
    if program is None:
        return {"compute-sanitizer": "isn't on this machine"}
    found = {}
    for tool in ("memcheck", "racecheck"):
        run = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", "ur5-double and agree", str(ROOT / "test/generation/card/on_card_test.py")]
        try:
            done = subprocess.run(
                [program, "--tool", tool, "--error-exitcode", "99", *run], capture_output=True, text=True, cwd=ROOT, check=False, timeout=SANITIZER_SECONDS
            )
        except subprocess.TimeoutExpired:
            found[tool] = f"stopped after {SANITIZER_SECONDS} s"
            continue
        summary = [line for line in (done.stdout + done.stderr).splitlines() if "SUMMARY" in line or "RACECHECK" in line]
        found[tool] = f"status {done.returncode}; {' '.join(summary[-1:]).strip('= ')}"
    return found


def states(m: ksl.Model, n: int, dtype: type) -> list[np.ndarray]:
    """A thousand states, as often as they fit: what a state costs doesn't depend on others."""
    rng, few = np.random.default_rng(1), min(n, 1024)
    q = np.stack([m.random(k) for k in range(few)])
    given = [q, *(rng.normal(size=(few, m.nv)) for _ in range(2))]
    return [np.ascontiguousarray(np.tile(x, (n // few, 1)), dtype=dtype) for x in given]


def measured(card: Card, m: ksl.Model, row: str, scalar: str) -> list[dict[str, Any]]:
    begin = time.perf_counter()
    fast = m.compile([row], scalar=scalar, device=f"cuda:{card.number}")
    compiled = time.perf_counter() - begin
    (function,) = code_on_card(fast).functions
    dtype, lines = np.dtype({"double": np.float64, "float": np.float32}[scalar]), []
    for n in STATES:
        width = sum(size for _, size in function.inputs) + sum(int(np.prod(shape)) for _, shape in function.results)
        if n * width * dtype.itemsize > MOST_BYTES:
            continue
        host = states(m, n, dtype.type)
        given = [card.array(x) for x in host]
        out = tuple(Array(card, (n, *shape), dtype) for _, shape in function.results)
        call = partial(getattr(fast, row), *given, out=out if len(out) > 1 else out[0])
        call()
        require_agreement(m, row, [x[:1024] for x in host], [y.numpy()[:1024] for y in out], BOUND[scalar])
        launches = max(10, min(200, 20_000_000 // n))

        def many(run: Callable[[], object], times: int = launches) -> None:
            for _ in range(times):
                run()

        def waited(call: Callable[[], object] = call) -> float:
            begin = time.perf_counter()
            call()
            card.wait()
            return time.perf_counter() - begin

        graph = card.graph(partial(many, call))
        graph()
        card.wait()
        kernel = min(card.seconds(partial(many, call)) for _ in range(5)) / launches
        in_graph = min(card.seconds(graph) for _ in range(5)) / launches
        one = float(np.median([waited() for _ in range(100)]))
        lines.append({
            "robot": m.name, "row": row, "scalar": scalar, "states": n, "kernel_ns": 1e9 * kernel / n, "graph_ns": 1e9 * in_graph / n, "call_ns": 1e9 * one / n, "call_us": 1e6 * one,
            "registers": function.attribute(REGISTERS, card.number), "spilled_bytes": function.attribute(LOCAL_BYTES, card.number), "compile_s": compiled,
            "gigabytes_a_second": width * dtype.itemsize * n / kernel / 1e9,
        })  # fmt: skip
        print_line(lines[-1])
    return lines


def require_agreement(m: ksl.Model, row: str, given: list[np.ndarray], found: list[np.ndarray], bound: float) -> None:
    expected = getattr(m, row)(*(x.astype(float) for x in given))
    for x, y in zip(found, expected if isinstance(expected, tuple) else (expected,), strict=True):
        worst = np.abs(x - y).max() / np.abs(y).max()
        if not worst <= bound:
            sys.exit(f"{m.name}: {row} on the card differs from the engine's by {worst:.3g} of the largest number; expected at most {bound:.3g}")


def print_line(line: dict[str, Any]) -> None:
    figures = ", ".join(f"{name} {line[f'{name}_ns']:.3g}" for name in ("kernel", "graph", "call") if f"{name}_ns" in line)
    print(f"{line['robot']:10} {line['row']:30} {line['scalar']:7} {line['states']:9,}  {figures} ns a state", flush=True)


def others(m: ksl.Model, path: Path) -> list[dict[str, Any]]:
    """Inverse dynamics of others on the same machine: calls until they are done."""
    lines = []
    for scalar, dtype in (("double", np.float64), ("float", np.float32)):
        for n in STATES:
            q, v, a = states(m, n, dtype)
            ways: dict[str, Callable[[], object]] = {"KSL, 16 threads": partial(m.inverse_dynamics, q, v, a, out=np.empty_like(v), threads=16)}
            ways |= in_jax(m, path, q, v, a)
            for name, way in ways.items():
                way()
                took = []
                for _ in range(20):
                    begin = time.perf_counter()
                    way()
                    took.append(time.perf_counter() - begin)
                lines.append({"robot": m.name, "row": name, "scalar": scalar, "states": n, "call_ns": 1e9 * float(np.median(took)) / n})
                print_line(lines[-1])
    return lines


def in_jax(m: ksl.Model, path: Path, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> dict[str, Callable[[], object]]:
    """The recursion over arrays, and frax, where JAX has a card."""
    try:
        import jax
        import jax.numpy as jnp

        device = jax.devices("cuda")[0]
    except (ImportError, RuntimeError):
        return {}
    import array_rnea

    jax.config.update("jax_enable_x64", True)
    there = [jax.device_put(x, device) for x in (q, v, a)]
    bodies = array_rnea.bodies_of(m)
    programs = {"array RNEA in JAX": jax.jit(lambda q, v, a: array_rnea.rnea(jnp, bodies, q, v, a))}
    try:
        import frax
    except ImportError:
        pass
    else:
        robot, gravity = frax.Robot(str(path)), jnp.array([0, 0, 9.81, 0, 0, 0], q.dtype)
        programs["frax"] = jax.jit(jax.vmap(lambda q, v, a: robot.rnea(q, v, a, gravity, None)))
    return {name: partial(lambda program: program(*there).block_until_ready(), program) for name, program in programs.items()}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("robots", nargs="*", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "build/card")
    options = parser.parse_args()
    try:
        driver = system_driver()
    except CompilerError as error:
        print(f"nothing is measured: {error}")
        return NO_CARD
    begin, card = time.perf_counter(), Card(driver)
    record: dict[str, Any] = {
        "card": driver.name(0), "architecture": driver.architecture(0), "driver_serves": driver.version, "nvrtc": nvrtc.find().version, "date": run_facts.date(),
        "commit": run_facts.commit(), "processor": run_facts.processor(), "tests": tests(), "sanitizer": sanitized(), "figures": [], "left_out": [],
    }  # fmt: skip
    options.output.mkdir(parents=True, exist_ok=True)
    for path in options.robots or robots():
        m = ksl.load(path)
        work = [(row, scalar) for row in (ROWS if m.nv < LARGEST else ROWS[:1]) for scalar in ("float", "double")]
        for name, measure in [*((f"{row}, {scalar}", partial(measured, card, m, row, scalar)) for row, scalar in work), ("others", partial(others, m, path))]:
            if time.perf_counter() - begin > MOST_SECONDS:
                record["left_out"].append(f"{m.name}: {name}")
                continue
            record["figures"] += measure()
            (options.output / "card.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"{record['card']}, {record['date']}, {record['commit']}: {options.output / 'card.json'}")
    return 0 if "failed" not in record["tests"] and "error" not in record["tests"] else 1


if __name__ == "__main__":
    sys.exit(main())
