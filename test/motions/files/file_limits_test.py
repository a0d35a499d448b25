"""Files of motions at the limits of their size, and one beyond: columns, names, numbers and bytes, in every format."""

import gzip
import io
import re
import zipfile

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io

from ksl.base import limits
from ksl.base.errors import MotionError
from ksl.motions.files.csv_form import doubts_about_end
from ksl.motions.reading import read_motion


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (b"a\n1\n2", 3), (b"a\n1\n2\n", None), (b"a,b", None), (b"a\n1\n  ", None), (b"a\n1\n # end", None), (b"a\n1\n%", None), (b"a\n1\n// x", None), (b"a\r1\r2", 3), (b"a\r\n1\r\n2\r\n3", 4),
        (b"a\r\n1\r\n", None), (b"a\r1", 2),
    ],
)  # fmt: skip
def test_a_last_line_without_an_end(data, line):
    assert [f"the last line ({line}) of f has no line end" in said for said in doubts_about_end("f", data)] == [True] * bool(line)


K = np.arange(9.0)
COLUMNS = {"time": K, "hip": 0.1 * K, "slide": 0.01 * K**2}
"""Three columns with nine rows, 27 numbers, and `slide` as the longest name."""


def as_csv() -> bytes:
    return "\n".join([",".join(COLUMNS), *(",".join(map(repr, row)) for row in np.column_stack(list(COLUMNS.values())).tolist())]).encode() + b"\n"


def as_npz() -> bytes:
    np.savez(file := io.BytesIO(), **COLUMNS)
    return file.getvalue()


def as_parquet() -> bytes:
    pq.write_table(pa.table(COLUMNS), file := io.BytesIO())
    return file.getvalue()


def as_workbook(empty: int = 0) -> bytes:
    book = pytest.importorskip("openpyxl").Workbook()
    for row in [*[["Test 7"], *[[]] * empty] * bool(empty), list(COLUMNS), *np.column_stack(list(COLUMNS.values())).tolist()]:
        book.active.append(row)
    book.save(file := io.BytesIO())
    return file.getvalue()


def as_mat(packed: bool) -> bytes:
    scipy.io.savemat(file := io.BytesIO(), COLUMNS, do_compression=packed)
    return file.getvalue()


def longest(lines: bytes) -> int:
    return max(map(len, lines.splitlines(keepends=True)))


def unpacked(archive: bytes) -> int:
    with zipfile.ZipFile(io.BytesIO(archive)) as inside:
        return sum(each.file_size for each in inside.infolist())


FORMS = {
    "m.csv": as_csv, "cut.csv": lambda: as_csv().rstrip() + b"00000000000000000000000000", "m.csv.gz": lambda: gzip.compress(as_csv()), "m.npz": as_npz, "m.parquet": as_parquet, "m.xlsx": as_workbook,
    "empty.xlsx": lambda: as_workbook(3), "m.mat": lambda: as_mat(False), "packed.mat": lambda: as_mat(True),
}  # fmt: skip
LAST = [
    *((form, "COLUMNS", lambda _: 3) for form in ("m.csv", "m.npz", "m.parquet", "m.xlsx", "m.mat")),
    *((form, "NAME_LENGTH", lambda _: 5) for form in ("m.csv", "m.npz", "m.parquet", "m.xlsx")),
    *((form, "MOTION_NUMBERS", lambda _: 27) for form in FORMS if form != "cut.csv"), ("empty.xlsx", "EMPTY_ROWS", lambda _: 2 * 3),
    *((form, "MOTION_BYTES", len) for form in ("m.csv", "m.mat")),
    ("m.csv.gz", "MOTION_BYTES", lambda _: len(as_csv())), ("m.csv", "LINE_BYTES", longest), ("cut.csv", "LINE_BYTES", longest), ("m.xlsx", "WORKBOOK_BYTES", unpacked), ("m.xlsx", "WORKBOOK_CELLS", lambda _: 30),
    ("packed.mat", "MOTION_BYTES", lambda _: len(as_mat(False)) - 128),
]  # fmt: skip
"""Form, limit, and the least value of it with which this file is read: by its rows, columns, names and bytes."""


@pytest.mark.parametrize(("form", "limit", "least"), LAST, ids=lambda x: x if isinstance(x, str) else "")
def test_a_file_at_a_limit_is_read_and_one_beyond_it_is_refused(leg, written, monkeypatch, form, limit, least):
    path = written(FORMS[form](), form)
    most = least(path.read_bytes())
    monkeypatch.setattr(limits, limit, most)
    motion = read_motion(leg, path)
    assert motion.time == pytest.approx(K) and motion.q == pytest.approx(np.column_stack([COLUMNS["hip"], COLUMNS["slide"]]))
    monkeypatch.setattr(limits, limit, most - 1)
    with pytest.raises(MotionError, match=re.escape(path.name)):
        read_motion(leg, path)


@pytest.mark.parametrize(("form", "limit", "most", "longest"), [("m.npz", "LINE_BYTES", 2 * 4 * 20, 20), ("m.mat", "COLUMNS", 3, 3 * 64 // 2)])
def test_names_of_joints_have_limits(leg, written, monkeypatch, form, limit, most, longest):
    """The bytes of an array, four a character; in MATLAB's, 64 characters for each column that there may be."""
    q = np.column_stack([COLUMNS["hip"], COLUMNS["slide"]])
    monkeypatch.setattr(limits, limit, most)
    for length in (longest, longest + 1):
        file, names = io.BytesIO(), np.array([name.ljust(length) for name in ("hip", "slide")], f"<U{length}")
        if form == "m.npz":
            np.savez(file, time=K, q=q, joints=np.char.strip(names).astype(names.dtype))
        else:
            scipy.io.savemat(file, {"time": K, "q": q, "joints": names})
        path = written(file.getvalue(), form)
        if length == longest:
            assert read_motion(leg, path).q == pytest.approx(q)
            continue
        with pytest.raises(MotionError, match="names"):
            read_motion(leg, path)


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_arrays_of_each_version_of_numpys_form(leg, written, version):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, x in COLUMNS.items():
            with archive.open(f"{name}.npy", "w") as one:
                np.lib.format.write_array(one, x, version)
    assert read_motion(leg, written(file.getvalue(), "m.npz")).q[:, 1] == pytest.approx(COLUMNS["slide"])


@pytest.mark.parametrize("kind", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"])
def test_numbers_of_matlab_of_every_type(leg, written, kind):
    scipy.io.savemat(file := io.BytesIO(), {"time": K.astype(kind), "hip": (2 * K).astype(kind), "slide": K[::-1].astype(kind)})
    motion = read_motion(leg, written(file.getvalue(), "m.mat"))
    assert motion.time == pytest.approx(K) and motion.q == pytest.approx(np.column_stack([2 * K, K[::-1]]))
