"""The repaired file."""

from __future__ import annotations

import os
from pathlib import Path

from ksl.checks.robot import RobotFile
from ksl.output import OutputError, staged


def write_tree(robot: RobotFile, out: Path, force: bool = False) -> None:
    """Writes the tree of a robot file to another file, completely or not at all.  Raises OutputError."""
    from lxml import etree

    if out.exists() and os.path.samefile(out, robot.path):
        raise OutputError(f"{out}: is the file that is checked, which is never overwritten; name another file")
    if out.is_dir():
        raise OutputError(f"{out}: is a folder; name a file, {out / robot.path.name} for example")
    if out.exists() and not force:
        raise OutputError(f"{out}: exists; name another file, or overwrite it with --force")
    assert robot.root is not None
    tree = robot.root.getroottree()
    declared = tree.docinfo.encoding if not robot.encoding else None
    data = etree.tostring(tree, encoding=declared or "UTF-8", xml_declaration=True)
    original = robot.path.read_bytes()
    if not original.lstrip().startswith(b"<?xml"):  # none was there
        data = data.partition(b"\n")[2]
    if original.endswith(b"\n") and not data.endswith(b"\n"):
        data += b"\n"
    with staged(out.parent) as folder:
        (folder / out.name).write_bytes(data)
