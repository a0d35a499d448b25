"""What `ksl size --spectra` prints: equivalent loads of each joint, and the loads of its bearing in classes."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from ksl.commands.app import say
from ksl.commands.print_info import table_lines
from ksl.sizing.figures import significant
from ksl.sizing.life import BALL, ROLLER, mean_speed
from ksl.sizing.utilisation.sheet import RPM
from ksl.sizing.spectra.bearing_classes import COLUMNS
from ksl.sizing.spectra.spectra import Spectra
from ksl.sizing.spectra.spectra_of_joints import SpectraOfJoints

POWERS = {"3": BALL, "10/3": ROLLER}


def print_spectra(found: SpectraOfJoints, console: Console, classes: int) -> None:
    """Equivalent loads of all joints for each exponent, the classes where there is one bearing, and the notes."""
    turning = {name: s for name, s in found.items() if s.samples.joint.turns}
    for power, p in POWERS.items() if turning else ():
        names = ["torque N m", "radial N", "axial N", "tilting N m", "r/min", "turns"]
        _table(console, f"Equivalent loads, p = {power}", [["joint"], names], [[name, *_cells(s, p)] for name, s in turning.items()])
    if len(turning) == 1:
        name, s = next(iter(turning.items()))
        heads = [f"{column.removesuffix('_rpm')} {unit}".strip() for column, unit in COLUMNS.items()]
        rows = [[str(k), *(significant(float(x)) for x in row)] for k, row in enumerate(zip(*s.bearing(classes).values()), 1)]
        _table(console, f"Loads of the bearing of {name}, x along the axis", [["class"], heads], rows)
    console.print()
    for note in found.notes:
        say(console, f"note: {note}")
    if not found:
        say(console, "no joint turns or slides along one axis")


def _cells(s: Spectra, p: float) -> list[str]:
    loads = ["open" if name in s.left_open else significant(x) for name, x in s.bearing_equivalent(p)._asdict().items()]
    return [significant(s.equivalent(p)), *loads, significant(mean_speed(s.samples.speed, s.samples.weight) * RPM), significant(float(s.revolutions.sum()))]


def _table(console: Console, title: str, groups: list[list[str]], rows: list[list[str]]) -> None:
    console.print(Text(f"\n{title}", style="bold"), soft_wrap=True)
    console.out("\n".join(table_lines(groups, rows, max(console.width, 60))), highlight=False)
