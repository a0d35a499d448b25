"""MATLAB files, as scipy writes them: arrays, rows or columns; names of joints; what is no array is said."""

import struct
import zlib

import numpy as np
import pytest
from scipy.io import savemat

import ksl

INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


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


@pytest.mark.parametrize(
    "names", [np.array(["slide", "hip"], dtype=object), np.array(["slide", "hip"]), np.array([["slide", "hip"]])], ids=["cells", "characters", "a row of texts"]
)
def test_names_of_joints(leg, mat, rows, names):
    motion = ksl.read_motion(leg, mat(time=rows[:, :1], q=rows[:, [2, 1]], joint_names=names))
    np.testing.assert_array_equal(motion.q, rows[:, 1:])


def test_numbers_of_the_whole_motion_are_left_out(leg, mat, rows):
    motion = ksl.read_motion(leg, mat(time=rows[:, :1], q=rows[:, 1:], rate=10.0))
    assert "left out, since they are single numbers: rate" in motion.source.notes


def test_what_is_no_array_is_said(leg, mat, rows, refusal):
    whole = {"time": rows[:, :1], "q": rows[:, 1:]}
    assert refusal(leg, mat(out={"time": rows[:, :1]})).startswith(
        ": holds no arrays of numbers, but out (struct); save arrays: save('motion.mat', 'time', 'q')"
    )
    assert "unknown column 'remark'" in refusal(leg, mat(**whole, remark="by Ada"))
    assert ksl.read_motion(leg, mat(**whole, remark="by Ada"), ignore_extra=True).q.shape == (10, 2)
    assert "array 'q' has 10 columns, but leg has 2: hip, slide" in refusal(leg, mat(time=rows[:6, :1], q=np.tile(rows[:, 1:].T, (3, 1))))
    assert "has the shape (2, 3, 4)" in refusal(leg, mat(**whole, x=np.ones((2, 3, 4))))
    assert refusal(leg, mat(time=rows[:, :1], slide=rows[:, 2:], hip=np.ones((10, 1)) * 1j)).startswith(": column 'hip' holds complex numbers: ")
    assert refusal(leg, mat(time=rows[:, :1], slide=rows[:, 2:], hip=np.ones((3, 1)))).endswith(
        "array 'hip' has 3 samples, but 'time' has 10; give as many of each"
    )
    for lying in ({"time": rows[:, :1], "q": rows[:, 1:].T}, {"q": rows[:, 1:].T, "time": rows[:, :1]}):
        assert refusal(leg, mat(**lying)).endswith("; 'q' has a column for each sample: transpose it")


MORE = {
    "force": np.ones((10, 6)), "gravity": np.ones(3), "transform": np.eye(4), "images": np.ones((2, 3, 4)), "transposed": np.ones((6, 10)), "square": np.ones((10, 10)),
    "phasor": np.ones((10, 1)) * 1j, "one_row": np.ones((1, 7)),
}  # fmt: skip


@pytest.mark.parametrize("form", ["mat", "npz"])
@pytest.mark.parametrize("name", MORE)
@pytest.mark.parametrize("time", ["time", "t"])
def test_other_arrays_are_left_out_as_columns_are(leg, mat, tmp_path, rows, refusal, form, name, time):
    """By --ignore-extra, and by a map's `ignore` under their own names."""
    if form == "mat":
        file = mat(**{time: rows[:, :1], "q": rows[:, 1:], name: MORE[name]})
    else:
        np.savez(file := tmp_path / "motion.npz", **{time: rows[:, 0], "q": rows[:, 1:], name: MORE[name]})
    assert refusal(leg, file).startswith(f": unknown column '{name}")
    for options in ({"ignore_extra": True}, {"map": {"ignore": [name]}}):
        motion = ksl.read_motion(leg, file, **options)
        np.testing.assert_array_equal(motion.q, rows[:, 1:])
        assert name in "\n".join(motion.source.notes)


def test_a_map_names_matrices(leg, mat, rows, refusal):
    """Columns of one, a whole one as q, and q itself to be left out."""
    file = mat(time=rows[:, :1], Q=rows[:, 1:], x=rows)
    for columns in ({"Q": "q"}, {"Q[0]": "hip", "Q[1]": "slide"}, {"x[1]": "hip", "x[2]": "slide"}):
        np.testing.assert_array_equal(ksl.read_motion(leg, file, map=columns, ignore_extra=True).q, rows[:, 1:])
    degrees = ksl.read_motion(
        leg, mat(time=rows[:, :1], Q=rows[:, 1:2], x=rows), map={"columns": {"Q": {"to": "hip", "unit": "deg"}, "x[2]": "slide"}}, ignore_extra=True
    )
    np.testing.assert_allclose(np.degrees(degrees.q[:, 0]), rows[:, 1])
    assert "'x' is to be 'q', and has 3 columns, but leg has 2: hip, slide" in refusal(leg, file, map={"x": "q"})
    file = mat(time=rows[:, :1], q=rows, v=rows[:, 1:], x=rows[:, 1:])
    np.testing.assert_array_equal(ksl.read_motion(leg, file, map={"columns": {"x": "q"}, "ignore": ["q", "v"]}).q, rows[:, 1:])


def test_a_square_q_is_no_guess(robot, mat, refusal):
    text = '<robot name="r"><link name="l0"/>' + "".join(
        f'<link name="l{k + 1}">{INERTIAL}</link><joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/></joint>' for k in range(6)
    )
    m = robot(text + "</robot>")
    assert "'q' is 6 × 6; whether its rows or its columns are the samples can't be told" in refusal(m, mat(time=np.arange(6.0), q=np.ones((6, 6))))


def test_damaged_and_newer_files(leg, mat, rows, written, refusal):
    data = mat(time=rows[:, :1], q=rows[:, 1:]).read_bytes()
    for cut in (130, 160, len(data) // 2, len(data) - 3):
        assert "truncated or damaged" in refusal(leg, written(data[:cut], "cut.mat")) or cut == len(data) - 3
    assert "version 7.3, which is HDF5; save it by save(…, '-v7')" in refusal(leg, written(b"MATLAB 7.3 MAT-file" + bytes(600), "new.mat"))
    savemat(old := written(b"", "old.mat"), {"time": rows[:, :1], "q": rows[:, 1:]}, format="4")
    assert refusal(leg, old) == ": is a MATLAB file of another version; save it by save(…, '-v7')"
    rng = np.random.default_rng(0)
    for _ in range(60):
        bad = bytearray(data)
        for i in rng.integers(100, len(bad), size=3):
            bad[i] = rng.integers(256)
        try:
            ksl.read_motion(leg, written(bytes(bad), "bad.mat"))
        except ksl.MotionError as e:
            assert "\n" not in str(e)


def element(kind, data, order="<"):
    """An element as MATLAB's documentation of the format describes it."""
    return struct.pack(f"{order}II", kind, len(data)) + data + bytes(-len(data) % 8)


def array(name, x, order="<", kind=9, of_class=6):
    head = element(6, struct.pack(f"{order}II", of_class, 0), order) + element(5, struct.pack(f"{order}2i", *x.shape), order) + element(1, name.encode(), order)
    return element(14, head + element(kind, x.astype(f"{order}f8").tobytes(order="F"), order), order)


def headed(elements, mark=b"\x00\x01IM"):
    return b"MATLAB 5.0 MAT-file".ljust(124) + mark + elements


def test_a_file_of_a_machine_whose_bytes_have_the_other_order(leg, written, rows):
    data = headed(array("time", rows[:, :1], ">") + array("q", rows[:, 1:], ">"), b"\x01\x00MI")
    np.testing.assert_array_equal(ksl.read_motion(leg, written(data)).q, rows[:, 1:])


def test_elements_that_matlab_does_not_write(leg, written, rows, refusal):
    time, q = array("time", rows[:, :1]), array("q", rows[:, 1:])
    assert "columns" not in refusal(leg, written(headed(time))) and ksl.read_motion(leg, written(headed(time + q))).q.shape == (10, 2)
    for bad in (
        array("q", rows[:, 1:], kind=0),
        array("q", rows[:, 1:], of_class=18),
        array("q", rows[:, 1:], kind=3),
        q[:8] + element(6, b"") + q[8:],
        element(9, bytes(8)),
    ):
        assert ": is a MATLAB file, but truncated or damaged; save it again" in refusal(leg, written(headed(time + bad)))
    assert refusal(leg, written(headed(time + q + time))) == ": two variables are named 'time'; save one of them"


def small(kind, data, order="<"):
    """An element of up to four bytes: its size and type are in four, and it in the next four."""
    return struct.pack(f"{order}I", len(data) << 16 | kind) + data + bytes(-(len(data) + 4) % 8)


@pytest.mark.parametrize(("order", "mark"), [("<", b"\x00\x01IM"), (">", b"\x01\x00MI")])
@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8", "i8", "u8"])
def test_numbers_and_names_of_every_type(leg, written, refusal, order, mark, kind):
    """Names of up to four letters are in small elements; what is larger, or of another size than the shape says, is damage."""
    types = dict(zip(("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8", "i8", "u8"), (1, 2, 3, 4, 5, 6, 7, 9, 12, 13), strict=True))

    def variable(name, x, shape=None, named=small):
        head = (
            element(6, struct.pack(f"{order}II", 6, 0), order)
            + element(5, struct.pack(f"{order}{len(shape or (0, 0))}i", *(shape or (len(x), 1))), order)
            + named(1, name, order)
        )
        return element(14, head + element(types[kind], np.asarray(x, dtype=order + kind).tobytes(), order), order)

    k = np.arange(8)
    motion = ksl.read_motion(leg, written(headed(variable(b"time", k) + variable(b"hip", k % 7) + variable(b"slide", 7 - k, named=element), mark)))
    assert motion.time.tolist() == k.tolist() and motion.q.tolist() == np.column_stack([k % 7, 7 - k]).tolist()
    for bad in (variable(b"slide", k), variable(b"x", k, (9, 1)), variable(b"x", k, (-8, -1)), variable(b"x", k, (0, 8)), variable(b"x", k, (8,))):
        assert "truncated or damaged" in refusal(leg, written(headed(variable(b"time", k) + variable(b"hip", k) + bad, mark)))


@pytest.mark.parametrize(("order", "mark"), [("<", b"\x00\x01IM"), (">", b"\x01\x00MI")])
@pytest.mark.parametrize(("kind", "encoding"), [(1, "latin-1"), (2, "latin-1"), (4, "utf-16"), (16, "utf-8"), (17, "utf-16"), (18, "utf-32")])
def test_texts_of_every_encoding(leg, written, refusal, order, mark, kind, encoding):
    """Names of joints in rows of characters, column by column."""
    end = "" if encoding in ("latin-1", "utf-8") else "-le" if order == "<" else "-be"
    names = "".join(a + b for a, b in zip("hip  ", "slide", strict=True)).encode(encoding + end)

    def variable(name, shape, of_class, held):
        head = element(6, struct.pack(f"{order}II", of_class, 0), order) + element(5, struct.pack(f"{order}2i", *shape), order) + element(1, name, order)
        return element(14, head + element(*held, order), order)

    k = np.arange(8.0)
    numbers = [variable(n, (8, x.size // 8), 6, (9, x.astype(f"{order}f8").tobytes())) for n, x in ((b"time", k), (b"q", np.concatenate([k % 7, 7 - k])))]
    motion = ksl.read_motion(leg, written(headed(b"".join([*numbers, variable(b"joint_names", (2, 5), 4, (kind, names))]), mark)))
    assert motion.q.tolist() == np.column_stack([k % 7, 7 - k]).tolist()
    none = ksl.read_motion(leg, written(headed(b"".join([*numbers, variable(b"joint_names", (2**31 - 1, 0), 4, (kind, b""))]), mark)))
    assert none.q.tolist() == motion.q.tolist(), "two billion names without a letter are none"
    assert "truncated or damaged" in refusal(leg, written(headed(b"".join([*numbers, variable(b"joint_names", (2, 6), 4, (kind, names))]), mark)))


@pytest.mark.parametrize("size", [4, 5])
def test_elements_that_say_they_are_small(leg, written, refusal, size):
    """They hold four bytes: more would be those of the next one."""
    k = np.arange(8)

    def variable(name, x, named=element):
        return element(14, element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<2i", 8, 1)) + named(1, name) + element(9, x.astype("f8").tobytes()))

    path = written(headed(variable(b"time", k) + variable(b"hip", k) + variable(b"slide", k) + variable(b"abcde"[:size], k, small)))
    said = refusal(leg, path)
    assert ("unknown column 'abcd'" in said) if size == 4 else ("truncated or damaged" in said)


def test_files_that_unpack_to_much_are_refused(leg, written, rows, refusal, monkeypatch):
    from ksl.base import limits

    monkeypatch.setattr(limits, "MOTION_BYTES", 1 << 20)
    packed = zlib.compress(array("q", np.zeros((1 << 20, 2))))
    assert len(packed) < 1 << 16
    assert ": unpacked it is larger than 1 MB, the most that is read" in refusal(
        leg, written(headed(array("time", rows[:, :1]) + struct.pack("<II", 15, len(packed)) + packed))
    )


def test_cells_that_hold_no_names(leg, mat, rows, refusal):
    path = mat(time=rows[:, :1], q=rows[:, 1:], joint_names=np.array(["hip", 1.0], dtype=object))
    assert refusal(leg, path) == ": joint_names holds double in a cell; expected the names of joints, texts"


def test_many_numbers_are_refused_before_they_are_loaded(leg, mat, rows, refusal, monkeypatch):
    from ksl.base import limits

    path = mat(time=rows[:, :1], q=rows[:, 1:])
    monkeypatch.setattr(limits, "MOTION_NUMBERS", 20)
    assert "30 numbers; at most 20 are read" in refusal(leg, path)
