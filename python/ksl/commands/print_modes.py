"""What `ksl modes` prints: the lowest frequencies over the poses, and the modes of the lowest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ksl.commands.app import say
from ksl.commands.print_notes import print_notes, print_unused
from ksl.report.html.numbers import format_number
from ksl.small_motions.frequencies import Frequencies

STRAINED = 0.05
"""Joints with a smaller share in the energy of a mode are not named."""


def print_modes(out: Console, found: Frequencies, written: Sequence[str]) -> None:
    """The tables."""
    count, several = found.frequencies.shape[1], len(found.q) > 1
    if several:
        _print_range(out, found)
    if not count:
        say(out, "no joint gives way, and none is free: there are no frequencies")
    else:
        _print_pose(out, found, count)
    print_notes(out, found.doubts)
    print_unused(out, found.model)
    for line in written:
        say(out, line)


def _print_range(out: Console, found: Frequencies) -> None:
    table = Table(
        "mode", "lowest, Hz", "highest, Hz", "lowest at" if found.time is not None else "lowest in pose", box=None, pad_edge=False, header_style="dim"
    )
    for k, column in enumerate(found.frequencies.T):
        at = int(np.nanargmin(column))
        when = f"{found.time[at]:.6g} s" if found.time is not None else _pose(found, at)
        table.add_row(str(k + 1), _hertz(np.nanmin(column)), _hertz(np.nanmax(column)), Text(when))
    out.print(table)
    where = f"at {found.time[found.lowest]:.6g} s" if found.time is not None else "in this pose"
    say(out, f"{len(found.q)} poses; the lowest is {_hertz(found.frequencies[found.lowest, 0])} Hz {where}: {_pose(found, found.lowest)}")


def _print_pose(out: Console, found: Frequencies, count: int) -> None:
    modes = found.modes
    table = Table("mode", "Hz", "kg x", "y", "z", "what gives way", box=None, pad_edge=False, header_style="dim")
    for column in table.columns[1:5]:
        column.justify = "right"
    zero = iter(modes.zero)
    for k, f in enumerate(modes.frequencies[:count]):
        shares = sorted(((share, joint) for share, joint in zip(modes.strain[k], modes.joints) if share >= STRAINED), reverse=True)
        said = ", ".join(f"{joint} {100 * share:.0f} %" for share, joint in shares)
        if f == 0:
            said = f"nothing resists: {', '.join(next(zero))}"
        elif f < 0:
            said = f"falls away; {said}" if said else "falls away"
        table.add_row(str(k + 1), _hertz(f), *(format_number(x) for x in modes.effective_mass[k, :3]), Text(said))
    out.print(table)


def _hertz(f: float) -> str:
    return format_number(float(f))


def _pose(found: Frequencies, k: int) -> str:
    joints = [joint for joint in found.model.joints if joint.nq == 1]
    return ", ".join(f"{joint.name} {format_number(float(found.q[k, joint.q_index]))}" for joint in joints)
