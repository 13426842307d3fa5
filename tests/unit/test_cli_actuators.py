"""The catalogue on the command line."""

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from gripwright.cli.actuators import actuators

OWN = "maker,model,type,fingers,stroke_mm,stroke_basis\nAcme,C-12,centric,3,5,per-jaw\n"


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("GRIPWRIGHT_DATA", str(tmp_path / "data"))
    made = tmp_path / "own.csv"
    made.write_text(OWN, encoding="utf-8")
    return made


def run(*arguments: str) -> Result:
    return CliRunner().invoke(actuators, list(arguments))


def listed() -> dict[str, str]:
    """The line of each actuator, by name."""
    return {line.split("  ")[0]: line for line in run().output.splitlines()}


def test_conflicts_and_unknown_figures_are_listed_as_such(file: Path) -> None:
    lines = listed()

    assert lines["SMC/MHC2-6"] == (
        "SMC/MHC2-6  angular-2  stroke unknown  force unknown  A  no-stroke "
        "(opening angle 30 to -10 deg; holding moment 0.038 Nm at 0.5 MPa)"
    )
    assert "C  conflicting-figures (CONFLICT: " in lines["SMC/MHSL3-32D (as in paper)"]
    assert lines["SMC/MHSL3-32D"].endswith("  centric-3  16 mm  force unknown  A")


def test_a_dry_run_says_what_an_import_would_do_and_does_nothing(file: Path) -> None:
    tried = run("import", str(file), "--dry-run")
    before = listed()
    done = run("import", str(file))

    assert (tried.exit_code, tried.output) == (done.exit_code, done.output) == (0, "added: Acme/C-12\n")
    assert "Acme/C-12" not in before
    assert listed()["Acme/C-12"] == "Acme/C-12  centric-3  10 mm  force unknown  B"
