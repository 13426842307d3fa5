"""API keys: valid until they expire, are rotated or revoked, and stored as hashes alone."""

import hmac
from datetime import timedelta

import pytest
from key_factory import YEAR, bearer, new_key

from gripwright.domain.access import AccessScope, NotAuthenticated, is_secret, key_word, secret_sha256, split_key_word
from gripwright.domain.errors import Conflict
from gripwright.jobs.keys import revoke_keys, rotate_key
from gripwright.store.api_keys import ApiKeyRepository
from gripwright.store.columns import utc_now


@pytest.mark.parametrize(
    "header",
    [
        "Bearer",
        "Bearer ",
        "Bearer gwk_",
        "Bearer gwk__",
        "Bearer gwk_a_b",
        "Bearer nonsense",
        "Basic dXNlcjpwYXNz",
        "gwk_a_b",
        "",
    ],
)
def test_what_is_no_key_is_refused(closed, problem, header):
    problem(closed.get("/api/v1/jobs", headers={"Authorization": header}), 401, "not-authenticated")


def test_a_secret_of_another_key_is_refused(closed, keys, problem):
    (read_id, read_secret), (admin_id, _) = (split_key_word(keys[scope]) for scope in (AccessScope.READ, AccessScope.ADMIN))
    crossed = key_word(admin_id, read_secret)

    assert closed.get("/api/v1/jobs", headers=bearer(key_word(read_id, read_secret))).status_code == 200
    answer = closed.get("/api/v1/audit", headers=bearer(crossed))

    assert problem(answer, 401)["detail"] == "there is no such API key"
    assert 'error="invalid_token"' in answer.headers["WWW-Authenticate"]


def test_a_key_is_valid_until_it_expires_and_not_at_that_moment(closed):
    made = new_key(closed.service, "short", lifetime=timedelta(hours=1))
    gate, header = closed.service.gate, f"Bearer {made.word}"

    assert gate.identify(header, made.row.expires_at - timedelta(microseconds=1)).name == "short"
    with pytest.raises(NotAuthenticated, match="the API key short has expired"):
        gate.identify(header, made.row.expires_at)


def test_an_expired_key_is_refused_over_http(closed, problem):
    made = new_key(closed.service, "old", now=utc_now() - 2 * YEAR)

    assert problem(closed.get("/api/v1/jobs", headers=bearer(made.word)), 401)["detail"] == "the API key old has expired"


def test_after_a_rotation_both_keys_are_valid_until_the_overlap_ends(closed):
    old = new_key(closed.service, "rotated", AccessScope.WRITE)
    now, gate = utc_now(), closed.service.gate
    with closed.service.database.write_sessions.begin() as session:
        new = rotate_key(session, "rotated", YEAR, timedelta(hours=2), now, actor="test")

    for word in (old.word, new.word):
        principal = gate.identify(f"Bearer {word}", now + timedelta(hours=1, minutes=59))
        assert (principal.name, principal.scopes) == ("rotated", AccessScope.WRITE.included)
    with pytest.raises(NotAuthenticated, match="has expired"):
        gate.identify(f"Bearer {old.word}", now + timedelta(hours=2))
    assert gate.identify(f"Bearer {new.word}", now + timedelta(hours=2)).actor == f"key:{new.row.id}"


def test_a_rotation_never_makes_an_old_key_live_longer(closed):
    old = new_key(closed.service, "ending", lifetime=timedelta(minutes=5))
    with closed.service.database.write_sessions.begin() as session:
        rotate_key(session, old.row.id, YEAR, timedelta(days=7), utc_now(), actor="test")

    with closed.service.database.read_sessions() as session:
        assert ApiKeyRepository(session).find(old.row.id).expires_at == old.row.expires_at


def test_a_revoked_key_is_refused_at_once(closed, problem):
    made = new_key(closed.service, "lost")
    assert closed.get("/api/v1/jobs", headers=bearer(made.word)).status_code == 200

    with closed.service.database.write_sessions.begin() as session:
        revoke_keys(session, "lost", utc_now(), actor="test")

    assert problem(closed.get("/api/v1/jobs", headers=bearer(made.word)), 401)["detail"] == "the API key lost has been revoked"
    assert new_key(closed.service, "lost").word != made.word, "the name is free again"


def test_a_name_belongs_to_one_valid_key(closed):
    new_key(closed.service, "taken")

    with pytest.raises(Conflict, match="rotate it"):
        new_key(closed.service, "taken")


def test_no_secret_is_stored(closed, keys):
    with closed.service.database.read_sessions() as session:
        stored = {value for row in ApiKeyRepository(session).all() for value in vars(row).values() if isinstance(value, str)}

    secrets = [split_key_word(word)[1] for word in keys.values()]
    assert all(len(secret) == 43 for secret in secrets)
    assert not stored & {*secrets, *keys.values()}
    assert {secret_sha256(secret) for secret in secrets} <= stored


@pytest.mark.parametrize("stored", [secret_sha256("right"), None])
def test_secrets_are_compared_in_a_time_that_tells_nothing(monkeypatch, stored):
    """Also where there is no such key, with as many characters."""
    compared = []

    def compare_digest(given, expected, compare=hmac.compare_digest):
        compared.append((len(given), len(expected)))
        return compare(given, expected)

    monkeypatch.setattr(hmac, "compare_digest", compare_digest)

    assert not is_secret("wrong", stored)
    assert is_secret("right", secret_sha256("right"))
    assert compared == [(64, 64), (64, 64)]
