"""The figures of results.json as Markdown tables, for the terminal and for docs/performance.md."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

Results = dict[str, Any]
OPERATIONS = {"rnea": "RNEA", "aba": "ABA", "crba": "CRBA", "fk": "FK"}
FURTHER = {
    "crba_upper": "CRBA, upper triangle",
    "crba_tree": "CRBA, elements of the tree",
    "mass_matrix_inverse": "M⁻¹",
    "coriolis_matrix": "Coriolis matrix",
    "inverse_dynamics_derivatives": "derivatives of inverse dynamics",
    "forward_dynamics_derivatives": "derivatives of forward dynamics",
    "centroidal_momentum_matrix": "centroidal momentum matrix",
    "center_of_mass_jacobian": "Jacobian of the centre of mass",
    "jacobian": "Jacobian of one frame",
    "frame_velocity": "velocity of one frame",
    "frame_acceleration": "acceleration of one frame",
    "inverse_dynamics_regressor": "regressor",
}
BESIDE = {"crba_upper": "crba", "crba_tree": "crba"}  # what other libraries have in its place
OURS, BY_GCC = "KSL, clang", "KSL, gcc"  # what users build where clang is there, and where it is not
PLOTS = {  # name of the file without the set: caption
    "time_over_bodies": "Time of one state and of one state in a batch, over the number of bodies",
    "states_per_second": "States per second over the size of a batch",
    "fraction_of_peak": "Share of the peak rate",
}


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table with aligned columns, which can be read unrendered."""
    lines = [list(head), *map(list, rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    text = ["| " + " | ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(line, widths))) + " |" for line in lines]
    text.insert(1, "|" + "|".join("-" * (w + 2) if i == 0 else "-" * (w + 1) + ":" for i, w in enumerate(widths)) + "|")
    return "\n".join(text)


def best(robot: Results, library: str, operation: str, batch: int = 0, single: int = 0, threads: int = 1) -> Results | None:
    """The fastest variant of a library, or of one peer."""
    wanted = [
        t
        for t in robot["times"]
        if library in (t["peer"], t["library"]) and (t["operation"], t["batch"], t["single"], t["threads"]) == (operation, batch, single, threads)
    ]
    return min(wanted, key=lambda t: t["median_ns"], default=None)


def ns(robot: Results, *which: Any) -> float | None:
    found = best(robot, *which)
    return found["median_ns"] if found else None


def cell(x: float | None, digits: int = 2) -> str:
    return "–" if x is None else f"{x:,.{digits}f}"


def over(a: float | None, b: float | None) -> float | None:
    return a / b if a and b else None


def way(rival: Results | None) -> str:
    """Which way of Pinocchio it is."""
    return f"{rival['peer'].removeprefix('Pinocchio, ')} {rival['variant'].removesuffix(' + update')}".strip() if rival else ""


def one_state(results: Results) -> str:
    rows = []
    for name, robot in results["robots"]["robots"].items():
        for operation, label in OPERATIONS.items():
            ours, by_gcc = ns(robot, OURS, operation), ns(robot, BY_GCC, operation)
            rival = best(robot, "Pinocchio", operation)
            others = [cell(over(ns(robot, library, operation), ours)) for library in ("Pinocchio", "Pinocchio wheel", "MuJoCo", "KDL")]
            spread = over(max(ours, by_gcc), min(ours, by_gcc)) if ours and by_gcc else None
            rows.append([f"{name} {label}", cell(ours, 0), cell(ns(robot, "Pinocchio", operation), 0), *others, cell(by_gcc, 0), cell(spread), way(rival)])
    ratios = ["× best Pinocchio", "× its wheel", "× MuJoCo", "× KDL"]
    return table(["one state", "KSL, ns", "best Pinocchio, ns", *ratios, "KSL by gcc, ns", "slower : faster", "best Pinocchio is"], rows)


def further(results: Results) -> str:
    """The other operations, one state and batches."""
    rows = []
    for operation, label in FURTHER.items():
        for name, robot in results["robots"]["robots"].items():
            theirs = BESIDE.get(operation, operation)
            ours, rival = ns(robot, OURS, operation), best(robot, "Pinocchio", theirs)
            if not ours or not rival:
                continue
            best_ns, (double, single) = rival["median_ns"], (ns(robot, OURS, operation, 1, s) for s in (0, 1))
            alone = [cell(ours, 0), cell(best_ns, 0), cell(over(best_ns, ours)), cell(over(ns(robot, "MuJoCo", theirs), ours))]
            rows.append([f"{label}, {name}", *alone, cell(double, 1), cell(over(best_ns, double)), cell(single, 1), way(rival)])
    batches = [f"batch of {results['robots']['many']}, ns", "× best Pinocchio, one state", "float, ns"]
    return table(["one state and batches", "KSL, ns", "best Pinocchio, ns", "× best Pinocchio", "× MuJoCo", *batches, "best Pinocchio is"], rows)


def reactions(results: Results) -> str:
    rows = []
    for name, robot in results["robots"]["robots"].items():
        for alone, both, label in (("rnea", "reactions", ""), ("inverse_dynamics_derivatives", "reactions_derivatives", ", derivatives")):
            times = [ns(robot, OURS, operation) for operation in (alone, both)]
            if all(times):
                rows.append([name + label, cell(times[0], 0), cell(times[1], 0), f"{100 * times[1] / times[0] - 100:.0f} %"])
    return table(["reactions beside inverse dynamics", "without, ns", "with reactions, ns", "more"], rows)


def kinds(results: Results) -> str:
    rows, robots = [], results["kinds"]["robots"]
    for operation, label in (OPERATIONS | FURTHER).items():
        row = [label]
        for is_batch in (0, 1):
            found = [best(robots[name], OURS, operation, is_batch) for name in ("kinds", "kinds_by_axes")]
            times = [time["minimum_ns"] if time else None for time in found]
            row += [cell(times[0], 1), cell(times[1], 1), cell(over(times[1], times[0]))]
        rows.append(row)
    columns = ["as such, ns", "as one-axis joints, ns", "faster", "batch, ns", "batch of one-axis joints, ns", "faster"]
    return table(["spherical, universal and cylindrical joints", *columns], rows)


def batch(results: Results) -> str:
    rows = []
    for name, robot in results["robots"]["robots"].items():
        limits = robot["limits"]
        for operation in ("rnea", "aba", "crba"):
            double, single = ns(robot, OURS, operation, 1), ns(robot, OURS, operation, 1, 1)
            flops = results.get("flops", {}).get(name, {}).get(operation)
            share = [over(over(flops, time), limits[peak] * 1e-9) for time, peak in ((double, "fused_double"), (single, "fused_float"))]
            percent = [f"{100 * s:.0f} %" if s else "–" for s in share]
            rival = cell(over(ns(robot, "Pinocchio", operation), double))
            rows.append([f"{name} {OPERATIONS[operation]}", cell(double, 1), rival, cell(single, 1), cell(over(double, single)), cell(flops, 0), *percent])
    many = results["robots"]["many"]
    head = [f"batch of {many}", "double, ns", "× best Pinocchio, one state", "float, ns", "float : double", "flops", "of peak, double", "of peak, float"]
    return table(head, rows)


def threads(results: Results) -> str:
    run, rows = results["threads"], []
    for name, robot in run["robots"].items():
        for operation in ("rnea", "aba"):
            times = [ns(robot, OURS, operation, 1, 0, n) for n in (1, 2)]
            if all(times):
                rows.append([f"{name} {OPERATIONS[operation]}", cell(times[0], 1), cell(times[1], 1), cell(over(*times))])
    return table([f"{run['many']} states", "one thread, ns", "two threads, ns", "faster"], rows)


def linearity(results: Results) -> str:
    robots, rows = results["scaling"]["robots"], []
    for name in ("chain8", "chain32", "chain128", "chain500", "chain1000"):
        if name not in robots:
            continue
        robot = robots[name]
        figures = [ns(robot, OURS, operation, is_batch) for operation in ("rnea", "aba") for is_batch in (0, 1)]
        rows.append([name, *(cell(over(x, robot["joints"]), 1) for x in figures), cell(robot["state_bytes"] / 1024, 1)])
    return table(["ns for each body", "RNEA, one state", "RNEA, batch", "ABA, one state", "ABA, batch", "kB for a state in flight"], rows)


def long_chains(results: Results) -> str:
    """Mass matrices, whose work grows with the square of a chain's length."""
    rows = []
    for name, robot in results["scaling"]["robots"].items():
        theirs = ns(robot, "Pinocchio", "crba")
        if name.startswith("chain") and theirs:
            times = [ns(robot, OURS, *which) for which in (("crba",), ("crba_upper",), ("crba", 1), ("crba_upper", 1))]
            rows.append([name, cell(theirs, 0), *(x for time in times for x in (cell(time, 0), cell(over(theirs, time))))])
    columns = [x for which in ("KSL", "upper triangle", "batch", "batch, upper") for x in (f"{which}, ns", "×")]
    return table(["CRBA of chains", "best Pinocchio, ns", *columns], rows)


def python_level(results: Results) -> str:
    rows = []
    for name, groups in results["python"].items():
        groups = {"": groups} if name.startswith("10^6") else groups
        for group, figures in groups.items():
            for what, figure in figures.items():
                label = f"{name}, {group}" if group else name
                rows.append([label, what, cell(figure["median_ns"], 1), cell(figure["minimum_ns"], 1)])
    return table(["from Python", "", "median, ns", "minimum, ns"], rows)


def loads(results: Results) -> str:
    rows = [[what, f"{x['median_s']:.2f}", f"{x['minimum_s']:.2f}", f"{x['memory_MB']:.0f}"] for what, x in results["loads"].items()]
    return table(["whole processes", "median, s", "least, s", "memory, MB"], rows)


def machine(results: Results) -> str:
    m, limits = results["machine"], results["robots"]["limits"]
    rate = {name: x * 1e-9 for name, x in limits.items()}
    peers = ", ".join(f"{name} {version}" for name, version in results["robots"]["peers"].items() if not name.startswith(("KSL", "Pinocchio, ")))
    pinocchio = results["robots"]["peers"].get("Pinocchio, gcc", "")
    return (
        f"### {results['robots']['instruction_set']}, {m['processor']}\n\n"
        f"{m['date']}; {m['cores']} cores, {m['system']}; {m['gcc']}; {m['clang']}; Python {m['python']}; Pinocchio {pinocchio}, {peers}.\n"
        f"Peak on one core: {rate['fused_double']:.1f} GFLOP/s double, {rate['fused_float']:.1f} float with fused multiply-adds; "
        f"{rate['unfused_double']:.1f} and {rate['unfused_float']:.1f} without; copying {rate['copy']:.1f} GB/s read and written."
    )


def everything(results: Results) -> str:
    """All tables of an instruction set for which there are figures.  Each names processor, set and day."""
    parts = {
        "robots": [one_state, batch, further, reactions],
        "kinds": [kinds],
        "threads": [threads],
        "scaling": [linearity, long_chains],
        "python": [python_level],
        "loads": [loads],
    }
    if "robots" not in results:
        return ""
    m = results["machine"]
    where = f"*{m['processor']}, {results['robots']['instruction_set']}, {m['date']}:*"
    written = [f"{where}\n\n{write(results)}" for part, writers in parts.items() if part in results for write in writers]
    return "\n\n".join([machine(results), *written])


def images(isa: str, docs: Path) -> str:
    """The plots of an instruction set that are there."""
    there = {f"images/{name}_{isa}.svg": caption for name, caption in PLOTS.items()}
    return "".join(f"\n\n![{caption}; {isa}]({path})" for path, caption in there.items() if (docs / path).exists())


def renew(page: Path, section: str, text: str) -> None:
    """Puts figures between the two marks of a section; all other sections stay as they are."""
    begin, end = f"<!-- figures: {section} -->", f"<!-- end of figures: {section} -->"
    old = page.read_text()
    between = re.compile(re.escape(begin) + ".*" + re.escape(end), re.S)
    if not between.search(old):
        raise SystemExit(f"{page} has no place for the figures of {section}: the lines {begin} and {end} are missing")
    page.write_text(between.sub(lambda _: f"{begin}\n\n{text}\n\n{end}", old))
