"""Steps that a search by a regular expression takes: Python's `re` tells nobody how often it goes back.

A pattern is matched once more here, as `re` does it: the parts of a pattern one after the other, the longest repetition first, and back to
the last choice where nothing fits.  Each comparison of a character, and each choice, is a step.  `re` skips some of them, so steps that
grow linearly mean that its time does."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
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
    """A pattern that counts: `found` is what `re` finds, to be compared with, and `taken` the steps so far."""

    def __init__(self, pattern: re.Pattern[Any]) -> None:
        self.taken = 0
        parsed = _parser.parse(pattern.pattern, pattern.flags & ~re.DEBUG)
        self._state, self._flags = parsed.state, parsed.state.flags
        self._program = [*self._compiled(parsed), ("end", None, None)]

    def match(self, text: Text, at: int = 0) -> int | None:
        """Where the match ends that begins at a place; None if there is none."""
        return self._end(self._program, text, at)

    def search(self, text: Text, at: int = 0) -> tuple[int, int] | None:
        for start in range(at, len(text) + 1):
            end = self.match(text, start)
            if end is not None:
                return start, end
        return None

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

    def _end(self, program: list[Instruction], text: Text, at: int) -> int | None:
        waiting = [(0, at)]
        while waiting:
            k, at = waiting.pop()
            while True:
                self.taken += 1
                kind, a, b = program[k]
                if kind == "end":
                    return at
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


class Counted:
    """Stands in for a pattern, or for the module `re`: it does what they do, and counts the steps of all its searches in `taken`."""

    def __init__(self, pattern: re.Pattern[Any] | None = None) -> None:
        self._pattern, self.taken = pattern, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(re if self._pattern is None else self._pattern, name)

    def compile(self, *given: Any) -> re.Pattern[Any]:
        return re.compile(*given)

    def match(self, *given: Any) -> re.Match[Any] | None:
        return self._counted("match", given)

    def search(self, *given: Any) -> re.Match[Any] | None:
        return self._counted("search", given)

    def sub(self, replacement: Any, text: Text) -> Text:
        assert self._pattern is not None
        steps, at = Steps(self._pattern), 0
        while at <= len(text) and (found := steps.search(text, at)):
            at = max(found[1], found[0] + 1)
        self.taken += steps.taken
        return self._pattern.sub(replacement, text)

    def _counted(self, how: str, given: tuple[Any, ...]) -> Any:
        pattern = self._pattern
        if pattern is None:
            pattern, given = re.compile(given[0], *given[2:]), given[1:2]
        steps = Steps(pattern)
        found, again = getattr(pattern, how)(*given), getattr(steps, how)(*given)
        self.taken += steps.taken
        assert (None if found is None else found.end() if how == "match" else found.span()) == again, pattern.pattern
        return found
