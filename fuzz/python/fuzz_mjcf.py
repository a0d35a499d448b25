"""MJCF texts: what KSL makes of the model that MuJoCo's compiler makes, and of what it says.

MuJoCo is a program of others, without coverage.  Texts that name files, or ask for many elements or large images by a few
words, are left out: the first would be read, and the second take the memory that they ask for."""

from guided import guide

guide("ksl.robot_files.load_mjcf", "ksl.robot_files.mjcf_states", "ksl.model.builder", "ksl.mechanism.given", "ksl.robot_files.loading")

import re
from zlib import crc32

from ksl.base.errors import DescriptionError
from ksl.robot_files import load_mjcf, mjcf_states  # noqa: F401  load_mjcf is imported late
from ksl.robot_files import loading
from ksl.robot_files.read_options import ReadOptions
from mutate import of_xml
from target import BrokenPromise, check_message, finite, run

LEFT_OUT = re.compile(rb"file|dir|include|plugin|mesh|skin|texture|hfield|replicate|composite|flex|size\s*=[^>]*\d{4}|n(user|key)|memory|numeric|tuple")


def read(data: bytes) -> None:
    if LEFT_OUT.search(data):
        return
    bits = crc32(data)  # options follow from the text itself, so that each text always takes the same way
    options = ReadOptions(floating_base=bits % 8 == 0, mimic="independent" if bits & 8 else "coupled", strict=bits & 48 == 0, masses="optional")
    if loading.root_element(data) != "mujoco":
        return
    model = loading._loaded("robot.xml", data, options)
    for line in [*model.warnings, *model.unused]:
        check_message(line)
    for names in (model.link_names, model.joint_names):
        if len(set(names)) < len(names) or not all(names):
            raise BrokenPromise(f"broken promise: names of {len(names)} links or joints are not unique")
    finite([link.mass for link in model.links], "masses")
    neutral = model.neutral()
    there = mjcf_states.to_mujoco(model, neutral)
    finite(there.q, "positions")
    if abs(mjcf_states.from_mujoco(model, there.q).q - neutral).max(initial=0.0) > 1e-9:
        raise BrokenPromise("broken promise: positions in MuJoCo's layout come back as others")


if __name__ == "__main__":
    run(read, of_xml, DescriptionError)
