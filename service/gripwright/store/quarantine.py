"""All SQL about steps that are not tried again by themselves."""

from datetime import datetime

from sqlalchemy import delete
from sqlalchemy.orm import Session

from gripwright.store.models import QuarantineRow


class QuarantineRepository:
    """Steps that broke their process. It never commits; the unit of work does."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def find(self, key: str) -> QuarantineRow | None:
        """How a step broke, if it did and nobody asked for it since."""
        return self._session.get(QuarantineRow, key)

    def add(self, key: str, *, stage: str, plugin: str | None, detail: str, now: datetime) -> None:
        """Note that a step broke its process, once more."""
        row = self._session.get(QuarantineRow, key)
        if row is None:
            row = QuarantineRow(key=key, stage=stage, plugin=plugin, times=0, detail=detail, created_at=now)
            self._session.add(row)
        row.times, row.detail, row.created_at = row.times + 1, detail, now
        self._session.flush()

    def release(self, key: str) -> None:
        """Let a step be tried again."""
        self._session.execute(delete(QuarantineRow).where(QuarantineRow.key == key))

    def remove_before(self, moment: datetime) -> None:
        """Forget what is older."""
        self._session.execute(delete(QuarantineRow).where(QuarantineRow.created_at < moment))
