"""Gaps: times without samples in which joints move, so that nobody has seen what happens there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ksl.mechanism.mechanism import Joint
from ksl.mechanism.joint_kinds import columns_of, units_of
from ksl.mechanism.states import Array

GAP = 5.0
"""A step that is longer than this many median steps is a gap."""
MOVED = 0.05
"""A joint moves in a gap if its way there may be more than this share of its whole travel."""


def doubts_about_gaps(joints: tuple[Joint, ...], time: Array, q: Array) -> list[str]:
    """One sentence if there are gaps in which a joint moves; otherwise none.

    How far a joint moves in a gap is the difference of its positions on both sides, or its rate before or after the gap times the gap's duration,
    whichever is largest: a joint that is back at its place has moved, too.  time (n), q (n, nq), as given.
    """
    named = [(j, k, name, unit) for j in joints for k, (name, unit) in enumerate(zip(columns_of(j)[0], units_of(j)[0], strict=True))]
    return gaps_of(time, q[:, [j.q_index + k for j, k, _, _ in named]], [(name, f" {unit}" if j.nv == 1 or unit == "m" else "") for j, _, name, unit in named])


def gaps_of(time: Array, x: Array, columns: Sequence[tuple[str, str]], seen: Array | None = None) -> list[str]:
    """One sentence if there are gaps in which a column moves; otherwise none.

    time (n); x (n, c), a column for each of `columns`: its name, and what stands behind its numbers as a unit.
    seen: times at which others were recorded; gaps without any of them are those of the whole recording, and aren't told.
    """
    steps = np.diff(time)
    gaps = np.flatnonzero(steps > GAP * np.median(steps)) if len(steps) else steps
    if seen is not None and len(gaps):
        gaps = gaps[np.searchsorted(seen, time[gaps], "right") < np.searchsorted(seen, time[gaps + 1])]
    if not len(gaps):
        return []
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):  # numbers that are too large are refused later
        moved = np.abs(np.diff(x, axis=0))
        rate = moved / steps[:, None]
        beside = np.maximum(rate[np.maximum(gaps - 1, 0)], rate[np.minimum(gaps + 1, len(steps) - 1)])
        way = np.maximum(moved[gaps], beside * steps[gaps, None])
        travel = np.ptp(x, axis=0)
        moving = gaps[(way > MOVED * travel).any(axis=1)]
    if not len(moving):
        return []
    longest = moving[np.argmax(steps[moving])]
    at = int(np.flatnonzero(gaps == longest)[0])
    c = max(range(len(columns)), key=lambda c: way[at, c] / travel[c] if travel[c] > 0 else 0.0)
    name, unit = columns[c]
    often = f" ({len(moving)} such gaps, this is the longest)" if len(moving) > 1 else ""
    of_whom = "" if seen is None else f" of {name}"
    return [
        f"no samples{of_whom} between {time[longest]:.6g} s and {time[longest + 1]:.6g} s, {steps[longest] / np.median(steps):.3g} median steps{often}, while "
        f"{name if seen is None else 'it'} moves by {moved[longest, c]:.3g}{unit}: the motion there is not known, so peaks may be missing. Give these samples, or compute "
        "the parts beside them (--from, --to)"
    ]
