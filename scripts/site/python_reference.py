"""The reference of Python: every public name of `ksl`, with whole signatures and docstrings.  They are read from the source: nothing is compiled."""

import functools
import re
import textwrap

import griffe
from contents import ROOT

PAGES = {
    "robots": ("Robots", ["load", "load_string", "Builder"]),
    "model": ("Model", ["Model", "Joint", "Link"]),
    "jobs": ("Jobs", ["check", "Findings", "Finding", "compute_loads", "hold", "Run", "size", "sweep", "read_motion", "read_efforts"]),
    "algebra": ("Typed vectors", ["Pose", "Twist", "Acceleration", "Wrench", "Momentum", "Inertia"]),
    "errors": (
        "Errors and warnings",
        [
            "CaseError",
            "DescriptionError",
            "FrameError",
            "MotionError",
            "ResultError",
            "SizingError",
            "SweepError",
            "ViewerError",
            "DescriptionWarning",
            "QuaternionWarning",
        ],
    ),
}
NOT_CALLED = ("Model", "Run", "Findings")  # other calls make these
ARGUMENT = re.compile(r"^([a-z]\w*(?:, \w+)*):")
ROLE = re.compile(r":(?:meth|func|class|mod|attr):`~?([^`]+)`")


@functools.cache
def package():
    return griffe.load("ksl", search_paths=[str(ROOT / "python")], allow_inspection=False)


def public_names(table):
    """{name: module that has it}, as the package has it in a table."""
    value = package()[table].value
    return {key.strip("'\""): place.strip("'\"") for key, place in zip(map(str, value.keys), map(str, value.values), strict=True)}


def titled():
    """{page: (title, names)}, with a page for names that PAGES doesn't have."""
    others = sorted(set(public_names("_MODULE_OF")) - {name for _, names in PAGES.values() for name in names} - {"__version__"})
    return PAGES | ({"others": ("Other names", others)} if others else {})


def pages():
    places, modules, found = public_names("_MODULE_OF"), public_names("_MODULES"), {}
    for page, (title, names) in titled().items():
        objects = [(name, package()[places[name].removeprefix("ksl.")][name]) for name in names]
        found[f"reference/python/{page}.md"] = "\n\n".join([f"# {title}", *(section(f"ksl.{name}", thing) for name, thing in objects)]) + "\n"
    for name, place in modules.items():
        module = package()[place.removeprefix("ksl.")]
        parts = [f"# ksl.{name}", text_of(module)]
        for member_name, member in module.members.items():
            if found_member := public(member, module):
                parts.append(section(f"ksl.{name}.{member_name}", found_member))
        parts += compiled() if name == "ufuncs" else []
        found[f"reference/python/{name}.md"] = "\n\n".join(parts) + "\n"
    found["reference/python/README.md"] = index(places, modules)
    return found


def navigation():
    names = {page: title for page, (title, _) in titled().items()} | {name: f"ksl.{name}" for name in public_names("_MODULES")}
    return {"Python": [{"All names": "reference/python/README.md"}, *({title: f"reference/python/{page}.md"} for page, title in names.items())]}


def index(places, modules):
    rows = ["| name | what |", "|---|---|"]
    for page, (_, names) in titled().items():
        rows += [f"| [ksl.{name}]({page}.md) | {first_line(package()[places[name].removeprefix('ksl.')][name])} |" for name in names]
    rows += [f"| [ksl.{name}]({name}.md) | {first_line(package()[place.removeprefix('ksl.')])} |" for name, place in modules.items()]
    return "\n\n".join(["# Python", text_of(package()), "\n".join(rows)]) + "\n"


def public(member, module):
    """The function, class or constant of a module that its users see; None for others."""
    listed = {str(name).strip("'\"") for name in module.exports or ()}
    if member.name.startswith("_") or (member.name not in listed if listed else member.is_alias) or "_ufuncs" in str(getattr(member, "target_path", "")):
        return None
    member = member.final_target if member.is_alias else member
    return member if member.is_function or member.is_class or (member.is_attribute and listed and member.docstring) else None


def compiled():
    """The functions of ksl.ufuncs that are compiled, from the table that gives them their docstrings."""
    table = re.findall(
        r'\{"(\w+)",((?:\s*"(?:[^"\\]|\\.)*")+)\}', (ROOT / "python/ufuncs.cpp").read_text(encoding="utf-8").split("texts[] = {")[1].split("\n};")[0]
    )
    return [f"## ksl.ufuncs.{name}\n\n" + plain("".join(re.findall(r'"((?:[^"\\]|\\.)*)"', text))) for name, text in table]


def section(name, thing):
    parts = [f"## {name}", f"```python\n{signature(thing)}\n```", text_of(thing)]
    if thing.is_class:
        members = {**thing.inherited_members, **thing.members}
        for member_name in sorted(members):
            member = members[member_name]
            member = member.final_target if member.is_alias else member
            if member_name.startswith("_") or not (member.is_function or (member.is_attribute and member.docstring)):
                continue
            parts += [f"### {name.removeprefix('ksl.')}.{member_name}", f"```python\n{signature(member)}\n```", text_of(member)]
    return "\n\n".join(part for part in parts if part)


def first_line(thing):
    return text_of(thing).split("\n")[0].replace("|", "\\|")


def text_of(thing):
    """The docstring, whose roles become code."""
    if not thing.docstring:
        return ""
    text = ROLE.sub(lambda found: f"`{found[1]}`", thing.docstring.value)
    parts = re.split(r"\n[ ]*\n+", text)
    return "\n\n".join(code(part) if part.startswith("    ") else prose(part) for part in parts)


def prose(paragraph):
    """A paragraph, in which lines as `path: also of a file…` are items, and indented lines go on with the item before them."""
    items = re.split(r"\n(?=[\w(][\w, .()…]*: |Returns |Raises )", paragraph)
    lines = ""
    for item in (re.sub(r"\s*\n\s*", " ", item) for item in items):
        found = re.match(ARGUMENT, item)
        lines += f"* **{plain(found[1])}**: {plain(item[found.end() :].strip())}\n" if found else f"\n{plain(item)}\n\n"
    return lines.strip("\n")


def code(block):
    """What is indented in a docstring: an example, or a table of words."""
    return f"```{'python' if re.search(r'[=(]', block) and '…' not in block.split('#')[0] else 'text'}\n{textwrap.dedent(block)}\n```"


def plain(text):
    return re.sub(r"([*_<\[])(?=[^`]*(?:`[^`]*`[^`]*)*$)", r"\\\1", text)  # outside code


def signature(thing):
    if thing.is_attribute:
        return thing.name + (f": {thing.annotation}" if thing.annotation else "")
    if thing.is_class:
        if thing.name not in NOT_CALLED and ("dataclass" in str([d.value for d in thing.decorators]) or "__init__" in thing.members):
            return call(f"class {thing.name}", thing.parameters, "")
        return f"class {thing.name}" + (f"({', '.join(map(str, thing.bases))})" if thing.bases and thing.name not in NOT_CALLED else "")
    return call(thing.name, thing.parameters, f" -> {thing.returns}" if thing.returns else "")


def call(name, parameters, returns):
    parts = listed(parameters)
    one = f"{name}({', '.join(parts)}){returns}"
    return one if len(one) <= 90 else f"{name}(\n" + "".join(f"    {part},\n" for part in parts) + f"){returns}"


def listed(parameters):
    parts, keyword_only = [], False
    for p in parameters:
        if p.name == "self":
            continue
        kind = p.kind.value
        if kind == "keyword-only" and not keyword_only:
            keyword_only = True
            parts.append("*")
        stars = {"variadic positional": "*", "variadic keyword": "**"}.get(kind, "")
        keyword_only |= stars == "*"
        annotation = f": {p.annotation}" if p.annotation else ""
        default = f" = {p.default}" if p.default is not None and not stars else ""
        parts.append(f"{stars}{p.name}{annotation}{default}")
    return parts
