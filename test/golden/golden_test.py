"""The golden hashes, of the builds that are there: the bits of results are those of the table, with gcc and with clang.

`make golden` compiles the programs for every level and instruction set; here the algebra is compiled twice, without
optimisation, and the engine is that of each compiler's library, with each of its instruction sets."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import golden


def built(folder: Path, compiler: str, level: str, isa: str) -> golden.Build:
    return golden.Build(folder, compiler, level, isa, [])


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_algebra_is_that_of_the_table(tmp_path, compiler):
    found = golden.rows(built(tmp_path, compiler, "0", "x86-64-v3").algebra())
    assert golden.differences(found, ["algebra"]) == []


def test_every_function_of_the_algebra_has_a_line():
    sys.path.insert(0, str(HERE.parent / "algebra"))
    from functions import everything
    from make_programs import LEFT_OUT

    names = {f.name for f in everything().values() if f.returns.kind != "pointer" and f.name not in LEFT_OUT and not f.name.endswith("_alloc")}
    assert names <= set(golden.of_tables())


def test_a_planted_fault_is_seen():
    """Contraction, which rounds once instead of twice, changes the hashes of many functions."""
    assert golden.planted() == "caught"


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_engine_is_that_of_the_table(tmp_path, compiler):
    library = os.environ.get("KSL_LIBRARY")
    assert library, "KSL_LIBRARY names the library that make test builds"
    build = built(tmp_path, compiler, "0", "x86-64-v2")
    assert golden.differences(golden.rows(build.engine(Path(library).parent.parent / compiler)), ["engine"]) == []
    for isa in ("x86-64-v2", "x86-64-v3", "x86-64-v4"):
        again = subprocess.run([tmp_path / "engine"], capture_output=True, text=True, env=os.environ | {"KSL_ISA": isa})
        if again.returncode == 0 or "KSL_ISA" not in again.stderr:  # a set that is not built or doesn't run here says so
            assert again.returncode == 0, again.stderr
            assert golden.differences(golden.rows(again.stdout), ["engine"]) == []
