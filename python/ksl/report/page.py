"""report.html: one page that needs no network, with all curves, their peaks, and the power balance as a check."""

from __future__ import annotations

import json
import os
from html import escape
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from string import Template

from ksl.report.balance_section import balance_section, balance_verdict
from ksl.report.charts import Charts
from ksl.report.input import ReportInput
from ksl.report.joint_section import joint_section
from ksl.report.numbers import Clock
from ksl.report.rows import with_limits
from ksl.report.tables import summary_tables

FEW_NOTES = 8
"""Up to this number, notes are shown unfolded."""


def write_report(path: str | os.PathLike[str], report: ReportInput) -> None:
    """Writes one HTML file that holds all it needs, plotly.js included (about 5 MB; 0.2 MB more for each joint)."""
    page = _Page(report)
    content = page.content()
    data = {"start": float(report.time[0]) - page.clock.origin, "charts": page.charts.data}
    html = Template(_asset("report.html")).substitute(
        title=escape(report.title),
        style=Template(_asset("report.css")).substitute(foot=_css_string(report.title)),
        content=content,
        data=json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
        plotly=_inline(_plotly()),
        script=_inline(_asset("report.js")),
    )
    Path(path).write_bytes(html.encode("utf-8", errors="replace"))


class _Page:
    """The body of the page, and beside it the data of the charts that the script draws into its figures."""

    def __init__(self, report: ReportInput) -> None:
        self.report = report
        self.charts = Charts(report.time, len(report.joints))
        self.clock = Clock.of(report.time)
        self.anchors = {loads.joint.name: f"joint-{i}" for i, loads in enumerate(report.joints)}

    def content(self) -> str:
        r = self.report
        header = f"<header><h1>{escape(r.title)}</h1>{self._facts()}{self._notes()}</header>"
        sections = self._summary() + balance_section(r.balance, r.time, self.charts, self.clock)
        sections += "".join(joint_section(loads, self.anchors[loads.joint.name], self.charts) for loads in r.joints)
        return f"{self._navigation()}<main>{header}{sections}</main>"

    def _facts(self) -> str:
        rows = "".join(f'<tr><th scope="row">{escape(name)}</th><td>{escape(text)}</td></tr>' for name, text in self.report.facts)
        return f'<table class="facts"><caption class="unseen">What was computed</caption><tbody>{rows}</tbody></table>{balance_verdict(self.report.balance)}'

    def _notes(self) -> str:
        notes = self.report.notes
        if not notes:
            return ""
        items = "".join(f"<li>{escape(note)}</li>" for note in notes)
        unfolded = " open" if len(notes) <= FEW_NOTES else ""
        return f'<details class="notes"{unfolded}><summary>Notes ({len(notes)})</summary><ul>{items}</ul></details>'

    def _navigation(self) -> str:
        links = "".join(f'<li><a href="#{self.anchors[j.joint.name]}">{escape(j.joint.name)}</a></li>' for j in self.report.joints)
        fixed = '<li><a href="#summary">Summary</a></li><li><a href="#balance">Power balance</a></li>'
        return f'<nav aria-label="Contents"><ul>{fixed}</ul><h2>Joints</h2><ul>{links}</ul></nav>'

    def _summary(self) -> str:
        r, joints = self.report, {l.joint.name: l.joint for l in self.report.joints}
        rows = [with_limits(row, joints[str(row["joint"])]) for row in r.summary]
        tables = summary_tables(rows, joints, self.anchors, self.clock)
        note = "Peaks are of the magnitude. Means (rms, mean) weigh each sample by the time it stands for. "
        note += "Forces and moments are those of the wrench at the chosen point; effort, speed, power and work are the drive's, whatever point is chosen."
        if self.clock.origin:
            note += f" Times on this page are counted from the first sample, at {self.clock.origin!r} s."
        return f'<section id="summary"><h2>Summary</h2><p>{note}</p>{tables}</section>'


def _inline(script: str) -> str:
    """Escapes JavaScript for an HTML page, so that no string in it ends the element or opens a comment."""
    return script.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def _css_string(text: str) -> str:
    """A string of a style sheet; names come from files, so that every character but letters and digits is escaped."""
    return '"' + "".join(c if c.isascii() and c.isalnum() else f"\\{ord(c):x} " for c in text) + '"'


def _plotly() -> str:
    """plotly.js, read without an import of plotly, which takes longer than the rest of the report."""
    found = find_spec("plotly")
    if found is None or found.origin is None:
        raise ModuleNotFoundError("the report needs plotly; install it with: pip install 'ksl[loads]'")
    return Path(found.origin).with_name("package_data").joinpath("plotly.min.js").read_text(encoding="utf-8")


def _asset(name: str) -> str:
    return resources.files("ksl").joinpath("report", "assets", name).read_text(encoding="utf-8")
