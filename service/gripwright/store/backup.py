"""A backup: a folder with a SQLite file of one moment, every artifact that it names, and a manifest. The service may run."""

import hashlib
import json
import os
import shutil
import sqlite3
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import gripwright
from gripwright.domain.errors import Conflict, InvalidInput, NotFound
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.columns import utc_now
from gripwright.store.engines import Database
from gripwright.store.files import write_atomically
from gripwright.store.migrate import migrate
from gripwright.store.transfer import copy_artifacts, copy_rows, names_in, snapshot

DATABASE, ARTIFACTS, MANIFEST = "gripwright.db", "artifacts", "backup.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Backup:
    """What a backup's manifest says: it is written last, so that a folder without one is no backup."""

    version: str
    made_at: str
    database_sha256: str
    rows: int
    artifacts: int


def make_backup(database: Database, artifacts: ArtifactStore, folder: Path) -> Backup:
    """Write a backup into a folder. Into that of an earlier backup only artifacts that are new are written.

    The database comes first: files are never changed in place, so what it names is there still.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / MANIFEST).unlink(missing_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".", suffix=".part") as name:
        copy = _sqlite(Path(name) / DATABASE)
        with snapshot(database) as connection:
            counts = copy_rows(connection, copy, requeue=False)
        names = names_in(copy)
        copy.dispose()
        _fold_log(Path(name) / DATABASE)
        os.replace(Path(name) / DATABASE, folder / DATABASE)
    copy_artifacts(iter(names), artifacts, ArtifactStore(folder / ARTIFACTS))
    backup = Backup(
        version=gripwright.__version__,
        made_at=utc_now().isoformat(),
        database_sha256=_sha256(folder / DATABASE),
        rows=sum(counts.values()),
        artifacts=len(names),
    )
    write_atomically(folder / MANIFEST, json.dumps(asdict(backup), indent=1).encode())
    return backup


def restore_backup(folder: Path, database: Database, artifacts: ArtifactStore, *, replace: bool) -> Backup:
    """Write a backup into a database and its storage. Everything is checked before anything is written.

    Conflict where the database holds data, unless that is to be replaced. A backup of an older version is migrated on the way.
    """
    backup, stored = _checked(folder), ArtifactStore(folder / ARTIFACTS)
    with tempfile.TemporaryDirectory(prefix="gripwright-restore-") as name:
        shutil.copyfile(folder / DATABASE, Path(name) / DATABASE)  # the backup itself is not touched
        copy = _sqlite(Path(name) / DATABASE)
        migrate(copy)
        names = names_in(copy)
        damaged = [sha256 for sha256 in names if not _is_whole(stored, sha256)]
        if damaged:
            raise InvalidInput(f"the backup lacks {len(damaged)} of {len(names)} artifacts, or has them damaged: {damaged[0]}")
        copy_artifacts(iter(names), stored, artifacts)
        with snapshot(copy) as connection:
            copy_rows(connection, database, replace=replace)
        copy.dispose()
    return backup


def _checked(folder: Path) -> Backup:
    """The manifest of a backup whose database is whole."""
    try:
        fields: dict[str, Any] = json.loads((folder / MANIFEST).read_bytes())
        backup = Backup(**fields)
        found = _sha256(folder / DATABASE)
    except FileNotFoundError as error:
        raise NotFound(f"{folder} is no complete backup: {Path(error.filename).name} is missing") from None
    except (ValueError, TypeError) as error:
        raise InvalidInput(f"{folder / MANIFEST} cannot be read: {error}") from None
    if found != backup.database_sha256:
        raise Conflict(f"{folder / DATABASE} is damaged: its sha-256 is {found}, the backup's was {backup.database_sha256}")
    return backup


def _is_whole(artifacts: ArtifactStore, sha256: str) -> bool:
    return artifacts.has(sha256) and hashlib.sha256(artifacts.get(sha256)).hexdigest() == sha256


def _sqlite(path: Path) -> Database:
    return Database(f"sqlite:///{path}")


def _fold_log(path: Path) -> None:
    """Bring everything into the one file, as which it can be moved."""
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA journal_mode=DELETE")
    connection.close()


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
