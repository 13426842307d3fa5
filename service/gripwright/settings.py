"""Settings of the service, from the environment: `GRIPWRIGHT_` and the field's name in capitals."""

from functools import cached_property
from pathlib import Path

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict


class Settings(BaseSettings):
    """What a deployment may choose; every field has a default that works on one machine."""

    model_config = SettingsConfigDict(env_prefix="GRIPWRIGHT_", populate_by_name=True, extra="ignore", frozen=True)

    data_dir: Path = Field(
        Path("~/.local/share/gripwright"),
        validation_alias="GRIPWRIGHT_DATA",
        description="folder of the database, the artifacts and the stored step results",
    )
    database_url: str = Field("", description="SQLAlchemy URL; empty: SQLite in `data_dir`, migrated by `serve` itself")
    host: str = "127.0.0.1"
    port: int = Field(8000, ge=0, le=65535)
    workers: int = Field(1, ge=0, le=64, description="worker processes embedded in `serve`")
    upload_max_bytes: int = Field(512 * 2**20, ge=1, description="of one product upload")
    body_max_bytes: int = Field(8 * 2**20, ge=1, description="of any other request body")
    upload_max_files: int = Field(1000, ge=1, description="parts of one multipart upload")
    gripper_set_timeout_s: float = Field(30.0, gt=0, description="longest synchronous gripper-set optimisation")
    webhook_private_targets: bool = Field(False, description="allow webhooks to loopback and private addresses")
    webhook_attempts: int = Field(8, ge=1, le=20, description="deliveries tried before one is given up")

    @cached_property
    def data_path(self) -> Path:
        """`data_dir` as an absolute path."""
        return self.data_dir.expanduser().resolve()

    @property
    def uses_default_database(self) -> bool:
        """Whether the database is the SQLite file in `data_dir`."""
        return not self.database_url

    @property
    def resolved_database_url(self) -> str:
        """The SQLAlchemy URL to connect to; a PostgreSQL URL gets the psycopg driver."""
        if self.uses_default_database:
            return f"sqlite:///{self.data_path / 'gripwright.db'}"
        for prefix in ("postgresql://", "postgres://"):
            if self.database_url.startswith(prefix):
                return "postgresql+psycopg://" + self.database_url.removeprefix(prefix)
        return self.database_url
