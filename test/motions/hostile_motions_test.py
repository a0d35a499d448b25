"""Motions that are meant to do harm, or that were cut: each is refused by one sentence, by work that is linear in the file."""

import gzip
import io
import os
import re
import subprocess
import sys
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import ksl
from growth import Name, assert_linear, work
from ksl.base import limits
from ksl.base import toml_files
from ksl.base.errors import MotionError
from ksl.motions.files.map_file import read_map
from ksl.motions.reading import read_motion
from ksl.motions.files.recognise import open_table
from ksl.base.toml_files import toml_of
from regex_steps import Counted

HEAD = "time,hip,slide\n"
ROWS = "".join(f"{k},{k / 10},{k / 10}\n" for k in range(8))
"""Eight samples: six at least are differentiated."""


def refused(leg, path, **options) -> str:
    with pytest.raises(MotionError) as caught:
        read_motion(leg, path, **options)
    said = str(caught.value)
    assert said.isprintable() and len(said) < 5000, said[:200]
    return said


# work


@pytest.mark.parametrize("ignore_extra", [False, True])
def test_many_names_of_columns(leg, tmp_path, counted_names, ignore_extra):
    """A hundred thousand took 73 s."""

    def read(n: int) -> int:
        (tmp_path / "wide.csv").write_text("time," + ",".join(f"hip_{k}" for k in range(n)) + "\n" + "0," * n + "0\n")
        said = []
        count = work(lambda: said.append(refused(leg, tmp_path / "wide.csv", ignore_extra=ignore_extra)))
        assert ("no column 'hip'" if ignore_extra else "unknown column 'hip_0'") in said[0]
        return count

    assert_linear(read, 300)


def test_a_parquet_file_with_a_repeated_name_among_many(tmp_path, monkeypatch):
    class Schema:
        """That of the file, with names that count."""

        def __init__(self, schema: pa.Schema) -> None:
            self._schema, self.names, self.metadata = schema, [Name(n) for n in schema.names], schema.metadata

        def __iter__(self):
            return iter(self._schema)

    class File(pq.ParquetFile):
        schema_arrow = property(lambda self: Schema(super().schema_arrow))

    def refuse(n: int) -> int:
        names = [f"c{k}" for k in range(n)] + [f"c{n - 1}"]
        pq.write_table(pa.table([pa.array([0.0])] * len(names), names=names), tmp_path / "t.parquet")

        def run() -> None:
            with pytest.raises(MotionError, match=f"two columns are named 'c{n - 1}'"):
                open_table(tmp_path / "t.parquet")

        return work(run)

    monkeypatch.setattr(pq, "ParquetFile", File)
    assert_linear(refuse, 200)


# what is no regular file


def test_a_named_pipe_is_refused_at_once(leg, tmp_path):
    os.mkfifo(tmp_path / "motion.csv")
    code = "import sys, ksl; ksl.read_motion(ksl.load(sys.argv[1]), sys.argv[2])"
    p = subprocess.run([sys.executable, "-c", code, leg.file, tmp_path / "motion.csv"], capture_output=True, text=True, timeout=60)
    assert "is a pipe" in p.stderr and "- < " in p.stderr


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/full", "/dev/urandom"])
def test_devices(leg, device):
    assert "device" in refused(leg, device)
    with pytest.raises(MotionError, match="device"):
        read_map(device)


def test_standard_input_has_a_limit(leg, monkeypatch):
    monkeypatch.setattr(limits, "MOTION_BYTES", 1000)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(open("/dev/zero", "rb")))
    assert refused(leg, "-").startswith("standard input: is larger than")


def test_a_sparse_file(leg, tmp_path):
    with open(tmp_path / "big.csv", "wb") as f:
        f.write((HEAD + ROWS).encode())
        f.truncate(8 << 30)
    assert "is larger than" in refused(leg, tmp_path / "big.csv")


# sizes


@pytest.mark.parametrize("unit", [b"0" * (1 << 20), bytes(1 << 20)], ids=["zeros", "null"])
def test_compressed_bombs(leg, tmp_path, monkeypatch, unit):
    monkeypatch.setattr(limits, "MOTION_BYTES", 1 << 20)
    for pack, name in ((gzip.compress, "gz"), (__import__("bz2").compress, "bz2"), (__import__("lzma").compress, "xz")):
        (tmp_path / name).write_bytes(pack(HEAD.encode() + unit * 4))
        assert "unpacked" in refused(leg, tmp_path / name)


def test_a_bomb_in_an_npz_file(leg, tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "MOTION_BYTES", 1 << 20)
    np.savez_compressed(tmp_path / "m.npz", time=np.zeros(1 << 18))
    assert "unpacked" in refused(leg, tmp_path / "m.npz")


def array(descr: str, shape: tuple[int, ...], data: bytes = bytes(80), version: int = 1, blanks: int = 0) -> bytes:
    """An array of an NPZ file whose header says what the test wants."""
    header = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode() + b" " * blanks + b"\n"
    return b"\x93NUMPY" + bytes([version, 0]) + len(header).to_bytes(2 if version == 1 else 4, "little") + header + data


@pytest.fixture
def packed(tmp_path):
    """Writes arrays of bytes, with the samples of `leg` that are not among them, into an NPZ file, and gives its path."""

    def write(method: int = zipfile.ZIP_DEFLATED, **arrays: bytes) -> Path:
        samples = {n: array("'<f8'", (8,), np.arange(8.0).tobytes()) for n in ("time", "hip", "slide")}
        with zipfile.ZipFile(tmp_path / "m.npz", "w", method) as z:
            for name, data in (samples | arrays).items():
                z.writestr(f"{name}.npy", data)
        return tmp_path / "m.npz"

    return write


def memory_of(refusal) -> tuple[str, int]:
    """What a refusal says, and the most bytes that it held; NumPy's are among them."""
    tracemalloc.start()
    try:
        return refusal(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


DAMAGED = {
    "more numbers than there are": array("'<f8'", (10**15,)),
    "a text longer than the file": array("'<U1000000000'", ()),
    "fewer than none": array("'<f8'", (-8,)),
    "a size that no array has": array("'<f8'", (0, 10**30)),
    "a size that is no number": array("'<f8'", (True,)),
    "no type": array("()", (8,)),
    "a nested type": array("-" * 9000 + "1", (8,)),
    "a header of 20 MB": array("'<f8'", (8,), version=2, blanks=20_000_000),
    "no header": b"time" * 20,
    "a version to come": array("'<f8'", (8,), version=9),
}


@pytest.mark.parametrize("name", ["hip", "names"])
@pytest.mark.parametrize("what", DAMAGED)
def test_an_array_that_is_not_what_it_claims(leg, packed, what, name):
    path = packed(**{name: DAMAGED[what]})
    said, most = memory_of(lambda: refused(leg, path))
    assert "truncated or damaged" in said and most < 4_000_000


def test_an_npz_file_of_more_numbers_than_are_taken(leg, packed, monkeypatch):
    """Nothing counted them, and bytes became doubles, which need eight times the memory."""
    path = packed(hip=array("'|i1'", (4_000_000,), bytes(4_000_000)))
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 4_000_015)
    said, most = memory_of(lambda: refused(leg, path))
    assert said == f"{path}: 4,000,016 numbers; at most 4,000,015 are read: thin it out, or give a part of it"
    assert most < 1_000_000
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 4_000_016)
    assert "has 4000000 samples" in refused(leg, path)


def test_text_in_an_npz_file_is_not_loaded(leg, packed):
    path = packed(note=array("'<U1000000'", (), bytes(4_000_000)), unit=array("'<U3'", (2,), np.array(["rad", "m"]).tobytes()))
    said, most = memory_of(lambda: refused(leg, path))
    assert "unknown column 'note', which holds text ('<U1000000')" in said and most < 1_000_000
    assert read_motion(leg, path, ignore_extra=True).q.shape == (8, 2)
    assert "unknown column 'unit', which holds text ('rad')" in refused(leg, path, map={"ignore": ["note"]})


@pytest.mark.parametrize("name", ["time", "hip"])
def test_text_instead_of_numbers_in_an_npz_file(leg, packed, name):
    """Ended in a fault, or in 0 samples."""
    assert f"column {name!r} holds text: '0.5'; expected numbers" in refused(leg, packed(**{name: array("'<U3'", (8,), np.array(["0.5"] * 8).tobytes())}))


@pytest.mark.parametrize("name", ["time", "hip", "mode"])
@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (complex, "complex numbers"),
        (np.complex64, "complex numbers"),
        ([("a", "f8"), ("b", "f8")], "records"),
        ("M8[ns]", "dates"),
        ("m8[ms]", "durations"),
        ("S3", "text"),
    ],
)
def test_arrays_of_other_types_in_an_npz_file(leg, tmp_path, kind, words, name):
    """Complex numbers were called text."""
    columns = {n: np.arange(8.0) for n in ("time", "hip", "slide")} | {name: np.zeros(8, kind)}
    np.savez(tmp_path / "m.npz", **columns)
    said = refused(leg, tmp_path / "m.npz")
    assert f"column {name!r}{', which' if name == 'mode' else ''} holds {words}" in said
    assert name == "mode" or said.endswith("expected real numbers" if "complex" in words else "expected numbers")


def test_lists_of_names_in_an_npz_file(leg, packed):
    size = limits.COLUMNS + 1
    path = packed(names=array("'<U3'", (size,), bytes(12 * size)))
    said, most = memory_of(lambda: refused(leg, path))
    assert said == f"{path}: 131,073 columns; at most 131,072 are read" and most < 1_000_000
    path = packed(names=array("'<U20000000'", (1,), bytes(80_000_000)))
    said, most = memory_of(lambda: refused(leg, path))
    assert said == f"{path}: array 'names' holds 76.3 MB; at most 64 MB of names are read" and most < 1_000_000


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_methods_that_unpack_more_than_is_asked_for(leg, packed, method):
    """NumPy writes none of them.  500 bytes took 700 MB, whatever the archive said of its size."""
    path = packed(method, hip=array("'|i1'", (8_000_000,), bytes(8_000_000)))
    said, most = memory_of(lambda: refused(leg, path))
    assert said.endswith("array 'time' is compressed by a method that NumPy doesn't write; save it by numpy.savez_compressed") and most < 1_000_000


def test_a_parquet_file_of_more_numbers_than_are_taken(leg, tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 1000)
    pq.write_table(pa.table({n: np.zeros(2000) for n in ("time", "hip", "slide")}), tmp_path / "m.parquet")
    assert "6,000 numbers" in refused(leg, tmp_path / "m.parquet")
    pq.write_table(pa.table({n: np.zeros(2000) for n in ("time", "hip", "slide", "hip.v", "slide.v")}), tmp_path / "m.parquet")
    assert "6,000 numbers" in refused(leg, tmp_path / "m.parquet", positions_only=True)
    assert "10,000 numbers" in refused(leg, tmp_path / "m.parquet")


def test_a_parquet_file_that_claims_fewer_rows_than_it_has(leg, tmp_path, monkeypatch):
    """Its rows are counted for the file, and again for each column: 300,000, as Thrift writes it, becomes 8."""
    path = tmp_path / "m.parquet"
    pq.write_table(pa.table({n: np.zeros(300_000) for n in ("time", "hip", "slide")}), path)
    data = path.read_bytes()
    at = data.index(b"\xc0\xcf\x24", len(data) - 8 - int.from_bytes(data[-8:-4], "little"))  # zigzag, 7 bits a byte
    path.write_bytes(data[:at] + b"\x90\x80\x00" + data[at + 3 :])
    assert pq.ParquetFile(path).metadata.num_rows == 8
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 1000)
    assert "900,000 numbers" in refused(leg, path)


def repeated_text(size: int) -> pa.Array:
    """A text of this many characters, 100 times: a few bytes of a Parquet file."""
    return pa.DictionaryArray.from_arrays(pa.array(np.zeros(100, np.int32)), pa.array(["x" * size]))


@pytest.mark.parametrize("what", ["texts", "lists"])
def test_columns_of_parquet_files_that_hold_no_numbers_are_not_read(leg, tmp_path, monkeypatch, what):
    """2.6 kB took 3.8 GB before it was said that the column holds no numbers."""
    column = repeated_text(10) if what == "texts" else pa.array([[0.0] * 10] * 100)
    samples = np.arange(100.0)
    pq.write_table(pa.table({"time": samples, "hip": column, "slide": samples}), tmp_path / "m.parquet", store_schema=False)
    monkeypatch.setattr(pq.ParquetFile, "read", lambda *_, **__: pytest.fail("was read"))
    assert ("; expected numbers" if what == "texts" else "unknown column 'hip[0]'") in refused(leg, tmp_path / "m.parquet")


def test_times_of_parquet_files_that_are_long_texts(leg, tmp_path, monkeypatch):
    samples = np.arange(100.0)
    table = pa.table({"time": repeated_text(100), "hip": samples, "slide": samples})
    pq.write_table(table, tmp_path / "m.parquet", store_schema=False)
    assert "sample 1: column 'time' holds 'xxxxx" in refused(leg, tmp_path / "m.parquet")
    monkeypatch.setattr(limits, "MOTION_BYTES", 9_999)
    assert "the times in column 'time' are larger than 9,999 bytes, the most that is read" in refused(leg, tmp_path / "m.parquet")


def test_a_parquet_file_with_long_times_that_are_text(leg, tmp_path):
    """A text of 1 MB that is stored once and repeated: 300 MB when it is read as text, and gigabytes with more rows."""
    text = pa.array(["x" * 1_000_000]).take(pa.array(np.zeros(300, dtype=int)))
    pq.write_table(pa.table({"time": text, "hip": np.zeros(300), "slide": np.zeros(300)}), tmp_path / "m.parquet")
    del text
    before = pa.total_allocated_bytes()
    said = refused(leg, tmp_path / "m.parquet")
    assert said == f"{tmp_path}/m.parquet: column 'time' holds a time of 1,000,000 bytes; at most 100 are read: write times in seconds, or as dates"
    assert pa.total_allocated_bytes() - before < 20_000_000


def test_a_parquet_file_with_text_for_numbers_is_refused_unread(leg, tmp_path, monkeypatch):
    rows = {"time": np.arange(8.0), "hip": ["a"] * 8, "slide": np.zeros(8)}
    pq.write_table(pa.table(rows), tmp_path / "m.parquet")
    monkeypatch.setattr(pq.ParquetFile, "read", lambda *_, **__: pytest.fail("it was read"))
    assert "column 'hip' holds string; expected numbers" in refused(leg, tmp_path / "m.parquet")


def test_a_parquet_file_that_is_larger_when_unpacked(leg, tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "MOTION_BYTES", 100_000)
    zeros = pa.table({n: np.zeros(50_000) for n in ("time", "hip", "slide")})
    pq.write_table(zeros, tmp_path / "m.parquet", use_dictionary=False)
    assert "unpacked it is larger than" in refused(leg, tmp_path / "m.parquet")
    repeated = pa.table({"time": ["0:00:01"] * 50_000, "hip": np.zeros(50_000), "slide": np.zeros(50_000)})
    pq.write_table(repeated, tmp_path / "m.parquet")  # a few bytes in the file
    assert "the times in column 'time' are larger than" in refused(leg, tmp_path / "m.parquet")


def test_times_that_are_text_in_several_parts(leg, tmp_path):
    rows = {"time": pa.array([f"0:00:{k / 100:09.6f}" for k in range(5000)], pa.large_string()), "hip": np.arange(5000) / 1e3, "slide": np.zeros(5000)}
    pq.write_table(pa.table(rows), tmp_path / "m.parquet", row_group_size=1500)
    np.testing.assert_allclose(read_motion(leg, tmp_path / "m.parquet").time, np.arange(5000) / 100, atol=1e-12)


@pytest.mark.parametrize(
    "kind, first, words",
    [
        (pa.timestamp("s"), 10**15, "column 'time' holds dates that are too large, only those from 1678 to 2261 are read; write times in seconds"),
        (pa.duration("s"), 10**15, "column 'time' holds durations that are too large, only those of at most 292 years are read; write times in seconds"),
        (pa.timestamp("ns", "Nowhere/Bad"), 0, "column 'time' has the time zone 'Nowhere/Bad', which is not known; write dates in UTC, or times in seconds"),
    ],
    ids=str,
)
def test_dates_that_can_not_be_read(leg, tmp_path, kind, first, words):
    rows = {"time": pa.array(range(first, first + 8), kind), "hip": np.zeros(8), "slide": np.zeros(8)}
    pq.write_table(pa.table(rows), tmp_path / "m.parquet")
    assert refused(leg, tmp_path / "m.parquet") == f"{tmp_path}/m.parquet: {words}"


def test_dates_of_three_centuries(leg, tmp_path):
    """Their difference has more nanoseconds than 64 bits hold."""
    rows = {"time": pa.array([-(2**63) + 1, *range(2**63 - 8, 2**63 - 1)], pa.timestamp("ns")), "hip": np.zeros(8), "slide": np.zeros(8)}
    pq.write_table(pa.table(rows), tmp_path / "m.parquet")
    assert "dates more than 292 years apart" in refused(leg, tmp_path / "m.parquet")


def test_a_csv_file_of_more_numbers_than_are_taken(leg, written, monkeypatch):
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 23)
    assert "24 numbers" in refused(leg, written(HEAD + ROWS))


def test_too_many_columns(leg, written, monkeypatch):
    monkeypatch.setattr(limits, "COLUMNS", 2)
    assert "3 columns; at most 2" in refused(leg, written(HEAD + ROWS))


@pytest.mark.parametrize("length", [5_000, 131_073, 1_000_000])
def test_a_name_of_a_column_that_is_too_long(leg, written, length):
    """131,073: the standard library's reader gives up there with an error of its own."""
    assert f"is {length:,} characters long" in refused(leg, written(f"time,{'x' * length},hip,slide\n0,0,0,0\n"))


def long_name(kind: str, folder: Path) -> Path:
    samples = {n: np.arange(8.0) for n in ("time", "hip", "slide")}
    long = "x" * 5000
    path = folder / f"motion.{kind}"
    if kind == "parquet":
        pq.write_table(pa.table(samples | {long: samples["hip"]}), path)
    elif kind == "array":
        np.savez(path := path.with_suffix(".npz"), **samples, **{long: samples["hip"]})
    elif kind == "names":
        np.savez(path := path.with_suffix(".npz"), time=samples["time"], q=np.zeros((8, 2)), names=["hip", long])
    else:
        from ros_bags_test import bag, leg_messages

        states = [(log, stamp, ["hip", long], np.array(q), np.empty(0), np.empty(0)) for log, stamp, _, q, *_ in leg_messages()]
        bag.write_mcap(path, states)
    return path


@pytest.mark.parametrize("kind", ["parquet", "array", "names", "mcap"])
def test_names_that_are_too_long_in_every_format(leg, tmp_path, kind):
    """CSV alone kept to the limit."""
    path = long_name(kind, tmp_path)
    assert refused(leg, path, ignore_extra=True) == f"{path}: the name {'x' * 20!r}… of a column is 5,000 characters long; at most 4,096 are read"


def test_a_field_of_a_map_that_is_too_long(tmp_path):
    (tmp_path / "map.csv").write_text(f"from,to\na,{'x' * 200_000}\n")
    with pytest.raises(MotionError, match="line 2|:2:"):
        read_map(tmp_path / "map.csv")


def test_the_limits_of_the_page_are_those_of_the_readers():
    section = (Path(__file__).parents[2] / "docs/motions.md").read_text(encoding="utf-8").split("\n## Limits\n")[1]
    said = re.findall(r"^\| .* \| ([\d,]+)(?: (GiB|MiB))?(?: characters)? \|$", section, re.MULTILINE)
    numbers = [int(number.replace(",", "")) << {"GiB": 30, "MiB": 20, "": 0}[unit] for number, unit in said]
    readers = (
        limits.MOTION_BYTES,
        limits.WORKBOOK_BYTES,
        limits.MOTION_NUMBERS,
        limits.COLUMNS,
        limits.LINE_BYTES,
        limits.NAME_LENGTH,
        limits.YAML_BYTES,
        limits.TOML_BYTES,
        limits.TOML_DEPTH,
    )
    assert numbers == [*readers, limits.ROBOT_BYTES, limits.ATTRIBUTES, limits.NAMESPACE_LENGTH]
    assert f"at most {limits.MESSAGE_LENGTH:,} characters" in section


def test_names_in_a_key(tmp_path):
    """As many as the page says, and not one more."""
    path = tmp_path / "map.toml"
    path.write_text("[columns]\n" + ".".join("a" * limits.TOML_DEPTH) + ' = "hip"\n')
    assert [rule.to for rule in read_map(path).rules.values()] == ["hip"]
    path.write_text("[columns]\n" + ".".join("a" * (limits.TOML_DEPTH + 1)) + ' = "hip"\n')
    with pytest.raises(MotionError, match="map.toml:2: a key of more than 32 names"):
        read_map(path)


@pytest.mark.parametrize("blank", [" ", "\t"])
@pytest.mark.parametrize("before", ["", "[", "[[", "a = {", "a", "a."])
def test_a_line_of_blanks_in_a_toml_file(before, blank, monkeypatch):
    """Alone in their line, 16,000 took 6 s."""
    pattern = Counted(toml_files._LONG_KEY)
    monkeypatch.setattr(toml_files, "_LONG_KEY", pattern)

    def refuse(n: int) -> int:
        pattern.taken = 0
        with pytest.raises(MotionError, match="is not TOML"):
            toml_of(before + blank * n + "?\n", "map.toml", MotionError)
        return pattern.taken

    assert_linear(refuse, 100)


@pytest.mark.parametrize("line", ["{} = 1", "[{}]", "[[{}]]", "\t[[ {} ]]", "[ {}]", "x = {{{} = 1}}", "x = {{y = 1, {} = 1}}"])
def test_long_keys_wherever_they_stand(line):
    """Names with dots between them, and with blanks around these."""
    for dot in (".", " . ", "\t."):
        toml_of(line.format(dot.join("a" * limits.TOML_DEPTH)) + "\n", "map.toml", MotionError)
        with pytest.raises(MotionError, match="map.toml:1: a key of more than 32 names"):
            toml_of(line.format(dot.join("a" * (limits.TOML_DEPTH + 1))) + "\n", "map.toml", MotionError)


# line ends


@pytest.mark.parametrize("end", ["\r", "\r\n", "\n"])
def test_every_line_end(leg, written, end):
    m = read_motion(leg, written((HEAD + ROWS).replace("\n", end)))
    assert m.q.shape == (8, 2) and not m.doubts
    comment = (HEAD + ROWS.replace("\n", "\n# note\n", 1)).replace("\n", end)
    assert read_motion(leg, written(comment)).q.shape == (8, 2)


@pytest.mark.parametrize("end", ["\r", "\r\n"])
def test_maps_with_every_line_end(tmp_path, end):
    (tmp_path / "map.csv").write_bytes(f"from,to{end}a,hip{end}b,slide{end}".encode())
    assert {k: r.to for k, r in read_map(tmp_path / "map.csv").rules.items()} == {"a": "hip", "b": "slide"}
    (tmp_path / "map.toml").write_bytes(f'[columns]{end}a = "hip"{end}'.encode())
    if end == "\r":
        with pytest.raises(MotionError, match="line ends"):
            read_map(tmp_path / "map.toml")
    else:
        assert read_map(tmp_path / "map.toml").rules["a"].to == "hip"


# files that were cut


def test_a_file_that_was_cut_inside_its_last_number(leg, written):
    """The last line lacks its end, which all others have: 0.25 may have been 0.2578."""
    m = read_motion(leg, written((HEAD + ROWS).removesuffix("\n")))
    assert any("last line (9)" in doubt and "cut" in doubt for doubt in m.doubts), m.doubts


@pytest.mark.parametrize("pack", [gzip.compress, lambda data: data], ids=["gzip", "plain"])
def test_a_file_that_ends_with_its_line_is_not_doubted(leg, written, pack):
    assert not read_motion(leg, written(pack((HEAD + ROWS).encode()))).doubts
    assert not read_motion(leg, written(pack((HEAD + ROWS + "\n\n").encode()))).doubts


def test_a_last_line_with_fewer_values_is_refused_or_doubted(leg, written):
    assert "2 values in a table of 3 columns" in refused(leg, written(HEAD + ROWS + "8,0.8"))
    cut = read_motion(leg, written(HEAD + ROWS + "8,0.8,"))
    assert "was the file cut there?" in cut.doubts[0] and cut.source.samples == len(ROWS.split())


def test_the_doubt_forbids_a_green_verdict(leg, written):
    whole, cut = (ksl.compute_loads(leg, read_motion(leg, written(text))).verdict.reasons for text in (HEAD + ROWS, (HEAD + ROWS)[:-1]))
    assert not any("cut" in r for r in whole) and any("cut" in r for r in cut)


def test_external_wrenches_that_were_cut(leg, written):
    from ksl.motions.reading import read_wrenches

    text = "time,b.fx\n" + "".join(f"{k},{k}\n" for k in range(8))
    assert read_wrenches(leg, written(text), np.arange(8.0))[1] == []
    assert "cut" in read_wrenches(leg, written(text[:-1]), np.arange(8.0))[1][0]


def test_numbers_below_the_smallest_are_zero(leg, written):
    """1e-400, as programs of more digits write; infinities stay refused."""
    m = read_motion(leg, written(HEAD + ROWS.replace("0,0.0,", "0,1e-400,").replace("1,0.1,", "1,-1e-400,")))
    assert m.q[0, 0] == 0 and m.q[1, 0] == 0
    assert "infinite" in refused(leg, written(HEAD + "0,1e400,0\n1,0,0.1\n2,0.2,0.2\n"))


def test_the_column_of_a_bad_value_beside_columns_that_are_left_out(leg, written):
    said = refused(leg, written("time,x,hip,slide\n0,q,0,0\n1,q,1p,1\n"), ignore_extra=True)
    assert "column 'hip' holds '1p'" in said
    assert "column 'slide' holds '1p'" in refused(leg, written("time,x,hip,slide\n0,q,0,0\n1,q,1,1p\n"), ignore_extra=True)


def test_a_separator_that_is_none(leg, written):
    """Excel's first line `sep=X`, with a character that separates nothing."""
    for mark in ("¹", '"', "\\", "a"):
        refused(leg, written(f"sep={mark}\n" + HEAD + ROWS))
    assert read_motion(leg, written("sep=;\n" + (HEAD + ROWS).replace(",", ";"))).q.shape == (8, 2)


@pytest.mark.parametrize("cutoff", [5e-324, 1e-300, 1e-9, 0.9e-6])
def test_a_cutoff_that_is_too_low(leg, written, cutoff):
    words = f"--smooth {cutoff:g} Hz is so low that the filter can't be computed for 1 samples a second; give a higher one, at least 1e-06 Hz"
    assert refused(leg, written(HEAD + ROWS), smooth=cutoff).endswith(f": {words}")
    assert np.isfinite(read_motion(leg, written(HEAD + ROWS), smooth=1.1e-6).q).all()


# names


def test_names_in_messages_can_be_printed(leg, written):
    for bad in ("\x1b[31mred", "a\u202eb", "a\x9bb", "=HYPERLINK(1)"):
        said = refused(leg, written(f'time,hip,slide,"{bad}"\n0,0,0,0\n'))
        assert "\x1b" not in said and "\u202e" not in said


@pytest.mark.parametrize("name", ["a\0b.csv", "a\udcffb.csv"])
def test_paths_that_no_file_can_have(leg, name):
    assert "can't be read" in refused(leg, name)


def test_blanks_around_a_joint_in_a_motion(tmp_path):
    """A robot whose joint is called ` hip ` takes the column `hip`, as the loader and every reader of columns see it."""
    (tmp_path / "r.urdf").write_text(
        '<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '</link><joint name=" hip " type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
    )
    robot = ksl.load(tmp_path / "r.urdf")
    for column in ("hip", " hip "):
        (tmp_path / "m.csv").write_text(f'time,"{column}"\n' + "".join(f"{k},{k / 10}\n" for k in range(8)))
        assert read_motion(robot, tmp_path / "m.csv").q[2, 0] == 0.2
    np.savez(tmp_path / "m.npz", **{"time": np.arange(8.0), " hip ": np.arange(8) / 10})
    assert read_motion(robot, tmp_path / "m.npz").q[2, 0] == 0.2


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_map_that_was_cut_inside_its_last_number(leg, written, tmp_path, end):
    """0.017 may have been 0.0174533."""
    path, motion = tmp_path / "map.csv", written(HEAD + ROWS)
    whole = f"from,to,scale{end}slide,slide,1{end}hip,hip,0.017".encode()
    path.write_bytes(whole)
    m = read_motion(leg, motion, map=path)
    assert any("last line (3) of" in doubt and "map.csv" in doubt and "cut" in doubt for doubt in m.doubts), m.doubts
    path.write_bytes(whole + end.encode())
    assert not read_motion(leg, motion, map=path).doubts


@pytest.mark.parametrize("number", ["1_0", "\u0661", "\uff11", "nan", "inf", "1e999", "0x1", "1 0", "--1", "."])
def test_what_is_no_number_in_a_map(tmp_path, number):
    for key in ("scale", "offset", "sign"):
        (tmp_path / "map.csv").write_text(f"from,to,{key}\na,hip,{number}\n", encoding="utf-8")
        with pytest.raises(MotionError, match=f"map.csv:2: .*{key} (is )?.*expected a number"):
            read_map(tmp_path / "map.csv")


@pytest.mark.parametrize("number", ["1", "+1", "1.", "1.0e0", "10E-1", ".1e1"])
def test_numbers_in_a_map(tmp_path, number):
    (tmp_path / "map.csv").write_text(f"from,to,sign,scale,offset\na,hip,{number},{number},{number}\n", encoding="utf-8")
    rule = read_map(tmp_path / "map.csv").rules["a"]
    assert (rule.sign, rule.scale, rule.offset) == (1, 1, 1)


def test_a_time_zone_that_is_no_text(tmp_path):
    """Found by a fuzzer: pyarrow reads the zone's bytes only when it is asked for it."""
    import base64

    import pyarrow as pa
    import pyarrow.parquet as pq

    path = tmp_path / "m.parquet"
    table = pa.table({"time": pa.array(range(9), pa.timestamp("ms", tz="Mars/Here")), "shoulder": np.zeros(9)})
    pq.write_table(table, path)
    schema = pq.read_metadata(path).metadata[b"ARROW:schema"]
    broken = base64.b64encode(base64.b64decode(schema).replace(b"Mars/Here", b"Ma\x97s/Here"))
    content = path.read_bytes()
    assert len(broken) == len(schema) and schema in content
    path.write_bytes(content.replace(schema, broken))
    with pytest.raises(ksl.MotionError, match="the time zone of column 'time' is no text; write times in seconds"):
        ksl.read_motion(ksl.load_string(ONE_JOINT), path)


ONE_JOINT = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>"""
