"""Declarations of rules.  A rule says all about itself that the documentation and a finding say.

A new rule is a function of a `…_rules.py` with a declaration above it, and a file that breaks it in `CASES` of test/checks/rules_test.py.
`scripts/check_page.py` writes it into docs/check.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Literal

from ksl.checks.description.findings import Finding, Repair, Severity

if TYPE_CHECKING:
    from ksl.checks.description.robot import RobotFile


@dataclass(frozen=True)
class Broken:
    """One place where a rule is broken; what is None is as the rule declares it."""

    found: str
    line: int | None = None
    kind: Literal["link", "joint", ""] = ""
    name: str = ""
    value: float | None = None
    cause: str | None = None
    repair: str | None = None
    severity: Severity | None = None
    fix: Repair | None = None
    guess: Repair | None = None
    """The repair if the likely cause is right, which `--accept` confirms."""


Check = Callable[["RobotFile"], Iterable[Broken]]


@dataclass(frozen=True)
class Rule:
    """A rule, as it is declared above the function that looks for what breaks it."""

    name: str
    severity: Severity
    condition: str
    cause: str
    repair: str
    fix: str
    """What `--fix` does about it; empty where it does nothing."""
    accept: str
    """What `--fix` does about it if `--accept` names the rule; empty where that changes nothing."""
    formats: tuple[str, ...]
    whole: bool
    """Whether it needs the whole file: in one that was cut short everything is missing that stood behind."""
    check: Check

    def findings(self, robot: RobotFile) -> Iterator[Finding]:
        for b in self.check(robot):
            yield Finding(
                self.name,
                b.severity or self.severity,
                str(robot.path),
                b.line,
                b.kind,
                clipped(b.name),
                clipped(b.found, 600),
                self.condition,
                b.cause or self.cause,
                b.repair or self.repair,
                b.value if b.value is None or math.isfinite(b.value) else None,  # JSON has no infinite numbers
                b.fix is not None,
                b.fix is None and b.guess is not None,
                b.fix or b.guess,
            )


def clipped(text: str, length: int = 200) -> str:
    """On one line, and not longer than that: files from strangers may have names of megabytes."""
    text = " ".join(text.split()) if "\n" in text else text
    return text if len(text) <= length else text[:length] + "…"


def rule(
    name: str,
    severity: Severity,
    *,
    condition: str,
    cause: str,
    repair: str,
    fix: str = "",
    accept: str = "",
    formats: tuple[str, ...] = ("urdf", "sdf", "mjcf"),
    whole: bool = False,
) -> Callable[[Check], Rule]:
    """Makes a rule of the function below: a generator of :class:`Broken` over a robot file."""
    return lambda check: Rule(name, severity, condition, cause, repair, fix, accept, formats, whole, check)


def rules_of(module: ModuleType) -> list[Rule]:
    """The rules that a module declares, in their order there, which is that of findings and of the documentation; not those that it imports."""
    return [x for x in vars(module).values() if isinstance(x, Rule) and x.check.__module__ == module.__name__]
