"""Errors and warnings, and the sentence about a name that is unknown."""

from __future__ import annotations

from collections.abc import Iterable


class DescriptionError(ValueError):
    """A robot file can't be read or describes no mechanism.  Names file, line, link or joint, what is wrong and how to mend it."""


class ResultError(ValueError):
    """Finite arguments have a result that is not finite: numbers are too large for the precision, or a joint moves no mass at this
    position.  Names the joint, or the first such number, and the state."""


class MotionError(ValueError):
    """A motion can't be used.  Names the file, the line or column, what is wrong and how to mend it."""


class SizingError(ValueError):
    """Results or components can't be used for sizing.  Names the file, the line or joint, what is wrong and how to mend it."""


class SweepError(ValueError):
    """A sweep can't be run.  Names its file and key, what is wrong and how to mend it."""


class CaseError(ValueError):
    """A file of load cases can't be used.  Names the file, the case, the key, what is wrong and how to mend it."""


class ViewerError(ValueError):
    """A viewer can't be started, or its file can't be written.  Says what is missing or wrong, and how to mend it."""


class DescriptionWarning(UserWarning):
    """Suspicious content of a robot file that is used all the same: an impossible inertia, a moving link without mass, a guessed encoding."""


class QuaternionWarning(UserWarning):
    """A quaternion of a position differs from unit length by more than 1e-6, but by no more than 1e-2, and was normalised."""


class FrameError(ValueError):
    """Two spatial values whose frames don't match.  Names the operation and both frames."""


def near_names(name: object, known: Iterable[str]) -> str:
    """"did you mean 'a' or 'b'? ", or nothing."""
    from difflib import get_close_matches

    near = get_close_matches(name, list(known), 3, 0.7) if isinstance(name, str) else []
    return f"did you mean {' or '.join(map(repr, near))}? " if near else ""


def unknown_name(where: str, what: str, name: object, known: Iterable[str]) -> str:
    """Says that there is no link, joint … of this name, which ones are near, and which ones there are."""
    names = list(known)
    return f"{where}: no {what} named {name!r}; {near_names(name, names)}known: {', '.join(names)}"
