"""Mutations of NPZ and Parquet files: of what they hold, and of how it is packed."""

from __future__ import annotations

import io
import zipfile
from random import Random

import atheris
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from ksl.motions.files import parquet_footer
from mutate import BYTES, NAMES, NUMBERS

TYPES = ["<f8", ">f8", "<f4", "<f2", "|i1", "<i8", "<u8", "|b1", "<U3", "|S4", "|O", "<c16", "<M8[ns]", "<U1000000000", "|V8", "<f8, (3,)", "()", "('<f8', 3)"]
SHAPES = ["()", "(8,)", "(4, 2)", "(8, 1)", "(1, 8)", "(0,)", "(-8,)", "(2, 2, 2)", "(1000000000000,)", "(0, 10**30)", "(True,)", "8", "(8.0,)"]
ARRAYS = ["time", "q", "v", "a", "names", "joints", "hip", "slide", "hip.v", "slide.v", "hip.a", "t", "note"]
_random = Random(1)


def another_column(n: int) -> np.ndarray:
    """Numbers as recordings have them, and as they don't."""
    way = _random.randrange(8)
    x = np.arange(n) * _random.choice([1.0, 0.01, 1e-9, 1e9, -1.0, 1e300])
    if way == 0:
        x[:] = float(_random.choice(NUMBERS))
    if way < 5 and n:
        for _ in range(_random.randint(1, n)):
            x[_random.randrange(n)] = float(_random.choice(NUMBERS))
    with np.errstate(all="ignore"):
        return x.astype(_random.choice([np.float64, np.float64, np.float32, np.int64, np.uint8, np.bool_]))


def of_npz(data: bytes, most: int, seed: int) -> bytes:
    """Arrays are renamed, removed, repeated, replaced; their headers and numbers are changed; the archive is packed again."""
    _random.seed(seed)
    if seed % BYTES:
        try:
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                members = [(each.filename, archive.read(each)) for each in archive.infolist() if each.file_size < most]
            for _ in range(_random.randint(1, 3)):
                _change_member(members)
            made = zipped(members)
            if len(made) <= most:
                return made
        except Exception:  # of what is no archive any more
            pass
    return atheris.Mutate(data, most)


def _change_member(members: list[tuple[str, bytes]]) -> None:
    at = _random.randrange(len(members))
    name, inside = members[at]
    way = _random.randrange(10)
    if way == 0:
        del members[at]
    elif way == 1:
        members.append((_name(), inside))
    elif way == 2:
        members[at] = (_name(), inside)
    elif way < 6:
        members[at] = (name, _with_header(inside))
    elif way < 8:
        out = io.BytesIO()
        x = another_column(8)
        np.lib.format.write_array(out, x.reshape(4, 2) if _random.randrange(4) == 0 else x)
        members[at] = (name, out.getvalue())
    elif way == 8:
        members[at] = (name, inside[:128] + atheris.Mutate(inside[128:], len(inside)))
    else:
        members[at] = (name, atheris.Mutate(inside, len(inside) + 8))


def _name() -> str:
    return _random.choice([*ARRAYS, *NAMES]) + _random.choice([".npy"] * 9 + [""])


def _with_header(inside: bytes) -> bytes:
    """The array with another type, shape, order or version."""
    text = inside[10:].partition(b"\n")[0].decode("latin-1")
    dtype, fortran, shape = _random.choice(TYPES), _random.choice(["False", "True", "0"]), _random.choice(SHAPES)
    keep = text.partition("'shape': ")[2].rpartition(",")[0] or "(8,)"
    header = f"{{'descr': {dtype!r}, 'fortran_order': {fortran}, 'shape': {_random.choice([shape, keep])}, }}"
    version = _random.choice([1] * 6 + [2, 3, 9])
    length = len(header) + 1
    return b"\x93NUMPY" + bytes([version, 0]) + length.to_bytes(2 if version == 1 else 4, "little") + header.encode() + b"\n" + inside[11 + len(text) :]


def zipped(members: list[tuple[str, bytes]]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, inside in members:
            archive.writestr(zipfile.ZipInfo(name), inside, _random.choice([zipfile.ZIP_STORED] * 4 + [zipfile.ZIP_DEFLATED] * 2 + [zipfile.ZIP_BZIP2]))
    made = out.getvalue()
    if _random.randrange(8):
        return made
    at = made.rindex(b"PK\x01\x02")  # sizes, sums and names of the directory that are not those of the arrays
    return made[:at] + atheris.Mutate(made[at:], len(made) - at)


def of_parquet(data: bytes, most: int, seed: int) -> bytes:
    """Columns are renamed, removed, repeated, replaced and cast, and written again; or the bytes of the footer are changed, or any others."""
    _random.seed(seed)
    way = seed % BYTES
    if way > 1:
        try:
            table = pq.read_table(pa.BufferReader(data)) if _says_little(data) else None
            if table is not None and table.num_rows < 200:
                made = _written(table)
                if len(made) <= most:
                    return made
        except Exception:  # of what is no Parquet file any more, and of types that can't be cast or written
            pass
    if way == 1 and data.endswith(b"PAR1") and 12 < (size := int.from_bytes(data[-8:-4], "little") + 8) < len(data):
        footer = atheris.Mutate(data[-size:-8], size - 8)
        return data[:-size] + footer + len(footer).to_bytes(4, "little") + b"PAR1"
    return atheris.Mutate(data, most)


def _says_little(data: bytes) -> bool:
    """Whether the file says of itself that it is small: a mutation must not take what a reader would refuse."""
    groups = parquet_footer.row_groups(data[-8 - int.from_bytes(data[-8:-4], "little") : -8])
    return sum(chunk.values for group in groups for chunk in group.columns) < 2000


def _written(table: pa.Table) -> bytes:
    columns = dict(zip(table.column_names, table.columns))
    n = table.num_rows
    for _ in range(_random.randint(1, 3)):
        name = _random.choice(list(columns) or ["time"])
        way = _random.randrange(8)
        if way == 0:
            columns.pop(name, None)
        elif way == 1:
            columns[_random.choice([*ARRAYS, *NAMES])] = columns.get(name, pa.array(another_column(n)))
        elif way == 2:
            columns[name] = _cast(columns[name])
        elif way < 6:
            columns[name] = pa.array(another_column(n))
        else:
            columns[name] = _odd_column(n)
    out = pa.BufferOutputStream()
    metadata = {b"unit": _random.choice([b"deg", b"rad", b"ms", b"\xff"])}
    fields = [pa.field(name, x.type, metadata=metadata if _random.randrange(8) == 0 else None) for name, x in columns.items()]
    made = pa.table(list(columns.values()), schema=pa.schema(fields))
    pq.write_table(
        made,
        out,
        compression=_random.choice(["none", "snappy", "gzip", "zstd", "lz4", "brotli"]),
        use_dictionary=bool(_random.randrange(2)),
        row_group_size=_random.choice([3, 100]),
    )
    return bytes(out.getvalue())


def _cast(x: pa.ChunkedArray) -> pa.ChunkedArray:
    kinds = [
        pa.float32(),
        pa.float16(),
        pa.int64(),
        pa.uint8(),
        pa.string(),
        pa.large_string(),
        pa.binary(),
        pa.timestamp("ns"),
        pa.timestamp("s", "Nowhere/Bad"),
        pa.duration("us"),
        pa.decimal128(30, 3),
    ]
    return x.cast(_random.choice(kinds), safe=False)


def _odd_column(n: int) -> pa.Array:
    numbers = another_column(n).astype(float).tolist()
    texts = [_random.choice(["0:00:01.5", "2026-03-01 12:00:00.25", "0.25 sec", "x" * 200, *NAMES]) for _ in range(n)]
    return _random.choice(
        [
            lambda: pa.array([None if _random.randrange(3) == 0 else x for x in numbers]),
            lambda: pa.array([[x] * _random.choice([2, 2, 2, 3, 0]) for x in numbers]),
            lambda: pa.array([[x] * 2 for x in numbers], pa.list_(pa.float64(), 2)),
            lambda: pa.array([[[x]] for x in numbers]),
            lambda: pa.array([{"a": x} for x in numbers]),
            lambda: pa.array(texts),
            lambda: pa.array([texts[0]] * n).dictionary_encode(),
            lambda: pa.array([f"0:00:{k:02d}.5" for k in range(n)]),
            lambda: pa.array(range(n), pa.timestamp(_random.choice(["s", "ns"]), _random.choice([None, "UTC"]))),
            lambda: pa.array([_random.choice([-(2**63) + 1, 2**63 - 1, 0]) for _ in range(n)], pa.timestamp(_random.choice(["s", "ns"]))),
            lambda: pa.nulls(n),
        ]
    )()
