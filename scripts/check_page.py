#!/usr/bin/env python3
"""Write the tables of docs/check.md: the rules as they are declared, and the findings in the robots of
example-robot-data.

    scripts/check_page.py            writes the page
    scripts/check_page.py --check    ends with status 1 if the page is another

Needs the package example-robot-data of the version that the page names."""

import importlib.metadata
import re
import sys
from collections import Counter
from pathlib import Path

from ksl.checks.run import TOPICS, check

PAGE = Path(__file__).resolve().parents[1] / "docs" / "check.md"
FOLDER = "share/example-robot-data/robots/"


def cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "\\<")


def rules() -> str:
    """A table for each topic."""
    lines = []
    for topic, declared in TOPICS.items():
        lines += [f"### {topic}", "", "| rule | | what is expected | likely cause | repair |", "|---|---|---|---|---|"]
        for rule in declared:
            done = [rule.repair, f"`--fix` {rule.fix}." if rule.fix else "", f"`--fix --accept {rule.name}` {rule.accept}." if rule.accept else ""]
            cells = [rule.severity, *map(cell, (rule.condition, rule.cause, " ".join(filter(None, done))))]
            lines.append(f"| `{rule.name}` | {' | '.join(cells)} |")
        lines.append("")
    return "\n".join(lines)


def robots() -> dict[str, Path]:
    """{path below the package's folder: URDF file}."""
    files = importlib.metadata.distribution("example-robot-data").files or []
    return dict(sorted((str(f).partition(FOLDER)[2], Path(str(f.locate()))) for f in files if f.suffix == ".urdf" and FOLDER in str(f)))


def findings() -> str:
    """How many findings of each rule there are, and in how many files."""
    count, where, status = Counter(), Counter(), Counter()
    for path in robots().values():
        found = check(path)
        status[found.status] += 1
        count.update(found.rules)
        where.update(found.rules.keys())
        status["mount only"] += set(found.rules) == {"root-inertial"}
    total = len(robots())
    head = (
        f"The {total} URDF files of example-robot-data {version()}: {status[0]} are clean, {status[1]} have warnings "
        f"({status['mount only']} of them only `root-inertial`), {status[2]} have errors."
    )
    rows = [f"| `{rule.name}` | {count[rule.name]} | {where[rule.name]} |" for declared in TOPICS.values() for rule in declared if count[rule.name]]
    return "\n".join([head, "", "| rule | findings | files |", "|---|---|---|", *rows, ""])


def version() -> str:
    return importlib.metadata.version("example-robot-data")


def written(text: str, **parts: str) -> str:
    """The page with what stands between its marks replaced."""
    for name, part in parts.items():
        pattern = re.compile(rf"(<!-- {name}: [^>]*-->\n).*?(<!-- end of {name} -->)", re.DOTALL)
        text, n = pattern.subn(lambda m, part=part: f"{m[1]}\n{part}\n{m[2]}", text)
        assert n == 1, name
    return text


def main() -> None:
    old = PAGE.read_text(encoding="utf-8")
    new = written(old, rules=rules(), findings=findings())
    if "--check" in sys.argv:
        sys.exit(old != new)
    PAGE.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main()
