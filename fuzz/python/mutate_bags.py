"""Mutations of MCAP files and of bags of ROS 1 and 2: of messages, of records and rows, and of how they are packed."""

from __future__ import annotations

import io
import sqlite3
import struct
import zipfile
from collections.abc import Callable
from random import Random

import atheris
import bag_records
import numpy as np
from bag_records import CHANNEL, CHUNK_INDEX, MESSAGE, PACK, SCHEMA, Record
from mutate import BYTES, NAMES, NUMBERS, of_text
from rosbags.typesys import Stores, get_typestore

TYPE = "sensor_msgs/msg/JointState"
STORE1, STORE2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
WORDS = [
    b"/joint_states",
    b"/joint_statez",
    b"sensor_msgs/msg/JointState",
    b"sensor_msgs/JointState",
    b"std_msgs/msg/String",
    b"cdr",
    b"ros2msg",
    b"ros2idl",
    b"zstd",
    b"lz4",
    b"",
    b"json",
]
INTEGERS = [0, 1, 2, 255, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**64 - 1]
QUERIES = [
    "DELETE FROM {table} WHERE rowid % 3 = {k}",
    "UPDATE {table} SET {column} = {value} WHERE rowid % 3 = {k}",
    "UPDATE {table} SET {column} = {value}",
    "INSERT INTO {table} SELECT * FROM {table} WHERE 0",
    "DROP TABLE {table}",
    "DROP INDEX timestamp_idx",
    "ALTER TABLE {table} RENAME TO other",
    "ALTER TABLE {table} RENAME COLUMN {column} TO other",
    "ALTER TABLE {table} ADD COLUMN other DEFAULT {value}",
    "CREATE TABLE other AS SELECT * FROM {table}; DROP TABLE {table}; ALTER TABLE other RENAME TO {table}",
    "CREATE TABLE other AS SELECT * FROM {table}; INSERT INTO other SELECT * FROM {table}; DROP TABLE {table}; ALTER TABLE other RENAME TO {table}",
    "ALTER TABLE {table} RENAME TO other; CREATE VIEW {table} AS SELECT * FROM other",
    "DROP TABLE {table}; CREATE VIEW {table} AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x AS {column}, x AS id FROM c",
    "ALTER TABLE {table} DROP COLUMN {column}; ALTER TABLE {table} ADD COLUMN {column} AS (zeroblob(500000000))",
]
COLUMNS = {
    "messages": ["id", "topic_id", "timestamp", "data"],
    "topics": ["id", "name", "type", "serialization_format", "offered_qos_profiles", "type_description_hash"],
    "schema": ["schema_version", "ros_distro"],
    "message_definitions": ["id", "topic_type", "encoding", "encoded_message_definition"],
}
VALUES = [
    "NULL",
    "0",
    "1",
    "-1",
    "9223372036854775807",
    "1.5",
    "'/joint_states'",
    "'sensor_msgs/msg/JointState'",
    "x'00'",
    "'[]'",
    "'- a: 1'",
    "zeroblob(9)",
    "data || data",
    "'cdr'",
]
_random = Random(1)


def of_mcap(data: bytes, most: int, seed: int) -> bytes:
    return _of_records(data, most, seed, bag_records.mcap_records, bag_records.mcap_file, _change_mcap)


def of_ros1(data: bytes, most: int, seed: int) -> bytes:
    return _of_records(data, most, seed, bag_records.bag_records, bag_records.bag_file, _change_bag)


def of_ros2(data: bytes, most: int, seed: int) -> bytes:
    """Of a database, or of one of the files in a zip archive."""
    _random.seed(seed)
    if not data.startswith(b"PK"):
        return of_database(data, most, seed)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {each.filename: archive.read(each) for each in archive.infolist()}
        name = _random.choice(list(members))
        members[name] = _of_member(members[name], most, seed)
        if _random.randrange(20) == 0:
            members[_random.choice([*NAMES, "metadata.yaml", "bag.db3", "b.mcap"])] = members.pop(name)
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            for each, inside in members.items():
                archive.writestr(zipfile.ZipInfo(each), inside)
        if len(made := out.getvalue()) <= most:
            return made
    except Exception:  # of what is no archive any more
        pass
    return atheris.Mutate(data, most)


def _of_member(inside: bytes, most: int, seed: int) -> bytes:
    if inside.startswith(b"\x28\xb5\x2f\xfd") and seed % BYTES:
        return PACK[b"zstd"](_of_member(bag_records.UNPACK[b"zstd"](inside), most, seed))
    if inside.startswith(bag_records.MCAP_MAGIC):
        return of_mcap(inside, most, seed)
    return of_database(inside, most, seed) if inside.startswith(b"SQLite") else of_text(inside, most, seed)


def of_database(data: bytes, most: int, seed: int) -> bytes:
    """Rows, columns and tables are changed; or bytes."""
    _random.seed(seed)
    if seed % BYTES:
        database = sqlite3.connect(":memory:")
        steps = iter(range(50))
        database.set_progress_handler(lambda: next(steps, None) is None, 1000)  # not to read what never ends
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, 1 << 20)
        try:
            database.deserialize(data)
            for _ in range(_random.randint(1, 3)):
                _change_database(database)
            database.commit()
            made = database.serialize()
            if len(made) <= most:
                return made
        except Exception:  # of what is no database any more
            pass
        finally:
            database.close()
    return atheris.Mutate(data, most)


def _change_database(database: sqlite3.Connection) -> None:
    rows = database.execute("SELECT id, data FROM messages LIMIT 100").fetchall()
    if rows and _random.randrange(2):
        key, message = _random.choice(rows)
        packed = isinstance(message, bytes) and message.startswith(b"\x28\xb5\x2f\xfd")
        raw = bag_records.UNPACK[b"zstd"](message) if packed else bytes(message or b"")
        changed = message_of(raw, STORE2.deserialize_cdr, STORE2.serialize_cdr)
        database.execute("UPDATE messages SET data = ? WHERE id = ?", (PACK[b"zstd"](changed) if packed else changed, key))
        return
    table = _random.choice(list(COLUMNS))
    words = {"table": table, "column": _random.choice(COLUMNS[table]), "value": _random.choice(VALUES), "k": _random.randrange(3)}
    database.executescript(_random.choice(QUERIES).format(**words))


Records = list[Record]


def _of_records(
    data: bytes, most: int, seed: int, parts: Callable[[bytes], Records], file: Callable[[Records], bytes], change: Callable[[Record], None]
) -> bytes:
    """Records are removed, repeated, moved and changed, in chunks, too."""
    _random.seed(seed)
    if seed % BYTES:
        try:
            records = parts(data)
            for _ in range(_random.randint(1, 3)):
                chunks = [r.inside for r in records if r.inside]
                among = _random.choice([records, *chunks])
                at, way = _random.randrange(len(among)), _random.randrange(20)
                if way == 0:
                    del among[at]
                elif way == 1:
                    among.insert(at, _random.choice(among))
                elif way == 2:
                    among[at] = _random.choice(among)
                else:
                    change(among[at])
            made = file(records)
            if len(made) <= most:
                return made
        except Exception:  # of what is no bag any more
            pass
    return atheris.Mutate(data, most)


def _change_mcap(record: Record) -> None:
    if record.inside:
        record.packed = _random.choice([b"", b"lz4", b"zstd"])
    elif record.kind == MESSAGE and _random.randrange(4):
        record.content = record.content[:22] + message_of(record.content[22:], STORE2.deserialize_cdr, STORE2.serialize_cdr)
    elif record.kind in (SCHEMA, CHANNEL) and _random.randrange(3):
        start = 2 if record.kind == SCHEMA else 4
        texts, place = [], start
        for _ in range(2):
            (size,) = struct.unpack_from("<I", record.content, place)
            texts.append(record.content[place + 4 : place + 4 + size])
            place += 4 + size
        texts[_random.randrange(2)] = _random.choice(WORDS)
        record.content = record.content[:start] + b"".join(struct.pack("<I", len(t)) + t for t in texts) + record.content[place:]
    elif record.kind == CHUNK_INDEX or _random.randrange(2):
        record.content = with_integer(record.content)
    else:
        record.content = atheris.Mutate(record.content, len(record.content) + 8)


def _change_bag(record: Record) -> None:
    if record.inside and _random.randrange(2):
        record.packed = _random.choice([b"none", b"lz4", b"bz2"])
    elif record.kind == 2 and _random.randrange(4):
        record.content = message_of(record.content, STORE1.deserialize_ros1, STORE1.serialize_ros1)
    elif _random.randrange(2) and not record.inside:
        record.content = with_integer(record.content) if _random.randrange(2) else atheris.Mutate(record.content, len(record.content) + 8)
    else:
        fields = bag_records.fields_of(record.head)
        name = _random.choice(list(fields) or [b"op"])
        value = fields.get(name, b"")
        fields[name] = with_integer(value) if len(value) in (1, 4, 8) and _random.randrange(4) else _random.choice([*WORDS, value[:-1], value + b"\0"])
        if _random.randrange(9) == 0:
            del fields[name]
        record.head = bag_records.head_of(fields)


def with_integer(data: bytes) -> bytes:
    """An integer becomes another one."""
    size = _random.choice([n for n in (1, 2, 4, 8) if n <= len(data)] or [0])
    at = _random.randrange(max(1, len(data) - size + 1))
    old = int.from_bytes(data[at : at + size], "little")
    new = _random.choice([*INTEGERS, old + 1, old - 1, 2 * old]) % (1 << 8 * size)
    return data[:at] + new.to_bytes(size, "little") + data[at + size :]


def message_of(data: bytes, decode: Callable[[bytes, str], object], encode: Callable[[object, str], bytes]) -> bytes:
    """A message of joint states with other names, numbers, stamps; or with other bytes."""
    way = _random.randrange(10)
    if way < 2:
        return with_integer(data)
    if way == 2:
        return atheris.Mutate(data, len(data) + 16)
    try:
        m = decode(data, TYPE)
        if way == 3:
            m.header.stamp.sec, m.header.stamp.nanosec = _random.choice(INTEGERS) % 2**31, _random.choice(INTEGERS) % 2**32
        elif way == 4:
            m.header.stamp.nanosec = _random.randrange(10**9)
        elif way == 5:
            names = [*m.name, _random.choice([*NAMES, "hip", "slide"])]
            m.name = _random.sample(names, _random.randint(0, len(names)))
        else:
            quantity = _random.choice(["position", "position", "velocity", "effort"])
            x = np.resize(np.append(getattr(m, quantity), 1.0), _random.choice([len(m.name)] * 4 + [0, 1, 3])).astype(float)
            if len(x) and _random.randrange(4):
                x[_random.randrange(len(x))] = float(_random.choice(NUMBERS))
            setattr(m, quantity, x)
        return bytes(encode(m, TYPE))
    except Exception:  # of what is no message any more
        return with_integer(data)
