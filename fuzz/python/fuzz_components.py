"""Components files: catalogue numbers of bearings, gears, motors, bolts and shafts."""

import atheris

with atheris.instrument_imports(include=["ksl.sizing", "ksl.toml_files", "ksl.toml_lines", "tomllib"]):
    from ksl.sizing import components

from target import run

from ksl.errors import SizingError


def read(data: bytes) -> None:
    components.components_of_text(data.decode("utf-8", "replace"), "components.toml")


if __name__ == "__main__":
    run(read, SizingError)
