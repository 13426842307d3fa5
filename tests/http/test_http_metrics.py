from prometheus_client.parser import text_string_to_metric_families


def samples(client):
    """(name, labels) → value of all that the service tells Prometheus."""
    answer = client.get("/metrics")
    assert answer.headers["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
    families = text_string_to_metric_families(answer.text)
    return {(sample.name, *sorted(sample.labels.items())): sample.value for family in families for sample in family.samples}


def test_requests_are_counted_and_timed_by_route_so_that_ids_make_no_series(client, design_id):
    route = ("route", "/jobs/{job_id}")
    before = samples(client).get(("gripwright_http_requests_total", ("method", "GET"), route, ("status", "200")), 0)

    client.get(f"/api/v1/jobs/{design_id}")
    client.request("BREW", "/api/v1/jobs")

    seen = samples(client)
    assert seen["gripwright_http_requests_total", ("method", "GET"), route, ("status", "200")] == before + 1
    assert seen["gripwright_http_request_duration_seconds_count", ("method", "GET"), route] >= 1
    assert not any(design_id in str(name) or "BREW" in str(name) for name in seen)


def test_the_queue_and_what_became_of_designs_are_told_of_all_processes(client, product_id, jobs, finish):
    outcome = "gripwright_design_duration_seconds_count"
    before = samples(client)
    ids = [client.post(f"/api/v1/products/{product_id}/designs", json={}).json()["id"] for _ in range(3)]
    finish(ids[0])
    jobs.start(ids[1], 1)
    jobs.fail(ids[1], 1, {"code": "step-failure", "detail": "no"})
    jobs.fail(ids[1], 1, {"code": "step-failure", "detail": "again"})

    seen = samples(client)

    assert seen["gripwright_jobs", ("status", "queued")] == before["gripwright_jobs", ("status", "queued")] + 1
    assert seen["gripwright_oldest_queued_seconds",] > 0
    for code in ("complete", "step-failure"):
        assert seen[outcome, ("outcome", code)] == before.get((outcome, ("outcome", code)), 0) + 1
    assert seen["gripwright_storage_free_bytes",] > 0
    assert seen["process_resident_memory_bytes",] > 0
    assert {("gripwright_webhook_deliveries", ("status", status)) for status in ("pending", "failed")} <= set(seen)
