"""The example of torque control, on this machine: its commands generate what it includes, and it notices the contact alone."""

import re
import sys
from pathlib import Path

from generated_code import FLAGS, run

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/embedded"))
from torque_control import EXAMPLE, generated


def test_the_controller_notices_a_contact_and_its_size(tmp_path):
    sources = generated(tmp_path)
    run("gcc", *FLAGS, *(f"-I{source.parent}" for source in sources), *sorted(EXAMPLE.glob("*.c")), *sources, "-lm", "-o", "example", cwd=tmp_path)
    printed = run(tmp_path / "example", cwd=tmp_path)
    contact, noticed = map(int, re.findall(r"\d+", printed.splitlines()[0]))
    assert contact < noticed <= contact + 10
    efforts = [tuple(map(float, re.findall(r"(-?[\d.]+) N m", line))) for line in printed.splitlines()[1:]]
    assert len(efforts) == 6 and max(abs(there) for _, there in efforts) > 20
    assert all(abs(residual - there) < 0.05 * 25 for residual, there in efforts)  # a filter lags behind by 10 ms
