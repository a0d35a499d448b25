"""Chooses components from a catalogue, round after round, until the masses of what is chosen change nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

from ksl.base.errors import SizingError
from ksl.sizing.choice.judge import Choice, Judge, Verdict, amount
from ksl.sizing.choice.loads_with_masses import LoadsWithMasses
from ksl.sizing.choice.offers import Catalogue, Offer
from ksl.sizing.choice.robot_of_results import cases_of
from ksl.sizing.choice.selection import Chosen, Selection
from ksl.sizing.choice.together import best_together
from ksl.sizing.figures import significant
from ksl.sizing.utilisation.figures_of_parts import GEARS, check_joints, check_kind, demands_of, gears_of
from ksl.sizing.catalogue.parts import Components
from ksl.sizing.results import Results
from ksl.sizing.samples import JointSamples


def choice_from(
    catalogue: Catalogue, results: Any, table: Results, parts: Components | None, samples: Callable[[str], JointSamples]
) -> tuple[Selection, Components, Callable[[str], JointSamples]]:
    """What is chosen, the components with it, and the loads with its masses.  results: as `ksl.size` was given them.  Raises SizingError."""
    if parts is None or not parts.requests:
        file = parts.file if parts else "components"
        raise SizingError(f"{file}: nothing is to be chosen from {catalogue.file}; write a table [[choose]] with joint and kind for each choice")
    requests = tuple(replace(r, joint=table.named(r.joint, r.where)) for r in parts.requests)
    for request in requests:
        check_kind(table, request.kind, request.joint, request.where)
    loads = LoadsWithMasses(samples, requests, lambda: cases_of(results, table))
    selection = choose(Judge(loads, catalogue, demands_of(parts), gears_of(parts.parts), table.of_sweep))
    parts = replace(parts, parts=(*parts.parts, *selection.parts))
    check_joints(table, parts.parts)
    notes = [
        *loads.notes,
        *(["what is chosen holds in each case of the sweep by itself; the figures are those of all of them, one after the other"] if table.of_sweep else []),
    ]
    return replace(selection, said=tuple(notes)), parts, cache(lambda joint: loads.samples(joint, selection.masses))


def choose(judge: Judge) -> Selection:
    """Joint by joint: of the entries that hold, the least.  Round 1 is under the loads without what is chosen, each later one under those of the last choice.

    Where choices go round in circles, each joint gets the heaviest of its circle.  Raises SizingError where none holds on a joint, with the nearest.
    """
    found: list[Choice] = []
    while True:
        choice = _round(judge, found[-1] if found else None)
        if choice in found:
            break
        found.append(choice)
    settled = choice == found[-1]
    if not settled:  # a circle from its first occurrence on
        circle = found[found.index(choice) :]
        choice = tuple(max((c[k] for c in circle), key=lambda offer: (offer.mass, offer.name)) for k in range(len(judge.requests)))
    masses, gears = judge.masses(choice), judge.chosen_gears(choice)
    chosen = tuple(_chosen(judge, k, offer, judge.verdicts(k, masses, gears)) for k, offer in enumerate(choice))
    parts = tuple(judge.catalogue.part(offer, request) for offer, request in zip(choice, judge.requests, strict=True))
    return Selection(chosen, len(found) + 1, settled, parts, masses, best_together(judge, choice))


def _round(judge: Judge, last: Choice | None) -> Choice:
    """Gears first: a motor without a ratio of its own has that of the gear on its joint."""
    masses = judge.masses(last)
    choice: list[Offer | None] = [None] * len(judge.requests)
    for k in sorted(range(len(judge.requests)), key=lambda k: judge.requests[k].kind.name not in GEARS):
        verdicts = judge.verdicts(k, masses, judge.chosen_gears(choice))
        first = next((v for v in verdicts if v.holds), None)
        if first is None:
            raise _none_holds(judge, k, verdicts)
        choice[k] = first.offer
    return tuple(offer for offer in choice if offer is not None)


def _none_holds(judge: Judge, k: int, verdicts: list[Verdict]) -> SizingError:
    request = judge.requests[k]
    nearest = min(verdicts, key=lambda v: v.beyond)
    if not nearest.figure:
        said = f"none of them has a figure that could be compared; of {nearest.offer.name}: {nearest.lacks}"
    else:
        asked = f"at most {significant(1 / request.margin, 3)}" + (f" with the margin {request.margin:g}" if request.margin != 1 else "")
        said = f"the nearest is {nearest.offer.name}, whose {nearest.figure} has the utilisation {significant(nearest.utilisation, 3)}; asked is {asked}"
    together = best_together(judge) if nearest.figure else None
    hint = f"; with the masses of another choice these hold together: {' + '.join(together.names)}" if together and together.names else ""
    return SizingError(f"{request.where}: {request.joint}: no {request.kind.name} of {judge.catalogue.file} holds: {said}{hint}")


def _chosen(judge: Judge, k: int, offer: Offer, verdicts: list[Verdict]) -> Chosen:
    request = judge.requests[k]
    own = next(v for v in verdicts if v.offer is offer)
    less = [v for v in verdicts if amount(request, v.offer) < amount(request, offer)]
    holds = [v for v in verdicts if v.holds]
    unjudged = sorted(frozenset().union(*(v.compared for v in verdicts)) - own.compared)
    front = [v for v in holds if not any(o.offer.mass < v.offer.mass and o.utilisation < v.utilisation for o in holds)]
    return Chosen(
        request.joint, request.kind.name, offer.name, offer.mass, offer.price, offer.size, own.utilisation, own.figure, own.holds, request.margin, request.by,
        {v.offer.name: (v.figure, v.utilisation) for v in less}, tuple(v.offer.name for v in holds), tuple(v.offer.name for v in front), request.link, request.at,
        tuple(unjudged),
    )  # fmt: skip
