"""Where a frame is off along motions: shares of joints, as a table and in a sentence."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ksl.base.csv_cells import csv_text
from ksl.load_cases.load_case import LoadCase
from ksl.mechanism.states import Array
from ksl.mechanism.stiffness import Stiffnesses, table_of
from ksl.small_motions.compliance import deflection

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
PARTS = ("motion", "bearing")
"""What gives way in a joint: along its motion, of gears and drives, and else, of bearings."""


@dataclass(frozen=True)
class Deflections:
    """The small displacements of a frame in load cases, in its axes, m and rad."""

    frame: str
    joints: tuple[str, ...]
    """The joints that have a share."""
    cases: tuple[str, ...]
    times: tuple[Array, ...]
    """(n) of each case, s."""
    shares: tuple[Array, ...]
    """(n, joints, 2, 6) of each case; the displacement is their sum."""

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes a CSV: case, time, x y z rx ry rz of the frame, and JOINT.motion.x … JOINT.bearing.rz, the shares; m and rad."""
        names = [f"{csv_text(joint)}.{part}.{component}" for joint in self.joints for part in PARTS for component in COMPONENTS]
        with open(Path(path), "w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["case", "time", *COMPONENTS, *names])
            for case, time, shares in zip(self.cases, self.times, self.shares):
                rows = np.column_stack([time, shares.sum(axis=(1, 2)), shares.reshape(len(time), -1)])
                table.writerows([csv_text(case), *map(repr, row)] for row in rows.tolist())

    def __str__(self) -> str:
        """The largest distance, when it is, and what has shares in it."""
        distances = [np.linalg.norm(shares.sum(axis=(1, 2))[:, :3], axis=1) for shares in self.shares]
        worst = int(np.argmax([d.max() for d in distances]))
        k = int(np.argmax(distances[worst]))
        off, most = self.shares[worst][k], float(distances[worst][k])
        total = off.sum(axis=(0, 1))[:3]
        parts = sorted(
            (
                (float(off[j, p, :3] @ total) / most**2 if most > 0 else 0.0, f"{joint} {part}")
                for j, joint in enumerate(self.joints)
                for p, part in enumerate(PARTS)
            ),
            reverse=True,
        )
        said = ", ".join(f"{name} {100 * share:.0f} %" for share, name in parts[:4] if share >= 0.01)
        of = f" of {self.cases[worst]}" if len(self.cases) > 1 else ""
        return f"{self.frame} is off by up to {1000 * most:.4g} mm, at {self.times[worst][k]:.6g} s{of}{f': {said}' if said else ''}"


def deflections(cases: Sequence[LoadCase], frame: str, stiffness: Stiffnesses | None = None) -> Deflections:
    """The displacement of a frame under the wrenches of load cases, by the joints that give way.

    stiffness: as of :meth:`Model.deflection`, or a TOML file.  Raises ValueError.  Each sample costs what :meth:`Model.deflection` does.

        off = deflections(run.cases, "tool0", "stiffness.toml")
    """
    given = table_of(cases[0].model, stiffness)
    found = [deflection(case.model, case.motion.q, case.motion.resolved_v, case.motion.resolved_a, frame, given, case.external, by="joint") for case in cases]
    has_share = np.any([shares.any(axis=(0, 2, 3)) for shares in found], axis=0)
    names = tuple(joint.name for joint, has in zip(cases[0].model.joints, has_share) if has)
    return Deflections(
        frame, names, tuple(case.name for case in cases), tuple(case.motion.time for case in cases), tuple(shares[:, has_share] for shares in found)
    )
