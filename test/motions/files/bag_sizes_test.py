"""ROS bags that unpack to more than is read are refused before they take the memory."""

import io
import resource
import sqlite3
import struct
from collections.abc import Callable
from types import SimpleNamespace

import lz4.frame
import pytest
import zstandard
from ros_bags_test import leg_messages, write
from rosbags.rosbag1 import Reader

from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.motions.files import unpacking
from ksl.motions.files.bag_sizes import check_files, check_index
from ksl.motions.files.mcap_chunks import chunks_from, unpacked_size
from ksl.motions.reading import read_motion

MESSAGES = 300


@pytest.fixture
def compressed(monkeypatch):
    """Makes the writers of the tests compress: compressed(KIND, HOW)."""

    def choose(kind: str, how: str) -> None:
        if kind == "ros1":
            from rosbags.rosbag1 import Writer

            module, options = "rosbags.rosbag1.Writer", (Writer.CompressionFormat[how],)
        else:
            from rosbags.rosbag2 import CompressionFormat, CompressionMode, Writer

            module, options = "rosbags.rosbag2.Writer", (CompressionMode[how], CompressionFormat.ZSTD)

        def writer(*given, **named):
            made = Writer(*given, **named)
            made.set_compression(*options)
            return made

        monkeypatch.setattr(module, writer)

    return choose


WAYS = [("ros1", "BZ2"), ("ros1", "LZ4"), ("ros2", "FILE"), ("ros2", "MESSAGE"), ("ros2 of mcap", "FILE")]


@pytest.mark.parametrize(("kind", "how"), WAYS)
def test_compressed_bags_have_a_limit_of_what_they_unpack_to(leg, tmp_path, refusal, monkeypatch, compressed, kind, how):
    compressed(kind, how)
    path = write(tmp_path, kind, leg_messages(MESSAGES))
    assert len(read_motion(leg, path).time) == MESSAGES
    monkeypatch.setattr(limits, "MOTION_BYTES", 20_000)
    assert "unpacked it is larger than 20,000 bytes, the most that is read; cut it with `ros" in refusal(leg, path)


def least(monkeypatch, limit: str, read: Callable[[], object]) -> int:
    """The least value of a limit with which a file is read, found by halving."""
    below, enough = 0, 1 << 20
    while enough - below > 1:
        middle = (below + enough) // 2
        monkeypatch.setattr(limits, limit, middle)
        try:
            read()
            enough = middle
        except MotionError:
            below = middle
    return enough


def test_messages_that_are_compressed_one_by_one_count_by_their_bytes(leg, tmp_path, monkeypatch, compressed):
    with sqlite3.connect(next(write(tmp_path / "plain", "ros2", leg_messages()).glob("*.db3"))) as database:
        whole = database.execute("SELECT sum(length(data)) FROM messages").fetchone()[0]
    compressed("ros2", "MESSAGE")
    path = write(tmp_path / "packed", "ros2", leg_messages())
    assert least(monkeypatch, "MOTION_BYTES", lambda: read_motion(leg, path)) == whole


@pytest.mark.parametrize("how", ["BZ2", "LZ4"])
def test_chunks_of_ros_1_count_by_what_they_unpack_to(leg, tmp_path, monkeypatch, compressed, how):
    with Reader(write(tmp_path / "plain", "ros1", leg_messages(MESSAGES))) as plain:
        whole = sum(chunk.datasize for chunk in plain.chunks.values())
    compressed("ros1", how)
    path = write(tmp_path / "packed", "ros1", leg_messages(MESSAGES))
    assert least(monkeypatch, "MOTION_BYTES", lambda: read_motion(leg, path)) == whole


def test_an_index_of_chunks_counts_as_the_file_does(leg, tmp_path, monkeypatch):
    folder = write(tmp_path, "ros2 of mcap", leg_messages(40))
    file = next(f for f in folder.iterdir() if f.suffix == ".mcap")
    whole = least(monkeypatch, "MOTION_BYTES", lambda: check_files("bag", [file]))
    assert least(monkeypatch, "MOTION_BYTES", lambda: read_motion(leg, folder)) == whole


@pytest.mark.parametrize(("kind", "how"), [("ros2", "FILE"), ("ros2 of mcap", "FILE"), ("ros2 of mcap", "")])
def test_files_of_a_bag_count_together(tmp_path, monkeypatch, compressed, kind, how):
    """Recorders split a long recording: of three files alike, each adds as much as the first."""
    if how:
        compressed("ros2", how)
    folder = write(tmp_path, kind, leg_messages(40))
    file = next(f for f in folder.iterdir() if f.name != "metadata.yaml")
    one, three = (least(monkeypatch, "MOTION_BYTES", lambda n=n: check_files("bag", [file] * n)) for n in (1, 3))
    assert one > 0 and three == 3 * one


@pytest.mark.parametrize("kind", ["ros1", "mcap", "ros2"])
def test_numbers_of_a_recording_are_positions_and_velocities(leg, tmp_path, monkeypatch, kind):
    path = write(tmp_path, kind, leg_messages(12))
    assert least(monkeypatch, "MOTION_NUMBERS", lambda: read_motion(leg, path)) == 12 * 4


def test_chunks_of_an_mcap_file_in_a_folder(leg, tmp_path, refusal, monkeypatch):
    path = write(tmp_path, "ros2 of mcap", leg_messages(MESSAGES))
    monkeypatch.setattr(limits, "MOTION_BYTES", 20_000)
    assert "unpacked it is larger than" in refusal(leg, path)


def test_messages_of_mcap_that_are_compressed_one_by_one(leg, tmp_path, refusal, compressed):
    compressed("ros2", "MESSAGE")
    path = write(tmp_path, "ros2 of mcap", leg_messages())
    assert "messages are compressed one by one" in refusal(leg, path)


def test_a_bag_of_a_few_kilobytes_that_unpacks_to_gigabytes(leg, tmp_path, refusal, compressed):
    """3.4 GB of zeros in some 300 kB, behind a frame that is empty: its header says nothing of what follows."""
    compressed("ros2", "FILE")
    path = write(tmp_path, "ros2", leg_messages())
    packer = zstandard.ZstdCompressor().compressobj()
    zeros, place = bytes(1 << 20), next(path.glob("*.zst*"))
    data = b"".join(packer.compress(zeros) for _ in range(3200)) + packer.flush()
    place.write_bytes(zstandard.ZstdCompressor().compress(b"") + data)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert place.stat().st_size < 500_000 and "unpacked it is larger than 2.05e+03 MB" in refusal(leg, path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000, "kB"


def test_pieces_are_the_text():
    import bz2

    text = bytes(range(256)) * 20_000
    zstd = zstandard.ZstdCompressor()
    skipped = b"\x50\x2a\x4d\x18\x04\x00\x00\x00abcd"
    assert b"".join(unpacking.of_bz2(bz2.compress(text) + bz2.compress(b"end"))) == text + b"end"
    assert b"".join(unpacking.of_lz4(lz4.frame.compress(text) + lz4.frame.compress(b"end"))) == text + b"end"
    for source in (bytes, io.BytesIO):
        assert b"".join(unpacking.of_zstd(source(skipped + zstd.compress(text) + zstd.compress(b"end")))) == text + b"end"
    assert unpacking.size(unpacking.of_bz2(bz2.compress(text)), 1000) == unpacking.PIECE, "it stops"
    for pieces in (unpacking.of_bz2(bz2.compress(text)[:-9]), unpacking.of_lz4(lz4.frame.compress(text)[:-9])):
        with pytest.raises(EOFError):
            unpacking.size(pieces, 1 << 30)


@pytest.mark.parametrize(("kind", "how"), WAYS)
def test_cut_compressed_bags(leg, tmp_path, refusal, compressed, kind, how):
    compressed(kind, how)
    path = write(tmp_path, kind, leg_messages(MESSAGES))
    files = [f for f in path.iterdir() if f.name != "metadata.yaml"] if path.is_dir() else [path]
    for kept in (0.3, 0.7, 0.98):
        data = files[0].read_bytes()
        files[0].write_bytes(data[: int(kept * len(data))])
        said = refusal(leg, path)
        assert "truncated or damaged" in said or "index" in said
        files[0].write_bytes(data)


@pytest.mark.parametrize(("compression", "pack"), [("", bytes), ("zstd", zstandard.compress), ("lz4", lz4.frame.compress)])
def test_chunks_that_an_index_names_count_together(monkeypatch, compression, pack):
    """Behind 9 bytes of the record, 40 of the chunk, and the name of its compression."""
    packed, found = pack(bytes(1000)), []
    file = io.BytesIO()
    for _ in range(3):
        found.append(SimpleNamespace(chunk_start_offset=file.tell(), compression=compression, compressed_size=len(packed)))
        file.write(bytes(49) + compression.encode() + packed)
    bag = SimpleNamespace(storage=SimpleNamespace(chunks=found, bio=file))
    assert least(monkeypatch, "MOTION_BYTES", lambda: check_index("bag", bag)) == 3000


@pytest.mark.parametrize(("cut", "places"), [(0, [17, 29]), (1, [17]), (9, [17])])
def test_records_end_where_the_file_does(cut, places):
    """A record may have no contents; of one that is cut there is no place."""
    records = bytes(8) + b"\x06" + (3).to_bytes(8, "little") + b"abc" + b"\x06" + bytes(8)
    assert list(chunks_from(io.BytesIO(records[: len(records) - cut]), 8)) == places
    with pytest.raises(EOFError):
        list(chunks_from(io.BytesIO(records[:19]), 8))


def chunk(name: bytes, packed: bytes) -> bytes:
    """Of an MCAP file: two times, the size unpacked, a checksum, the compression, and the records."""
    return struct.pack("<QQQII", 1, 2, 0, 0, len(name)) + name + struct.pack("<Q", len(packed)) + packed


def test_counting_stops_behind_the_most(monkeypatch):
    """At the first piece or chunk that is more; a name may have 100 bytes; and a chunk ends within the file."""
    packed = zstandard.ZstdCompressor().compressobj()
    large = packed.compress(bytes(5000)) + packed.flush()  # without its size
    monkeypatch.setattr(unpacking, "PIECE", 1000)
    for one, mosts in (
        (chunk(b"", bytes(1000)), {5000: 3000, 2000: 3000, 1999: 2000, 999: 1000}),
        (chunk(b"zstd", large), {20_000: 15_000, 6500: 7000, 5000: 6000, 4999: 5000}),
    ):
        for most, counted in mosts.items():
            assert unpacked_size(io.BytesIO(3 * one), [k * len(one) for k in range(3)], most) == counted, most
    named = chunk(bytes(100), bytes(7))
    assert unpacked_size(io.BytesIO(named), [0], 100) == 7
    for damaged, error in ((named[:-1], EOFError), (chunk(bytes(101), bytes(7)), ValueError)):
        with pytest.raises(error):
            unpacked_size(io.BytesIO(damaged), [0], 100)
