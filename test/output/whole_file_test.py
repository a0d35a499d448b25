"""Single files: devices are written to and not replaced."""

from pathlib import Path

import pytest
from writers import ARM

import ksl
from ksl.output import OutputError


@pytest.mark.parametrize("name", ["null", "full"])
def test_devices_are_written_to_and_not_replaced(tmp_path, name):
    device = Path("/dev") / name
    if not device.is_char_device():
        pytest.skip("no such device")
    (tmp_path / "out").symlink_to(device)
    if name == "null":
        ksl.load(writers_urdf(tmp_path)).to_urdf(tmp_path / "out")
    else:
        with pytest.raises(OutputError, match=r"can't be written \(No space left on device\); free some space"):
            ksl.load(writers_urdf(tmp_path)).to_urdf(tmp_path / "out")
    assert device.is_char_device() and (tmp_path / "out").is_symlink()


def writers_urdf(folder: Path) -> Path:
    (folder / "arm.urdf").write_text(ARM)
    return folder / "arm.urdf"
