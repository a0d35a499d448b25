"""Joints that close loops, force elements, and drives, in a file beside that of the robot, for robot files that must stay as they are.

robot = "fourbar"                 # as the robot file names it; may be left out
drives = ["A"]                    # the joints that have a motor, or { A = 1.0, B = 4.0 } with weights; may be left out

[[loop]]
name = "C"
kind = "revolute"                 # any kind of joint but floating
predecessor = "coupler"           # two links
successor = "rocker"
predecessor_xyz = [0.32, 0, 0]    # the joint's frame on each side, in that link's frame: m; zero if left out
predecessor_rpy = [0, 0, 0]       # rad, about the fixed axes x, y, z in this order
successor_xyz = [0.25, 0, 0]
axis = [0, 1, 0]                  # for kinds that have one; the same components in both frames; axis2 for universal joints
# pitch = 0.001                   # of helical joints, m/rad

[[force_element]]                 # a spring, damper or cylinder between two points; acts where physics= names "force elements"
name = "gas spring"
link1 = "ground"                  # two links, and a point in the frame of each, m
point1 = [0, 0, 0.1]
link2 = "rocker"
point2 = [0.2, 0, 0]
stiffness = 500                   # N/m; tension = preload + stiffness (length − free_length) + damping × rate of the length
free_length = 0.3                 # m
damping = 40                      # N s/m
preload = -250                    # N, positive where it pulls
limits = [0.1, 0.4]               # of the length, m; beyond them it is refused, unless there are stops:
stop_stiffness = 1e6              # N/m
"""

from __future__ import annotations

import hashlib
from typing import Any

from ksl.base.errors import DescriptionError, near_names
from ksl.base.files_read import InputFile, note, state_of
from ksl.base.input_files import Unreadable, contents, text
from ksl.base.limits import TOML_BYTES
from ksl.base.toml_files import toml_of
from ksl.mechanism import given

_OF_FILE = ("robot", "drives", "loop", "force_element")
_NEEDED = ("name", "kind", "predecessor", "successor")
OF_LOOP = (*_NEEDED, "predecessor_xyz", "predecessor_rpy", "successor_xyz", "successor_rpy", "axis", "axis2", "pitch")
"""Keys of a [[loop]]."""
_ENDS = ("link1", "point1", "link2", "point2")
_NUMBERS_OF_ELEMENT = ("stiffness", "free_length", "damping", "preload", "stop_stiffness")
OF_ELEMENT = ("name", *_ENDS, *_NUMBERS_OF_ELEMENT, "limits")
"""Keys of a [[force_element]]."""


def _is_number(x: Any) -> bool:
    return isinstance(x, (int, float)) and not isinstance(x, bool)


class LoopsFile:
    """What such a file says.  Raises :class:`ksl.DescriptionError`, which names it."""

    def __init__(self, file: str) -> None:
        self.file = file
        try:
            read = contents(file, TOML_BYTES)
            tables = toml_of(text(read), file, DescriptionError)
        except Unreadable as e:
            raise self._refused(f"{e}; give a TOML file with the loops of the robot") from None
        self.input = InputFile("loops", file, hashlib.sha256(read).hexdigest() if state_of(file) is not None else None)
        note(self.input, DescriptionError)
        self._check_keys(tables, "the file", _OF_FILE)
        self.robot = tables.get("robot")
        if self.robot is not None and not isinstance(self.robot, str):
            raise self._refused(f"robot is {self.robot!r}; expected the name in the robot file")
        self.drives = self._drives(tables.get("drives"))
        loops, elements = self._tables_of(tables, "loop"), self._tables_of(tables, "force_element")
        if not loops and not elements:
            raise self._refused("no [[loop]] and no [[force_element]] in it; describe at least one, or leave loops= out")
        self.loops = [self._loop(i, loop) for i, loop in enumerate(loops, 1)]
        self.force_elements = [self._force_element(i, element) for i, element in enumerate(elements, 1)]

    def check_robot(self, name: str) -> None:
        if self.robot is not None and self.robot != name:
            raise self._refused(
                f"its loops are those of robot {self.robot!r}, but the robot is called {name!r}; give the file of that robot, or correct the name in it"
            )

    def refused(self, error: ValueError) -> DescriptionError:
        """What the model says of a loop, with the name of the file."""
        return self._refused(str(error))

    def _refused(self, what: str) -> DescriptionError:
        return DescriptionError(f"{self.file}: {what}")

    def _check_keys(self, table: dict[str, Any], where: str, known: tuple[str, ...]) -> None:
        for key in table:
            if key not in known:
                raise self._refused(f"{where} has an unknown key {key!r}; {near_names(key, list(known))}expected {', '.join(known)}")

    def _tables_of(self, tables: dict[str, Any], key: str) -> list[dict[str, Any]]:
        found = tables.get(key, [])
        if not isinstance(found, list) or not all(isinstance(table, dict) for table in found):
            raise self._refused(f"{key} is no list of tables; begin each {key.replace('_', ' ')} with a line [[{key}]]")
        return found

    def _drives(self, drives: Any) -> given.Drives | None:
        if drives is None:
            return None
        if isinstance(drives, dict):
            try:
                given.drives(drives)
            except ValueError as error:
                raise self.refused(error) from None
            return drives
        if not isinstance(drives, list) or not all(isinstance(joint, str) for joint in drives):
            raise self._refused(f'drives is {drives!r}; expected names of joints, ["A"] for example')
        return drives

    def _loop(self, number: int, loop: dict[str, Any]) -> given.Loop:
        name = loop.get("name")
        who = f"loop {name}" if isinstance(name, str) and name else f"loop {number}"
        self._check_keys(loop, who, OF_LOOP)
        self._check_words(who, loop, _NEEDED)
        for key in OF_LOOP[4:]:
            if key in loop:
                self._check_numbers(who, key, loop[key])
        try:
            poses = (self._frame(who, loop, "predecessor"), self._frame(who, loop, "successor"))
            kind, links = loop["kind"], (loop["predecessor"], loop["successor"])
            return given.loop(loop["name"], kind, *links, *poses, loop.get("axis"), loop.get("axis2"), loop.get("pitch"))
        except DescriptionError:
            raise
        except ValueError as error:
            raise self.refused(error) from None

    def _force_element(self, number: int, element: dict[str, Any]) -> given.ForceElement:
        name = element.get("name")
        who = f"force element {name}" if isinstance(name, str) and name else f"force element {number}"
        self._check_keys(element, who, OF_ELEMENT)
        self._check_words(who, element, ("name", "link1", "link2"))
        for key in ("point1", "point2"):
            self._check_numbers(who, key, element.get(key))
        for key in _NUMBERS_OF_ELEMENT:
            if key in element and not _is_number(element[key]):
                raise self._refused(f"{who}: {key} is {element[key]!r}; expected a number")
        limits = element.get("limits")
        if limits is not None and not (isinstance(limits, list) and len(limits) == 2 and all(map(_is_number, limits))):
            raise self._refused(f"{who}: limits is {limits!r}; expected two numbers, [0.1, 0.4] for example")
        numbers = {key: element.get(key, 0.0) for key in _NUMBERS_OF_ELEMENT}
        ends = {key: element[key] for key in _ENDS}
        try:
            return given.force_element(element["name"], **ends, limits=limits, **numbers)
        except ValueError as error:
            raise self.refused(error) from None

    def _check_words(self, who: str, table: dict[str, Any], keys: tuple[str, ...]) -> None:
        for key in keys:
            if not isinstance(table.get(key), str) or not table[key]:
                said = f"{key} is {table[key]!r}" if key in table else f"no {key}"
                raise self._refused(f'{who}: {said}; write {key} = "..."')

    def _frame(self, who: str, loop: dict[str, Any], side: str) -> given.PoseLike | None:
        return given.pose_of(f"{who}: its frame on the {side}", None, loop.get(f"{side}_xyz"), loop.get(f"{side}_rpy"), None)

    def _check_numbers(self, who: str, key: str, value: Any) -> None:
        if key == "pitch":
            if not _is_number(value):
                raise self._refused(f"{who}: pitch is {value!r}; expected a number, m/rad")
        elif not isinstance(value, list) or len(value) != 3 or not all(map(_is_number, value)):
            raise self._refused(f"{who}: {key} is {value!r}; expected three numbers, [0, 0, 1] for example")
