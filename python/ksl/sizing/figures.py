"""Figures of sizing: a number with its formula, source and inputs beside it, and how much of the limit it uses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

NEAR = 0.9
"""Utilisations from here on are near their limit."""


@dataclass(frozen=True)
class Formula:
    """What is computed, as text, and where it comes from: printed beside every figure."""

    text: str
    source: str


@dataclass(frozen=True)
class Figure:
    """One result for one component on one joint."""

    joint: str
    component: str
    """Name of the component in the components file."""
    kind: str
    """Kind of the component: motor, crossed roller bearing …"""
    figure: str
    value: float
    unit: str
    limit: float | None
    """What the catalogue allows, in the same unit; None where nothing is compared."""
    utilisation: float | None
    """1 is at the limit, more is beyond it; None where no limit was given, or where the figure is an intermediate result."""
    formula: str
    inputs: str
    source: str
    case: str
    """The governing load case; several, separated by commas, where the figure is one over the whole spectrum."""
    time: float | None
    """When in that case, s; None for means, lives and sums."""
    note: str = ""
    bound: str = ""
    """≤ where the limit is the largest value allowed, ≥ where it is the smallest; empty without a limit."""

    @property
    def verdict(self) -> Literal["over", "near", "within", ""]:
        """Whether the limit is exceeded, near (from 90 % on), or kept with a margin; empty where nothing is compared."""
        if self.utilisation is None:
            return ""
        return "over" if self.utilisation > 1 else "near" if self.utilisation >= NEAR else "within"


@dataclass(frozen=True)
class LeftOut:
    """A figure, or the comparison with its limit, that could not be made, and why."""

    joint: str
    component: str
    figure: str
    why: str

    def __str__(self) -> str:
        return f"{self.joint}: {self.component}: {self.figure} is left out: {self.why}"


def significant(x: float | None, digits: int = 4) -> str:
    """A number with some significant digits, without an exponent where it stays short: 0.0123, 12.35, 23500, 1.2e+09; – for none."""
    if x is None or x != x:
        return "–"
    if x in (float("inf"), float("-inf")):
        return "∞" if x > 0 else "−∞"
    text = f"{x:.{digits}g}"
    return f"{x:.0f}" if "e" in text and 1e4 <= abs(float(text)) < 1e7 else text
