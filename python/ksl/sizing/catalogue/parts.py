"""Components as they were read and checked, and what is to be chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from ksl.sizing.catalogue.catalogue_key import ComponentKind
from ksl.sizing.samples import Spectrum


@dataclass(frozen=True)
class Part:
    """A component with checked values: numbers are finite; those of the wrong sign are in `refused`, and why."""

    kind: ComponentKind
    name: str
    joints: tuple[str, ...]
    values: Mapping[str, Any]
    refused: Mapping[str, str] = field(default_factory=dict)
    """{key: sentence} of numbers that can't be used; keys of inner tables are dotted."""
    where: str = ""
    """File and line of its joints."""
    derived: Mapping[str, float] = field(default_factory=dict)
    """Numbers that follow from others, as those of a bolt from its name."""
    absent: Mapping[str, str] = field(default_factory=dict)
    """{key: sentence} of numbers that would follow if others were given."""

    def get(self, key: str) -> Any:
        """A value, or its default, or None."""
        table, _, name = key.rpartition(".")
        inside: Mapping[str, Any] = self.values.get(table, {}) if table else self.values
        known = {k.name: k for k in (self.kind.by_name[table].keys if table else self.kind.keys)}
        return None if key in self.refused else inside.get(name, self.derived.get(key, known[name].default))

    def why_absent(self, key: str) -> str:
        """Why there is no value."""
        return self.refused.get(key) or self.absent.get(key) or f"{key} is not given"


@dataclass(frozen=True)
class Request:
    """What is to be chosen from a catalogue for a joint."""

    joint: str
    kind: ComponentKind
    margin: float = 1.0
    """Every utilisation is at most its inverse."""
    by: Literal["mass", "price"] = "mass"
    link: str | None = None
    """Which link carries what is chosen; None: the ground does."""
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where on that link its mass is, from the link's origin in its axes, m."""
    values: Mapping[str, Any] = field(default_factory=dict)
    """Numbers of the place and not of the catalogue, as `gear_ratio` or `position`."""
    where: str = ""
    """File and line."""


@dataclass(frozen=True)
class Components:
    """A components file."""

    file: str
    parts: tuple[Part, ...]
    robot: str | None = None
    required_life_h: float | None = None
    reliability: float = 90.0
    edition: int = 2007
    spectrum: Spectrum = Spectrum()
    requests: tuple[Request, ...] = ()
    """What is to be chosen from a catalogue."""
    case_lines: Mapping[str, int | None] = field(default_factory=dict)
    stiffness: Mapping[str, Any] = field(default_factory=dict)
    """{joint: …} as a file of stiffnesses has it, of joints that no component is on."""
    stiffness_lines: Mapping[str, int | None] = field(default_factory=dict)
    left_out_spectrum: str = ""
    """Why the spectrum doesn't apply to the results at hand."""
