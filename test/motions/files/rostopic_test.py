"""What `rostopic echo -p` prints: joints by their names in the rows, and a map that names columns as they stand in the file."""

import numpy as np
import pytest

import ksl

MS, START = 1_000_000, 1_760_000_000_000_000_000
HEAD = "%time,field.header.stamp,field.name0,field.name1,field.position0,field.position1,field.velocity0,field.velocity1"


@pytest.fixture
def printed(written):
    def write(names=lambda k: "j1,j2"):
        t = [10 * k * MS for k in range(12)]
        rows = [f"{START + x},{START + x},{names(k)},{0.1 * k},{0.2 * k},10.0,20.0" for k, x in enumerate(t)]
        return written("\n".join([HEAD, *rows]) + "\n")

    return write


@pytest.mark.parametrize("time", [{}, {"%time": "time"}, {"field.header.stamp": {"to": "time", "unit": "ns"}}])
@pytest.mark.parametrize("names", [("j1", "j2"), ("field.position0", "field.position1"), ("field.position0", "j2")])
def test_a_map_names_joints_or_columns(leg, printed, names, time):
    motion = ksl.read_motion(leg, printed(), map={names[0]: "slide", names[1]: {"to": "hip", "sign": -1}} | time)
    np.testing.assert_allclose(motion.time, 0.01 * np.arange(12), atol=1e-12)
    np.testing.assert_allclose(motion.q, np.outer(np.arange(12), (-0.2, 0.1)), atol=1e-12)
    np.testing.assert_allclose(motion.v, np.outer(np.ones(12), (-20.0, 10.0)))


def test_names_that_change_from_row_to_row(leg, printed, refusal):
    file = printed(lambda k: "j1,j2" if k < 6 else "j2,j1")
    with pytest.raises(ksl.MotionError, match="'field.position0' of .* holds several joints, whose names change from row to row"):
        ksl.read_motion(leg, file, map={"field.position0": "slide"})


@pytest.mark.parametrize("head, name", [("%time,hip,slide", "%time"), ("time, x ,slide", " x "), ("time,'=x,slide", "'=x")])
def test_names_as_they_stand_in_a_table(leg, written, rows, head, name):
    """Readers take a comment's mark, blanks and the apostrophe of spreadsheets off."""
    file = written(head + "\n" + "".join(f"{t},{x},{y}\n" for t, x, y in rows.tolist()))
    motion = ksl.read_motion(leg, file, map={name: "time" if name == "%time" else "hip"})
    np.testing.assert_array_equal(motion.q, rows[:, 1:])
