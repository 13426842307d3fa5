"""Products: upload, list, read, delete, and their assembly sequence."""

from typing import Annotated

from fastapi import APIRouter, Body, Query, Request, Response, status

from gripwright.http.deps import Artifacts, Now, ReadSession, Service, WriteSession
from gripwright.http.pagination import Page, link_next
from gripwright.http.preconditions import IfMatch, IfNoneMatch, check_match, is_known, require_match, version_tag
from gripwright.http.schemas.problem import problems
from gripwright.http.schemas.products import OperationsBody, ProductPage, ProductSummary, ProductView
from gripwright.http.uploads import UPLOAD_SCHEMA, UploadParts, stored_upload
from gripwright.jobs.products import read_upload, register_product, replace_operations
from gripwright.jobs.requests import delete_product
from gripwright.store.models import ProductRow
from gripwright.store.pages import Cursor
from gripwright.store.products import ProductRepository

router = APIRouter(prefix="/products", tags=["products"])


@router.post(
    "",
    operation_id="create_product",
    status_code=status.HTTP_201_CREATED,
    response_model=ProductView,
    responses={
        200: {"model": ProductView, "description": "It exists with the same content"},
        **problems(409, 413, 415, 422, 507),
    },
    openapi_extra=UPLOAD_SCHEMA,
)
def create_product(
    upload: UploadParts, service: Service, session: WriteSession, artifacts: Artifacts, now: Now, response: Response
) -> ProductView:
    """Upload a product: a package (.zip), CAD files with a `manifest` part, or one STEP assembly alone."""
    with stored_upload(upload) as path:
        product = read_upload(path, service.package_limits)
    row, is_new = register_product(session, artifacts, product, now)
    if not is_new:
        response.status_code = status.HTTP_200_OK
    response.headers["Location"] = f"/api/v1/products/{row.id}"
    response.headers["ETag"] = version_tag(row.version)
    return ProductView.of(row)


@router.get("", operation_id="list_products", responses=problems(422))
def list_products(
    session: ReadSession,
    page: Page,
    request: Request,
    response: Response,
    part_number: Annotated[str | None, Query(max_length=200)] = None,
) -> ProductPage:
    """Products in the order of their upload."""
    rows = ProductRepository(session).page(after=page.after, limit=page.limit + 1, part_number=part_number)
    shown, next_cursor = page.cut(rows, _cursor)
    link_next(request, response, next_cursor)
    return ProductPage(items=[ProductSummary.of(row) for row in shown], next_cursor=next_cursor)


@router.get(
    "/{product_id}",
    operation_id="get_product",
    response_model=ProductView,
    responses={304: {"description": "Not modified"}, **problems(404)},
)
def get_product(product_id: str, session: ReadSession, response: Response, if_none_match: IfNoneMatch = None) -> object:
    """A product with its components and its assembly sequence."""
    row = ProductRepository(session).get(product_id)
    tag = version_tag(row.version)
    if is_known(if_none_match, tag):
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers={"ETag": tag})
    response.headers["ETag"] = tag
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


def _cursor(row: ProductRow) -> Cursor:
    return Cursor(created_at=row.created_at, id=row.id)
