"""Generated C on microcontrollers: float never needs double, and emulated processors compute the engine's bits (bench/embedded)."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from generated_code import EXAMPLES, run
from ksl_command import run_ksl

import ksl

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/embedded"))
from measure import ALGORITHMS as LABELS
from measure import PAGE, estimated, version
from programs import code_of, measured, write
from targets import TARGETS

ALGORITHMS = [name.replace("LINK", "tool0") for name in LABELS]
MATHEMATICS = "#define INFINITY (1.0f / 0.0f)\n" + "".join(
    f"{t} {name}{f}({', '.join([t] * n)});\n" for name, n in (("sqrt", 1), ("fabs", 1), ("fma", 3), ("atan2", 2)) for t, f in (("double", ""), ("float", "f"))
)
ON_A_MACHINE = {name: [f"{target.tools}gcc", target.emulator[0]] for name, target in TARGETS.items()}


@pytest.mark.parametrize("compiler", ["clang", "arm-none-eabi-gcc"])
def test_float_needs_no_double_on_a_cortex_m4f(ur5, tmp_path, compiler):
    """Functions of the compiler's library that compute in double, or convert by way of it: __aeabi_dmul, __aeabi_f2d, __aeabi_f2lz …"""
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} isn't installed: make embedded installs it")
    ksl.generate(ur5, [*ALGORITHMS, "forward_dynamics", "energy"], tmp_path, name="p", scalar="float")
    (tmp_path / "math.h").write_text(MATHEMATICS)
    here = ["-target", "thumbv7em-none-eabihf", "-nostdlibinc"] if compiler == "clang" else ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard"]
    run(
        compiler,
        *here,
        "-mfpu=fpv4-sp-d16",
        "-std=c99",
        "-O2",
        "-ffp-contract=off",
        "-fno-math-errno",
        "-Wdouble-promotion",
        "-Werror",
        "-I.",
        "-c",
        "p.c",
        "-o",
        "p.o",
        cwd=tmp_path,
    )
    asked = {line.split()[-1] for line in run("nm", "-u", "p.o", cwd=tmp_path).splitlines()}
    assert asked <= {"__aeabi_l2f", "memset", "memcpy", "__aeabi_memclr4"}  # l2f rounds by integers alone


@pytest.mark.parametrize("name", TARGETS)
def test_emulated_processors_compute_the_bits_of_the_engine(ur5, tmp_path, name):
    for tool in ON_A_MACHINE[name]:
        if not shutil.which(tool):
            pytest.skip(f"{tool} isn't installed: make embedded installs it")
    plugin = tmp_path / "count.so"
    run("cc", "-O1", "-shared", "-fPIC", ROOT / "bench/arm/count_instructions.c", "-o", plugin, cwd=tmp_path)
    code = code_of(ur5, "ur5", "float", ALGORITHMS)
    found = measured(TARGETS[name], code, tmp_path / "code", plugin)  # compares every bit, and runs the self-test
    for f in code.functions:
        m = found[f.name]
        assert f.recording.arithmetic < m.instructions < 3 * len(f.recording.operations) + 2 * sum(f.recording.sizes()) + 100 * f.recording.angles
        assert m.declared <= m.stack <= m.declared + 64  # -fstack-usage, and the library's conversion of large angles
    page = PAGE.read_text(encoding="utf-8")
    if version(f"{TARGETS[name].tools}gcc") not in page:
        pytest.skip("the page's tables are of another compiler")
    alone = code_of(ur5, "ur5", "float", ALGORITHMS[:1])
    TARGETS[name].compile(write(alone, tmp_path / "alone"), tmp_path / "alone.o")
    flash = TARGETS[name].flash(tmp_path / "alone.o")
    assert 0.9 < flash / estimated(alone) < 1.4
    for f, label in zip(code.functions, LABELS.values()):
        rows = [line.split("|")[2:-1] for line in page.splitlines() if line.startswith(f"| UR5, {label}, float ")]
        told = [int(row[list(TARGETS).index(name)].replace(",", "")) for row in rows]
        assert [told[0], told[2]] == [found[f.name].instructions, found[f.name].stack] and (f.row != "inverse_dynamics" or told[1] == flash)


def test_code_larger_than_the_flash_is_refused(ur5, tmp_path):
    with pytest.raises(
        ValueError, match=r"flash=4000: the code takes about 4,\d+ bytes on a Cortex-M that computes float in hardware.*inverse_dynamics.*state more flash"
    ):
        ksl.generate(ur5, ["inverse_dynamics"], tmp_path / "out", scalar="float", flash=4000)
    with pytest.raises(ValueError, match="flash=-1: expected a number of bytes"):
        ksl.generate(ur5, ["inverse_dynamics"], tmp_path / "out", flash=-1)
    assert not (tmp_path / "out").exists()
    ksl.generate(ur5, ["inverse_dynamics"], tmp_path / "out", scalar="float", flash=5000)


@pytest.mark.parametrize(
    ("option", "value"), [("--flash", "4000"), ("--flash", "-1"), ("--scalar", "half"), ("--lanes", "3"), ("--name", "2p"), ("--undetermined", "some")]
)
def test_the_command_names_its_option(tmp_path, option, value):
    said = run_ksl("generate", EXAMPLES / "ur5.urdf", "--algorithms", "inverse_dynamics", option, value, "-o", tmp_path / "out")
    assert said.returncode == 2 and said.stderr.startswith(f"ksl: {option} {value}: ")


# gcc 12.2 for Cortex-M4F in float and M7 in double, -O2: text and data as `size` counts them.
@pytest.mark.parametrize(
    ("scalar", "algorithm", "size"),
    [
        ("float", "inverse_dynamics", 4504),
        ("float", "forward_dynamics", 13936),
        ("float", "inverse_dynamics_derivatives", 31312),
        ("double", "mass_matrix", 4820),
        ("double", "forward_dynamics", 15748),
    ],
)
def test_the_estimate_is_near_what_gcc_makes(ur5, tmp_path, scalar, algorithm, size):
    ksl.generate(ur5, [algorithm], tmp_path, name="p", scalar=scalar)
    said = (tmp_path / "README.md").read_text().split("takes about ")[1].split()[0]
    assert 0.9 < size / int(said.replace(",", "")) < 1.1
    assert ("soft-float" in (tmp_path / "README.md").read_text()) is (scalar == "double")


def test_the_manifest_compiles_the_source_alone(ur5, tmp_path):
    ksl.generate(ur5, ["mass_matrix"], tmp_path, name="p")
    manifest = json.loads((tmp_path / "library.json").read_text())
    assert manifest["name"] == "p" and manifest["headers"] == "p.h" and manifest["version"] == ksl.__version__
    assert manifest["build"] == {"srcDir": ".", "includeDir": ".", "srcFilter": "+<p.c>", "flags": ["-ffp-contract=off"]}
    long = ksl.Builder("r" * 300).add_link("base").add_link("l", 1.0, (0.1, 0, 0)).add_joint("j", "revolute", "base", "l", axis=(0, 0, 1)).build()
    ksl.generate(long, ["mass_matrix"], tmp_path / "long", name="p")  # names of 50 characters, descriptions of 255: platformio/assets/schema/library.json
    assert len(json.loads((tmp_path / "long/library.json").read_text())["description"]) == 255
    ksl.generate(ur5, ["mass_matrix"], tmp_path, name="p", contract=True)
    assert json.loads((tmp_path / "library.json").read_text())["build"]["flags"] == []
