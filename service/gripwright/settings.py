"""Settings of the service, from the environment: `GRIPWRIGHT_` and the field's name in capitals."""

import ipaddress
import os
from pathlib import Path
from typing import Annotated, Literal, Self
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from gripwright.cad.limits import Limits
from gripwright.domain.access import AccessScope


def _absolute(path: Path) -> Path:
    return path.expanduser().resolve()


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches what listens there."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def is_secure_url(url: str) -> bool:
    """Whether what is read from there can be trusted: HTTPS, or this machine."""
    parts = urlsplit(url)
    return bool(parts.hostname) and (parts.scheme == "https" or (parts.scheme == "http" and is_loopback(parts.hostname or "")))


def _issuer(url: str) -> str:
    if not is_secure_url(url):
        raise ValueError(f"the issuer must be an https URL, it is {url}")
    return url


def _storage(url: str) -> str:
    parts = urlsplit(url)
    is_folder = parts.scheme == "file" and not parts.netloc and parts.path.startswith("/")
    if not is_folder and not (parts.scheme == "s3" and parts.netloc):
        raise ValueError(f"the storage is file:///folder or s3://bucket/prefix, not {url}")
    return url


def _origin(origin: str) -> str:
    parts = urlsplit(origin)
    if parts.scheme not in ("http", "https") or not parts.hostname or origin != f"{parts.scheme}://{parts.netloc}":
        raise ValueError(f"an origin is written https://host or https://host:port, not {origin}")
    return origin


class Settings(BaseSettings):
    """What a deployment may choose; every field has a default that works on one machine."""

    model_config = SettingsConfigDict(env_prefix="GRIPWRIGHT_", populate_by_name=True, extra="ignore", frozen=True)

    data_dir: Annotated[Path, AfterValidator(_absolute)] = Field(
        default=_absolute(Path("~/.local/share/gripwright")),
        validation_alias="GRIPWRIGHT_DATA",
        description="folder of the database, the artifacts and the stored step results",
    )
    database_url: str | None = Field(
        default=None, description="SQLAlchemy URL; none: SQLite in `data_dir`, migrated by `serve` itself"
    )
    jobs_database_url: str | None = Field(default=None, description="of the job engine's own tables; none: SQLite in `data_dir`")
    storage_url: Annotated[str, AfterValidator(_storage)] | None = Field(
        default=None, description="of artifacts and step results: file:///folder or s3://bucket/prefix; none: `data_dir`"
    )
    disk_quota_bytes: int | None = Field(default=None, ge=1, description="of artifacts and step results together; none: no limit")
    disk_free_min_bytes: int = Field(default=256 * 2**20, ge=0, description="that stay free on the disk of a storage folder")
    steps_max_bytes: int | None = Field(default=None, ge=0, description="of stored step results; none: no limit")
    steps_max_days: float = Field(default=90.0, gt=0, description="for which a step result that nobody uses is kept")
    host: str = "127.0.0.1"
    port: int = Field(default=8000, ge=0, le=65535)
    workers: int = Field(default=os.cpu_count() or 1, ge=0, le=64, description="worker processes embedded in `serve`")
    worker_lease_s: float = Field(
        default=20.0, ge=1.0, le=3600.0, description="silence after which another worker takes over a worker's designs"
    )
    step_memory_mb: int = Field(default=4096, ge=256, description="of one step of a design")
    step_timeout_s: float = Field(default=900.0, gt=0, description="of one step of a design")
    plugin_memory_mb: int | None = Field(
        default=None, ge=64, description="that one call of a plug-in may take; none: as much as its step"
    )
    plugin_timeout_s: float | None = Field(default=None, gt=0, description="of one call of a plug-in; none: as its step")
    designs_per_worker: int = Field(default=4, ge=1, le=100, description="designs that one worker runs at a time")
    designs_per_client: int | None = Field(default=None, ge=1, description="designs of one client that run at a time; none: any")
    design_deadline_s: float | None = Field(default=None, gt=0, description="of a design that asks for no deadline; none: none")
    event_days: int = Field(default=90, ge=1, le=36_500, description="how long the events of a job are kept after its end")
    plugins_allow: tuple[str, ...] | None = Field(default=None, description="distributions whose plug-ins may load; none: all")
    plugins_strict: bool = Field(default=False, description="a plug-in that fails to load is an error")
    upload_max_bytes: int = Field(default=512 * 2**20, ge=1, description="of one product upload")
    upload_max_files: int = Field(default=1000, ge=1, description="parts of one product upload")
    import_max_packages: int = Field(default=200, ge=1, description="of one import of products")
    package_max_files: int = Field(default=2000, ge=1, description="files of one package")
    package_max_file_bytes: int = Field(default=256 * 2**20, ge=1, description="of one file of a package, decompressed")
    package_max_bytes: int = Field(default=1024 * 2**20, ge=1, description="of all files of a package, decompressed")
    package_max_document_bytes: int = Field(default=16 * 2**20, ge=1, description="of product.json")
    package_max_ratio: float = Field(default=200.0, ge=1, description="decompressed over compressed size of one file")
    package_max_triangles: int = Field(default=5_000_000, ge=1, description="of one component")
    package_max_levels: int = Field(default=100, ge=1, le=400, description="assemblies in assemblies, of one CAD file")
    package_max_instances: int = Field(default=100_000, ge=1, description="parts that one CAD file places")
    parse_file_s: float = Field(default=7.0, gt=0, description="processor time to read one CAD file")
    parse_mib_s: float = Field(default=4.0, ge=0, description="as much more for each MiB of it")
    parse_package_s: float = Field(default=300.0, gt=0, description="longest time to read all CAD files of a package")
    parse_memory_mb: int = Field(default=6144, ge=512, description="address space of the process that reads CAD files")
    body_max_bytes: int = Field(default=8 * 2**20, ge=1, description="of any other request body")
    idempotency_hours: int = Field(default=24, ge=1, le=168, description="how long answers are given again by Idempotency-Key")
    gripper_set_timeout_s: float = Field(default=30.0, gt=0, description="longest synchronous gripper-set optimisation")
    wait_max_s: int = Field(default=60, ge=0, le=3600, description="longest that `Prefer: wait` is granted")
    wait_requests: int = Field(
        default=100, ge=0, le=10_000, description="requests that may wait at a time; others are answered at once"
    )
    webhook_private_targets: bool = Field(default=False, description="allow webhooks to loopback and private addresses")
    webhook_attempts: int = Field(default=8, ge=1, le=20, description="deliveries tried before a message is given up")
    webhook_days: int = Field(default=30, ge=1, le=3650, description="how long messages that are over are kept")
    webhook_failing_days: float = Field(default=5.0, gt=0, description="of failures alone, after which a webhook is disabled")
    access_required: bool = Field(default=False, description="ask for a key or token on loopback too; elsewhere always")
    oidc_issuer: Annotated[str, AfterValidator(_issuer)] | None = Field(default=None, description="whose bearer tokens are taken")
    oidc_audience: str | None = Field(default=None, min_length=1, description="that the tokens must be for")
    oidc_claim: str = Field(default="scope", min_length=1, description="of a token: its scopes, a list or words in one string")
    oidc_scopes: dict[str, AccessScope] = Field(
        default={f"gripwright:{scope}": scope for scope in AccessScope}, description="value of the claim → read, write or admin"
    )
    cors_origins: tuple[Annotated[str, AfterValidator(_origin)], ...] = Field(
        default=(), description="origins whose pages may read answers"
    )
    allowed_hosts: tuple[str, ...] = Field(
        default=(), description="names in `Host` beside those of loopback, where no key is asked; where one is: none means all"
    )
    rate_reads: int | None = Field(
        default=None, ge=1, description="reads a minute of one client; none: 3000 where a key is asked, else no limit"
    )
    rate_writes: int | None = Field(
        default=None, ge=1, description="of everything else; none: 600 where a key is asked, else no limit"
    )
    rate_burst: int = Field(default=200, ge=1, description="requests of one client at once, of each kind")
    heavy_requests: int = Field(default=4, ge=1, le=32, description="uploads read and gripper sets solved at a time")
    heavy_wait_s: float = Field(default=30.0, gt=0, description="longest wait of another one before it is told to come again")
    audit_days: int = Field(default=365, ge=1, le=36_500, description="how long the audit trail is kept")
    audit_reads: bool = Field(default=False, description="the audit trail holds requests that only read, too")

    log_format: Literal["json", "console"] | None = Field(default=None, description="of the log; none: console on a terminal")
    log_level: Literal["DEBUG", "INFO", "WARNING", "ERROR"] = Field(default="INFO", description="of the log")
    shutdown_s: float = Field(
        default=20.0, ge=0, le=600, description="time for requests in flight when the service is told to end"
    )

    @model_validator(mode="after")
    def _audience_with_issuer(self) -> Self:
        if (self.oidc_issuer is None) != (self.oidc_audience is None):
            raise ValueError("an issuer needs an audience, and an audience an issuer")
        return self

    @property
    def asks_for_access(self) -> bool:
        """Whether requests need a key or a token."""
        return self.access_required or not is_loopback(self.host)

    @property
    def package_limits(self) -> Limits:
        """What a package may cost."""
        return Limits(
            max_files=self.package_max_files,
            max_file_bytes=self.package_max_file_bytes,
            max_total_bytes=self.package_max_bytes,
            max_document_bytes=self.package_max_document_bytes,
            max_ratio=self.package_max_ratio,
            max_triangles=self.package_max_triangles,
            max_levels=self.package_max_levels,
            max_instances=self.package_max_instances,
            seconds=self.parse_package_s,
            seconds_per_file=self.parse_file_s,
            seconds_per_mebibyte=self.parse_mib_s,
            memory_bytes=self.parse_memory_mb * 2**20,
        )

    @property
    def uses_default_database(self) -> bool:
        """Whether the database is the SQLite file in `data_dir`."""
        return self.database_url is None

    @property
    def resolved_storage_url(self) -> str:
        """Where artifacts and step results are kept, as a URL."""
        return self.storage_url or self.data_dir.as_uri()

    @property
    def resolved_database_url(self) -> str:
        """The SQLAlchemy URL to connect to; a PostgreSQL URL gets the psycopg driver."""
        if self.database_url is None:
            return f"sqlite:///{self.data_dir / 'gripwright.db'}"
        return with_driver(self.database_url)


def with_driver(url: str) -> str:
    """A database's URL with the driver that we use for PostgreSQL."""
    for prefix in ("postgresql://", "postgres://"):
        if url.startswith(prefix):
            return "postgresql+psycopg://" + url.removeprefix(prefix)
    return url


def load_settings() -> Settings:
    """The settings of this process."""
    return Settings()
