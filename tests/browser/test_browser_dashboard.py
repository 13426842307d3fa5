import os
import shutil
import threading
import time

import pytest
import uvicorn
from chromium_page import ChromiumPage

from gripwright.http.app import create_app
from gripwright.settings import Settings
from gripwright.store.jobs import StoredDesignJobs
from service_factory import make_document, store_product


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    """The service on a free port, without workers: the test does their part."""
    app = create_app(Settings(data_dir=tmp_path_factory.mktemp("service")))
    config = uvicorn.Config(app, port=0, log_level="warning", timeout_graceful_shutdown=1)
    listener = config.bind_socket()
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    state = app.state.service
    while not server.started:
        time.sleep(0.05)
    state.wait_for_plugins(60)
    state.url = f"http://127.0.0.1:{listener.getsockname()[1]}"
    yield state
    server.should_exit = True
    thread.join()


@pytest.fixture
def page(tmp_path):
    binary = shutil.which("chromium") or shutil.which("google-chrome")
    if binary is None:
        if os.environ.get("CI") == "true":
            pytest.fail("Chromium is not installed")
        pytest.skip("Chromium is not installed")
    page = ChromiumPage(binary, tmp_path / "profile")
    yield page
    page.close()


def test_a_design_is_requested_followed_and_read_on_the_page(service, page):
    store_product(service.database, service.artifacts, make_document("CP-7"))
    jobs = StoredDesignJobs(service.database, service.artifacts)

    page.open(service.url)
    page.wait_for("document.querySelector('#products button')")
    assert page.evaluate("!document.getElementById('no-designs').hidden")
    page.evaluate("document.querySelector('#products button').click()")
    page.wait_for("document.querySelector('.badge.queued')")

    ((design_id, attempt),) = jobs.undispatched(10)
    jobs.start(design_id, attempt)
    jobs.record_progress(design_id, attempt, 0.5, "fit", "rotor")
    page.wait_for("document.querySelector('.card output').textContent === '50 % · fit · rotor'", timeout_s=3)
    assert page.evaluate("document.querySelector('.card progress').value") == 0.5

    operations = [{"id": "op-1", "status": "uncovered", "detail": "too wide: <b>80 mm</b>"}]
    document = {"operations": operations, "grippers": [], "bom": [], "optimum": {"proven": True}}
    files = {"report.html": service.artifacts.put(b"<!doctype html><h1>made</h1>")}
    jobs.finish(design_id, attempt, "incomplete", document, files)
    page.wait_for("document.querySelector('.badge.incomplete')")
    page.wait_for("document.querySelector('.reasons li')")

    assert page.evaluate("document.querySelector('.reasons').innerText") == "op-1: too wide: <b>80 mm</b>"
    assert page.evaluate("document.querySelector('.summary').textContent").startswith("0 grippers for 0 of 1 operations")
    report = page.evaluate("[...document.querySelectorAll('.links a')].find((link) => link.textContent === 'Report').href")
    assert page.messages == [], "the page reports no error and its own policy blocks nothing"
    page.open(report)
    page.wait_for("document.querySelector('h1')?.textContent === 'made'")


def test_what_goes_wrong_is_said_on_the_page(service, page):
    page.open(service.url)
    page.wait_for("typeof requestDesign === 'function'")

    page.evaluate("requestDesign('nothing')")

    page.wait_for("!document.getElementById('notice').hidden")
    assert page.evaluate("document.getElementById('notice').textContent") == "no product nothing"


def test_everything_on_the_page_has_a_name_for_screen_readers(service, page):
    store_product(service.database, service.artifacts)
    page.open(service.url)
    page.wait_for("document.querySelector('#products button')")

    nameless = page.evaluate(
        "[...document.querySelectorAll('button, a, input, progress, img')].filter((item) => !("
        "item.textContent.trim() || item.getAttribute('aria-label') || item.labels?.length || item.hasAttribute('alt')"
        ")).map((item) => item.outerHTML)"
    )

    assert nameless == []
    assert page.evaluate("document.documentElement.lang") == "en"
