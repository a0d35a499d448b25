"""Options that say how a motion is read."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

import typer

from ksl.commands.options import Decorator, with_options

MOTION_HELP = "CSV, Excel workbook, Parquet, NPZ, MCAP or ROS bag with the positions of all moving joints over time; - is standard input."


@dataclass(frozen=True)
class MotionOptions:
    """How a motion is read: arguments of `ksl.read_motion`.  A command whose argument `reading` is one has these options."""

    map: Annotated[
        Path | None,
        typer.Option(
            "--map", metavar="FILE", help="Which column of the motion is which joint's, and its unit, sign, scale and offset: TOML or CSV (docs/motions.md)."
        ),
    ] = None
    degrees: Annotated[bool, typer.Option("--degrees", help="Angles of the motion and their rates are in degrees.")] = False
    time_unit: Annotated[
        str | None, typer.Option("--time-unit", metavar="s|ms|us|ns|min", help="Unit of the motion's times; s unless its file says another.")
    ] = None
    resample: Annotated[float | None, typer.Option("--resample", metavar="HZ", help="Resample the motion to equal steps, on quintic splines.")] = None
    start: Annotated[float | None, typer.Option("--from", metavar="SECONDS", help="Use the motion from this time on.")] = None
    stop: Annotated[float | None, typer.Option("--to", metavar="SECONDS", help="Use the motion up to this time.")] = None
    ignore_extra: Annotated[bool, typer.Option("--ignore-extra", help="Leave out columns of the motion that belong to no joint.")] = False
    topic: Annotated[str | None, typer.Option("--topic", metavar="NAME", help="Topic of a bag, where several have joint states, or sheet of a workbook.")] = (
        None
    )
    positions_only: Annotated[
        bool, typer.Option("--positions-only", help="Differentiate the positions, even if the motion has velocities or accelerations.")
    ] = False


def of_motion(without: Collection[str] = ()) -> Decorator:
    """A command with the options of MotionOptions in the place of its argument `reading`, without some."""
    return with_options("reading", MotionOptions, [each.name for each in fields(MotionOptions) if each.name not in without])
