"""`library.json`: generated code as a library of PlatformIO.  No program here reads it; keys, kinds of values and lengths are those of its schema
(platformio-core, platformio/assets/schema/library.json, and what `pio pkg pack` judges by, platformio/package/manifest/schema.py)."""

from __future__ import annotations

import json


DESCRIPTION = 255
"""Characters of a description at most; those of a name are 50, of which checked_prefix takes 31."""


def manifest(name: str, version: str, description: str, contract: bool) -> str:
    """version: of KSL.  Without a filter PlatformIO compiles the self-test, too, whose main would meet that of the program."""
    build = {"srcDir": ".", "includeDir": ".", "srcFilter": f"+<{name}.c>", "flags": [] if contract else ["-ffp-contract=off"]}
    return (
        json.dumps(
            {
                "name": name,
                "version": version,
                "description": description[:DESCRIPTION],
                "frameworks": "*",
                "platforms": "*",
                "headers": f"{name}.h",
                "build": build,
            },
            indent=2,
        )
        + "\n"
    )
