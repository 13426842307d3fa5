"""Products: upload, list, read, delete, and their assembly sequence."""

from typing import Annotated

from fastapi import APIRouter, Body, Query, Request, Response, status
from fastapi.responses import JSONResponse

from gripwright.cad.package import read_upload
from gripwright.http.bundles import packages_of
from gripwright.http.deps import Artifacts, HeavyTurn, Now, ReadSession, Service, WriteSession
from gripwright.http.idempotency import ActingRoute
from gripwright.http.merge_patch import MergePatch, patch_schema
from gripwright.http.pagination import Changes, list_answer
from gripwright.http.preconditions import IfMatch, check_match, require_match, version_tag
from gripwright.http.reading import NOT_MODIFIED, Sparse
from gripwright.http.schemas.problem import problems
from gripwright.http.schemas.product_import import ImportedProductView, ProductImportView
from gripwright.http.schemas.products import OperationsBody, ProductPage, ProductPatch, ProductSummary, ProductView
from gripwright.http.uploads import IMPORT_SCHEMA, UPLOAD_SCHEMA, UploadFiles
from gripwright.jobs.product_import import ProductImport
from gripwright.jobs.products import change_product, check_product, register_product, replace_operations
from gripwright.jobs.requests import delete_product
from gripwright.store.columns import utc_now
from gripwright.store.products import ProductRepository

router = APIRouter(prefix="/products", tags=["products"], route_class=ActingRoute)


DryRun = Annotated[bool, Query(description="say what would be done, and do nothing")]


@router.post(
    "",
    operation_id="create_product",
    status_code=status.HTTP_201_CREATED,
    response_model=ProductView,
    responses={
        200: {"model": ProductView | ImportedProductView, "description": "It exists with the same content; or a dry run"},
        **problems(400, 409, 413, 415, 422, 503, 507),
    },
    openapi_extra=UPLOAD_SCHEMA,
)
def create_product(
    upload: UploadFiles,
    turn: HeavyTurn,
    service: Service,
    session: WriteSession,
    artifacts: Artifacts,
    response: Response,
    dry_run: DryRun = False,
) -> object:
    """Upload a product: a package (.zip), CAD files with a `manifest` part, or one STEP assembly alone."""
    product = read_upload(upload, service.package_limits, service.spare_reader)
    if dry_run:
        existing, _ = check_product(session, product)
        return JSONResponse(ImportedProductView.checked(upload.label, product, existing).model_dump())
    row, is_new = register_product(session, artifacts, product, utc_now())  # reading took its time
    if not is_new:
        response.status_code = status.HTTP_200_OK
    response.headers["Location"] = f"/api/v1/products/{row.id}"
    response.headers["ETag"] = version_tag(row.version)
    return ProductView.of(row)


@router.post("/import", operation_id="import_products", responses=problems(400, 413, 415, 422, 503), openapi_extra=IMPORT_SCHEMA)
def import_products(
    upload: UploadFiles, turn: HeavyTurn, service: Service, artifacts: Artifacts, dry_run: DryRun = False
) -> ProductImportView:
    """Upload several packages, as parts or in a .zip of packages. Each is stored or refused by itself: `outcome` says which."""
    limits = service.package_limits
    products = ProductImport(service.database, artifacts, limits, service.spare_reader, clock=utc_now, dry_run=dry_run)
    done = products.run(packages_of(upload, limits, most=service.settings.import_max_packages))
    return ProductImportView(dry_run=dry_run, items=[ImportedProductView.of(product) for product in done])


@router.get("", operation_id="list_products", response_model=ProductPage, responses={**NOT_MODIFIED, **problems(422)})
def list_products(
    session: ReadSession,
    changes: Changes,
    sparse: Sparse,
    request: Request,
    part_number: Annotated[str | None, Query(max_length=500)] = None,
    revision: Annotated[str | None, Query(max_length=500)] = None,
    external_id: Annotated[
        str | None,
        Query(
            max_length=300,
            pattern=r"^[^:\x00]+:[^\x00]+$",
            description="SYSTEM:ID, what another system calls it",
            examples=["plm:4711"],
        ),
    ] = None,
) -> Response:
    """Products in the order of their upload, or with `updated_since` of their changes."""
    system, _, value = (external_id or "").partition(":")
    rows = ProductRepository(session).page(
        after=changes.page.after,
        limit=changes.page.limit + 1,
        part_number=part_number,
        revision=revision,
        external_id=None if external_id is None else (system, value),
        updated_since=changes.updated_since,
    )
    shown, next_cursor = changes.cut(rows)
    page = ProductPage(
        items=[ProductSummary.of(row) for row in shown],
        next_cursor=next_cursor,
        next_updated_since=changes.next_updated_since,
    )
    return list_answer(request, sparse, page)


@router.get(
    "/{product_id}",
    operation_id="get_product",
    response_model=ProductView,
    responses={**NOT_MODIFIED, **problems(404, 422)},
)
def get_product(product_id: str, session: ReadSession, sparse: Sparse) -> Response:
    """A product with its components and its assembly sequence."""
    row = ProductRepository(session).get(product_id)
    return sparse.answer(ProductView.of(row), tag=version_tag(row.version))


@router.patch(
    "/{product_id}",
    operation_id="patch_product",
    responses=problems(404, 412, 415, 422),
    openapi_extra=patch_schema(ProductPatch),
)
def patch_product(
    product_id: str,
    patch: MergePatch,
    session: WriteSession,
    artifacts: Artifacts,
    now: Now,
    response: Response,
    if_match: IfMatch = None,
) -> ProductView:
    """Merge a patch (RFC 7396): `name`, `external_ids`; null restores the default."""
    row = ProductRepository(session).get(product_id)
    check_match(if_match, version_tag(row.version))
    change_product(session, artifacts, row, patch, now)
    response.headers["ETag"] = version_tag(row.version)
    return ProductView.of(row)


@router.delete(
    "/{product_id}",
    operation_id="delete_product",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=problems(404, 409, 412, 428),
)
def remove_product(product_id: str, session: WriteSession, if_match: IfMatch = None) -> None:
    """Delete a product and its designs. `If-Match` is required: nobody deletes what they have not seen."""
    row = ProductRepository(session).get(product_id)
    require_match(if_match, version_tag(row.version))
    delete_product(session, row)


@router.put(
    "/{product_id}/operations",
    operation_id="put_operations",
    responses=problems(404, 412, 422),
)
def put_operations(
    product_id: str,
    body: Annotated[OperationsBody, Body()],
    session: WriteSession,
    artifacts: Artifacts,
    now: Now,
    response: Response,
    if_match: IfMatch = None,
) -> ProductView:
    """Give the product its assembly sequence, `{"operations": […]}` or the list alone, as in product.json."""
    row = ProductRepository(session).get(product_id)
    check_match(if_match, version_tag(row.version))
    replace_operations(session, artifacts, row, body, now)
    response.headers["ETag"] = version_tag(row.version)
    return ProductView.of(row)
