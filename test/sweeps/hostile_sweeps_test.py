"""Values of TOML files that are of another kind, or larger, than what is asked for: refused with a sentence."""

import pytest

from ksl.base.errors import CaseError, MotionError, SizingError, SweepError
from ksl.base.toml_files import toml_of
from ksl.motions.files.map_file import map_of
from ksl.sweeps.description import sweep_from

HUGE = "9" * 400
"""More than a floating-point number can be."""


def sweep_of(vary: str):
    return sweep_from(toml_of(f'[base]\nmotion = "m.csv"\n[[vary]]\n{vary}\n', "sweep.toml", SweepError), "sweep.toml")


@pytest.mark.parametrize(
    "vary, said",
    [
        ('kind = { a = 1 }\nvalues = [1]', "kind = {'a': 1}; expected one of payload"),
        ('kind = ["payload"]\nvalues = [1]', "kind = ['payload']; expected one of payload"),
        ('kind = "payload"\nlink = [1]\nname = "x"\nvalues = [1]', "link = [1]; expected the name of a link"),
        (f'kind = "speed"\nvalues = [{HUGE}]', "a whole number of more than 64 bits"),
    ],
    ids=["a table", "a list", "a link", "a huge number"],
)  # fmt: skip
def test_values_that_no_sweep_has(vary, said):
    with pytest.raises(SweepError) as refusal:
        sweep_of(vary)
    assert said in str(refusal.value)


@pytest.mark.parametrize("error", [CaseError, MotionError, SizingError, SweepError])
@pytest.mark.parametrize("value", [HUGE, f"-{HUGE}", str(1 << 63), f"0x{'f' * 17}", f"[[1, {HUGE}]]", f"{{ b = {HUGE} }}"])
def test_whole_numbers_beyond_64_bits_are_no_toml(error, value):
    with pytest.raises(error, match="a whole number of more than 64 bits"):
        toml_of(f"a = {value}", "file.toml", error)


def test_whole_numbers_of_64_bits_and_long_words_are():
    assert toml_of(f"a = {(1 << 63) - 1}\nb = '{HUGE}'\nc{HUGE} = {-(1 << 63)}", "file.toml", SweepError)["a"] == (1 << 63) - 1


def test_numbers_of_a_program_that_no_float_holds():
    with pytest.raises(SweepError, match="expected finite numbers"):
        sweep_from({"base": {"motion": "m.csv"}, "vary": [{"kind": "speed", "values": [10**400]}]})
    with pytest.raises(SweepError, match="expected three finite numbers"):
        sweep_from({"base": {"motion": "m.csv"}, "vary": [{"kind": "tilt", "axis": [10**400, 0, 0], "values": [1]}]})


@pytest.mark.parametrize("text", [f"[constants]\na = {HUGE}", f'[columns]\na = {{ to = "b", scale = {HUGE} }}'])
def test_maps_with_huge_numbers(text):
    with pytest.raises(MotionError, match="64 bits"):
        map_of(text)
