"""MuJoCo's compiler: in this process, or in one of its own, which ends when it is told to and is alone when memory runs out."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from typing import Any

from ksl.base import own_process

COMPILE = """
import mujoco
said = []
mujoco.set_mju_user_warning(said.append)
try:
    if given["text"] is None:
        compiled = mujoco.MjModel.from_xml_path(given["file"])
    else:
        compiled = mujoco.MjModel.from_xml_string(given["text"])
    mujoco.mj_saveModel(compiled, given["to"], None)
    say(said=said)
except (ValueError, mujoco.FatalError) as e:
    say(said=said, refused=str(e))
except (MemoryError, RuntimeError) as e:
    say(said=said, refused=str(e), short=isinstance(e, MemoryError))
"""
NO_MEMORY = "there is not enough memory for it"


class Refused(Exception):
    """What the compiler says of a file that it doesn't take."""


def compiled(file: str, text: str | None, say: Callable[[str], None]) -> Any:
    """The `mujoco.MjModel` of a file, or of a text.  say: takes its warnings.  Raises :class:`Refused`."""
    if own_process.is_wanted():
        return _compiled_apart(file, text, say)
    import mujoco

    _forget_meshes(mujoco)
    handler = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(say)  # instead of a log file in the current folder
    try:
        return mujoco.MjModel.from_xml_path(file) if text is None else mujoco.MjModel.from_xml_string(text)
    except (ValueError, mujoco.FatalError) as e:
        raise Refused(str(e)) from None
    except (MemoryError, RuntimeError) as e:
        raise Refused(_why(str(e), isinstance(e, MemoryError))) from None
    finally:
        mujoco.set_mju_user_warning(handler)


def _compiled_apart(file: str, text: str | None, say: Callable[[str], None]) -> Any:
    def load() -> None:
        import mujoco  # noqa: F401 - while the other process does so, too

    with tempfile.TemporaryDirectory() as folder:
        to = os.path.join(folder, "model.mjb")
        try:
            made = own_process.run(COMPILE, {"file": file, "text": text, "to": to}, meanwhile=load)
        except own_process.Ended as e:
            raise Refused(str(e)) from None
        for line in (*made["said"], *filter(None, map(str.strip, made["printed"].splitlines()))):
            say(line)
        if "refused" in made:
            raise Refused(_why(made["refused"], made.get("short", False)))
        import mujoco

        try:
            return mujoco.MjModel.from_binary_path(to)
        except (ValueError, mujoco.FatalError) as e:
            raise Refused(str(e)) from None
        except (MemoryError, RuntimeError) as e:
            raise Refused(_why(str(e), isinstance(e, MemoryError))) from None


def _why(said: str, short: bool) -> str:
    """MuJoCo's own words, or that memory is short: its bindings call an allocation that fails an unknown exception."""
    return NO_MEMORY if short or "unknown exception" in said or "bad_alloc" in said else said or "it says nothing more"


def _forget_meshes(mujoco: Any) -> None:
    """MuJoCo keeps meshes by the names of their files and times of change in whole seconds: one that was replaced a moment ago would be the old one."""
    if hasattr(mujoco, "mj_clearCache") and hasattr(mujoco, "mj_getCache"):
        mujoco.mj_clearCache(mujoco.mj_getCache())
