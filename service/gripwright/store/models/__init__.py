"""The tables. Every constraint is named, so that migrations can change it; contents of files live in the artifact store."""

from gripwright.store.models.base import Base
from gripwright.store.models.callers import ApiKeyRow, AuditRow, IdempotencyRow
from gripwright.store.models.designs import JOB_STATUSES, DesignFileRow, DesignRow, JobEventRow, JobRow, QuarantineRow
from gripwright.store.models.products import ActuatorRow, ComponentRow, ExternalIdRow, ProductRow
from gripwright.store.models.webhooks import DELIVERY_STATUSES, WebhookAttemptRow, WebhookDeliveryRow, WebhookRow
from gripwright.store.models.workers import StepStatRow, WorkerRow

__all__ = [
    "DELIVERY_STATUSES",
    "JOB_STATUSES",
    "ActuatorRow",
    "ApiKeyRow",
    "AuditRow",
    "Base",
    "ComponentRow",
    "DesignFileRow",
    "DesignRow",
    "ExternalIdRow",
    "IdempotencyRow",
    "JobEventRow",
    "JobRow",
    "ProductRow",
    "QuarantineRow",
    "StepStatRow",
    "WebhookAttemptRow",
    "WebhookDeliveryRow",
    "WebhookRow",
    "WorkerRow",
]
