"""A type that lacks what the engine needs of a scalar is refused by the compiler, in words."""

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

PROGRAM = """
#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/kinematics/forward_kinematics.hpp"
#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix.hpp"

struct mine {
  double value;
  mine() = default;
  mine(double x) : value(x) {}
  friend mine operator-(mine a) { return -a.value; }
  friend mine operator+(mine a, mine b) { return a.value + b.value; }
  friend mine operator-(mine a, mine b) { return a.value - b.value; }
  friend mine operator*(mine a, mine b) { return a.value * b.value; }
  friend mine operator/(mine a, mine b) { return a.value / b.value; }
  friend bool operator<(mine a, mine b) { return a.value < b.value; }
  friend bool operator<=(mine a, mine b) { return a.value <= b.value; }
  friend bool operator>(mine a, mine b) { return a.value > b.value; }
  friend bool operator==(mine a, mine b) { return a.value == b.value; }
};
template <> struct ksl::scalar_of_trait<mine> { using type = double; };
template <> struct ksl::math<mine> {
  static constexpr double epsilon = ksl::math<double>::epsilon;
  static mine select(bool c, mine a, mine b) { return c ? a : b; }
  static mine fabs(mine x) { return ksl::math<double>::fabs(x.value); }
  static mine sqrt(mine x) { return ksl::math<double>::sqrt(x.value); }
  static mine sin(mine x) { return ksl::math<double>::sin(x.value); }
  static mine cos(mine x) { return ksl::math<double>::cos(x.value); }
  static mine atan2(mine y, mine x) { return ksl::math<double>::atan2(y.value, x.value); }
  static void sine_cosine(mine x, mine &s, mine &c) { s = sin(x), c = cos(x); }
};
using model = ksl::model_view<double>;
void efforts(const model &m, const ksl::inverse_dynamics_workspace<mine> &d, const mine *x, mine *out) { ksl::inverse_dynamics<mine>(m, d, x, x, x, {}, out); }
void accelerations(const model &m, const ksl::forward_dynamics_workspace<mine> &d, const mine *x, mine *out) { ksl::forward_dynamics<mine>(m, d, x, x, x, {}, out); }
void inertias(const model &m, const ksl::mass_matrix_workspace<mine> &d, const mine *x, mine *out) { ksl::mass_matrix<mine>(m, d, x, out); }
void poses(const model &m, const ksl::forward_kinematics_workspace<mine> &d, const mine *x) { ksl::forward_kinematics<mine>(m, d, x); }
"""


def messages(compiler: str, code: str) -> str:
    command = [compiler, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-I", ROOT / "include", "-x", "c++", "-"]
    done = subprocess.run(command, input=code, capture_output=True, text=True)
    return done.stderr if done.returncode else ""


def without(line: str) -> str:
    (found,) = [x for x in PROGRAM.splitlines() if line in x]
    return PROGRAM.replace(found + "\n", "")


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_a_scalar_with_all_that_is_asked_compiles(compiler):
    assert messages(compiler, PROGRAM) == ""


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_a_scalar_without_its_own_sine_and_cosine_is_refused(compiler):
    said = messages(compiler, without("void sine_cosine"))
    assert "this scalar has no sine and cosine of its own: give it math<T>::sine_cosine(angle, sine, cosine)" in said


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
@pytest.mark.parametrize("line", ["operator/", "mine atan2", "mine select", "epsilon", "operator=="])
def test_a_scalar_that_lacks_something_else_is_refused(compiler, line):
    assert "this type is no scalar for KSL" in messages(compiler, without(line))
