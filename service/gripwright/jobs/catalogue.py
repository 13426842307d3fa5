"""The catalogue of actuators as the command line uses it: the service's, or the one that comes with the software."""

from gripwright.domain.gripper import Actuator
from gripwright.settings import Settings
from gripwright.store.seed import seed_actuators


def catalogue(settings: Settings) -> tuple[Actuator, ...]:
    """Every actuator; the database is not created for it."""
    if settings.uses_default_database and not (settings.data_dir / "gripwright.db").exists():
        return seed_actuators()
    from gripwright.store.actuators import ActuatorRepository, actuator_of  # a second that the seed need not wait
    from gripwright.store.engines import Database
    from gripwright.store.migrate import prepare

    database = Database(settings.resolved_database_url)
    prepare(database, automatically=settings.uses_default_database)
    with database.read_sessions() as session:
        actuators = tuple(actuator_of(row) for row in ActuatorRepository(session).all())
    database.dispose()
    return actuators
