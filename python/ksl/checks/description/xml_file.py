"""Robot files as XML trees: bytes, encoding, syntax, and numbers in attributes and elements."""

from __future__ import annotations

import codecs
import math
import re
import unicodedata
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ksl.base import input_files, limits
from ksl.base.errors import DescriptionError
from ksl.checks.description.robot import Array, Kind, Note, RobotFile
from ksl.checks.description.tags import balanced
from ksl.checks.description.vocabulary import ELEMENTS

if TYPE_CHECKING:
    from lxml.etree import _Element

LARGEST_MENDED = 4 << 20
"""Bytes up to which tags that are not closed are looked for."""

NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?$|[-+]?(inf|infinity|nan)$", re.ASCII | re.IGNORECASE)
"""A digit can belong to one part only: otherwise the time would be quadratic in the number of digits."""

_NO_BLANKS = {
    ord(c): "?"
    for c in "\x0b\x0c\x1c\x1d\x1e\x1f\x85\xa0\u1680\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2007\u2008\u2009\u200a\u2028\u2029\u202f\u205f\u3000"
}
"""What Python takes for blanks, and XML doesn't."""

_LONG_VALUE = re.compile(rb"=\s*(?:\"[^\"<]{%d}|'[^'<]{%d})" % (limits.NAMESPACE_LENGTH + 1, limits.NAMESPACE_LENGTH + 1))


def contents(path: Path) -> bytes:
    """The bytes of a file.  Raises DescriptionError in one sentence where there is nothing to check."""
    try:
        if path.is_dir():
            raise DescriptionError(f"{path}: is a folder; name the robot file in it")
        if path.exists() and not path.is_file():  # not even a pipe that the shell has opened: the loader reads it once more
            raise DescriptionError(f"{path}: is a pipe or device; write the robot to a file first")
        data = input_files.contents(str(path), limits.ROBOT_BYTES)
    except input_files.Unreadable as e:
        raise DescriptionError(f"{path}: {e}; give a robot file: URDF, SDF or MJCF") from None
    except DescriptionError:
        raise
    except (OSError, ValueError) as e:  # of path.exists(): links in a circle, null characters
        raise DescriptionError(f"{path}: can't be read ({input_files.what_os_says(e)}); give a robot file: URDF, SDF or MJCF") from None
    check_xml(data, path)
    return data


def check_xml(data: bytes, path: Path) -> None:
    """Raises DescriptionError for contents that are no XML."""
    if data.startswith((b"#usda", b"PXR-USDC")):
        raise DescriptionError(
            f"{path}: is USD, whose physics ksl.load reads (ksl info prints what it has read); files that are checked are URDF, SDF and MJCF"
        )
    if not data.strip():
        raise DescriptionError(f"{path}: is empty; expected a URDF, SDF or MJCF file")
    is_utf_16 = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    if b"<" not in data or (not is_utf_16 and b"\0" in data[:2000:2]):
        raise DescriptionError(f"{path}: is no XML file; expected URDF, SDF or MJCF")


def parse(robot: RobotFile) -> None:
    """Reads the tree of a file, as :func:`parse_bytes` does."""
    parse_bytes(robot, contents(robot.path))


def parse_bytes(robot: RobotFile, data: bytes) -> None:
    """Reads the tree as far as possible into `robot.root`, and notes errors of syntax and encoding.

    Neither entities nor the network are used: a file from a stranger must not read others.
    """
    from lxml import etree

    line = _long_namespace(data)
    if line is not None:
        robot.syntax.append(Note(line, f"a namespace of more than {limits.NAMESPACE_LENGTH:,} bytes"))
        return
    declared = re.match(rb"(?:\xef\xbb\xbf)?\s*<\?xml[^>]*encoding=[\"']([^\"'>]*)", data)
    encoding = None
    says = declared[1].decode("latin-1") if declared else ""
    if declared and not _can_be(says, data):
        encoding, declared = "utf-8", None
        robot.encoding.append(Note(1, f'encoding="{says[:40]}", and it is UTF-8 or Latin-1'))
    if not declared and not data.startswith((b"\xff\xfe", b"\xfe\xff")):
        try:
            data.decode("utf-8")
        except UnicodeDecodeError as e:
            encoding = "iso-8859-1"
            robot.encoding.append(Note(data.count(b"\n", 0, e.start) + 1, f"byte 0x{data[e.start]:02x} is not UTF-8; read as Latin-1"))
    if len(data) <= LARGEST_MENDED:
        robot.text = data.decode("iso-8859-1")
    try:
        robot.root, robot.syntax = _tree(data, encoding)
        if robot.syntax and len(data) <= LARGEST_MENDED:
            text, tags, robot.cut_short = balanced(data.decode("iso-8859-1"), ELEMENTS if b"<robot" in data else {})
            # Latin-1 has a character for each byte, which come back as they were
            if tags:
                robot.root, others = _tree(text.encode("iso-8859-1"), encoding)
                robot.syntax = tags + others
                robot.mended = not others and not robot.cut_short
    except (etree.XMLSyntaxError, ValueError, LookupError) as e:
        robot.syntax.append(Note(getattr(e, "lineno", None), " ".join(str(e).split())[:200]))


def _can_be(encoding: str, data: bytes) -> bool:
    """Whether there is such an encoding, and it has as many bytes for a character as the data.  Programs of .NET write utf-16 into files that are UTF-8."""
    try:
        codecs.lookup(encoding)
    except (LookupError, ValueError):
        return False
    return b"\0" in data or not encoding.lower().startswith(("utf-16", "utf_16", "utf-32", "utf_32"))


def _long_namespace(data: bytes) -> int | None:
    """The line of a namespace that is longer than the limit; None where there is none.  O(length)."""
    plain = data.replace(b"\0", b"")  # of UTF-16
    for found in _LONG_VALUE.finditer(plain):
        before = plain[max(0, found.start() - limits.NAMESPACE_LENGTH) : found.start()]
        words = before.split()
        if not words or words[-1].startswith(b"xmlns") or words[-1] == before:  # what it names may stand further to the left
            return plain.count(b"\n", 0, found.start()) + 1
    return None


def _tree(data: bytes, encoding: str | None) -> tuple[_Element | None, list[Note]]:
    """The root element as far as the parser can make one, and what it complains about."""
    from lxml import etree

    parser = etree.XMLParser(recover=True, resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, encoding=encoding)
    root = etree.fromstring(data, parser)
    if root is not None and root.prefix is None and root.tag.startswith("{"):
        own = root.tag[: root.tag.index("}") + 1]
        for element in root.iter(f"{own}*"):  # a namespace for the whole file, which loaders don't look at; written as it was
            element.tag = element.tag.removeprefix(own)
    severe = [each for each in parser.error_log if each.level >= etree.ErrorLevels.ERROR and each.type_name != "NS_ERR_UNDEFINED_NAMESPACE"]
    return root, [Note(each.line, " ".join(each.message.split())[:200]) for each in severe]


def children(element: _Element, *tags: str) -> list[_Element]:
    """Child elements of these names, in the order of the file; all without names.  Comments are none."""
    return [child for child in element if isinstance(child.tag, str) and (not tags or child.tag in tags)]


def line_of(element: _Element | None) -> int | None:
    return None if element is None else element.sourceline


def to_float(text: str) -> float | None:
    """A number as robot files have it: with a decimal point, whatever the locale."""
    return float(text) if NUMBER.match(text) else None


def _named(character: str) -> str:
    return f"U+{ord(character):04X}, {unicodedata.name(character, 'a control character').lower()},"


def half_unit(text: str) -> float:
    """Half a unit of the last digit of a number: 0.005 of `0.12`."""
    mantissa, _, exponent = text.lower().strip().partition("e")
    decimals = len(mantissa.partition(".")[2])
    try:
        return 0.5 * 10.0 ** (int(exponent or 0) - decimals)
    except (ValueError, OverflowError):
        return 0.0


class Numbers:
    """Reads numbers for one link or joint, and notes those that can't be read."""

    def __init__(self, robot: RobotFile, kind: Kind, name: str) -> None:
        self.robot, self.kind, self.name = robot, kind, name

    def note(self, line: int | None, found: str) -> None:
        self.robot.unreadable.append(Note(line, found, self.kind, self.name))

    def several(self, text: str | None, count: int, line: int | None, what: str) -> Array | None:
        """`count` finite numbers separated by spaces; None, with a note, where they are not that."""
        words = (text or "").translate(_NO_BLANKS).split()
        values = [to_float(word) for word in words]
        if len(values) != count or any(v is None or not math.isfinite(v) for v in values):
            if "${" not in (text or ""):  # a finding of its own: xacro that was not expanded
                shown = (text or "").strip(" \t\r\n")[:60]
                strange = None if re.search("[a-df-zA-DF-Zµ]", shown) else next((c for c in shown if c > "~"), None)
                mend = (
                    "; numbers have a decimal point" if "," in shown else f"; {_named(strange)} only looks like a blank, a sign or a digit" if strange else ""
                )
                expected = f"{count} finite numbers" if count > 1 else "a finite number"
                self.note(line, f'{what} is "{shown}", expected {expected}{mend}')
            return None
        return np.array(values, dtype=float)

    def attribute(self, element: _Element | None, name: str) -> float | None:
        """A number in an attribute; None if it isn't there."""
        if element is None or element.get(name) is None:
            return None
        value = self.several(element.get(name), 1, line_of(element), f"{name} of <{element.tag}>")
        return None if value is None else float(value[0])

    def vector(self, element: _Element | None, name: str) -> Array | None:
        if element is None or element.get(name) is None:
            return None
        return self.several(element.get(name), 3, line_of(element), f"{name} of <{element.tag}>")

    def text(self, parent: _Element | None, tag: str, count: int = 1) -> Array | None:
        """Numbers in the text of a child element, as SDF has them."""
        child = None if parent is None else parent.find(tag)
        return None if child is None else self.several(child.text, count, line_of(child), f"<{tag}>")


def rotation_of(rpy: Array) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll): the fixed-axes angles of URDF and SDF."""
    cr, cp, cy = np.cos(rpy)
    sr, sp, sy = np.sin(rpy)
    return np.array(
        [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]]
    )


def rotation_of_quaternion(xyzw: Array) -> Array:
    """The rotation of a quaternion of any length; none for zero."""
    length = float(np.linalg.norm(xyzw))
    if length == 0:
        return np.eye(3)
    x, y, z, w = xyzw / length
    S = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + 2 * w * S + 2 * S @ S)
