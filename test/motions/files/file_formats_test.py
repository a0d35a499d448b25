"""Parquet and NPZ files, told by their content."""

import io

import numpy as np
import pandas
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import ksl
from ksl.base import limits
from ksl.motions.files.parquet_table import ParquetTable
from ksl.motions.reading import read_motion


def parquet(table: pa.Table) -> bytes:
    out = io.BytesIO()
    pq.write_table(table, out)
    return out.getvalue()


def npz(**arrays) -> bytes:
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def columns(rows: np.ndarray) -> dict[str, np.ndarray]:
    return {"time": rows[:, 0], "hip": rows[:, 1], "slide": rows[:, 2]}


def frame(rows: np.ndarray, **options) -> bytes:
    out = io.BytesIO()
    pandas.DataFrame(columns(rows)).to_parquet(out, **options)
    return out.getvalue()


def indexed_by_dates(rows: np.ndarray) -> bytes:
    out = io.BytesIO()
    times = pandas.to_datetime(1_760_000_000_000_000_000 + (rows[:, 0] * 1e9).round().astype(np.int64))
    pandas.DataFrame({"hip": rows[:, 1], "slide": rows[:, 2]}, index=pandas.Index(times, name="time")).to_parquet(out)
    return out.getvalue()


SAME = {
    "pyarrow": (lambda r: parquet(pa.table(columns(r))), "Parquet", None),
    "pandas": (lambda r: frame(r), "Parquet", None),
    "pandas with an index": (lambda r: frame(r, index=True), "Parquet", None),
    "pandas, indexed by dates": (indexed_by_dates, "Parquet", "times in column 'time' are dates; time 0 is 2025-10-09 08:53:20"),
    "durations": (lambda r: parquet(pa.table(columns(r) | {"time": pa.array((r[:, 0] * 1e6).round().astype("timedelta64[us]"))})), "Parquet", None),
    "dates as text": (
        lambda r: parquet(pa.table(columns(r) | {"time": [f"2026-03-01 12:00:0{t:.1f}" for t in r[:, 0]]})),
        "Parquet",
        "time 0 is 2026-03-01 12:00:00.0",
    ),
    "integers and single precision": (lambda r: parquet(pa.table(columns(r) | {"hip": r[:, 1].astype(np.float32)})), "Parquet", None),
    "units in the schema": (
        lambda r: parquet(
            pa.table(
                list(columns(r * [1, 180 / np.pi, 1]).values()),
                pa.schema([("time", pa.float64()), pa.field("hip", pa.float64(), metadata={"unit": "deg"}), ("slide", pa.float64())]),
            )
        ),
        "Parquet",
        "converted from deg to rad: hip",
    ),
    "arrays by name": (lambda r: npz(**columns(r)), "NPZ", None),
    "time and q": (lambda r: npz(time=r[:, 0], q=r[:, 1:]), "NPZ", "columns of q are taken in the order of the robot's joints: hip, slide"),
    "names as bytes, and once more": (
        lambda r: npz(time=r[:, 0], q=r[:, :0:-1], joint_names=np.array([b"slide", b"hip"]), names=["slide", "hip"]),
        "NPZ",
        None,
    ),
    "t, and names": (lambda r: npz(t=r[:, 0], q=r[:, :0:-1], joint_names=["slide", "hip"]), "NPZ", "column 't' is taken as the time, in s"),
    "columns of MATLAB": (lambda r: npz(time=r[:, :1], hip=r[:, 1:2], slide=r[:, 2:].T), "NPZ", None),
}


@pytest.mark.parametrize("form", SAME)
@pytest.mark.parametrize("name", ["motion.csv", "motion"])
def test_forms_that_hold_the_same_numbers(leg, written, rows, form, name):
    content, how, note = SAME[form]
    m = read_motion(leg, written(content(rows), name))
    assert np.allclose(m.time, rows[:, 0], rtol=0, atol=1e-9) and np.allclose(m.q, rows[:, 1:], rtol=1e-6, atol=1e-9)
    assert m.source.format == how
    assert note is None or any(note in line for line in m.source.notes), m.source.notes


def test_rates_of_npz(leg, written, rows):
    v, a = np.cos(rows[:, 1:]), np.sin(rows[:, 1:])
    m = read_motion(leg, written(npz(time=rows[:, 0], q=rows[:, 1:], v=v, a=a)))
    assert np.array_equal(m.v, v) and np.array_equal(m.a, a) and m.differentiated == []


def test_states_of_a_floating_base(flying, written):
    t = np.linspace(0, 1, 9)
    q = np.column_stack([t, t**2, -t, 0 * t, 0 * t, np.sin(t / 2), np.cos(t / 2)])
    m = read_motion(flying, written(npz(time=t, q=q, v=np.column_stack([0 * t] * 5 + [1 + 0 * t]))))
    assert np.allclose(m.q, q, atol=1e-15) and np.array_equal(m.v[:, 5], 1 + 0 * t)


def results() -> bytes:
    schema = pa.schema([("time", pa.float64()), ("joint", pa.string()), ("fx", pa.float64())], metadata={"ksl": "{}"})
    return parquet(pa.table([[0.0], ["hip"], [1.0]], schema))


ROW = {"time": [0.0], "hip": [0.0], "slide": [0.0]}
REFUSED = {
    "Parquet, truncated": (parquet(pa.table(ROW))[:-9], ": is a Parquet file, but truncated or damaged; copy or write it again"),
    "results": (results(), ": holds the wrenches that `ksl loads` has computed, not a motion"),
    "no rows, times as text": (
        parquet(pa.table({"time": pa.array([], pa.string()), "hip": pa.array([], pa.float64()), "slide": pa.array([], pa.float64())})),
        ": 0 samples, but differentiating hip, slide needs at least 6",
    ),
    "text": (parquet(pa.table(ROW | {"mode": ["auto"]})), ": unknown column 'mode', which holds text ('string')"),
    "a joint as text": (parquet(pa.table(ROW | {"hip": ["0"]})), ": column 'hip' holds string; expected numbers"),
    "infinite": (
        parquet(pa.table({n: x * 3 for n, x in ROW.items()} | {"hip": [0.0, np.inf, 1.0], "time": [0.0, 1.0, 2.0]})),
        ": sample 2: column 'hip' is infinite",
    ),
    "a date is missing": (parquet(pa.table(ROW | {"time": pa.array([None], pa.timestamp("ns"))})), ": 1 time in column 'time' missing"),
    "NPZ, truncated": (npz(**ROW)[:-40], ": is an NPZ file or another zip archive, but truncated or damaged"),
    "objects": (npz(time=[0.0], q=np.array([None], dtype=object)), ": array 'q' holds Python objects; save numbers only"),
    "sizes": (npz(time=np.zeros(3), q=np.zeros((3, 5))), ": array 'q' has 5 columns, but leg has 2: hip, slide"),
    "a joint that is listed twice": (
        npz(time=np.zeros(3), q=np.zeros((3, 2)), names=["hip", "hip"]),
        ": array 'names' lists 'hip' more than once; give each joint once",
    ),
    "two lists of joints": (
        npz(time=np.zeros(3), q=np.zeros((3, 2)), joints=["hip", "slide"], names=["slide", "hip"]),
        ": arrays 'joints' and 'names' list different joints; remove one",
    ),
    "sizes of listed joints": (npz(time=np.zeros(3), q=np.zeros((3, 5)), names=["hip"]), ": array 'q' has 5 columns, but the file lists 1 joint"),
    "samples": (npz(time=np.zeros(3), q=np.zeros((4, 2))), ": array 'q' has 4 samples, but 'time' has 3; give as many of each"),
    "cube": (npz(time=np.zeros(3), hip=np.zeros((3, 2, 2)), slide=np.zeros(3)), ": array 'hip' has the shape (3, 2, 2); expected one number for each sample"),
    "a cube of all": (npz(time=np.zeros(3), q=np.zeros((3, 2, 2))), ": unknown column 'q', which has the shape (3, 2, 2)"),
    "two columns of a joint": (
        npz(time=np.zeros(4), hip=np.zeros((2, 2)), slide=np.zeros(4)),
        ": array 'hip' has the shape (2, 2); expected one number for each sample",
    ),
    "no time": (npz(q=np.zeros((3, 2))), ": no column `time`; found hip, slide"),
    "twice": (npz(time=np.zeros(3), q=np.zeros((3, 2)), hip=np.zeros(3)), ": column 'hip' is given twice, by 'q' and by an array of its own"),
    "a single array": (b"\x93NUMPY\x01\x00", ": is a single NumPy array; save time and positions together"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_files_that_are_refused(leg, written, refusal, what):
    content, sentence = REFUSED[what]
    found = refusal(leg, written(content))
    assert found.startswith(sentence), found


@pytest.mark.parametrize("form", ["pyarrow", "arrays by name", "CSV", "CSV of a spreadsheet"])
def test_damaged_files_are_refused_in_one_sentence_or_read(leg, written, rows, form):
    """Bytes that are changed, inserted or removed anywhere: never another error than MotionError."""
    text = "time,hip,slide\n" + "".join(",".join(f"{x:.6g}" for x in row) + "\n" for row in rows)
    seeds = {"CSV": text.encode(), "CSV of a spreadsheet": text.replace(",", ";").replace(".", ",").replace("\n", "\r\n").encode()}
    content = seeds[form] if form in seeds else SAME[form][0](rows)
    rng = np.random.default_rng(7)
    refused = 0
    for _ in range(60):
        at, size, kind = rng.integers(len(content)), rng.integers(1, 12), rng.integers(3)
        junk = rng.bytes(size) if rng.integers(2) else bytes(rng.choice(list(b',;."#\n\r0 n-'), size).tolist())
        damaged = content[:at] + (b"" if kind == 0 else junk) + content[at + (0 if kind == 1 else size) :]
        try:
            read_motion(leg, written(damaged), ignore_extra=True)
        except ksl.MotionError as e:
            refused += 1
            assert "\n" not in str(e) and len(str(e)) < 800
    assert refused > 10


LISTS = {
    "time": pa.array(np.arange(9) * 1_000_000_000, pa.timestamp("ns")),
    "state": [[k, 2.0 * k] for k in range(9)],
    "load": np.arange(9) * 0.1,
    "other": [[0.0] * 5] * 9,
}
DATE = {"time": ["2026-03-01 12:00:00.0"] * 300}


@pytest.mark.parametrize(
    ("table", "names", "limit", "least"),
    [
        (LISTS, ["time", "state[1]", "load"], "MOTION_NUMBERS", lambda _: 9 * 4), (LISTS, ["time", "state[1]", "load"], "MOTION_BYTES", lambda sizes: sum(sizes[:3])),
        (DATE, ["time"], "MOTION_BYTES", lambda _: pa.array(DATE["time"]).dictionary_encode().cast(pa.string()).nbytes),
    ],
)  # fmt: skip
def test_what_counts_of_a_parquet_file(monkeypatch, table, names, limit, least):
    """The columns that are wanted, lists with all their elements; bytes as pyarrow says them, and of texts without those that were stored once."""
    data = parquet(pa.table(table))
    group = pq.ParquetFile(io.BytesIO(data)).metadata.row_group(0)
    most = least([group.column(i).total_uncompressed_size for i in range(group.num_columns)])
    monkeypatch.setattr(limits, limit, most)
    found = ParquetTable("f", data).read(names, "time")
    assert found["time"] == pytest.approx(np.arange(9) if table is LISTS else np.zeros(300)) and list(found) == names
    assert table is DATE or (found["state[1]"].tolist() == (2.0 * np.arange(9)).tolist() and found["load"].tolist() == LISTS["load"].tolist())
    monkeypatch.setattr(limits, limit, most - 1)
    with pytest.raises(ksl.MotionError):
        ParquetTable("f", data).read(names, "time")


@pytest.mark.parametrize("more", [0, 1])
def test_dates_that_64_bits_do_not_hold_the_difference_of(more):
    dates = ParquetTable("f", parquet(pa.table({"time": pa.array([-(2**62), 2**62 - 1 + more], pa.timestamp("ns"))})))
    if more:
        with pytest.raises(ksl.MotionError, match="column 'time' holds dates more than 292 years apart"):
            dates.read(["time"], "time")
        return
    assert dates.read(["time"], "time")["time"] == pytest.approx([0, (2**63 - 1) * 1e-9], rel=1e-15)


def test_spreadsheets_are_refused(leg, tmp_path, refusal):
    import zipfile

    path = tmp_path / "motion.csv"
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("xl/workbook.xml", "<workbook/>")
    assert refusal(leg, path).startswith(": is an Excel workbook, but truncated or damaged")
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
    assert refusal(leg, path).startswith(": is a spreadsheet (binary Excel or OpenDocument); save it as .xlsx, or the sheet as CSV")
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("readme.txt", "")
    assert refusal(leg, path).startswith(": is a zip archive without NumPy arrays")


def test_a_topic_is_for_bags(leg, written, refusal):
    assert refusal(leg, written(npz(**ROW)), topic="/joint_states").startswith(
        ": --topic (topic=) chooses among the topics of a bag or the sheets of a workbook, but this is NPZ"
    )


@pytest.mark.parametrize("piped", [False, True], ids=["a file", "bytes of a pipe"])
def test_arrow_gets_no_file_of_python_s(tmp_path, monkeypatch, piped):
    """Threads of Arrow that still hold one when the interpreter ends would end the process by an abort."""
    given, real = [], pq.ParquetFile
    monkeypatch.setattr(pq, "ParquetFile", lambda source, *more, **options: (given.append(source), real(source, *more, **options))[1])
    path = tmp_path / "motion.parquet"
    path.write_bytes(parquet(pa.table(ROW)))
    if piped:
        from ksl.motions.files.recognise import _opened, Content

        _opened(Content("pipe", None, path.read_bytes()), path.read_bytes()[:512], None, False)
    else:
        from ksl.motions.files.recognise import open_table

        open_table(path)
    assert [type(source) for source in given] == [pa.BufferReader if piped else pa.OSFile]
