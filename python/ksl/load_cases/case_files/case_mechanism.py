"""What load cases say of a mechanism with loops: joints that close them, joints that have motors, and stiffnesses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ksl.base.errors import CaseError
from ksl.robot_files.loading import with_loops
from ksl.model.model import Model
from ksl.robot_files.stiffness_file import stiff_by

OF_MECHANISM = ("loops", "drives", "stiffness")
"""Keys of a load case."""


class Mechanisms:
    """A robot as load cases change its mechanism; each is made once."""

    def __init__(self, model: Model, path: Callable[[str, Any], str]) -> None:
        """path: where, and the name of a file in it, to its path."""
        self._model, self._path = model, path
        self._made: dict[str, Model] = {}

    def of(self, where: str, spec: Mapping[str, Any]) -> Model:
        """The mechanism of a case.  Raises CaseError."""
        given = {key: spec[key] for key in OF_MECHANISM if key in spec}
        key = repr(given)
        if key not in self._made:
            try:
                self._made[key] = self._changed(where, given)
            except CaseError:
                raise
            except ValueError as e:
                raise CaseError(f"{where}: {e}") from None
        return self._made[key]

    def _changed(self, where: str, given: Mapping[str, Any]) -> Model:
        model = self._model
        if "loops" in given:
            model = model.without_loops() if given["loops"] == "cut" else with_loops(model, self._path(f"{where}: loops", given["loops"]))
        if "drives" in given:
            drives = drives_named(f"{where}: drives", given["drives"])
            if not model.loops:
                raise CaseError(f"{where}: drives are given, but {model.name} has no loops: each joint of a tree has a motor; leave drives out")
            model = model.with_drives(drives)
        if "stiffness" in given:
            stiffness = given["stiffness"]
            model, _ = stiff_by(model, stiffness if isinstance(stiffness, dict) else self._path(f"{where}: stiffness", stiffness))
        return model


def drives_named(where: str, given: Any) -> list[str] | dict[str, float]:
    """A list of names, names separated by commas as the option has them, or a table of weights."""
    if isinstance(given, dict):
        return given
    names = [name.strip() for name in given.split(",")] if isinstance(given, str) else given
    if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
        raise CaseError(f'{where} is {given!r}; expected names of joints, ["A"] for example')
    return names
