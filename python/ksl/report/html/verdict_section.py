"""The verdict at the top of the page, and what each joint uses of its limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from ksl.base.markup import html as escape

from ksl.load_cases.verdict import AMBER, Level, Use, Verdict, percent, worst_level
from ksl.report.html.numbers import PLAIN_CLOCK, Clock, format_number, link

WORDS: dict[Level, str] = {
    "green": "every limit was compared and holds with its margin",
    "amber": "no limit is exceeded, but this needs a look",
    "red": "limits are exceeded",
}
"""Words for the limits of the robot's file."""
OF_COMPONENTS: dict[Level, str] = {"green": "all components hold", "amber": "components hold, but this needs a look", "red": "components are over their limits"}
OF_USE: dict[Level, str] = {"green": "", "amber": "near the limit", "red": "exceeded"}
"""What is said of a share besides its colour, which not everybody sees and not every printer prints."""


@dataclass(frozen=True)
class ComponentsVerdict:
    """What the components say, beside the limits of the robot's file."""

    level: Level
    headline: str
    left_out: Sequence[str] = ()
    words: str = ""
    """In place of OF_COMPONENTS."""


def verdict_section(verdict: Verdict | None, components: ComponentsVerdict | None = None, of: Sequence[tuple[str, str]] = ()) -> str:
    """One card for the run: the worse level of limits and components in words, the worst use of each, what forbids green, and what it holds for.

    of: payloads and load cases.  A card that was green above another that is amber would be read alone.
    """
    parts: list[tuple[str, Level, str, str]] = []
    if verdict is not None:
        parts.append(("Limits of the robot's file", verdict.level, WORDS[verdict.level], _headline(verdict)))
    if components is not None:
        parts.append(("Components", components.level, components.words or OF_COMPONENTS[components.level], components.headline))
    level = worst_level(part[1] for part in parts)
    if level is None:
        return ""
    said = "; ".join(words for _, each, words, _ in parts if each == level)
    head = f'<p class="level">{level.capitalize()}: {said}</p>'
    for name, each, _, headline in parts:
        which = f'{name}: <strong class="{each}">{each}</strong>. ' if components is not None else ""
        head += f"<p>{which}{escape(headline)}.</p>"
    reasons = [*(verdict.reasons if verdict else ()), *(components.left_out if components else ())]
    if reasons:
        listed = "".join(f"<li>{escape(reason)}</li>" for reason in reasons)
        head += f"<p>{'Doubts' if level == 'red' else 'Not green, because'}:</p><ul>{listed}</ul>"
    head += "".join(f'<p class="small">{escape(name)}: {escape(text)}</p>' for name, text in of)
    return f'<section id="verdict" class="verdict {level}"><h2 class="unseen">Verdict</h2>{head}</section>'


def uses_table(verdict: Verdict, anchors: Mapping[tuple[str, str], str], clocks: Mapping[str, Clock]) -> str:
    """A table of the largest share of each limit over all load cases, worst joints first.

    anchors: of the sections of joints, by case and joint.  clocks: by case.  Both only of cases whose curves are shown.
    """
    joints = {name: verdict.of(name) for name in dict.fromkeys(use.joint for use in verdict.uses)}
    if not joints:
        return ""
    several = len({use.case for use in verdict.uses}) > 1
    rows = ""
    worst_of = {name: max(uses.values(), key=_weight) for name, uses in joints.items()}
    for name, worst in sorted(worst_of.items(), key=lambda item: _weight(item[1]), reverse=True):
        cells = "".join(_cell(joints[name].get(quantity), anchors, clocks, several) for quantity in AMBER)
        elsewhere = next((anchor for (_, joint), anchor in anchors.items() if joint == name), None)
        rows += f'<tr><th scope="row">{link(anchors.get((worst.case, name), elsewhere), name)}</th>{cells}</tr>'
    head = "".join(f'<th scope="col">{quantity}</th>' for quantity in AMBER)
    title = "Share of its limits that each joint uses" + (", largest over all load cases" if several else "")
    table = f'<table class="uses"><caption>{title}</caption><thead><tr><th scope="col">joint</th>{head}</tr></thead><tbody>{rows}</tbody></table>'
    note = '<p class="small">The share of a position is its distance from the middle of the range, divided by half the range.</p>'
    return f'<div class="wide" role="region" aria-label="{title}" tabindex="0">{table}</div>{note}'


def _weight(use: Use) -> tuple[bool, bool, float]:
    """What orders uses: the level before the share, since positions may come nearer to their limits than speeds."""
    return use.level == "red", use.level == "amber", use.share


def _cell(use: Use | None, anchors: Mapping[tuple[str, str], str], clocks: Mapping[str, Clock], several: bool) -> str:
    if use is None:
        return "<td>–<small>not compared</small></td>"
    words = f" {OF_USE[use.level]}" if OF_USE[use.level] else ""
    share = f'<strong class="{use.level}">{percent(use.share)}{words}</strong>'
    width = f"{100 * min(max(use.share, 0.0), 1.0):.1f}%"
    of = f" {use.column.removeprefix(f'{use.joint}.')}" if use.column != use.joint else ""
    between = ", limit" if use.quantity == "position" else " of"  # a share of a range is not the quotient of position and limit
    when = "" if use.time is None else f" at {clocks.get(use.case, PLAIN_CLOCK).text(use.time)} s"
    text = f"{escape(of)} {format_number(use.value)}{between} {use.limit:.5g} {use.unit}{when}"
    case = f", {link(anchors.get((use.case, use.joint)), use.case)}" if several else ""
    return f'<td>{share}<span class="bar"><span class="{use.level}" style="width:{width}"></span></span><small>{text.strip()}{case}</small></td>'


def _headline(verdict: Verdict) -> str:
    """With a capital, unless it begins with the name of a joint."""
    text = verdict.headline
    return text if verdict.worst is not None else text[0].upper() + text[1:]
