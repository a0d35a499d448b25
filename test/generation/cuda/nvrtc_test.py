"""NVRTC: machine code of kernels without a card, what it says of registers, and sentences where it can't.  Those that need the library are left out where it isn't there."""

import struct

import pytest

from ksl.base.errors import CompilerError
from ksl.generation.cuda import nvrtc
from ksl.generation.cuda.figures import figures
from ksl.generation.cuda.kernels import kernels

NOTHING = 'extern "C" __global__ void nothing(float *x) { x[threadIdx.x] = 1.0f; }\n'


@pytest.fixture(scope="module")
def there():
    try:
        return nvrtc.find()
    except CompilerError as e:
        pytest.skip(str(e))


def test_kernels_become_machine_code_that_fits_registers(ur5, there):
    text, made = kernels(ur5, ["inverse_dynamics", "jacobian:tool0"], "float", layouts=("rows", "soa"))
    code = nvrtc.compile(text, "sm_90")
    assert code[:4] == b"\x7fELF" and struct.unpack_from("<H", code, 18) == (190,)  # EM_CUDA
    found = figures(there, text, "sm_90")
    assert set(found) == {k.name for k in made}
    for of in found.values():
        assert 20 < of.registers <= 80 and of.spilled == 0 and of.stack <= 64 and 400 < of.instructions < 4000
    assert found["k_inverse_dynamics_rows"].shared == 4 * 4 * 4 * 32 * 7 and found["k_inverse_dynamics_soa"].shared == 0
    fused = figures(there, text, "sm_90", ["--fmad=true"])
    assert fused["k_inverse_dynamics_soa"].instructions < 0.9 * found["k_inverse_dynamics_soa"].instructions  # so nothing is fused without being asked for


@pytest.mark.parametrize(("text", "architecture", "options", "words"), [
    (NOTHING.replace("1.0f", "y"), "sm_90", [], r"(?s)ended with status 6 for .*failed-\w{16}\.cu, which is kept: kernels\.cu\(1\): error: identifier .y. is undefined"),
    (NOTHING, "sm_9999", [], "makes no code for 'sm_9999'; it knows .*sm_90.*; a newer one may"),
    (NOTHING, "sm90", [], "did you mean sm_90"),
    (NOTHING, "sm_90 -x", [], "makes no code for"),
    (NOTHING, "sm_90", ["--no-such-option"], "doesn't take the options '--no-such-option'"),
])  # fmt: skip
def test_what_it_does_not_compile_is_said(there, text, architecture, options, words):
    with pytest.raises(CompilerError, match=words):
        nvrtc.compile(text, architecture, options)


def test_without_it_a_command_is_named(monkeypatch, tmp_path):
    monkeypatch.delenv(nvrtc.VARIABLE, raising=False)
    monkeypatch.setattr(nvrtc, "_candidates", lambda: iter(["libno-such-nvrtc.so"]))
    with pytest.raises(CompilerError, match=r"there is none: `pip install 'ksl\[cuda\]'` brings it along"):
        nvrtc.compile(NOTHING, "sm_90")
    other = tmp_path / "other.so"
    other.write_text("")
    for named, words in ((tmp_path / "missing.so", "there is no library"), (other, "can't be loaded as NVRTC")):
        monkeypatch.setenv(nvrtc.VARIABLE, str(named))
        with pytest.raises(CompilerError, match=words):
            nvrtc.compile(NOTHING, "sm_90")


def test_packages_are_searched_for_it(monkeypatch, tmp_path):
    """Where CUDA 12 and 13, and torch, put it; the newest of several; nothing of them is imported."""
    monkeypatch.delenv("CUDA_PATH", raising=False)
    monkeypatch.delenv("CUDA_HOME", raising=False)
    places = [tmp_path / place for place in ("nvidia/cuda_nvrtc/lib/libnvrtc.so.12", "nvidia/cu13/lib/libnvrtc.so.13", "torch/lib/libnvrtc.so.12")]
    for place in places:
        place.parent.mkdir(parents=True)
        place.write_text("")
        (place.parent / "libnvrtc-builtins.so.12.9").write_text("")
    (tmp_path / "torch" / "__init__.py").write_text("raise RuntimeError('imported')")
    monkeypatch.setattr(nvrtc, "_package_folders", lambda package: [tmp_path / package.replace(".", "/")])
    monkeypatch.setattr(nvrtc.sys, "platform", "linux")
    assert list(nvrtc._candidates()) == [*map(str, places), *nvrtc.LIBRARIES]
