"""A robot that a sweep is given as a model, and not as a file: as workers and the folder of results have it."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, field
from typing import Any

from ksl.base.errors import SweepError
from ksl.model.model import Model, sealed
from ksl.model.surgery import under_gravity

OF_FILES = ("floating_base", "mimic", "strict", "model", "loops", "xacro", "packages")
"""Keys of [base] that say how a file is read."""


@dataclass(frozen=True)
class GivenModel:
    """A model with all that it is made of, whatever becomes of its file."""

    name: str
    sha256: str
    """The SHA-256 of all that it is made of."""
    contents: bytes = field(repr=False)
    """The model's pickle."""

    @classmethod
    def of(cls, model: Model) -> GivenModel:
        return cls(model.name, *sealed(model))

    def model(self, base: dict[str, Any], file: str) -> Model:
        """The model, with gravity and physics that a sweep has in [base].  Raises SweepError for what only a file can be told."""
        given = next((key for key in OF_FILES if key in base), None)
        if given is not None:
            raise SweepError(
                f"{file}: [base] {given}: the robot is a ksl.Model, which has been loaded already; give {given} to ksl.load, or the robot as a file"
            )
        model: Model = pickle.loads(self.contents)
        if "drives" in base:
            model = model.with_drives(base["drives"])
        if "gravity" in base:
            model = under_gravity(model, base["gravity"])
        if "physics" in base or "friction_width" in base:
            model = model.with_physics(base.get("physics", model.physics), base.get("friction_width", model.friction_width))
        return model
