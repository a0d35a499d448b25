"""What made the results, what they assume, and a place to sign: what a signature needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ksl.base.files_read import InputFile
from ksl.base.markup import html as escape
from ksl.base.notes import NoteKind, of_kind
from ksl.load_cases.provenance import Provenance
from ksl.load_cases.verdict import NAMED

MASSES = "Masses, centres of mass and inertias are those of the robot's file, with the payloads named above. They were not measured."
LIMITS = "Limits are those of the robot's file. They are limits of single peaks; lives, fatigue and temperatures are not assessed by them."
EFFECTS = ("damping", "friction", "armature", "rotor", "spring", "force elements")
"""What `physics` may name, as people say it; exact friction is friction, rotor bodies are rotors."""

Case = Mapping[str, Any]


def assumptions(cases: Sequence[Case]) -> list[str]:
    """What the results of these load cases assume, as `Provenance.cases` describes them."""
    lines = [*_by_case(cases, _rigidity), *_by_case(cases, _followed), MASSES, LIMITS, *_by_case(cases, _physics)]
    return lines


def _by_case(cases: Sequence[Case], sentence: Callable[[Case], str]) -> list[str]:
    """A sentence of each case; those that not all say begin with the names of the cases."""
    alike: dict[str, list[str]] = {}
    for case in cases:
        alike.setdefault(sentence(case), []).append(str(case.get("name", "")))
    return [
        text if len(alike) == 1 else f"{', '.join(names[:NAMED]) + (f' and {len(names) - NAMED} more' if len(names) > NAMED else '')}: {text}"
        for text, names in alike.items()
    ]


def _rigidity(case: Case) -> str:
    stiff = case.get("compliance")
    if not stiff:
        return "Links are rigid, and joints have neither play nor compliance."
    return (
        f"Links are rigid, and joints have no play. Those with stiffnesses ({', '.join(stiff)}) give way: this decides how they share what rigid bodies "
        "leave open, and moves nothing. Joints without one are rigid."
    )


def _followed(case: Case) -> str:
    kind = [case.get("kind", "")]
    if of_kind(kind, NoteKind.SIMULATED):
        return f"The motion is computed ({kind[0]}), and is that of rigid bodies."
    return "The mechanism is at rest." if of_kind(kind, NoteKind.HELD) else "The motion is followed exactly."


def _physics(case: Case) -> str:
    on = [str(name) for name in case.get("physics", [])]
    absent = ", ".join(name for name in EFFECTS if not any(name in one for one in on))
    if not on:
        return "Friction, damping, rotor inertias and springs of joints are left out, and force elements: efforts are those at the joint, not the motor's."
    rest = f" Left out: {absent}." if absent else ""
    supplied = "the motor's, or where brakes act the brake's" if case.get("brake") else "the motor's"
    return f"Efforts are {supplied}. They include these effects, with the numbers of the robot's file: {', '.join(on)}.{rest}"


def provenance_section(provenance: Provenance, notes: Sequence[str], components: Sequence[Mapping[str, Any]] = ()) -> str:
    """notes: of the report; those about content that is not used are listed.  components: role, file and sha256 of files beside the inputs of the run."""
    p = provenance
    inputs_of_all = [*p.inputs, *(InputFile(str(f["role"]), str(f["file"]), f.get("sha256")) for f in components)]
    files = "".join(
        f'<tr><th scope="row">{escape(f.role)}</th><td>{escape(f.file)}</td><td><code>{f.sha256 or "none, since it could not be read twice"}</code></td></tr>'
        for f in inputs_of_all
    )
    inputs = (
        '<div class="wide inputs"><table><caption>Inputs</caption><thead><tr><th scope="col">what</th><th scope="col">file</th>'
        f'<th scope="col">SHA-256</th></tr></thead><tbody>{files}</tbody></table></div>'
    )
    given = {name: value for name, value in p.options.items() if value not in ("", None, False, [])}
    facts = [
        ("command", p.command or "called from a program"),
        ("in the folder", p.directory),
        ("date", p.date),
        ("versions", ", ".join(f"{name} {version}" for name, version in p.versions.items())),
        ("options", ", ".join(name.replace("_", " ") if value is True else f"{name.replace('_', ' ')} {value}" for name, value in given.items()) or "none"),
    ]
    rows = "".join(f'<tr><th scope="row">{name}</th><td>{escape(text)}</td></tr>' for name, text in facts if text)
    made = f'<table class="facts"><caption>How they were made</caption><tbody>{rows}</tbody></table>'
    unused = [note.of for note in of_kind(notes, NoteKind.VISUALS, NoteKind.CONTENT)]
    lists = (
        f"<h3>Assumptions</h3>{_list(assumptions(p.cases))}<h3>Content of the robot's file that was ignored</h3>{_list(unused) if unused else '<p>None.</p>'}"
    )
    return f'<section id="provenance"><h2>What made these results</h2>{inputs if files else ""}{made}{lists}</section>'


def signature_box() -> str:
    """On paper alone."""
    cells = "".join(f"<tr><th scope='row'>{who}</th><td></td><td></td><td></td></tr>" for who in ("prepared", "checked", "approved"))
    head = '<tr><td></td><th scope="col">name</th><th scope="col">date</th><th scope="col">signature</th></tr>'
    return f'<table class="sign"><caption>Signatures</caption><thead>{head}</thead><tbody>{cells}</tbody></table><p class="paper">Inputs with SHA-256, command, versions and assumptions: last section.</p>'


def _list(lines: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"
