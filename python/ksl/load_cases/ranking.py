"""Which load cases matter most: whose curves are kept and shown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from ksl.load_cases.case_result import CaseResult
from ksl.load_cases.quantities import COMPARED
from ksl.load_cases.verdict import Verdict

LEVELS = ("green", "amber", "red")


def severity(result: CaseResult) -> tuple[int, float, float]:
    """By which load cases are compared: level and share of the worst use of a limit, and the largest effort."""
    worst = Verdict(tuple(result.uses)).worst
    effort = max((float(row.get(f"{what}_peak") or 0.0) for row in result.rows for what in ("effort", "brake")), default=0.0)
    return (LEVELS.index(worst.level), worst.share, effort) if worst else (0, 0.0, effort)


class Ranking:
    """Load cases by what they govern, while they are computed one after the other.

    The first is the one with the worst use of a limit.  Then come those that govern the most peaks: the largest ones of a quantity of
    a joint over all cases, and the first of equal ones.  Limits alone would not do: wrenches of bearings and flanges have none.
    """

    def __init__(self) -> None:
        self._severities: list[tuple[int, float, float]] = []
        self._largest: dict[tuple[str, str], tuple[float, int]] = {}

    def add(self, result: CaseResult, joints: Sequence[str]) -> None:
        """The next load case; joints: whose wrenches are wanted."""
        case = len(self._severities)
        self._severities.append(severity(result))
        for row in result.rows:
            joint = str(row["joint"])
            for quantity in COMPARED if joint in joints else ():
                peak = float(row.get(f"{quantity}_peak") or 0.0)
                if peak > self._largest.get((joint, quantity), (0.0, 0))[0]:
                    self._largest[joint, quantity] = peak, case

    def first(self, most: int, among: Sequence[int] | None = None) -> list[int]:
        """So many load cases at most, by their numbers, those that matter most first."""
        governed = Counter(case for _, case in self._largest.values())
        worst = self._severities.index(max(self._severities))
        numbers = range(len(self._severities)) if among is None else among
        return sorted(numbers, key=lambda i: (i == worst, governed[i], self._severities[i]), reverse=True)[:most]
