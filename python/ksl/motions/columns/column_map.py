"""Maps of columns: which column of a file is which of the motion, and how its numbers are converted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from ksl.base.errors import MotionError, close_names
from ksl.base.words import listed

JOINT = "joint:"


@dataclass(frozen=True)
class ColumnRule:
    """What a column of the file is: `to` = sign · scale · number + offset, in `unit`."""

    to: str
    unit: str = ""
    """The unit of the result, and so of the offset; empty for that of the motion (rad, m, s)."""
    sign: float = 1.0
    scale: float = 1.0
    offset: float = 0.0

    @property
    def factor(self) -> float:
        return self.sign * self.scale

    def words(self) -> str:
        factor = f"× {self.factor:g}" if self.factor != 1 else ""
        said = [x for x in (factor, f"{self.offset:+g}" if self.offset else "", f"in {self.unit}" if self.unit else "") if x]
        return self.to + (f" ({' '.join(said)})" if said else "")


@dataclass(frozen=True)
class ColumnMap:
    """Rules for columns of a file, columns that are left out, and joints that rest at a position."""

    file: str
    rules: Mapping[str, ColumnRule] = field(default_factory=dict)
    ignored: tuple[str, ...] = ()
    constants: Mapping[str, float] = field(default_factory=dict)
    rated: Mapping[str, float] = field(default_factory=dict)
    """The rated effort of joints whose efforts are in ‰ of it: N m or N."""
    doubts: tuple[str, ...] = ()
    """Why the map may be wrong, as `Motion.doubts` says it."""

    def of(self, joints: Iterable[str]) -> ColumnMap:
        """The map for a robot with these joints, where `joint:NAME` is NAME, as in other calls."""
        if any(name.startswith(JOINT) for name in joints):
            return self
        rules = {column: replace(rule, to=rule.to.removeprefix(JOINT)) for column, rule in self.rules.items()}
        constants, rated = ({name.removeprefix(JOINT): x for name, x in numbers.items()} for numbers in (self.constants, self.rated))
        return replace(self, rules=rules, constants=constants, rated=rated)


def absent(columns: ColumnMap, name: str, names: list[str], head: str) -> MotionError:
    """What to say of a column that the map names and the file doesn't have."""
    near, rule = close_names(name, names, 1), columns.rules.get(name)
    if rule is not None and rule.to in names:
        return MotionError(
            f"{columns.file}: column {name!r} is not in {head}, but {rule.to!r} is; a map says what a column is, not the other way round: {rule.to!r} = {name!r}"
        )
    hint = f"did you mean {near[0]!r}?" if near else f"its columns are {listed(names)}"
    return MotionError(f"{columns.file}: column {name!r} is not in {head}; {hint}")
