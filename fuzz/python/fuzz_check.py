"""`ksl check` of URDF and SDF texts, all rules, without the loader, which has targets of its own, and of MJCF up to MuJoCo's compiler."""

import atheris

with atheris.instrument_imports(include=["ksl.checks"]):
    from ksl.checks import run as checks

from target import check_message, run

from ksl.errors import DescriptionError


def read(data: bytes) -> None:
    for finding in checks.findings_of_bytes(data, "robot.urdf"):
        check_message(" ".join(finding.rule.split()))


if __name__ == "__main__":
    run(read, DescriptionError)
