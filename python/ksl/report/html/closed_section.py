"""The section of a closed mechanism: loops, freedoms, redundant equations, stiffnesses, components that are not determined, and how well the motion is closed."""

from __future__ import annotations

from ksl.base.markup import html as escape
from ksl.load_cases.closed_mechanism import ClosedMechanism
from ksl.load_cases.undetermined import FOOTNOTE, MARK, NOT_JUDGED, WAY_OUT


def closed_section(found: ClosedMechanism) -> str:
    rows = "".join(f'<tr><th scope="row">{name}</th><td>{escape(text)}</td></tr>' for name, text in found.lines())
    return f'<section id="closed"><h2>Closed mechanism</h2><table class="facts"><tbody>{rows}</tbody></table>{_undetermined(found)}</section>'


def _undetermined(found: ClosedMechanism) -> str:
    """Which components of which joints are not determined."""
    if not found.undetermined:
        return f"<p>{_determined(found)}</p>"
    rows = "".join(f'<tr><th scope="row">{escape(joint)}</th><td>{escape(" ".join(names))}</td></tr>' for joint, names in found.undetermined.items())
    head = '<thead><tr><th scope="col">joint</th><th scope="col">components</th></tr></thead>'
    title = "Components that are not determined, as the table of wrenches expresses them"
    text = f"{_open(found)}. Such numbers are marked on this page, and get no verdict ({NOT_JUDGED}). {WAY_OUT}."
    return f'<p>{escape(text)}</p><div class="wide" role="region" aria-label="{title}" tabindex="0"><table><caption>{title}</caption>{head}<tbody>{rows}</tbody></table></div>'


def _determined(found: ClosedMechanism) -> str:
    if not found.stiff or not found.redundant:
        return "Every component of every reaction is determined by rigid bodies."
    return "Rigid bodies leave components of reactions open. The stiffnesses above decide all of them: the values are those of least energy."


def _open(found: ClosedMechanism) -> str:
    """What marked numbers are.  Load cases may differ in their stiffnesses."""
    of_stiff = [name for name in found.open_in if name in found.stiff]
    beside = f"{MARK} not determined by rigid bodies and the stiffnesses that are given: one of the possible values"
    if not of_stiff:
        decided = [name for name in found.cases if name in found.stiff]
        return FOOTNOTE + (f". In the load cases {', '.join(decided)} stiffnesses decide them" if decided else "")
    return (
        beside
        if len(of_stiff) == len(found.open_in)
        else f"{beside}; in the load cases {', '.join(n for n in found.open_in if n not in of_stiff)} the value of least norm"
    )
