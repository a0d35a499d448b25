"""What Python and C count as C++ does: the extension takes and gives numbers of enumerations, whose names stand once on each side."""

import re
from pathlib import Path

import pytest

from ksl.generation.recording import Operation
from ksl.mechanism.requests import KINDS
from ksl.operators.operator import Stage
from ksl.simulation.simulate import METHODS, REASONS
from ksl.simulation.simulation_result import HAPPENINGS

ROOT = Path(__file__).resolve().parents[2]


def enumerators(file: str, declared: str) -> list[str]:
    """The names between the braces behind `declared`."""
    body = (ROOT / file).read_text(encoding="utf-8").split(declared, 1)[1].split("{", 1)[1].split("}", 1)[0]
    return re.findall(r"\w+", re.sub(r"//[^\n]*|/\*.*?\*/", "", body, flags=re.DOTALL))


def lower(names) -> list[str]:
    return [name.lower().replace(" ", "_") for name in names]


@pytest.mark.parametrize(
    "file, declared, names",
    [
        ("include/ksl/simulate.hpp", "enum class stepping", METHODS),
        ("include/ksl/simulate.hpp", "enum class happening", [*HAPPENINGS[:-1], "function"]),
        ("src/generate/graph.hpp", "enum class operation", [step.name for step in Operation]),
        ("python/operators/operation.hpp", "enum class stage", [stage.name for stage in Stage]),
        ("include/ksl/engine/steps/frame_options.hpp", "enum class acceleration_kind", KINDS),
    ],
)
def test_names_of_python_are_in_the_order_of_the_enumeration(file, declared, names):
    assert enumerators(file, declared) == lower(names)


def test_methods_of_c_are_those_of_cpp():
    assert enumerators("include/ksl/engine_simulate.h", "typedef enum ksl_stepping_t") == [f"KSL_{name.upper()}" for name in METHODS]


def test_each_end_of_a_run_has_its_sentence():
    assert len(enumerators("include/ksl/simulate.hpp", "enum class ending")) == len(REASONS)
