"""The repaired file."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from ksl.checks.description.robot import RobotFile
from ksl.checks.description.tags import end_of_root
from ksl.output import OutputError, whole_file

if TYPE_CHECKING:
    from lxml.etree import _ElementTree


def write_tree(robot: RobotFile, out: Path, force: bool = False) -> None:
    """Writes the tree of a robot file to another file, completely or not at all.  Raises OutputError."""

    if out.exists() and os.path.samefile(out, robot.path):
        raise OutputError(f"{out}: is the file that is checked, which is never overwritten; name another file")
    if out.is_dir():
        raise OutputError(f"{out}: is a folder; name a file, {out / robot.path.name} for example")
    if out.exists() and not force:
        raise OutputError(f"{out}: exists; name another file, or overwrite it with --force")
    data = _text(robot)
    with whole_file(out) as part:
        part.write_bytes(data)


def _text(robot: RobotFile) -> bytes:
    """The tree, between what stands before and after the root element in the original, to the byte.

    Where that can't be told, the parser writes the whole file: comments beside the root element stay, and blank lines there may not.
    """
    from lxml import etree

    root = robot.root
    assert root is not None
    original = robot.path.read_bytes()
    tree = root.getroottree()
    encoding = tree.docinfo.encoding or "UTF-8"
    if robot.encoding:
        encoding = "UTF-8"
        if not _is_utf_8(original):
            original = original.decode("latin-1").encode("utf-8")
    before = re.match(rb"(?:\xef\xbb\xbf)?(?:\s|<\?.*?\?>|<!--.*?-->)*", original, re.DOTALL)
    assert before is not None  # it matches nothing, too: if it could fail, the time would be exponential in the number of comments
    text = bytes(etree.tostring(root, encoding=encoding, xml_declaration=False, with_tail=False))
    spliced = before[0] + text + original[end_of_root(original) :]
    if re.match(rb"<[^!?]", original[before.end() : before.end() + 2]) and _reads_as(spliced, tree):  # no DOCTYPE, and one byte a character
        return spliced
    return bytes(etree.tostring(tree, encoding=encoding, xml_declaration=True))


def _is_utf_8(data: bytes) -> bool:
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def _reads_as(data: bytes, tree: _ElementTree) -> bool:
    """Whether a parser makes this tree of the data, and the same comments beside its root."""
    from lxml import etree

    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False)
    try:
        other = etree.fromstring(data, parser).getroottree()
    except (etree.XMLSyntaxError, ValueError, LookupError):
        return False
    return bool(etree.tostring(other) == etree.tostring(tree))
