"""`ksl free-bodies`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ksl.commands.app import GroupedOptions, app, console, errors, fail, print_json
from ksl.commands.options import described_warnings, in_options, named_number, numbers, path_with_a_name, results_with_a_name

if TYPE_CHECKING:
    from ksl.parts.free_body_cases import FreeBodyCases
    from ksl.parts.part_loads import DeckOptions

PRINTED = 24
"""So many cases at most."""


@app.command("free-bodies", cls=GroupedOptions)
def free_bodies(
    results: Annotated[Path, typer.Argument(parser=results_with_a_name, metavar="RESULTS", help="Folder that `ksl loads` has written.")],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", parser=path_with_a_name, metavar="DIR", help="Folder for free_bodies.csv, motions.csv, free_bodies.json and decks."),
    ],
    links: Annotated[str, typer.Option(metavar="NAME,NAME", help="Only the free bodies of these links; otherwise those that have a mesh, or all.")] = "",
    case: Annotated[list[str], typer.Option(metavar="NAME", help="Only this load case; may be repeated.")] = [],
    apart: Annotated[bool, typer.Option("--apart", help="Welded links each for itself, and not as one body.")] = False,
    frame: Annotated[
        list[str], typer.Option(metavar="LINK=X,Y,Z[,R,P,Y]", help="Frame of the CAD part in the link's, m and rad (roll, pitch, yaw); may be repeated.")
    ] = [],
    robot_file: Annotated[Path | None, typer.Option("--robot", metavar="FILE", help="The robot, if the file that the results name has moved.")] = None,
    times: Annotated[str, typer.Option(metavar="T,T", help="At these times, s; otherwise at the peaks of the joints.")] = "",
    peaks: Annotated[str, typer.Option(metavar="NAME,NAME", help="At the peaks of these joints alone.")] = "",
    section: Annotated[
        list[str],
        typer.Option(
            metavar="LINK=X,Y,Z,NX,NY,NZ", help="In few cases that keep most of the loads of a section, by its point, m, and normal; may be repeated."
        ),
    ] = [],
    stress: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="In few cases that keep most of some stresses: [LINK] WRENCH = [[six factors], …], or [[LINK.section]] with point, normal and factors.",
        ),
    ] = None,
    hull: Annotated[bool, typer.Option("--hull", help="In few cases that keep most of whatever the wrenches of a link stress.")] = False,
    most: Annotated[int | None, typer.Option(metavar="N", help="So many cases at most, of each link or section; otherwise as many as keep all.")] = None,
    deck: Annotated[
        list[str],
        typer.Option(metavar="calculix|abaqus|nastran", help="Write decks with a step for each case; may be repeated. With a mesh, calculix without it."),
    ] = [],
    mesh: Annotated[
        list[str], typer.Option(metavar="LINK=PART.inp", help="Mesh of the part, in its frame and the deck's units: the deck then runs as it is.")
    ] = [],
    on_set: Annotated[
        list[str], typer.Option("--set", metavar="WRENCH=SET", help="Node set on which a joint or payload acts; otherwise that of its name.")
    ] = [],
    radius: Annotated[list[str], typer.Option(metavar="WRENCH=R", help="Or it acts on the surface within so much of its point, m.")] = [],
    units: Annotated[str, typer.Option(metavar="m-kg-s|mm-t-s", help="Of decks and meshes.")] = "m-kg-s",
    young: Annotated[float, typer.Option(metavar="E", help="Young's modulus, Pa; otherwise that of steel.")] = 2.1e11,
    poisson: Annotated[float, typer.Option(metavar="NU", help="Poisson's ratio.")] = 0.3,
    density: Annotated[float | None, typer.Option(metavar="RHO", help="kg/m³; otherwise the link's mass over the mesh's volume.")] = None,
    coupling: Annotated[str, typer.Option(metavar="distributing|rigid", help="How reference nodes are carried.")] = "distributing",
    relief: Annotated[bool, typer.Option("--relief", help="Inertia relief: with the accelerations that balance the mesh's own mass.")] = False,
    xlsx: Annotated[bool, typer.Option("--xlsx", help="Write free_bodies.xlsx too.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print everything as JSON instead.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace free bodies of another robot in DIR, or files of others with their names.")] = False,
) -> None:
    """Write load cases of parts: each link with everything that acts on it, in balance, at chosen instants of the loads.

    For finite element programs: tables, and decks for CalculiX, Abaqus and Nastran.
    """
    from ksl.output import OutputError
    from ksl.parts.compute_free_bodies import free_bodies as compute

    chosen = {"--times": times, "--peaks": peaks, "--section": section, "--stress": stress, "--hull": hull}
    if len(two := [option for option, x in chosen.items() if x]) > 1 and two != ["--section", "--stress"]:
        fail(f"{two[0]} and {two[1]}: each says which instants; give one of them")
    if most is not None and not (section or stress or hull):
        fail(f"--most {most}: is for --section, --stress or --hull; peaks and times have their number of cases")
    meshes = _pairs(mesh, "--mesh", "PART.inp")
    factors, sections = _stresses(stress)
    for link, planes in _sections(section).items():
        sections.setdefault(link, []).extend(planes)
    try:
        with described_warnings():
            cases = compute(
                results, numbers_of(times, "--times") if times else None, instants="hull" if hull else None, joints=_words(peaks), links=_words(links) or (None if section or stress else list(meshes) or None), stress=factors or None,
                sections=sections or None, most=most, frames=_frames(frame), welded="apart" if apart else "together", cases=case or None, robot=robot_file,
            )  # fmt: skip
            written = cases.write(output, deck, meshes, _options(on_set, radius, units, young, poisson, density, coupling, relief), xlsx, force)
    except (ValueError, OutputError) as e:
        fail(in_options(e, links=links, times=times, most=most, coupling=coupling, units=units))
    if json:
        from ksl.parts.write import as_dict

        print_json(as_dict(cases), indent=1)
    else:
        _print(cases)
    for note in (*cases.notes, *cases.deck_notes):
        errors.print(f"ksl: note: {note}")
    if not json:
        print(f"written to {output}: {', '.join(written)}")


def numbers_of(text: str, option: str) -> list[float]:
    """As many as there are."""
    return numbers(text, option, text.count(",") + 1)


def _words(text: str) -> list[str] | None:
    return [word.strip() for word in text.split(",")] if text else None


def _pairs(given: list[str], option: str, what: str) -> dict[str, str]:
    found = {}
    for text in given:
        name, sign, value = text.partition("=")
        if not sign or not name or not value:
            fail(f"{option} {text}: expected NAME={what}")
        found[name] = value
    return found


def _sections(given: list[str]) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    for link, xyz in (text.rpartition("=")[::2] for text in given):
        if not link:
            fail(f"--section {xyz}: expected LINK=X,Y,Z,NX,NY,NZ, a point of the section and its normal, in the link's frame")
        x = numbers(xyz, f"--section {link}=", 6)
        found.setdefault(link, []).append((x[:3], x[3:]))
    return found


def _frames(given: list[str]) -> dict[str, Any] | None:
    from ksl.mechanism.given import pose_of

    found = {}
    for link, xyz in (text.rpartition("=")[::2] for text in given):
        if not link:
            fail(f"--frame {xyz}: expected LINK=X,Y,Z or LINK=X,Y,Z,ROLL,PITCH,YAW, m and rad")
        x = numbers(xyz, f"--frame {link}=", 3, 6)
        found[link] = pose_of("--frame", None, x[:3], x[3:] or None, None)
    return found or None


def _stresses(file: Path | None) -> tuple[dict[str, Any], dict[str, list[Any]]]:
    """Factors of stresses on wrenches of links, and sections of links with factors of theirs."""
    from ksl.base.errors import PartError
    from ksl.base.toml_files import read_toml

    if file is None:
        return {}, {}
    sections: dict[str, list[Any]] = {}
    try:
        found = read_toml(file, PartError, "stresses: [LINK] WRENCH = [[six factors], …], or [[LINK.section]]")
    except PartError as e:
        fail(str(e))
    for link, of in found.items():
        if not isinstance(of, dict) or not of:
            fail(
                f"{file}: {link} is no table; expected [{link}] with a line WRENCH = [[six factors], …] for each wrench that stresses it, or [[{link}.section]]"
            )
        if isinstance(planes := of.get("section"), list) and all(isinstance(plane, dict) for plane in planes):
            sections[link] = of.pop("section")
    return {link: of for link, of in found.items() if of}, sections


def _options(on_set: list[str], radius: list[str], units: str, young: float, poisson: float, density: float | None, coupling: str, relief: bool) -> DeckOptions:
    from ksl.parts.part_loads import DeckOptions
    from ksl.parts.units import Material

    near = dict(named_number(text, "--radius", "m") for text in radius)
    return DeckOptions(units, Material(young, poisson, density), _pairs(on_set, "--set", "SET"), near, coupling, relief)  # type: ignore[arg-type]


def _print(cases: FreeBodyCases) -> None:
    """The cases, what they keep, and what is to be known of them."""
    from rich.table import Table
    from rich.text import Text

    out = console(100)
    several = len({case.case for case in cases}) > 1
    table = Table("case", *(["load case"] if several else []), "time (s)", "largest there", box=None, pad_edge=False)
    for i, case in enumerate(cases[:PRINTED], 1):
        table.add_row(str(i), *([Text(case.case)] if several else []), f"{case.time:.6g}", Text(case.reason))
    out.print(table)
    if len(cases) > PRINTED:
        out.print(f"and {len(cases) - PRINTED} more")
    for what, share in cases.shares.items():
        out.print(Text(f"share kept of {what}: {share:.3f}"))
