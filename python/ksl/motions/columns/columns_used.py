"""Which columns of a file are which of the motion: names, maps of columns, and every sentence about names that don't fit."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from ksl.base.csv_cells import text_of_cell
from ksl.base.errors import MotionError, close_names
from ksl.base.notes import NoteKind, Note, not_of_kind, of_kind
from ksl.base.words import listed
from ksl.mechanism.freedoms import are_enough, leads
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.joint_kinds import columns_of, columns_of_one_coordinate, units_of
from ksl.motions.columns.column_map import ColumnMap, ColumnRule, absent
from ksl.motions.columns.recorded import Recorded
from ksl.motions.columns.time_column import TIME, TimeColumn, find_time
from ksl.motions.columns.units import DEGREE, bare, factor, si

_WITH_UNIT = re.compile(r"(.*\S)\s*([\[(](?!\d+[\])])[^\[\]()]+[\])])")  # a number is that of an element of a list
STATES = ("q", "v", "a")
"""What a matrix may be: positions, velocities, accelerations of all joints."""
LEFT_OUT = "--ignore-extra leaves out what no joint has"
EFFORT = ".effort"
"""The end of names of columns with measured efforts, which :func:`ksl.read_efforts` reads."""


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

    @property
    def sources(self) -> list[str]:
        """Columns of the file to be read, the times first."""
        times = [self.time.name] + [self.time.nanoseconds] * bool(self.time.nanoseconds)
        return list(dict.fromkeys([*times, *(u.source for u in self.used.values())]))


def quantities(table: Recorded, model: Mechanism) -> dict[str, Quantity]:
    """All columns that a motion of the model may have.  Raises MotionError if one that the file has could be two."""
    known: dict[str, Quantity] = {}
    in_file = set(table.names)
    for joint in model.joints[: len(model.joint_names)]:
        for order, (group, units) in enumerate(zip(columns_of(joint), units_of(joint), strict=True)):
            for c, unit in zip(group, units, strict=True):
                quantity = Quantity(joint, order, "plain" if not unit else "length" if unit == "m" else "angle")
                if c in known and c in in_file:
                    both = f"{known[c].what} or {quantity.what}"
                    raise MotionError(f"{table.head}: column {c!r} could be {both}; rename one of these joints in the robot's file")
                known[c] = quantity
    return known


def choose_columns(
    table: Recorded, model: Mechanism, columns: ColumnMap, degrees: bool = False, ignore_extra: bool = False, positions_only: bool = False
) -> Choice:
    """Which columns are used, and how they are converted.  Raises MotionError with the name that doesn't fit, and what to do.

    columns: a map, which may be empty.  degrees, ignore_extra, positions_only: as `read_motion` takes them.  O(columns).
    """
    if TIME in model.joint_names:
        raise MotionError(f"{table.head}: column `time` holds the times, and {model.name} has a joint 'time' too; rename that joint in the robot's file")
    known = quantities(table, model)
    columns = by_columns(table, model, known, columns)
    rules = _rules(table, known, columns)
    choice = Choice(_time(table, known, rules, columns))
    unknown = _Unknown(table, model, known, columns)
    for source, rule in rules.items():
        if source in (choice.time.name, choice.time.nanoseconds):
            continue
        if rule.to not in known:
            choice.notes.append(unknown.left_out(source, rule, ignore_extra))
        elif not (positions_only and known[rule.to].order):
            choice.used[rule.to] = _conversion(table, known[rule.to], source, rule, degrees, columns)
    if positions_only and any(known[r.to].order for r in rules.values() if r.to in known):
        choice.notes.append("velocities and accelerations in the file are not used, as wished")
    if not degrees:
        _check_units(table, known, choice, rules)
    _check_constants(table, model, choice, columns)
    _check_complete(table, model, choice, columns)
    choice.notes += _notes(table, known, choice, rules, columns)
    return choice


def _rules(table: Recorded, known: Mapping[str, Quantity], columns: ColumnMap) -> dict[str, ColumnRule]:
    """A rule for each column of the file: that of the map, or one that follows from it, or the column's own name."""
    names = list(table.names)
    in_file, ignored = set(names), set(columns.ignored)
    aliases = _without_blanks(known)
    given = {name: _meant(rule, known, aliases) for name, rule in columns.rules.items()}
    for name in [*given, *columns.ignored]:
        if name not in in_file:
            raise absent(columns, name, names, table.file)
    for name, rule in list(given.items()):  # rates of a mapped joint are mapped with it
        if rule.to in known and known[rule.to].joint.one_coordinate and rule.to == known[rule.to].joint.name:
            for end in (".v", ".a"):
                if name + end in in_file and name + end not in given and name + end not in known:
                    given[name + end] = ColumnRule(rule.to + end, rule.unit, rule.sign, rule.scale)
    taken = {rule.to: name for name, rule in given.items()}
    for name in names:
        if name in given or name in ignored:
            continue
        rule = _meant(_rule_of_name(name, known, in_file), known, aliases)
        if rule.to in taken and rule.to in known:
            by = f"{columns.file} maps {taken[rule.to]!r} to it" if taken[rule.to] in columns.rules else f"{taken[rule.to]!r} is it"
            raise MotionError(f"{table.head}: column {name!r} would be {known[rule.to].what}, but {by}, too; put {name!r} into the list `ignore` of a map")
        taken[rule.to] = name
        given[name] = rule
    return {name: given[name] for name in names if name in given}


def by_columns(table: Recorded, model: Mechanism, known: Collection[str], columns: ColumnMap) -> ColumnMap:
    """The map with the names of columns where it names them as they stand in the file, or names a whole matrix or list.

    A matrix that is to be q, v or a has a column for each of the joints' columns, in their order.  Raises MotionError where it has others.
    known: columns of the motion, which a matrix is not, whatever its name is.
    """
    names = set(table.names)

    def meant(name: str) -> str:
        if table.aliases.get(name) == "":
            raise MotionError(
                f"{columns.file}: column {name!r} of {table.file} holds several joints, whose names change from row to row; give the names of the joints instead"
            )
        bare = name.strip().lstrip("%#").strip()  # readers take names without the mark of a comment, and without what guards them in spreadsheets
        return next((n for n in (name, table.aliases.get(name, name), bare, text_of_cell(bare)) if n in names or n in table.groups), name)

    rules: dict[str, ColumnRule] = {}
    for name, rule in columns.rules.items():
        source = meant(name)
        if source == TIME != name and table.is_recording:
            continue  # its stamps are read already
        if source in names or source not in table.groups or rule.to in known or rule.to not in STATES:
            rules[source] = rule
            continue
        joints = model.joints[: len(model.joint_names)]
        wanted = [c for joint in joints for c in columns_of(joint)[STATES.index(rule.to)]]
        if len(wanted) != len(table.groups[source]):
            raise MotionError(
                f"{columns.file}: {name!r} is to be {rule.to!r}, and has {len(table.groups[source])} columns, but {model.name} has {len(wanted)}: {listed(wanted)}"
            )
        rules |= {element: replace(rule, to=c) for element, c in zip(table.groups[source], wanted)}
    ignored = [element for name in map(meant, columns.ignored) for element in ([name] if name in names else table.groups.get(name, [name]))]
    return replace(columns, rules=rules, ignored=tuple(ignored))


def _without_blanks(known: Mapping[str, Quantity]) -> dict[str, str]:
    """Columns of joints whose names begin or end with blanks, by the names without them: tables lose these blanks."""
    found: dict[str, list[str]] = {}
    for column, what in known.items():
        if what.joint.name != what.joint.name.strip():
            found.setdefault(what.joint.name.strip() + column.removeprefix(what.joint.name), []).append(column)
    return {bare: columns[0] for bare, columns in found.items() if len(columns) == 1}


def _meant(rule: ColumnRule, known: Mapping[str, Quantity], aliases: Mapping[str, str]) -> ColumnRule:
    """The rule with the column of the motion that it means."""
    return rule if rule.to in known or rule.to.strip() not in aliases else replace(rule, to=aliases[rule.to.strip()])


def _rule_of_name(name: str, known: Mapping[str, Quantity], in_file: set[str]) -> ColumnRule:
    """`hip [deg]` is `hip`, unless a column or a joint has the name as it stands."""
    found = None if name in known else _WITH_UNIT.fullmatch(name)
    if found and found[1] not in in_file and found[1] in known:
        return ColumnRule(found[1], found[2])
    return ColumnRule(name)


def _time(table: Recorded, known: Mapping[str, Quantity], rules: Mapping[str, ColumnRule], columns: ColumnMap) -> TimeColumn:
    for name, rule in columns.rules.items():
        if rule.to == TIME:
            if rule.offset or rule.sign < 0:
                raise MotionError(f"{columns.file}: column {name!r} holds times, which take a unit or a scale, and neither sign nor offset")
            return TimeColumn(name, rule.unit, rule.scale)
    return find_time(table, {name for name, rule in rules.items() if rule.to in known})


def _conversion(table: Recorded, what: Quantity, source: str, rule: ColumnRule, degrees: bool, columns: ColumnMap) -> Used:
    unit = rule.unit or table.units.get(source, "")
    scale = DEGREE if degrees and what.quantity == "angle" else 1.0
    if unit:
        where = columns.file if rule.unit and source in columns.rules else table.head
        scale = factor(where, source, unit, what.quantity, what.order, rate_of_position=rule.unit != "")
    return Used(source, scale * rule.factor, scale * rule.offset)


def _check_units(table: Recorded, known: Mapping[str, Quantity], choice: Choice, rules: Mapping[str, ColumnRule]) -> None:
    """Raises MotionError where a column is converted, and another one of its kind says no unit: a merged cell gives it to the first column alone."""
    units = {to: rules[used.source].unit or table.units.get(used.source, "") for to, used in choice.used.items()}
    for to, unit in units.items():
        alike = [other for other in units if known[other].quantity == known[to].quantity and known[other].order == known[to].order]
        without = [choice.used[other].source for other in alike if not units[other] and rules[choice.used[other].source].scale == 1]
        if unit and without and choice.used[to].factor != 1 and known[to].quantity != "plain":
            raise MotionError(
                f"{table.head}: column {choice.used[to].source!r} is in {bare(unit)}, and {without[0]!r} has no unit; give each column its own, {without[0]} [{bare(unit)}] say"
            )


@dataclass
class _Unknown:
    """What to do about columns that no joint has."""

    table: Recorded
    model: Mechanism
    known: Mapping[str, Quantity]
    columns: ColumnMap

    def left_out(self, source: str, rule: ColumnRule, ignore_extra: bool) -> str:
        """The note about a column that is left out, or raises MotionError."""
        if rule.to.removesuffix(EFFORT) in self.model.joint_names and rule.to.endswith(EFFORT):
            return _unused_column(f"{source!r} (an effort)")
        if source in self.columns.rules:
            said = f"column {source!r} is to be {rule.to!r}, which no joint of {self.model.name} has"
            raise MotionError(f"{self.columns.file}: {said}; {self._instead(rule.to) or self._nearest(rule.to, [*self.known, TIME])}")
        if ignore_extra or (self.table.is_recording and source in self.of_followers):
            return _unused_column(f"{source!r}" + (" (it follows another joint)" if source in self.of_followers else ""))
        kind, holding = "joint" if self.table.is_recording else "column", self.table.holding(source)
        holds = f", which {holding}" if holding else ""
        raise MotionError(f"{self.table.head}: unknown {kind} {source!r}{holds}; {self._hint(source)}")

    @cached_property
    def of_followers(self) -> dict[str, Joint]:
        """Columns that mimic joints would have if they didn't follow."""
        followers = map(self.model.joint, self.model.follower_names)
        return {c: joint for joint in followers for group in columns_of_one_coordinate(joint) for c in group}

    def _hint(self, name: str) -> str:
        joints = self.model.joints[: len(self.model.joint_names)]
        instead = self._instead(name)
        if instead:
            return instead
        if name.startswith("floating_base.") and not (joints and joints[0].parent is None):
            return "if the root link floats, load the robot with --floating-base (in Python floating_base=True)"
        in_file = set(self.table.names)
        missing = [n for n in self.known if n not in in_file]
        hint = self._nearest(name, missing)
        if len(missing) == len(self.known) and _near(name, missing) is None:
            return f"{hint}. No column has the name of a joint; say which is which by a map (--map FILE)"
        return f"{hint} ({LEFT_OUT})"

    def _nearest(self, name: str, known: list[str]) -> str:
        near = _near(name, known)
        return f"did you mean {near!r}?" if near else f"the moving joints of {self.model.name} are {listed(self.model.joint_names)}"

    def _instead(self, name: str) -> str | None:
        """What to give instead of a column that a joint would have if it had one coordinate, or didn't follow another one."""
        follower = self.of_followers.get(name)
        if follower:
            return (
                f"joint {follower.name} mimics {follower.leader}, whose column says where both are: remove this column, "
                'or load the robot with --mimic independent (in Python mimic="independent")'
            )
        if name.removesuffix(".v").removesuffix(".a") in self.model.loop_names:
            return f"that joint closes a loop, and its position follows from those of other joints: remove this column ({LEFT_OUT})"
        for joint in self.model.joints[: len(self.model.joint_names)]:
            for one, group in zip(columns_of_one_coordinate(joint), columns_of(joint), strict=True):
                if name in one and name not in group:
                    return f"joint {joint.name} is {joint.kind}: give {' '.join(group)}"
        return None


def _near(name: str, known: list[str]) -> str | None:
    """The column that is likely meant.  The name of another robot's joint is not meant to be a rate: only slips of a letter are."""
    rates = [n for n in known if n.endswith((".v", ".a"))]
    return next(iter(close_names(name, [n for n in known if n not in rates], 1) or close_names(name, rates, 1, 0.9)), None)


def _check_constants(table: Recorded, model: Mechanism, choice: Choice, columns: ColumnMap) -> None:
    """Raises MotionError for positions at rest of joints that don't exist, or that the file has."""
    positions = [c for j in model.joints[: len(model.joint_names)] for c in columns_of(j)[0]]
    for name in columns.constants:
        if name not in positions:
            near = close_names(name, positions, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"the moving joints of {model.name} are {listed(model.joint_names)}"
            raise MotionError(f"{columns.file}: [constants] names {name!r}, which no joint of {model.name} has; {hint}")
        if name in choice.used:
            raise MotionError(f"{columns.file}: {name!r} is a constant, but {table.file} has it; remove it from [constants], or put the column into `ignore`")


def _check_complete(table: Recorded, model: Mechanism, choice: Choice, columns: ColumnMap) -> None:
    """Raises MotionError for joints without positions, and rates that are given in part."""
    given = [j for j in model.joints[: len(model.joint_names)] if any(c in choice.used or c in columns.constants for c in columns_of(j)[0])]
    for joint in model.joints[: len(model.joint_names)]:
        position, *rates = columns_of(joint)
        if model.loops and joint not in given:
            if model.drives is None:
                raise MotionError(_drives_unknown(table, model, joint))
            if not leads(model, joint) or are_enough(model, given):
                continue  # it follows
        for c in position:
            if c not in choice.used and c not in columns.constants:
                pose = "its pose (position in m, unit quaternion)" if joint.quaternion else "its orientation (a unit quaternion)"
                unit = joint.unit if joint.one_coordinate else "rad or m"
                what = f"its positions ({unit})" if joint.quaternion is None else pose
                said = f"{table.head}: no column {c!r} for joint {joint.name}; add {what} at every sample"
                raise MotionError(_not_recorded(table, joint) if table.is_recording else said)
        for group in rates:
            if any(c in choice.used for c in group) and not all(c in choice.used for c in group):
                missing = next(c for c in group if c not in choice.used)
                others = f"though others of its group are there; give all of {', '.join(group)} or none"
                raise MotionError(f"{table.head}: no column {missing!r}, {others}")


def _drives_unknown(table: Recorded, model: Mechanism, joint: Joint) -> str:
    """A closed mechanism needs the columns of its drives alone, where these are known."""
    return (
        f"{table.head}: no column {columns_of(joint)[0][0]!r} for joint {joint.name}. The columns of the joints that have motors would do, but {model.name} "
        f"doesn't say which these are; name them: --drives (drives= in Python), from among {listed(model.joint_names)}"
    )


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


def _notes(table: Recorded, known: Mapping[str, Quantity], choice: Choice, rules: Mapping[str, ColumnRule], columns: ColumnMap) -> list[str]:
    """What was renamed and converted."""
    renamed = [f"{s!r} is {columns.rules[s].words()}" for s in rules if s in columns.rules and s != choice.time.name]
    notes = [f"columns by the map {columns.file}: {listed(renamed)}"] if renamed else []
    units: dict[str, list[str]] = {}
    for column, used in choice.used.items():
        what, rule = known[column], rules[used.source]
        if used.factor == rule.factor:  # its unit is that of the motion
            continue
        said = bare(rule.unit or table.units.get(used.source, "")) or ("deg", "deg/s", "deg/s²")[what.order]
        units.setdefault(f"{said} to {si(what.quantity, what.order)}", []).append(column)
    notes += [f"converted from {how}: {listed(names)}" for how, names in units.items()]
    if columns.ignored:
        notes.append(f"left out, as {columns.file} says: {listed(columns.ignored)}")
    if columns.constants:
        notes.append(f"at rest, as {columns.file} says: {listed(f'{n} = {x:g}' for n, x in columns.constants.items())}")
    return notes


def with_unused_together(notes: Iterable[str]) -> list[str]:
    """Notes in which the lines about columns that are not used are one."""
    lines = list(notes)
    left = [note.of for note in of_kind(lines, NoteKind.COLUMN)]
    return not_of_kind(lines, NoteKind.COLUMN) + ([f"columns that are not used: {listed(left)}"] if left else [])


def _unused_column(column: str) -> Note:
    return Note(NoteKind.COLUMN, f"not used: column {column}", column)
