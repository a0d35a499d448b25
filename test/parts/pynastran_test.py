"""Nastran decks as pyNastran reads them and adds them up, in an environment of its own: it wants NumPy below 2.  Without a registry the test is left out."""

import json
import subprocess
import sys

import numpy as np
import pytest
from bricks import bar
from swinging_bar import MASS, RHO, SIZE, bar_cases

from ksl.parts.part_loads import DeckOptions
from ksl.parts.units import SYSTEMS, Material

pytestmark = pytest.mark.long

PROGRAM = """
import json, sys
import numpy as np
from pyNastran.bdf.bdf import read_bdf
from pyNastran.bdf.mesh_utils.loads import sum_forces_moments
from pyNastran.bdf.mesh_utils.mass_properties import mass_properties
said = []
for file in sys.argv[1:]:
    m = read_bdf(file, debug=None)
    force, moment = sum_forces_moments(m, np.zeros(3), 1, include_grav=True)
    said.append({"force": force.tolist(), "moment": moment.tolist(), "mass": mass_properties(m)[0], "nodes": len(m.nodes), "rigid": [e.type for e in m.rigid_elements.values()]})
print("\\n" + json.dumps(said))
"""


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """The Python of an environment with pyNastran."""
    folder = tmp_path_factory.mktemp("nastran")
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    done = subprocess.run([folder / "bin" / "pip", "install", "--quiet", "numpy<2", "pyNastran==1.4.1"], capture_output=True, text=True, timeout=600)
    if done.returncode:
        pytest.skip(f"pyNastran can't be installed: {done.stderr[-200:]}")
    return folder / "bin" / "python"


def test_what_pynastran_adds_up_is_the_opposite_of_the_centrifugal_force(python, tmp_path):
    """It leaves RFORCE out: of the bar, ω² m L/2 along the bar, about the origin without moment."""
    decks, wanted = [], []
    for units, coupling in (("m-kg-s", "distributing"), ("mm-t-s", "rigid")):
        length = SYSTEMS[units].length
        for kind in ("C3D10", "C3D20"):
            folder = tmp_path / f"{units}_{kind}"
            folder.mkdir()
            mesh = bar(folder / "bar.inp", kind, SIZE * length, (8, 2, 1))
            options = DeckOptions(units, Material(density=RHO), {"hinge": "root", "tip": "tip"}, coupling=coupling)
            bar_cases().write(folder, "nastran", {"bar": mesh}, options)
            decks.append(folder / "bar_nastran.bdf")
            wanted.append((MASS * SYSTEMS[units].mass, length, "RBE3" if coupling == "distributing" else "RBE2"))
    done = subprocess.run([python, "-c", PROGRAM, *decks], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    for found, (mass, length, element) in zip(json.loads(done.stdout.splitlines()[-1]), wanted, strict=True):
        np.testing.assert_allclose(found["mass"], mass, rtol=1e-9)
        np.testing.assert_allclose(found["force"], [-144 * MASS * SIZE[0] / 2, 0, 0], atol=1e-6)
        np.testing.assert_allclose(np.array(found["moment"]) / length, 0, atol=1e-7)
        assert found["rigid"] == [element] * 2
