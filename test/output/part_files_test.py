"""Files of sweeps: written under a name of their own first."""

from ksl.output.part_files import write_part

import sets


def test_the_file_of_a_sweep_does_not_follow_a_link_at_its_unfinished_name(tmp_path):
    (tmp_path / "mine").write_text("mine")
    (tmp_path / ".table.part").symlink_to("mine")
    write_part(tmp_path / "table", b"later")
    assert sets.texts(tmp_path) == {"table": "later", "mine": "mine"} and sets.killing.everything(tmp_path) == {"table", "mine"}
