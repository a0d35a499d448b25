"""Errors and warnings, and the sentence about a name that is unknown."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from itertools import islice
from typing import Any, TypeVar

from ksl.base.limits import NEAR_NAMES
from ksl.base.printable import sentence


class _Sentence(Exception):
    """An error or a warning with one line of text, which can be printed on any terminal whatever names it holds."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(sentence(a) if isinstance(a, str) else a for a in arguments))

    argument: str = ""
    """The argument of a call that the sentence begins with; the commands say the option instead."""
    shown: str = ""
    """The argument's value, as Python shows it; "" where the sentence names the argument alone."""
    rest: str = ""
    """The sentence behind them."""


E = TypeVar("E", bound=_Sentence)


def of_argument(error: type[E], argument: str, rest: str, *value: object) -> E:
    """An error about an argument, as `axes='tip': no such link`, or without a value as `joints: no joint named …`."""
    shown = repr(value[0]) if value else ""
    made = error(f"{argument}={shown}{rest}" if value else f"{argument}{rest}")
    made.argument, made.shown, made.rest = argument, shown, sentence(rest)
    return made


class ArgumentError(_Sentence, ValueError):
    """An argument of a call is none of those that are possible.  Names it, its value, and what is expected."""


class DescriptionError(_Sentence, ValueError):
    """A robot file can't be read or describes no mechanism.  Names file, line, link or joint, what is wrong and how to mend it."""


class ResultError(_Sentence, ValueError):
    """Finite arguments have a result that is not finite: numbers are too large or too small for the precision, or a joint moves no mass at this
    position.  Names the joint, or the first such number, and the state of a batch."""

    state: int = 0
    """The state's number in the batch; 0 where there is one state."""


class MotionError(_Sentence, ValueError):
    """A motion can't be used.  Names the file, the line or column, what is wrong and how to mend it."""


class SizingError(_Sentence, ValueError):
    """Results or components can't be used for sizing.  Names the file, the line or joint, what is wrong and how to mend it."""


class SweepError(_Sentence, ValueError):
    """A sweep can't be run.  Names its file and key, what is wrong and how to mend it."""


class CaseError(_Sentence, ValueError):
    """A file of load cases can't be used.  Names the file, the case, the key, what is wrong and how to mend it."""


class PartError(_Sentence, ValueError):
    """The mesh of a part, or what is asked of its deck, can't be used.  Names the file, the link or joint, what is wrong and how to mend it."""


class CompilerError(_Sentence, ValueError):
    """Code of a mechanism can't be compiled or loaded: there is no compiler, it fails, or the cache isn't the user's own.  Says what to do about it."""


class ViewerError(_Sentence, ValueError):
    """A viewer can't be started, or its file can't be written.  Says what is missing or wrong, and how to mend it."""


class DescriptionWarning(_Sentence, UserWarning):
    """Suspicious content of a robot file that is used all the same: an impossible inertia, a moving link without mass, a guessed encoding."""


class QuaternionWarning(_Sentence, UserWarning):
    """A quaternion of a position differs from unit length by more than 1e-6, but by no more than 1e-2, and was normalised."""


class FrameError(_Sentence, ValueError):
    """Two spatial values whose frames don't match.  Names the operation and both frames."""


def close_names(name: object, known: Iterable[str], count: int = 3, cutoff: float = 0.6) -> list[str]:
    """Names that are near, best first.  Only those of about the same length are compared, and of very many only the first ones."""
    from difflib import get_close_matches

    if not isinstance(name, str) or not 0 < len(name) <= 200:
        return []
    slack = len(name) * (2 / cutoff - 1)  # a ratio 2 m / (a + b) with m ≤ min(a, b): others can't reach the cutoff
    able = (k for k in known if len(name) * cutoff / (2 - cutoff) <= len(k) <= slack)
    return get_close_matches(name, list(islice(able, NEAR_NAMES)), count, cutoff)


def near_names(name: object, known: Iterable[str]) -> str:
    """ "did you mean 'a' or 'b'? ", or nothing."""
    near = close_names(name, known, 3, 0.7)
    return f"did you mean {' or '.join(map(repr, near))}? " if near else ""


def name_among(known: Collection[str], name: Any, what: str) -> Any:
    """The known name that is meant: also with `joint:` or `link:`, which is what, before it; what isn't known stays as it is."""
    if not isinstance(name, str) or name in known:
        return name
    bare = name.removeprefix(f"{what}:")
    return bare if bare in known else name


def other_kind(where: str, what: str, name: object, found: str, other: str) -> str:
    """Says that a link has the name where a joint is meant, or the other way round, and which joint carries it, or which link it carries."""
    said = f"it is a link, which joint {other!r} carries" if found == "link" else f"it is a joint, which carries link {other!r}"
    return sentence(f"{where}: no {what} named {name!r}; {said}")


def unknown_name(where: str, what: str, name: object, known: Iterable[str]) -> str:
    """Says that there is no link, joint … of this name, which ones are near, and which ones there are."""
    names = list(known)
    return sentence(f"{where}: no {what} named {name!r}; {near_names(name, names)}known: {', '.join(names)}")
