"""Files of sweeps."""

from guided import guide

guide("ksl.sweeps", "ksl.toml_files")

from ksl.errors import SweepError
from ksl.sweeps import description
from ksl.toml_files import toml_of
from mutate import of_text
from target import run


def read(data: bytes) -> None:
    tables = toml_of(data.decode("utf-8", "replace"), "sweep.toml", SweepError)
    description.sweep_from(tables, "sweep.toml")


if __name__ == "__main__":
    run(read, of_text, SweepError)
