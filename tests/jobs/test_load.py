"""The short form of `soak/load.py`: whether all goes well, not how fast."""

import asyncio

from service_factory import make_document, make_package
from service_process import running_service
from soak.load import put_under_load


def test_clients_read_and_write_while_designs_are_made_and_every_design_ends(monkeypatch):
    monkeypatch.setattr("soak.load.THINK_S", 0.05)

    with running_service(workers=1) as service:
        load = put_under_load(
            service.address, make_package(make_document(), 20.0), clients=8, seconds=2.0, queue=5, patience_s=60.0
        )
        measured, ends = asyncio.run(load)

    assert len(measured.seconds["read"]) > 10
    assert set(measured.statuses) <= {200, 201, 202}
    assert set(ends) == {"succeeded"}
    assert sum(ends.values()) >= 5
