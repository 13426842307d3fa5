"""Many products at once: each is stored, or refused, by itself."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Literal

from sqlalchemy.exc import IntegrityError

from gripwright.cad.archive import PackageFiles
from gripwright.cad.limits import Limits
from gripwright.cad.package import Product, read_upload
from gripwright.cad.spare import SpareReader
from gripwright.domain.errors import Conflict, Fault, GripwrightError, LimitExceeded
from gripwright.jobs.products import check_product, register_product
from gripwright.store.artifacts import ArtifactStore
from gripwright.store.engines import Database

Outcome = Literal["created", "exists", "conflict", "refused"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedProduct:
    """What has become, or would become, of one package."""

    name: str  # of the file
    outcome: Outcome
    part_number: str | None = None  # None: it could not be read
    revision: str | None = None
    product_id: str | None = None  # of the product that there is; None where a dry run would make it
    detail: str | None = None  # why not
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Package:
    """A file to import, or why it is none."""

    name: str
    files: PackageFiles | None = None
    refusal: GripwrightError | None = None


class ProductImport:
    """Imports packages one by one, each in a transaction of its own; all together have the time that one upload has."""

    def __init__(
        self,
        database: Database,
        artifacts: ArtifactStore,
        limits: Limits,
        spare: SpareReader,
        *,
        clock: Callable[[], datetime],
        dry_run: bool,
    ) -> None:
        self._database, self._artifacts, self._limits, self._spare = database, artifacts, limits, spare
        self._clock, self._dry_run = clock, dry_run
        self._seen: dict[tuple[str, str], str] = {}  # of a dry run: what it would have stored by now
        self._ends_s = time.monotonic() + limits.seconds

    def run(self, packages: Iterable[Package]) -> list[ImportedProduct]:
        """What becomes of each."""
        return [self._import(package) for package in packages]

    def _import(self, package: Package) -> ImportedProduct:
        try:
            product = self._read(package)
        except GripwrightError as error:
            return ImportedProduct(name=package.name, outcome="refused", detail=error.detail, faults=error.faults)
        manifest = product.manifest
        detail: str | None = None
        try:
            outcome, product_id = self._check(product) if self._dry_run else self._store(product)
        except Conflict as error:
            known = error.context.get("product_id")
            outcome, product_id, detail = "conflict", None if known is None else str(known), error.detail
        except IntegrityError:
            outcome, product_id, detail = "conflict", None, "another request stored it at the same time: import it again"
        return ImportedProduct(
            name=package.name,
            outcome=outcome,
            part_number=manifest.part_number,
            revision=manifest.revision,
            product_id=product_id,
            detail=detail,
        )

    def _read(self, package: Package) -> Product:
        if package.refusal is not None:
            raise package.refusal
        assert package.files is not None
        left_s = self._ends_s - time.monotonic()
        if left_s <= 0:
            raise LimitExceeded(f"the packages before this one took {self._limits.seconds:.0f} s, at most that for all of them")
        return read_upload(package.files, replace(self._limits, seconds=left_s), self._spare)

    def _store(self, product: Product) -> tuple[Outcome, str | None]:
        with self._database.write_sessions.begin() as session:
            row, is_new = register_product(session, self._artifacts, product, self._clock())
            return "created" if is_new else "exists", row.id

    def _check(self, product: Product) -> tuple[Outcome, str | None]:
        with self._database.read_sessions() as session:
            row, sha256 = check_product(session, product)
        identity = (product.manifest.part_number, product.manifest.revision)
        is_first = identity not in self._seen
        if self._seen.setdefault(identity, sha256) != sha256:
            raise Conflict(f"product {identity[0]} revision {identity[1]!r} is imported twice with different content")
        if row is not None:
            return "exists", row.id
        return "created" if is_first else "exists", None
