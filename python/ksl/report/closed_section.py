"""The section of a closed mechanism: loops, freedoms, redundant equations, components that are not determined, and how well the motion is closed."""

from __future__ import annotations

from ksl.base.markup import html as escape
from ksl.load_cases.closed_mechanism import ClosedMechanism
from ksl.load_cases.undetermined import FOOTNOTE, NOT_JUDGED, WAY_OUT


def closed_section(found: ClosedMechanism) -> str:
    rows = "".join(f'<tr><th scope="row">{name}</th><td>{escape(text)}</td></tr>' for name, text in found.lines())
    return f'<section id="closed"><h2>Closed mechanism</h2><table class="facts"><tbody>{rows}</tbody></table>{_undetermined(found)}</section>'


def _undetermined(found: ClosedMechanism) -> str:
    """Which components of which joints are not determined."""
    if not found.undetermined:
        return "<p>Every component of every reaction is determined by rigid bodies.</p>"
    rows = "".join(f'<tr><th scope="row">{escape(joint)}</th><td>{escape(" ".join(names))}</td></tr>' for joint, names in found.undetermined.items())
    head = '<thead><tr><th scope="col">joint</th><th scope="col">components</th></tr></thead>'
    title = "Components that are not determined, as the table of wrenches expresses them"
    text = f"{FOOTNOTE}. Such numbers are marked on this page, and get no verdict ({NOT_JUDGED}). {WAY_OUT}."
    return f'<p>{escape(text)}</p><div class="wide" role="region" aria-label="{title}" tabindex="0"><table><caption>{title}</caption>{head}<tbody>{rows}</tbody></table></div>'
