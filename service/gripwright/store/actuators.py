"""All SQL about the catalogue of actuators."""

from collections.abc import Iterable
from dataclasses import fields
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from gripwright.domain.errors import NotFound
from gripwright.domain.gripper import Actuator
from gripwright.store.models import ActuatorRow

_FIELDS = tuple(field.name for field in fields(Actuator))


def actuator_of(row: ActuatorRow) -> Actuator:
    """The domain value of a row."""
    return Actuator(**{name: getattr(row, name) for name in _FIELDS})


class ActuatorRepository:
    """The catalogue. It never commits; the unit of work does."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def all(self) -> list[ActuatorRow]:
        """Every actuator in order of (maker, model)."""
        return list(self._session.scalars(select(ActuatorRow).order_by(ActuatorRow.maker, ActuatorRow.model)))

    def find(self, maker: str, model: str) -> ActuatorRow | None:
        """The actuator of that maker and model."""
        return self._session.get(ActuatorRow, (maker, model))

    def get(self, maker: str, model: str) -> ActuatorRow:
        """The actuator of that maker and model, or `NotFound`."""
        row = self.find(maker, model)
        if row is None:
            raise NotFound(f"no actuator {maker}/{model}", maker=maker, model=model)
        return row

    def put(self, actuator: Actuator, now: datetime) -> tuple[ActuatorRow, bool]:
        """Write an actuator over what stands under its maker and model; whether it is new comes second."""
        row = self.find(actuator.maker, actuator.model)
        is_new = row is None
        if row is None:
            row = ActuatorRow(version=0)
            self._session.add(row)
        for name in _FIELDS:
            setattr(row, name, getattr(actuator, name))
        row.version += 1
        row.updated_at = now
        self._session.flush()
        return row, is_new

    def delete(self, row: ActuatorRow) -> None:
        """Take an actuator out of the catalogue; designs made with it keep their snapshot."""
        self._session.delete(row)
        self._session.flush()

    def fill(self, actuators: Iterable[Actuator], now: datetime) -> None:
        """Write the first content into an empty catalogue."""
        for actuator in actuators:
            self.put(actuator, now)
