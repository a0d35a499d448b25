"""The verdict: shares of the limits that load cases use, the worst of them, and whether all is green.

Each joint with one coordinate uses shares of its limits; 1 is at the limit.

* position: |q − middle| / half of the range between the lower and the upper limit;
* speed and effort: the largest magnitude / the limit.

Red: a share is above 1.  Amber: a position above 0.95, a speed or an effort above 0.8; or a reason forbids green: a limit
that is not given, so that nothing could be compared; or doubts about the numbers themselves, such as noise of the motion.
Green: everything was compared, and holds with these margins.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np

from ksl.load_cases.joint_limits import limits_of
from ksl.load_cases.quantities import CONSTANT, SummaryRow, unit
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.joint_kinds import columns_of, units_of
from ksl.mechanism.states import Array

Level = Literal["green", "amber", "red"]
_WORSE: tuple[Level, ...] = ("green", "amber", "red")
"""Each is worse than those before it."""

AMBER = {"position": 0.95, "speed": 0.8, "effort": 0.8}
"""Shares of limits from which on they are amber.  Positions need no margin but that of the controller, which stops before the end stop."""
ROUND_OFF = 1e-9
"""A share is above 1 if it is by more than this: motions that end at a limit are not beyond it."""
NAMED = 4
"""So many joints or load cases are named in a sentence."""


def worst_level(levels: Iterable[Level]) -> Level | None:
    """The level of all together; None of none."""
    return max(levels, key=_WORSE.index, default=None)


@dataclass(frozen=True)
class Use:
    """The share of a limit that a joint uses in a load case."""

    case: str
    joint: str
    quantity: str
    """position, speed or effort."""
    column: str
    """The joint's name, and for joints with several coordinates the number of its position: j.x."""
    share: float
    value: float
    limit: float
    which: str
    """lower, upper, velocity or effort."""
    unit: str
    time: float | None
    """s; None where the load case is a single pose."""
    rests: bool = False
    """Whether the joint stands there throughout: a stop that it rests at needs no margin."""

    @property
    def level(self) -> Level:
        if self.share > 1 + ROUND_OFF:
            return "red"
        if self.rests:
            return "green"
        return "amber" if self.share > AMBER[self.quantity] else "green"

    @property
    def exceeded(self) -> str:
        """What is said of a limit that is exceeded."""
        number = self.column.removeprefix(f"{self.joint}.") if self.column != self.joint else self.quantity
        return f"{self.joint}: {number} {self.value:.4g} {self.unit} is beyond the {self.which} limit {self.limit:.4g} {self.unit}"

    def __str__(self) -> str:
        if self.quantity == "position":
            what = f"its position range ({self.value:.4g} {self.unit}, {self.which} limit {self.limit:.4g} {self.unit})"
        else:
            what = f"its {self.quantity} limit ({self.value:.4g} of {self.limit:.4g} {self.unit})"
        when = "" if self.time is None else f" at {self.time:.6g} s"
        when = ", where it rests" if self.rests and self.share > AMBER[self.quantity] else when
        return f"{self.column} uses {percent(self.share)} of {what}{when}"


@dataclass(frozen=True)
class Verdict:
    """What load cases use of the limits, and what forbids green."""

    uses: tuple[Use, ...]
    """Every limit that was compared, in every load case."""
    reasons: tuple[str, ...] = ()
    """Why green is forbidden though no limit is near, most important first."""

    def __repr__(self) -> str:
        """The colour and one sentence: the whole would fill a notebook."""
        return f"<ksl verdict {self.level}: {self.headline}{''.join(f'; not green: {reason}' for reason in self.reasons)}>"

    @property
    def level(self) -> Level:
        levels = {use.level for use in self.uses}
        return "red" if "red" in levels else "amber" if "amber" in levels or self.reasons else "green"

    @property
    def worst(self) -> Use | None:
        """The use of the worst level, and of these the one with the largest share; None if nothing was compared."""
        order = ("green", "amber", "red")
        return max(self.uses, key=lambda use: (order.index(use.level), use.share), default=None)

    @property
    def exceeded(self) -> tuple[Use, ...]:
        return tuple(use for use in self.uses if use.level == "red")

    @property
    def headline(self) -> str:
        """One sentence."""
        worst, exceeded = self.worst, {use.column for use in self.exceeded}
        if worst is None:
            return "no limit could be compared"
        of_case = f", case {worst.case}" if len({use.case for use in self.uses}) > 1 else ""
        others = f"; {len(exceeded)} joints exceed limits" if len(exceeded) > 1 else ""
        return f"{worst}{of_case}{others}"

    def of(self, joint: str) -> dict[str, Use]:
        """The largest use of each of a joint's limits over all load cases: {quantity: use}."""
        largest: dict[str, Use] = {}
        for use in self.uses:
            if use.joint == joint and (use.quantity not in largest or use.share > largest[use.quantity].share):
                largest[use.quantity] = use
        return largest

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        uses = [asdict(use) | {"level": use.level} for use in self.uses]
        return {"level": self.level, "headline": self.headline, "reasons": list(self.reasons), "uses": uses}


def percent(share: float) -> str:
    """One decimal, and never 100.0 % for a share that is beyond the limit."""
    x = 100 * share
    if 0 < x < 0.1:
        return "<0.1 %"
    if x >= 1000:
        return f"{x:,.0f} %"
    text = f"{x:.1f}"
    return f"{x:.6g} %" if text == "100.0" and share > 1 + ROUND_OFF else f"{text} %"


def uses_of(joint: Joint, row: SummaryRow, time: Array, q: Array) -> list[Use]:
    """What a load case uses of a joint's limits, from the joint's row of its summary; q (n, nq) for joints with several coordinates."""
    uses = _uses_of_one(joint, row) if joint.one_coordinate else _uses_of_several(joint, str(row.get("case", "")), time, q)
    return uses if len(time) > 1 else [replace(use, time=None) for use in uses]


def _uses_of_one(joint: Joint, row: SummaryRow) -> list[Use]:
    """The uses of the limits of a joint with one coordinate."""
    case = str(row.get("case", ""))
    limits = limits_of(joint)
    uses = []
    if "position_lowest" in row:
        ends = [(number(row, f"position_{end}"), number(row, f"position_{end}_time")) for end in ("lowest", "highest")]
        uses += _position(joint, case, joint.name, joint.unit, (limits.lower, limits.upper), ends)
    for quantity, limit, which in (("speed", limits.velocity, "velocity"), ("effort", limits.effort, "effort")):
        if limit is not None and f"{quantity}_peak" in row:
            value, at = number(row, f"{quantity}_peak"), number(row, f"{quantity}_peak_time")
            uses.append(Use(case, joint.name, quantity, joint.name, value / limit, value, limit, which, unit(quantity, joint), at))
    return uses


def number(row: SummaryRow, key: str) -> float:
    """A number that the row has."""
    return float(row[key] or 0.0)


def _uses_of_several(joint: Joint, case: str, time: Array, q: Array) -> list[Use]:
    """The uses of the limits of a joint with several coordinates, whose positions have limits one by one.  Quaternions have none."""
    uses = []
    for c, (column, of, bounds) in enumerate(zip(columns_of(joint)[0], units_of(joint)[0], joint.limits, strict=False)):
        x = q[:, joint.q_index + c]
        ends = [(float(x[k]), float(time[k])) for k in (int(np.argmin(x)), int(np.argmax(x)))]
        uses += _position(joint, case, column, of, bounds, ends)
    return uses


def _position(joint: Joint, case: str, column: str, of: str, bounds: tuple[float | None, float | None], ends: Sequence[tuple[float, float]]) -> list[Use]:
    """The larger share of the two ends of a range, and both where both are exceeded.

    ends: the lowest and the highest position, each with its time.  With one bound there is no range: the distance to it then counts
    in units of its size, or of 1 rad or m if that is larger.
    """
    lower, upper = bounds
    uses = []
    (least, _), (most, _) = ends
    rests = most - least <= CONSTANT * max(1.0, abs(most))
    for (value, at), limit, which, sign in zip(ends, (lower, upper), ("lower", "upper"), (-1, 1), strict=True):
        if limit is None:
            continue
        if lower is not None and upper is not None and upper > lower:
            share = sign * (value - (lower + upper) / 2) / ((upper - lower) / 2)
        else:
            share = 1 + sign * (value - limit) / max(abs(limit), 1.0)
        uses.append(Use(case, joint.name, "position", column, share, value, limit, which, of, at, rests))
    beyond = [use for use in uses if use.level == "red"]
    return beyond or sorted(uses, key=lambda use: use.share)[-1:]


def not_given(joints: Sequence[Joint], drives: Collection[str] | None = None) -> list[str]:
    """Reasons: limits that the file doesn't give, so that nothing can be compared with them.  Mimic joints have no drive, so no effort.

    drives: of a closed mechanism, whose other joints have no effort, and are not missed where they have no speed limit, either.
    """
    moving = [(j, limits_of(j)) for j in joints if j.one_coordinate and (drives is None or j.name in drives)]
    absent = {
        "effort": [j.name for j, l in moving if l.effort is None and j.leader is None],
        "velocity": [j.name for j, l in moving if l.velocity is None],
        "position": [j.name for j, l in moving if j.has_limits and l.lower is None and l.upper is None],
    }
    alike: dict[tuple[str, ...], list[str]] = {}
    for which, of in absent.items():
        if of:
            alike.setdefault(tuple(of), []).append(which)
    lines = []
    for names, whiches in alike.items():  # limits that are absent of the same joints share a sentence
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        whose = "any joint" if len(names) == len(moving) > 1 else ", ".join(names[:NAMED]) + more
        lines.append(f"no {' and '.join(whiches)} limit of {whose} in the robot's file (or 0): not compared")
    return lines
