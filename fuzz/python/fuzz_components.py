"""Components files: catalogue numbers of bearings, gears, motors, bolts and shafts."""

from guided import guide

guide("ksl.sizing", "ksl.base.toml_files", "ksl.base.toml_lines")

from ksl.base.errors import SizingError
from ksl.sizing.catalogue import components
from mutate import of_text
from target import run


def read(data: bytes) -> None:
    components.components_of_text(data.decode("utf-8", "replace"), "components.toml")


if __name__ == "__main__":
    run(read, of_text, SizingError)
