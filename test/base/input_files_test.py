"""Files that can't be read to their end: the sentence names the file, whatever reads it, and as much memory is taken as they have bytes."""

import errno
import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import ksl
from ksl.base import files_read, input_files
from ksl.base.input_files import Unreadable, bounded
from ksl.motions.files import parquet_table, recognise

ROWS = np.column_stack([np.linspace(0, 1, 5000), *np.random.default_rng(0).normal(size=(6, 5000))])
UR5 = "examples/robots/ur5.urdf"


def csv(path, names):
    np.savetxt(path, ROWS, header=",".join(names), delimiter=",", comments="")


def parquet(path, names):
    pq.write_table(pa.table(dict(zip(names, ROWS.T))), path)


def npz(path, names):
    with open(path, "wb") as file:
        np.savez(file, **dict(zip(names, ROWS.T)))


def xlsx(path, names):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [names, *ROWS[:200].tolist()]:
        book.active.append(row)
    book.save(path)


def mat(path, names):
    scipy_io = pytest.importorskip("scipy.io")
    with open(path, "wb") as file:
        scipy_io.savemat(file, dict(zip(names, ROWS.T)))


class Failing(io.RawIOBase):
    """A file on a disk that fails after some reads."""

    def __init__(self, path, good):
        self._file, self._good = io.FileIO(path), good

    def readable(self):
        return True

    def seekable(self):
        return True

    def seek(self, *given):
        return self._file.seek(*given)

    def fileno(self):
        return self._file.fileno()

    def readinto(self, into):
        self._good -= 1
        if self._good < 0:
            raise OSError(errno.EIO, "Input/output error")
        return self._file.readinto(into)


@pytest.mark.parametrize("good", [0, 1, 2, 3, 5])
@pytest.mark.parametrize("write", [csv, parquet, npz, xlsx, mat], ids=lambda f: f.__name__)
def test_a_disk_that_fails_is_named_with_its_file(tmp_path, monkeypatch, write, good):
    """Neither the file is called damaged, nor standard output."""
    m = ksl.load(UR5)
    write(tmp_path / "m", ["time", *m.joint_names])
    monkeypatch.setattr(recognise, "opened", lambda file, limit: io.BufferedReader(Failing(file, good)))
    monkeypatch.setattr(input_files, "opened", lambda file, limit: io.BufferedReader(Failing(file, good)))
    monkeypatch.setattr(parquet_table, "arrow_file", lambda path: pa.PythonFile(io.BufferedReader(Failing(path, good)), "r"))
    try:
        assert len(ksl.read_motion(m, tmp_path / "m").time) in (len(ROWS), 200)  # it had read enough
    except ksl.MotionError as e:
        assert str(e).startswith(f"{tmp_path / 'm'}: can't be read (Input/output error)")
    else:
        assert good > 1


def test_a_file_that_fails_while_it_is_hashed(tmp_path, monkeypatch):
    m, file = ksl.load(UR5), tmp_path / "m.csv"
    csv(file, ["time", *m.joint_names])
    real = open
    monkeypatch.setattr(
        "builtins.open", lambda name, *how, **more: io.BufferedReader(Failing(name, 0)) if name == str(file) and how == ("rb",) else real(name, *how, **more)
    )
    with files_read.recorded(), pytest.raises(ksl.MotionError, match=r"m.csv: can't be read \(Input/output error\); copy it"):
        ksl.read_motion(m, file)


@pytest.mark.parametrize("size", [0, 1, 1 << 10, (1 << 24) - 1, 1 << 24, (1 << 24) + 1, (3 << 24) + 5])
def test_pieces_are_the_whole(size):
    assert bounded(io.BytesIO(bytes(size)), size) == bytes(size)
    if size:
        with pytest.raises(Unreadable, match="larger than"):
            bounded(io.BytesIO(bytes(size)), size - 1)


@pytest.mark.skipif(sys.platform != "linux", reason="limits memory as Linux does")
def test_small_files_need_little_memory(tmp_path):
    """With 1 GB of addresses more than the libraries take, far less than the largest file may have; by name, and from standard input."""
    files = []
    for write in (csv, parquet, npz):
        files.append(str(tmp_path / write.__name__))
        write(tmp_path / write.__name__, ["time", *ksl.load(UR5).joint_names])
    code = f"""
import os, resource, ksl, scipy.interpolate, pyarrow.parquet, pyarrow.csv
size = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (size + (1 << 30), -1))
for file in {files}:
    os.dup2(os.open(file, os.O_RDONLY), 0)
    for name in (file, "-"):
        print(file, ksl.read_motion(ksl.load({UR5!r}), name).q.shape)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert done.stdout.splitlines() == [f"{file} (5000, 6)" for file in files for _ in range(2)], done.stderr
