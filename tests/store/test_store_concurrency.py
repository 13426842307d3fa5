import subprocess
import sys

from sqlalchemy import text

from gripwright.store.engines import Database

WRITERS, INCREMENTS = 4, 50

_WRITE = """
import sys
from gripwright.store.actuators import ActuatorRepository
from gripwright.store.columns import utc_now
from gripwright.store.engines import Database

database = Database(sys.argv[1])
for _ in range(int(sys.argv[2])):
    with database.write_sessions.begin() as session:
        row = ActuatorRepository(session).get("SMC", "MHF2-12D2")
        row.version += 1
"""


def version_of(database):
    with database.read_sessions() as session:
        return session.scalar(text("SELECT version FROM actuator WHERE model = 'MHF2-12D2'"))


def test_writers_in_several_processes_lose_nothing_and_see_no_lock_error(database, url):
    before = version_of(database)

    command = [sys.executable, "-c", _WRITE, url, str(INCREMENTS)]
    writers = [subprocess.Popen(command, stderr=subprocess.PIPE) for _ in range(WRITERS)]
    errors = [writer.communicate(timeout=60)[1] for writer in writers]

    assert errors == [b""] * WRITERS
    assert version_of(database) == before + WRITERS * INCREMENTS


def test_a_reader_neither_waits_for_a_writer_nor_sees_its_unfinished_work(database):
    before = version_of(database)

    with database.write_sessions.begin() as session:
        session.execute(text("UPDATE actuator SET version = version + 1"))
        assert version_of(database) == before

    assert version_of(database) == before + 1


def test_the_database_is_in_wal_mode_with_foreign_keys(database):
    for engine in (database.read_engine, database.write_engine):
        with engine.connect() as connection:
            pragmas = [
                connection.exec_driver_sql(f"PRAGMA {name}").scalar() for name in ("journal_mode", "synchronous", "foreign_keys")
            ]
        assert pragmas == ["wal", 1, 1]


def test_a_postgresql_address_gets_its_driver():
    from gripwright.settings import Settings

    settings = Settings(database_url="postgres://user@host/db")

    assert settings.resolved_database_url == "postgresql+psycopg://user@host/db"
    assert Database(settings.resolved_database_url).write_engine.dialect.driver == "psycopg"
