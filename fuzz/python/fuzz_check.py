"""What `ksl check` reads of URDF and SDF texts, however broken: encodings, tags that are not closed, links, joints, numbers."""

from guided import guide

guide("ksl.checks")

from ksl.base.errors import DescriptionError
from ksl.base.printable import one_line
from ksl.checks import run as checks
from ksl.checks.description import read_sdf, read_urdf  # noqa: F401  are imported late
from mutate import of_xml
from target import check_message, finite, run


def read(data: bytes) -> None:
    robot = checks.robot_of_bytes(data)
    for note in (*robot.syntax, *robot.encoding, *robot.unreadable, *robot.repeated):
        check_message(one_line(note.found))
    for link in robot.links:
        if link.inertial is not None:
            finite([link.mass, *link.inertial.centroid], f"masses and centroids of {link.name}")
    for joint in robot.joints:
        finite([x for x in (joint.lower, joint.upper, joint.effort, joint.velocity) if x is not None], "limits")


if __name__ == "__main__":
    run(read, of_xml, DescriptionError)
