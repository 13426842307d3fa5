"""The catalogue of actuators as the command line uses it, and the import of a user's own actuators."""

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

from gripwright.design.actuator_csv import actuators_from_csv
from gripwright.domain.errors import Fault, InvalidInput
from gripwright.domain.gripper import Actuator
from gripwright.settings import Settings
from gripwright.store.seed import seed_actuators

if TYPE_CHECKING:  # SQLAlchemy takes a second that the seed need not wait
    from sqlalchemy.orm import Session

    from gripwright.store.engines import Database

ADDED, REPLACED, UNCHANGED = "added", "replaced", "unchanged"


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueImport:
    """What an import does to the catalogue: the actuators with their outcomes, and the rows that cannot be read."""

    actuators: tuple[tuple[Actuator, str], ...]
    faults: tuple[Fault, ...]


def catalogue(settings: Settings) -> tuple[Actuator, ...]:
    """Every actuator; the database is not created for it."""
    if settings.uses_default_database and not (settings.data_dir / "gripwright.db").exists():
        return seed_actuators()
    from gripwright.store.actuators import ActuatorRepository, actuator_of

    database = prepared_database(settings)
    with database.read_sessions() as session:
        actuators = tuple(actuator_of(row) for row in ActuatorRepository(session).all())
    database.dispose()
    return actuators


def prepared_database(settings: Settings) -> "Database":
    """The database of the settings, at this version's schema."""
    from gripwright.store.engines import Database
    from gripwright.store.migrate import prepare

    settings.data_dir.mkdir(parents=True, exist_ok=True)
    database = Database(settings.resolved_database_url)
    prepare(database, automatically=settings.uses_default_database)
    return database


def import_actuators(session: "Session", text: str, now: datetime, *, dry_run: bool) -> CatalogueImport:
    """Put the actuators of a CSV (see `actuators_from_csv`) into the catalogue, all of them or none.

    InvalidInput names every row that cannot be read. A dry run writes nothing, and reports such rows beside the others.
    """
    from gripwright.store.actuators import ActuatorRepository, actuator_of

    actuators, faults = actuators_from_csv(text)
    if faults and not dry_run:
        raise InvalidInput("the actuators cannot be imported", faults=faults)
    repository, outcomes = ActuatorRepository(session), []
    for actuator in actuators:
        present = repository.find(actuator.maker, actuator.model)
        same = present is not None and actuator_of(present) == actuator
        outcomes.append((actuator, ADDED if present is None else UNCHANGED if same else REPLACED))
        if not same and not dry_run:
            repository.put(actuator, now)
    return CatalogueImport(actuators=tuple(outcomes), faults=faults)
