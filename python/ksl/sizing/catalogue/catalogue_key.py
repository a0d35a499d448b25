"""What an entry of the components file is: a key of a kind of component."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

Shape = Literal["number", "count", "vector", "points", "curve", "word", "numbers by name", "table"]


@dataclass(frozen=True)
class Key:
    """One entry of a component."""

    name: str
    unit: str
    meaning: str
    example: str
    """As it would stand in the file."""
    shape: Shape = "number"
    sign: Literal["positive", "not negative", "any"] = "positive"
    default: float | str | list[float] | None = None
    choices: tuple[str, ...] = ()
    keys: tuple[Key, ...] = ()
    """The keys of tables inside of the component."""
    largest: float | None = None
    one_of: tuple[float, ...] = ()
    needed: bool = False
    """Whether nothing can be said of the component without it."""
    alternative: bool = False
    """Whether it, or other keys in its place, is needed: a circle of bolts, or points."""

    @property
    def essential(self) -> bool:
        """Whether a number that can't be is an error; otherwise it leaves out the figures that need it."""
        return self.needed or self.alternative or self.sign == "any" or bool(self.one_of)


@dataclass(frozen=True)
class ComponentKind:
    """A kind of component."""

    name: str
    meaning: str
    joints: Literal["turning", "sliding", "driven", "any"]
    """Which joints it can sit on: those that turn about one axis, those that slide along one, those with one coordinate, or all."""
    keys: tuple[Key, ...]
    by_name: dict[str, Key] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_name", {key.name: key for key in self.keys})
