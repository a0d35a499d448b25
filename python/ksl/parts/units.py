"""Units of a deck, and what a part is made of."""

from __future__ import annotations

from dataclasses import dataclass

from ksl.base.errors import PartError


@dataclass(frozen=True)
class Units:
    """What one SI unit is in the deck; the second stays."""

    name: str
    length: float
    mass: float

    @property
    def force(self) -> float:
        return self.mass * self.length

    @property
    def moment(self) -> float:
        return self.force * self.length

    @property
    def density(self) -> float:
        return self.mass / self.length**3

    @property
    def stress(self) -> float:
        return self.force / self.length**2

    @property
    def text(self) -> str:
        return "m, kg, s, N, N m, Pa, kg/m³" if self.length == 1 else "mm, t, s, N, N mm, MPa, t/mm³"


SYSTEMS = {"m-kg-s": Units("m-kg-s", 1.0, 1.0), "mm-t-s": Units("mm-t-s", 1e3, 1e-3)}
"""Systems of units by their names."""


@dataclass(frozen=True)
class Material:
    """Isotropic; SI units."""

    young: float = 2.1e11
    """Pa."""
    poisson: float = 0.3
    density: float | None = None
    """kg/m³; None: the mass of the link over the volume of the mesh."""

    def checked(self) -> Material:
        """Raises PartError unless a solid can be made of it."""
        if not 0 < self.young < float("inf"):
            raise PartError(f"young={self.young!r}; expected Young's modulus in Pa, as 2.1e11 of steel")
        if not -1 < self.poisson < 0.5:
            raise PartError(f"poisson={self.poisson!r}; expected Poisson's ratio, above −1 and below 0.5")
        if self.density is not None and not 0 < self.density < float("inf"):
            raise PartError(f"density={self.density!r}; expected kg/m³, as 7850 of steel")
        if self.young < 1e7:
            raise PartError(f"young={self.young:g} Pa is less than rubber has; is it in MPa? give it in Pa, as 2.1e11 of steel, whatever the units of the deck")
        if self.density is not None and self.density < 1e-3:
            raise PartError(
                f"density={self.density:g} kg/m³ is that of no solid; is it in t/mm³? give it in kg/m³, as 7850 of steel, whatever the units of the deck"
            )
        return self
