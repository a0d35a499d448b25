"""What tests of cards share: one folder of compiled libraries for all of them, and a card that is none."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # generated_code.py
from fake_card import FakeArray, FakeCard
from generated_code import EXAMPLES

import ksl


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fake_card")


@pytest.fixture
def card(folder, monkeypatch):
    """Compiled text is found again by the next test."""
    monkeypatch.setenv("KSL_CACHE", str(folder / "cache"))
    card = FakeCard(folder, monkeypatch.setattr)
    yield card
    card.fail("", 0)
    card.say(cards=2, version=12040, best=1024)


@pytest.fixture
def cards(card, monkeypatch):
    """Arrays of a library that makes memory for results, and joins arrays, as CuPy does."""
    library = type(sys)("cards")
    like = lambda x, host: type(x)(card, host, x.card, x.stream)
    library.empty_like = lambda x, shape: like(x, np.full(shape, np.nan, x.host.dtype))
    library.full_like = lambda x, number, shape: like(x, np.full(shape, number, x.host.dtype))
    library.broadcast_to = lambda x, shape: like(x, np.broadcast_to(x.host, shape).copy())
    library.concatenate = lambda arrays, axis: like(arrays[0], np.concatenate([x.host for x in arrays], axis))
    monkeypatch.setitem(sys.modules, "cards", library)
    kind = type("Array", (FakeArray,), {"__module__": "cards.core"})
    return lambda x: kind(card, np.array(x), 0, 5)


@pytest.fixture(scope="module")
def ur5():
    return ksl.load(EXAMPLES / "ur5.urdf")
