"""What the site has, and in which order: the rows of the table in docs/README.md, under its headings."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
INDEX = DOCS / "README.md"
ROW = re.compile(r"^\| (?:\*\*(?P<heading>.+?)\*\*|(?P<links>\[.+?)) \|", re.MULTILINE)
LINK = re.compile(r"\[([^\]]+)\]\(([^)#\s]+\.md|[^)#\s]+/)\)")


def sections():
    """{heading: [(name, path from docs)]}."""
    found, heading = {}, None
    for row in ROW.finditer(INDEX.read_text(encoding="utf-8")):
        if row["heading"]:
            heading = found.setdefault(row["heading"], [])
        elif heading is not None:
            heading += LINK.findall(row["links"])
    return found


def title(path):
    """The first heading of a page."""
    return re.search(r"^# (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)[1].replace("`", "").replace("\\", "")


def folder(name):
    """The pages of a folder of docs, its README first."""
    pages = sorted((DOCS / name).glob("*.md"), key=lambda path: (path.name != "README.md", path.name))
    return [{title(path): f"{name}{path.name}"} for path in pages]


def navigation(references):
    """As mkdocs.yml would have it.  `references` are entries for pages that the site alone has, made from docstrings and headers."""
    nav = [{"KSL": "README.md"}]
    for heading, pages in sections().items():
        entries = []
        for name, path in pages:
            if path.endswith("/"):
                entries.append({name: folder(path)})
            else:
                entries.append({title(DOCS / path) if (DOCS / path).exists() and name == path else name: site_path(DOCS / path)})
        if heading == "Reference":
            entries = references + entries
        nav.append({heading: entries})
    return nav


def site_path(path):
    """Where the site has a file of the project: pages of docs at their own places, others below project/ and source/."""
    path = path.resolve()
    if path.is_relative_to(DOCS):
        return path.relative_to(DOCS).as_posix()
    inside = path.relative_to(ROOT)
    if path.is_dir():
        return f"source/{inside.as_posix()}/README.md"
    if path.suffix == ".md":
        return f"project/{inside.as_posix().replace('README', 'readme').lower()}"
    return f"source/{inside.as_posix()}" + (".md" if is_shown(path) else "")


def is_shown(path):
    """Whether a file of the project is a page, with its text; others are files to load down."""
    return path.suffix in (".c", ".cpp", ".h", ".hpp", ".py", ".toml") and path.stat().st_size < 60_000
