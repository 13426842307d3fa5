"""Cursor pagination in order of (created_at, id), or of (updated_at, id) where what changed is asked for."""

import base64
import binascii
from dataclasses import dataclass
from datetime import UTC, datetime

from gripwright.domain.errors import Fault, InvalidInput


@dataclass(frozen=True, slots=True, kw_only=True)
class Cursor:
    """The last row of a page."""

    created_at: datetime  # or when it changed, in a list that is in that order
    id: str

    def encode(self) -> str:
        """As an opaque word that can stand in a URL."""
        return base64.urlsafe_b64encode(f"{self.created_at.isoformat()} {self.id}".encode()).decode()

    @classmethod
    def decode(cls, word: str) -> "Cursor":
        """The cursor again; InvalidInput where it is none of ours."""
        try:
            moment, _, row_id = base64.b64decode(word, altchars=b"-_", validate=True).decode().partition(" ")
            created_at = datetime.fromisoformat(moment)
            created_at.astimezone(UTC)
        except (binascii.Error, ValueError, OverflowError):
            created_at, row_id = None, ""
        if created_at is None or created_at.tzinfo is None:
            fault = Fault(pointer="/query/cursor", message="not a cursor that this service gave")
            raise InvalidInput("the cursor is not valid", faults=(fault,))
        return cls(created_at=created_at, id=row_id)
