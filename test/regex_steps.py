"""Steps that a search by a regular expression takes: Python's `re` tells nobody how often it goes back.

A pattern is matched once more here, as `re` does it: the parts of a pattern one after the other, the longest repetition first, and back to
the last choice where nothing fits.  Each comparison of a character, and each choice, is a step.  `re` skips some of them, so steps that
grow linearly mean that its time does."""

from __future__ import annotations

import functools
import re
import sys
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

if sys.version_info >= (3, 11):
    from re import _compiler, _constants, _parser
else:
    import sre_compile as _compiler
    import sre_constants as _constants
    import sre_parse as _parser

Text = Any  # str or bytes
Instruction = tuple[str, Any, Any]


class Steps:
    """A pattern whose searches find what `re` finds, and count their steps in `taken`."""

    def __init__(self, pattern: re.Pattern[Any]) -> None:
        self.taken = 0
        parsed = _parser.parse(pattern.pattern, pattern.flags & ~re.DEBUG)
        self._state, self._flags = parsed.state, parsed.state.flags
        self._program = [*self._compiled(parsed), ("end", None, None)]

    def match(self, text: Text, at: int = 0) -> tuple[int, int] | None:
        """Where the match begins and ends; None if there is none."""
        end = self._end(self._program, text, at)
        return None if end is None else (at, end)

    def fullmatch(self, text: Text) -> tuple[int, int] | None:
        end = self._end(self._program, text, 0, whole=True)
        return None if end is None else (0, end)

    def search(self, text: Text, at: int = 0) -> tuple[int, int] | None:
        return next((found for start in range(at, len(text) + 1) if (found := self.match(text, start))), None)

    def _compiled(self, items: Any) -> list[Instruction]:
        """A program: "one" character that fits, "split" into a way to try first and another, "at" a place, "look" by a program of its own."""
        program: list[Instruction] = []
        for item in items:
            program += self._one(*item, item)
        return program

    def _one(self, op: Any, given: Any, item: Any) -> list[Instruction]:
        name = str(op)
        if name == "SUBPATTERN":
            return self._compiled(given[3])
        if name == "BRANCH":
            ways = [self._compiled(way) for way in given[1]]
            program = ways.pop()
            for way in reversed(ways):
                program = [("split", 1, len(way) + 2), *way, ("split", len(program) + 1, None), *program]
            return program
        if name in ("MAX_REPEAT", "MIN_REPEAT"):
            least, most, body = given
            part = self._compiled(body)
            if most is _constants.MAXREPEAT:
                assert body.getwidth()[0] > 0, "a repetition of what may be empty"
                rest = [("split", 1, len(part) + 2), *part, ("split", -len(part) - 1, None)]
            else:
                rest = []
                for _ in range(most - least):
                    rest = [("split", 1, len(part) + len(rest) + 1), *part, *rest]
            if name == "MIN_REPEAT":
                rest = [(kind, b, a) if kind == "split" and b is not None else (kind, a, b) for kind, a, b in rest]
            return part * least + rest
        if name in ("ASSERT", "ASSERT_NOT"):
            assert given[0] == 1, "only what follows can be looked at"
            return [("look", [*self._compiled(given[1]), ("end", None, None)], name == "ASSERT")]
        alone = _compiler.compile(_parser.SubPattern(self._state, [item]), self._flags)
        return [("at", alone, None)] if name == "AT" else [("one", _fits(alone), None)]

    def _end(self, program: list[Instruction], text: Text, at: int, whole: bool = False) -> int | None:
        waiting = [(0, at)]
        while waiting:
            k, at = waiting.pop()
            while True:
                self.taken += 1
                kind, a, b = program[k]
                if kind == "end":
                    if not whole or at == len(text):
                        return at
                    break
                if kind == "split":
                    if b is not None:
                        waiting.append((k + b, at))
                    k += a
                elif kind == "one":
                    if at == len(text) or not a(text[at : at + 1]):
                        break
                    k, at = k + 1, at + 1
                elif (a.match(text, at) is not None) if kind == "at" else ((self._end(a, text, at) is not None) == b):
                    k += 1
                else:
                    break
        return None


def _fits(alone: re.Pattern[Any]) -> Callable[[Text], bool]:
    known: dict[Text, bool] = {}

    def fits(character: Text) -> bool:
        if character not in known:
            known[character] = alone.fullmatch(character) is not None
        return known[character]

    return fits


_steps = functools.cache(Steps)


class Counted:
    """Stands in for a pattern, or for the module `re`: it does what they do, and counts the steps of its searches in `taken`."""

    def __init__(self, pattern: re.Pattern[Any] | None = None) -> None:
        self._pattern, self.taken = pattern, 0

    def __getattr__(self, name: str) -> Any:
        if name in ("split", "findall", "subn"):
            raise NotImplementedError(f"{name} is not counted yet")
        return getattr(self._pattern or re, name)

    def match(self, *given: Any) -> re.Match[Any] | None:
        return self._one("match", *given)

    def search(self, *given: Any) -> re.Match[Any] | None:
        return self._one("search", *given)

    def fullmatch(self, *given: Any) -> re.Match[Any] | None:
        return self._one("fullmatch", *given)

    def finditer(self, *given: Any) -> Iterator[re.Match[Any]]:
        pattern, text, *more = self._with_pattern(given)
        self._all(pattern, text)
        return pattern.finditer(text, *more)

    def sub(self, *given: Any) -> Any:
        pattern, replacement, text, *more = self._with_pattern(given)
        self._all(pattern, text)
        return pattern.sub(replacement, text, *more)

    def _with_pattern(self, given: tuple[Any, ...]) -> tuple[Any, ...]:
        return (re.compile(given[0]), *given[1:]) if self._pattern is None else (self._pattern, *given)

    def _all(self, pattern: re.Pattern[Any], text: Text) -> None:
        steps, at = _steps(pattern), 0
        before = steps.taken
        while at <= len(text) and (found := steps.search(text, at)):
            at = max(found[1], found[0] + 1)
        self.taken += steps.taken - before

    def _one(self, how: str, *given: Any) -> Any:
        pattern, (text, *more) = self._pattern, given
        if pattern is None:  # re.match(pattern, text, flags)
            pattern, text, more = re.compile(given[0], *given[2:]), given[1], []
        steps = _steps(pattern)
        before = steps.taken
        found, again = getattr(pattern, how)(text, *more), getattr(steps, how)(text, *more)
        self.taken += steps.taken - before
        assert (None if found is None else found.span()) == again, pattern.pattern
        return found


def count_patterns(monkeypatch: Any, *modules: ModuleType) -> Callable[[], int]:
    """Counts the steps of all patterns of these modules from now on: the function that is returned says how many there were."""
    stand_ins = []
    for module in modules:
        for name, value in list(vars(module).items()):
            if value is re or isinstance(value, re.Pattern):
                stand_ins.append(Counted(None if value is re else value))
                monkeypatch.setattr(module, name, stand_ins[-1])
    assert stand_ins
    return lambda: sum(each.taken for each in stand_ins)
