"""Without the packages of the extra `loads`: what needs one names it and the command that brings it; the rest works."""

import json
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"
BEGIN = """
import importlib.util, json, sys
import numpy as np
hidden = {{"pyarrow", "scipy", "plotly"}}
real = importlib.util.find_spec
importlib.util.find_spec = lambda name, *more: None if name in hidden else real(name, *more)
sys.modules.update(dict.fromkeys(hidden))
import ksl
from ksl.motions import generate
m = ksl.load("robots/ur5.urdf")
t, q = np.linspace(0, 1, 20), np.zeros((20, 6))
said = {{}}
for what, call in {calls!r}.items():
    try:
        said[what] = ""
        eval(call)
    except (ModuleNotFoundError, ksl.MotionError) as e:
        said[what] = str(e)
sys.stdout.write("\\n" + json.dumps(said))
"""
NEED = {
    "reading motions": 'ksl.read_motion(m, "motions/ur5_pick.csv")',
    "a run of a file": 'ksl.compute_loads(m, "motions/ur5_pick.csv")',
    "a table": "m.wrench_table(t, q, q, q)",
    "derivatives of a motion": "m.wrench_table(t, q)",
    "a summary": "ksl.hold(m).summary",
    "wrenches of a run": "ksl.hold(m).wrenches",
    "results": 'ksl.hold(m).write("{out}")',
    "a report": 'ksl.hold(m).report("{out}/report.html")',
    "the worst pose": 'ksl.hold(m, worst="elbow")',
    "free bodies of results": 'ksl.free_bodies("{out}")',
    "free bodies in few cases": '__import__("ksl.parts.hull").parts.hull.extremes(q[None])',
    "sizing": 'ksl.size("{out}")',
    "spectra": 'ksl.spectra("{out}")',
    "a sweep": 'ksl.sweep("robots/panda.urdf", "sweeps/panda_payload.toml", "{out}/sweep")',
    "a generated motion": "generate.minimum_jerk(m)",
    "a motion in Parquet": 'generate.write_motion(m, generate.trapezoid(m), "{out}/m.parquet")',
    "findings": 'ksl.check("robots/ur5.urdf").table',
}
NO_NEED = {
    "a pose": "ksl.hold(m).verdict",
    "a motion in CSV": 'generate.write_motion(m, generate.trapezoid(m), "{out}/m.csv")',
    "dynamics": "m.inverse_dynamics(q, q, q)",
}


def test_what_needs_an_extra_names_it(tmp_path):
    """In one process, since each of them would import the same."""
    calls = {what: call.format(out=tmp_path) for what, call in (NEED | NO_NEED).items()}
    done = subprocess.run([sys.executable, "-c", BEGIN.format(calls=calls)], capture_output=True, text=True, cwd=EXAMPLES)
    said = json.loads(done.stdout.rpartition("\n")[2])
    assert {what: "; install it with: pip install 'ksl[loads]'" in said[what] for what in NEED} == dict.fromkeys(NEED, True), said
    assert {what: said[what] for what in NO_NEED} == dict.fromkeys(NO_NEED, "")
