"""Where in a user's program a call of KSL stands, for warnings that are found deep inside."""

from __future__ import annotations

import os
import sys

_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__))) + os.sep


def called_from() -> tuple[str, int]:
    """The function of KSL that a program called, and the `stacklevel` with which the caller of this function warns there."""
    frame, level, method = sys._getframe(1), 1, ""
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        method, frame, level = frame.f_code.co_name, frame.f_back, level + 1
    return method, level
