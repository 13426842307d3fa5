import json

import pytest

from page_commands import BLOCKS, run_page


@pytest.mark.timeout(250)
def test_the_commands_of_the_page_that_need_no_finished_design_work_as_printed(tmp_path):
    blocks = [block for block in BLOCKS if "$design" not in block and "replayed" not in block]  # what is replayed is a design

    code, printed = run_page(tmp_path, blocks, workers=0, timeout_s=200)

    assert code == 0, printed[-3000:]
    assert printed.rstrip().endswith("THE END")
    assert "\n304\n" in printed
    assert '{"plm":"4711"}' in printed
    assert json.loads((tmp_path / "product.json").read_text())["external_ids"] == {"plm": "4711"}
    assert (tmp_path / "rotor.glb").read_bytes()[:4] == b"glTF"
    assert len(blocks) >= 8
