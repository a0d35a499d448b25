"""Which columns of a file are which of the motion: names, maps of columns, and every sentence about names that don't fit."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches

from ksl.errors import MotionError
from ksl.mechanism import Joint, Mechanism
from ksl.motions.column_map import ColumnMap, ColumnRule, absent
from ksl.motions.columns import METRES, columns_of, columns_of_one_coordinate
from ksl.motions.recorded import Recorded, listed
from ksl.motions.time_column import TIME, TimeColumn, find_time
from ksl.motions.units import factor, si, unit_of

_WITH_UNIT = re.compile(r"(.*\S)\s*([\[(][^\[\]()]+[\])])")
LEFT_OUT = "--ignore-extra leaves out what no joint has"


@dataclass(frozen=True)
class Quantity:
    """What a column of the motion holds."""

    joint: Joint
    order: int
    """0 for positions, 1 for velocities, 2 for accelerations."""
    quantity: str
    """"angle", "length", or "plain" for quaternions."""

    @property
    def what(self) -> str:
        return f"the {('position', 'velocity', 'acceleration')[self.order]} of joint {self.joint.name}"


@dataclass(frozen=True)
class Used:
    """A column that is used: where it stands in the file, and value = factor · number + offset."""

    source: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass
class Choice:
    """Columns of the motion and where they come from."""

    time: TimeColumn
    used: dict[str, Used] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def quantities(table: Recorded, model: Mechanism) -> dict[str, Quantity]:
    """All columns that a motion of the model may have.  Raises MotionError if one that the file has could be two."""
    known: dict[str, Quantity] = {}
    in_file = set(table.names)
    for joint in model.joints[: len(model.joint_names)]:
        for order, group in enumerate(columns_of(joint)):
            for c in group:
                is_quaternion = joint.quaternion is not None and order == 0 and c[-3:] in (".qx", ".qy", ".qz", ".qw")
                metres = joint.unit == "m" if joint.one_coordinate else c.removeprefix(f"{joint.name}.") in METRES
                quantity = Quantity(joint, order, "plain" if is_quaternion else "length" if metres else "angle")
                if c in known and c in in_file:
                    raise MotionError(f"{table.head}: column {c!r} could be {known[c].what} or {quantity.what}; rename one of these joints in the robot's file")
                known[c] = quantity
    return known


def choose_columns(table: Recorded, model: Mechanism, columns: ColumnMap | None, degrees: bool, ignore_extra: bool, positions_only: bool) -> Choice:
    """Which columns are used, and how they are converted.  Raises MotionError with the name that doesn't fit, and what to do."""
    if TIME in model.joint_names:
        raise MotionError(f"{table.head}: column `time` holds the times, and {model.name} has a joint 'time' too; rename that joint in the robot's file")
    known = quantities(table, model)
    rules = _rules(table, known, columns)
    choice = Choice(_time(table, known, rules, columns))
    for source, rule in rules.items():
        if source == choice.time.name:
            continue
        if rule.to not in known:
            _leave_out(table, model, known, source, rule, columns, choice, ignore_extra)
        elif not (positions_only and known[rule.to].order):
            choice.used[rule.to] = _conversion(table, known[rule.to], source, rule, degrees, columns)
    if positions_only and any(known[r.to].order for r in rules.values() if r.to in known):
        choice.notes.append("velocities and accelerations in the file are not used, as wished")
    _check_complete(table, model, choice, columns)
    choice.notes += _notes(table, known, choice, rules, columns, degrees)
    return choice


def _rules(table: Recorded, known: Mapping[str, Quantity], columns: ColumnMap | None) -> dict[str, ColumnRule]:
    """A rule for each column of the file: that of the map, or one that follows from it, or the column's own name."""
    names = list(table.names)
    in_file = set(names)
    given = dict(columns.rules) if columns else {}
    for name in [*given, *(columns.ignored if columns else ())]:
        if columns is not None and name not in in_file:
            raise absent(columns, name, names, table.file)
    for name, rule in list(given.items()):  # rates of a mapped joint are mapped with it
        if rule.to in known and known[rule.to].joint.one_coordinate and rule.to == known[rule.to].joint.name:
            for end in (".v", ".a"):
                if name + end in in_file and name + end not in given and name + end not in known:
                    given[name + end] = ColumnRule(rule.to + end, rule.unit, rule.sign, rule.scale)
    taken = {rule.to: name for name, rule in given.items()}
    for name in names:
        if name in given or columns is not None and name in columns.ignored:
            continue
        found = _WITH_UNIT.fullmatch(name)
        plain = name not in known and name != TIME and found is not None and (found[1] in known or found[1].lower() == TIME) and found[1] not in in_file
        given[name] = ColumnRule(found[1], found[2]) if plain and found else ColumnRule(name)
        to = given[name].to
        if to in taken and to in known:
            by = f"{columns.file} maps {taken[to]!r} to it" if columns and taken[to] in columns.rules else f"{taken[to]!r} is it"
            raise MotionError(f"{table.head}: column {name!r} would be {known[to].what}, but {by}, too; put {name!r} into the list `ignore` of a map")
        taken[to] = name
    return {name: given[name] for name in names if name in given}


def _time(table: Recorded, known: Mapping[str, Quantity], rules: Mapping[str, ColumnRule], columns: ColumnMap | None) -> TimeColumn:
    for name, rule in (columns.rules if columns else {}).items():
        if rule.to == TIME:
            if rule.offset or rule.sign < 0:
                raise MotionError(f"{columns.file if columns else ''}: column {name!r} holds times, which take a unit or a scale, and neither sign nor offset")
            return TimeColumn(name, rule.unit, rule.scale)
    return find_time(table, {name for name, rule in rules.items() if rule.to in known})


def _conversion(table: Recorded, what: Quantity, source: str, rule: ColumnRule, degrees: bool, columns: ColumnMap | None) -> Used:
    mapped = columns is not None and source in columns.rules
    unit = rule.unit or table.units.get(source, "")
    if unit:
        scale = factor(columns.file if columns and mapped and rule.unit else table.head, source, unit, what.quantity, what.order, mapped or rule.unit != "")
    else:
        scale = unit_of("deg").factor if degrees and what.quantity == "angle" else 1.0  # type: ignore[union-attr]
    return Used(source, scale * rule.factor, scale * rule.offset)


def _leave_out(
    table: Recorded, model: Mechanism, known: Mapping[str, Quantity], source: str, rule: ColumnRule, columns: ColumnMap | None, choice: Choice, ignore_extra: bool
) -> None:
    """Leaves a column out that no joint has, or raises MotionError."""
    if columns is not None and source in columns.rules:
        near = get_close_matches(rule.to, [*known, TIME], 1)
        hint = _several_columns_of(model, rule.to) or _column_of_follower(model, rule.to)
        hint = hint or (f"did you mean {near[0]!r}?" if near else f"the moving joints of {model.name} are {listed(model.joint_names)}")
        raise MotionError(f"{columns.file}: column {source!r} is to be {rule.to!r}, which no joint of {model.name} has; {hint}")
    follower = _column_of_follower(model, source)
    if ignore_extra or (follower and table.is_recording):
        why = " (it follows another joint)" if follower else ""
        choice.notes.append(f"not used: column {source!r}{why}")
        return
    kind = "joint" if table.is_recording else "column"
    raise MotionError(f"{table.head}: unknown {kind} {source!r}{_holds(table, source)}; {_hint(table, model, known, source, follower)}")


def _holds(table: Recorded, name: str) -> str:
    text = table.text_in(name)
    return f", which holds text ({text[:40]!r})" if text is not None else ""


def _hint(table: Recorded, model: Mechanism, known: Mapping[str, Quantity], name: str, follower: str | None) -> str:
    """What to do about a column that no joint has."""
    joints = model.joints[: len(model.joint_names)]
    several = _several_columns_of(model, name)
    if several or follower:
        return several or follower or ""
    if name.startswith("floating_base.") and not (joints and joints[0].parent is None):
        return "if the root link floats, load the robot with --floating-base (in Python floating_base=True)"
    in_file = set(table.names)
    near = get_close_matches(name, [n for n in known if n not in in_file], 1)
    if near:
        return f"did you mean {near[0]!r}? ({LEFT_OUT})"
    names = f"the moving joints of {model.name} are {listed(model.joint_names)}"
    if not any(n in known for n in in_file):
        return f"{names}. No column has the name of a joint; say which is which by a map (--map FILE)"
    return f"{names} ({LEFT_OUT})"


def _column_of_follower(model: Mechanism, name: str) -> str | None:
    """What to do about a column of a mimic joint; None where it is none."""
    for follower in map(model.joint, model.follower_names):
        if any(name in group for group in columns_of_one_coordinate(follower)):
            return (
                f"joint {follower.name} mimics {follower.leader}, whose column says where both are: remove this column, "
                'or load the robot with --mimic independent (in Python mimic="independent")'
            )
    return None


def _several_columns_of(model: Mechanism, name: str) -> str | None:
    """What to give instead of a column that a joint would have if it had one coordinate; None where no joint would."""
    for joint in model.joints[: len(model.joint_names)]:
        for one, group in zip(columns_of_one_coordinate(joint), columns_of(joint), strict=True):
            if name in one and name not in group:
                return f"joint {joint.name} is {joint.kind}: give {' '.join(group)}"
    return None


def _check_complete(table: Recorded, model: Mechanism, choice: Choice, columns: ColumnMap | None) -> None:
    """Raises MotionError for joints without positions, and rates that are given in part."""
    constants = columns.constants if columns else {}
    joints = model.joints[: len(model.joint_names)]
    for name in constants:
        if columns is not None and not any(name in columns_of(j)[0] for j in joints):
            near = get_close_matches(name, [c for j in joints for c in columns_of(j)[0]], 1)
            hint = f"did you mean {near[0]!r}?" if near else f"the moving joints of {model.name} are {listed(model.joint_names)}"
            raise MotionError(f"{columns.file}: [constants] names {name!r}, which no joint of {model.name} has; {hint}")
        if columns is not None and name in choice.used:
            raise MotionError(f"{columns.file}: {name!r} is a constant, but {table.file} has it, too; remove it from [constants], or put the column into `ignore`")
    for joint in joints:
        position, *rates = columns_of(joint)
        for c in position:
            if c not in choice.used and c not in constants:
                pose = "its pose (position in m, unit quaternion)" if joint.quaternion else "its orientation (a unit quaternion)"
                what = "its positions (rad or m)" if joint.quaternion is None else pose
                where = f"{table.head}: no column {c!r} for joint {joint.name}; add {what} at every sample"
                raise MotionError(where if not table.is_recording else _not_recorded(table, joint))
        for group in rates:
            if any(c in choice.used for c in group) and not all(c in choice.used for c in group):
                absent_column = next(c for c in group if c not in choice.used)
                raise MotionError(f"{table.head}: no column {absent_column!r}, though others of its group are there; give all of {', '.join(group)} or none")


def _not_recorded(table: Recorded, joint: Joint) -> str:
    if not joint.one_coordinate:
        return (
            f"{table.file}: joint states have one number for each joint, but {joint.name} is {joint.kind}. Poses from nav_msgs/Odometry and tf are not read; "
            f"write the motion as CSV, with the columns {' '.join(columns_of(joint)[0])}"
        )
    recorded = [n for n in table.names if n != TIME and not n.endswith((".v", ".a"))]
    return (
        f"{table.file}: no joint states of {joint.name}; recorded are {listed(recorded)}. Say by a map (--map FILE) which of them it is, "
        f"or where it rests ([constants] {joint.name} = …)"
    )


def _notes(
    table: Recorded, known: Mapping[str, Quantity], choice: Choice, rules: Mapping[str, ColumnRule], columns: ColumnMap | None, degrees: bool
) -> list[str]:
    """What was renamed and converted."""
    renamed = [f"{s!r} is {columns.rules[s].words()}" for s in rules if columns is not None and s in columns.rules and s != choice.time.name]
    notes = [f"columns by the map {columns.file}: {listed(renamed)}"] if columns is not None and renamed else []
    units: dict[str, list[str]] = {}
    for column, used in choice.used.items():
        what, mapped = known[column], columns is not None and used.source in columns.rules
        unit = rules[used.source].unit or table.units.get(used.source, "")
        if used.factor == 1.0 or (mapped and not unit and not degrees):
            continue
        said = unit.strip("[]()") or ("deg", "deg/s", "deg/s²")[what.order]
        units.setdefault(f"{said} to {si(what.quantity, what.order)}", []).append(column)
    notes += [f"converted from {how}: {listed(names)}" for how, names in units.items()]
    if columns is not None and columns.ignored:
        notes.append(f"left out, as {columns.file} says: {listed(columns.ignored)}")
    if columns is not None and columns.constants:
        notes.append(f"at rest, as {columns.file} says: {listed(f'{n} = {x:g}' for n, x in columns.constants.items())}")
    return notes


def sources(choice: Choice) -> list[str]:
    """Columns of the file to be read, the times first."""
    return list(dict.fromkeys([choice.time.name, *(u.source for u in choice.used.values())]))


def unused_in(notes: Iterable[str]) -> list[str]:
    """Notes in which the lines about unused columns are one."""
    lines = list(notes)
    start = "not used: column "
    left = [n.removeprefix(start) for n in lines if n.startswith(start)]
    return [n for n in lines if not n.startswith(start)] + ([f"columns that are not used: {listed(left)}"] if left else [])
