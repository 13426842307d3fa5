"""The worker processes, of this host and of others."""

from fastapi import APIRouter

from gripwright.http.deps import ReadSession, Service
from gripwright.http.schemas.workers import WorkerList, WorkerView
from gripwright.store.workers import WorkerRepository

router = APIRouter(prefix="/workers", tags=["workers"])


@router.get("", operation_id="list_workers")
def list_workers(session: ReadSession, service: Service) -> WorkerList:
    """Every worker process with its host, its version and how many steps it runs."""
    lease_s = service.settings.worker_lease_s
    return WorkerList(items=[WorkerView.of(worker, lease_s) for worker in WorkerRepository(session).all()])
