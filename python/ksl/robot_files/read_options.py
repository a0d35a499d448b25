"""How a robot file is read: the options of `ksl.load`, checked once and given whole to each reader."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from ksl.mechanism import given
from ksl.mechanism.payload import Payload, point_masses
from ksl.mechanism.requests import one_of, three_numbers

Mimic: TypeAlias = Literal["coupled", "independent"]
Payloads: TypeAlias = Mapping[str, tuple[float, Sequence[float]]]

_OfBuilder: TypeAlias = tuple[bool, list[float] | None, list[tuple[str, float, list[float]]], bool]
_OfCore: TypeAlias = tuple[bool, bool, bool, list[float] | None, list[tuple[str, float, list[float]]], bool, str, given.Physics, bool]


@dataclass(frozen=True)
class ReadOptions:
    """Options by their names and with their defaults in :func:`ksl.load`, which says what each means; and by the names that the readers, and C++, have
    (`ksl::load_options`, `ksl::model_options`).  Raises ValueError for a value that no file could be read by."""

    floating_base: bool = False
    mimic: Mimic = "coupled"
    strict: bool = False
    gravity: Sequence[float] | None = None
    payloads: Payloads | None = None
    masses: Literal["optional"] | None = None
    model: str | None = None
    physics: str | Iterable[str] | None = None
    friction_width: float = 0.01
    loops: str | os.PathLike[str] | None = None
    drives: given.Drives | None = None

    mimic_independent: bool = field(init=False)
    """Joints that mimic others have coordinates of their own."""
    masses_optional: bool = field(init=False)
    """A robot without masses is accepted."""
    cut_loops: bool = field(init=False)
    """Joints that close loops are left out."""
    beside: str | None = field(init=False)
    """The file of joints that close loops, beside the robot's."""
    points: list[tuple[str, float, list[float]]] = field(init=False)
    """Payloads, as :func:`ksl.mechanism.given.payload_points` returns them."""
    numbers_of_gravity: list[float] | None = field(init=False)
    physics_named: given.Physics = field(init=False)

    def __post_init__(self) -> None:
        cut = isinstance(self.loops, str) and self.loops == "cut"
        if cut and self.drives is not None:
            raise ValueError('drives are given, but loops="cut" leaves a tree, whose joints all have a motor; leave one of the two out')
        if self.masses is not None:
            one_of(self.masses, "masses", "optional")
        checked = {
            "beside": None if self.loops is None or cut else path_of_loops(self.loops),
            "mimic_independent": one_of(self.mimic, "mimic", "coupled", "independent") == "independent",
            "masses_optional": self.masses is not None,
            "cut_loops": cut,
            "numbers_of_gravity": None if self.gravity is None else list(three_numbers(self.gravity, "gravity")),
            "floating_base": given.flag(self.floating_base, "floating_base"),
            "strict": given.flag(self.strict, "strict"),
            "points": given.payload_points(self.payloads),
            "physics_named": given.physics(self.physics, self.friction_width),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)  # of a frozen class, while it is made

    @property
    def carried(self) -> tuple[Payload, ...]:
        return point_masses(self.points)

    def of_builder(self) -> _OfBuilder:
        """What builders take after `floating_base`, which readers in Python judge themselves."""
        return self.strict, self.numbers_of_gravity, self.points, self.masses_optional

    def of_core(self) -> _OfCore:
        """What the compiled reader takes after text and name."""
        return (
            self.floating_base,
            self.mimic_independent,
            self.strict,
            self.numbers_of_gravity,
            self.points,
            self.masses_optional,
            self.model or "",
            self.physics_named,
            self.cut_loops,
        )


def path_of_loops(loops: object) -> str:
    try:
        return os.fsdecode(loops)  # type: ignore[arg-type]
    except TypeError:
        raise ValueError(f'loops is {loops!r}; expected the path of a TOML file, or "cut"') from None
