"""wrenches.rrd: wrenches, joint states and poses of links as a recording of Rerun.

Every link is an entity world/LINK with a Transform3D.  Below it each joint whose child it is has Arrows3D `JOINT/force` and `JOINT/torque`, what acts on the child at the
joint's origin.  wrench/JOINT/fx … tz and joints/JOINT/position, speed, effort are scalars in SI units, `case` names the load case that begins, and scale/CASE says how long arrows are.  All have the timeline `time`, s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ksl.load_cases.load_case import LoadCase, Placement
from ksl.load_cases.provenance import Provenance
from ksl.load_cases.undetermined import Undetermined
from ksl.mechanism.lengths import extent
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.states import Array
from ksl.output import OutputError
from ksl.report.mcap_file import PAUSE, frame_of, frames_of, states_of

FILE = "wrenches.rrd"
COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")
COLOURS = {"force": (220, 60, 40), "torque": (40, 110, 220)}
OF_EXTENT = 0.3
"""Length of the arrow of the largest force or torque, as a share of the robot's extent."""


def check_package() -> None:
    """Raises OutputError without the package that writes such files: before an hour of work rather than after it."""
    if find_spec("rerun") is None:
        raise OutputError(f"{FILE}: is written by the package rerun-sdk; install it: pip install 'ksl[rerun]'")


def write_rrd(path: Path, cases: Sequence[LoadCase], provenance: Provenance) -> None:
    """Writes all samples, load cases after each other.  Computes the wrenches again, on the child at the joint's origin, whatever the placement of the results.  O(samples · joints)."""
    import rerun

    recording = rerun.RecordingStream("ksl", send_properties=False)
    recording.save(path)
    try:
        text = "\n".join(f"{name}: {line}" for name, line in provenance.lines() if name)
        recording.log("made_by", rerun.TextDocument(_text(f"robot: {provenance.robot}\n{text}")), static=True)
        first = float(cases[0].motion.time[0])
        start = first if len(cases) == 1 else 0.0
        for case in cases:
            _Case(rerun, recording, case, start - float(case.motion.time[0])).write()
            start += float(case.motion.time[-1] - case.motion.time[0]) + PAUSE
        recording.flush()
    finally:
        recording.disconnect()


def _arrow(joint: Joint, model: Mechanism, what: str) -> tuple[str, str, str, str]:
    """Where the arrow of a joint's force or torque is: below the frame that it moves with."""
    return "world", frame_of(joint, model), joint.name, what


def _text(name: str) -> str:
    """A name as Unicode that can be written: files may hold other bytes."""
    return name.encode("utf-8", "replace").decode()


class _Case:
    """A load case, whose times are shifted."""

    def __init__(self, rerun: Any, recording: Any, case: LoadCase, shift: float) -> None:
        self._rerun, self._recording, self._shift = rerun, recording, shift
        self._plain = replace(case, placement=Placement(), known_undetermined=Undetermined())
        self._wanted = [(k, joint) for k, joint in enumerate(case.joints) if case.placement.wanted(joint.name)]

    def write(self) -> None:
        """Arrows have one length for all samples of a load case, which needs a first pass over the wrenches."""
        most = np.zeros(2)
        chosen = [k for k, _ in self._wanted]
        for block in self._plain.blocks():
            f = block.total[:, chosen].reshape(-1, 2, 3)
            most = np.maximum(most, np.linalg.norm(f, axis=2).max(axis=0, initial=0.0))
        metres = OF_EXTENT * (extent(self._plain.model) or 1.0) / np.where(most > 0, most, 1.0)
        self._recording.log(
            self._path("scale", self._plain.name),
            self._rerun.TextDocument(f"1 m of an arrow is {1 / metres[0]:.6g} N, or {1 / metres[1]:.6g} N m"),
            static=True,
        )
        for _, joint in self._wanted:
            for what, colour in COLOURS.items():
                self._recording.log(self._path(*_arrow(joint, self._plain.model, what)), self._rerun.Arrows3D.from_fields(colors=[colour]), static=True)
        first = self._plain.motion.time[:1] + self._shift
        self._send(("case",), first, self._rerun.TextDocument.columns(text=[_text(self._plain.name)]))
        for block in self._plain.blocks():
            time = block.time + self._shift
            for name, positions, quaternions in frames_of(self._plain, block):
                self._send(("world", name), time, self._rerun.Transform3D.columns(translation=positions, quaternion=quaternions))
            for k, joint in self._wanted:
                f = block.total[:, k]
                for part, what in enumerate(COLOURS):
                    self._send(_arrow(joint, self._plain.model, what), time, self._rerun.Arrows3D.columns(vectors=f[:, 3 * part : 3 * part + 3] * metres[part]))
                for name, x in zip(COMPONENTS, f.T):
                    self._send(("wrench", joint.name, name), time, self._rerun.Scalars.columns(scalars=x))
            for name, position, speed, effort in states_of(self._plain, block):
                for what, x in (("position", position), ("speed", speed), ("effort", effort)):
                    if not np.isnan(x).all():  # there is no effort where there is no drive
                        self._send(("joints", name, what), time, self._rerun.Scalars.columns(scalars=x))

    def _path(self, *parts: str) -> str:
        path: str = self._rerun.new_entity_path([_text(part) or "_" for part in parts])
        return path

    def _send(self, place: Sequence[str], time: Array, columns: Any) -> None:
        self._rerun.send_columns(self._path(*place), [self._rerun.TimeColumn("time", duration=time)], columns, recording=self._recording)
