"""What made the results, what they assume, and a place to sign: what a signature needs."""

from __future__ import annotations

from collections.abc import Sequence
from ksl.base.markup import html as escape

from ksl.load_cases.provenance import Provenance
from ksl.report.input import NOT_USED

ASSUMPTIONS = (
    "Links are rigid, and joints have neither play nor compliance. The motion is followed exactly.",
    "Masses, centres of mass and inertias are those of the robot's file, with the payloads named above. They were not measured.",
    "Limits are those of the robot's file. They are limits of single peaks; lives, fatigue and temperatures are not assessed by them.",
)
WITHOUT_PHYSICS = "Friction, damping, rotor inertias and springs of joints are left out: efforts are those at the joint, not the motor's."
WITH_PHYSICS = "Efforts are the motor's. They include these effects of joints, with the numbers of the robot's file: "


def provenance_section(provenance: Provenance, notes: Sequence[str]) -> str:
    """notes: of the report; those about content that is not used are listed."""
    p = provenance
    files = "".join(
        f'<tr><th scope="row">{escape(f.role)}</th><td>{escape(f.file)}</td><td><code>{f.sha256 or "none, since it could not be read twice"}</code></td></tr>'
        for f in p.inputs
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
    physics = list(dict.fromkeys(name for case in p.cases for name in case.get("physics", [])))
    assumed = [*ASSUMPTIONS, WITH_PHYSICS + ", ".join(physics) + "." if physics else WITHOUT_PHYSICS]
    unused = [note.removeprefix(NOT_USED) for note in notes if note.startswith(NOT_USED)]
    lists = f"<h3>Assumptions</h3>{_list(assumed)}<h3>Content of the robot's file that was ignored</h3>{_list(unused) if unused else '<p>None.</p>'}"
    return f'<section id="provenance"><h2>What made these results</h2>{inputs if files else ""}{made}{lists}</section>'


def signature_box() -> str:
    """On paper alone."""
    cells = "".join(f"<tr><th scope='row'>{who}</th><td></td><td></td><td></td></tr>" for who in ("prepared", "checked", "approved"))
    head = '<tr><td></td><th scope="col">name</th><th scope="col">date</th><th scope="col">signature</th></tr>'
    return f'<table class="sign"><caption>Signatures</caption><thead>{head}</thead><tbody>{cells}</tbody></table><p class="paper">Inputs with SHA-256, command, versions and assumptions: last section.</p>'


def _list(lines: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"
