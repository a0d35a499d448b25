"""scripts/dist/dist.py: how it ends.  What it builds is tried by `make dist`."""

import importlib.util
import sys
import types
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts/dist/dist.py"


@pytest.mark.parametrize("found", [[], ["it has not the stable ABI", "it needs foreign.dll"]])
def test_a_wheel_for_another_system_is_a_success_without_objections(monkeypatch, tmp_path, found):
    monkeypatch.setitem(sys.modules, "sbom", types.ModuleType("sbom"))  # whose packages are those of `make dist` alone
    monkeypatch.setattr(sys, "path", list(sys.path))
    spec = importlib.util.spec_from_file_location("dist_script", SCRIPT)
    dist = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(dist)
    wheel = tmp_path / "ksl.whl"
    wheel.write_bytes(b"")
    monkeypatch.setattr(dist, "OUT", tmp_path / "out")
    monkeypatch.setattr(dist, "build", lambda place, *more: (place.mkdir(parents=True), (wheel, wheel))[1])
    monkeypatch.setattr(dist, "objections", lambda *of: found)
    with pytest.raises(SystemExit) as end:
        dist.one_for("aarch64-linux-musl", None)
    assert end.value.code == ("\n".join(found) or 0)
