"""Joints that close loops, and drives, in a file beside that of the robot, for robot files that must stay as they are.

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
"""

from __future__ import annotations

import hashlib
from typing import Any

from ksl.base.errors import DescriptionError, near_names
from ksl.base.files_read import InputFile, note, state_of
from ksl.base.input_files import Unreadable, contents, text
from ksl.base.limits import TOML_BYTES
from ksl.base.toml_files import toml_of
from ksl.model import given

_OF_FILE = ("robot", "drives", "loop")
_NEEDED = ("name", "kind", "predecessor", "successor")
OF_LOOP = (*_NEEDED, "predecessor_xyz", "predecessor_rpy", "successor_xyz", "successor_rpy", "axis", "axis2", "pitch")
"""Keys of a [[loop]]."""


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
        loops = tables.get("loop", [])
        if not isinstance(loops, list) or not all(isinstance(loop, dict) for loop in loops):
            raise self._refused("loop is no list of tables; begin each loop with a line [[loop]]")
        if not loops:
            raise self._refused("no [[loop]] in it; describe at least one loop, or leave loops= out")
        self.loops = [self._loop(i, loop) for i, loop in enumerate(loops, 1)]

    def check_robot(self, name: str) -> None:
        if self.robot is not None and self.robot != name:
            raise self._refused(f"its loops are those of robot {self.robot!r}, but the robot is called {name!r}; give the file of that robot, or correct the name in it")

    def refused(self, error: ValueError) -> DescriptionError:
        """What the model says of a loop, with the name of the file."""
        return self._refused(str(error))

    def _refused(self, what: str) -> DescriptionError:
        return DescriptionError(f"{self.file}: {what}")

    def _check_keys(self, table: dict[str, Any], where: str, known: tuple[str, ...]) -> None:
        for key in table:
            if key not in known:
                raise self._refused(f"{where} has an unknown key {key!r}; {near_names(key, list(known))}expected {', '.join(known)}")

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
        for key in _NEEDED:
            if not isinstance(loop.get(key), str) or not loop[key]:
                said = f"{key} is {loop[key]!r}" if key in loop else f"no {key}"
                raise self._refused(f'{who}: {said}; write {key} = "..."')
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

    def _frame(self, who: str, loop: dict[str, Any], side: str) -> given.PoseLike | None:
        return given.pose_of(f"{who}: its frame on the {side}", None, loop.get(f"{side}_xyz"), loop.get(f"{side}_rpy"), None)

    def _check_numbers(self, who: str, key: str, value: Any) -> None:
        def is_number(x: Any) -> bool:
            return isinstance(x, (int, float)) and not isinstance(x, bool)

        if key == "pitch":
            if not is_number(value):
                raise self._refused(f"{who}: pitch is {value!r}; expected a number, m/rad")
        elif not isinstance(value, list) or len(value) != 3 or not all(map(is_number, value)):
            raise self._refused(f"{who}: {key} is {value!r}; expected three numbers, [0, 0, 1] for example")
