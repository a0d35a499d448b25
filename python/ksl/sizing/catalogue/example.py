"""The components file that `ksl size --example` prints: every kind of component with all of its keys, made from their table."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator

from ksl.sizing.catalogue.bolt_numbers import OF_BOLT
from ksl.sizing.catalogue.catalogue import KINDS, Key, ComponentKind
from ksl.sizing.catalogue.catalogue_stiffness import OF_STIFFNESS

HEAD = """\
# Components of a robot for `ksl size RESULTS THIS_FILE`.  SI units, but for keys that end in _rpm, _deg and _h.
# The numbers are examples: replace them by those of your catalogue, and remove what you don't have.  A figure whose
# numbers are missing is left out, and that is said.

ROBOT
required_life_h = 20000   # h; a component may have its own
reliability = 90          # % of the life of bearings: 90, 95, 96, 97, 98 or 99
iso_281 = 2007            # edition whose reliability factors are taken: 2007 or 1990

# [cases]                 # how often each load case occurs in one pass of the duty cycle; otherwise each once
# pick = 3
# emergency_stop = 0      # exceptional: counts for peaks and static safety, not for life

# [shares]                # instead of [cases]: shares of the operating time
# pick = 0.7
# idle = 0.3

# [stiffness]             # for --stiffness: joints without components that say how they give way; keys that begin with # below are for it, too
# JOINT = 2.5e4

# [[choose]]              # a component that --choose CATALOGUE finds: joint, kind, margin, by, link, at
"""


def example_file(joint: str = "JOINT", robot: str = "", sliding: str | None = "SLIDING_JOINT") -> str:
    """The commented file as text, with all components on one joint, but those of joints that slide.  sliding: one of these; None if there is none."""
    named = f"{f'robot = {_quoted(robot)}':<24}" if robot else '# robot = "NAME"        '
    head = HEAD.replace("ROBOT\n", f"{named}  # if given, results of another robot are refused\n")
    return head + "".join(_of_kind(kind, joint, sliding) for kind in KINDS.values())


def _of_kind(kind: ComponentKind, joint: str, sliding: str | None) -> str:
    """The component, commented out where the robot has no joint for it."""
    if kind.joints != "sliding":
        return "".join(_component(kind, joint))
    lines = "".join(_component(kind, sliding or "SLIDING_JOINT"))
    return lines if sliding else "".join(f"# {line}" if line.strip() else line for line in lines.splitlines(keepends=True))


def _component(kind: ComponentKind, joint: str) -> Iterator[str]:
    yield f"\n[[component]]             # {kind.name}: {kind.meaning}\n"
    yield f"joint = {_quoted(joint)}           # or joints = [{_quoted(joint)}, …]\n"
    yield f'kind = "{kind.name}"\nname = "{kind.name} 1"\n'
    left_out = OF_STIFFNESS | ({"points", "load_factor", *OF_BOLT} if kind.name == "bolted flange" else set())
    yield from _lines((key for key in kind.keys if key.shape != "table"), left_out)
    for k, table in enumerate(key for key in kind.keys if key.shape == "table"):
        yield f"[component.{table.name}]  # {table.meaning}\n"
        yield from _lines(table.keys, OF_STIFFNESS, second=k > 0)


def _lines(keys: Iterable[Key], left_out: set[str], second: bool = False) -> Iterator[str]:
    for key in keys:
        value = f"-{key.example}" if second and key.name == "position" else key.example
        about = ", ".join(x for x in (key.unit, key.meaning) if x)
        default = (
            ""
            if key.default is None or key.shape == "vector"
            else f"; {key.default:g} if left out"
            if isinstance(key.default, float)
            else f"; {key.default} if left out"
        )
        yield f"{'# ' if key.name in left_out else ''}{f'{key.name} = {value}':<40}  # {about}{default}\n"


def _quoted(name: str) -> str:
    """A string of TOML, whose escapes are those of JSON."""
    return json.dumps(name, ensure_ascii=False)
