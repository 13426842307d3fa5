import os
import time
from datetime import timedelta

import pytest
from typer.testing import CliRunner

from gripwright.cli import app
from gripwright.jobs.housekeeping import clean
from gripwright.settings import Settings
from gripwright.store.columns import utc_now
from gripwright.store.designs import DesignRepository
from gripwright.store.engines import Database
from gripwright.store.migrate import migrate
from gripwright.store.models import DesignRow
from gripwright.store.storage import open_artifacts, open_steps
from service_factory import store_product

DAY_S = 86_400.0


@pytest.fixture
def settings(tmp_path):
    return Settings(data_dir=tmp_path / "data")


@pytest.fixture
def database(settings):
    settings.data_dir.mkdir()
    database = Database(settings.resolved_database_url)
    migrate(database)
    yield database
    database.dispose()


@pytest.fixture
def artifacts(settings):
    return open_artifacts(settings.resolved_storage_url)


@pytest.fixture
def steps(settings):
    return open_steps(settings.resolved_storage_url)


def age(store, seconds, names=None):
    """Let files have been used last so long ago."""
    for state in store.files.all():
        if names is None or state.name.partition("/")[2] in names:
            os.utime(store.files.folder / state.name, (time.time() - seconds,) * 2)


def keys_of(steps):
    return {state.name.partition("/")[2] for state in steps.files.all()}


def save(steps, *ages):
    """Step results of 1000 bytes and their sum, used so many seconds ago; their keys."""
    keys = [f"{number:02x}" * 32 for number in range(len(ages))]
    for key, seconds in zip(keys, ages, strict=True):
        steps.save(key, bytes(1000))
        age(steps, seconds, {key})
    return keys


def test_artifacts_that_no_row_names_are_removed_after_a_day_of_grace(settings, database, artifacts):
    store_product(database, artifacts)
    named = {state.name for state in artifacts.files.all()}
    old, young = artifacts.put(b"old"), artifacts.put(b"young")
    age(artifacts, 1.1 * DAY_S)
    age(artifacts, 0.9 * DAY_S, {young})

    done = clean(settings, database)

    assert (done.artifacts, done.bytes) == (1, 3)
    assert not artifacts.has(old)
    assert {state.name for state in artifacts.files.all()} == named | {f"{young[:2]}/{young}"}


def test_an_artifact_that_is_uploaded_again_is_young_again(settings, database, artifacts):
    sha256 = artifacts.put(b"old")
    age(artifacts, 2 * DAY_S)

    artifacts.put(b"old")

    assert clean(settings, database).artifacts == 0
    assert artifacts.has(sha256)


def test_the_least_recently_used_steps_go_first_and_recent_ones_never(settings, database, steps):
    keys = save(steps, 50 * DAY_S, 40 * DAY_S, 30 * DAY_S, 60.0, 0.0)

    clean(settings.model_copy(update={"steps_max_bytes": 4 * 1032}), database)
    assert keys_of(steps) == set(keys[1:])
    clean(settings.model_copy(update={"steps_max_bytes": 0}), database)

    assert keys_of(steps) == set(keys[3:])


def test_steps_that_nobody_used_for_long_are_removed(settings, database, steps):
    keys = save(steps, 91 * DAY_S, 89 * DAY_S)

    assert clean(settings, database).steps == 1

    assert keys_of(steps) == {keys[1]}


def test_no_step_is_removed_that_a_running_design_may_need(settings, database, artifacts, steps):
    keys = save(steps, 3.1 * DAY_S, 2.9 * DAY_S)
    product_id = store_product(database, artifacts)
    design = DesignRow(
        id="d", product_id=product_id, product_version=1, task_sha256="0" * 64, actuators_sha256="0" * 64, options={},
        outcome=None, created_at=utc_now(),
    )  # fmt: skip
    with database.write_sessions.begin() as session:
        DesignRepository(session).add(design, utc_now())
        design.job.status, design.job.started_at = "running", utc_now() - timedelta(days=3)

    clean(settings.model_copy(update={"steps_max_bytes": 0}), database)

    assert keys_of(steps) == {keys[1]}


def test_parts_that_a_dead_writer_left_are_removed_and_those_of_a_living_one_are_not(settings, database, artifacts):
    folder = artifacts.files.folder / "ab"
    folder.mkdir(parents=True)
    for name, seconds in ((".dead.part", 7200.0), (".living.part", 0.0)):
        (folder / name).write_bytes(b"half")
        os.utime(folder / name, (time.time() - seconds,) * 2)

    assert clean(settings, database).parts == 1

    assert [path.name for path in folder.iterdir()] == [".living.part"]


def test_the_command_cleans_and_says_what(settings, database, artifacts):
    artifacts.put(b"old")

    done = CliRunner().invoke(app, ["clean", "--grace-hours", "0"], env={"GRIPWRIGHT_DATA": str(settings.data_dir)})

    assert done.exit_code == 0, done.output
    assert done.output == "removed: 1 artifacts, 0 step results, 3 bytes; 0 parts of files\n"
