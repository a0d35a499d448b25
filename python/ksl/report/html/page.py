"""report.html: one page that needs no network, with all curves, their peaks, and the power balance as a check."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Any

from ksl._core import __version__
from ksl.base.extras import require
from ksl.base.markup import css_string, json_in_page, script, source_of
from ksl.base.markup import html as escape
from ksl.report.html.balance_section import balance_verdict
from ksl.report.html.case_section import Anchors, case_head, case_sections
from ksl.report.html.charts import Charts
from ksl.report.html.closed_section import closed_section
from ksl.report.html.input import ReportInput
from ksl.report.html.numbers import Clock, round_off_of_page
from ksl.report.html.provenance_section import provenance_section, signature_box
from ksl.report.html.rows import with_limits
from ksl.report.html.verdict_section import ComponentsVerdict, uses_table, verdict_section
from ksl.report.html.worst_section import worst_section

FEW_NOTES = 8
"""Up to this number, notes are shown unfolded."""
NAMED = 8
"""So many load cases are named in the verdict."""


def write_report(path: str | os.PathLike[str], report: ReportInput) -> None:
    """Writes one HTML file that holds all it needs, plotly.js included: 5 MB, and with 20 joints at most 8."""
    page = _Page(report)
    with round_off_of_page(report.summary, report.weight):
        content = page.content()
    write_page(path, report.title, content, page.charts, report.provenance.date if report.provenance else "")


def write_page(path: str | os.PathLike[str], title: str, content: str, charts: Charts, date: str = "") -> None:
    """Writes a page with this body, in which the script draws the charts.  title, date: on each page of paper, so that one that is alone says what it belongs to."""
    foot = f"{title}   ·   KSL {__version__}" + (f"   ·   {date}" if date else "")
    plotly, own = (f"\n{script(code)}\n" for code in (_plotly(), _asset("report.js")))
    html = Template(_asset("report.html")).substitute(
        title=escape(title),
        style=Template(_asset("report.css")).substitute(foot=css_string(foot)),
        content=content,
        data=json_in_page({"charts": charts.data, "stills": charts.stills}),
        plotly=plotly,
        script=own,
        scripts=f"{source_of(plotly)} {source_of(own)}",
    )
    Path(path).write_bytes(html.encode("utf-8", errors="replace"))


class _Page:
    """The body of the page, and beside it the data of the charts that the script draws into its figures."""

    def __init__(self, report: ReportInput) -> None:
        self.report = report
        self.charts = Charts(sum(len(case.joints) for case in report.cases))
        self.several = len({row.get("case") for row in report.summary}) > 1
        self.anchors = [Anchors.of(case, i if self.several else None) for i, case in enumerate(report.cases)]
        cases = zip(report.cases, self.anchors, strict=True)
        self.of_joints = {(case.name, joint): anchor for case, anchors in cases for joint, anchor in anchors.joints.items()}

    def content(self) -> str:
        r = self.report
        card = verdict_section(r.verdict, self._components(), self._holds_for())
        balance = "" if self.several else balance_verdict(r.cases[0].balance, "balance")
        head = f"<h1>{escape(r.title)}</h1>{self._made()}{card}{signature_box()}{self._uses()}{self._facts()}{balance}{self._notes()}"
        closed = closed_section(r.closed) if r.closed else ""
        made = provenance_section(r.provenance, r.notes, _of_components(r)) if r.provenance else ""
        return f"{self._navigation()}<main><header>{head}</header>{closed}{self._cases()}{made}</main>"

    def _made(self) -> str:
        p = self.report.provenance
        return f'<p class="made">KSL {escape(__version__)}{", " + escape(p.date) if p else ""}</p>'

    def _holds_for(self) -> list[tuple[str, str]]:
        """What the verdict is of: the payloads and the load cases, which a reader of the card alone must know."""
        r = self.report
        alike: dict[str, list[str]] = {}
        for case, text in r.payloads.items():
            alike.setdefault(text, []).append(case)
        payloads = "; ".join(f"{text} ({_named(of)})" if len(alike) > 1 else text for text, of in alike.items())
        cases = list(dict.fromkeys(str(row["case"]) for row in r.summary if row.get("case"))) or [case.name for case in r.cases]
        return ([("Payloads", payloads)] if payloads else []) + [("Load cases" if len(cases) > 1 else "Load case", _named(cases))]

    def _components(self) -> ComponentsVerdict | None:
        if self.report.sizing is None:
            return None
        from ksl.report.html.sizing_section import sizing_verdict

        return sizing_verdict(self.report.sizing)

    def _uses(self) -> str:
        if self.report.verdict is None:
            return ""
        return uses_table(self.report.verdict, self.of_joints, {case.name: Clock.of(case.time) for case in self.report.cases})

    def _cases(self) -> str:
        r = self.report
        if not self.several:
            return case_sections(r.cases[0], r.summary, self.anchors[0], self.charts, r.sizing)
        joints = {loads.joint.name: loads.joint for case in r.cases for loads in case.joints}
        html = worst_section([with_limits(row, joints[str(row["joint"])]) for row in r.summary], joints, self.of_joints)
        for i, (case, anchors) in enumerate(zip(r.cases, self.anchors, strict=True)):
            rows = [row for row in r.summary if row.get("case") == case.name]
            sections = case_sections(case, rows, anchors, self.charts, r.sizing if i == 0 else None)  # it is one for all cases
            html += f'<article class="case" id="case-{i}" aria-label="Load case {escape(case.name)}">{case_head(case, anchors)}{sections}</article>'
        return html

    def _selector(self) -> str:
        """Which case is shown.  Without JavaScript, and on paper, all are."""
        if len(self.report.cases) < 2:
            return ""
        options = "".join(f'<option value="{i}">{escape(case.name)}</option>' for i, case in enumerate(self.report.cases))
        return f'<label class="choice">Load case <select id="choice">{options}</select></label>'

    def _facts(self) -> str:
        rows = "".join(f'<tr><th scope="row">{escape(name)}</th><td>{escape(text)}</td></tr>' for name, text in self.report.facts)
        return f'<table class="facts"><caption class="unseen">What was computed</caption><tbody>{rows}</tbody></table>'

    def _notes(self) -> str:
        notes = list(dict.fromkeys([*self.report.notes, *(self.report.sizing.notes if self.report.sizing else ())]))
        if not notes:
            return ""
        items = "".join(f"<li>{escape(note)}</li>" for note in notes)
        unfolded = " open" if len(notes) <= FEW_NOTES else ""
        return f'<details class="notes"{unfolded}><summary>Notes ({len(notes)})</summary><ul>{items}</ul></details>'

    def _navigation(self) -> str:
        top = '<li><a href="#verdict">Verdict</a></li>' if self.report.verdict else ""
        top += '<li><a href="#closed">Closed mechanism</a></li>' if self.report.closed else ""
        top += '<li><a href="#worst">Worst over all cases</a></li>' if self.several else ""
        html = f"<ul>{top}</ul>{self._selector()}"
        for i, (case, anchors) in enumerate(zip(self.report.cases, self.anchors, strict=True)):
            links = "".join(f'<li><a href="#{anchors.joints[j.joint.name]}">{escape(j.joint.name)}</a></li>' for j in case.joints)
            fixed = f'<li><a href="#{anchors.prefix}summary">Summary</a></li><li><a href="#{anchors.prefix}balance">Power balance</a></li>'
            html += f'<div data-case="{i}"><ul>{fixed}</ul><h2>Joints</h2><ul>{links}</ul></div>'
        html += '<ul><li><a href="#provenance">What made these results</a></li></ul>' if self.report.provenance else ""
        return f'<nav aria-label="Contents">{html}</nav>'


def _named(cases: Sequence[str]) -> str:
    return ", ".join(cases[:NAMED]) + (f" and {len(cases) - NAMED} more" if len(cases) > NAMED else "")


def _of_components(report: ReportInput) -> list[dict[str, Any]]:
    """The files that components were read from."""
    return [] if report.sizing is None else [dict(f) for f in report.sizing.provenance.get("inputs", []) if f["role"] == "components"]


def _plotly() -> str:
    """plotly.js, read without an import of plotly, which takes longer than the rest of the report."""
    require("the report", "plotly")
    found = find_spec("plotly")
    assert found is not None and found.origin is not None
    return Path(found.origin).with_name("package_data").joinpath("plotly.min.js").read_text(encoding="utf-8")


def _asset(name: str) -> str:
    return resources.files("ksl").joinpath("report", "html", "assets", name).read_text(encoding="utf-8")
