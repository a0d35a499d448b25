"""Files of free bodies: tables, JSON and decks, all of them or none."""

from __future__ import annotations

import csv
import io
import json
import os
import re
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from functools import partial
from pathlib import Path
from typing import Any

from ksl._core import __version__
from ksl.base import workbooks
from ksl.base.csv_cells import csv_comment, csv_text
from ksl.base.errors import PartError
from ksl.base.printable import one_line
from ksl.mechanism.given import names
from ksl.output import OutputError, refuse_inputs, refuse_unknown, staged
from ksl.parts import calculix, nastran
from ksl.parts.cases import Cases
from ksl.parts.free_body import COMPONENTS, FreeBody, open_components
from ksl.parts.mesh import read_mesh
from ksl.parts.part_loads import DeckOptions, PartLoads, check_links, check_wrenches, part_loads

WRENCHES, MOTIONS, JSON, WORKBOOK = "free_bodies.csv", "motions.csv", "free_bodies.json", "free_bodies.xlsx"
FILES = (WRENCHES, MOTIONS, JSON, WORKBOOK)
SOLVERS = {"calculix": "calculix.inp", "abaqus": "abaqus.inp", "nastran": "nastran.bdf"}
"""{solver: how the name of its decks ends}."""

NAME_LENGTH = 80
"""Characters of a link's name in the names of its decks."""

AXES = ("x", "y", "z")
OF_WRENCH = {
    "": ("case", "load_case", "link", "frame", "kind", "name"),
    "s": ("time",),
    "m": AXES,
    "N": COMPONENTS[:3],
    "N m": COMPONENTS[3:],
    " ": ("undetermined",),
}
OF_MOTION = {
    "": ("case", "load_case", "link", "frame", "links", "why"), "s": ("time",), "kg": ("mass",), "m": tuple(f"center_{i}" for i in AXES), "m/s²": (*(f"a{i}" for i in AXES), *(f"g{i}" for i in AXES)),
    "rad/s": tuple(f"w{i}" for i in AXES), "rad/s²": tuple(f"alpha{i}" for i in AXES), "N": ("residual_force",), "N m": ("residual_moment",), " ": ("complete",),
}  # fmt: skip
"""Columns of the tables by their units."""

CONVENTIONS = (
    "every row is what acts on the body, in the axes of `frame` (of the topmost link, or of the part), moments about the point x y z from its origin; "
    "the rows of a case and link, gravity and inertia among them, are in balance; inertia is minus the rate of momentum"
)


def write(
    cases: Cases, directory: str | os.PathLike[str], decks: Sequence[str] = (), meshes: Mapping[str, str | os.PathLike[str]] | None = None,
    options: DeckOptions = DeckOptions(), xlsx: bool = False, force: bool = False,
) -> tuple[list[str], list[str]]:  # fmt: skip
    """See :meth:`ksl.parts.free_body_cases.FreeBodyCases.write`.  Returns the names of files, and notes about decks."""
    folder, given = Path(directory), dict(meshes or {})
    solvers = names(decks, "decks") if decks else ["calculix"] if given else []
    for solver in solvers:
        if solver not in SOLVERS:
            raise PartError(f"decks: {solver!r} is none of {', '.join(SOLVERS)}; users of other programs import {WRENCHES}")
    if xlsx and (missing := workbooks.is_missing()):
        raise OutputError(f"{WORKBOOK}: {missing}")
    check_links(cases, given)
    parts = _parts(cases, given, options) if solvers else []
    names_of = _file_names([part.link for part in parts])
    texts = {
        f"{names_of[part.link]}_{SOLVERS[solver]}": _deck(part, solver, [*_head(cases), *(one_line(note) for note in cases.notes)])
        for part in parts
        for solver in solvers
    }
    known = [*FILES, *texts, *_earlier(folder)]
    refuse_inputs([folder / name for name in known], [os.fspath(mesh) for mesh in given.values()])
    with staged(folder, known, None if force else partial(_refuse_others, folder, known, cases.made_of["robot"])) as stage:
        _write_csv(stage / WRENCHES, OF_WRENCH, _wrench_rows(cases), cases)
        _write_csv(stage / MOTIONS, OF_MOTION, _motion_rows(cases), cases)
        if xlsx:
            _write_workbook(stage / WORKBOOK, cases)
        for name, text in texts.items():
            (stage / name).write_text(text, encoding="utf-8", errors="replace")
        written = [WRENCHES, MOTIONS, JSON, *([WORKBOOK] if xlsx else []), *texts]
        (stage / JSON).write_text(json.dumps(as_dict(cases) | {"files": written}, indent=1, ensure_ascii=False) + "\n", encoding="utf-8", errors="replace")
    return written, [note for part in parts for note in part.notes]


def as_dict(cases: Cases) -> dict[str, Any]:
    """Everything in numbers and words, as JSON can hold it."""
    bodies = [{top: body.as_dict() for top, body in case.bodies.items()} for case in cases]
    rows = [
        {"time": case.time, "load_case": case.case, "why": [list(pair) for pair in case.why], "complete": case.complete, "bodies": of}
        for case, of in zip(cases, bodies, strict=True)
    ]
    return {"made_of": cases.made_of, "conventions": CONVENTIONS, "shares": cases.shares, "notes": list(cases.notes), "cases": rows}


def _parts(cases: Cases, meshes: Mapping[str, str | os.PathLike[str]], options: DeckOptions) -> list[PartLoads]:
    """The loads of links with meshes, or of all links where there are none."""
    if not len(cases):
        return []
    check_wrenches(cases, meshes or cases.links, options)
    if meshes:
        return [part_loads(cases, link, read_mesh(mesh), options) for link, mesh in meshes.items()]
    return [part_loads(cases, link, None, options) for link in cases.links]


def _deck(part: PartLoads, solver: str, head: Sequence[str]) -> str:
    lines = nastran.deck(part, head) if solver == "nastran" else calculix.deck(part, head, "abaqus" if solver == "abaqus" else "calculix")
    return "\n".join(lines) + "\n"


def _file_names(links: Sequence[str]) -> dict[str, str]:
    """A name for the files of each link that every system takes, no two of which differ in capitals alone."""
    found: dict[str, str] = {}
    for link in links:
        plain = re.sub(r"[^A-Za-z0-9._-]", "_", link).lstrip(".")[:NAME_LENGTH] or "part"
        taken = {name.lower() for name in found.values()}
        found[link] = next(name for k in range(1, len(links) + 1) if (name := plain if k == 1 else f"{plain}_{k}").lower() not in taken)
    return found


def _head(cases: Cases) -> list[str]:
    """Where the numbers come from."""
    now = datetime.now(timezone.utc).isoformat(timespec="seconds").replace("+00:00", "Z")
    return [f"ksl {__version__}, free bodies, {now}", *(csv_comment(f"{name}: {said}") for name, said in cases.made_of.items())]


def _write_csv(path: Path, columns: Mapping[str, Sequence[str]], rows: Sequence[Sequence[Any]], cases: Cases) -> None:
    text = io.StringIO()
    lines = [*_head(cases), CONVENTIONS, "units: " + ", ".join(f"{' '.join(of)} {unit}" for unit, of in columns.items() if unit.strip())]
    text.writelines(f"# {line}\n" for line in lines)
    table = csv.writer(text, lineterminator="\n")
    table.writerow([name for of in columns.values() for name in of])
    table.writerows([csv_text(x) if isinstance(x, str) else repr(x) if isinstance(x, float) else x for x in row] for row in rows)
    path.write_text(text.getvalue(), encoding="utf-8", errors="replace")


def _wrench_rows(cases: Cases) -> list[list[Any]]:
    return [
        [i, case.case, top, body.frame, kind, name, case.time, *map(float, point), *map(float, wrench), open_now]
        for i, case in enumerate(cases, 1)
        for top, body in case.bodies.items()
        for kind, name, point, wrench, open_now in _acting(body)
    ]


def _acting(body: FreeBody) -> list[tuple[str, str, Any, Any, str]]:
    """All that acts: kind, name, point, wrench, and components that are open."""
    own = [("gravity", body.link, (0.0, 0.0, 0.0), body.gravity, ""), ("inertia", body.link, (0.0, 0.0, 0.0), body.inertia, "")]
    return [*((w.kind, w.name, w.point, w.wrench, " ".join(open_components(w.undetermined))) for w in body.wrenches), *own]


def _motion_rows(cases: Cases) -> list[list[Any]]:
    rows = []
    for i, case in enumerate(cases, 1):
        for top, body in case.bodies.items():
            vectors = (body.center_of_mass, body.acceleration, body.gravity_field, body.angular_velocity, body.angular_acceleration)
            left = [float(abs(body.residual[part]).max()) for part in (slice(0, 3), slice(3, 6))]
            words = [i, case.case, top, body.frame, " ".join(body.links), case.reason]
            rows.append([*words, case.time, body.mass, *(float(x) for v in vectors for x in v), *left, "yes" if body.complete else "no"])
    return rows


def _write_workbook(path: Path, cases: Cases) -> None:
    book = workbooks.new_workbook()
    for title, columns, rows in (("Free bodies", OF_WRENCH, _wrench_rows(cases)), ("Motions", OF_MOTION, _motion_rows(cases))):
        workbooks.add_table(book, title, [name for of in columns.values() for name in of], [unit.strip() for unit, of in columns.items() for _ in of], rows)
    said = [*cases.made_of.items(), *((f"share of {what}", f"{share:.3f}") for what, share in cases.shares.items()), *(("note", note) for note in cases.notes)]
    workbooks.add_lines(book, "About", [("made by", f"ksl {__version__}"), *said, ("conventions", CONVENTIONS)])
    workbooks.save(book, path)


def _earlier(folder: Path) -> list[str]:
    """Files that earlier free bodies in the folder say to be theirs: decks that this run doesn't write are removed."""
    said = _said(folder).get("files", [])
    return (
        [name for name in said if isinstance(name, str) and os.path.basename(name) == name and name.endswith(tuple(SOLVERS.values()))]
        if isinstance(said, list)
        else []
    )


def _said(folder: Path) -> dict[str, Any]:
    try:
        found = json.loads((folder / JSON).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _refuse_others(folder: Path, known: Sequence[str], robot: str) -> None:
    """Raises where the folder holds free bodies of another robot, or files of others with these names."""
    made_of = _said(folder).get("made_of")
    if not isinstance(made_of, dict):
        refuse_unknown(folder, known, f"{JSON} of KSL")
    elif made_of.get("robot") != robot:
        raise PartError(f"{folder}: holds free bodies of {made_of.get('robot')}, and these are of {robot}; give another folder with -o, or --force")
