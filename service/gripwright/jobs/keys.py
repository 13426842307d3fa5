"""API keys are made, rotated and revoked, and the audit trail says so."""

from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy.orm import Session

from gripwright.domain.access import AccessScope, key_word, new_key_secret, secret_sha256
from gripwright.domain.errors import Conflict, InvalidInput
from gripwright.store.api_keys import ApiKeyRepository
from gripwright.store.audit import AuditRepository
from gripwright.store.columns import new_id
from gripwright.store.models import ApiKeyRow, AuditRow

_NAME_MAX = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class NewKey:
    """A key that was just made: the only time that its word is known."""

    row: ApiKeyRow
    word: str


def create_key(session: Session, name: str, scope: AccessScope, lifetime: timedelta, now: datetime, *, actor: str) -> NewKey:
    """A new key. Conflict where a valid key has this name."""
    if not name.strip() or len(name) > _NAME_MAX or not name.isprintable():
        raise InvalidInput(f"a key's name has 1 to {_NAME_MAX} printable characters")
    if ApiKeyRepository(session).valid(now, name):
        raise Conflict(f"a valid key is called {name}: rotate it, or choose another name", name=name)
    made = _add(session, name, scope, lifetime, now)
    _note(session, "keys create", made.row, now, actor)
    return made


def rotate_key(
    session: Session, id_or_name: str, lifetime: timedelta, overlap: timedelta, now: datetime, *, actor: str
) -> NewKey:
    """A new key of the same name and scope. The old ones of that name end after the overlap, or before if they would anyway."""
    keys = ApiKeyRepository(session)
    newest = keys.named(now, id_or_name)[0]
    olds = keys.valid(now, newest.name)
    made = _add(session, newest.name, AccessScope(newest.scope), lifetime, now)
    for old in olds:
        old.expires_at = min(old.expires_at, now + overlap)
    _note(session, "keys rotate", made.row, now, actor)
    return made


def revoke_keys(session: Session, id_or_name: str, now: datetime, *, actor: str) -> list[ApiKeyRow]:
    """End the key of an id, or every valid key of a name, at once."""
    rows = ApiKeyRepository(session).named(now, id_or_name)
    for row in rows:
        row.revoked_at = now
        _note(session, "keys revoke", row, now, actor)
    return rows


def _add(session: Session, name: str, scope: AccessScope, lifetime: timedelta, now: datetime) -> NewKey:
    secret = new_key_secret()
    row = ApiKeyRow(
        id=new_id(now),
        name=name,
        scope=scope.value,
        secret_sha256=secret_sha256(secret),
        created_at=now,
        expires_at=now + lifetime,
        revoked_at=None,
    )
    ApiKeyRepository(session).add(row)
    return NewKey(row=row, word=key_word(row.id, secret))


def _note(session: Session, command: str, key: ApiKeyRow, now: datetime, actor: str) -> None:
    AuditRepository(session).add(
        AuditRow(
            id=new_id(now),
            created_at=now,
            actor=actor,
            actor_name="",
            client="",
            method="CLI",
            path=f"{command} {key.name}",
            status=200,
            resource_id=key.id,
            request_id="",
        )
    )
