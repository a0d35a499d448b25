"""Files of load cases.  The files that they name are not read here: a text must not make the target read files of this machine."""

from guided import guide

guide("ksl.load_cases", "ksl.base.toml_files")

import ksl
import numpy as np
from ksl.base.errors import CaseError, MotionError
from ksl.load_cases import poses  # noqa: F401  is imported late, where it is needed
from ksl.load_cases.case_files import case_file
from ksl.motions.motion import Motion
from mutate import of_text
from target import finite, run

ROBOT = ksl.load_string(
    '<robot name="leg"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="hip" type="revolute"><parent link="a"/><child link="b"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>'
)
TIME = np.arange(8.0)
MOTION = Motion(TIME, 0.1 * TIME[:, None], np.full((8, 1), 0.1), np.zeros((8, 1)))


def no_motion(model: object, file: str, **options: object) -> Motion:
    if not file.endswith("m.csv"):
        raise MotionError(f"{file}: can't be read")
    return MOTION


def no_wrench(file: str) -> object:
    raise MotionError(f"{file}: can't be read")


case_file.read_motion, case_file._read_wrench = no_motion, no_wrench
case_file.input_file = lambda role, file: None


def read(data: bytes) -> None:
    for case in case_file.cases_of_text(ROBOT, data.decode("utf-8", "replace"), "cases.toml"):
        finite(case.motion.q, "positions")
        for wrench in case.external.values():
            finite(wrench, "wrenches")


if __name__ == "__main__":
    run(read, of_text, CaseError, MotionError)
