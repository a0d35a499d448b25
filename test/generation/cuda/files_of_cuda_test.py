"""`ksl generate --cuda`: NAME.cuh and NAME.cu, which compilers take, and what README.md says of them."""

import sys

import numpy as np
import pytest
from generated_code import EXAMPLES, run
from on_host import Kernels

import ksl
from ksl.base.errors import CompilerError
from ksl.generation.arguments import arguments_given
from ksl.generation.cuda import files, nvrtc
from ksl.generation.cuda.kernels import signatures
from ksl.generation.requests import functions_of

ASKED = ["inverse_dynamics", "jacobian:tool0", "vjp.reactions:elbow"]
USER = """
#include "p.cuh"
extern "C" void effort(const float *q, float *v, const float *a, float *tau) {
  float own[6];
  p_inverse_dynamics(q, v, a, own); /* arrays of the thread's own, const or not */
  for (int k = 0; k < 6; ++k)
    tau[k] = own[k];
}
"""


def test_kernels_of_the_files_compute_and_so_do_functions_of_a_thread(ur5, tmp_path):
    ksl.generate(ur5, ASKED, tmp_path, name="p", scalar="float", cuda=True)
    functions = functions_of(ur5, ASKED, arguments_given(ur5, []), True, "refuse")
    made = signatures(functions, "p_", "float", files.LAYOUTS)
    code = Kernels('#include "p.cu"\n' + USER, made, tmp_path)
    q, v, a = np.random.default_rng(5).normal(size=(3, 50, 6)).astype(np.float32)
    expected = ur5.inverse_dynamics(q, v, a)
    for coalesced in (False, True):
        assert np.array_equal(code("inverse_dynamics", [q, v, a], coalesced)[0], expected)
        assert np.array_equal(code("jacobian_tool0", [q], coalesced)[0], ur5.jacobian(q, "tool0"))
    own = np.empty(6, np.float32)
    code.library.effort(*(x.ctypes.data_as(code.pointer) for x in (q[3].copy(), v[3].copy(), a[3].copy(), own)))
    assert np.array_equal(own, expected[3])


def test_the_command_and_the_page(tmp_path):
    page = (EXAMPLES.parents[1] / "docs" / "card.md").read_text(encoding="utf-8")
    command = next(line for line in page.splitlines() if line.startswith("ksl generate"))
    run(sys.executable, "-m", "ksl", *command.replace("build/ur5_cuda", str(tmp_path)).split()[1:], cwd=EXAMPLES.parents[1])
    header = (tmp_path / "ur5.cuh").read_text()
    called = page.split("```cuda\n")[1].split("```")[0]
    declared = next(line for line in header.splitlines() if line.startswith('extern "C"') and "inverse_dynamics_rows" in line)
    assert "ur5_inverse_dynamics_rows<<<" in called and called.count(", 6") == declared.count("_stride")
    assert "#define UR5_INVERSE_DYNAMICS_THREADS 128\n" in header and "UR5_INVERSE_DYNAMICS_THREADS" in called


@pytest.mark.parametrize("contract", [False, True])
def test_without_nvrtc_readme_says_how_registers_are_seen(ur5, tmp_path, monkeypatch, contract):
    def none():
        raise CompilerError("there is none")

    monkeypatch.setattr(files, "find", none)
    ksl.generate(ur5, ["inverse_dynamics"], tmp_path, name="p", cuda=True, contract=contract)
    readme, header = (tmp_path / "README.md").read_text(), (tmp_path / "p.cuh").read_text()
    assert "nvcc -Xptxas -v" in readme and "pip install 'ksl[cuda]'" in readme
    assert ("--fmad=false" in readme) == (not contract) and ("#error" in header) == (not contract)
    assert "p_inverse_dynamics_rows<<<" in readme and header.isascii()


def test_fast_mathematics_are_refused_and_registers_are_listed(ur5, tmp_path):
    try:
        found = nvrtc.find()
    except CompilerError as e:
        pytest.skip(str(e))
    ksl.generate(ur5, ["inverse_dynamics", "forward_dynamics"], tmp_path, name="p", cuda=True, scalar="float")
    rows = [line.strip("| ").split(" | ") for line in (tmp_path / "README.md").read_text().splitlines() if line.startswith("| `p_") and line.count("|") == 8]
    registers = {row[0].strip("`"): int(row[1]) for row in rows if "_dynamics_" in row[0] or "simulate" in row[0]}
    bounds = {"p_inverse_dynamics_rows": 64, "p_inverse_dynamics_soa": 64, "p_forward_dynamics_rows": 168, "p_forward_dynamics_soa": 168, "p_simulate": 200}
    assert set(registers) == set(bounds) and all(30 < registers[name] <= bound for name, bound in bounds.items()), registers
    with pytest.raises(CompilerError, match="fast mathematics"):
        found.compile((tmp_path / "p.cuh").read_text(), "sm_90", ["--use_fast_math"])
