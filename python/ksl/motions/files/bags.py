"""Joint states in ROS 1 bags, ROS 2 bags and MCAP files, read by the libraries `rosbags` and `mcap-ros2-support`."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

from ksl.base import limits
from ksl.base.errors import MotionError, near_names
from ksl.base.input_files import check_regular, failed_read
from ksl.base.library_messages import heard
from ksl.base.words import listed
from ksl.motions.files.bag_sizes import check_files, check_index, check_messages, limit_chunks, too_large
from ksl.motions.files.bag_database import NOT_IN_NAMES
from ksl.motions.files.joint_states import JointStates, JointStateTable
from ksl.motions.files.mcap_chunks import MAGIC, RECORD, chunks_from, summary_start, unpacked_size

if TYPE_CHECKING:
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

JOINT_STATE = "sensor_msgs/msg/JointState"
DEFINITION = b"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
"""The definition of the message.  It has never changed, so that what a file says of it is not needed: parsers of such texts can be made to run for hours."""
TRUNCATED = "truncated or damaged"


class Topic(NamedTuple):
    name: str
    type: str
    messages: int


def bag_in_folder(folder: str, topic: str | None, positions_only: bool) -> JointStateTable:
    """The joint states of a ROS 2 bag, which is a folder with metadata.yaml and one or more .db3 or .mcap files.  Raises MotionError."""
    inside = sorted(Path(folder).iterdir())
    for each in inside:  # the libraries open them by name
        if not each.is_dir():
            check_regular(str(each))
    if any(f.name == "metadata.yaml" for f in inside):
        return _ros2(folder, Path(folder), topic, positions_only, [f for f in inside if f.is_file()])
    recordings = [f for f in inside if f.suffix in (".db3", ".mcap", ".bag")]
    if recordings:
        if Path(folder, "wrenches.parquet").is_file():
            raise MotionError(f"{folder}: holds the wrenches that `ksl loads` has computed, not a motion; give the motion's file")
        raise MotionError(f"{folder}: is a folder without metadata.yaml; give one of its recordings: {listed(str(f) for f in recordings)}")
    raise MotionError(f"{folder}: can't be read: it is a folder, but no ROS 2 bag; give a file, or the folder of a bag")


def ros2_database(file: str, topic: str | None, positions_only: bool) -> JointStateTable:
    """The joint states of one .db3 file of a ROS 2 bag.  Raises MotionError."""
    with _with_suffix(file, ".db3") as path:
        return _ros2(file, path, topic, positions_only)


def _ros2(file: str, path: Path, topic: str | None, positions_only: bool, inside: Sequence[Path] = ()) -> JointStateTable:
    _import(file, "rosbags")
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    decode = get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr

    def reader() -> Reader2:
        check_files(file, inside or [path])
        return Reader(path)

    def limit(bag: Reader2) -> None:
        check_index(file, bag)
        if bag.compression_mode == "message":
            check_messages(file, [f for f in inside if f.name != "metadata.yaml"])

    return _read(file, "ROS 2 bag", reader, limit, decode, topic, positions_only)


def ros1_bag(file: str, topic: str | None, positions_only: bool) -> JointStateTable:
    """The joint states of a ROS 1 bag.  Raises MotionError."""
    _import(file, "rosbags")
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_typestore

    decode = get_typestore(Stores.ROS1_NOETIC).deserialize_ros1
    return _read(file, "ROS 1 bag", lambda: Reader(file), lambda bag: limit_chunks(file, bag), decode, topic, positions_only)


def _read(
    file: str,
    format: str,
    reader: Callable[[], Reader1 | Reader2],
    limit: Callable[[Any], None],
    decode: Callable[[Any, str], Any],
    topic: str | None,
    positions_only: bool,
) -> JointStateTable:
    """Joint states by a reader of rosbags.

    limit: refuses what unpacks to too much, before messages are read.
    """
    try:
        with heard("rosbags") as said, reader() as bag:
            limit(bag)
            name = chosen_topic(file, [Topic(c.topic, c.msgtype, c.msgcount) for c in bag.connections], topic)
            connections: Any = [c for c in bag.connections if c.topic == name]
            messages = bag.messages(connections)
            states = JointStates(file, name, ((log, decode(raw, JOINT_STATE)) for _, log, raw in messages))
    except (MotionError, KeyboardInterrupt):
        raise
    except MemoryError:
        raise _takes_too_much(file, format) from None
    except Exception as e:  # readers of truncated bags raise errors of many types: of zlib, sqlite, struct, YAML …
        if failed := failed_read(e):
            raise failed from None
        raise MotionError(_what_is_wrong(file, format, str(e))) from None
    table = JointStateTable(states, format, positions_only)
    table.notes += said
    return table


def _what_is_wrong(file: str, format: str, text: str) -> str:
    if "not indexed" in text:
        return f"{file}: is a {format} that was not closed, and has no index; run `rosbag reindex` on it"
    if "not supported" in text or "missing" in text:
        return f"{file}: is a {format} that can't be read ({' '.join(text.split())}); record it again, or convert it with rosbags-convert"
    return f"{file}: is a {format}, but {TRUNCATED}; copy it again, or repair it with the tools of ROS"


def _takes_too_much(file: str, format: str) -> MotionError:
    """What to say where memory runs out: the libraries ask for as much as a length in a damaged file says."""
    return MotionError(
        f"{file}: is {'an' if format == 'MCAP file' else 'a'} {format}, but reading it takes more memory than there is: it is damaged, or too large; copy it again, or give a part of it"
    )


def mcap(file: str, source: BinaryIO, topic: str | None, positions_only: bool) -> JointStateTable:
    """The joint states of an MCAP file with messages of ROS 2.  Raises MotionError."""
    _import(file, "mcap_ros2", "mcap-ros2-support")
    from mcap.reader import make_reader
    from mcap.records import Schema
    from mcap_ros2.decoder import DecoderFactory

    decode = DecoderFactory().decoder_for("cdr", Schema(id=1, name=JOINT_STATE, encoding="ros2msg", data=DEFINITION))
    assert decode is not None
    try:
        with heard("mcap", "mcap_ros2") as said, source:
            start = summary_start(source)
            _check_size(file, source, chunks_from(source, start) if start else ())  # a summary holds none, unless somebody wants it to
            source.seek(0)
            reader = make_reader(source)
            summary = reader.get_summary()
            if summary is None:
                raise MotionError(f"{file}: is an MCAP file, but {TRUNCATED}: it has no summary at its end; repair it with `mcap recover`")
            indexed = [c.chunk_start_offset + RECORD for c in summary.chunk_indexes]
            _check_size(file, source, indexed or chunks_from(source, MAGIC))  # without an index all records are read
            counts = summary.statistics.channel_message_counts if summary.statistics else {}
            topics = [Topic(c.topic, _type_of(summary.schemas.get(c.schema_id)), counts.get(c.id, 1)) for c in summary.channels.values()]
            name = chosen_topic(file, topics, topic)
            of_topic = [c for c in summary.channels.values() if c.topic == name]
            for c in of_topic:
                schema = summary.schemas.get(c.schema_id)
                if c.message_encoding != "cdr" or schema is None or schema.encoding != "ros2msg":
                    how = f"{c.message_encoding}, {schema.encoding}" if schema else c.message_encoding
                    raise MotionError(f"{file}: joint states of {name} are encoded as {how}; expected messages of ROS 2 (cdr, ros2msg)")
            states = JointStates(file, name, ((m.log_time, decode(m.data)) for _, _, m in reader.iter_messages([name])))
    except (MotionError, KeyboardInterrupt):
        raise
    except MemoryError:
        raise _takes_too_much(file, "MCAP file") from None
    except Exception as e:  # McapError, struct.error, errors of zstd and lz4, and others of damaged files
        if failed := failed_read(e):
            raise failed from None
        raise MotionError(f"{file}: is an MCAP file, but {TRUNCATED}; copy it again, or repair it with `mcap recover`") from None
    table = JointStateTable(states, "MCAP", positions_only)
    table.notes += said
    return table


def _check_size(file: str, source: BinaryIO, chunks: Iterable[int]) -> None:
    """Raises MotionError if chunks of an MCAP file are larger than what is read.  What its index says of them may be wrong."""
    if unpacked_size(source, chunks, limits.MOTION_BYTES) > limits.MOTION_BYTES:
        raise too_large(file, "mcap filter")


def _type_of(schema: Any) -> str:
    """The type of a schema as ROS 2 writes it."""
    name = str(schema.name) if schema is not None else "unknown"
    return name if name.count("/") != 1 else name.replace("/", "/msg/")


def chosen_topic(file: str, topics: Iterable[Topic], wanted: str | None) -> str:
    """The topic with joint states: the only one, or the one that is wanted.  Raises MotionError."""
    messages: dict[str, int] = {}
    types: dict[str, str] = {}
    for t in topics:  # a topic with several publishers has several connections in a ROS 1 bag
        messages[t.name] = messages.get(t.name, 0) + t.messages
        types[t.name] = t.type
    states = [n for n in types if types[n] == JOINT_STATE and messages[n]]
    said = listed((f"{n} ({types[n].replace('/msg/', '/')})" for n in types), 8) or "none"
    if wanted is not None:
        name = wanted if wanted in types else "/" + wanted.lstrip("/")
        if name not in types:
            raise MotionError(f"{file}: no topic {wanted!r}; {near_names(name, types)}its topics: {said}")
        if types[name] != JOINT_STATE:
            known = f"joint states are in {listed(states)}" if states else "no topic of the bag has joint states"
            raise MotionError(f"{file}: topic {name} holds {types[name].replace('/msg/', '/')}; {known}")
        return name
    if not states:
        poses = any(n in types.values() for n in ("nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage"))
        note = ". Poses from nav_msgs/Odometry and tf are not read" if poses else ""
        raise MotionError(f"{file}: holds no messages of the type sensor_msgs/JointState; its topics: {said}{note}")
    if len(states) > 1:
        counts = listed(f"{n} ({messages[n]:,} messages)" for n in states)
        raise MotionError(f"{file}: several topics hold joint states: {counts}; say which one by --topic NAME (topic=)")
    return states[0]


def _import(file: str, module: str, package: str = "") -> None:
    from importlib.util import find_spec

    if find_spec(module) is None:
        raise MotionError(f"{file}: is a recording of ROS, which needs the package {package or module}; install it: pip install 'ksl[bags]'")


class _with_suffix:
    """The path of a file under a name with that suffix, by which rosbags tells the format, and that SQLite takes as it stands."""

    def __init__(self, file: str, suffix: str) -> None:
        self._file, self._suffix = Path(file), suffix
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def __enter__(self) -> Path:
        if self._file.suffix == self._suffix and not set(NOT_IN_NAMES) & set(str(self._file)):
            return self._file
        self._folder = tempfile.TemporaryDirectory()
        link = Path(self._folder.name) / f"recording{self._suffix}"
        try:
            os.symlink(self._file.absolute(), link)
        except OSError:  # Windows gives this right to few
            shutil.copyfile(self._file, link)
        return link

    def __exit__(self, *_: object) -> None:
        if self._folder:
            self._folder.cleanup()
