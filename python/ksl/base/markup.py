"""Text of files in pages: names of robots, joints, meshes and cases are text there, whatever characters they have.

One function for each target.  Each makes invisible and control characters visible too, as :mod:`ksl.base.printable` does for terminals.
Whatever of a file reaches a page passes one of these; `test/viewer/hostile_names_test.py` lists the surfaces.  There is none for Markdown:
what the viewer shows as Markdown is KSL's own.  Cells of tables: :mod:`ksl.base.csv_cells`.
"""

from __future__ import annotations

import base64
import hashlib
import json
from html import escape
from typing import Any

from ksl.base.printable import one_line, printable


def html(text: object) -> str:
    """Text as content or as an attribute in quotes, of HTML and of SVG."""
    return escape(printable(str(text)), quote=True)


def plotly(text: object) -> str:
    """Text in a title, legend, annotation or label of plotly, which takes some tags, templates (`%{x}`) and TeX between `$`."""
    return html(one_line(str(text))).replace("$", "&#36;").replace("%{", "&#37;{")


def json_in_page(value: Any) -> str:
    """A value as JSON within a `<script>` element, which no string in it can end.  Raises ValueError for numbers that aren't finite."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def script(code: str) -> str:
    """JavaScript of our own within a `<script>` element, so that no string in it ends the element or opens a comment."""
    return code.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def css_string(text: str) -> str:
    """Text as a string of a style sheet, in quotes: every character but letters and digits is escaped."""
    return '"' + "".join(c if c.isascii() and c.isalnum() else f"\\{ord(c):x} " for c in printable(text)) + '"'


def source_of(code: str) -> str:
    """What allows a script element with exactly this content in a Content-Security-Policy, and no other."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()}'"
