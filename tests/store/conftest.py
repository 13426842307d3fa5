import pytest

from gripwright.store.artifacts import ArtifactStore
from gripwright.store.engines import Database
from gripwright.store.jobs import StoredDesignJobs
from gripwright.store.migrate import migrate


@pytest.fixture
def url(tmp_path):
    return f"sqlite:///{tmp_path / 'test.db'}"


@pytest.fixture
def database(url):
    database = Database(url)
    migrate(database)
    yield database
    database.dispose()


@pytest.fixture
def artifacts(tmp_path):
    return ArtifactStore(tmp_path / "artifacts")


@pytest.fixture
def jobs(database, artifacts):
    return StoredDesignJobs(database, artifacts)
