"""API keys for tests of the service."""

from datetime import timedelta

from gripwright.domain.access import AccessScope
from gripwright.jobs.keys import create_key
from gripwright.store.columns import utc_now

YEAR = timedelta(days=365)


def new_key(service, name, scope=AccessScope.READ, lifetime=YEAR, now=None):
    with service.database.write_sessions.begin() as session:
        return create_key(session, name, scope, lifetime, now or utc_now(), actor="test")


def bearer(word):
    return {"Authorization": f"Bearer {word}"}
