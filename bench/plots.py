"""Draws the plots of docs/performance.md for an instruction set from results.json: plots.py RESULTS SET OUTPUT_DIR."""

import io
import json
import re
import sys
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

import tables

Results = dict[str, Any]
plt.rcParams |= {
    "svg.hashsalt": "ksl",
    "svg.fonttype": "none",
    "font.size": 9,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
}
COLOURS = {tables.OURS: "tab:blue", "Pinocchio": "tab:orange"}


def over_bodies(results: Results) -> plt.Figure:
    """Time over bodies: one state and batch, chains and trees."""
    figure, axes = plt.subplots(1, 3, figsize=(9.5, 3.5), sharey=True, layout="constrained")
    robots = results["scaling"]["robots"]
    for axis, operation in zip(axes, ("rnea", "aba", "crba")):
        for shape, marker in (("chain", "o"), ("tree", "^")):
            some = {r["joints"]: r for name, r in robots.items() if name.startswith(shape)}
            for peer, batch, style in (("Pinocchio", 0, "-"), (tables.OURS, 0, "-"), (tables.OURS, 1, "--")):
                points = [(n, tables.ns(r, peer, operation, batch)) for n, r in sorted(some.items())]
                xy = [(n, t) for n, t in points if t]
                name = {"Pinocchio": "best Pinocchio", tables.OURS: "KSL, batch" if batch else "KSL"}[peer]
                axis.loglog(*zip(*xy), style, marker=marker, ms=3.5, color=COLOURS[peer], label=f"{name}, {shape}s")
        axis.set(title=tables.OPERATIONS[operation], xlabel="bodies")
    axes[0].set_ylabel("ns a state")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncol=6, fontsize=7)
    return figure


def over_batch(results: Results) -> plt.Figure:
    """States per second over batch size, by precision and threads."""
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.2))
    for axis, robot in zip(axes, ("ur5", "talos")):
        for single, threads, style in ((0, 1, "o-"), (1, 1, "^-"), (0, 2, "o--"), (1, 2, "^--")):
            points = [(int(n), tables.ns(run[robot], tables.OURS, "rnea", 1, single, threads)) for n, run in results["sizes"].items()]
            xy = [(n, 1e3 / t) for n, t in points if t]
            if xy:
                label = f"{'float' if single else 'double'}, {threads} thread{'s' if threads > 1 else ''}"
                axis.semilogx(*zip(*xy), style, ms=3.5, color="tab:green" if single else "tab:blue", label=label)
        axis.set(title=f"RNEA, {robot}", xlabel="states in a batch", ylim=(0, None))
    axes[0].set_ylabel("million states per second")
    axes[0].legend(fontsize=7)
    return figure


def of_peak(results: Results) -> plt.Figure:
    """Share of the peak rate of multiply-adds, batches on one core."""
    figure, axis = plt.subplots(figsize=(8, 3))
    robots = results["robots"]["robots"]
    bars = [(operation, single) for operation in ("rnea", "aba", "crba") for single in (0, 1)]
    for k, (operation, single) in enumerate(bars):
        peak = "fused_float" if single else "fused_double"
        rates = [results["flops"][name][operation] / tables.ns(robot, tables.OURS, operation, 1, single) for name, robot in robots.items()]
        shares = [100e9 * rate / robot["limits"][peak] for rate, robot in zip(rates, robots.values())]
        label = f"{tables.OPERATIONS[operation]}, {'float' if single else 'double'}"
        axis.bar([i + (k - 2.5) * 0.13 for i in range(len(shares))], shares, 0.12, label=label, color=f"C{k // 2}", alpha=0.55 if single else 1)
    axis.set(xticks=range(len(robots)), xticklabels=list(robots), ylabel="% of peak", ylim=(0, 100))
    axis.legend(fontsize=7, ncol=3)
    return figure


def compact(svg: str) -> str:
    """The same picture with a line for each of its axes, as nobody reads coordinates: two decimals of a point, no blanks between elements."""
    svg = re.sub(r"<!DOCTYPE[^>]*>|<metadata>.*?</metadata>|<!--.*?-->", "", svg, flags=re.S)
    svg = re.sub(r"\s*\n\s*", " ", svg).replace("> <", "><")
    svg = re.sub(r"-?[1-9]\d*\.\d{3,}", lambda number: f"{float(number[0]):.2f}".rstrip("0").rstrip("."), svg)  # scales below 1 stay
    return svg.replace('<g id="axes', '\n<g id="axes') + "\n"


def main(results: str, isa: str, output: str) -> None:
    figures = json.loads(Path(results).read_text())[isa]
    Path(output).mkdir(parents=True, exist_ok=True)
    needs = {"time_over_bodies": (over_bodies, "scaling"), "states_per_second": (over_batch, "sizes"), "fraction_of_peak": (of_peak, "flops")}
    for name, (draw, part) in needs.items():
        if part in figures:
            drawn = io.StringIO()
            draw(figures).savefig(drawn, format="svg", bbox_inches="tight", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
            (Path(output) / f"{name}_{isa}.svg").write_text(compact(drawn.getvalue()), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
