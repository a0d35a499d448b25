"""What made a result: inputs with their hashes, load cases, options, versions, date and command line."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import datetime, timezone
from typing import Any

import numpy as np

from ksl._core import __version__
from ksl.base.files_read import InputFile
from ksl.base.notes import NoteKind, Note
from ksl.load_cases.case_result import doubts_of
from ksl.load_cases.load_case import LoadCase, Payload
from ksl.mechanism.lengths import extent
from ksl.mechanism.mechanism import Joint
from ksl.mechanism.stiffness import compliances_of

CONVENTIONS = (
    "vectors of the columns are in the axes `axes`, moments about the point `at`; a wrench acts on the side `on`; "
    "constraint_… is what the structure carries, the rest acts along the joint's motion; effort is the drive's, the same for every on, at and axes"
)
LISTED = 4
"""More files of one role are one line."""
UNITS = "s, N, N m; position rad or m, speed rad/s or m/s, acceleration rad/s² or m/s², effort N m or N, power W, work J"


@dataclass(frozen=True)
class Provenance:
    """Says what made a result, so that two runs that differ look different."""

    robot: str
    joints: list[dict[str, Any]]
    """A dict for each joint, in the order of `Model.joints`: name, kind, axis, parent, child, lower, upper, velocity, effort.  Limits that
    the file doesn't give, or gives as zero, are None."""
    cases: list[dict[str, Any]]
    """A dict for each load case: name, motion, samples, gravity, payloads, physics, external; external_wrenches: those that are constant, {link: [6]};
    compliance: {joint: [36]}, by rows, of joints with stiffnesses; 36 numbers more, Σ u uᵀ, where nothing resists along directions u."""
    inputs: list[InputFile] = field(default_factory=list)
    options: dict[str, Any] = field(default_factory=dict)
    command: str = ""
    """The command line, or empty if a program called."""
    date: str = ""
    """When the results were made, ISO 8601, UTC."""
    versions: dict[str, str] = field(default_factory=dict)
    directory: str = ""
    """The folder that names of files are relative to."""
    extent: float = 0.0
    """How far the robot reaches, m; lengths that come later are judged by it."""

    def metadata(self) -> dict[str, Any]:
        """For the key `ksl` of Parquet files: values that JSON can hold."""
        return {"version": __version__, **asdict(self), "units": UNITS, "conventions": CONVENTIONS}

    def lines(self) -> list[tuple[str, str]]:
        """The provenance for people: names and texts, most important first."""
        several = len(self.cases) > 1
        by_case = [(f"case {c['name']}" if several else name, text) for c in self.cases for name, text in _of_case(c, several)]
        files = [line for role in dict.fromkeys(f.role for f in self.inputs) for line in _of_files(role, [f for f in self.inputs if f.role == role])]
        said = {name: value for name, value in self.options.items() if value not in ("", None, False, [])}
        return [
            *by_case,
            *files,
            ("options", ", ".join(f"{name.replace('_', ' ')} {_shown(value)}".strip() for name, value in said.items()) or "none"),
            *([("command", self.command)] if self.command else []),
            *([("date", self.date)] if self.date else []),
            ("versions", ", ".join(f"{name} {version}" for name, version in self.versions.items())),
        ]


def provenance_of(cases: Sequence[LoadCase], inputs: Sequence[InputFile] = (), options: Mapping[str, Any] | None = None, command: str = "") -> Provenance:
    """What makes the results of these load cases, now."""
    model = cases[0].model
    return Provenance(
        model.name,
        [joint_description(j) for j in cases[0].joints],
        [_case_description(case) for case in cases],
        list(inputs),
        dict(options or {}),
        command,
        datetime.now(timezone.utc).isoformat(timespec="seconds").replace("+00:00", "Z"),
        versions(),
        os.getcwd(),
        extent(model, [p.carried for p in cases[0].payloads]),
    )


def versions() -> dict[str, str]:
    return {"KSL": __version__, "Python": platform.python_version(), "NumPy": np.__version__, "platform": f"{platform.system()} {platform.machine()}"}


def joint_description(joint: Joint) -> dict[str, Any]:
    """What readers of results need to know of a joint."""
    lower, upper = joint.lower, joint.upper
    axis = list(joint.axis) if joint.has_axis else None
    given = {"lower": lower, "upper": upper, "velocity": joint.velocity or None, "effort": joint.effort or None}
    return {"name": joint.name, "kind": joint.kind, "axis": axis, "parent": joint.parent, "child": joint.child, **given}


def _case_description(case: LoadCase) -> dict[str, Any]:
    time, source = case.motion.time, case.motion.source
    return {
        "name": case.name,
        "kind": _kind(case),
        "brake": bool(case.braked.any()),
        "motion": case.motion_file,
        "format": source.format if source else None,
        "step": float(np.median(np.diff(time))) if len(time) > 1 else 0.0,
        "resolution": _resolution(case),
        "reading": list(source.notes) if source else [],
        "doubts": list(dict.fromkeys(doubts_of(case))),
        "samples": len(time),
        "start": float(time[0]),
        "end": float(time[-1]),
        "gravity": [float(g) for g in case.model.gravity],
        "payloads": [{"link": p.link, "mass": p.mass, "center": list(p.center), **({"inertia": list(p.inertia)} if p.inertia else {})} for p in case.payloads],
        "physics": list(case.model.physics),
        **(
            {"loops": case.model.loop_names, "drives": list(case.model.drives or ()), "drive_weights": list(case.model.drive_weights)}
            if case.model.loops
            else {}
        ),
        **({"compliance": compliance} if (compliance := compliances_of(case.model)) else {}),
        "external": list(case.external),
        "external_wrenches": {link: [float(x) for x in w[0]] for link, w in case.external.items() if (w == w[0]).all()},
    }


def _kind(case: LoadCase) -> str:
    """What the samples are, in words; a note where the report asks for its kind."""
    return Note(NoteKind.HELD, case.kind) if case.static else Note(NoteKind.SIMULATED, case.kind) if case.motion.integrated else case.kind


def _resolution(case: LoadCase) -> dict[str, float]:
    """{joint: the speed up to which it stands, rad/s or m/s}, of joints with one coordinate."""
    rate = case.motion.resolution
    if rate is None:
        return {}
    return {j.name: abs(float(case.model.velocity_of(j, rate))) for j in case.model.joints if j.one_coordinate}


def _of_case(case: Mapping[str, Any], several: bool) -> list[tuple[str, str]]:
    """Lines of one load case; one line if there are several."""
    motion = ", ".join(x for x in (case["motion"] or "arrays", case["format"]) if x)
    parts = {
        **({"what": case["kind"]} if case["kind"] != "motion" else {}),
        "motion": f"{motion}, {case['samples']} samples, median step {case['step']:.6g} s, from {case['start']:.10g} s to {case['end']:.10g} s",
        "gravity": f"({', '.join(f'{g:g}' for g in case['gravity'])}) m/s² in world axes",
        "payloads": "; ".join(str(Payload(p["link"], p["mass"], tuple(p["center"]))) for p in case["payloads"]) or "none",
        "physics of joints": ", ".join(case["physics"]) or "none",
        **({"closed by": ", ".join(case["loops"]), "drives": ", ".join(case["drives"])} if case.get("loops") else {}),
        **({"stiffnesses of": ", ".join(case["compliance"])} if case.get("compliance") else {}),
        "external wrenches": ", ".join(case["external"]) or "none",
    }
    return [("", "; ".join(f"{name} {text}" for name, text in parts.items()))] if several else list(parts.items())


def _of_files(role: str, files: Sequence[InputFile]) -> list[tuple[str, str]]:
    """A line for each; one for all where there are many: meshes, partitions of a sweep."""
    if len(files) <= LISTED:
        return [(f"{role} file", f"{f.file}, SHA-256 {f.sha256 or 'unknown, since it is no regular file'}") for f in files]
    together = hashlib.sha256("".join(f.sha256 or "" for f in files).encode()).hexdigest()
    return [(f"{role} files", f"{len(files)} files, from {files[0].file} to {files[-1].file}, SHA-256 of their hashes {together}")]


def _shown(value: object) -> str:
    return "" if value is True else str(value)
