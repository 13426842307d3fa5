import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import MetaData, inspect, text

from gripwright.domain.errors import Conflict
from gripwright.http.errors import RequestInFlight
from gripwright.http.idempotency import KeptAnswers
from gripwright.settings import Settings, with_driver
from gripwright.store.columns import utc_now
from gripwright.store.engines import Database
from gripwright.store.idempotency import KeptAnswer, KeyClaim
from gripwright.store.migrate import alembic_config, migrate, prepare, require_current
from gripwright.store.models import Base
from gripwright.store.seed import seed_actuators
from populated import contents, populate


@pytest.fixture
def database(tmp_path):
    database = Database(f"sqlite:///{tmp_path / 'test.db'}")
    yield database
    database.dispose()


def differences(database):
    with database.read_engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True, "compare_server_default": True})
        return compare_metadata(context, Base.metadata)


def count_actuators(database):
    with database.read_engine.connect() as connection:
        return connection.scalar(text("SELECT count(*) FROM actuator"))


def test_migrations_make_exactly_the_tables_of_the_models(database):
    migrate(database)

    assert differences(database) == []


def test_migrating_again_changes_nothing_and_an_emptied_catalogue_stays_empty(database):
    migrate(database)
    assert count_actuators(database) == len(seed_actuators())
    with database.write_engine.begin() as connection:
        connection.execute(text("DELETE FROM actuator"))

    migrate(database)

    assert count_actuators(database) == 0


def test_every_constraint_has_a_name(database):
    migrate(database)

    inspector = inspect(database.read_engine)
    for table in Base.metadata.tables:
        names = [constraint["name"] for constraint in inspector.get_foreign_keys(table)]
        if table != "job_event":  # SQLite has no name for the key of an AUTOINCREMENT table
            names.append(inspector.get_pk_constraint(table)["name"])
        names += [constraint["name"] for constraint in inspector.get_unique_constraints(table)]
        names += [constraint["name"] for constraint in inspector.get_check_constraints(table)]
        assert None not in names, table


def test_the_way_back_leaves_nothing(database):
    migrate(database)

    with database.write_engine.begin() as connection:
        command.downgrade(alembic_config(connection), "base")

    assert inspect(database.read_engine).get_table_names() == ["alembic_version"]


@pytest.mark.parametrize("kind", ["sqlite", "postgresql"])
def test_a_populated_database_of_the_first_version_keeps_its_rows(kind, database, request):
    if kind == "postgresql":
        database = Database(with_driver(request.getfixturevalue("postgresql")))
    with database.write_engine.connect() as connection, connection.begin():
        command.upgrade(alembic_config(connection), "0001")
    first = MetaData()
    first.reflect(database.read_engine)
    assert "api_key" not in first.tables
    with database.write_engine.begin() as connection:
        populate(connection, first)
        first.remove(first.tables["idempotency"])  # what is forgotten on the way, and may be
        before = contents(connection, first)

    migrate(database)

    assert len(before) == 9
    assert all(len(rows) == 3 for rows in before.values())
    with database.read_engine.connect() as connection:
        assert contents(connection, first) == before
        for table in set(Base.metadata.tables) - set(first.tables):
            assert connection.scalar(text(f"SELECT count(*) FROM {table}")) == 0
    assert differences(database) == []
    database.dispose()


def test_a_database_of_a_newer_version_is_refused(database):
    migrate(database)
    with database.write_engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))

    with pytest.raises(Conflict, match="newer version than this one"):
        migrate(database)


def test_a_database_of_another_version_is_refused_with_the_way_out(database):
    with pytest.raises(Conflict, match="gripwright migrate"):
        require_current(database)
    with pytest.raises(Conflict, match="is at migration none"):
        prepare(database, automatically=False)

    prepare(database, automatically=True)

    require_current(database)


def test_processes_that_start_together_migrate_once(tmp_path):
    url = f"sqlite:///{tmp_path / 'test.db'}"
    script = (
        f"from gripwright.store.engines import Database; from gripwright.store.migrate import migrate; migrate(Database({url!r}))"
    )

    starts = [subprocess.Popen([sys.executable, "-c", script], stderr=subprocess.PIPE) for _ in range(3)]
    endings = [(start.communicate(timeout=60)[1][-400:], start.returncode) for start in starts]

    assert [code for _, code in endings] == [0, 0, 0], endings
    assert count_actuators(Database(url)) == len(seed_actuators())


def claim_outcome(answers, claim):
    try:
        return "claimed" if answers.claim(claim, utc_now()) is None else "answered"
    except RequestInFlight:
        return "in flight"


def test_postgresql_gets_the_same_tables_and_runs_a_job(postgresql, tmp_path):
    from gripwright.domain.access import AccessScope
    from gripwright.jobs.keys import create_key
    from gripwright.store.api_keys import ApiKeyRepository
    from gripwright.store.artifacts import ArtifactStore
    from gripwright.store.audit import AuditRepository
    from gripwright.store.products import ProductRepository
    from service_factory import make_document, store_product

    database = Database(Settings(database_url=postgresql).resolved_database_url)
    artifacts = ArtifactStore(tmp_path)

    migrate(database)
    migrate(database)

    assert differences(database) == []
    assert count_actuators(database) == len(seed_actuators())
    product_id = store_product(database, artifacts, make_document("PG-1"))
    with database.read_sessions() as session:
        assert ProductRepository(session).find("PG-1", "A").id == product_id
        assert [row.id for row in ProductRepository(session).page(after=None, limit=5, part_number=None)] == [product_id]
    with database.write_sessions.begin() as session:
        made = create_key(session, "PLM", AccessScope.WRITE, timedelta(days=1), utc_now(), actor="cli:ada")
    with database.read_sessions() as session:
        assert [row.id for row in ApiKeyRepository(session).valid(utc_now(), "PLM")] == [made.row.id]
        trail = AuditRepository(session).page(after=None, limit=5, actor=None, resource_id=made.row.id)
        assert [row.path for row in trail] == ["keys create PLM"]
    claims = [KeyClaim(caller_sha256="c" * 64, key="k", id=f"{number:032}") for number in range(8)]
    answers = KeptAnswers(database, hours=1)
    with ThreadPoolExecutor(8) as pool:
        outcomes = list(pool.map(lambda claim: claim_outcome(answers, claim), claims))
    assert sorted(outcomes) == ["claimed"] + ["in flight"] * 7
    kept = KeptAnswer(request_sha256="0" * 64, status=201, headers=[("etag", '"1"')], body=b"\x00")
    answers.keep_alone(claims[outcomes.index("claimed")], kept)
    assert answers.claim(claims[0], utc_now()) == kept
    database.dispose()
