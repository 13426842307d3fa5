import importlib
import io
import json
import subprocess
import sys
from pathlib import Path

import pytest

from gripwright.settings import Settings
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.engines import Database
from service_factory import finish_design, make_document, make_package
from service_process import running_service

OPENAPI = Path(__file__).resolve().parents[2] / "openapi"


@pytest.fixture
def generated(tmp_path, monkeypatch):
    """The client that a generator makes of the committed document, without a warning."""
    tools = Path(sys.executable).parent
    command = [
        *(tools / "openapi-python-client", "generate", "--meta", "none", "--fail-on-warning"),
        *("--path", OPENAPI / "openapi.json", "--config", OPENAPI / "client.yaml", "--output-path", tmp_path / "generated"),
    ]
    monkeypatch.setenv("PATH", str(tools), prepend=":")
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 0, run.stdout
    monkeypatch.syspath_prepend(tmp_path)
    return lambda name: importlib.import_module(f"generated.{name}")


def test_a_generated_client_uploads_designs_follows_and_reads_the_result(generated, tmp_path):
    models, types = generated("models"), generated("types")
    package = types.File(payload=io.BytesIO(make_package(make_document("GEN-1"))), file_name="p.zip", mime_type="application/zip")
    with running_service(workers=0, folder=tmp_path) as service, generated("client").Client(base_url=service.address) as client:
        body = models.CreateProductBody(package=package)
        product = generated("api.products.create_product").sync(client=client, body=body)
        request = models.DesignRequest.from_dict({"options": {"plan": "paper"}})
        design = generated("api.designs.create_design").sync(product.id, client=client, body=request, idempotency_key="one")
        again = generated("api.designs.create_design").sync(product.id, client=client, body=request, idempotency_key="one")
        listed = generated("api.products.list_products").sync(client=client, part_number="GEN-1")
        waiting = generated("api.jobs.get_job").sync(design.id, client=client)
        finish(tmp_path / "data", design.id)
        done = generated("api.designs.get_design").sync(design.id, client=client)
        bill = generated("api.designs.get_design_bom").sync_detailed(design.id, client=client)
        finger = generated("api.designs.get_design_file").sync_detailed(design.id, "grippers/G1/finger.step", client=client)
        missing = generated("api.products.get_product").sync("none", client=client)

    assert [item.id for item in listed.items] == [product.id]
    assert again.id == design.id
    assert (waiting.status, waiting.part_number) == ("queued", "GEN-1")
    assert (done.status, done.design["status"]) == ("complete", "complete")
    assert json.loads(bill.content)["items"][0]["part_number"] == "F-1"
    assert finger.content == b"ISO-10303-21;"
    assert isinstance(missing, models.Problem)
    assert missing.type_ == "urn:gripwright:problem:not-found"


def finish(data, design_id):
    database = Database(Settings(data_dir=data).resolved_database_url)
    finish_design(database, ArtifactStore(data / "artifacts"), design_id, {"grippers/G1/finger.step": b"ISO-10303-21;"})
    database.dispose()
