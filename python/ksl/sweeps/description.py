"""What a sweep varies: its TOML file, checked."""

from __future__ import annotations

import math
import os
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ksl.base.errors import CaseError, MotionError, SweepError, near_names
from ksl.base.toml_files import read_toml
from ksl.load_cases.case_files.simulate_keys import simulated_of
from ksl.load_cases.case_files.simulated import Simulated
from ksl.motions.reading_options import check_options

KINDS = {
    "payload": ("kg", "mass of a body on the link `link`, its centre of mass at `center` in the link's frame"),
    "speed": ("", "factor of the motion's speed: the same path in 1/factor of the time"),
    "tilt": ("deg", "angle by which the mounting is turned about `axis`, an axis of the world through the base"),
    "mass": ("", "factor of mass and inertia of the link `link`; of all links without it"),
    "center": ("m", "shift of the centre of mass of the link `link` along `axis` of the link"),
    "motion": ("", "file of the motion"),
}
"""{kind: (unit, what it varies)}."""
NEEDS = {"payload": ("link",), "tilt": ("axis",), "center": ("link", "axis")}
TAKES = {"payload": ("link", "center"), "speed": (), "tilt": ("axis",), "mass": ("link",), "center": ("link", "axis"), "motion": ()}
AT_MOST = 10_000_000
"""Cases of one sweep."""
LARGEST = sys.float_info.max
"""Python's whole numbers may be larger, which `math.isfinite` doesn't take."""
TAKEN = ("case", "joint", "kind", "quantity", "value", "unit", "undetermined")
"""Columns of the results that are no parameters."""
OF_BASE = (
    "motion",
    "simulate",
    "reading",
    "components",
    "gravity",
    "physics",
    "friction_width",
    "floating_base",
    "mimic",
    "strict",
    "model",
    "loops",
    "drives",
    "stiffness",
    "xacro",
    "packages",
)


@dataclass(frozen=True)
class EvenlySpaced(Sequence[float]):
    """Numbers from `lower` to `upper`, made when they are asked for: a line of a file may want millions."""

    lower: float
    upper: float
    steps: int

    def __len__(self) -> int:
        return self.steps

    def __getitem__(self, i: Any) -> Any:
        return self._at(range(self.steps)[i])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """All at once, for arithmetic with arrays."""
        return np.asarray(self._at(np.arange(self.steps)), dtype)

    def _at(self, i: Any) -> Any:
        """Number i, or those of an array of integers."""
        return self.lower + (self.upper - self.lower) * i / max(1, self.steps - 1)


@dataclass(frozen=True)
class Parameter:
    """Something that a sweep varies, and between what."""

    name: str
    """The name of its column in the results."""
    kind: str
    """One of `KINDS`."""
    values: Sequence[float | str] = ()
    """The values of a grid, or the choices of a Latin hypercube; empty if a range is given."""
    lower: float = 0.0
    upper: float = 0.0
    link: str | None = None
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def unit(self) -> str:
        """The unit of its values; empty for factors and files."""
        return KINDS[self.kind][0]


@dataclass(frozen=True)
class Sweep:
    """A sweep as its file describes it."""

    file: str
    parameters: tuple[Parameter, ...]
    sampling: str = "grid"
    """"grid": each value with each; "latin hypercube": `cases` points, spread evenly over every range."""
    cases: int = 0
    """How many cases a Latin hypercube has."""
    seed: int = 0
    motion: str | None = None
    """File of the motion, if no parameter names some."""
    simulated: Simulated | None = None
    """How the motion of each case is simulated, if it is; a motion is then what it follows."""
    base: Mapping[str, Any] = field(default_factory=dict)
    """What all cases share besides: gravity, physics, friction_width, floating_base, mimic, strict, model, loops, drives, stiffness."""
    reading: Mapping[str, Any] = field(default_factory=dict)
    """How motions are read: arguments of `ksl.read_motion`."""
    components: str | None = None
    """File of catalogue numbers, for utilisations."""
    partition: int = 0
    """Cases of one partition of the results; 0 is chosen by the sweep."""
    folder: str = ""
    """The folder that names of files are relative to, from the root: workers may run elsewhere."""

    def path(self, name: str) -> str:
        """The path of a file that the sweep names."""
        return os.path.normpath(os.path.join(self.folder, name))

    @property
    def motions(self) -> list[str]:
        """Files of motions, as the sweep names them."""
        varied = [str(v) for p in self.parameters if p.kind == "motion" for v in p.values]
        return [*([self.motion] if self.motion is not None else []), *varied]


def read_sweep(path: str | os.PathLike[str]) -> Sweep:
    """Reads a sweep from a TOML file.  Paths in it are relative to the file.  Raises SweepError, which names the file and the key."""
    file = os.fspath(path)
    return sweep_from(read_toml(file, SweepError, "a sweep"), file)


def sweep_from(tables: Mapping[str, Any], file: str = "<sweep>") -> Sweep:
    """A sweep from the tables of such a file."""
    _known(tables, ("sweep", "base", "vary"), file, "")
    head, base = _table(tables, "sweep", file), dict(_table(tables, "base", file))
    _known(head, ("sampling", "cases", "seed", "partition"), file, "[sweep] ")
    _known(base, OF_BASE, file, "[base] ")
    vary = tables.get("vary", [])
    if not isinstance(vary, list) or not vary or not all(isinstance(v, Mapping) for v in vary):
        raise SweepError(f"{file}: nothing to vary; add a table [[vary]] with `kind` and `values`, or `from`, `to` and `steps`")
    sampling = head.get("sampling", "grid")
    if sampling not in ("grid", "latin hypercube"):
        raise SweepError(f'{file}: [sweep] sampling = {sampling!r}; expected "grid" or "latin hypercube"')
    latin = sampling != "grid"
    parameters = tuple(_parameter(v, i, latin, file) for i, v in enumerate(vary, 1))
    repeated = next((name for name, k in Counter(p.name for p in parameters).items() if k > 1), None)
    if repeated is not None:
        raise SweepError(f"{file}: two parameters are named {repeated!r}; give one of them another `name`")
    motion = base.pop("motion", None)
    simulated = _simulated(base.pop("simulate", None), parameters, file)
    if (motion is None) == all(p.kind != "motion" for p in parameters) and (motion is not None or simulated is None):
        raise SweepError(f'{file}: give the motion once: `motion` in [base], or a parameter of kind "motion"')
    if motion is not None and not isinstance(motion, str):
        raise SweepError(f"{file}: [base] motion = {motion!r}; expected the name of a file")
    cases = _count(head, "cases", 0, file)
    if latin and not cases:
        raise SweepError(f"{file}: a Latin hypercube needs `cases` in [sweep]: how many points it has")
    if not latin:
        cases = math.prod(len(p.values) for p in parameters)
    if cases > AT_MOST:
        raise SweepError(f"{file}: {cases:,} cases; at most {AT_MOST:,}: give fewer values, or split the sweep")
    components = base.pop("components", None)
    if components is not None and not isinstance(components, str):
        raise SweepError(f"{file}: [base] components = {components!r}; expected the name of a file")
    reading = _reading(base.pop("reading", {}), file)
    seed, partition = _count(head, "seed", 0, file), _count(head, "partition", 0, file)
    folder = os.path.dirname(os.path.abspath(file))
    return Sweep(file, parameters, sampling, cases, seed, motion, simulated, base, reading, components, partition, folder)


def _simulated(given: Any, parameters: Sequence[Parameter], file: str) -> Simulated | None:
    if given is None:
        return None
    if any(p.kind == "speed" for p in parameters):
        raise SweepError(
            f'{file}: [base] simulate, and a parameter of kind "speed": a simulated motion has the speed that its drives give it; leave one of them out'
        )
    try:
        return simulated_of(f"{file}: [base] simulate", given)
    except CaseError as e:
        raise SweepError(str(e)) from None


def _reading(given: Any, file: str) -> dict[str, Any]:
    """How motions are read."""
    if not isinstance(given, Mapping):
        raise SweepError(f"{file}: [base] reading = {given!r}; expected a table, for instance {{ degrees = true }}")
    try:
        check_options(f"{file}: [base] reading", given)
    except MotionError as error:
        raise SweepError(str(error)) from None
    return dict(given)


def described(sweep: Sweep) -> list[dict[str, Any]]:
    """The parameters, for the metadata of results: name, kind, unit, values or range, link, point, axis."""
    return [{**vars(p), "values": list(p.values), "unit": p.unit, "meaning": KINDS[p.kind][1]} for p in sweep.parameters]


def _parameter(given: Mapping[str, Any], number: int, latin: bool, file: str) -> Parameter:
    where = f"{file}: [[vary]] {number}"
    kind = given.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise SweepError(f"{where}: kind = {kind!r}; {near_names(kind, KINDS)}expected one of {', '.join(KINDS)}")
    _known(given, ("kind", "name", "values", "from", "to", "steps", *TAKES[kind]), where, "")
    for key in NEEDS.get(kind, ()):
        if key not in given:
            raise SweepError(f"{where}: `{key}` is missing; {kind} is the {KINDS[kind][1]}")
    link = given.get("link")
    if link is not None and not isinstance(link, str):
        raise SweepError(f"{where}: link = {link!r}; expected the name of a link")
    name = given.get("name", kind if not given.get("link") else f"{kind}_{given['link']}")
    if not isinstance(name, str) or not name or name in TAKEN:
        raise SweepError(f"{where}: name = {name!r}; expected a name for its column, other than {', '.join(TAKEN)}")
    center, axis = _vector(given, "center", where), _vector(given, "axis", where)
    if "axis" in TAKES[kind] and not any(axis):
        raise SweepError(f"{where}: axis has no direction; give three numbers, for instance [1, 0, 0]")
    values, lower, upper = _values(given, kind, latin, where)
    return Parameter(name, kind, values, lower, upper, given.get("link"), center, axis)


def _values(given: Mapping[str, Any], kind: str, latin: bool, where: str) -> tuple[Sequence[float | str], float, float]:
    """Values to choose from; or none, and the range of a Latin hypercube."""
    if "values" in given:
        if any(key in given for key in ("from", "to", "steps")):
            raise SweepError(f"{where}: has `values` and a range; give one of them")
        values = given["values"].tolist() if hasattr(given["values"], "tolist") else given["values"]  # NumPy's arrays, too
        if not isinstance(values, (list, tuple)) or not values:
            raise SweepError(f"{where}: values = {values!r}; expected a list")
        if kind == "motion":
            if not all(isinstance(v, str) for v in values):
                raise SweepError(f"{where}: values of a motion are names of files")
            return tuple(values), 0.0, 0.0
        return tuple(_number(v, kind, "values", where) for v in values), 0.0, 0.0
    if kind == "motion":
        raise SweepError(f"{where}: a motion has `values`: the names of the files")
    absent = [key for key in ("from", "to") if key not in given]
    if absent:
        raise SweepError(f"{where}: neither `values` nor a range; `{absent[0]}` is missing")
    lower, upper = _number(given["from"], kind, "from", where), _number(given["to"], kind, "to", where)
    if latin:
        if "steps" in given:
            raise SweepError(f"{where}: a Latin hypercube has no steps; leave `steps` out")
        if not lower < upper:
            raise SweepError(f"{where}: from {lower:g} to {upper:g} is no range; `from` must be below `to`")
        return (), lower, upper
    steps = _count(given, "steps", 0, where)
    if not 1 <= steps <= AT_MOST:
        raise SweepError(f"{where}: a range on a grid needs `steps`, how many values it has; at most {AT_MOST:,}")
    return EvenlySpaced(lower, upper, steps), 0.0, 0.0


def _number(x: Any, kind: str, key: str, where: str) -> float:
    if isinstance(x, bool) or not isinstance(x, (int, float)) or not abs(x) <= LARGEST:
        raise SweepError(f"{where}: {key} has {x!r}; expected finite numbers")
    if kind == "speed" and x <= 0:
        raise SweepError(f"{where}: {key} has the speed factor {x:g}; expected more than 0")
    if kind in ("payload", "mass") and x < 0:
        raise SweepError(f"{where}: {key} has {x:g}; a mass can't be negative")
    return float(x)


def _vector(given: Mapping[str, Any], key: str, where: str) -> tuple[float, float, float]:
    x = given.get(key, [0.0, 0.0, 0.0])
    numbers: Sequence[Any] = x if isinstance(x, list) else ()
    if len(numbers) != 3 or any(isinstance(c, bool) or not isinstance(c, (int, float)) or not abs(c) <= LARGEST for c in numbers):
        raise SweepError(f"{where}: {key} = {x!r}; expected three finite numbers")
    return (float(numbers[0]), float(numbers[1]), float(numbers[2]))


def _count(given: Mapping[str, Any], key: str, otherwise: int, where: str) -> int:
    x = given.get(key, otherwise)
    if isinstance(x, bool) or not isinstance(x, int) or x < 0:
        raise SweepError(f"{where}: {key} = {x!r}; expected a whole number")
    return x


def _table(tables: Mapping[str, Any], key: str, file: str) -> Mapping[str, Any]:
    table = tables.get(key, {})
    if not isinstance(table, Mapping):
        raise SweepError(f"{file}: {key} = {table!r}; expected a table [{key}]")
    return table


def _known(given: Mapping[str, Any], known: Sequence[str], file: str, where: str) -> None:
    for key in given:
        if key not in known:
            raise SweepError(f"{file}: {where}unknown key {key!r}; {near_names(key, known)}expected {', '.join(known)}")
