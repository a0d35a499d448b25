"""NPZ and Parquet files whose damage ended the process, or in faults of Python."""

import sys
import tracemalloc
import zipfile

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from parquet_footer_test import signed
from scipy.io import savemat
from text_that_is_none import damaged_text

from ksl.base import limits
from ksl.motions.files import parquet_footer
from ksl.motions.reading import read_motion

T = np.arange(8.0)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("name", ["note", "names"])
@pytest.mark.parametrize("damage", [lambda x: x[:-8] + b"\x7f" * 8, lambda x: x[:-1]], ids=["beyond", "cut"])
def test_text_of_characters_that_unicode_does_not_have(leg, tmp_path, refusal, name, order, damage):
    """NumPy makes strings of them that Python fails to print; the last one that there is may be read.  Nor is text that is cut."""
    np.savez(tmp_path / "m.npz", time=T, hip=T, slide=T, **{name: np.array([2 * chr(sys.maxunicode)], f"{order}U2")})
    assert len(read_motion(leg, tmp_path / "m.npz", ignore_extra=True).time) == len(T)
    with zipfile.ZipFile(tmp_path / "m.npz") as archive:
        members = {each: archive.read(each) for each in archive.namelist()}
    members[f"{name}.npy"] = damage(members[f"{name}.npy"])
    with zipfile.ZipFile(tmp_path / "m.npz", "w") as archive:
        for each, inside in members.items():
            archive.writestr(each, inside)
    assert "truncated or damaged" in refusal(leg, tmp_path / "m.npz")


@pytest.mark.parametrize("dictionary", [True, False])
@pytest.mark.parametrize("texts", [["0:01:02", "0:01:03"], ["nonsense", "0:01:03"], ["2026-03-01 12:00:00", "2026-03-01 12:00:01"], ["0.25 sec", "0.5 sec"]])
def test_times_that_are_no_utf_8(leg, tmp_path, refusal, texts, dictionary):
    """Python fails to make text of them, where a time is to be shown."""
    columns = {"time": damaged_text(texts), "hip": pa.array([0.0, 1.0]), "slide": pa.array([0.0, 1.0])}
    pq.write_table(pa.table(columns), tmp_path / "m.parquet", use_dictionary=dictionary)
    assert refusal(leg, tmp_path / "m.parquet") == ": is a Parquet file, but truncated or damaged; copy or write it again"


def without_rows(path, columns):
    """A file of some hundred bytes that says that it has many columns, two of them in arrays of no rows."""
    if path.suffix == ".npz":
        np.savez(path, c=np.empty((0, columns)), d=np.empty((0, columns)))
    elif path.suffix == ".mat":
        savemat(path, {name: np.empty((0, columns)) for name in "cd"})
    else:
        lists = pa.array([], pa.list_(pa.float64(), columns))
        pq.write_table(pa.table(dict.fromkeys("cd", lists)), path)


@pytest.mark.parametrize("form", ["npz", "mat", "parquet"])
def test_columns_that_take_no_place_are_counted(leg, tmp_path, refusal, form, monkeypatch):
    """They took gigabytes, since each got a name; those of all arrays count together."""
    monkeypatch.setattr(limits, "COLUMNS", 1000)
    for columns, said in ((600, "1,200 columns; at most 1,000 are read"), (10**6, "columns; at most 1,000 are read"), (400, "")):
        without_rows(tmp_path / f"m.{form}", columns)
        tracemalloc.start()
        found = refusal(leg, tmp_path / f"m.{form}")
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert (said in found if said else "columns; at most" not in found) and most < 4 << 20, (found, most)


def test_a_footer_that_contradicts_itself(leg, tmp_path, refusal):
    """pyarrow ended the process: a column that can't be missing, and statistics of where it is."""
    pq.write_table(pa.table({"time": T, "hip": T, "slide": T}), tmp_path / "m.parquet", store_schema=False)
    data = (tmp_path / "m.parquet").read_bytes()
    optional, required = b"\x15\x0a\x25\x02\x18\x03hip", b"\x15\x0a\x25\x00\x18\x03hip"
    assert data.count(optional) == 1
    (tmp_path / "m.parquet").write_bytes(data.replace(optional, required))
    assert "truncated or damaged" in refusal(leg, tmp_path / "m.parquet")


def footer(path):
    data = path.read_bytes()
    return data[-8 - int.from_bytes(data[-8:-4], "little") : -8]


def test_sizes_are_those_that_pyarrow_says(tmp_path):
    table = pa.table(
        {"time": T, "text": list("abcdefgh"), "lists": [[1.0] * k for k in range(8)], "deep": [{"a": [k], "b": None} for k in range(8)], "flag": T > 2}
    )
    for options in (
        {"row_group_size": 3},
        {"compression": "zstd", "write_page_index": True, "use_dictionary": False},
        {"data_page_version": "2.0", "store_schema": False},
    ):
        pq.write_table(table, tmp_path / "m.parquet", **options)
        metadata = pq.ParquetFile(tmp_path / "m.parquet").metadata
        groups = [metadata.row_group(g) for g in range(metadata.num_row_groups)]
        sizes = [(g.num_rows, [(c.num_values, c.total_uncompressed_size) for c in map(g.column, range(metadata.num_columns))]) for g in groups]
        assert parquet_footer.row_groups(footer(tmp_path / "m.parquet")) == sizes


@pytest.mark.parametrize(("of_group", "of_file"), [(9, 8), (7, 8), (8, 9), (8, 7), (9, 9), (-1, -1), (2**37, 8), (2**37, 2**37), (-(2**37), 8), (8, -(2**37))])
def test_row_groups_have_the_rows_that_the_file_says(leg, tmp_path, refusal, of_group, of_file):
    """pyarrow takes memory for the rows of a group before it looks at columns: 256 GB for a file of 1.5 KB."""
    pq.write_table(pa.table({"time": T, "hip": T, "slide": T}), tmp_path / "m.parquet", store_schema=False)
    data = (tmp_path / "m.parquet").read_bytes()
    whole = footer(tmp_path / "m.parquet")
    said = whole
    for n, before, behind in ((of_file, b"\x16", b"\x19\x1c\x19\x3c"), (of_group, b"\x16", b"\x26\x08")):  # before the list of groups, and before an offset
        assert whole.count(before + b"\x10" + behind) == 1
        said = said.replace(before + b"\x10" + behind, before + signed(n) + behind)
    (tmp_path / "m.parquet").write_bytes(data[: -8 - len(whole)] + said + len(said).to_bytes(4, "little") + b"PAR1")
    assert "truncated or damaged" in refusal(leg, tmp_path / "m.parquet")


def test_what_is_no_footer(tmp_path):
    pq.write_table(pa.table({"time": T}), tmp_path / "m.parquet")
    whole = footer(tmp_path / "m.parquet")
    lists = b"\x19" + b"\x19" * 40  # in lists in lists
    structs = b"\x1c" * 40
    for data in (
        *(whole[:k] for k in range(len(whole) - 1)),
        lists,
        structs,
        b"\x19\xfc\xff\xff\x03",
        b"\x49\x16\x00",
        b"\x1b\x00",
        b"\x16" + b"\xff" * 11,
        b"\x16" + b"\xff" * 10 + bytes(2),
    ):
        with pytest.raises(ValueError):
            parquet_footer.row_groups(data)
