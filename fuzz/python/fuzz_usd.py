"""USD as text: bodies, joints, masses and units of a stage.

Pixar's library is a program of others, without coverage.  Texts that name other files, or ask for many elements by a few words, are left out."""

from guided import guide

guide(
    "ksl.robot_files.usd.load_usd",
    "ksl.robot_files.usd.machine",
    "ksl.robot_files.usd.amounts",
    "ksl.robot_files.usd.stage",
    "ksl.robot_files.usd.masses",
    "ksl.robot_files.usd.shapes",
    "ksl.robot_files.usd.joints",
    "ksl.robot_files.usd.couplings",
    "ksl.robot_files.usd.unused",
    "ksl.robot_files.assembly",
    "ksl.model.builder",
    "ksl.robot_files.loading",
)

import atexit
import os
import re
import tempfile
from pathlib import Path
from zlib import crc32

from ksl.base.errors import DescriptionError
from ksl.robot_files import loading
from ksl.robot_files.read_options import ReadOptions
from mutate import of_text
from target import BrokenPromise, check_message, finite, run

LEFT_OUT = re.compile(rb"@|references|payload|subLayers|inherits|specializes|variant|instance|clips|timeSamples|#usda.*\n.*#sdf")
FILE = Path(tempfile.gettempdir()) / f"ksl_fuzz_{os.getpid()}.usda"
atexit.register(lambda: FILE.unlink(missing_ok=True))


def read(data: bytes) -> None:
    if not data.startswith(b"#usda") or LEFT_OUT.search(data):
        return
    FILE.write_bytes(data)
    bits = crc32(data)  # options follow from the text itself, so that each text always takes the same way
    options = ReadOptions(floating_base=bits % 8 == 0, strict=bits & 48 == 0, masses="optional", loops="cut" if bits & 8 else None)
    model = loading._loaded(str(FILE), None, options)
    for line in [*model.warnings, *model.unused]:
        check_message(line)
    for names in (model.link_names, [*model.joint_names, *model.loop_names]):
        if len(set(names)) < len(names) or not all(names):
            raise BrokenPromise(f"broken promise: names of {len(names)} links or joints are not unique")
    finite([link.mass for link in model.links], "masses")


if __name__ == "__main__":
    run(read, of_text, DescriptionError)
