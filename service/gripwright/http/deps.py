"""What handlers are given: sessions, stores, and what is installed.

What only looks something up is `async`: the framework would send anything else to a thread and wait for it.
"""

from collections.abc import AsyncIterator, Iterator
from datetime import datetime
from typing import Annotated, cast

from fastapi import Depends, Request
from sqlalchemy.orm import Session

from gripwright.http.errors import NotReady
from gripwright.http.state import State
from gripwright.registry.description import RegistryDescription
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.columns import utc_now
from gripwright.traces import TracePlace


async def service_state(request: Request) -> State:
    """The parts of the service."""
    return cast(State, request.app.state.service)


_LISTING_S = 60.0

Service = Annotated[State, Depends(service_state)]


def write_session(request: Request, service: Service) -> Iterator[Session]:
    """One request, one transaction: commit on return, roll back on any exception. Its answer may be kept in it."""
    with service.database.write_sessions.begin() as session:
        request.state.write_session = session
        yield session


def read_session(service: Service) -> Iterator[Session]:
    """One request, one consistent view."""
    with service.database.read_sessions() as session:
        yield session


# "function": the exit code, hence the commit, runs before the response is sent.
WriteSession = Annotated[Session, Depends(write_session, scope="function")]
ReadSession = Annotated[Session, Depends(read_session, scope="function")]


async def artifact_store(service: Service) -> ArtifactStore:
    """Files by their content."""
    return service.artifacts


Artifacts = Annotated[ArtifactStore, Depends(artifact_store)]


def installed_plugins(service: Service) -> RegistryDescription:
    """What is installed. Right after the start a request waits for the listing; NotReady where it takes too long or failed."""
    service.wait_for_plugins(_LISTING_S)
    if service.plugins is None:
        raise NotReady(service.plugins_problem or "the plug-ins are still being listed; try again in a moment")
    return service.plugins


def traceparent(request: Request) -> str:
    """The request as the parent of what is done for it."""
    return cast(TracePlace, request.state.trace).traceparent


Traceparent = Annotated[str, Depends(traceparent)]
Plugins = Annotated[RegistryDescription, Depends(installed_plugins)]


async def this_moment() -> datetime:
    """The time of the request, UTC."""
    return utc_now()


Now = Annotated[datetime, Depends(this_moment)]


async def asking_actor(request: Request) -> str:
    """Who asks, as in the audit trail."""
    return cast(str, request.state.actor)


Actor = Annotated[str, Depends(asking_actor)]


async def heavy_turn(service: Service) -> AsyncIterator[None]:
    """One of the turns of this service. It begins when the body has arrived: slow callers hold none."""
    await service.turns.take()
    try:
        yield
    finally:
        service.turns.give_back()


HeavyTurn = Annotated[None, Depends(heavy_turn, scope="function")]
