"""What kernels take of a card: registers, what is spilled, and instructions, as NVRTC says it; no card is needed.

    python bench/kernels.py [sm_90] [--fmad=true]

Prints a table of the kernels of rows of arms and of a humanoid (`pip install 'ksl[cuda]' example-robot-data`).  Checked by hand, not in CI: the figures are those of one
version of NVRTC, which the table names (docs/decisions/0035-kernels.md)."""

import sys
import sysconfig
import time
from pathlib import Path

import ksl
from ksl.generation.cuda.figures import figures
from ksl.generation.cuda.kernels import kernels
from ksl.generation.cuda.nvrtc import find

EXAMPLES = Path(__file__).resolve().parents[1] / "examples/robots"
TALOS = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots/talos_data/robots/talos_reduced.urdf"
ARMS = [
    "inverse_dynamics",
    "forward_dynamics",
    "mass_matrix",
    "reactions",
    "frame_poses",
    "inverse_dynamics_derivatives",
    "vjp.inverse_dynamics",
    "jacobian:{}",
]
LARGE = ["inverse_dynamics", "forward_dynamics", "mass_matrix", "reactions"]


def robots():
    yield "UR5", ksl.load(EXAMPLES / "ur5.urdf"), [row.format("tool0") for row in ARMS]
    panda = ksl.load(EXAMPLES / "panda.urdf")
    yield "Panda", panda, [row.format(panda.link_names[-1]) for row in ARMS]
    yield "Talos", ksl.load(TALOS), LARGE


def main():
    options = [word for word in sys.argv[1:] if word.startswith("--")]
    architecture = next((word for word in sys.argv[1:] if word.startswith("sm_")), "sm_90")
    nvrtc = find()
    print(f"NVRTC {'.'.join(map(str, nvrtc.version))}, {architecture} {' '.join(options)}\n")
    print("| | | operations | registers | bytes spilled | stack | instructions | of local memory | compiled in |\n|---|---|---|---|---|---|---|---|---|")
    for name, m, rows in robots():
        for row in rows:
            for scalar in ("float", "double"):
                text, (kernel,) = kernels(m, [row], scalar)
                begin = time.process_time()
                (found,) = figures(nvrtc, text, architecture, options).values()
                seconds = time.process_time() - begin
                steps = kernel.function.recording.arithmetic
                print(
                    f"| {name}: {row} | {scalar} | {steps} | {found.registers} | {found.spilled} | {found.stack} | {found.instructions} | {found.local} | {seconds:.1f} s |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
