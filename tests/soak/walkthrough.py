"""The whole of docs/api.md, its design included, half a minute on a quiet machine: `python tests/soak/walkthrough.py`."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from page_commands import BLOCKS, run_page


@pytest.mark.timeout(1000)
def test_every_command_of_the_page_works_as_printed(tmp_path):
    code, printed = run_page(tmp_path, BLOCKS, workers=2, timeout_s=900)

    assert code == 0, printed[-3000:]
    assert printed.rstrip().endswith("THE END")
    assert '"succeeded"' in printed
    assert '"status":"complete"' in printed
    assert (tmp_path / "design.zip").read_bytes()[:2] == b"PK"
    assert (tmp_path / "rotor-segments.glb").read_bytes()[:4] == b"glTF"
    assert (tmp_path / "beginning.step").stat().st_size == 100


if __name__ == "__main__":
    sys.exit(pytest.main([__file__]))
