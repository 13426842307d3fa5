"""All SQL about API keys."""

from datetime import datetime

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from gripwright.domain.errors import NotFound
from gripwright.store.models import ApiKeyRow


class ApiKeyRepository:
    """API keys. It never commits; the unit of work does."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, row: ApiKeyRow) -> None:
        """Add a key."""
        self._session.add(row)
        self._session.flush()

    def find(self, key_id: str) -> ApiKeyRow | None:
        """The key, valid or not."""
        return self._session.get(ApiKeyRow, key_id)

    def all(self) -> list[ApiKeyRow]:
        """Every key in the order in which they were made."""
        return list(self._session.scalars(select(ApiKeyRow).order_by(ApiKeyRow.created_at, ApiKeyRow.id)))

    def valid(self, now: datetime, id_or_name: str | None = None) -> list[ApiKeyRow]:
        """Keys neither revoked nor expired, the newest first: all, or those of an id or a name."""
        query = select(ApiKeyRow).where(ApiKeyRow.revoked_at.is_(None), ApiKeyRow.expires_at > now)
        if id_or_name is not None:
            query = query.where(or_(ApiKeyRow.id == id_or_name, ApiKeyRow.name == id_or_name))
        return list(self._session.scalars(query.order_by(ApiKeyRow.created_at.desc(), ApiKeyRow.id.desc())))

    def named(self, now: datetime, id_or_name: str) -> list[ApiKeyRow]:
        """The valid keys of an id or a name, the newest first, or `NotFound`."""
        rows = self.valid(now, id_or_name)
        if not rows:
            raise NotFound(f"no valid key is {id_or_name}: `gripwright keys list` names them", key=id_or_name)
        return rows


def is_valid(row: ApiKeyRow, now: datetime) -> bool:
    """Whether a key is neither revoked nor expired."""
    return row.revoked_at is None and now < row.expires_at
