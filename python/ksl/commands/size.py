"""`ksl size`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ksl.commands.app import app, console, discard_output, fail, is_of_printing, print_for_programs, print_json, unwritable
from ksl.commands.options import in_options, numbers, path_with_a_name, results_with_a_name

if TYPE_CHECKING:
    from ksl.sizing.joints.sizing import Sizing


@app.command()
def size(
    results: Annotated[
        Path | None, typer.Argument(parser=results_with_a_name, metavar="RESULTS", help="Folder that `ksl loads` has written, or its wrenches.parquet.")
    ] = None,
    components: Annotated[
        Path | None, typer.Argument(metavar="COMPONENTS.toml", help="Components with catalogue numbers; without it, the simultaneous loads alone.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", parser=path_with_a_name, metavar="DIR", help="Folder for sizing.parquet, .csv, .json and peaks.parquet, .csv."),
    ] = None,
    joints: Annotated[str, typer.Option(metavar="NAME,NAME", help="Only these joints.")] = "",
    at: Annotated[
        list[str], typer.Option(metavar="JOINT=X,Y,Z", help="Point of the moments at the peaks, from the joint's origin in its axes, m; may be repeated.")
    ] = [],
    choose: Annotated[
        Path | None,
        typer.Option(
            "--choose", metavar="CATALOGUE", help="Choose components for the tables [[choose]] of COMPONENTS.toml from a catalogue, TOML, CSV or xlsx."
        ),
    ] = None,
    spectra: Annotated[
        bool,
        typer.Option(
            "--spectra", help="Load spectra instead of figures: time and revolutions by torque and speed, rainflow matrices, loads of each bearing in classes."
        ),
    ] = False,
    classes: Annotated[int, typer.Option("--classes", metavar="N", help="With --spectra: classes of each bearing's loads, at most.")] = 20,
    peaks: Annotated[bool, typer.Option("--peaks", help="Print what acts together at each peak, too.")] = False,
    brief: Annotated[bool, typer.Option("--brief", help="Print one line for each figure, without inputs and formulas.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print everything as JSON instead.")] = False,
    xlsx: Annotated[bool, typer.Option("--xlsx", help="With -o: sizing.xlsx too, a workbook with a sheet for each table.")] = False,
    fail_on: Annotated[
        list[str],
        typer.Option(
            "--fail-on", metavar="utilisation|left-out", help="End with status 3 if a utilisation is above 1, or a figure is left out; may be repeated."
        ),
    ] = [],
    force: Annotated[bool, typer.Option("--force", help="Replace the sizing of another robot in DIR, or files of others with its names.")] = False,
    example: Annotated[bool, typer.Option("--example", help="Print a commented components file, for the robot of RESULTS if they are given, and end.")] = False,
) -> None:
    """Check motors, gears, bearings, bolts, pins, bushes, cylinders and sections against the loads of their joints.

    Each figure has its formula, source and inputs, and a utilisation: 1 is at the limit. `ksl size --example > components.toml`
    writes a file to fill in.
    """
    from ksl.base.errors import SizingError
    from ksl.output import OutputError
    from ksl.sizing.catalogue.example import example_file

    if example and results is None:
        print_for_programs(example_file())
        return
    if results is None:
        fail("size needs the results of `ksl loads`, or --example")
    for word in fail_on:
        if word not in ("utilisation", "left-out"):
            fail(f"--fail-on {word}: expected utilisation or left-out")
    if choose is not None and (spectra or components is None):
        fail(
            f"--choose {choose}: "
            + ("--spectra has no components to choose" if spectra else "needs COMPONENTS.toml with tables [[choose]]: joint and kind of each choice")
        )
    if xlsx and output is None:
        fail("--xlsx writes sizing.xlsx into a folder; give it by -o DIR")
    points = _points(at)
    try:
        if example:
            print_for_programs(_example_of(results))
            return
        from ksl.sizing.joints.compute_sizing import size as size_components

        chosen = [name.strip() for name in joints.split(",")] if joints else None
        if spectra:
            _spectra(results, components, chosen, points, output, json, classes, xlsx, force)
            return
        sizing = size_components(results, components, joints=chosen, at=points, choose=choose)
        written = sizing.write(output, force, xlsx) if output else []
    except (SizingError, OutputError) as e:
        fail(in_options(e, joints=joints, at=at))
    except ModuleNotFoundError as e:
        fail(f"this needs the package {e.name}; install it with: pip install 'ksl[size]'")
    _print(sizing, json, brief, peaks or components is None, output, written)
    if ("utilisation" in fail_on and sizing.exceeded) or ("left-out" in fail_on and sizing.left_out):
        raise typer.Exit(3)


def _spectra(
    results: Path, components: Path | None, joints: list[str] | None, points: dict[str, list[float]],
    output: Path | None, as_json: bool, classes: int, xlsx: bool, force: bool,
) -> None:  # fmt: skip
    """Computes load spectra, writes and prints them."""
    from ksl.commands.print_spectra import print_spectra
    from ksl.sizing.spectra.compute_spectra import spectra

    if classes < 1:
        fail(f"--classes {classes}: expected a whole number, 1 or more")
    found = spectra(results, joints, at=points, components=components)
    written = found.write(output, force, xlsx, classes) if output else []
    if as_json:
        print_json(found.as_dict(classes), indent=1)
        return
    print_spectra(found, console(80), classes)
    if output:
        print(f"written to {output}: {', '.join(written)}")


def _print(sizing: Sizing, as_json: bool, brief: bool, peaks: bool, output: Path | None, written: list[str]) -> None:
    """Prints the figures, and what was written."""
    from ksl.commands.print_sizing import print_sizing

    try:
        if as_json:
            print_json(sizing.as_dict(), indent=1)
        else:
            print_sizing(sizing, console(80), brief, peaks)
            if output:
                print(f"written to {output}: {', '.join(written)}")
    except BrokenPipeError:  # nobody reads what is printed: as any command
        raise
    except OSError as e:
        if not is_of_printing(e):
            raise
        discard_output()
        fail(f"{unwritable(e)}" + (f"; results are in {output}" if output else ""))


def _example_of(results: Path) -> str:
    """An example on the first joint of the results that turns, and the first that slides."""
    from ksl.sizing.catalogue.example import example_file
    from ksl.sizing.results import read_results

    table = read_results(results)
    turning = [joint.name for joint in table.joints.values() if joint.turns]
    sliding = next((joint.name for joint in table.joints.values() if joint.driven and not joint.turns), None)
    return example_file(turning[0] if turning else next(iter(table.joints)), table.robot, sliding)


def _points(at: list[str]) -> dict[str, list[float]]:
    points = {}
    for text in at:
        name, sign, xyz = text.rpartition("=")
        if not sign or not name:
            fail(f"--at {text}: expected JOINT=X,Y,Z, the joint's name and a point from its origin in its axes, m")
        points[name] = numbers(xyz, f"--at {name}=", 3)
    return points
