"""What springs, dampers and cylinders between two points do along a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ksl.load_cases.load_case import LoadCase
from ksl.mechanism.mechanism import Mechanism
from ksl.mechanism.states import Array


@dataclass(frozen=True)
class ElementRange:
    """The extremes of one force element."""

    name: str
    length: tuple[float, float]
    """The least and the greatest, m."""
    tension: tuple[float, float]
    """N; negative where it pushes."""

    @property
    def text(self) -> str:
        least, most = self.tension
        return f"length {self.length[0]:.4g} to {self.length[1]:.4g} m, tension {least:.4g} to {most:.4g} N"


def act(model: Mechanism) -> bool:
    """Whether the model has force elements, and its physics name them."""
    return bool(model.force_elements) and "force elements" in model.physics


def element_ranges(case: LoadCase) -> list[ElementRange]:
    """The ranges of all that act, in the order of the model."""
    if not act(case.model):
        return []
    states = case.model.force_element_states(case.motion.q, case.motion.resolved_v)

    def extremes(x: Array) -> tuple[float, float]:
        return float(np.min(x)), float(np.max(x))

    return [ElementRange(e.name, extremes(states.length[..., i]), extremes(states.tension[..., i])) for i, e in enumerate(case.model.force_elements)]
