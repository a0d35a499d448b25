"""Which format a file has, told by its content and never by its name."""

from __future__ import annotations

import bz2
import gzip
import lzma
import os
import stat
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.base.extras import missing
from ksl.base.input_files import STANDARD_INPUT, Unreadable, bounded, check_path, contents, failed_read, opened, standard_input, what_os_says
from ksl.motions.columns.recorded import Recorded
from ksl.motions.files import rostopic
from ksl.motions.files.csv_form import no_table
from ksl.motions.files.csv_table import CsvTable

_PACKED: dict[bytes, tuple[str, Callable[[BytesIO], Any]]] = {b"\x1f\x8b": ("gzip", gzip.open), b"BZh": ("bzip2", bz2.open), b"\xfd7zXZ\x00": ("xz", lzma.open)}
_OTHERS = {
    b"\x89HDF": "an HDF5 file (or one of MATLAB's -v7.3); save the motion as CSV, Parquet or NPZ, or in MATLAB by save(…, '-v7')",
    b"MATLAB 7.3": "a MATLAB file of version 7.3, which is HDF5; save it by save(…, '-v7')",
    b"MATLAB": "a MATLAB file of another version; save it by save(…, '-v7')",
    b"\x93NUMPY": "a single NumPy array; save time and positions together: numpy.savez('motion.npz', time=…, q=…)",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook, or one with a password; save it as .xlsx without one, or the sheet as CSV",
    b"\x28\xb5\x2f\xfd": "compressed by zstd; unpack it, or compress it by gzip",
    b"ARROW1": "an Arrow file; save the motion as Parquet",
    b"%PDF": "a PDF; give the table that it was made from",
    b"\x7fELF": "a program; give a motion",
}


@dataclass(frozen=True)
class Content:
    """What a file holds: a path to it, or its bytes where it was a pipe or was compressed."""

    file: str
    path: Path | None
    data: bytes | None
    how: str = ""

    def head(self) -> bytes:
        if self.data is not None:
            return self.data[:512]
        with self.opened() as f:
            return f.read(512)

    def bytes(self) -> bytes:
        return contents(self.file, limits.MOTION_BYTES) if self.data is None else self.data

    def opened(self) -> BinaryIO:
        return opened(self.file, limits.MOTION_BYTES) if self.data is None else BytesIO(self.data)


def open_table(path: str | os.PathLike[str], topic: str | None = None, positions_only: bool = False) -> Recorded:
    """The table that a file holds: CSV, Parquet, NPZ, an Excel workbook, MCAP, a ROS 1 bag, or a ROS 2 bag, which is a folder.

    "-" is standard input; pipes and files compressed by gzip, bzip2 or xz are read, too.  topic: of a bag, or the sheet of a workbook.
    positions_only: for bags.
    Raises MotionError with the file, what it is, and what to give instead.
    """
    file = os.fspath(path)
    if said := missing("pyarrow", "scipy"):
        raise MotionError(f"{file}: reading motions {said}")
    try:
        check_path(file)
        if file != STANDARD_INPUT and (os.path.isdir(file) or _describes_bag(file)):
            from ksl.motions.files.bags import bag_in_folder

            return bag_in_folder(file if os.path.isdir(file) else os.path.dirname(file) or os.getcwd(), topic, positions_only)
        content = _content(file)
        table = _opened(content, content.head(), topic, positions_only)
    except Unreadable as e:
        raise no_table(f"{'standard input' if file == STANDARD_INPUT else file}: {e}") from None
    except (OSError, UnicodeError) as e:
        raise no_table(f"{file}: can't be read ({what_os_says(e)})") from None
    if topic is not None and not table.has_parts:
        raise MotionError(
            f"{content.file}: --topic (topic=) chooses among the topics of a bag or the sheets of a workbook, but this is {table.format}; leave it out"
        )
    return table


def _describes_bag(file: str) -> bool:
    """Whether it is the metadata.yaml of a ROS 2 bag, which is what its tools name; it means the folder."""
    if os.path.basename(file) != "metadata.yaml" or not os.path.isfile(file):
        return False
    with open(file, "rb") as source:
        return b"rosbag2_bagfile_information" in source.read(4096)


def _content(file: str) -> Content:
    if file == STANDARD_INPUT:
        return _unpacked(Content("standard input", None, standard_input(limits.MOTION_BYTES)))
    with opened(file, limits.MOTION_BYTES) as source:
        if not stat.S_ISREG(os.fstat(source.fileno()).st_mode):  # a pipe is read once, and all of it
            return _unpacked(Content(file, None, bounded(source, limits.MOTION_BYTES)))
        if not source.read(8).startswith(tuple(_PACKED)):
            return Content(file, Path(file), None)
        source.seek(0)
        return _unpacked(Content(file, None, bounded(source, limits.MOTION_BYTES)))


def _unpacked(content: Content) -> Content:
    assert content.data is not None
    for magic, (name, unpack) in _PACKED.items():
        if content.data.startswith(magic):
            try:
                with unpack(BytesIO(content.data)) as source:
                    return Content(content.file, None, bounded(source, limits.MOTION_BYTES, "is compressed, and unpacked it is"), name)
            except (EOFError, OSError, zlib.error, lzma.LZMAError, ValueError) as e:
                if failed := failed_read(e):
                    raise failed from None
                raise MotionError(f"{content.file}: is compressed by {name}, but truncated or damaged; copy or compress it again") from None
    return content


def _opened(content: Content, head: bytes, topic: str | None, positions_only: bool) -> Recorded:
    file = content.file
    if head.startswith(b"PAR1"):
        from ksl.motions.files.parquet_table import ParquetTable

        return ParquetTable(file, content.bytes() if content.path is None else content.path)
    if head.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return _opened_zip(content, topic)
    if head.startswith((b"\x89MCAP0", b"#ROSBAG", b"SQLite format 3")):
        from ksl.motions.files import bags

        if head.startswith(b"\x89MCAP0"):
            return bags.mcap(file, content.opened(), topic, positions_only)
        if content.path is None:
            raise MotionError(f"{file}: is a bag that is {content.how or 'read from a pipe'}; unpack it to a file, and give that")
        read = bags.ros1_bag if head.startswith(b"#ROSBAG") else bags.ros2_database
        return read(file, topic, positions_only)
    if head.startswith(b"MATLAB 5.0 MAT-file"):
        from ksl.motions.files.mat_table import mat_table

        return mat_table(file, content.opened())
    for magic, what in _OTHERS.items():
        if head.startswith(magic) or (magic == b"MATLAB" and _is_matlab_4(head)):
            raise MotionError(f"{file}: is {what}")
    if is_markup(head):
        what = "a robot" if any(root in head for root in (b"<robot", b"<sdf", b"<mujoco")) else "an XML or HTML"
        raise no_table(f"{file}: is {what} file, not a motion")
    if head.lstrip().startswith((b"{", b"[{")):
        raise MotionError(f"{file}: is JSON; save the motion as CSV, Parquet or NPZ")
    table = CsvTable(file, content.bytes(), content.how)
    if rostopic.is_joint_states(table):
        return rostopic.joint_states(table, positions_only)
    return table


def _opened_zip(content: Content, sheet: str | None) -> Recorded:
    from ksl.motions.files.npz_table import npz_table

    try:
        with content.opened() as source, zipfile.ZipFile(source) as archive:
            inside = archive.infolist()
    except (zipfile.BadZipFile, ValueError, EOFError, OverflowError, NotImplementedError, UnicodeError, struct.error) as e:
        if failed := failed_read(e):
            raise failed from None
        raise MotionError(f"{content.file}: is an NPZ file or another zip archive, but truncated or damaged; copy or write it again") from None
    names = [each.filename for each in inside]
    if "xl/workbook.xml" in names:
        from ksl.motions.files.workbook import workbook_table

        return workbook_table(content.file, content.opened(), sheet)
    if "xl/workbook.bin" in names or "mimetype" in names:
        raise MotionError(f"{content.file}: is a spreadsheet (binary Excel or OpenDocument); save it as .xlsx, or the sheet as CSV, and give that")
    if not names or not all(n.endswith(".npy") for n in names):
        raise MotionError(f"{content.file}: is a zip archive without NumPy arrays; give CSV, Parquet, NPZ or a bag")
    if len(inside) > limits.COLUMNS:
        raise MotionError(f"{content.file}: {len(inside):,} arrays; at most {limits.COLUMNS:,} are read")
    if sum(each.file_size for each in inside) > limits.MOTION_BYTES:  # what an archive says of its sizes is kept to when it is unpacked
        raise no_table(f"{content.file}: unpacked it is larger than {limits.megabytes(limits.MOTION_BYTES)}, the most that is read")
    return npz_table(content.file, content.opened())


def _is_matlab_4(head: bytes) -> bool:
    """Whether a file begins as MATLAB's files of version 4: five whole numbers (type, rows, columns, imaginary part, length of the name), and a name."""
    for order in "<>":
        kind, rows, columns, imaginary, length = struct.unpack(f"{order}5i", head[:20]) if len(head) > 20 else (-1, 0, 0, 0, 0)
        if (
            0 <= kind < 5000
            and min(rows, columns) >= 0
            and imaginary in (0, 1)
            and 1 < length <= len(head) - 20
            and head[20 : 20 + length].find(b"\0") == length - 1
        ):
            return True
    return False


def is_markup(head: bytes) -> bool:
    """Whether a file begins as XML does."""
    text = head.removeprefix(b"\xef\xbb\xbf")
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = head.replace(b"\x00", b"")[2:]
    return text.lstrip().startswith(b"<")


def swapped(robot: str | os.PathLike[str], motion: str | os.PathLike[str]) -> bool:
    """Whether the robot's file and the motion's were given in the wrong order."""

    def markup(path: str | os.PathLike[str]) -> bool | None:
        try:
            if not stat.S_ISREG(os.stat(path).st_mode):
                return None
            with open(path, "rb") as f:
                return is_markup(f.read(512))
        except (OSError, ValueError):
            return None

    return markup(motion) is True and (markup(robot) is False or os.path.isdir(robot))
