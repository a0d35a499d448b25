"""A card that is none: the driver of fake_driver.cpp, machine code of the processor's compiler, and arrays whose memory the driver calls a card's."""

import ctypes
import re
import subprocess
import weakref
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from ksl.generation.card import compiled
from ksl.generation.card.driver import Driver
from ksl.generation.cuda import nvrtc

HERE = Path(__file__).parent
KERNEL = re.compile(r'extern "C" __global__ void __launch_bounds__\(\d+\) (\w+)\(([^)]*)\)')


def fake_driver(folder: Path) -> Path:
    """The library of the driver, compiled into this folder if it isn't there."""
    library = folder / "fake_driver.so"
    if not library.exists():
        subprocess.run(["g++", "-std=c++20", "-O1", "-shared", "-fPIC", "-fvisibility=hidden", HERE / "fake_driver.cpp", "-o", library, "-ldl"], check=True)
    return library


RUN = """
#define EXPORT extern "C" __attribute__((visibility("default")))
EXPORT void fake_run(void (*called)(void **), void **given, unsigned blocks, unsigned threads) { on_host::grid(blocks, threads, [&] { called(given); }); }
"""


def image(text: str, architecture: str, folder: Path) -> bytes:
    """What the fake driver loads for a text of kernels."""
    calls = RUN
    for name, parameters in KERNEL.findall(text):
        types = [re.sub(r"\w+$", "", parameter) for parameter in parameters.split(", ")]
        taken = ", ".join(f"*({of} *)given[{k}]" for k, of in enumerate(types))
        calls += f"EXPORT void {name}_called(void **given) {{ {name}({taken}); }}\n"
    number = len(list(folder.glob("kernels_*.cpp")))
    source, library = folder / f"kernels_{architecture}_{number}.cpp", folder / f"kernels_{architecture}_{number}.so"
    source.write_text('#include "on_host.hpp"\n' + text + calls)
    flags = ["-std=c++17", "-O0", "-ffp-contract=off", "-w", "-shared", "-fPIC", "-fvisibility=hidden", f"-I{HERE.parent / 'cuda'}"]
    subprocess.run(["g++", *flags, source, "-o", library], check=True)
    return b"FAKE" + str(library).encode()


class FakeCard:
    """The fake driver in place of the system's.  set: a monkeypatch's setattr."""

    def __init__(self, folder: Path, set_) -> None:
        self.folder, self.compiled = folder, []
        path = fake_driver(folder)
        self.library = ctypes.CDLL(str(path))
        self.library.fake_own.argtypes = [ctypes.c_uint64, ctypes.c_uint64, ctypes.c_int]
        self.library.fake_free.argtypes = [ctypes.c_uint64]
        set_(compiled, "system_driver", lambda: Driver(str(path)))
        set_(nvrtc, "compile", self._compile)
        self.nvrtc = lambda *version: set_(nvrtc, "find", lambda: SimpleNamespace(version=version))
        self.nvrtc(12, 9)

    def _compile(self, text: str, architecture: str) -> bytes:
        self.compiled.append(architecture)
        return image(text, architecture, self.folder)

    def __getitem__(self, name: str) -> int:
        return (
            ctypes.c_uint64.in_dll(self.library, f"fake_{name}").value
            if name in ("stream", "blocks", "threads", "card")
            else ctypes.c_int.in_dll(self.library, f"fake_{name}").value
        )

    def say(self, **values: int) -> None:
        """What the driver says from now on: version, cards."""
        for name, value in values.items():
            ctypes.c_int.in_dll(self.library, f"fake_{name}").value = value

    def fail(self, function: str, code: int) -> None:
        """This function of the driver returns a code from now on; "" none."""
        ctypes.memmove(ctypes.addressof(ctypes.c_char.in_dll(self.library, "fake_failing")), function.encode() + b"\0", len(function) + 1)
        self.say(code=code)

    def array(self, x, card: int = 0, stream: int | None = None) -> "FakeArray":
        return FakeArray(self, np.array(x), card, stream)


class FakeArray:
    """An array on the fake card, with the array interface, as Numba's are.  `host` is its memory."""

    def __init__(self, of: FakeCard, host: np.ndarray, card: int, stream: int | None) -> None:
        self.of, self.host, self.card, self.stream = of, host, card, stream
        self.base = host if host.base is None else host.base
        if self.base.size:
            of.library.fake_own(self.base.ctypes.data, self.base.nbytes, card)
            weakref.finalize(self.base, of.library.fake_free, self.base.ctypes.data)

    def view(self, slices) -> "FakeArray":
        return type(self)(self.of, self.host[slices], self.card, self.stream)

    @property
    def __cuda_array_interface__(self):
        given = {"version": 3, "shape": self.host.shape, "typestr": self.host.dtype.str, "data": (self.host.ctypes.data, False), "stream": self.stream}
        return given | ({} if self.host.flags.c_contiguous else {"strides": self.host.strides})
