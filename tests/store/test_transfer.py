"""Copies of whole databases, from and to real servers."""

import pytest
from sqlalchemy import select, text
from typer.testing import CliRunner

from gripwright.cli import app
from gripwright.domain.errors import Conflict
from gripwright.settings import with_driver
from gripwright.store.engines import Database
from gripwright.store.events import record_event
from gripwright.store.migrate import migrate, require_current
from gripwright.store.models import Base, JobEventRow, JobRow
from gripwright.store.named import ARTIFACT_COLUMNS
from gripwright.store.storage import open_artifacts
from gripwright.store.transfer import DATA_TABLES, copy_rows, snapshot
from populated import contents, populate

NAMES_OF_OTHER_THINGS = {("idempotency", "request_sha256"), ("idempotency", "caller_sha256"), ("api_key", "secret_sha256")}


@pytest.fixture
def databases(tmp_path, postgresql):
    """A SQLite file and a PostgreSQL database, both new."""
    made = {"sqlite": Database(f"sqlite:///{tmp_path / 'a.db'}"), "postgresql": Database(with_driver(postgresql))}
    yield made
    for database in made.values():
        database.dispose()


def fill(database):
    migrate(database)
    with database.write_engine.begin() as connection:
        populate(connection, Base.metadata)
        return contents(connection, Base.metadata)


def read(database):
    with database.read_engine.connect() as connection:
        return contents(connection, Base.metadata)


@pytest.mark.parametrize(("source", "target"), [("sqlite", "postgresql"), ("postgresql", "sqlite")])
def test_a_copy_holds_the_same_rows_and_counts_on(databases, source, target):
    expected = fill(databases[source])
    with databases[source].write_engine.begin() as connection:  # the newest number is gone, and is not given again
        last = connection.scalar(select(JobEventRow.id).order_by(JobEventRow.id.desc()))
        if source == "postgresql":
            connection.execute(text("SELECT setval('job_event_id_seq', :last)"), {"last": last + 5})
        else:
            connection.execute(text("UPDATE sqlite_sequence SET seq = :last"), {"last": last + 5})

    with snapshot(databases[source]) as connection:
        counts = copy_rows(connection, databases[target], requeue=False)

    require_current(databases[target])
    found = read(databases[target])
    assert counts == {table.name: 3 for table in DATA_TABLES}
    assert found.pop("worker") == []
    del expected["worker"]
    assert found == expected
    with databases[target].write_sessions.begin() as session:
        job = session.scalars(select(JobRow)).first()
        record_event(session, job, "status", job.created_at)
        session.flush()
        assert session.scalar(select(JobEventRow.id).order_by(JobEventRow.id.desc())) == last + 6


def test_designs_that_had_not_ended_are_queued_anew_in_the_copy(databases):
    before = {row["id"]: row for row in fill(databases["sqlite"])["job"]}

    with snapshot(databases["sqlite"]) as connection:
        copy_rows(connection, databases["postgresql"])

    for row in read(databases["postgresql"])["job"]:
        was = before[row["id"]]
        if was["status"] == "succeeded":
            assert row == was
        else:
            assert (row["status"], row["dispatched"]) == ("queued", False)
            assert row["attempt"] == was["attempt"] + (was["status"] == "running" or was["dispatched"])


def test_a_target_with_data_is_refused_and_left_as_it_was(databases):
    fill(databases["sqlite"])
    before = fill(databases["postgresql"])

    with snapshot(databases["sqlite"]) as connection, pytest.raises(Conflict, match=r"not empty: its table \w+ has 3 rows"):
        copy_rows(connection, databases["postgresql"])

    assert read(databases["postgresql"]) == before


def test_the_copy_command_takes_a_migrated_target_and_brings_the_artifacts(databases, tmp_path, s3_storage):
    fill(databases["sqlite"])
    migrate(databases["postgresql"])
    artifacts = open_artifacts(tmp_path.as_uri())
    named = {artifacts.put(f"content {number}".encode()) for number in range(3)}
    with databases["sqlite"].write_engine.begin() as connection:
        for column in ARTIFACT_COLUMNS:
            connection.execute(column.class_.__table__.update().values({column.key: sorted(named)[0]}))
    places = ["--from", databases["sqlite"].url, "--to", databases["postgresql"].url]
    places += ["--storage-from", tmp_path.as_uri(), "--storage-to", s3_storage]

    first, again = (CliRunner().invoke(app, ["copy", *places]) for _ in range(2))

    assert first.exit_code == 0, first.output
    assert "3 product" in first.output
    assert open_artifacts(s3_storage).get(sorted(named)[0]) == artifacts.get(sorted(named)[0])
    assert len(list(open_artifacts(s3_storage).files.all())) == 1
    assert again.exit_code == 1
    assert "not empty" in again.stderr


def test_every_column_that_names_content_is_known_to_be_an_artifact_or_not():
    named = {(column.class_.__tablename__, column.key) for column in ARTIFACT_COLUMNS}
    columns = {(table.name, column.name) for table in DATA_TABLES for column in table.columns if "sha256" in column.name}

    assert columns == named | NAMES_OF_OTHER_THINGS
