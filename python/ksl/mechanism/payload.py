"""A payload: a body on a link that is no part of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

Carried = tuple[str, float, Sequence[float], float]
"""A body on a link: the link, mass in kg, centre in the link's frame in m, and the sum of its principal moments about it, kg m², 0 for a point mass."""


@dataclass(frozen=True)
class Payload:
    """A body fixed to a link, which the model that has it carries already."""

    link: str
    mass: float
    """kg."""
    center: tuple[float, float, float]
    """The centre of mass, in the link's frame, m."""
    inertia: tuple[float, ...] | None = None
    """About the centre of mass, in the link's axes, kg m²: nine numbers, by rows; None for a point mass."""

    @property
    def carried(self) -> Carried:
        """As lengths are judged without it."""
        return self.link, self.mass, self.center, sum((self.inertia or (0.0,))[::4])

    def __str__(self) -> str:
        return f"{self.mass:g} kg on {self.link} at ({', '.join(f'{x:g}' for x in self.center)}) m"


def point_masses(points: Iterable[tuple[str, float, Sequence[float]]]) -> tuple[Payload, ...]:
    """The payloads of :func:`ksl.mechanism.given.payload_points`."""
    return tuple(Payload(link, mass, (x, y, z)) for link, mass, (x, y, z) in points)


def payload_of(link: str, body: tuple[float, Sequence[float], Sequence[float]]) -> Payload:
    """The payload of :func:`ksl.mechanism.given.mass`, on a link."""
    kilograms, (x, y, z), tensor = body
    return Payload(link, kilograms, (x, y, z), tuple(tensor) if any(tensor) else None)
