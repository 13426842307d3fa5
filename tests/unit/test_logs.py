import json
import logging

import pytest

from gripwright.logs import FIELDS, configure_logs, of_this_process
from gripwright.settings import Settings


@pytest.fixture
def configure(monkeypatch):
    """Configures the log of this process; what was there before comes back."""
    root = logging.getLogger()
    before, level = root.handlers, root.level
    monkeypatch.setattr("gripwright.logs._of_process", {})
    yield lambda log_format: configure_logs(Settings(log_format=log_format))
    root.handlers = before
    root.setLevel(level)


@pytest.mark.parametrize("log_format", ["json", "console", None])
def test_an_event_is_one_line_that_steers_no_terminal(configure, capsys, log_format):
    configure(log_format)

    logging.getLogger("x").info("read %s", "a\nb\r\x1b[31m\u2028\u202e", extra={FIELDS: {"path": "/a\nb\x1b"}})

    written = capsys.readouterr().err
    assert written.count("\n") == 1
    assert not set("\r\x1b\u2028\u202e") & set(written)


def test_a_line_says_what_it_belongs_to_and_how_it_failed(configure, capsys):
    configure("json")
    of_this_process(worker="host-1")

    try:
        raise ValueError("no")
    except ValueError:
        logging.getLogger("x").exception("it failed", extra={FIELDS: {"stage": "fit"}})

    line = json.loads(capsys.readouterr().err)
    assert (line["event"], line["level"], line["worker"], line["stage"]) == ("it failed", "error", "host-1", "fit")
    assert "ValueError: no" in line["exception"]


@pytest.mark.parametrize("secret", ["whsec_c2VjcmV0", "gwk_id_c2VjcmV0", "Bearer c2VjcmV0", "postgresql://ada:c2VjcmV0@host/db"])
def test_no_secret_is_told_even_in_an_exception(configure, capsys, secret):
    configure("json")

    try:
        raise ValueError(f"cannot use {secret} now")
    except ValueError:
        logging.getLogger("x").exception("with %s", secret)

    written = capsys.readouterr().err
    assert "c2VjcmV0" not in written
    assert json.loads(written)["event"].startswith("with ")
