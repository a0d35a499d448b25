"""`ksl check`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ksl.commands.app import app, console, fail, print_json
from ksl.commands.options import RobotOptions, RobotText, of_robot, xacro_arguments

if TYPE_CHECKING:
    from ksl.checks.run import Fixed


@app.command()
@of_robot()
def check(
    robot: RobotText,
    ignore: Annotated[list[str], typer.Option("--ignore", metavar="RULE", help="A rule that is left out, inertia-triangle for example; may be repeated.")] = [],
    package_path: Annotated[list[Path], typer.Option("--package-path", metavar="DIR", help="Where the packages of package:// are; may be repeated.")] = [],
    symmetry: Annotated[
        float, typer.Option("--symmetry", metavar="SHARE", help="Share of its mass by which a limb may differ from that of the other side.")
    ] = 0.05,
    fix: Annotated[
        Path | None, typer.Option("--fix", metavar="OUT.urdf", help="Write the repaired file there; print what was changed and what is left.")
    ] = None,
    accept: Annotated[
        list[str], typer.Option("--accept", metavar="RULE", help="With --fix: repair this rule's findings, too; their likely cause is right. May be repeated.")
    ] = [],
    force: Annotated[bool, typer.Option("--force", help="Overwrite OUT.urdf if it exists.")] = False,
    everything: Annotated[bool, typer.Option("--all", help="Print every place, and not the first five of a rule.")] = False,
    how: RobotOptions = RobotOptions(),
    json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Look for what is wrong in a robot file: masses and inertias, joints, limits, names, meshes, the tree.

    Exit status: 0 clean, 1 warnings, 2 errors, or no file to check. With --fix it is that of the repaired file.
    """
    from ksl.checks.run import check as check_file
    from ksl.checks.run import fix as fix_file
    from ksl.checks.show import print_findings, print_fixed
    from ksl.output import OutputError

    if (accept or force) and fix is None:
        fail("--accept and --force are for --fix OUT.urdf; give it, or leave them out")
    if how.xacro is not None and fix is not None:
        fail("--xacro and --fix: what xacro makes is repaired where it comes from, in the xacro file; leave one of them out")
    options: dict[str, Any] = {"ignore": ignore, "package_paths": package_path, "symmetry": symmetry, "loops": how.loops or None, "drives": how.motors}
    options |= {"floating_base": how.floating_base, "mimic": how.mimic, "strict": how.strict, "model": how.model_name or None}
    try:
        fixed = fix_file(robot, fix, accept=accept, force=force, **options) if fix else None
        findings = fixed.left if fixed else check_file(robot, xacro=xacro_arguments(how.xacro, how.package), **options)
    except (ValueError, OutputError) as e:
        fail(_of_option(e, ignore, accept, package_path, symmetry, how.mimic))
    if json:
        print_json(findings.as_dict() | (_changes(fixed) if fixed else {}))
    elif fixed:
        print_fixed(fixed, console(80), everything)
    else:
        print_findings(findings, console(80), everything)
    raise typer.Exit(findings.status)


def _of_option(error: Exception, ignore: list[str], accept: list[str], package_path: list[Path], symmetry: float, mimic: str) -> str:
    """What Python says of an argument, said of the option that gave it."""
    from ksl.commands.options import in_options

    given: dict[str, list[Any]] = {
        "ignore": ignore,
        "accept": accept,
        "package_path": [str(path) for path in package_path],
        "symmetry": [symmetry],
        "mimic": [mimic],
    }
    said = [in_options(error, **{name: value}) for name, values in given.items() for value in values]
    return next((text for text in said if text != str(error)), str(error))


def _changes(fixed: Fixed) -> dict[str, Any]:
    changes = [{"rule": f.rule, "line": f.line, "kind": f.kind, "name": f.name, "change": change} for f, change in fixed.changes]
    return {"changes": changes}
