#!/usr/bin/env python3
"""Write every type and function of the C algebra, made from the comments of the flattened header.

scripts/reference_pages.py [FOLDER]    build/reference by default; the site has the same pages"""

import re
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from single_header import ROOT, sections

COMMENT = r"(?:/\*\*((?:(?!\*/).)*?)\*/\n)?"
FUNCTION = re.compile(COMMENT + r"^(KSL_INLINE|KSL_EXPORT) ([\w ]+?[ *]+)(\w+)\(([^)]*)\)(?: \{|;)", re.S | re.M)
TYPE = re.compile(r"/\*\*((?:(?!\*/).)*?)\*/\ntypedef (union|struct|enum) \w+ \{\n(.*?)^\} (\w+);", re.S | re.M)
FLOPS = re.compile(r"\s*\b(\d+) flops?((?:,| and| for) [^.]*)?\.(?=\s|$)")
NOTE = "<!-- Made by scripts/reference_pages.py from the headers' own comments. -->\n"


@dataclass
class Function:
    names: list
    returns: str
    args: str
    text: str
    flops: str


def one_line(text):
    return re.sub(r"\s+", " ", text or "").strip()


def escape(text):
    return re.sub(r"([*_<|\[\]\\])", r"\\\1", text).replace("\\](", "\\]\\(")  # no link


def stem(name):
    """The name that all variants of a function share: of ksl_screwf_copy and ksl_screw_copy, of ksl_array2Dui_free ..."""
    name = re.sub(r"^ksl_(array2D|array|triang|swap|allclose)(f|i|ui|c|b)?(?=_|$)", r"ksl_\1", name)
    name = re.sub(
        r"^ksl_(\w+?3|\w+?4|SE3|quaternion|screw|coscrew|inertia|spatial_inertia|articulated_inertia|joint_space|motion|force|plucker|eulerangles|"
        r"mat3x3|mat4x4)f(?=_|$)",
        r"ksl_\1",
        name,
    )
    return name


def functions(text):
    """Functions of a header in their order, variants with the same comment as one."""
    found, by_double = [], {}
    for doc, _, returns, name, args in FUNCTION.findall(text):
        doc, cost = one_line(doc), FLOPS.search(one_line(doc))
        for double in (stem(name), stem(name.removesuffix("f"))):
            if double in by_double and by_double[double][0] == doc and name not in by_double[double][1].names:
                by_double[double][1].names.append(name)
                break
        else:
            f = Function([name], one_line(returns), one_line(args), FLOPS.sub("", doc), cost[1] + (cost[2] or "") if cost else "")
            found.append(f)
            by_double[stem(name)] = doc, f
    return found


def members(kind, text):
    """Each line of a union, struct or enum, without comments on the line."""
    lines = [re.sub(r"\s*/\*\*<\s*(.*?)\s*\*/", r" — \1", line).strip() for line in text.splitlines()]
    out = []
    for line in filter(None, lines):
        code, _, remark = line.partition(" — ")
        code = re.sub(r"^KSL_VIEW \{\s*(.*?)\s*\};$", r"\1", code).rstrip(",")
        out.append(f"`{code}`" + (f" {remark}" if remark else ""))
    return " · ".join(out)


def comments(text):
    """What a header says about itself, its parts' own words included: comments that belong to no declaration."""
    found = re.findall(r"^/\*(?!\*)((?:(?!\*/).)*?)\*/\n(?=\n|#define KSL_\w+_H\n)", text, re.S | re.M)
    return [c for c in dict.fromkeys(found) if "---" not in c and "not for lanes" not in c and len(c.split()) > 4 and c.strip()[0].isupper()]


def paragraphs(text):
    """A comment as Markdown: indented or numbered lines keep their form."""
    out = []
    for part in re.split(r"\n[ \t]*\n", text.strip()):
        lines = part.splitlines()
        if (len(lines) > 1 and any(re.match(r" {5}", line) for line in lines)) or re.match(r" {5}", part):
            out.append(textwrap.indent(textwrap.dedent(part), "    "))
        else:
            out.append(escape(one_line(part)))
    return "\n\n".join(out)


def capital(text):
    return text[:1].upper() + text[1:]


def page(header, text):
    intro = comments(text)
    lines = [f"# {header}\n", NOTE]
    title, *rest = intro or [f"KSL: {header}"]
    title = capital(re.sub(r"^\s*KSL: ", "", title))
    lines.append(paragraphs(title) + "\n")
    lines += [paragraphs(part) + "\n" for part in rest]
    types = [t for t in TYPE.findall(text) if not re.fullmatch(r"ksl_\w+f_t", t[3])]
    if types:
        lines.append("Types of numbers have a twin in single precision, `f` before `_t`. Members of a union, between dots, are views on the same numbers.\n")
        lines.append("| type | what it is | members |\n|---|---|---|")
        lines += [f"| `{name}` | {escape(one_line(doc))} | {members(kind, body)} |" for doc, kind, body, name in types]
        lines.append("")
    found = functions(text)
    if found:
        lines.append("| function, its twins | arguments → result | what it computes | flops |\n|---|---|---|---|")
        for f in found:
            names = "<br>".join(f"`{n}`" for n in f.names)
            result = "" if f.returns == "void" else f" → `{f.returns}`"
            lines.append(f"| {names} | `{f.args}`{result} | {escape(f.text)} | {f.flops} |")
        lines.append("")
    macros = sorted(set(re.findall(r"^#define (ksl_\w+)\(", text, re.M)))
    if macros:
        lines.append("Macros: " + ", ".join(f"`{m}`" for m in macros) + ".\n")
    return "\n".join(lines), title, sum(len(f.names) for f in found)


def pages():
    """File name → text."""
    out, rows, total = {}, [], 0
    for header, text in sorted(sections(), key=lambda s: s[0].lower()):
        if header == "ksl/config.h":
            continue
        body, title, count = page(header, text)
        name = Path(header).stem + ".md"
        out[name] = body
        total += count
        what = escape(re.split(r"\.\s|:\s|\n\n", title)[0].strip().rstrip(".").replace("\n", " "))
        rows.append(f"| [{header}]({name}) | {re.sub(r' +', ' ', what)} | {count or ''} |")
    head = [
        "# Reference of the C algebra\n",
        NOTE,
        f"{total} functions, double and float counted apart. The arguments shown are those of the first name; its twin in single precision takes `float` and",
        "`ksl_..f_t`. How names are made is in [algebra.md](../algebra.md). Flops are additions, multiplications and divisions; a test counts them.",
        "Numbers like (coscrews (6)) are equations of the Coscrews page. Algorithms of mechanisms: [Dynamics](dynamics.md).\n",
        "| header | what | functions |\n|---|---|---|",
    ]
    out["README.md"] = "\n".join(head + rows) + "\n"
    return out


"""Pages that scripts/generate.py writes."""


def main(argv):
    folder = Path(argv[0]) if argv else ROOT / "build" / "reference"
    folder.mkdir(parents=True, exist_ok=True)
    texts = pages()
    for old in folder.glob("*.md"):
        if old.name not in texts:
            old.unlink()
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    print(f"{folder}: {len(texts)} pages")


if __name__ == "__main__":
    main(sys.argv[1:])
