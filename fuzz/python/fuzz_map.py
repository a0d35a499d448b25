"""Maps of columns, TOML or CSV."""

from guided import guide

guide("ksl.motions", "ksl.base.csv_cells", "ksl.base.toml_files")

from ksl.base.errors import MotionError
from ksl.motions.files import map_file
from mutate import of_text
from target import finite, run


def read(data: bytes) -> None:
    found = map_file.map_of(data.decode("utf-8", "replace"), "map")
    finite([x for r in found.rules.values() for x in (r.sign, r.scale, r.offset)], "factors")
    finite(list(found.constants.values()), "constants")


if __name__ == "__main__":
    run(read, of_text, MotionError)
