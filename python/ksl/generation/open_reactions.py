"""Reactions of closed mechanisms that rigid bodies leave open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import ArgumentError

if TYPE_CHECKING:
    from ksl.model.model import Model

Undetermined = Literal["refuse", "least-norm"]
COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
POSITIONS = 3
"""Positions in which reactions are judged: in a singular one more of them are open than in the others."""
NAMED = 4
"""Joints that a message names."""


def refuse_open(model: Model, where: str, fewer: str, joints: Sequence[str], has_values: bool = True) -> None:
    """Raises ArgumentError for joints with components that are open in each of some closed positions.

    where: the argument; fewer: how to ask for some joints; has_values: are there values of least norm for them."""
    if not model.loops:
        return
    unique = np.any([model.reactions_unique(closed_position(model, np.random.default_rng(k + 1)), joints) for k in range(POSITIONS)], axis=0)
    named = [
        f"{', '.join(name for name, known in zip(COMPONENTS, of, strict=True) if not known)} of {joint}"
        for joint, of in zip(joints, unique, strict=True)
        if not of.all()
    ]
    if named:
        more = f"; and {len(named) - NAMED} joints more" if len(named) > NAMED else ""
        values = ', or for the values of least norm, undetermined="least-norm" (--undetermined least-norm)' if has_values else ""
        raise ArgumentError(
            f"{where}: not determined by rigid bodies: {'; '.join(named[:NAMED])}{more}; ask for joints all of whose components are, {fewer}{values}"
        )


def closed_position(model: Model, rng: np.random.Generator) -> NDArray[np.floating[Any]]:
    """One near the neutral position; the neutral one, closed, where none is found."""
    start = model.close(model.neutral())
    for size in np.geomspace(0.3, 1e-3, 20):
        found = model.close(model.integrate(start.q, rng.normal(size=model.nv) * size))
        if found.converged:
            return np.asarray(found.q)
    return np.asarray(start.q)
