"""The contents of a robot file as text: the tree, joints, limits, masses, gravity, and unused contents.

Tables and tree are written by functions of this module, in time that grows with the number of links alone.  Those of the package
rich take half a millisecond a row, and its trees indent without end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.cells import cell_len
from rich.console import Console
from rich.text import Text

from ksl.commands.app import say
from ksl.commands.print_loops import print_loops
from ksl.mechanism.mechanism import Joint, Mechanism
from ksl.mechanism.model_tables import force_element_table, given_physics, joint_table, link_table

DEEPEST_INDENT = 20
"""Levels of the tree beyond this one are written as numbers; in narrow terminals, those beyond a tenth of the columns, whose indents take two fifths of them."""


def print_info(model: Mechanism, console: Console) -> None:
    """Prints everything that `ksl info` shows of a model."""
    moving, following = len(model.joint_names), len(model.follower_names)
    of_followers = f"mimic joints {following}, " if following else ""
    console.print(Text(f"{model.name} ({model.file})", style="bold"))
    of_tree = "coordinates of the tree" if model.loops else "degrees of freedom"
    console.print(
        f"{of_tree} {model.nv} (nq {model.nq}), moving joints {moving}, {of_followers}fixed joints {len(model.joints) - moving - following}, links {len(model.links)}"
    )
    console.print(f"total mass {model.mass:.6g} kg, gravity ({', '.join(f'{g:g}' for g in model.gravity)}) m/s²")
    console.print(
        f"physics of joints: {', '.join(model.physics) or 'none; --physics applies what joints have'}\n"
        if model.physics or model.force_elements or given_physics(model.joints)
        else ""
    )
    console.out("\n".join(tree_lines(model, console.width)), highlight=False)
    if model.loops:
        print_loops(model, console)
    _print_table(console, "Force elements between two points, in m and N", *force_element_table(model))
    followers = "the mimic joints and " if following else ""
    _print_table(console, f"Joints, in the order of q, then {followers}the fixed ones", *joint_table(model))
    _print_table(console, "Links with mass: centroid in the link's frame (m), inertia about it (kg m²)", *link_table(model))
    for title, lines in (("Warnings", model.warnings), ("In the file and not used", model.unused)):
        if lines:
            console.print(Text(f"\n{title}", style="bold"))
            for line in lines:
                say(console, f"  {line}")


def tree_lines(model: Mechanism, width: int = 200) -> Iterator[str]:
    """A line for each link, below the one that carries it; parents first, children in the order of the file.

    Joints that don't fit into the columns beside their links are below them.
    """
    deepest = min(DEEPEST_INDENT, width // 10)
    children: dict[str | None, list[Joint]] = {}
    order = {link.name: i for i, link in enumerate(model.links)}
    for joint in sorted(model.joints, key=lambda j: order[j.child]):
        children.setdefault(joint.parent, []).append(joint)
    yield "ground"
    pending = [(joint, "", joint is children[None][-1], 1) for joint in reversed(children[None])]
    while pending:
        joint, guides, last, level = pending.pop()
        deep = f"({level}) " if level > deepest else ""
        below = children.get(joint.child, [])
        further = guides + ("    " if last else "│   ") if level < deepest else guides
        link, name = f"{guides}{'└── ' if last else '├── '}{deep}{joint.child}", f"{joint.name}, {joint.kind}"
        if cell_len(link) + 2 + cell_len(name) <= width:
            yield f"{link}  {name}"
        else:
            yield from (link, f"{guides}{'    ' if last else '│   '}{'│ ' if below else '  '}{name}")
        pending.extend((child, further, child is below[-1], level + 1) for child in reversed(below))


def _print_table(console: Console, title: str, groups: Sequence[Sequence[str]], rows: Sequence[Sequence[str]]) -> None:
    if rows:
        console.print(Text(f"\n{title}", style="bold"))
        console.out("\n".join(table_lines(groups, rows, console.width)), highlight=False)


def table_lines(groups: Sequence[Sequence[str]], rows: Sequence[Sequence[str]], width: int) -> Iterator[str]:
    """A table as lines.  groups: the headings, in groups of columns that belong together; the first column is that of the names.

    Columns that don't fit beside the others follow below, with the names again: nothing is cut.  Columns of numbers are aligned
    to the right.  Empty columns are left out.
    """
    columns = iter(zip(*rows))
    filled = [[_aligned(heading, cells) for heading, cells in zip(group, columns) if any(cells)] for group in groups]
    names, *others = [column for group in filled for column in group]
    first_of_group = {id(group[0]): sum(cell_len(column[0]) + 2 for column in group) for group in filled if group}
    block, used = [names], cell_len(names[0])
    for column in others:
        own = cell_len(column[0]) + 2
        whole = first_of_group.get(id(column), own)  # a group starts where all of it fits, if that is possible
        if len(block) > 1 and used + whole > width:
            yield from (*_block_lines(block), "")
            block, used = [names], cell_len(names[0])
        block.append(column)
        used += own
    yield from _block_lines(block)


def _block_lines(columns: Sequence[Sequence[str]]) -> list[str]:
    lines = ["  ".join(cells).rstrip() for cells in zip(*columns)]
    return [lines[0], "─" * max(map(cell_len, lines)), *lines[1:]]


def _aligned(heading: str, cells: Sequence[str]) -> list[str]:
    """Heading and cells, filled with blanks to one width."""
    widths = [cell_len(cell) for cell in cells]
    width = max(cell_len(heading), *widths)
    to_the_right = all(_is_number(cell) for cell in cells)
    filled = [" " * (width - n) + cell if to_the_right else cell + " " * (width - n) for cell, n in zip(cells, widths)]
    blanks = " " * (width - cell_len(heading))
    return [blanks + heading if to_the_right else heading + blanks, *filled]


def _is_number(cell: str) -> bool:
    try:
        return cell in ("", "–") or float(cell) == float(cell)
    except ValueError:
        return False
