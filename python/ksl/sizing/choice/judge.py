"""Which entries of a catalogue hold on a joint under its loads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ksl.sizing.choice.loads_with_masses import LoadsWithMasses
from ksl.sizing.choice.offers import Catalogue, Offer
from ksl.sizing.utilisation.figures_of_parts import GEARS, sheet_of
from ksl.sizing.catalogue.parts import Part, Request
from ksl.sizing.utilisation.sheet import Demands, Sheet

SAID = {"peak speed": "speed"}
"""Figures that are called otherwise where entries are compared."""


@dataclass(frozen=True)
class Verdict:
    """How much of its limits an entry uses: the worst figure."""

    offer: Offer
    figure: str
    """Empty where nothing could be compared: then it doesn't hold."""
    utilisation: float
    margin: float
    lacks: str = ""
    """Why nothing could be compared."""
    compared: frozenset[str] = frozenset()
    """All figures that were."""

    @property
    def holds(self) -> bool:
        return bool(self.figure) and self.utilisation * self.margin <= 1.0

    @property
    def beyond(self) -> float:
        """What counts as near: the utilisation; infinite where nothing could be compared."""
        return self.utilisation if self.figure else float("inf")


Choice = tuple[Offer, ...]
"""An entry for each request, in their order."""


class Judge:
    """Judges entries of a catalogue under loads with masses.

    gears: those of the components file, by joint.  of_sweep: cases are no parts of one cycle, and an entry has to hold in each by itself.
    """

    def __init__(self, loads: LoadsWithMasses, catalogue: Catalogue, demands: Demands, gears: Mapping[str, Part], of_sweep: bool = False) -> None:
        self.loads, self.catalogue, self._demands, self._gears, self._of_sweep = loads, catalogue, demands, gears, of_sweep
        self.requests = loads.requests
        self.offers = [catalogue.of(request) for request in self.requests]
        self._known: dict[tuple[int, str, str, tuple[float, ...]], Verdict] = {}

    def masses(self, choice: Choice | None) -> tuple[float, ...]:
        """The mass at the place of each request."""
        return tuple(0.0 if choice is None or r.link is None else choice[k].mass for k, r in enumerate(self.requests))

    def verdict(self, k: int, offer: Offer, masses: tuple[float, ...], gears: Mapping[str, Part]) -> Verdict:
        """How an entry does for request k.  gears: those that are chosen, by joint."""
        request = self.requests[k]
        gear = gears.get(request.joint, self._gears.get(request.joint))
        key = (k, offer.name, gear.name if gear else "", masses)
        if key not in self._known:
            part, samples = self.catalogue.part(offer, request), self.loads.samples(request.joint, masses)
            sheets = [sheet_of(part, s, self._demands, gear)[0] for s in (samples.each_alone() if self._of_sweep else [samples])]
            compared = [(f.utilisation, f.figure) for sheet in sheets for f in sheet.figures if f.utilisation is not None]
            worst, figure = max(compared, key=lambda pair: pair[0], default=(0.0, ""))
            names = frozenset(SAID.get(name, name) for _, name in compared)
            self._known[key] = Verdict(offer, SAID.get(figure, figure), worst, request.margin, "" if figure else _lacks(sheets), names)
        return self._known[key]

    def verdicts(self, k: int, masses: tuple[float, ...], gears: Mapping[str, Part]) -> list[Verdict]:
        """How all entries do for request k, the least first: by mass or price, then mass, then name."""
        return [self.verdict(k, offer, masses, gears) for offer in sorted(self.offers[k], key=lambda offer: order(self.requests[k], offer))]

    def chosen_gears(self, choice: Sequence[Offer | None]) -> dict[str, Part]:
        """The gears among entries, by joint."""
        chosen = [(r, offer) for r, offer in zip(self.requests, choice, strict=True) if offer is not None and r.kind.name in GEARS]
        return {r.joint: self.catalogue.part(offer, r) for r, offer in chosen}

    def all_hold(self, choice: Choice) -> bool:
        """Whether a choice holds on all joints under the loads that it makes itself."""
        masses, gears = self.masses(choice), self.chosen_gears(choice)
        return all(self.verdict(k, offer, masses, gears).holds for k, offer in enumerate(choice))


def _lacks(sheets: Sequence[Sheet]) -> str:
    return "; ".join(dict.fromkeys(x.why for sheet in sheets for x in sheet.left_out)) or "it has no limits"


def order(request: Request, offer: Offer) -> tuple[float, float, str]:
    """What is chosen first: the lightest or the cheapest; of equal ones the lighter, then the first by name."""
    return amount(request, offer), offer.mass, offer.name


def amount(request: Request, offer: Offer) -> float:
    """The mass, kg, or the price of an entry, whichever counts."""
    return offer.mass if request.by == "mass" or offer.price is None else offer.price
