"""What MkDocs calls while it builds the site: pages that are made, links that lead out of docs/, which pages a search finds first."""

import posixpath
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]
import contents
import cpp_reference
import reference_pages
from generator import reference as algorithms
import python_reference
from mkdocs.structure.files import File

LINK = re.compile(r"(?<!!)(\]\()([^)#\s]+)(#[^)\s]*)?\)")
CODE = re.compile(r"^```.*?^```$|`[^`\n]+`(?!\])", re.MULTILINE | re.DOTALL)

FIRST = [  # the first pattern that fits a page's path says how much its words count in a search
    (r"decisions/|source/|project/", 0.2),
    (r"trust\.md|performance\.md|engine\.md", 0.3),
    (r"reference/dynamics", 2.0),
    (r"reference/python", 0.5),
    (r"reference/", 0.15),
    (r"tutorials/", 0.9),
    (r"sizing\.md", 6.0),
    (r"(conventions|cases|sizing|derivatives|loads)\.md", 3.0),
]

_wanted: dict[str, Path] = {}
"""Pages and files outside docs/ that others link to, by their paths on the site."""


def algebra():
    return {f"reference/{name}": text for name, text in reference_pages.pages().items()}


def on_config(config):
    functions = [
        {re.search("^# (.+)", text)[1].replace("`", ""): path} for path, text in sorted(algebra().items(), key=lambda page: ("README" not in page[0], page))
    ]
    config.nav = contents.navigation(
        [{"Dynamics": "reference/dynamics.md"}, python_reference.navigation(), *cpp_reference.navigation(), {"Functions of the algebra": functions}]
    )
    return config


def on_files(files, config):
    made = {**python_reference.pages(), **cpp_reference.pages(), "reference/dynamics.md": algorithms.page(), **algebra()}
    pages = [file.src_uri for file in files.documentation_pages()]
    for path in pages:
        _note_links(contents.DOCS / path, (contents.DOCS / path).read_text(encoding="utf-8"))
    for entry in _paths(config.nav):  # those of the table that are not in docs/
        if entry.startswith("project/"):
            _want(next(p for p in contents.ROOT.glob("*.md") if contents.site_path(p) == entry))
    for path, text in made.items():
        files.append(File.generated(config, path, content=text))
    for path, origin in _wanted.items():
        files.append(File.generated(config, path, content=_content(origin)) if path.endswith(".md") else File.generated(config, path, abs_src_path=str(origin)))
    return files


def on_page_markdown(markdown, page, config, files):
    boost = next((boost for pattern, boost in FIRST if re.match(pattern, page.file.src_uri)), 1.0)
    page.meta.setdefault("search", {"exclude": True} if page.file.src_uri.startswith("source/") else {"boost": boost})
    origin = _wanted.get(page.file.src_uri, contents.DOCS / page.file.src_uri)
    if page.file.src_uri.startswith("reference/") and not origin.exists():
        return markdown  # made for the site
    code = []
    hidden = CODE.sub(lambda found: code.append(found[0]) or f"\0{len(code) - 1}\0", markdown)
    turned = LINK.sub(lambda found: _turned(found, origin, page.file.src_uri), hidden)
    return re.sub("\0(\\d+)\0", lambda found: code[int(found[1])], turned)


def _paths(nav):
    for entry in nav:
        (value,) = entry.values()
        yield from _paths(value) if isinstance(value, list) else [value]


def _target(origin, link):
    """The file of the project that a link of a page leads to; None for others."""
    path = ((origin if origin.is_dir() else origin.parent) / unquote(link)).resolve()
    return path if "://" not in link and not link.startswith("mailto:") and path.exists() and path.is_relative_to(contents.ROOT) else None


def _note_links(origin, markdown):
    for _, link, _ in LINK.findall(CODE.sub("", markdown)):
        target = _target(origin, link)
        if target and not target.is_relative_to(contents.DOCS):
            _want(target)


def _want(path):
    at = contents.site_path(path)
    if at in _wanted:
        return
    _wanted[at] = path
    if path.is_dir():
        for file in _tracked(path):
            _want(file)
    elif path.suffix == ".md":
        _note_links(path, path.read_text(encoding="utf-8"))


def _tracked(folder):
    listed = subprocess.run(["git", "ls-files", "-z", "."], cwd=folder, check=True, capture_output=True, text=True).stdout
    return [folder / name for name in listed.split("\0") if name]


def _content(path):
    if path.is_dir():
        lines = [f"* [{file.relative_to(path).as_posix()}]({file.relative_to(path).as_posix()})" for file in _tracked(path)]
        return f"# {path.relative_to(contents.ROOT).as_posix()}\n\n" + "\n".join(lines) + "\n"
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        return text
    language = {".h": "c", ".hpp": "cpp"}.get(path.suffix, path.suffix[1:])
    fence = "`" * max([3, *(len(ticks) + 1 for ticks in re.findall("`+", text))])
    return f"# {path.relative_to(contents.ROOT).as_posix()}\n\n{fence}{language}\n{text}\n{fence}\n"


def _turned(found, origin, page):
    """The link, as it is on the site."""
    target = _target(origin, found[2])
    if target is None:
        return found[0]
    if target.is_dir() and target.is_relative_to(contents.DOCS):
        target /= "README.md"
    at = posixpath.relpath(contents.site_path(target), posixpath.dirname(page) or ".")
    return f"{found[1]}{at}{found[3] or ''})"
