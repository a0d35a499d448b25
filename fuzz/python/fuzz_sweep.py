"""Files of sweeps."""

from guided import guide

guide("ksl.sweeps", "ksl.base.toml_files")

from ksl.base.errors import SweepError
from ksl.base.toml_files import toml_of
from ksl.sweeps import description
from mutate import of_text
from target import run


def read(data: bytes) -> None:
    tables = toml_of(data.decode("utf-8", "replace"), "sweep.toml", SweepError)
    description.sweep_from(tables, "sweep.toml")


if __name__ == "__main__":
    run(read, of_text, SweepError)
