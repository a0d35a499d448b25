"""Load cases from a TOML file: docs/cases.md says what it may hold."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np

from ksl.base.errors import CaseError, MotionError, near_names
from ksl.base.files_read import InputFile, being_read, recorded
from ksl.base.input_files import path_given
from ksl.base.toml_files import read_toml, toml_of
from ksl.load_cases.case_files.case_mechanism import OF_MECHANISM, Mechanisms
from ksl.load_cases.case_files.case_values import check_keys, list_of, number_of, numbers_of, read_wrench, rotation_of, table_of
from ksl.load_cases.closed_poses import closed_pose, named_joints
from ksl.load_cases.load_case import ALWAYS, NEVER, LoadCase, Payload, Placement
from ksl.load_cases.reaction_joints import reaction_joints
from ksl.load_cases.case_files.simulate_keys import simulated_of
from ksl.load_cases.case_files.simulated import brakes_from, simulated_motion
from ksl.load_cases.case_files.stops import Law, Stop, at_rest, nearest_sample, worst_start
from ksl.load_cases.summary_table import ALL_CASES
from ksl.load_cases.case_files.wrenches_over_time import WrenchOverTime, total_on_links
from ksl.mechanism.lengths import extent, far_point
from ksl.model.model import Model
from ksl.mechanism.requests import WORLD
from ksl.mechanism.states import Array
from ksl.model.surgery import under_gravity, with_body
from ksl.motions.motion import Motion
from ksl.motions.reading import read_motion
from ksl.motions.reading_options import OPTIONS
from ksl.motions.signal.suspicions import suspicions

KEYS = ("motion", "payloads", "external", "gravity", "mounting", "physics", "friction_width", "hold", "stop", "simulate", *OF_MECHANISM)
"""The keys of a load case, and of the defaults of all."""
ROUND_OFF = 1e-6
"""The relative round-off of inertias, which are given with some digits."""
OF_PAYLOAD = ("link", "mass", "center", "inertia")
OF_EXTERNAL = ("link", "wrench", "steps", "file", "axes", "point", "order")
OF_HOLD = ("pose",)
OF_STOP = ("time", "from", "step", "law", "by")
MOST_STOPS = 1000
"""Load cases that `from = "all"` may make."""


def read_cases(
    model: Model, path: str | os.PathLike[str], placement: Placement | None = None, motion: str | os.PathLike[str] | None = None,
    payloads: Sequence[Payload] = (), reading: Mapping[str, Any] | None = None,
) -> tuple[list[LoadCase], list[InputFile]]:  # fmt: skip
    """The load cases of a TOML file, and the files that they come from, itself the first.

    Files in it are relative to its folder.  placement: of the wrenches of all cases.  motion: of cases that name none.
    payloads: what the model carries already, for the record.  reading: arguments of `read_motion`, unless a case gives its own.  Raises CaseError with the file, the case and the key; MotionError.
    """
    return _Reader(model, path_given(path, "a file of load cases", "cases"), placement or Placement(), motion, payloads, reading or {}).read()


def cases_of_text(model: Model, text: str, file: str = "cases.toml") -> list[LoadCase]:
    """The load cases of the text of such a file, which messages call by this name; what it names is looked for in that file's folder."""
    return _Reader(model, file, Placement(), None, (), {}).read_from(toml_of(text, file, CaseError))


class _Reader:
    def __init__(
        self, model: Model, file: str, placement: Placement, motion: str | os.PathLike[str] | None, payloads: Sequence[Payload], reading: Mapping[str, Any]
    ) -> None:
        self._reading = reading
        self._model, self._file, self._placement, self._motion, self._payloads = model, file, placement, motion, payloads
        self._folder = Path(file).parent
        self._motions: dict[str, Motion] = {}
        self.mechanisms = Mechanisms(model, self.path)
        self.doubts: list[str] = []
        """About the tables of wrenches that were read so far."""

    def read(self) -> tuple[list[LoadCase], list[InputFile]]:
        with recorded() as ledger:
            with being_read("cases", self._file, CaseError):
                tables = read_toml(self._file, CaseError, "load cases")
            return self.read_from(tables), ledger.files

    def read_from(self, tables: Mapping[str, Any]) -> list[LoadCase]:
        check_keys(self._file, tables, ("defaults", "cases"))
        defaults = table_of(f"{self._file}: defaults", tables.get("defaults", {}))
        check_keys(f"{self._file}: defaults", defaults, KEYS)
        named = table_of(f"{self._file}: cases", tables.get("cases", {}), ", as [cases.NAME]")
        if not named:
            raise CaseError(f"{self._file}: no load cases; give a table [cases.NAME] for each")
        found = [case for name, keys in named.items() for case in self._cases_of(name, keys, defaults)]
        names = [c.name for c in found]
        repeated = next((n for n, k in Counter(names).items() if k > 1), None)
        if repeated is not None:
            raise CaseError(f"{self._file}: two load cases are called {repeated!r}; rename one")
        self._check_joints(found)
        return found

    def _check_joints(self, cases: Sequence[LoadCase]) -> None:
        """Cases of one run have the same joints, of the tree and of loops: their results are one table."""
        joints = [[j.name for j in reaction_joints(case.model)] for case in cases]
        for case, names in zip(cases, joints, strict=True):
            if names != joints[0]:
                differ = ", ".join(sorted({*names} ^ {*joints[0]})) or "their order"
                raise CaseError(
                    f"{self._file}: case {case.name} and case {cases[0].name} differ in their joints ({differ}), and cases of one run have the same; "
                    "give loops in [defaults], or to the command"
                )

    def _cases_of(self, name: str, keys: Any, defaults: Mapping[str, Any]) -> list[LoadCase]:
        """The load cases of a table: several where an emergency stop begins at several samples."""
        where = f"{self._file}: case {name}"
        check_keys(where, table_of(where, keys), KEYS)
        if name in ("", ALL_CASES):
            raise CaseError(f"{self._file}: a load case can't be called {name!r}; choose another name")
        spec = {**defaults, **keys}
        given = _Case(where, name, spec, self)
        return given.load_cases()

    # what cases share

    @property
    def model(self) -> Model:
        return self._model

    @cached_property
    def reach(self) -> float:
        """The extent of the robot, by which lengths are judged."""
        return extent(self._model, [p.carried for p in self._payloads])

    @property
    def placement(self) -> Placement:
        return self._placement

    @property
    def has_motion(self) -> bool:
        """Is there one for cases that name none."""
        return self._motion is not None

    @property
    def payloads(self) -> Sequence[Payload]:
        return self._payloads

    def motion(self, where: str, spec: Any, model: Model) -> tuple[Motion, str]:
        """The motion that a case names, or the common one, and its file.  model: with the loops and the drives of the case."""
        options = dict(spec) if isinstance(spec, dict) else {}
        if isinstance(spec, dict):
            spec = options.pop("file", None)
            check_keys(f"{where}: motion", options, OPTIONS)
            if isinstance(options.get("map"), str):
                options["map"] = self.path(f"{where}: motion: map", options["map"])
        if spec is None:
            if self._motion is None:
                raise CaseError(f'{where}: no motion; give motion = "FILE", relative to the folder of {Path(self._file).name}')
            file = os.fspath(self._motion)
        else:
            file = self.path(f"{where}: motion", spec)
        key = repr((file, sorted(options.items()), model.loop_names, model.drives))
        if key not in self._motions:
            try:
                self._motions[key] = read_motion(model, file, **{**self._reading, **options})
            except MotionError as e:
                raise CaseError(f"{where}: motion: {e}") from None
        return self._motions[key], file

    def path(self, where: str, file: Any) -> str:
        if not isinstance(file, str):
            raise CaseError(f"{where} is {file!r}; expected the name of a file")
        return os.path.normpath(self._folder / file)

    def columns(self, where: str, file: Any) -> tuple[Array, Array]:
        """Times (n) and wrenches (n, 6) of a file with the columns time, fx … tz."""
        path = self.path(where, file)
        with being_read("external", path, CaseError):
            time, wrench, doubts = read_wrench(path)
        self.doubts += doubts
        return time, wrench


@dataclass(frozen=True)
class _Case:
    """A table of a load case, with the defaults."""

    where: str
    name: str
    spec: Mapping[str, Any]
    reader: _Reader

    def load_cases(self) -> list[LoadCase]:
        """With doubts about tables of wrenches beside those about the motion."""
        self.reader.doubts.clear()
        cases, doubts = self._load_cases(), self.reader.doubts
        return [replace(case, motion=replace(case.motion, doubts=[*case.motion.doubts, *doubts])) for case in cases] if doubts else cases

    @property
    def mechanism(self) -> Model:
        """The robot with the loops, the drives and the stiffnesses of this case."""
        return self.reader.mechanisms.of(self.where, self.spec)

    def _load_cases(self) -> list[LoadCase]:
        several = [key for key in ("hold", "stop", "simulate") if key in self.spec and self.spec[key] is not False]
        if len(several) > 1:
            raise CaseError(f"{self.where}: {' and '.join(several)}; give one of them, and the other in a case of its own")
        model, payloads = self._model()
        external = [self._external(i, e) for i, e in enumerate(list_of(f"{self.where}: external", self.spec.get("external", [])))]
        if self.spec.get("hold", False) is not False:
            motion, file = self._held(model)
            return [
                self._made(
                    model, replace(at_rest(motion), doubts=_about_units(model, motion)), file, payloads, external, "held at rest by brakes", ALWAYS, static=True
                )
            ]
        if self.spec.get("simulate", False) is not False:
            return [self._simulated(model, payloads, external)]
        motion, file = self.reader.motion(self.where, self.spec.get("motion"), self.mechanism)
        if "stop" in self.spec:
            return self._stops(model, motion, file, payloads, external)
        return [self._made(model, motion, file, payloads, external)]

    def _made(
        self, model: Model, motion: Motion, file: str, payloads: Sequence[Payload], external: Sequence[WrenchOverTime], kind: str = "motion",
        brakes_from: float = NEVER, name: str | None = None, held_at: float | None = None, static: bool = False,
    ) -> LoadCase:  # fmt: skip
        """held_at: the time whose external wrenches act throughout, or None."""
        time = motion.time if held_at is None else np.full(len(motion.time), held_at)
        wrenches = total_on_links(external, model, time, motion.q)
        return LoadCase(model, motion, self.reader.placement, wrenches, name or self.name, file, payloads, brakes_from, kind, static)

    def _model(self) -> tuple[Model, list[Payload]]:
        """The robot with what this case changes about it."""
        model, carried = self.mechanism, list(self.reader.payloads)
        if "physics" in self.spec or "friction_width" in self.spec:
            names = self.spec.get("physics", model.physics)
            width = number_of(f"{self.where}: friction_width", self.spec.get("friction_width", model.friction_width))
            try:
                model = model.with_physics(names, width)
            except ValueError as e:
                raise CaseError(f"{self.where}: {e}") from None
            if [j.name for j in model.joints] != [j.name for j in self.reader.model.joints]:
                raise CaseError(f'{self.where}: physics "rotor bodies" adds joints, and cases of one run have the same; give --physics to the command instead')
        for i, given in enumerate(list_of(f"{self.where}: payloads", self.spec.get("payloads", []))):
            payload = self._payload(f"{self.where}: payload {i + 1}", given)
            try:
                model = with_body(
                    model, payload.link, payload.mass, payload.center, None if payload.inertia is None else np.array(payload.inertia).reshape(3, 3)
                )
            except ValueError as e:
                raise CaseError(f"{self.where}: payload {i + 1}: {e}") from None
            carried.append(payload)
        return self._under_gravity(model), carried

    def _payload(self, where: str, given: Any) -> Payload:
        check_keys(where, table_of(where, given), OF_PAYLOAD)
        link = self._link(where, given.get("link"))
        mass = number_of(f"{where}: mass", given.get("mass"))
        x, y, z = numbers_of(f"{where}: center", given.get("center", [0, 0, 0]), 3)
        inertia = given.get("inertia")
        if inertia is None:
            return Payload(link, mass, (x, y, z))
        xx, yy, zz, xy, yz, zx = numbers_of(f"{where}: inertia (Ixx, Iyy, Izz, Ixy, Iyz, Izx about the centre of mass)", inertia, 6)
        matrix = (xx, xy, zx, xy, yy, yz, zx, yz, zz)
        least, middle, largest = np.linalg.eigvalsh(np.reshape(matrix, (3, 3)))
        if least < -ROUND_OFF * abs(largest) or largest > (least + middle) * (1 + ROUND_OFF):
            raise CaseError(
                f"{where}: inertia: principal moments {least:.4g}, {middle:.4g} and {largest:.4g} kg m², which no body can have: "
                "none is negative, and none exceeds the sum of the other two; check order (Ixx, Iyy, Izz, Ixy, Iyz, Izx) and units"
            )
        return Payload(link, mass, (x, y, z), matrix)

    def _under_gravity(self, model: Model) -> Model:
        """Gravity is that of the case, turned into the axes of the mounted base."""
        if "gravity" in self.spec:
            model = under_gravity(model, numbers_of(f"{self.where}: gravity", self.spec["gravity"], 3))
        if "mounting" in self.spec:
            model = under_gravity(model, rotation_of(f"{self.where}: mounting", self.spec["mounting"]).T @ model.gravity)
        return model

    def _frame(self, where: str, name: Any, what: str, known: Collection[str]) -> str:
        if name is None:
            raise CaseError(f'{where}: no {what}; give {what} = "NAME"')
        if name not in known:
            raise CaseError(f"{where}: no {what} {name!r}; {near_names(name, known)}known: {', '.join(known)}")
        return str(name)

    def _link(self, where: str, name: Any) -> str:
        """A link, also as `link:NAME`; a joint is refused with the link that it carries."""
        model = self.reader.model
        if not isinstance(name, str) or name not in {*model.frames, *(f"link:{link}" for link in model.link_names)}:
            return self._frame(where, name, "link", model.link_names)
        try:
            return model.link(name).name
        except ValueError as e:
            raise CaseError(f"{where}: {e}") from None

    def _link_of_frame(self, where: str, name: Any, what: str, *words: str) -> str:
        """The link that a frame's name stands for; `words` are what may be named instead."""
        model = self.reader.model
        try:
            return model.link_names[model.frame_link(name)]
        except ValueError as e:
            if name in model.link_names:  # and of a joint that carries another one
                raise CaseError(f"{where}: {what}: {e}") from None
        return self._frame(where, name, what, [*model.frames, *words])

    def _axes(self, where: str, axes: Any) -> str:
        if axes == "world":
            try:
                self.reader.model.reaction_request(axes=axes, joints=[])
            except ValueError as e:
                raise CaseError(f"{where}: {e}") from None
        elif axes not in ("link", WORLD):
            self._link_of_frame(where, axes, "axes", "link", "world")
        return "world" if axes == WORLD else str(axes)

    def _external(self, i: int, given: Any) -> WrenchOverTime:
        """link may be any frame; the wrench acts on the link that has it."""
        where = f"{self.where}: external wrench {i + 1}"
        check_keys(where, table_of(where, given), OF_EXTERNAL)
        link = self._link_of_frame(where, given.get("link"), "link")
        axes = self._axes(where, given.get("axes", "link"))
        order = given.get("order", "lin_ang")
        if order not in ("lin_ang", "ang_lin"):
            raise CaseError(f'{where}: order {order!r}; expected "lin_ang" (force first) or "ang_lin"')
        ways = [key for key in ("wrench", "steps", "file") if key in given]
        if len(ways) != 1:
            raise CaseError(f"{where}: {' and '.join(ways) or 'no wrench'}; give one of wrench (constant), steps, file")
        point = numbers_of(f"{where}: point", given.get("point", [0, 0, 0]), 3)
        if any(point):
            self.reader.doubts += far_point(f"the point of external wrench {i + 1}, on {link}, is", point, self.reader.reach)
        between = "hold"
        time: Array
        wrench: Array
        if "wrench" in given:
            time, wrench = np.zeros(1), np.array([numbers_of(f"{where}: wrench", given["wrench"], 6)])
        elif "steps" in given:
            rows = [numbers_of(f"{where}: step {k + 1} (time and six numbers)", row, 7) for k, row in enumerate(list_of(f"{where}: steps", given["steps"]))]
            if not rows or any(b[0] <= a[0] for a, b in pairwise(rows)):
                raise CaseError(f"{where}: steps need increasing times")
            time, wrench = np.array(rows)[:, 0], np.array(rows)[:, 1:]
        else:
            time, wrench = self.reader.columns(f"{where}: file", given["file"])
            between, order = "linear", "lin_ang"  # columns have names
        if order == "ang_lin":
            wrench = np.roll(wrench, 3, axis=1)
        return WrenchOverTime(link, time, wrench, "hold" if between == "hold" else "linear", axes, point)

    def _held(self, model: Model) -> tuple[Motion, str]:
        """The positions that are held: those of the motion, or a pose."""
        hold = self.spec["hold"]
        if hold is True:
            return self.reader.motion(self.where, self.spec.get("motion"), self.mechanism)
        check_keys(f"{self.where}: hold", table_of(f"{self.where}: hold", hold), OF_HOLD)
        if "pose" not in hold:
            return self.reader.motion(self.where, self.spec.get("motion"), self.mechanism)
        from ksl.load_cases.poses import held_still, pose_of

        try:
            q, closing = pose_of(model, table_of(f"{self.where}: pose", hold["pose"])), None
            if model.loops:
                q, closing = closed_pose(model, q, named_joints(model, hold["pose"]))
        except ValueError as e:
            raise CaseError(f"{self.where}: {e}") from None
        return held_still(model, q, closing), ""

    def _simulated(self, model: Model, payloads: Sequence[Payload], external: Sequence[WrenchOverTime]) -> LoadCase:
        """A motion that is simulated.  That which the case names, if it names one, is followed, or left at a time."""
        how = simulated_of(f"{self.where}: simulate", self.spec["simulate"])
        followed, file = (
            self.reader.motion(self.where, self.spec.get("motion"), self.mechanism) if "motion" in self.spec or self.reader.has_motion else (None, "")
        )
        try:
            motion, kind = simulated_motion(model, how, followed, external)
        except ValueError as e:
            raise CaseError(f"{self.where}: {e}") from None
        return self._made(model, motion, file, payloads, external, kind, brakes_from(how))

    def _stops(self, model: Model, motion: Motion, file: str, payloads: Sequence[Payload], external: Sequence[WrenchOverTime]) -> list[LoadCase]:
        stop, by = self._stop(motion)
        if stop.start == "worst":
            try:
                starts = [worst_start(model, motion, stop, external)]
            except MotionError as e:
                raise CaseError(f"{self.where}: {e}") from None
        elif stop.start == "all":
            starts = stop.starts(motion).tolist()
        else:
            starts = [nearest_sample(motion, float(stop.start))]
        if len(starts) > MOST_STOPS:
            raise CaseError(f'{self.where}: stop: {len(starts)} starts, at most {MOST_STOPS}; give a longer step, in s, or from = "worst"')
        tried = f", worst of {len(stop.starts(motion))} starts" if stop.start == "worst" else ""
        made, doubts = [], _about_units(model, motion)
        for start in starts:
            at = float(motion.time[start])
            kind = f"emergency stop from {at:.6g} s in {stop.duration:g} s, {stop.law} law, by the {by}{tried}"
            name = f"{self.name} {at:.6g} s" if stop.start == "all" else self.name
            try:
                stopped = replace(stop.motion(model, motion, start), doubts=doubts)
            except MotionError as e:
                raise CaseError(f"{self.where}: {e}") from None
            made.append(self._made(model, stopped, file, payloads, external, kind, ALWAYS if by == "brakes" else NEVER, name, at))
        return made

    def _stop(self, motion: Motion) -> tuple[Stop, str]:
        where = f"{self.where}: stop"
        given = table_of(where, self.spec["stop"])
        check_keys(where, given, OF_STOP)
        duration = number_of(f"{where}: time", given.get("time"))
        if duration <= 0:
            raise CaseError(f"{where}: time {duration:g}; expected the seconds until all is at rest, more than 0")
        fastest = float(np.abs(motion.v).max(initial=0.0))
        if not (math.isfinite(1.5 * fastest / duration) and math.isfinite(fastest * duration)):
            said = "the deceleration or the way is beyond the range of numbers; give a time that the mechanism can stop in"
            raise CaseError(f"{where}: time {duration:g} s: from {fastest:.6g} rad/s or m/s {said}")
        law, by = given.get("law", "cubic"), given.get("by", "drives")
        for key, value, known in (("law", law, ("cubic", "linear")), ("by", by, ("drives", "brakes"))):
            if value not in known:
                raise CaseError(f"{where}: {key} {value!r}; expected {' or '.join(known)}")
        start = given.get("from", "worst")
        if start not in ("worst", "all"):
            start = number_of(f'{where}: from ("worst", "all" or a time)', start)
            if not motion.time[0] <= start <= motion.time[-1]:
                raise CaseError(f"{where}: from {start:g} s; the motion is from {motion.time[0]:g} s to {motion.time[-1]:g} s")
        step = None if "step" not in given else number_of(f"{where}: step", given["step"])
        if step is not None and step <= 0:
            raise CaseError(f"{where}: step {step:g}; expected seconds, more than 0")
        return Stop(duration, cast(Law, law), start, step), str(by)


def _about_units(model: Model, motion: Motion) -> list[str]:
    """Doubts about the units of a motion, which its positions at rest and its stops share; those about noise they don't."""
    if len(motion.time) < 2:  # a pose, which has no others
        return motion.doubts
    about_units = suspicions(model, motion.time, motion.q, motion.v)
    return [line for line in motion.doubts if line in about_units]
