"""The warnings of cmake/warnings.txt, which says where each is given."""

from pathlib import Path

LIST = Path(__file__).resolve().parents[2] / "cmake/warnings.txt"


def options(family, language, test=False):
    """The options for gcc or clang, "c" or "c++", in the order of the list."""
    here = {family, language, *(["tests"] if test else [])}
    lines = (line.partition("#")[0].split() for line in LIST.read_text(encoding="utf-8").splitlines())
    return [words[-1] for words in lines if words and here.issuperset(words[:-1])]
