"""Motions in Excel workbooks: one table on one sheet; everything else is said and not guessed."""

import datetime
import warnings
import zipfile

import numpy as np
import pytest
from ksl_command import run_ksl

import ksl
from ksl.base import limits
from ksl.motions.files.workbook import MOST_NOTES, hidden_parts, letters

openpyxl = pytest.importorskip("openpyxl")
NAMES = ["time", "hip", "slide"]


@pytest.fixture
def book(tmp_path):
    """Writes sheets {name: rows} and gives the path."""

    def write(**sheets):
        made = openpyxl.Workbook()
        made.remove(made.active)
        for name, rows in sheets.items():
            sheet = made.create_sheet(name)
            for row in rows:
                sheet.append(list(row))
        made.save(tmp_path / "motion.xlsx")
        return tmp_path / "motion.xlsx"

    return write


def test_numbers_are_those_of_the_sheet(leg, book, rows):
    motion = ksl.read_motion(leg, book(Log=[NAMES, *rows.tolist()]))
    np.testing.assert_array_equal(np.column_stack([motion.time, motion.q]), rows)
    assert motion.source.format == "Excel workbook" and not motion.doubts


@pytest.mark.parametrize("ends", [["", None], [None, ""], [None, None, ""]])
def test_cells_that_hold_nothing_beside_the_table(leg, book, rows, ends):
    """Cells with a format alone, and texts without a character, as programs leave them."""
    table = [["Test 7", *ends], [], [*NAMES, *ends], ["s", "rad", "m", *ends], *[[*row, *ends] for row in rows.tolist()]]
    motion = ksl.read_motion(leg, book(Log=table))
    np.testing.assert_array_equal(np.column_stack([motion.time, motion.q]), rows)


def test_titles_units_indents_empty_sheets_and_remarks(leg, book, rows):
    degrees = np.column_stack([1000 * rows[:, 0], np.degrees(rows[:, 1]), 1000 * rows[:, 2]])
    above = [["Test 7, arm 2"], ["Examiner", "Ada"], ["Date", datetime.datetime(2026, 11, 3, 14, 22)], ["Rate", 10, "Hz"], ["Bench", 50 * "x"], []]
    table = [*above, [None, *NAMES], [None, "ms", "deg", "[mm]"], *[[None, *row] for row in degrees.tolist()], [], []]
    table[9].append("recorded by Ada")
    motion = ksl.read_motion(leg, book(**{"Empty": [], "sheet 2": table, "Notes": [["see page 3", "and 4"]]}))
    np.testing.assert_allclose(np.column_stack([motion.time, motion.q]), rows, atol=1e-12)
    notes = "\n".join(motion.source.notes)
    assert (
        "left out of sheet 'sheet 2': 'Test 7, arm 2', 'Examiner Ada', 'Date 2026-11-03 14:22:00', 'Rate 10 Hz', 'Bench " + 34 * "x" + "', above the names"
        in notes
    )
    assert "'recorded by Ada' in cell E10" in notes and "converted from deg to rad: hip" in notes and "they hold no numbers: sheets Notes" in notes
    for row in table[8:18]:
        row[4:] = ["ok"]
    table[8].append("and fine")
    marked = [note for note in ksl.read_motion(leg, book(Log=table)).source.notes if note.startswith("left out")]
    assert len(marked) == MOST_NOTES and "'ok' in cell E16" in marked[-1]
    named = [["time [ms]", "hip (deg)", "slide [mm]"], *degrees.tolist()]
    np.testing.assert_allclose(ksl.read_motion(leg, book(Log=named)).q, rows[:, 1:], atol=1e-12)


@pytest.mark.parametrize(
    "start",
    [
        datetime.datetime(2026, 3, 1, 12, 0, 0, 250000),
        datetime.time(23, 59, 58),
        datetime.time(23, 59, 59, 500000),
        datetime.time(1, 59, 59, 500000),
        datetime.timedelta(hours=30),
    ],
    ids=["dates", "clock", "clock past midnight", "clock past an hour", "durations"],
)
def test_times_of_excel(leg, book, rows, start):
    def at(k):
        step = datetime.timedelta(milliseconds=100 * k)
        return (datetime.datetime.combine(datetime.date(2026, 1, 1), start) + step).time() if isinstance(start, datetime.time) else start + step

    motion = ksl.read_motion(leg, book(Log=[NAMES, *([at(k), *row[1:]] for k, row in enumerate(rows.tolist()))]))
    np.testing.assert_allclose(motion.time, rows[:, 0], atol=1e-9)
    assert any("dates or clock times" in note for note in motion.source.notes)


def test_hidden_rows_and_columns_are_said(leg, book, rows):
    """A filter hides rows: they are not shown, and are in the file."""
    path = book(Log=[NAMES, *rows.tolist()])
    made = openpyxl.load_workbook(path)
    for number in (2, 4, 5, 6, 11, 40):
        made.active.row_dimensions[number].hidden = True
    made.active.column_dimensions["C"].hidden = True
    made.active.column_dimensions["F"].hidden = True
    made.active.auto_filter.ref = "A1:C11"
    made.save(path)
    motion = ksl.read_motion(leg, path)
    np.testing.assert_array_equal(motion.q, rows[:, 1:])
    notes = "\n".join(motion.source.notes)
    assert "rows of sheet 'Log' that are hidden, by a filter say, are used like the others: 2, 4 to 6, 11, 5 in all" in notes.replace(" and ", ", ")
    assert "columns of sheet 'Log' that are hidden are used like the others: 'slide' (column C)" in notes


@pytest.mark.parametrize("size", [1, 7, 64, 10_000])
def test_tags_of_a_sheet_in_pieces(size):
    text = b'<cols><col min="2" max="3" hidden="1"/><col min="5" max="5" hidden="0"/></cols><row r="3" hidden="true"><c r="A3"/></row><row><c/></row><x:row hidden=\'1\'/>'
    assert hidden_parts(text[k : k + size] for k in range(0, len(text), size)) == ([3, 5], ["B", "C"])


def test_what_openpyxl_says_is_a_note(leg, book, rows, recwarn):
    path = book(Log=[NAMES, *rows.tolist()])
    said = openpyxl.load_workbook

    def talking(*given, **options):
        warnings.warn_explicit("Cell B7 is marked as a date", UserWarning, openpyxl.__file__.replace("__init__", "reader/excel"), 1)
        warnings.warn_explicit("Workbook contains no default style, apply openpyxl's default", UserWarning, openpyxl.__file__, 1)
        return said(*given, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(openpyxl, "load_workbook", talking)
        notes = ksl.read_motion(leg, path).source.notes
    assert [note for note in notes if "says" in note] == ["openpyxl says: Cell B7 is marked as a date"] and not recwarn.list


def test_several_sheets_need_a_name(leg, book, rows, refusal):
    path = book(First=[NAMES, *rows.tolist()], Second=[NAMES, *(2 * rows).tolist()])
    assert refusal(leg, path) == ": 2 sheets hold numbers: First, Second; say which by --topic SHEET (topic=)"
    assert refusal(leg, path, topic="Secnd").startswith(": --topic (topic=) is 'Secnd', and no sheet has this name; did you mean 'Second'?")
    np.testing.assert_array_equal(ksl.read_motion(leg, path, topic="Second").q, 2 * rows[:, 1:])


REFUSED = {
    "two tables side by side": (
        [[*NAMES, None, *NAMES], [0, 1, 2, None, 0, 1, 2]],
        ", row 1: column D has no name, and columns with names stand on both sides of it: two tables?",
    ),
    "a number beside the table": ([NAMES, [0, 1, 2, None, 5]], ", cell E2: holds '5' beside the table, where no name is above: two tables?"),
    "two tables below each other": ([NAMES, [0, 1, 2], [1, 1, 2], [], NAMES, [0, 1, 2]], ", row 5: the table ends in row 3, and more follows: a second table?"),
    "an empty row": ([NAMES, [0, 1, 2], [], [1, 1, 2]], ", row 4: the table ends in row 2, and more follows"),
    "no names": ([[0, 1, 2], [1, 1, 2]], ", row 1: no names of columns above this row"),
    "one text alone": ([["hello"]], ": no names of columns"),
    "names with values alone": ([["Examiner", "Ada"], ["Rate", 10]], ": no names of columns"),
    "numbers as text below two names": ([["time", "hip"], ["0", "1,5"]], ", row 1: no column 'slide' for joint slide"),
    "names alone": ([NAMES, ["s", "rad", "m"]], ": 0 samples, but differentiating hip, slide needs at least 6"),
    "a last column without numbers": ([NAMES, [0, 1], [1, 1]], ": the positions of slide are not numbers in any sample"),
    "times that go back": ([["Test 7"], [], NAMES, ["s", "rad", "m"], [5, 1, 2], [1, 1, 2]], ", row 6: time 1 after 5; times must increase"),
    "a unit far above the names": (
        [*[["Test 7"]] * 2 * MOST_NOTES, ["Positions [deg]"], NAMES, [0, 1, 2]],
        f", cell A{2 * MOST_NOTES + 1}: 'Positions [deg]' stands above",
    ),
    "the same name twice": ([["time", "hip", "hip"], [0, 1, 2]], ", row 1: two columns are named 'hip'"),
    "a number as text": (
        [NAMES, [0, 1, 2], [1, "1,5", 2]],
        ", cell B3: column 'hip' holds '1,5'; expected a number, and this is text: let the spreadsheet program make numbers",
    ),
    "an error of a formula": ([NAMES, [0, "#DIV/0!", 2]], ", cell B2: column 'hip' holds '#DIV/0!'"),
    "a truth value": ([NAMES, [0, True, 2]], ", cell B2: column 'hip' holds 'True'"),
    "a mean below": ([NAMES, [0, 1, 2], ["mean", 1, 2]], ", cell A3: column 'time' holds 'mean'"),
    "a unit above the names": (
        [[None, "Positions [deg]"], NAMES, [0, 1, 2]],
        ", cell B1: 'Positions [deg]' stands above the names of columns and gives a unit",
    ),
    "a formula without its value": (
        [NAMES, [0, 1, 2], ["=A2+1", 1, 2]],
        ", cell A3: holds a formula without its value; open the workbook in a spreadsheet program",
    ),
    "dates of a joint": ([NAMES, [0, datetime.datetime(2026, 1, 1), 2]], ": column 'hip' holds dates or clock times; expected numbers"),
    "dates among numbers": ([NAMES, [0, 1, 2], [datetime.datetime(2026, 1, 1), 1, 2]], ", cell A3: column 'time' holds '2026-01-01"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_no_one_table_is_refused(leg, book, refusal, what):
    rows, said = REFUSED[what]
    assert said in refusal(leg, book(Log=rows))


def test_empty_and_damaged_workbooks(leg, book, written, refusal):
    assert refusal(leg, book(A=[], B=[])).startswith(": all sheets are empty")
    whole = book(Log=[NAMES, [0, 1, 2]]).read_bytes()
    assert "damaged" in refusal(leg, written(whole[:-40], "cut.xlsx"))
    with zipfile.ZipFile(written(b"", "bad.xlsx"), "w") as bad:
        bad.writestr("xl/workbook.xml", "<workbook>")
    assert "truncated or damaged" in refusal(leg, written((written(b"", "x").parent / "bad.xlsx").read_bytes(), "bad2.xlsx"))


def test_entities_and_large_workbooks_are_refused_soon(leg, book, written, refusal, monkeypatch):
    path = book(Log=[NAMES, [0, 1, 2]])
    bomb = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">' + "".join(f'<!ENTITY a{i} "{f"&a{i - 1 if i else str()};" * 10}">' for i in range(12)) + "]>"
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(path.with_name("bomb.xlsx"), "w") as new:
        for name in old.namelist():
            text = old.read(name)
            new.writestr(name, text.replace(b"<worksheet", f"{bomb}<worksheet".encode(), 1).replace(b"<v>0</v>", b"<v>&a11;</v>") if "sheet1" in name else text)
    assert "damaged" in refusal(leg, path.with_name("bomb.xlsx"))
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 5)
    assert "6 numbers; at most 5 are read" in refusal(leg, book(Log=[NAMES, [0, 1, 2], [1, 1, 2]]))
    path = book(Log=[NAMES, [0, 1, 2]])
    monkeypatch.setattr(limits, "WORKBOOK_CELLS", 5)
    assert "6 cells; at most 5 are read" in refusal(leg, path)
    monkeypatch.setattr(limits, "WORKBOOK_BYTES", 1000)
    assert "of a workbook are read: save the sheet as CSV" in refusal(leg, path)


@pytest.mark.parametrize("number", ["1e308", "99999999999", "2097156"])
def test_a_row_of_a_number_that_no_sheet_has_is_refused_soon(leg, book, refusal, number):
    """A text of some bytes makes openpyxl give as many empty rows."""
    path = book(Log=[NAMES, [0, 1, 2], [1, 1, 2]])
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(path.with_name("far.xlsx"), "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b'<row r="3"', f'<row r="{number}"'.encode()))
    assert "more than 2,097,152 empty rows in the workbook; save the table as CSV" in refusal(leg, path.with_name("far.xlsx"))


def test_hostile_names(leg, book, refusal):
    said = refusal(leg, book(**{"L\u202eog": [["time", "hip\u202e\u2066", "slide"], [0, 1, 2]]}))
    assert "\u202e" not in said and "\\u202e" in said


def test_without_openpyxl(leg, book, refusal, monkeypatch):
    path = book(Log=[NAMES, [0, 1, 2]])
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    assert "pip install 'ksl[xlsx]'; or save the sheet as CSV" in refusal(leg, path)


def test_by_the_command(leg, book, rows, tmp_path):
    path = book(First=[NAMES, *rows.tolist()], Second=[["notes"]])
    done = run_ksl("loads", leg.file, path, "-o", tmp_path / "out", "--topic", "First")
    assert done.returncode == 0 and "axial" in done.stdout, done.stderr


def test_letters():
    assert [letters(i) for i in (0, 25, 26, 51, 52, 701, 702, 16383)] == ["A", "Z", "AA", "AZ", "BA", "ZZ", "AAA", "XFD"]


def test_cells_as_numbers():
    """Times in s; neither text nor truth values, nor what no float holds."""
    import datetime

    from ksl.motions.files.workbook import _number

    assert _number(datetime.time(2, 3, 4, 500_000)) == (2 * 3600 + 3 * 60 + 4.5, True) and _number(datetime.timedelta(days=1, milliseconds=5)) == (
        86400.005,
        True,
    )
    assert _number(3) == (3.0, False) and _number(-0.5) == (-0.5, False) and [_number(x) for x in ("3", True, None, 10**400)] == [(None, False)] * 4
