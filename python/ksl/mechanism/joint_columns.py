"""Names of the numbers of q, v, a and tau, and tables whose columns have these names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ksl.base.errors import near_names

TIME = ("time", "t")
"""Columns that tables of motions have besides."""
ROLES = {"q": 0, "q0": 0, "q1": 0, "v": 1, "a": 2, "tau": 3}
"""Arguments of calls, and which of the names of a joint's numbers theirs are."""
LISTED = 12
"""Names in a message; of more it says how many there are."""


class Endings(NamedTuple):
    """What tables call the numbers of a kind of joint behind the joint's name: ".x", ".v"; "" where that says it."""

    position: tuple[str, ...]
    velocity: tuple[str, ...]
    acceleration: tuple[str, ...]
    effort: tuple[str, ...]


class KindNames(Protocol):
    """A kind of joint, as far as tables need it: "x", "v", and "" where the joint's name says it."""

    @property
    def position(self) -> tuple[str, ...]: ...
    @property
    def velocity(self) -> tuple[str, ...]: ...
    @property
    def acceleration(self) -> tuple[str, ...]: ...
    @property
    def effort(self) -> tuple[str, ...]: ...


def endings_of(kind: KindNames) -> Endings:
    """For each kind once: compiled rows would make their tuples anew each time."""
    groups = (kind.position, kind.velocity, kind.acceleration, kind.effort)
    return Endings(*(tuple(f".{word}" if word else "" for word in group) for group in groups))


def column_names(x: Any) -> list[str] | None:
    """Names of the columns of a table: pandas, polars, pyarrow, a structured array, a mapping; of the numbers of a pandas.Series.

    None for whatever has no names, and where they are numbers, as those of pandas are by default: such tables are arrays.
    """
    found: Any
    if type(x) is np.ndarray or isinstance(x, (list, tuple, str, bytes)):
        found = x.dtype.names if isinstance(x, np.ndarray) else None
    elif isinstance(x, Mapping):
        found = x.keys()
    else:
        found = next((names for names in (getattr(x, each, None) for each in ("column_names", "columns", "index")) if names is not None), None)
    if not isinstance(found, Iterable):
        return None
    names = list(found)
    return names if any(isinstance(name, str) for name in names) else None


def by_name(x: Any, names: Sequence[str], what: str, joints: Sequence[tuple[str, Endings]]) -> NDArray[Any]:
    """The numbers (…, n) of an argument `what`, from a table with these column names; joints: names, and endings of their kinds, in the order of q.

    Positions have the names of joints with one coordinate, and JOINT.x … as in the columns of motions; velocities and accelerations
    JOINT.v, JOINT.a, or else the names of the joints.  A table of a whole motion serves for q, v and a.
    """
    role = ROLES.get(what, 3)
    wanted = [joint + ending for joint, endings in joints for ending in endings[role]]
    if not set(wanted) & set(names):  # plain names of joints, also for their rates
        same = [(joint, endings[0] if len(endings[0]) == len(endings[role]) else endings[role]) for joint, endings in joints]
        plain = [joint + ending for joint, own in same for ending in own]
        wanted = plain if set(plain) & set(names) else wanted
    place = f"{what}: columns are taken by name"
    times, taken = Counter(names), set(wanted)
    missing = [name for name in wanted if name not in times]
    if missing:
        others = [name for name in names if name not in taken]
        near = next(filter(None, (near_names(name, others) for name in missing[:LISTED])), "")
        raise ValueError(f"{place}, and there is none for {_listed(missing)}; {near}columns: {_listed(names)}; .to_numpy() takes them by place")
    known = {joint + ending for joint, endings in joints for group in endings for ending in group}.union(TIME)
    for name in names:
        if name not in known and str(name).lower() not in TIME:
            near = near_names(name, known)
            raise ValueError(f"{place}, and {name!r} is that of no joint; {near}leave it out: table[{_listed(wanted, quoted=True)}]")
        if times[name] > 1 and name in taken:
            raise ValueError(f"{place}, and {name!r} is that of {times[name]} columns; keep one of them")
    if not wanted:
        return np.zeros(0)
    return np.stack(np.broadcast_arrays(*(_column(x, name, what) for name in wanted)), axis=-1)


def _column(x: Any, name: str, what: str) -> NDArray[Any]:
    try:
        column = np.asarray(x[name])
    except (TypeError, KeyError) as error:  # polars.LazyFrame has names, but no numbers yet
        raise ValueError(f"{what}: column {name!r} of a {type(x).__name__} can't be read ({error}); collect it into a table or an array first") from None
    if column.dtype.kind == "O":  # numbers of Python, or of pandas with a place for absent ones
        try:
            column = column.astype(float)
        except (TypeError, ValueError):
            pass
    if column.dtype.kind not in "fiub":
        raise ValueError(f"{what}: column {name!r} has no numbers, but {column.dtype}; expected numbers in every row")
    return column


def _listed(names: Sequence[str], quoted: bool = False) -> str:
    shown = ", ".join(map(repr if quoted else str, names[:LISTED]))
    more = len(names) - LISTED
    return f"[{shown}]" if quoted and more <= 0 else f"[…{len(names)} names]" if quoted else shown + (f" and {more} more" if more > 0 else "")
