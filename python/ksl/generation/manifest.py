"""`library.json`: generated code as a library of PlatformIO.  No program here reads it; its keys are those of PlatformIO's documentation."""

from __future__ import annotations

import json


def manifest(name: str, version: str, description: str, contract: bool) -> str:
    """version: of KSL.  Without a filter PlatformIO compiles the self-test, too, whose main would meet that of the program."""
    build = {"srcDir": ".", "includeDir": ".", "srcFilter": f"+<{name}.c>", "flags": [] if contract else ["-ffp-contract=off"]}
    return (
        json.dumps(
            {"name": name, "version": version, "description": description, "frameworks": "*", "platforms": "*", "headers": f"{name}.h", "build": build},
            indent=2,
        )
        + "\n"
    )
