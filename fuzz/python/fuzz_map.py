"""Maps of columns, TOML or CSV."""

import atheris

with atheris.instrument_imports(include=["ksl.motions", "ksl.toml_files", "tomllib"]):
    from ksl.motions import column_map

from target import finite, run

from ksl.errors import MotionError


def read(data: bytes) -> None:
    found = column_map.map_of(data.decode("utf-8", "replace"), "map")
    finite([x for r in found.rules.values() for x in (r.sign, r.scale, r.offset)], "factors")
    finite(list(found.constants.values()), "constants")


if __name__ == "__main__":
    run(read, MotionError)
