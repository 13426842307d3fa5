"""`gripwright serve`, `gripwright worker` and `gripwright migrate`."""

import logging
import math
import os
import signal
import socket
import sys
from typing import Annotated

import typer
import uvicorn

from gripwright.http.app import create_app
from gripwright.http.gate import require_way_in
from gripwright.http.protocol import ProblemProtocol
from gripwright.http.state import State
from gripwright.jobs.supervisor import Supervisor
from gripwright.logs import configure_logs
from gripwright.settings import Settings, load_settings
from gripwright.store.columns import utc_now
from gripwright.store.engines import Database
from gripwright.store.migrate import migrate as migrate_database
from gripwright.store.migrate import prepare

LISTENING = "Gripwright listens on "
_KEEP_ALIVE_S = 75  # longer than clients and proxies keep an idle connection: else they send into one that closes

_log = logging.getLogger(__name__)


def serve(
    host: Annotated[str | None, typer.Option(help="address to listen on; by default GRIPWRIGHT_HOST or 127.0.0.1")] = None,
    port: Annotated[int | None, typer.Option(min=0, max=65535, help="by default GRIPWRIGHT_PORT or 8000; 0: a free one")] = None,
) -> None:
    """The HTTP service with its embedded workers, until SIGTERM or Ctrl-C."""
    chosen = {"host": host, "port": port}
    settings = load_settings().model_copy(update={name: value for name, value in chosen.items() if value is not None})
    configure_logs(settings)
    prepare_database(settings)
    check_way_in(settings)
    app = create_app(settings)
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        http=ProblemProtocol,
        log_config=None,
        access_log=False,
        server_header=False,
        timeout_keep_alive=_KEEP_ALIVE_S,
        timeout_graceful_shutdown=math.ceil(settings.shutdown_s),
    )
    listener = config.bind_socket()
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # asyncio does not see that it is TCP: 40 ms for each answer
    listener.listen(config.backlog)  # who reads the address may connect at once, and waits until the server takes over
    address, bound_port = listener.getsockname()[:2]
    supervisor = Supervisor(settings)
    if settings.workers:
        app.state.service.live_workers = supervisor.count_alive
    server = _Server(config, app.state.service)
    for ending in (signal.SIGTERM, signal.SIGINT):
        signal.signal(ending, server.handle_exit)  # also before and after the server runs
    supervisor.start()
    typer.echo(f"{LISTENING}http://{f'[{address}]' if ':' in address else address}:{bound_port}")
    try:
        server.run(sockets=[listener])
    finally:
        supervisor.stop()
    _log.info("the service has ended")
    logging.shutdown()
    sys.stdout.flush()
    os._exit(0)  # a request that was given up may still hold its thread


def worker() -> None:
    """A further worker process, until SIGTERM or Ctrl-C."""
    from gripwright.jobs.worker import run_worker  # the job engine: `serve` never needs it

    settings = load_settings()
    configure_logs(settings)
    prepare_database(settings)
    run_worker(settings)


def migrate() -> None:
    """Bring the database to this version."""
    settings = load_settings()
    settings.data_dir.mkdir(parents=True, exist_ok=True)
    migrate_database(Database(settings.resolved_database_url))
    typer.echo("the database is at this version")


def prepare_database(settings: Settings) -> None:
    """Migrate the default database; Conflict where another one is not at this version."""
    settings.data_dir.mkdir(parents=True, exist_ok=True)
    database = Database(settings.resolved_database_url)
    prepare(database, automatically=settings.uses_default_database)
    database.dispose()


def check_way_in(settings: Settings) -> None:
    """Conflict where the service would ask for a key, and there is none."""
    database = Database(settings.resolved_database_url)
    require_way_in(settings, database, utc_now())
    database.dispose()


class _Server(uvicorn.Server):
    """Told to end it takes no new requests, ends streams, and waits for the others; told again it ends at once."""

    def __init__(self, config: uvicorn.Config, service: State) -> None:
        super().__init__(config)
        self._service = service

    def handle_exit(self, sig: int, frame: object) -> None:
        """A signal. (The framework's own waits on at a second SIGTERM, and raises the first one again when it has ended.)"""
        if self.should_exit:
            os._exit(128 + sig)  # the workers see their lifeline end
        self.should_exit = self._service.is_ending = True
