import pytest
from fastapi.testclient import TestClient

from gripwright.http.app import create_app
from gripwright.settings import Settings
from gripwright.store.designs import JobRepository
from gripwright.traces import place_of
from otlp_collector import collecting
from service_factory import store_product

CALLER = f"00-{'ab' * 16}-{'cd' * 8}-01"


def traceparent_of(service, design_id):
    with service.database.read_sessions() as session:
        return JobRepository(session).get(design_id).traceparent


def test_a_design_belongs_to_the_trace_of_its_caller_below_its_request(tmp_path, monkeypatch):
    with collecting() as collector:
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", f"{collector.url}/v1/traces")
        app = create_app(Settings(data_dir=tmp_path))
        with TestClient(app, base_url="http://localhost") as client:
            service = app.state.service
            product_id = store_product(service.database, service.artifacts)
            path = f"/api/v1/products/{product_id}/designs"
            design_id = client.post(path, json={}, headers={"traceparent": CALLER}).json()["id"]
            client.post(path, json={}, headers={"traceparent": CALLER.removesuffix("1") + "0"})
            place = place_of(traceparent_of(service, design_id))

    (request,) = collector.spans
    assert (request.trace_id, request.parent_id) == ("ab" * 16, "cd" * 8)
    assert (place.trace_id, place.span_id) == (request.trace_id, request.span_id)
    assert request.name == "POST /products/{product_id}/designs"
    assert request.attributes["http.response.status_code"] == 202


NO_TRACES = ["", "no", CALLER + "-x", CALLER.upper(), f"ff{CALLER[2:]}", CALLER.replace("ab", "00"), CALLER.replace("cd", "00")]


@pytest.mark.parametrize("header", NO_TRACES)
def test_a_request_without_a_trace_begins_one(client, service, product_id, header):
    answer = client.post(f"/api/v1/products/{product_id}/designs", json={}, headers={"traceparent": header})

    place = place_of(traceparent_of(service, answer.json()["id"]))
    assert place is not None
    assert place.trace_id != "ab" * 16
    assert place.is_sampled
