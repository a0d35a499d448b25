"""The form of a CSV file alone, in pure Python: many more texts a second than with the parser of its numbers."""

from guided import guide

guide("ksl.motions", "ksl.base.csv_cells")

from ksl.base.csv_cells import csv_text, text_of_cell
from ksl.base.errors import MotionError
from ksl.motions.files import csv_form, csv_table
from mutate import of_text
from target import BrokenPromise, run


def read(data: bytes) -> None:
    text, encoding, _ = csv_table._as_utf8("motion.csv", data)
    form = csv_form.form_of("motion.csv", text, encoding)
    for name in form.names:
        if text_of_cell(csv_text(name)) != name:
            raise BrokenPromise(f"broken promise: {name!r} does not read back")
    csv_form.doubts_about_end("motion.csv", text)


if __name__ == "__main__":
    run(read, of_text, MotionError)
