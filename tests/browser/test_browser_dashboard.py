import os
import shutil
import threading
import time
from contextlib import contextmanager
from datetime import timedelta

import pytest
import uvicorn
from chromium_page import ChromiumPage

from gripwright.domain.access import AccessScope
from gripwright.http.app import create_app
from gripwright.jobs.keys import create_key
from gripwright.settings import Settings
from gripwright.store.columns import utc_now
from gripwright.store.jobs import StoredDesignJobs
from service_factory import make_document, store_product


@contextmanager
def running(settings):
    """The service on a free port, without workers: the test does their part."""
    app = create_app(settings)
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


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    with running(Settings(data_dir=tmp_path_factory.mktemp("service"))) as state:
        yield state


@pytest.fixture
def closed(tmp_path):
    """A service that asks for a key, and a key."""
    with running(Settings(data_dir=tmp_path / "closed", access_required=True)) as state:
        with state.database.write_sessions.begin() as session:
            state.key = create_key(session, "Ada", AccessScope.WRITE, timedelta(days=1), utc_now(), actor="test").word
        yield state


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


def sign_in(page, key):
    page.evaluate(f"document.getElementById('key').value = '{key}'; document.querySelector('#sign-in button').click()")


def shown(identity):
    return f"document.getElementById('{identity}')?.checkVisibility()"


def test_where_a_key_is_needed_the_page_asks_for_it_and_does_all_its_work_with_it(closed, page, tmp_path):
    store_product(closed.database, closed.artifacts, make_document("CP-8"))
    jobs = StoredDesignJobs(closed.database, closed.artifacts)
    page.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    page.open(closed.url)
    page.wait_for(shown("sign-in"))
    assert not page.evaluate(shown("notice"))

    sign_in(page, "gwk_a_b")
    page.wait_for(shown("notice"))
    assert page.evaluate("document.getElementById('notice').textContent") == "there is no such API key"
    assert page.evaluate(shown("sign-in"))
    sign_in(page, closed.key)
    page.wait_for("document.querySelector('#products button')")
    assert not page.evaluate(shown("sign-in"))
    assert page.evaluate("document.cookie + Object.values(localStorage).join()") == ""

    page.evaluate("document.querySelector('#products button').click()")
    page.wait_for("document.querySelector('.badge.queued')")
    ((design_id, attempt),) = jobs.undispatched(10)
    jobs.start(design_id, attempt)
    jobs.record_progress(design_id, attempt, 0.5, "fit", "rotor")
    page.wait_for("document.querySelector('.card output').textContent === '50 % · fit · rotor'", timeout_s=3)
    document = {"operations": [], "grippers": [], "bom": [], "optimum": {"proven": True}}
    files = {"grippers/G1/finger.step": closed.artifacts.put(b"ISO-10303-21; of G1")}
    jobs.finish(design_id, attempt, "complete", document, files)
    page.wait_for("document.querySelector('.badge.complete')")
    page.wait_for("document.querySelector('.files a[href$=\"finger.step\"]')")
    page.evaluate("document.querySelector('.files a[href$=\"finger.step\"]').click()")

    deadline = time.monotonic() + 10
    while not (tmp_path / "finger.step").exists():
        assert time.monotonic() < deadline, "the file was not saved"
        time.sleep(0.1)
    assert (tmp_path / "finger.step").read_bytes() == b"ISO-10303-21; of G1"

    page.evaluate("document.getElementById('sign-out').click()")
    page.wait_for(shown("sign-in"))
    assert page.evaluate("sessionStorage.length") == 0
    refusals = [message for message in page.messages if "status of 401" not in str(message)]
    assert refusals == [], "the page's own policy blocks nothing"


def test_where_no_key_is_needed_nobody_is_asked(service, page):
    page.open(service.url)
    page.wait_for("document.querySelector('.card, #no-designs:not([hidden])')")

    assert not page.evaluate(shown("sign-in"))
    assert not page.evaluate(shown("sign-out"))


def test_what_goes_wrong_is_said_on_the_page(service, page):
    page.open(service.url)
    page.wait_for("typeof requestDesign === 'function'")

    page.evaluate("requestDesign('nothing')")

    page.wait_for("!document.getElementById('notice').hidden")
    assert page.evaluate("document.getElementById('notice').textContent") == "no product nothing"


def fill(page, values):
    """As a user types them."""
    for name, value in values.items():
        field = f"document.getElementById('options-form').elements.namedItem('{name}')"
        page.evaluate(f"{field}.value = '{value}'; {field}.dispatchEvent(new Event('input', {{ bubbles: true }}))")


def test_options_are_a_form_drawn_from_the_schemas_and_only_what_was_changed_is_sent(service, page):
    store_product(service.database, service.artifacts, make_document("CP-9"))
    jobs = StoredDesignJobs(service.database, service.artifacts)
    page.open(service.url)
    page.wait_for("document.querySelector('#products button + button')")

    page.evaluate("document.querySelector('#products button + button').click()")
    page.wait_for("document.getElementById('options').open")
    rays = "document.getElementById('options-form').elements.namedItem('sdf.rays')"
    assert page.evaluate(f"[{rays}.type, {rays}.min, {rays}.value]") == ["number", "1", "30"]
    assert page.evaluate(f"document.getElementById({rays}.getAttribute('aria-describedby')).textContent").endswith("at most 1000")
    chosen = "document.querySelector('details[data-key=prefer_makers]')"
    assert page.evaluate(f"{chosen}.hidden")
    page.evaluate("document.querySelector('[data-chooses=policy][value=prefer_makers]').click()")
    assert not page.evaluate(f"{chosen}.hidden")

    fingers = "[...document.querySelectorAll('[data-chooses=finger]')]"
    assert page.evaluate(f"{fingers}.filter(box => box.checked).map(box => box.value)") == ["straight"]
    page.evaluate(f"{fingers}.forEach(box => box.value === 'straight' || box.click())")

    factor = "document.getElementById('options-form').elements.namedItem('prefer_makers.factor')"
    fill(page, {"prefer_makers.factor": 0, "prefer_makers.makers": "SCHUNK, Zimmer", "margin": 0.2})
    submit = "document.querySelector('#options-form [type=submit]').click()"
    page.evaluate(submit)
    page.wait_for(shown("options-problem"))
    assert "/options/prefer_makers.factor" in page.evaluate("document.getElementById('options-problem').textContent")
    assert page.evaluate(f"{factor}.validationMessage").startswith("0 is less than or equal to the minimum of 0")
    assert jobs.undispatched(10) == []

    fill(page, {"prefer_makers.factor": 0.5})
    page.evaluate(submit)
    page.wait_for("!document.getElementById('options').open")

    ((design_id, _),) = jobs.undispatched(10)
    assert jobs.snapshot(design_id).options == {
        "finger": ["straight", "concave"],
        "policies": ["prefer_makers"],
        "margin": 0.2,
        "prefer_makers.makers": ["SCHUNK", "Zimmer"],
        "prefer_makers.factor": 0.5,
    }


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
