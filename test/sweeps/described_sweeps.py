"""Sweeps of a Panda, for tests."""

from pathlib import Path

import numpy as np
import pytest

from ksl.sweeps.description import sweep_from
from ksl.sweeps.variants import Variants

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PANDA, PICK = str(EXAMPLES / "robots" / "panda.urdf"), str(EXAMPLES / "motions" / "panda_pick.csv")
TOOL = "panda_flange"
HERE = pytest.mark.usefixtures("sweeps_here")
PAYLOAD = {"kind": "payload", "link": TOOL, "center": [0.02, -0.03, 0.1], "values": [0, 1.5, 3]}
SPEED = {"kind": "speed", "values": [0.5, 1.0]}


def described(*vary, **head) -> dict:
    return {"sweep": head, "base": {"motion": PICK}, "vary": list(vary)}


def variants(*vary) -> Variants:
    return Variants(PANDA, sweep_from(described(*vary)))


def efforts(case) -> np.ndarray:
    model, motion = case
    return model.inverse_dynamics(motion.q, motion.v, motion.a)


def contents(folder: Path) -> dict[str, bytes]:
    return {f.name: f.read_bytes() for f in sorted((folder / "cases").iterdir())}


def many(steps: int = 8, partition: int = 4) -> dict:
    return described({**PAYLOAD, "values": [0.0, 0.5, 1.0, 1.5, 2.0]}, {"kind": "speed", "from": 0.5, "to": 1.2, "steps": steps}, partition=partition)
