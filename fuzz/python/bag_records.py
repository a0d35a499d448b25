"""Records of MCAP files and ROS 1 bags, taken apart and put together again, so that mutations reach what is packed inside of them."""

from __future__ import annotations

import bz2
import struct
from collections.abc import Callable
from dataclasses import dataclass, field

import lz4.frame
import zstandard

MCAP_MAGIC, BAG_MAGIC = b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, CHUNK_INDEX, DATA_END = 0x02, 0x03, 0x04, 0x05, 0x06, 0x08, 0x0F  # of MCAP
MOST = 1 << 20
"""Bytes to which a chunk is unpacked here."""

PACK: dict[bytes, Callable[[bytes], bytes]] = {
    b"": bytes,
    b"none": bytes,
    b"bz2": bz2.compress,
    b"lz4": lz4.frame.compress,
    b"zstd": zstandard.ZstdCompressor().compress,
}
UNPACK: dict[bytes, Callable[[bytes], bytes]] = {
    b"": bytes,
    b"none": bytes,
    b"bz2": lambda packed: bz2.BZ2Decompressor().decompress(packed, MOST),
    b"lz4": lambda packed: lz4.frame.LZ4FrameDecompressor().decompress(packed, MOST),
    b"zstd": lambda packed: zstandard.ZstdDecompressor().stream_reader(packed).read(MOST),
}


@dataclass
class Record:
    """One record.  head: what it is, or the fields of its header; inside: records of a chunk."""

    head: bytes
    content: bytes
    place: int
    inside: list[Record] = field(default_factory=list)
    packed: bytes = b""
    """How the records inside are compressed."""

    @property
    def kind(self) -> int:
        return self.head[0] if len(self.head) == 1 else fields_of(self.head).get(b"op", b"\0")[0]


def mcap_records(data: bytes, place: int = len(MCAP_MAGIC), nested: bool = False) -> list[Record]:
    """Raises struct.error, or an error of a compression, for damaged files; what follows behind the last whole record is left out."""
    found = []
    while place + 9 <= len(data):
        kind, length = struct.unpack_from("<BQ", data, place)
        record = Record(bytes([kind]), data[place + 9 : place + 9 + length], place)
        if kind == CHUNK and not nested:
            size = struct.unpack_from("<I", record.content, 28)[0]
            record.packed = record.content[32 : 32 + size]
            record.inside = mcap_records(UNPACK[record.packed](record.content[40 + size :]), 0, True)
        found.append(record)
        place += 9 + length
        if kind == FOOTER:
            break
    return found


def mcap_file(records: list[Record]) -> bytes:
    """The file, in which the index points to where the records are now.  Checksums are left out, as the format allows."""
    moved, parts, place = {0: 0}, [], len(MCAP_MAGIC)
    for record in records:
        if record.inside:
            raw = b"".join(_mcap_record(each) for each in record.inside)
            packed = PACK[record.packed](raw)
            head = record.content[:16] + struct.pack("<QI", len(raw), 0) + struct.pack("<I", len(record.packed)) + record.packed
            record.content = head + struct.pack("<Q", len(packed)) + packed
        moved.setdefault(record.place, place)
        place += 9 + len(record.content)
    for record in records:
        content = record.content
        if record.kind == CHUNK_INDEX and len(content) >= 32:
            start, length = struct.unpack_from("<QQ", content, 16)
            chunk = next((r for r in records if r.place == start and r.inside), None)
            content = content[:16] + struct.pack("<QQ", moved.get(start, start), 9 + len(chunk.content) if chunk else length) + content[32:]
        elif record.kind == FOOTER and len(content) == 20:
            content = struct.pack("<QQI", *(moved.get(x, x) for x in struct.unpack_from("<QQ", content)), 0)
        elif record.kind == DATA_END:
            content = bytes(4)
        parts.append(_mcap_record(Record(record.head, content, 0)))
    return MCAP_MAGIC + b"".join(parts) + MCAP_MAGIC


def _mcap_record(record: Record) -> bytes:
    return record.head + struct.pack("<Q", len(record.content)) + record.content


def fields_of(head: bytes) -> dict[bytes, bytes]:
    """The header of a record of a ROS 1 bag."""
    found, place = {}, 0
    while place + 4 <= len(head):
        (size,) = struct.unpack_from("<I", head, place)
        name, _, value = head[place + 4 : place + 4 + size].partition(b"=")
        found[name] = value
        place += 4 + size
    return found


def head_of(fields: dict[bytes, bytes]) -> bytes:
    return b"".join(struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value for name, value in fields.items())


def bag_records(data: bytes, place: int = len(BAG_MAGIC), nested: bool = False) -> list[Record]:
    """The records of a ROS 1 bag from a place on; of chunks the records in them, too, unless nested."""
    found = []
    while place + 8 <= len(data):
        (size,) = struct.unpack_from("<I", data, place)
        (length,) = struct.unpack_from("<I", data, place + 4 + size)
        record = Record(data[place + 4 : place + 4 + size], data[place + 8 + size : place + 8 + size + length], place)
        if record.kind == 5 and not nested:
            record.packed = fields_of(record.head).get(b"compression", b"")
            record.inside = bag_records(UNPACK[record.packed](record.content), 0, True)
        elif record.kind == 3:
            record.content = record.content.rstrip(b" ")  # the room for a longer header
        found.append(record)
        place += 8 + size + length
    return found


def bag_file(records: list[Record]) -> bytes:
    moved, inner, place = {}, {}, len(BAG_MAGIC)
    for record in records:
        if record.inside:
            raw, inner = b"", {}
            for each in record.inside:
                inner[each.place] = len(raw)
                raw += _bag_record(each)
            record.content = PACK[record.packed](raw)
            record.head = head_of(fields_of(record.head) | {b"compression": record.packed, b"size": struct.pack("<I", len(raw))})
        elif record.kind == 4:  # the index of the chunk before it
            entries = [record.content[k : k + 12] for k in range(0, len(record.content) - 11, 12)]
            record.content = b"".join(e[:8] + struct.pack("<I", inner.get(at := struct.unpack("<I", e[8:])[0], at)) for e in entries)
        moved.setdefault(record.place, place)
        place += 8 + len(record.head) + len(record.content)
    for record in records:
        fields = fields_of(record.head)
        for name in (b"index_pos", b"chunk_pos"):
            if len(fields.get(name, b"")) == 8:
                (at,) = struct.unpack("<Q", fields[name])
                record.head = head_of(fields | {name: struct.pack("<Q", moved.get(at, at))})
    return BAG_MAGIC + b"".join(map(_bag_record, records))


def _bag_record(record: Record) -> bytes:
    return struct.pack("<I", len(record.head)) + record.head + struct.pack("<I", len(record.content)) + record.content
