"""MATLAB files, as scipy writes them: arrays, rows or columns; names of joints; what is no array is said."""

import numpy as np
import pytest
from scipy.io import savemat

import ksl


@pytest.fixture
def mat(tmp_path):
    def write(compressed=True, **variables):
        savemat(tmp_path / "motion.mat", variables, do_compression=compressed)
        return tmp_path / "motion.mat"

    return write


@pytest.mark.parametrize("compressed", [True, False])
@pytest.mark.parametrize("shape", [(-1, 1), (1, -1)], ids=["columns", "rows"])
def test_arrays(leg, mat, rows, compressed, shape):
    motion = ksl.read_motion(leg, mat(compressed, time=rows[:, 0].reshape(shape), q=rows[:, 1:]))
    np.testing.assert_array_equal(np.column_stack([motion.time, motion.q]), rows)
    assert motion.source.format == "MATLAB file" and "in the order of the robot's joints: hip, slide" in "\n".join(motion.source.notes)
    motion = ksl.read_motion(leg, mat(compressed, t=rows[:, 0].reshape(shape), hip=rows[:, 1].reshape(shape), slide=rows[:, 2].reshape(shape).astype("f4")))
    np.testing.assert_allclose(motion.q, rows[:, 1:], atol=1e-7)


@pytest.mark.parametrize("names", [np.array(["slide", "hip"], dtype=object), np.array(["slide", "hip"])], ids=["cells", "characters"])
def test_names_of_joints(leg, mat, rows, names):
    motion = ksl.read_motion(leg, mat(time=rows[:, :1], q=rows[:, [2, 1]], joint_names=names))
    np.testing.assert_array_equal(motion.q, rows[:, 1:])


def test_numbers_of_the_whole_motion_are_left_out(leg, mat, rows):
    motion = ksl.read_motion(leg, mat(time=rows[:, :1], q=rows[:, 1:], rate=10.0))
    assert "left out, since they are single numbers: rate" in motion.source.notes


def test_what_is_no_array_is_said(leg, mat, rows, refusal):
    whole = {"time": rows[:, :1], "q": rows[:, 1:]}
    assert refusal(leg, mat(out={"time": rows[:, :1]})).startswith(": holds no arrays of numbers, but out (struct); save arrays: save('motion.mat', 'time', 'q')")
    assert "unknown column 'remark'" in refusal(leg, mat(**whole, remark="by Ada"))
    assert ksl.read_motion(leg, mat(**whole, remark="by Ada"), ignore_extra=True).q.shape == (10, 2)
    assert "array 'q' has 10 columns, but leg has 2: hip, slide" in refusal(leg, mat(time=rows[:, :1], q=np.tile(rows[:, 1:].T, (5, 1))))
    assert "has the shape (2, 3, 4)" in refusal(leg, mat(**whole, x=np.ones((2, 3, 4))))
    assert refusal(leg, mat(**whole, hip=np.ones((10, 1)) * 1j)) == ": hip holds complex numbers; expected real ones"
    assert "has 3 samples, but" in refusal(leg, mat(**whole, hip=np.ones((3, 1))))


def test_damaged_and_newer_files(leg, mat, rows, written, refusal):
    data = mat(time=rows[:, :1], q=rows[:, 1:]).read_bytes()
    for cut in (130, 160, len(data) // 2, len(data) - 3):
        assert "truncated or damaged" in refusal(leg, written(data[:cut], "cut.mat")) or cut == len(data) - 3
    assert "version 7.3, which is HDF5; save it by save(…, '-v7')" in refusal(leg, written(b"MATLAB 7.3 MAT-file" + bytes(600), "new.mat"))
    rng = np.random.default_rng(0)
    for _ in range(60):
        bad = bytearray(data)
        for i in rng.integers(100, len(bad), size=3):
            bad[i] = rng.integers(256)
        try:
            ksl.read_motion(leg, written(bytes(bad), "bad.mat"))
        except ksl.MotionError as e:
            assert "\n" not in str(e)


def test_many_numbers_are_refused_before_they_are_loaded(leg, mat, rows, refusal, monkeypatch):
    from ksl.base import limits

    path = mat(time=rows[:, :1], q=rows[:, 1:])
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 20)
    assert "30 numbers; at most 20 are read" in refusal(leg, path)
