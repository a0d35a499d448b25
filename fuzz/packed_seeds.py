#!/usr/bin/env python3
"""Small valid files for the targets of formats that are packed: packed_seeds.py FORMAT FOLDER, FORMAT being npz, parquet, mcap, ros1, ros2, xlsx or mat.

They are written by the libraries of these formats, so that no binary file is kept in the repository.
"""

import argparse
import io
import sqlite3
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "examples/motions"), str(ROOT / "fuzz/python")]
K = np.arange(8)
T = K / 100
COLUMNS = {"time": T, "hip": 0.1 * T, "slide": T**2}
"""Eight samples of the robot of the targets."""
START = 1_760_000_000_000_000_000


def npz():
    def packed(write=np.savez, **arrays):
        out = io.BytesIO()
        write(out, **arrays)
        return out.getvalue()

    both = np.column_stack([COLUMNS["hip"], COLUMNS["slide"]])
    rates = {f"{n}.{r}": 0.1 * T for n in ("hip", "slide") for r in "va"}
    yield "columns", packed(**COLUMNS)
    yield "compressed", packed(np.savez_compressed, **COLUMNS, **rates)
    yield "matrices", packed(time=T, q=both, v=both, a=np.asfortranarray(both))
    yield "names", packed(time=T, q=both[:, ::-1], names=np.array(["slide", "hip"]), note=np.array("a text"))
    yield "integers", packed(t=K, hip=K.astype(np.int8), slide=K.astype(">f4").reshape(-1, 1))


def parquet():
    import pyarrow as pa
    import pyarrow.parquet as pq

    def written(columns, **options):
        out = pa.BufferOutputStream()
        pq.write_table(pa.table(columns), out, **{"write_statistics": False, "store_schema": False} | options)
        return bytes(out.getvalue())

    rates = {f"{n}.v": 0.1 * T for n in ("hip", "slide")}
    dates = pa.array(START + 10_000_000 * K, pa.timestamp("ns", "UTC"))
    yield "plain", written(COLUMNS, use_dictionary=False, compression="none")
    yield "rates", written(COLUMNS | rates, compression="zstd", store_schema=True, row_group_size=5)
    yield "dates", written(COLUMNS | {"time": dates})
    yield "texts", written(COLUMNS | {"time": [f"0:00:{k / 100:09.6f}" for k in K]})
    yield "lists", written({"time": T, "hip": T, "state": [[x, x] for x in T]}, use_dictionary=False)
    yield "missing", written(COLUMNS | {"slide": [None if k == 3 else k / 10 for k in K]}, write_statistics=True)


def messages(rates=True):
    for k in K.tolist():
        stamp = START + k * 10_000_000
        yield stamp + 1_000_000, stamp, ["slide", "hip"], np.array([k * k * 1e-4, k / 100]), np.array([k / 50, 1.0] if rates else []), np.empty(0)


def mcap():
    import make_bag
    from mcap.writer import CompressionType, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    stamped = {name: store.types[f"{package}/msg/{name}"] for package, name in (("builtin_interfaces", "Time"), ("std_msgs", "Header"))}

    def written(rates, **options):
        out = io.BytesIO()
        writer = Writer(out, **options)
        writer.start("ros2")
        schema = writer.register_schema(make_bag.TYPE, "ros2msg", make_bag.DEFINITION.encode())
        channel = writer.register_channel(make_bag.TOPIC, "cdr", schema)
        for log, stamp, *numbers in messages(rates):
            header = stamped["Header"](stamp=stamped["Time"](*divmod(stamp, 10**9)), frame_id="")
            data = bytes(store.serialize_cdr(store.types[make_bag.TYPE](header, *numbers), make_bag.TYPE))
            writer.add_message(channel, log, data, log)
        writer.finish()
        return out.getvalue()

    yield "none", written(True, compression=CompressionType.NONE)
    yield "lz4", written(False, compression=CompressionType.LZ4)
    yield "zstd", written(True, compression=CompressionType.ZSTD, chunk_size=300)
    yield "without_chunks", written(True, use_chunking=False)


def ros1():
    import make_bag
    from bag_records import bag_file, bag_records

    with tempfile.TemporaryDirectory() as folder:
        make_bag.write_ros1(Path(folder) / "bag", messages())
        data = (Path(folder) / "bag").read_bytes()
    for how in (b"none", b"lz4", b"bz2"):
        records = bag_records(data)
        for each in records:
            each.packed = how if each.inside else b""
        yield how.decode(), bag_file(records)


def ros2():
    import make_bag
    import zstandard

    def folder_of(storage, rates=True):
        with tempfile.TemporaryDirectory() as folder:
            make_bag.write_ros2(Path(folder) / "bag", messages(rates), storage)
            return {each.name: each.read_bytes() for each in sorted((Path(folder) / "bag").iterdir())}

    def smaller(database, packed=False):
        """In pages of 512 bytes, without the definitions of messages."""
        with tempfile.TemporaryDirectory() as folder:
            (path := Path(folder) / "bag").write_bytes(database)
            made = sqlite3.connect(path, isolation_level=None)
            if packed:
                made.create_function("pack", 1, zstandard.ZstdCompressor().compress)
                made.execute("UPDATE messages SET data = pack(data)")
            made.execute("UPDATE message_definitions SET encoded_message_definition = ''")
            made.executescript("PRAGMA page_size = 512; VACUUM")
            made.close()
            return path.read_bytes()

    def zipped(files):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            for name, inside in files.items():
                archive.writestr(zipfile.ZipInfo(name), inside)
        return out.getvalue()

    def compressed(files, mode):
        text = (
            files["metadata.yaml"]
            .replace(b"compression_format: ''", b"compression_format: zstd")
            .replace(b"compression_mode: ''", b"compression_mode: " + mode)
        )
        return files | {"metadata.yaml": text}

    files = folder_of("sqlite3")
    yield "database", smaller(files["bag.db3"])
    small = files | {"bag.db3": smaller(files["bag.db3"])}
    yield "folder", zipped(small)
    whole = compressed(small, b"file") | {"bag.db3.zstd": zstandard.ZstdCompressor().compress(small["bag.db3"])}
    del whole["bag.db3"]
    yield "whole", zipped({name: inside.replace(b"bag.db3", b"bag.db3.zstd") if name == "metadata.yaml" else inside for name, inside in whole.items()})
    yield "each_message", zipped(compressed(files, b"message") | {"bag.db3": smaller(files["bag.db3"], packed=True)})
    yield "of_mcap", zipped(folder_of("mcap", rates=False))


def xlsx():
    import datetime

    import openpyxl

    def written(rows, title=None, name="Sheet"):
        book = openpyxl.Workbook()
        book.active.title = name
        for row in [*([[title]] if title else []), *rows]:
            book.active.append(row)
        out = io.BytesIO()
        book.save(out)
        return out.getvalue()

    samples = np.column_stack(list(COLUMNS.values())).tolist()
    dates = [[datetime.datetime(2026, 3, 1) + datetime.timedelta(milliseconds=10 * k), *row[1:]] for k, row in enumerate(samples)]
    yield "plain", written([list(COLUMNS), *samples])
    yield "units", written([list(COLUMNS), ["s", "deg", "mm"], *samples], "Arm, measured")
    yield "dates", written([list(COLUMNS), *dates])
    yield "remarks", written([["t", "hip [deg]", "slide", "note"], *([*row, "calm"] for row in samples)], name="a sheet")


def mat():
    import scipy.io

    def written(compressed=False, **variables):
        out = io.BytesIO()
        scipy.io.savemat(out, variables, do_compression=compressed)
        return out.getvalue()

    both = np.column_stack([COLUMNS["hip"], COLUMNS["slide"]])
    yield "columns", written(**COLUMNS)
    yield "compressed", written(True, time=T, q=both, v=both, a=both)
    yield "names", written(time=T[:, None], q=both, joint_names=np.array(["hip", "slide"], dtype=object), rate=100.0)
    yield "characters", written(t=K.astype(np.int32), q=both.astype(np.float32), names=["hip  ", "slide"], note="a text")


FORMATS = {each.__name__: each for each in (npz, parquet, mcap, ros1, ros2, xlsx, mat)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("format", choices=FORMATS)
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    for name, data in FORMATS[given.format]():
        (given.folder / name).write_bytes(data)


if __name__ == "__main__":
    main()
