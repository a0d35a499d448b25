"""Steps of patterns: the matches are those of `re`, and what goes back again and again is seen."""

import random
import re

import pytest

from growth import assert_linear
from regex_steps import Counted, Steps

PATTERNS = [
    r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?$|inf$", r"(?:a|ab)(?:c|bcd)?d", r"^[ \t]*(?:\[{1,2}[ \t]*)?(?:[\w-]+[ \t]*\.[ \t]*){2}|[{,]a",
    r"<!--.*?-->|<([a-z]+)(?![a-z.])((?:\"[^\"<]*\"|[^\"'<>])*)>", r"([,;|][\s\"]*)(?=[=@]|[-+](?!\d+\s*(?:,|$)))", r"a{2,4}?b|A{3}",
]  # fmt: skip


@pytest.mark.parametrize("flags", [0, re.MULTILINE | re.DOTALL | re.IGNORECASE])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_what_is_found_is_what_re_finds(pattern, flags):
    rng = random.Random(3)
    compiled, binary = re.compile(pattern, flags), re.compile(pattern.encode(), flags)
    for _ in range(40):
        text = "".join(rng.choice('ab1.,-e<> \t"\n[=') for _ in range(rng.randrange(30)))
        for each, given in ((compiled, text), (binary, text.encode())):
            for how in ("match", "search", "fullmatch"):
                getattr(Counted(each), how)(given)  # it compares


def steps(pattern: str, text: str) -> int:
    counted = Steps(re.compile(pattern))
    counted.search(text)
    return counted.taken


def test_a_number_that_can_be_split_at_every_digit_is_seen():
    """The first is what once read numbers; its digits could belong to two parts."""
    with pytest.raises(AssertionError, match="(0.9|1.0)[0-9] of it grows with the square"):
        assert_linear(lambda n: steps(r"^[-+]?(\d+\.?\d*|\.\d+)$", "1" * n + "x"), 150)
    assert_linear(lambda n: steps(r"^[-+]?(\d+(\.\d*)?|\.\d+)$", "1" * n + "x"), 150)
