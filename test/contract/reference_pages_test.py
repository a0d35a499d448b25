"""The reference of the algebra leaves no function out, and says what the headers say."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "algebra"))
sys.path.insert(0, str(ROOT / "scripts"))
from functions import bodies, published
from reference_pages import pages


def test_every_function_is_there():
    rows = re.findall(r"^\| (`\S+`) \| `", "".join(pages().values()), re.M)
    listed = [name.strip("`") for row in rows for name in row.split("<br>")]
    functions = {f.name for f in [*published(), *bodies()] if not f.helper}
    assert functions - set(listed) == set()
    assert len(listed) == len(set(listed)), "a function is listed twice"


def test_flops_are_those_of_the_comments():
    counted = {f.double or f.name: m[1] for f in bodies() if not f.helper and (m := re.search(r"(\d+)\s+flops?\b[^.]*\.\s*\*/", f.doc))}
    rows = re.findall(r"^\| `(\w+)`\S* \| `.*\| ([^|]*) \|$", "".join(pages().values()), re.M)
    flops = {name: re.match(r"\d+", cell)[0] for name, cell in rows if cell}
    assert len(counted) > 250 and {n: c for n, c in counted.items() if flops.get(n) != c} == {}
