"""TOML files that people write: read, or refused with a sentence."""

from __future__ import annotations

import os
import sys
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def read_toml(path: str | os.PathLike[str], error: type[ValueError], what: str) -> dict[str, Any]:
    """The tables of a TOML file.  Raises `error` for a file that can't be read; what: what it should hold, in words."""
    file = os.fspath(path)
    try:
        with open(file, encoding="utf-8-sig", newline="") as text:  # editors on Windows put a byte-order mark first
            return tomllib.loads(text.read().replace("\r\n", "\n"))
    except OSError as e:
        raise error(f"{file}: can't be read ({os.strerror(e.errno) if e.errno else e}); give a TOML file that describes {what}") from None
    except UnicodeDecodeError:
        raise error(f"{file}: is not text; give a TOML file that describes {what}") from None
    except tomllib.TOMLDecodeError as e:
        raise error(f"{file}: is not TOML: {e}") from None
