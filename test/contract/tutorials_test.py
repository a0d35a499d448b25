"""The tutorials: their blocks run in order, each page in a folder of its own; they print what the page shows; numbers in the text are theirs."""

import re
import sys
from pathlib import Path

import pytest
from pages import ROOT, TUTORIALS, Walk, blocks_of

sys.path.insert(0, str(ROOT / "scripts"))
from tutorial_pictures import PICTURES
from warm_ksl import waiting

IMAGES = ROOT / "docs" / "images"
PAGES = sorted(path for path in TUTORIALS.glob("*.md") if path.name != "README.md")
NUMBER = re.compile(r"(?<![\w.])[-−+±]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?")


@pytest.fixture(scope="module")
def walks(tmp_path_factory):
    """{page: what has been run of it}."""
    with waiting(tmp_path_factory.mktemp("ksl")) as program:
        made = {page.stem: Walk(page, tmp_path_factory.mktemp(page.stem) / "work", program) for page in PAGES}
        yield made
        for walk in made.values():
            walk.close()


def all_blocks() -> list:
    return [pytest.param(page.stem, k, id=f"{page.stem}:{block.line}-{block.language}") for page in PAGES for k, block in enumerate(blocks_of(page))]


@pytest.mark.parametrize(("page", "k"), all_blocks())
def test_block(walks, page, k):
    """It runs; or, if it shows what the block before it prints, its lines are printed, in this order."""
    walk = walks[page]
    walk.until(k)
    block = walk.blocks[k]
    if k in walk.left_out:
        pytest.skip(walk.left_out[k])
    if block.language == "text":
        source = max(i for i in range(k) if walk.blocks[i].language in ("sh", "python"))
        if source in walk.left_out:
            pytest.skip(walk.left_out[source])
        check_excerpt(block.code, walk.printed[source])


def check_excerpt(excerpt: str, printed: str) -> None:
    """Each line of the excerpt is a line that was printed, in this order, but for blanks; … stands for what is left out."""
    lines = iter([" ".join(line.split()) for line in printed.splitlines()])
    for wanted in (" ".join(line.split()) for line in excerpt.splitlines()):
        if wanted.strip("… "):
            assert any(same(wanted, line) for line in lines), f"not printed, or not in this order: {wanted}\n\n{printed}"


def same(wanted: str, line: str) -> bool:
    """Words are the same; numbers are, but for a unit of the last digit.  A line that ends in … is the beginning of what is printed."""
    begins = wanted.endswith("…")
    wanted = wanted.rstrip("… ")
    number = f"({NUMBER.pattern})"
    pattern = number.join(re.escape(words) for words in NUMBER.split(wanted))
    found = re.match(pattern, line) if begins else re.fullmatch(pattern, line)
    return found is not None and all(close(a, value(b)) for a, b in zip(NUMBER.findall(wanted), found.groups(), strict=True))


def value(text: str) -> float:
    return float(text.replace("−", "-").replace("±", "").replace(",", ""))


def close(printed: str, number: float, units: float = 1.01) -> bool:
    """Whether a printed number is this one, but for some units of its last digit."""
    mantissa, _, exponent = printed.partition("e")
    step = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    return abs(value(printed) - number) <= units * step


def prose(text: str) -> str:
    """Without blocks, headings, links, pictures and names of standards."""
    text = re.sub(r"^```.*?^```$|^#.*?$|<!--.*?-->|!\[.*?\]\(.*?\)|\]\(.*?\)|\b(ROS|ISO|SHA|URDF|COLLADA) ?-?[\d.]+", "", text, flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"`[^`\n]*`", "", text)


@pytest.mark.parametrize("page", [p.stem for p in PAGES])
def test_numbers_in_the_text_are_printed_or_given(walks, page):
    """Each number of the text is, rounded, one that the page's blocks print, or that they contain."""
    walk = walks[page]
    walk.until(len(walk.blocks) - 1)
    if walk.left_out:
        pytest.skip("; ".join(set(walk.left_out.values())))
    text = walk.page.read_text(encoding="utf-8")
    known = [value(n) for n in NUMBER.findall("\n".join([*walk.printed.values(), *(b.code for b in walk.blocks), *re.findall(r"`[^`\n]*`", text)]))]
    strange = [n for n in NUMBER.findall(prose(text)) if not any(close(n, sign * x, 0.501) for x in known for sign in (1, -1))]
    assert not strange, f"numbers that nothing prints: {strange}"


def pictures(path: Path) -> list[str]:
    return re.findall(r"\((?:\S*/)?images/(tutorial_\w+\.png)\)", path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", [ROOT / "README.md", TUTORIALS / "README.md", *PAGES], ids=lambda p: str(p.relative_to(ROOT)))
def test_pictures_exist_and_can_be_made(path):
    for name in pictures(path):
        assert name in PICTURES, f"scripts/tutorial_pictures.py can't make {name}"
        assert (IMAGES / name).stat().st_size <= 150_000


def test_every_picture_is_shown():
    shown = {name for path in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")] for name in pictures(path)}
    assert shown == set(PICTURES) == {path.name for path in IMAGES.glob("tutorial_*.png")}


def test_all_pages_are_in_the_index():
    text = (TUTORIALS / "README.md").read_text(encoding="utf-8")
    assert all(f"({page.name})" in text for page in PAGES) and len(PAGES) == 14


def test_an_excerpt_that_is_not_printed_is_found():
    printed = "a 1.23\nb 4.56\n"
    check_excerpt("a 1.23\n…\nb 4.57\n", printed)
    for wrong in ("a 1.30\n", "b 4.56\na 1.23\n", "c\n"):
        with pytest.raises(AssertionError, match="not printed"):
            check_excerpt(wrong, printed)


def test_the_front_page_lists_every_page():
    """All pages but those of folders that it names whole are in the table of docs/README.md, which is the menu of the site."""
    docs = ROOT / "docs"
    text = (docs / "README.md").read_text(encoding="utf-8")
    assert "(docs/README.md#all-pages)" in (ROOT / "README.md").read_text(encoding="utf-8")
    pages = {p.relative_to(docs).as_posix() for p in docs.rglob("*.md")} - {"README.md"}
    missing = [page for page in pages if f"]({page})" not in text and f"]({page.rpartition('/')[0]}/)" not in text]
    assert not missing


def test_the_page_of_installation_lists_every_extra():
    """All extras of the package but that of the tests."""
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    section = project[project.index("[project.optional-dependencies]") : project.index("[project.scripts]")]
    extras = set(re.findall(r"^(\w+) = \[", section, re.MULTILINE)) - {"test"}
    listed = set(re.findall(r"^\| `(\w+)` \|", (ROOT / "docs/install.md").read_text(encoding="utf-8"), re.MULTILINE))
    assert extras and listed == extras
