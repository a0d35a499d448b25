"""Bags of a few kilobytes that libraries would read for hours, or into gigabytes, and bags whose damage used to end in faults of Python."""

import sqlite3
import struct
from itertools import pairwise

import numpy as np
import pytest
from ros_bags_test import MS, START, leg_messages, write

from ksl.base import limits
from ksl.motions.files.bag_database import check_database, check_yaml
from ksl.motions.reading import read_motion

FOREVER = "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x AS {column}, x AS id FROM c"
RENAMED = "ALTER TABLE {table} RENAME TO other; CREATE TABLE {table} AS SELECT * FROM other"
DATABASES = {
    "a view without an end": ("DROP TABLE schema; CREATE VIEW schema AS " + FOREVER.format(column="schema_version"), "the view 'schema'"),
    "a trigger": ("CREATE TRIGGER t AFTER INSERT ON messages BEGIN DELETE FROM topics; END", "the trigger 't'"),
    "a column of a gigabyte": (
        "ALTER TABLE messages DROP COLUMN data; ALTER TABLE messages ADD COLUMN data AS (zeroblob(1000000000))",
        "columns of 'messages' that are computed",
    ),
    "one topic many times": (RENAMED.format(table="topics") + "; INSERT INTO topics SELECT * FROM other", "two topics of the same number"),
    "one topic by two names": (
        RENAMED.format(table="topics")
        + "; UPDATE topics SET id = '1'; INSERT INTO topics SELECT '01', name, type, serialization_format, offered_qos_profiles, type_description_hash FROM other",
        "two topics",
    ),
}


def database_of(path):
    return next(path.glob("*.db3"))


@pytest.mark.parametrize("what", DATABASES)
@pytest.mark.parametrize("alone", [False, True], ids=["folder", "file"])
def test_databases_that_no_recorder_writes(leg, tmp_path, refusal, what, alone):
    """A view without an end hung, and a column of a gigabyte took it for each message."""
    path = write(tmp_path, "ros2", leg_messages())
    database = sqlite3.connect(database_of(path))
    database.executescript("DROP INDEX timestamp_idx;" + DATABASES[what][0])
    database.commit()
    database.close()
    assert refusal(leg, database_of(path) if alone else path).startswith(f": its database holds {DATABASES[what][1]}")


def test_a_database_in_a_compressed_file_is_looked_at(leg, tmp_path, refusal):
    import zstandard

    path = write(tmp_path, "ros2", leg_messages())
    file = database_of(path)
    database = sqlite3.connect(file)
    database.executescript("DROP TABLE schema; CREATE VIEW schema AS " + FOREVER.format(column="schema_version"))
    database.close()
    file.with_name(file.name + ".zstd").write_bytes(zstandard.ZstdCompressor().compress(file.read_bytes()))
    file.unlink()
    text = (path / "metadata.yaml").read_text().replace(file.name, file.name + ".zstd").replace("compression_format: ''", "compression_format: zstd")
    (path / "metadata.yaml").write_text(text.replace("compression_mode: ''", "compression_mode: FILE"))
    assert refusal(leg, path).startswith(": its database holds the view 'schema'")


@pytest.mark.parametrize("table", ["messages", "sqlite_master"])
def test_pages_of_a_database_that_name_each_other(leg, tmp_path, refusal, table):
    """Pages that name one page often have its rows as often: five such pages, one behind the other, are more rows than anybody reads."""
    path = write(tmp_path, "ros2", leg_messages())
    file, size, cells = database_of(path), 4096, 100
    database = sqlite3.connect(file)
    database.executescript("CREATE TABLE filler(data BLOB); INSERT INTO filler SELECT zeroblob(4000) FROM messages; DROP INDEX timestamp_idx")
    root = database.execute("SELECT rootpage FROM sqlite_master WHERE name = 'messages'").fetchone()[0] if table == "messages" else 1
    database.commit()
    database.close()
    data = bytearray(file.read_bytes())
    leaves = [k for k in range(len(data) // size) if data[k * size] == 13 and k + 1 != root]
    chain, head = [root - 1, *leaves[-5:]], 100 * (root == 1)  # pages counted from 0, of which the first begins with what is said of the file
    last = slice(chain[-1] * size, (chain[-1] + 1) * size)
    data[last] = data[(root - 1) * size : root * size]
    if head:
        data[last] = data[last][head : head + 100] + data[last][100:]
    for page, child in pairwise(chain):
        places = [size - 5 * (k + 1) for k in range(cells)]
        begin = struct.pack(">BHHHBI", 5, 0, cells, places[-1], 0, child + 1) + struct.pack(f">{cells}H", *places)
        data[page * size + head : (page + 1) * size] = begin.ljust(size - head - 5 * cells, b"\0") + cells * struct.pack(">IB", child + 1, 1)
        head = 0
    file.write_bytes(data)
    assert "truncated or damaged" in refusal(leg, path)


def test_databases_of_many_messages_and_of_older_recorders(leg, tmp_path):
    """More steps than a small file may take; and topics without a column of what their publishers offer."""
    path = database_of(write(tmp_path, "ros2", leg_messages()))
    database = sqlite3.connect(path)
    database.executescript(
        f"INSERT INTO messages SELECT row + 100, topic_id, timestamp, data FROM messages, ({FOREVER.format(column='row')} LIMIT 100000) WHERE messages.id = 1"
    )
    database.execute("ALTER TABLE topics DROP COLUMN offered_qos_profiles")
    database.commit()
    database.close()
    check_database("bag", path)


@pytest.mark.parametrize("stamp", ["'soon'", "x'00'", "9223372036854775807", "1.5"])
def test_times_of_the_log_that_are_none(leg, tmp_path, refusal, stamp):
    path = write(tmp_path, "ros2", leg_messages())
    database = sqlite3.connect(database_of(path))
    database.execute(f"UPDATE messages SET timestamp = {stamp} WHERE id = 3")
    database.commit()
    database.close()
    said = refusal(leg, path)
    assert "truncated or damaged" in said or "has the time 9223372036854775807 ns, after the year 2116" in said


@pytest.mark.parametrize("name", ["run #3", "50% load", "what?"])
def test_names_that_mean_something_in_addresses(leg, tmp_path, refusal, name):
    """A single file is given another name for the library; of a folder it is said."""
    path = write(tmp_path, "ros2", leg_messages()).rename(tmp_path / name)  # writers have the same fault
    assert len(read_motion(leg, database_of(path)).time) == 12
    assert "can't be opened; rename it" in refusal(leg, path)


def records(data: bytes):
    """(kind, begin, end) of the records of an MCAP file."""
    place = 8
    while place + 9 <= len(data) - 8:
        kind, length = struct.unpack_from("<BQ", data, place)
        yield kind, place, place + 9 + length
        place += 9 + length


def test_a_chunk_that_an_index_names_often(leg, tmp_path, refusal, monkeypatch):
    """rosbags unpacks it each time, and keeps all of them."""
    path = write(tmp_path, "ros2 of mcap", leg_messages(300))
    file = next(path.glob("*.mcap"))
    data = file.read_bytes()
    begin, end = next((b, e) for kind, b, e in records(data) if kind == 8)
    monkeypatch.setattr(limits, "MOTION_BYTES", 500_000)
    assert len(read_motion(leg, path).time) == 300
    file.write_bytes(data[:end] + 20 * data[begin:end] + data[end:])
    assert "unpacked it is larger than 500,000 bytes" in refusal(leg, path)


def test_definitions_of_messages_are_not_read(leg, tmp_path, capfd):
    """The library printed what it did not understand, and lists of structs without members were read as long as a length in the file said."""
    path = write(tmp_path, "mcap", leg_messages())
    data = path.read_bytes()
    hostile = b"\x1b[31m velocity".ljust(len(b"float64[] velocity")) + b"\n"
    (tmp_path / "other.mcap").write_bytes(data.replace(b"float64[] velocity\n", hostile))
    assert len(read_motion(leg, path).time) == len(read_motion(leg, tmp_path / "other.mcap").time) == 12
    assert capfd.readouterr() == ("", "")


def test_a_time_of_an_mcap_file_that_64_bits_do_not_hold(leg, tmp_path, refusal):
    path = write(tmp_path, "mcap", [(2**64 - 1, START, ["hip", "slide"], [0.0, 0.0], [], []), *leg_messages()])
    assert "after the year 2116; record it again" in refusal(leg, path)


def test_joints_without_a_common_sample(leg, tmp_path, refusal):
    """The joint that is recorded more often has a gap where the other one is recorded."""
    hip = [(t, t, ["hip"], [0.1], [], []) for t in (START + k * MS for k in [*range(20), *range(60, 80)])]
    slide = [(t, t, ["slide"], [0.1], [], []) for t in (START + k * MS for k in range(30, 50))]
    said = refusal(leg, write(tmp_path, "ros1", sorted(hip + slide)))
    assert said == ": hip have no sample while all other joints are recorded; record them together"
    rows = [f"{k / 1000},{'' if 30 <= k < 50 else 0.1},{0.1 if 30 <= k < 50 else ''}" for k in [*range(20), *range(30, 50), *range(60, 80)]]
    (tmp_path / "m.csv").write_text("\n".join(["time,hip,slide", *rows]) + "\n")
    assert refusal(leg, tmp_path / "m.csv") == said


def test_a_length_beyond_the_end(leg, tmp_path, refusal):
    """Of a record that only the index leads to: reading it asked for 2^60 bytes."""
    path = write(tmp_path, "ros2 of mcap", leg_messages())
    file = next(path.glob("*.mcap"))
    data = bytearray(file.read_bytes())
    begin, end = (next(b for kind, b, _ in records(data) if kind == wanted) for wanted in (8, 15))
    data[end] = 2  # what walks along the records ends there, and what goes by the index doesn't
    struct.pack_into("<Q", data, begin + 1, 1 << 60)
    file.write_bytes(data)
    assert "truncated or damaged" in refusal(leg, path)


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_memory_that_runs_out_is_said(leg, tmp_path, refusal, monkeypatch, kind):
    """Lengths in damaged files make the libraries ask for gigabytes."""

    def without_memory(*_, **__):
        raise MemoryError

    path = write(tmp_path, kind, leg_messages())
    monkeypatch.setattr("rosbags.rosbag1.Reader.open" if kind == "ros1" else "mcap.reader.SeekingReader.get_summary", without_memory)
    assert "reading it takes more memory than there is: it is damaged, or too large" in refusal(leg, path)


def test_rows_without_positions_at_the_end_of_what_rostopic_prints(leg, tmp_path):
    head = "%time,field.header.stamp,field.name0,field.name1,field.position0,field.position1"
    rows = [f"{START + k * MS},{START + k * MS},hip,slide,{k},{k}" for k in range(8)]
    (tmp_path / "m.csv").write_text("\n".join([head, *rows, f"{START + 9 * MS},{START + 9 * MS},hip,slide,,", ",,,,,"]) + "\n")
    m = read_motion(leg, tmp_path / "m.csv")
    assert np.array_equal(m.q[:, 0], range(8))
    assert "1 sample of hip, slide left out, since positions are not numbers" in " ".join(m.source.notes).replace(" and ", ", ")


@pytest.mark.parametrize("kind", ["ros2", "ros2 of mcap"])
@pytest.mark.parametrize("where", ["description", "topics"])
def test_much_text_about_topics(leg, tmp_path, refusal, monkeypatch, kind, where):
    """The parser of YAML takes some ten seconds for a megabyte."""
    path = write(tmp_path, kind, leg_messages())
    file = next(f for f in path.iterdir() if (f.name == "metadata.yaml") == (where == "description"))
    monkeypatch.setattr(limits, "YAML_BYTES", 1000)
    check_yaml("bag", "metadata.yaml", 1000)
    assert len(read_motion(leg, path).time) == 12
    if where == "description":
        file.write_text(file.read_text() + 1000 * "#")
    elif file.suffix == ".db3":
        database = sqlite3.connect(file)
        database.execute("UPDATE topics SET offered_qos_profiles = ?", ("#" * 1001,))
        database.commit()
        database.close()
    else:
        data = file.read_bytes()
        begin, end = next((b, e) for kind, b, e in records(data) if kind == 15)  # the summary begins behind it
        file.write_bytes(data[:end] + struct.pack("<BQ", 4, 1001) + bytes(1001) + data[end:])
    assert f": {file.name} holds " in refusal(leg, path) and "bytes about topics and files; at most 1,000 are read" in refusal(leg, path)
