"""What a check of a robot file found: findings, and the list of them."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

from ksl.base.extras import require

if TYPE_CHECKING:
    import pyarrow as pa

Severity = Literal["error", "warning", "note"]

Repair = Callable[[], str]
"""Changes the XML tree that the file was read into, and says what it changed."""

STATUS = {"error": 2, "warning": 1, "note": 0}
"""Exit status of `ksl check`, for the most severe finding; the most severe ones first."""


@dataclass(frozen=True)
class Finding:
    """One place of a robot file that breaks a rule."""

    rule: str
    """Name of the rule, which `ignore` takes: `inertia-triangle`."""
    severity: Severity
    """`error`: numbers would be wrong, or readers refuse the file.  `warning`: suspicious, or some readers differ.  `note`: nothing
    is wrong, but who uses the file should know it."""
    file: str
    line: int | None
    """Line of the element in the file, from 1; None where it is not known."""
    kind: Literal["link", "joint", ""]
    """What `name` is; empty where the finding is about the file."""
    name: str
    found: str
    """What stands in the file, with numbers and units."""
    condition: str
    """What the rule demands."""
    cause: str
    """How this usually comes about."""
    repair: str
    """What to do about it."""
    value: float | None = None
    """The number that breaks the condition, in SI units; None where there is not exactly one."""
    fixable: bool = False
    """Whether `--fix` repairs it."""
    acceptable: bool = False
    """Whether `--fix` repairs it where `--accept` names the rule: the likely cause must be confirmed by a person."""
    _fix: Repair | None = field(default=None, repr=False, compare=False)

    @property
    def place(self) -> str:
        """`arm.urdf:12: link forearm`, of what is known."""
        where = self.file if self.line is None else f"{self.file}:{self.line}"
        return f"{where}: {self.kind} {self.name}" if self.name else where

    def __str__(self) -> str:
        return f"{self.place}: {self.severity}: {self.found} ({self.rule}). {self.repair}"

    def as_dict(self) -> dict[str, Any]:
        """The fields as plain values, for JSON."""
        return {k: v for k, v in asdict(self).items() if not k.startswith("_")}


def mend(finding: Finding, accepted: Collection[str]) -> str | None:
    """Repairs what was found, if that is safe or its rule is accepted: what was changed, or None."""
    if finding._fix is None or not (finding.fixable or finding.rule in accepted):
        return None
    return finding._fix()


class Findings(Sequence[Finding]):
    """The findings of one file, errors first, then by line."""

    def __init__(self, file: str, findings: Sequence[Finding], not_checked: Sequence[str] = (), ignored: Sequence[str] = ()) -> None:
        self.file = file
        self.not_checked = tuple(not_checked)
        """What no rule looked at in this file, one sentence each."""
        self.ignored = tuple(ignored)
        """Rules that were left out on request."""
        self._all = sorted(findings, key=lambda f: (-STATUS[f.severity], f.line or 0))

    @overload
    def __getitem__(self, index: int) -> Finding: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Finding]: ...

    def __getitem__(self, index: int | slice) -> Finding | Sequence[Finding]:
        return self._all[index]

    def __len__(self) -> int:
        return len(self._all)

    def __iter__(self) -> Iterator[Finding]:
        return iter(self._all)

    @property
    def errors(self) -> list[Finding]:
        return [f for f in self._all if f.severity == "error"]

    @property
    def warnings(self) -> list[Finding]:
        return [f for f in self._all if f.severity == "warning"]

    @property
    def notes(self) -> list[Finding]:
        return [f for f in self._all if f.severity == "note"]

    @property
    def status(self) -> int:
        """Exit status of `ksl check`: 0 clean or notes alone, 1 warnings, 2 errors."""
        return max((STATUS[f.severity] for f in self._all), default=0)

    @property
    def rules(self) -> dict[str, int]:
        """{rule: how many findings}, of the rules that were broken."""
        counts: dict[str, int] = {}
        for f in self._all:
            counts[f.rule] = counts.get(f.rule, 0) + 1
        return counts

    @property
    def summary(self) -> str:
        """`2 errors, 1 warning`, or `no findings`."""
        counts = ((len(self.errors), "error"), (len(self.warnings), "warning"), (len(self.notes), "note"))
        return ", ".join(f"{n} {word}{'s' if n > 1 else ''}" for n, word in counts if n) or "no findings"

    @property
    def table(self) -> pa.Table:
        """The findings as an Arrow table with a column for each field.  Needs pyarrow, of the extra `ksl[loads]`."""
        require("a table of findings", "pyarrow")
        import pyarrow as pa

        text, columns = pa.string(), [f.as_dict() for f in self._all]
        types = {"line": pa.int32(), "value": pa.float64(), "fixable": pa.bool_(), "acceptable": pa.bool_()}
        names = [name for name in Finding.__dataclass_fields__ if not name.startswith("_")]
        metadata = {"ksl": json.dumps({"file": self.file, "not_checked": self.not_checked, "ignored": self.ignored})}
        return pa.Table.from_pylist(columns, pa.schema([(name, types.get(name, text)) for name in names], metadata=metadata))

    def as_dict(self) -> dict[str, Any]:
        """What `ksl check --json` prints."""
        return {
            "file": self.file,
            "status": self.status,
            "errors": len(self.errors),
            "warnings": len(self.warnings),
            "notes": len(self.notes),
            "findings": [f.as_dict() for f in self._all],
            "not_checked": list(self.not_checked),
            "ignored": list(self.ignored),
        }

    def __repr__(self) -> str:
        name = Path(self.file).name
        return "\n".join([f"<{name}: {self.summary}>", *(f"  {str(f).removeprefix(self.file).lstrip(': ')}" for f in self._all)])
