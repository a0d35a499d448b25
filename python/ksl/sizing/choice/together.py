"""The best of all combinations of entries, where they are few: joint by joint is not always the least together."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

from ksl.sizing.choice.judge import Choice, Judge, amount, order
from ksl.sizing.fatigue import ROUND_OFF

MOST = 2000
"""Combinations that are tried, at most: some milliseconds each."""


@dataclass(frozen=True)
class Together:
    """What a search over combinations has found."""

    names: tuple[str, ...]
    """The least combination that holds, an entry for each request; empty where none was looked for, or none was found."""
    total: float
    """The mass of this combination, kg, or its price."""
    joint_by_joint: float
    """The total of the choice joint by joint."""
    by: str
    tried: int
    complete: bool
    """Whether all combinations below the choice joint by joint were tried."""

    @property
    def is_better(self) -> bool:
        return bool(self.names) and self.total < self.joint_by_joint

    @property
    def sentence(self) -> str:
        """What is to be said beside the choice."""
        unit, word = (" kg", "lightest") if self.by == "mass" else ("", "cheapest")
        if not self.by:
            return "each joint has its own choice, some by mass and some by price: combinations were not compared"
        if self.is_better:
            return f"together, {' + '.join(self.names)} hold with {self.total:g}{unit} instead of {self.joint_by_joint:g}{unit}: joint by joint is not the least here"
        if not self.complete:
            return f"each joint has its own {word}; the first {self.tried} of the combinations with less were tried, and none holds; there are more"
        return (
            f"no combination with less holds: the choice joint by joint is the {word} together ({self.tried} tried)"
            if self.tried
            else f"no combination has less: the choice joint by joint is the {word} together"
        )


def best_together(judge: Judge, choice: Choice | None = None) -> Together | None:
    """The least combination that holds under its own loads, tried from the least on, up to the choice joint by joint, if there is one; None for a single request."""
    by: str = judge.requests[0].by
    if len(judge.requests) < 2:
        return None
    if any(request.by != by for request in judge.requests):
        return Together((), 0.0, 0.0, "", 0, False)
    whole = math.inf if choice is None else sum(amount(r, offer) for r, offer in zip(judge.requests, choice, strict=True))
    tried = 0
    for total, combination in _rising(judge):
        if total >= whole * (1 - ROUND_OFF):
            break
        if tried == MOST:
            return Together((), 0.0, whole, by, tried, False)
        tried += 1
        if judge.all_hold(combination):
            return Together(tuple(offer.name for offer in combination), total, whole, by, tried, True)
    return Together((), 0.0, whole, by, tried, True)


def _rising(judge: Judge) -> Iterator[tuple[float, Choice]]:
    """All combinations with their sums, the least first."""
    lists = [sorted(offers, key=partial(order, request)) for request, offers in zip(judge.requests, judge.offers, strict=True)]

    def sums(at: tuple[int, ...]) -> float:
        return sum(amount(r, offers[i]) for r, offers, i in zip(judge.requests, lists, at, strict=True))

    first = (0,) * len(lists)
    waiting, seen = [(sums(first), first)], {first}
    while waiting:
        total, at = heapq.heappop(waiting)
        yield total, tuple(offers[i] for offers, i in zip(lists, at, strict=True))
        for k, offers in enumerate(lists):
            following = (*at[:k], at[k] + 1, *at[k + 1 :])
            if following[k] < len(offers) and following not in seen:
                seen.add(following)
                heapq.heappush(waiting, (sums(following), following))
