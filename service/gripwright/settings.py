"""Settings of the service, from the environment: `GRIPWRIGHT_` and the field's name in capitals."""

import ipaddress
import os
from pathlib import Path
from typing import Annotated, Self
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
    host: str = "127.0.0.1"
    port: int = Field(default=8000, ge=0, le=65535)
    workers: int = Field(default=os.cpu_count() or 1, ge=0, le=64, description="worker processes embedded in `serve`")
    step_memory_mb: int = Field(default=4096, ge=256, description="of one step of a design")
    step_timeout_s: float = Field(default=900.0, gt=0, description="of one step of a design")
    plugins_allow: tuple[str, ...] | None = Field(default=None, description="distributions whose plug-ins may load; none: all")
    plugins_strict: bool = Field(default=False, description="a plug-in that fails to load is an error")
    upload_max_bytes: int = Field(default=512 * 2**20, ge=1, description="of one product upload")
    upload_max_files: int = Field(default=1000, ge=1, description="parts of one product upload")
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
    parse_at_a_time: int = Field(default=2, ge=1, le=64, description="uploads whose CAD files are read at the same time")
    parse_wait_s: float = Field(default=60.0, gt=0, description="longest wait of an upload for those before it")
    body_max_bytes: int = Field(default=8 * 2**20, ge=1, description="of any other request body")
    gripper_set_timeout_s: float = Field(default=30.0, gt=0, description="longest synchronous gripper-set optimisation")
    webhook_private_targets: bool = Field(default=False, description="allow webhooks to loopback and private addresses")
    webhook_attempts: int = Field(default=8, ge=1, le=20, description="deliveries tried before a message is given up")
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
    audit_days: int = Field(default=365, ge=1, le=36_500, description="how long the audit trail is kept")
    audit_reads: bool = Field(default=False, description="the audit trail holds requests that only read, too")

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
    def resolved_database_url(self) -> str:
        """The SQLAlchemy URL to connect to; a PostgreSQL URL gets the psycopg driver."""
        if self.database_url is None:
            return f"sqlite:///{self.data_dir / 'gripwright.db'}"
        for prefix in ("postgresql://", "postgres://"):
            if self.database_url.startswith(prefix):
                return "postgresql+psycopg://" + self.database_url.removeprefix(prefix)
        return self.database_url


def load_settings() -> Settings:
    """The settings of this process."""
    return Settings()
