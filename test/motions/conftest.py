from dataclasses import replace

import numpy as np
import pytest

import ksl
from growth import Name

INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
LEG = f"""<robot name="leg"><link name="a"/><link name="b"/><link name="c">{INERTIAL}</link>
<joint name="hip" type="revolute"><parent link="a"/><child link="b"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>
<joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>"""


@pytest.fixture
def leg(robot) -> ksl.Model:
    """A joint that turns, and one that slides."""
    return robot(LEG)


@pytest.fixture
def flying(robot) -> ksl.Model:
    return robot(f'<robot name="stone"><link name="stone">{INERTIAL}</link></robot>', floating_base=True)


@pytest.fixture
def written(tmp_path):
    """Writes text or bytes to a file and gives its path."""

    def write(content: str | bytes, name: str = "motion.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.fixture
def rows() -> np.ndarray:
    """Samples of `leg`: time, hip, slide, to be written with 6 digits without loss."""
    k = np.arange(10)
    return np.column_stack([0.1 * k, 0.5 + 0.01 * k**2, 0.5 - 0.02 * k]).round(6)


@pytest.fixture
def refusal():
    """The sentence with which a file is refused, from the file's name on."""
    from ksl.motions.reading import read_motion

    def said(model, path, **options) -> str:
        with pytest.raises(ksl.MotionError) as e:
            read_motion(model, path, **options)
        text = str(e.value)
        assert "\n" not in text
        name = "standard input" if str(path) == "-" else str(path)
        return text[text.index(name) + len(name) :] if name in text else text

    return said


@pytest.fixture
def counted_names(monkeypatch):
    """Names of the columns of CSV files are such that `work` counts their comparisons."""
    from ksl.motions.files import csv_table

    form_of = csv_table.form_of
    monkeypatch.setattr(csv_table, "form_of", lambda *given: replace(found := form_of(*given), names=[Name(n) for n in found.names]))
