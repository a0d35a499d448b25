"""What the databases of ROS 2 bags may not hold, since it lets a small file be read for hours or fill the memory.

SQLite computes what views and generated columns hold when they are read, and follows pages as they name each other.
"""

from __future__ import annotations

import re
import sqlite3
from pathlib import Path

from ksl.base import limits
from ksl.base.errors import MotionError

DATABASE = b"SQLite format 3\0"
TABLES = ("schema", "metadata", "topics", "message_definitions", "messages")
NOT_IN_NAMES = "?#%"
"""The library puts names of files into addresses as they stand, where these mean something."""
_PLAIN = re.compile(r"CREATE +(TABLE|INDEX|UNIQUE +INDEX)\b", re.IGNORECASE)
_STEPS, _STEPS_A_BYTE, _AT_ONCE = 200_000, 3, 10_000
"""Steps of SQLite's machine that the checks may take.  A row takes about twenty, and a message has more than a hundred bytes."""


def check_database(file: str, path: Path) -> None:
    """Raises MotionError for what no recorder writes: views, triggers, virtual tables, generated columns, topics of the same number.

    Raises sqlite3.Error for what is damaged.  O(bytes of the file).
    """
    if set(NOT_IN_NAMES) & set(str(path)):
        raise MotionError(f"{file}: the name of the bag or of its folder has one of {' '.join(NOT_IN_NAMES)}, with which databases can't be opened; rename it")
    left = (_STEPS + _STEPS_A_BYTE * path.stat().st_size) // _AT_ONCE

    def goes_on() -> int:
        nonlocal left
        left -= 1
        return int(left < 0)

    database = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
    try:
        database.set_progress_handler(goes_on, _AT_ONCE)
        for kind, name, text in database.execute("SELECT type, name, sql FROM sqlite_master"):
            if text is not None and not (isinstance(text, str) and _PLAIN.match(text)):
                raise _strange(file, f"the {kind} {name!r}")
        for table in TABLES:
            if any(column[6] for column in database.execute(f"PRAGMA table_xinfo({table})")):
                raise _strange(file, f"columns of {table!r} that are computed")
        database.execute("PRAGMA ignore_check_constraints = ON")
        (found,) = database.execute("PRAGMA quick_check(1)").fetchone()
        if found != "ok":
            raise sqlite3.DatabaseError(found)
        if database.execute("SELECT count(*) > count(DISTINCT CAST(id AS INTEGER)) FROM topics").fetchone()[0]:
            raise _strange(file, "two topics of the same number")
        if any(column[1] == "offered_qos_profiles" for column in database.execute("PRAGMA table_info(topics)")):
            (size,) = database.execute("SELECT total(length(CAST(offered_qos_profiles AS BLOB))) FROM topics").fetchone()
            check_yaml(file, path.name, int(size))
    finally:
        database.close()


def check_yaml(bag: str, file: str, size: int) -> None:
    """Raises MotionError for more bytes of YAML in a file of a bag than are read."""
    if size > limits.YAML_BYTES:
        raise MotionError(
            f"{bag}: {file} holds {size:,} bytes about topics and files; at most {limits.YAML_BYTES:,} are read: give one of the bag's recordings, or convert it"
        )


def _strange(file: str, what: str) -> MotionError:
    return MotionError(f"{file}: its database holds {what}, which no recorder writes; convert the bag with `ros2 bag convert`, or record it again")
