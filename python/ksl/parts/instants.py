"""Which samples of motions become load cases: given times, peaks of joints, or those that keep most of what stresses a link."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import ArgumentError, unknown_name
from ksl.mechanism import given
from ksl.mechanism.requests import one_of, three_numbers
from ksl.mechanism.states import Array
from ksl.parts.free_body import COMPONENTS
from ksl.parts.hull import NOISE, extremes
from ksl.parts.sources import Moved

Instant = tuple[int, int]
"""The load case, by its number, and the sample."""
Section = tuple[Sequence[float], Sequence[float]] | Mapping[str, Any]
"""Point and normal of a plane section, in the link's frame, as :meth:`ksl.Model.section_wrench` takes them; or a mapping with these, its `share` and `beyond`, and
`factors` (k, 6): stresses of the section per N and N m of its loads."""
SECTION_KEYS = ("point", "normal", "share", "beyond", "factors")
Factors = ArrayLike | Mapping[str, ArrayLike]
"""(k, 6 × wrenches): stresses of a link per N and N m of its wrenches, in their order; or {name of the wrench: (k, 6)}."""


@dataclass
class Chosen:
    """Samples that are load cases, and why each is."""

    why: dict[Instant, list[tuple[str, str]]] = field(default_factory=dict)
    shares: dict[str, float] = field(default_factory=dict)
    """{what is stressed: the share kept}."""
    notes: list[str] = field(default_factory=list)

    def add(self, instant: Instant, *reason: tuple[str, str]) -> None:
        self.why.setdefault(instant, []).extend(reason)


def at_times(moved: Sequence[Moved], times: Iterable[float]) -> Chosen:
    """The samples next to given times, in each load case that lasts so long."""
    chosen = Chosen()
    for time in times:
        lasting = [i for i, m in enumerate(moved) if _slack(m.time[0]) >= m.time[0] - time and time - m.time[-1] <= _slack(m.time[-1])]
        if not lasting:
            spans = ", ".join(f"{m.case} lasts from {m.time[0]:g} s to {m.time[-1]:g} s" for m in moved)
            raise ArgumentError(f"times: no motion at {time:g} s; {spans}")
        for i in lasting:
            chosen.add((i, int(np.abs(moved[i].time - time).argmin())))
    return chosen


def _slack(time: float) -> float:
    return 1e-9 * max(1.0, abs(time))


def at_peaks(moved: Sequence[Moved], joints: Sequence[str]) -> Chosen:
    """Where each component of each joint is largest in magnitude, over all load cases; in the joint's axes, on the child."""
    chosen = Chosen()
    for joint in joints:
        rows = [m.bodies.reactions[:, m.bodies.joint_names.index(joint)] for m in moved]
        largest = max(float(np.abs(f).max()) for f in rows)
        quiet = []
        for i, component in enumerate(COMPONENTS):
            peaks = [float(np.abs(f[:, i]).max()) for f in rows]
            case = int(np.argmax(peaks))
            if peaks[case] <= NOISE * largest:
                quiet.append((joint, component))
            else:
                chosen.add((case, int(np.abs(rows[case][:, i]).argmax())), (joint, component))
        chosen.add(min(chosen.why, default=(0, 0)), *quiet)  # zero throughout: any sample has the largest
    return chosen


def of_hull(moved: Sequence[Moved], links: Sequence[str], most: int | None) -> Chosen:
    """Few samples that keep a share of whatever all wrenches of a link stress."""
    chosen = Chosen()
    for link in links:
        vectors = _vectors(moved, link)
        _keep(chosen, moved, link, np.concatenate([np.concatenate(list(of.values()), axis=1) for of in vectors]), most)
    return chosen


def of_stress(chosen: Chosen, moved: Sequence[Moved], stress: Mapping[str, Factors], most: int | None, axes: Mapping[str, Array]) -> None:
    """Adds few samples that keep a share of all combinations of the stresses (k) that factors give of a link's wrenches.

    axes: {link: (3, 3)}, the axes of its part in those of the link, by columns, of links whose factors are in the axes of a part.
    """
    for link, factors in stress.items():
        vectors = _vectors(moved, link)
        if link in axes:
            turn = np.kron(np.eye(2), axes[link])
            vectors = [{name: w @ turn for name, w in of.items()} for of in vectors]
        by_name = _factors(link, factors, vectors[0])
        rows = [
            sum((w @ by_name[name].T for name, w in of.items() if name in by_name), np.zeros((len(m.time), 1))) for m, of in zip(moved, vectors, strict=True)
        ]
        _keep(chosen, moved, f"stresses of {link}", np.concatenate(rows), most)


def of_sections(chosen: Chosen, moved: Sequence[Moved], sections: Iterable[tuple[str, Sequence[Section]]], most: int | None) -> None:
    """Adds few samples that keep a share of all combinations of the six loads of each section, or of its stresses."""
    for link, planes in sections:
        if isinstance(planes, (str, Mapping)) or not hasattr(planes, "__len__"):
            raise ArgumentError(f"sections of {link}: {planes!r}; expected a list of (point, normal), or of mappings")
        for k, plane in enumerate(planes, 1):
            what = f"section {k} of {link}" if len(planes) > 1 else f"the section of {link}"
            of = section_given(link, plane)
            factors = of.pop("factors", None)
            rows = np.concatenate([m.model.section_wrench(m.q, m.v, m.a, link, **of, external=dict(m.external) or None) for m in moved])  # type: ignore[attr-defined]
            if factors is not None:
                table = np.atleast_2d(given.numbers(factors, f"{what}: its factors"))
                if table.ndim != 2 or table.shape[1] != 6 or not np.isfinite(table).all():
                    raise ArgumentError(
                        f"{what}: its factors have shape {table.shape}; expected finite numbers (stresses, 6), of fx, fy, fz, tx, ty, tz in the link's axes about the point"
                    )
                rows = rows @ table.T
            _keep(chosen, moved, what, rows, most)


def section_given(link: str, plane: Section) -> dict[str, Any]:
    """Arguments of :meth:`ksl.Model.section_wrench`, and `factors` where they are given."""
    if not isinstance(plane, Mapping):
        if not hasattr(plane, "__len__") or len(plane) != 2:
            raise ArgumentError(f"sections of {link}: {plane!r}; expected (point, normal), or a mapping with some of {', '.join(SECTION_KEYS)}")
        plane = {"point": plane[0], "normal": plane[1]}
    for key in plane:
        one_of(key, f"sections of {link}: a section has key", *SECTION_KEYS)
    for key in ("point", "normal"):
        if key not in plane:
            raise ArgumentError(f"sections of {link}: a section without {key}; give point and normal, in the link's frame")
    return {**plane, **{key: three_numbers(plane[key], f"sections of {link}: the {key}") for key in ("point", "normal")}}


def _keep(chosen: Chosen, moved: Sequence[Moved], what: str, vectors: Array, most: int | None) -> None:
    """Adds the samples that keep most of vectors (samples of all cases, d)."""
    kept, share = extremes(vectors, most)
    starts = np.cumsum([0, *(len(m.time) for m in moved)])
    for k in kept:
        case = int(np.searchsorted(starts, k, side="right")) - 1
        chosen.add((case, int(k - starts[case])), (what, "extreme"))
    chosen.shares[what] = share
    if share == 0:
        mend = "ask for more cases, or for stresses of single sections"
        chosen.notes.append(f"{what}: {len(kept)} cases keep nothing for certain, since its loads have more dimensions; {mend}")
    elif share < 1 - 1e-9:
        few = f"{what}: {len(kept)} of {len(vectors)} samples keep {share:.2f} of whatever is linear in its loads"
        chosen.notes.append(f"{few}: a stress may be up to {1 / share:.3g} times what the cases show")


def _vectors(moved: Sequence[Moved], link: str) -> list[dict[str, Array]]:
    """For each load case {wrench: (n, 6)} of a link, the same wrenches in all: those that a case lacks are zero."""
    bodies = [m.bodies.body(link) for m in moved]
    names = list(dict.fromkeys((entry.kind, entry.name) for body in bodies for entry in body.entries))
    shown = {key: key[1] if [n for _, n in names].count(key[1]) == 1 else f"{key[0]} {key[1]}" for key in names}
    found = []
    for m, body in zip(moved, bodies, strict=True):
        own = {(entry.kind, entry.name): entry.wrench for entry in body.entries}
        found.append({shown[key]: own.get(key, np.zeros((len(m.time), 6))) for key in names})
    return found


def _factors(link: str, factors: Factors, wrenches: Mapping[str, Array]) -> dict[str, Array]:
    """{wrench: (k, 6)}."""
    if isinstance(factors, Mapping):
        for name in factors:
            if name not in wrenches:
                raise ArgumentError(unknown_name(f"stress of {link}", "wrench", name, wrenches))
        found = {name: np.atleast_2d(given.numbers(x, f"stress of {link} by {name}")) for name, x in factors.items()}
    else:
        table = np.atleast_2d(given.numbers(factors, f"stress of {link}"))
        if table.ndim != 2 or table.shape[1] != 6 * len(wrenches):
            raise ArgumentError(
                f"stress of {link} has shape {table.shape}; expected (stresses, {6 * len(wrenches)}): six factors for each of {', '.join(wrenches)}"
            )
        found = {name: table[:, 6 * i : 6 * i + 6] for i, name in enumerate(wrenches)}
    shapes = {x.shape for x in found.values()}
    if len(shapes) != 1 or not all(x.ndim == 2 and x.shape[1] == 6 and np.isfinite(x).all() for x in found.values()):
        raise ArgumentError(f"stress of {link}: expected finite factors (stresses, 6) for each wrench, found shapes {sorted(shapes)}")
    return found
