"""CSV files as spreadsheets and programs write them, each with the same numbers."""

import bz2
import gzip
import io
import lzma
import os

import numpy as np
import pytest

import ksl
from growth import assert_linear, work
from ksl.motions.files.csv_form import form_of
from ksl.motions.reading import read_external, read_motion


def table(rows: np.ndarray, separator: str = ",", decimal: str = ".", end: str = "\n") -> str:
    return "".join(separator.join(f"{x:.6g}".replace(".", decimal) for x in row) + end for row in rows)


HEAD = "time,hip,slide\n"
SAME = {
    "German Excel": (
        lambda r: "\ufeffZeit;hip;slide\r\n" + table(r, ";", ",", "\r\n"),
        "CSV (semicolons, decimal commas)",
        "column 'Zeit' is taken as the time, in s",
    ),
    "first number with a comma far down": (
        lambda r: "time;hip;slide\n" + table(np.column_stack([np.arange(30) - 30, np.zeros((30, 2))]), ";") + table(r, ";", ","),
        "CSV (semicolons, decimal commas)",
        None,
    ),
    "Excel's first line": (lambda r: "sep=;\r\ntime;hip;slide\r\n" + table(r, ";", ",", "\r\n"), "CSV (semicolons, decimal commas)", None),
    "Excel's Unicode text": (lambda r: ("Time\thip\tslide\r\n" + table(r, "\t", end="\r\n")).encode("utf-16"), "CSV (tabs)", "the file is in UTF-16"),
    "tabs": (lambda r: "t\thip\tslide\n" + table(r, "\t"), "CSV (tabs)", "column 't' is taken as the time, in s"),
    "bars": (lambda r: "time|hip|slide\n" + table(r, "|"), "CSV (vertical bars)", None),
    "old Mac": (lambda r: "time,hip,slide\r" + table(r, end="\r"), "CSV", None),
    "comments": (lambda r: "# made by x\n%\ntimestamp,hip,slide\n# start\n" + table(r).replace("\n", "\n  # note\n", 1), "CSV", "column 'timestamp' is taken"),
    "a comment with a unit": (
        lambda r: "# positions [mm]\n" + HEAD + table(r),
        "CSV",
        "the comment in line 1 speaks of mm, and columns have no units: they are taken in rad and m",
    ),
    "a comment with a unit beside units": (lambda r: "# positions [mm]\ntime (s),hip,slide (m)\n" + table(r), "CSV", None),
    "remarks below names in a comment": (
        lambda r: "# time hip slide\n# run 3 hot\n# recorded by Ada, on a Friday\n" + table(r),
        "CSV",
        "names of the columns are taken from the comment in line 1",
    ),
    "numpy.savetxt": (lambda r: saved(r, header="time hip slide"), "CSV (blanks)", "names of the columns are taken from the comment in line 1"),
    "numpy.savetxt with commas": (
        lambda r: saved(r, delimiter=",", header="time,hip,slide"),
        "CSV",
        "names of the columns are taken from the comment in line 1",
    ),
    "row of units": (lambda r: HEAD + "s,rad,m\n" + table(r), "CSV", None),
    "row of units in brackets": (lambda r: HEAD + "[s],[rad],[m]\n" + table(r), "CSV", None),
    "quoted": (lambda r: '"time","hip","slide"\n' + quoted(r), "CSV", None),
    "quoted with decimal commas": (lambda r: HEAD + quoted(r, ","), "CSV (decimal commas)", None),
    "pandas": (
        lambda r: ",time,hip,slide\n" + "".join(f"{k},{line}\n" for k, line in enumerate(table(r).split())),
        "CSV",
        "the first column, which has no name, numbers the rows",
    ),
    "pandas, what it has read": (
        lambda r: "Unnamed: 0,time,hip,slide,Unnamed: 4\n" + "".join(f"{k},{line},\n" for k, line in enumerate(table(r).split())),
        "CSV",
        "the first column, which has no name, numbers the rows",
    ),
    "blank lines": (lambda r: HEAD + "\n" + table(r).replace("\n", "\n\n") + "  \n\t", "CSV", None),
    "blank lines of Windows": (lambda r: "time;hip;slide\r\n" + table(r, ";", ",").replace("\n", "\r\n \t\r\n\r\n"), "CSV (semicolons, decimal commas)", None),
    "blank lines of an old Mac": (lambda r: "time hip slide\r" + table(r, " ", end="\r\r"), "CSV (blanks)", None),
    "names in quotation marks": (
        lambda r: chr(34) + "time [s]" + chr(34) + "  " + chr(34) + "hip [rad]" + chr(34) + " slide\n" + table(r, " "),
        "CSV (blanks)",
        None,
    ),
    "words for no number": (
        lambda r: (
            "time,hip,slide,hip.v\n" + "".join(f"{line},{x}\n" for line, x in zip(table(r).split(), 3 * ["None", "none", "n/a", "<NA>"] + ["0"] * len(r)))
        ),
        "CSV",
        "velocities of hip are not used",
    ),
    "MATLAB's writetimetable": (
        lambda r: "Time,hip,slide\n" + "".join(f"{t:g} sec,{q:g},{s:g}\n" for t, q, s in r),
        "CSV",
        "times in column 'Time' are in sec",
    ),
    "clock times": (lambda r: "Time,hip,slide\n" + "".join(f"0:00:0{t:.1f},{q:g},{s:g}\n" for t, q, s in r), "CSV", "are clock times"),
    "dates": (lambda r: "Time,hip,slide\n" + "".join(f"2026-03-01T12:00:0{t:.1f}Z,{q:g},{s:g}\n" for t, q, s in r), "CSV", "time 0 is 2026-03-01T12:00:00.0Z"),
    "nanoseconds since 1970": (
        lambda r: HEAD + "".join(f"{1_760_000_000_000_000_000 + round(t * 1e9)},{q:g},{s:g}\n" for t, q, s in r),
        "CSV",
        "times are ns since 1970; time 0 is 2025-10-09T08:53:20.000 UTC",
    ),
    "milliseconds": (lambda r: "time [ms],hip [deg],slide (mm)\n" + table(r * [1000, 180 / np.pi, 1000]), "CSV", "times were converted from ms to s"),
    "row of other units": (lambda r: HEAD + "ms;°;mm\n".replace(";", ",") + table(r * [1000, 180 / np.pi, 1000]), "CSV", "converted from ° to rad: hip"),
    "gzip": (lambda r: gzip.compress((HEAD + table(r)).encode()), "CSV (gzip)", None),
    "bzip2": (lambda r: bz2.compress((HEAD + table(r)).encode()), "CSV (bzip2)", None),
    "xz": (lambda r: lzma.compress((HEAD + table(r)).encode()), "CSV (xz)", None),
}


def saved(rows: np.ndarray, **options) -> str:
    out = io.StringIO()
    np.savetxt(out, rows, "%.6g", **options)
    return out.getvalue()


def quoted(rows: np.ndarray, decimal: str = ".") -> str:
    return "".join(",".join(f'"{x:.6g}"'.replace(".", decimal) for x in row) + "\n" for row in rows)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("time,hip,hip2\ns,deg,\n0,1,2\n1,2,3\n", "column 'hip' is in deg, and 'hip2' has no unit; give each column its own"),
        ("time,hip [deg],hip2\n0,1,2\n1,2,3\n", "column 'hip [deg]' is in deg, and 'hip2' has no unit"),
        ((HEAD + "0,1,2\n").encode("utf-16-le"), "is not text; it seems to be in UTF-16 without a mark: save it in UTF-8"),
        ((HEAD + "0,1,2\n").encode("utf-32"), "is in UTF-32; save it in UTF-8"),
    ],
    ids=["units of some columns", "names with units of some columns", "UTF-16 without a mark", "UTF-32"],
)
def test_what_would_be_a_guess_is_refused(written, refusal, content, said):
    b = ksl.Builder("two hips").add_link("base").add_link("thigh", mass=1.0).add_link("shin", mass=1.0, center_of_mass=(1, 0, 0))
    m = b.add_joint("hip", "continuous", "base", "thigh", axis=(0, 1, 0)).add_joint("hip2", "continuous", "thigh", "shin", axis=(0, 1, 0)).build()
    assert said in refusal(m, written(content))


@pytest.mark.parametrize("form", SAME)
def test_forms_that_hold_the_same_numbers(leg, written, rows, form):
    content, how, note = SAME[form]
    m = read_motion(leg, written(content(rows), "motion.dat"))
    last = slice(-len(rows), None)
    assert np.allclose(m.time[last] - m.time[last][0], rows[:, 0] - rows[0, 0], rtol=0, atol=1e-9)
    assert np.allclose(m.q[last], rows[:, 1:], rtol=1e-5, atol=1e-6)
    assert m.source.format == how
    assert note is None or any(note in line for line in m.source.notes), m.source.notes
    assert note is not None or not any("speaks of" in line for line in m.source.notes)


@pytest.mark.parametrize(
    ("texts", "seconds"),
    [
        ("0 min|0.5 min|2 min", (0, 30, 120)), ("0.5 hr|1 hr|1.25 hr", (1800, 3600, 4500)), ("1 ms|2.5 ms|4 ms", (1e-3, 2.5e-3, 4e-3)), ("1s|2s|4s", (1, 2, 4)), ("1:00:00.5|1:01:02|2:00:00", (3600.5, 3662, 7200)),
        ("1:02|1:03|10:00", (3720, 3780, 36000)), ("23:59:59.5|0:00:00|12:00:01", (86399.5, 86400, 129601)), ("23:58|23:59|0:01", (86280, 86340, 86460)), ("-0:00:01.5|-0:00:00.5|0:00:1.", (-1.5, -0.5, 1)), ("2026-02-28 23:59:59.5|2026-03-01 00:00:00|2026-03-01 00:00:01", (0, 0.5, 1.5)), ("2026-03-01T00:00|2026-03-01T00:01|2026-03-01T01:00", (0, 60, 3600)),
        ("2026-03-01T00:00:00+01:00|2026-03-01T00:00:01+01:00|2026-03-01T00:00:00Z", (0, 1, 3600)),
    ],
)  # fmt: skip
def test_times_that_are_text(leg, written, texts, seconds):
    rows = [f"{text},{k},0,{k},0,0,0" for k, text in enumerate(texts.split("|"))]
    motion = read_motion(leg, written("\n".join(["Time,hip,slide,hip.v,slide.v,hip.a,slide.a", *rows]) + "\n"))
    assert motion.time == pytest.approx(seconds, abs=1e-9)


def test_decimal_commas_are_exact(leg, written, rows):
    plain, commas = (read_motion(leg, written("time;hip;slide\n" + table(rows, ";", d))) for d in ".,")
    assert np.array_equal(plain.q, commas.q) and np.array_equal(plain.time, commas.time)
    assert np.array_equal(plain.q, rows[:, 1:])


@pytest.mark.parametrize(("separator", "decimal"), [(";", ","), ("\t", ","), ("|", ","), (",", ".")])
def test_what_splits_each_line_alike_separates(written, separator, decimal):
    """Though commas in a name and in numbers would split the line of names into more."""
    name = "a, b, c" if separator != "," else "a; b| c"
    leg = ksl.Builder("leg").add_link("a").add_link("b", 1.0, (0, 0, 0), np.eye(3)).add_joint(name, "continuous", "a", "b", axis=(0, 0, 1)).build()
    lines = [["time", name], *([f"{k}", f"0{decimal}{k}5" if k % 2 else "1"] for k in range(9))]
    m = read_motion(leg, written("".join(f"{separator.join(f'{chr(34)}{x}{chr(34)}' if separator == ',' else x for x in line)}\n" for line in lines)))
    assert m.q[:, 0] == pytest.approx([k / 10 + 0.05 if k % 2 else 1 for k in range(9)]) and m.time == pytest.approx(np.arange(9))


def test_a_spreadsheet_in_an_old_encoding(leg, written, rows):
    lines = ["Zeit;hip;slide;Kraft Hüfte", *(line + ";1,5" for line in table(rows, ";", ",").split())]
    m = read_motion(leg, written("\r\n".join(lines).encode("cp1252")), ignore_extra=True)
    assert np.array_equal(m.q, rows[:, 1:])
    assert m.source.notes == [
        "the file is not in UTF-8, and was read as Windows-1252",
        "column 'Zeit' is taken as the time, in s",
        "columns that are not used: 'Kraft Hüfte'",
    ]


REFUSED = {
    "text": (
        HEAD.strip() + ",mode\n0,0,0,auto\n",
        ":1: unknown column 'mode', which holds text ('auto'); the moving joints of leg are hip, slide (--ignore-extra leaves",
    ),
    "other case": ("time,Hip,slide\n0,0,0\n", ":1: unknown column 'Hip'; did you mean 'hip'?"),
    "other robot": (
        "time,j1,j2\n0,0,0\n",
        ":1: unknown column 'j1'; the moving joints of leg are hip, slide. No column has the name of a joint; say which is which by a map",
    ),
    "two times": ("Time,t,hip,slide\n0,0,0,0\n", ":1: columns 'Time' and 't' could all be the time; rename one to `time`"),
    "wrong unit": (HEAD + "s,mm,mm\n0,0,0\n", ":1: column 'hip' is in 'mm', but expected rad"),
    "unknown unit": (HEAD + "[s],[degr],[m]\n0,0,0\n", ":1: column 'hip' is in 'degr', which is no unit that KSL knows; did you mean 'deg'"),
    "what NumPy shows": (
        "time,hip,slide\n0,np.float64(1.5),0\n",
        ":2: column 'hip' holds 'np.float64(1.5)'; expected a number with a decimal point; that is how NumPy shows a number: write float(x)",
    ),
    "thousands": ("time;hip;slide\n0,5;1.000,5;0\n", ":2: column 'hip' holds '1.000,5'; expected a number with a decimal comma, as other values have"),
    "fault after comments": ("# a\n" + HEAD + "# b\n0,0,0\n# c\n1,x,0\n", ":6: column 'hip' holds 'x'"),
    "fault after blank lines": ("\n" + HEAD + "\n0,0,0\n \n1,x,0\n", ":6: column 'hip' holds 'x'"),
    "infinite after comments": ("# a\n" + HEAD + "# b\n0,0,0\n# c\n1,inf,0\n", ":6: column 'hip' is infinite"),
    "lines above the names": (
        "Bench 3;B\nDate;3.11.2026\nRate [Hz];125\n\nTime;hip;slide\n0;0;0\n",
        ":1: the names of columns seem to be in line 5; remove the lines above it, or begin them with #",
    ),
    "a first column without a name": (",time,hip,slide\n5,0,0,0\n6,1,0,0\n7,2,0,0\n", ":2: '5' in column 1, which has no name; name it in line 1"),
    "a last column that counts from 0": ("time,hip,slide,\n0,0,0,0\n1,0,0,1\n2,0,0,2\n", ":2: '0' in column 4, which has no name; name it in line 1"),
    "names above a thousand comments": ("# time hip slide\n" + "# x\n" * 1000 + "0 0 0\n1 0 0\n", ":1002: no names of columns, but numbers"),
    "a short row between semicolons": ("time;hip;slide\n0;0;0\n1;0\n", ":3: 2 values in a table of 3 columns; separate values by semicolons"),
    "numbers alone": ("0,0,0\n1,0,0\n", ":1: no names of columns, but numbers"),
    "degrees": (HEAD + "".join(f"{k},{k * 600},0\n" for k in range(8)), ":4: joint hip is at 1200 rad, where its limit is 9 rad; did you mean --degrees"),
    "open quotation mark": (HEAD + '0,0,"0\n1,0,0\n', ":2: column 'slide' holds several lines, from '0\\n1,0,0\\n' on; a quotation mark is not closed"),
    "clock that stops": ("Time,hip,slide\n0:00:01,0,0\nnoon,0,0\n", ":3: column 'Time' holds 'noon'; expected a number with a decimal point, a clock time"),
    "minutes of no clock": ("Time,hip,slide\n0:59,0,0\n0:61,0,0\n", ":3: column 'Time' holds '0:61'; expected a number with a decimal point, a clock time"),
    "seconds of no clock": ("Time,hip,slide\n0:00:01,0,0\n0:00:-2,0,0\n", ":3: column 'Time' holds '0:00:-2'"),
    "clock times of two forms": ("Time,hip,slide\n59:59,0,0\n1:00:00,0,0\n", ":2: column 'Time' holds '59:59'"),
    "hours that go back": ("Time,hip,slide\n30:00,0,0\n1:00,0,0\n", ":3: time 3600 after 108000; times must increase"),
    "a time that is missing": ("Time,hip,slide\n0:00:01,0,0\nNA,0,0\n", ":3: column 'Time' holds no time; expected a number"),
    "no first time": ("Time,hip,slide\nNA,0,0\n1,0,0\n", ":2: column 'Time' holds no time; expected a number"),
    "nothing but a missing time": ("\ufefft;hip;slide;\nNA;;;", ": 0 samples, but differentiating hip, slide needs at least 6"),
    "JSON": ('{"time": 0}', ": is JSON; save the motion as CSV, Parquet or NPZ"),
    "robot": ("<?xml version='1.0'?>\n<robot name='r'/>", ": is a robot file, not a motion"),
    "web page": ("<!DOCTYPE html><html>", ": is an XML or HTML file, not a motion"),
    "NUL": (b"time,hip\x00,slide\n", ": line 1 is not text; give a CSV file"),
    "text below a short row": ("time,hip,slide,mode\n0,0,0\n1,0,0,auto\n", ":1: unknown column 'mode', which holds text ('auto')"),
    "a row that is too short for its time": ("hip,slide,time\n0,0\n0,0,1\n", ":2: 2 values in a table of 3 columns; separate values by commas"),
    "an empty first time": (HEAD + ",0,0\n1,0,0\n", ":2: column 'time' is not a number or missing"),
    "decimal commas far down between commas": (HEAD + "0,0,0\n" * 30 + '30,"1,5",0\n', ":32: column 'hip' holds '1,5'; expected a number with a decimal point"),
    "gzip, truncated": (gzip.compress((HEAD + "0,0,0\n").encode())[:-9], ": is compressed by gzip, but truncated or damaged"),
    "HDF5": (b"\x89HDF\r\n\x1a\n", ": is an HDF5 file"),
    "MATLAB": (b"MATLAB 5.0 MAT-file", ": is a MATLAB file, but truncated or damaged"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_files_that_are_refused(leg, written, refusal, what):
    content, sentence = REFUSED[what]
    found = refusal(leg, written(content))
    assert found.startswith(sentence), found


@pytest.mark.parametrize("character", "é€😀")
def test_a_character_is_cut_where_the_encoding_is_told(leg, written, rows, character):
    """By the first 64 KiB: a byte of Windows-1252 there is a note, and behind them it is in a comment that nobody reads."""
    for size in range(len(character.encode())):
        m = read_motion(leg, written("#".ljust((1 << 16) - size) + character + "\n" + HEAD + table(rows)))
        assert np.array_equal(m.q, rows[:, 1:]) and m.source.notes == []
    for size, notes in ((0, []), (2, ["the file is not in UTF-8, and was read as Windows-1252"])):
        assert read_motion(leg, written(b"#".ljust((1 << 16) - size) + b"\xe9\n" + (HEAD + table(rows)).encode())).source.notes == notes


def test_a_file_of_one_column():
    """Nothing separates it, and nothing is said of that."""
    assert form_of("f", b"time\n0\n1\n", "utf-8").words == ""


def test_a_row_of_a_megabyte(written):
    """Which would not fit a block of the parser as it is for rows of few columns."""
    from ksl.motions.files.recognise import open_table

    names, row = ["time", *(f"x{k}" for k in range(20_000))], ["0." + "1" * 110] * 20_001
    found = open_table(written("".join(",".join(line) + "\n" for line in (names, row, row)))).read(["time", "x19999"], "time")
    assert [x.tolist() for x in found.values()] == [[float(row[0])] * 2] * 2


def test_extra_columns_are_left_out_on_request(leg, written, rows):
    lines = table(rows).split()
    path = written("time,mode,hip,temperature,slide\n" + "".join(f"{t},auto,{q},21.5,{s}\n" for t, q, s in (line.split(",") for line in lines)))
    m = read_motion(leg, path, ignore_extra=True)
    assert np.array_equal(m.q, rows[:, 1:]) and m.source.notes == ["columns that are not used: 'mode', 'temperature'"]


def test_standard_input_and_pipes(leg, rows, monkeypatch, tmp_path):
    text = (HEAD + table(rows)).encode()
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(gzip.compress(text))))
    m = read_motion(leg, "-")
    assert np.array_equal(m.q, rows[:, 1:]) and str(m.source).startswith("standard input, CSV (gzip), 10 samples")
    read, write = os.pipe()
    os.write(write, text)
    os.close(write)
    assert np.array_equal(read_motion(leg, f"/dev/fd/{read}").q, rows[:, 1:])
    os.close(read)


def test_external_wrenches_as_spreadsheets_write_them(leg, written, rows):
    path = written("Zeit;c.fx\n" + table(rows[:, :2], ";", ","))
    assert np.array_equal(read_external(leg, path, rows[:, 0])["c"][:, 0], rows[:, 1])


def test_work_is_linear_in_the_number_of_columns(leg, written, refusal, counted_names):
    """Unknown ones, left out or refused."""

    def read(columns: int) -> int:
        names, zeros = ",".join(f"x{k}" for k in range(columns)), ",0" * columns
        path = written(f"time,hip,slide,{names}\n" + "".join(f"{k},0,0{zeros}\n" for k in range(7)), "wide.csv")
        said = []
        count = work(lambda: (read_motion(leg, path, ignore_extra=True), said.append(refusal(leg, path))))
        assert said[0].startswith(":1: unknown column 'x0'")
        return count

    assert_linear(read, 200)


def test_no_line_of_a_plain_file_is_looked_at_by_itself(written):
    """pyarrow reads the numbers in one pass.  A search of the text line by line would take ten times as long.  bench/growth.py has the times."""
    from ksl.motions.files.recognise import open_table

    def read(rows: int) -> int:
        path = written("time,a,b %,c\n" + "".join(f"{k},0.123456789,-0.5,{k}.25\n" for k in range(rows)))
        return work(lambda: open_table(path).read(["time", "a", "b %", "c"], "time"))

    _, few, many = map(read, (1000, 1000, 20_000))  # the first run imports
    assert many < 1.1 * few


def test_the_robot_and_the_motion_in_the_wrong_order(leg, written, tmp_path):
    from ksl.motions.files.recognise import swapped

    motion = written(HEAD + "0,0,0\n")
    assert swapped(motion, leg.file) and not swapped(leg.file, motion) and not swapped(motion, motion)
    assert not swapped(leg.file, tmp_path / "absent.csv") and not swapped(leg.file, "-")


def test_a_missing_package_is_named(leg, written, refusal, monkeypatch):
    monkeypatch.setattr("ksl.base.extras.find_spec", lambda name: None)
    assert refusal(leg, written(HEAD)) == ": reading motions needs the package pyarrow; install it with: pip install 'ksl[loads]'"


def test_a_source_says_what_was_read(leg, written, rows):
    path = written(HEAD + table(rows))
    source = read_motion(leg, path).source
    assert (source.file, source.format, source.samples, source.notes) == (str(path), "CSV", 10, [])
    assert source.step == pytest.approx(0.1) and str(source) == f"{path}, CSV, 10 samples, median step 0.1 s"
    assert isinstance(ksl.MotionError(), ValueError)
