"""The charts of the report: which samples are drawn, and their data in the form that report.js reads."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ksl.mechanism.states import Array
from ksl.report.html.numbers import Clock, peak
from ksl.report.html.stills import Still, still_figure

COLOURS = {
    "axial": "structure", "radial": "structure-2", "force": "structure", "moment": "structure", "bending": "structure-2", "about axis": "structure",
    "drive": "drive", "power": "drive", "brake": "drive", "coupling": "drive", "external": "external",
    "position": "motion", "speed": "motion-2", "raw": "motion-2", "smoothed": "motion", "difference": "motion",
    "rate of energy": "broad", "residual": "motion", "energy": "motion", "− dissipation": "part-2",
    "transmitted": "part-1", "damping": "part-2", "friction": "part-3", "rotor": "part-4", "spring": "part-5",
}  # fmt: skip
"""The colour of each curve, by what it is.  They are those of the pictures: blue is what the structure carries, orange what the drive exerts,
green what acts from outside."""

Indices = NDArray[np.intp]
Limits = tuple[float, ...]

POINTS = 2000
"""Approximate number of points of a decimated curve."""
POINTS_OF_ALL = 12_000
"""Points of a curve times sections of joints: with more than 6 sections, curves have fewer points, so that the page stays below 8 MB."""
FEWEST_POINTS = 300
"""No curve is thinned to fewer: a chart on paper is about as many dots wide."""
STILL = 1e-6
"""A path that varies by no more than this, relative to its size, is drawn as a point."""


def decimate(*curves: Array, points: int = POINTS) -> Indices:
    """Sorted indices of samples to draw, about `points` of them, such that no extreme of any curve (n) is lost.

    Samples are split into buckets of equal count; of each, the smallest and the largest value of every curve stay, and
    the first and the last sample.  Curves that share an abscissa, or span a plane together, are decimated together.
    All indices if n ≤ points; at most points + 2 otherwise.  O(n).
    """
    n = len(curves[0])
    if n <= points:
        return np.arange(n)
    size = math.ceil(n / max(1, points // (2 * len(curves))))
    starts = np.arange(0, n, size)
    kept = [np.array([0, n - 1])]
    for x in curves:
        # the last bucket is padded with its last value; argmin and argmax return the first position of a value
        buckets = np.pad(x, (0, len(starts) * size - n), mode="edge").reshape(-1, size)
        kept += [starts + buckets.argmin(axis=1), starts + buckets.argmax(axis=1)]
    return np.unique(np.concatenate(kept))


def limits_in_sight(x: Array, lower: float | None, upper: float | None, reach: float) -> Limits:
    """The limits of two that are near enough to a curve (n) to be drawn with it.

    A limit is near where the curve, seen from the middle of the limits, comes to 1 / reach of the way to it.  Lines
    farther away would flatten the curve.
    """
    middle = 0.0 if lower is None or upper is None else (lower + upper) / 2
    near = []
    if lower is not None and (middle - float(np.min(x))) * reach >= middle - lower:
        near.append(lower)
    if upper is not None and (float(np.max(x)) - middle) * reach >= upper - middle:
        near.append(upper)
    return tuple(near)


@dataclass(frozen=True)
class Panel:
    """Curves that share an ordinate."""

    label: str
    curves: dict[str, Array]
    limits: Limits = ()
    """Where dashed lines are drawn: see `limits_in_sight`."""
    emphasis: bool = False
    """The first curve is drawn wide, so that others drawn over it leave it visible."""
    driven: str = ""
    """The curve that the drive exerts, where the others are what the structure carries."""
    colours: Sequence[str] = ()
    """The colours of the curves in their order, where names don't say them."""

    def packed(self, keep: Indices) -> dict[str, Any]:
        own = dict(zip(self.curves, self.colours))
        curves = [
            {"name": name, "color": own.get(name) or ("drive" if name == self.driven else COLOURS.get(name, "motion")), "data": _packed(x[keep])}
            for name, x in self.curves.items()
        ]
        return {"label": self.label, "curves": curves, "limits": self.limits, "emphasis": self.emphasis}


class Charts:
    """Makes the figures of a page, and collects beside them the data that the script draws into them."""

    def __init__(self, sections: int) -> None:
        """sections: of joints that will draw their curves: the more, the fewer points each curve has."""
        self._points = max(FEWEST_POINTS, min(POINTS, POINTS_OF_ALL // max(1, sections)))
        self.data: list[dict[str, Any]] = []
        self.stills: list[dict[str, Any]] = []

    def over_time(self, time: Array, title: str, panels: list[Panel], note: str = "") -> str:
        """Curves over time, one panel over the other, all at the same samples; `note` stands beside the title."""
        curves = [x for panel in panels for x in panel.curves.values()]
        keep = decimate(*curves, points=self._points * len(curves))
        return self._figure(title, note, {**_packed_time(time, keep), "panels": [panel.packed(keep) for panel in panels]})

    def path(self, time: Array, title: str, x: tuple[str, Array], y: tuple[str, Array], limits: tuple[Limits, Limits]) -> str:
        """One curve over another, each with its label: a path in their plane, with the limits of both."""
        keep = decimate(x[1], y[1], points=2 * self._points)
        if all(math.isfinite(peak(z)) and np.ptp(z) <= STILL * peak(z) for z in (x[1], y[1])):
            keep = keep[:1]  # a single point needs a marker, since a line would be invisible
        abscissa = {"label": x[0], "data": _packed(x[1][keep]), "limits": limits[0]}
        panel = Panel(y[0], {title: y[1]}, limits[1], driven=title)
        return self._figure(title, "", {**_packed_time(time, keep), "x": abscissa, "panels": [panel.packed(keep)]})

    def over(self, title: str, x: tuple[str, Array], panels: list[Panel], limits: Limits = ()) -> str:
        """Curves over another quantity, which increases, with its label: the position of a joint, say; one panel over the other."""
        keep = np.arange(len(x[1]))
        return self._figure(title, "", {"x": {"label": x[0], "data": _packed(x[1]), "limits": limits}, "panels": [panel.packed(keep) for panel in panels]})

    def still(self, still: Still, time: Array) -> str:
        """A picture."""
        self.stills.append(still.figure)
        return still_figure(still, len(self.stills) - 1, Clock.of(time).text(still.time))

    def _figure(self, title: str, note: str, chart: dict[str, Any]) -> str:
        self.data.append(chart)
        beside = f" <small>{note}</small>" if note else ""
        return f'<figure><figcaption>{title}{beside}</figcaption><div class="chart" data-chart="{len(self.data) - 1}"></div></figure>'


def _packed_time(time: Array, keep: Indices) -> dict[str, Any]:
    """Times since the first sample, since single precision can't represent seconds since 1970, and what the first one is shown as."""
    return {"start": float(time[0]) - Clock.of(time).origin, "time": _packed(time[keep] - time[0])}


def _packed(x: Array) -> str:
    """Single precision (7 digits), little-endian, in base 64: short, and quick to write and to read.

    What is too large for it becomes infinite, and as what isn't finite a gap in the curve.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return base64.b64encode(x.astype("<f4").tobytes()).decode("ascii")
