"""Files of sweeps."""

import atheris

with atheris.instrument_imports(include=["ksl.sweeps.description", "ksl.toml_files", "tomllib"]):
    from ksl.sweeps import description

from target import run

from ksl.errors import SweepError
from ksl.toml_files import toml_of


def read(data: bytes) -> None:
    tables = toml_of(data.decode("utf-8", "replace"), "sweep.toml", SweepError)
    description.sweep_from(tables, "sweep.toml")


if __name__ == "__main__":
    run(read, SweepError)
