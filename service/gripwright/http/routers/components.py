"""Components of a product: what they are, their mesh, and what of them may be touched."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from gripwright.http.deps import Artifacts, Now, ReadSession, WriteSession
from gripwright.http.downloads import file_response
from gripwright.http.merge_patch import MergePatch, patch_schema
from gripwright.http.preconditions import IfMatch, IfNoneMatch, IfRange, Range, check_match, version_tag
from gripwright.http.reading import NOT_MODIFIED, Sparse
from gripwright.http.schemas.problem import problems
from gripwright.http.schemas.products import ComponentList, ComponentPatch, ComponentView
from gripwright.jobs.products import change_component, component_mesh
from gripwright.store.media_types import media_type_of
from gripwright.store.products import ProductRepository

router = APIRouter(prefix="/products/{product_id}/components", tags=["products"])


@router.get(
    "",
    operation_id="list_components",
    response_model=ComponentList,
    responses={**NOT_MODIFIED, **problems(404, 422)},
)
def list_components(product_id: str, session: ReadSession, sparse: Sparse) -> Response:
    """All components of a product, in the order of its manifest."""
    product = ProductRepository(session).get(product_id)
    components = ComponentList(items=[ComponentView.of(product, row) for row in product.components])
    return sparse.answer(components, tag=version_tag(product.version))


@router.get(
    "/{component_id}",
    operation_id="get_component",
    response_model=ComponentView,
    responses={**NOT_MODIFIED, **problems(404, 422)},
)
def get_component(product_id: str, component_id: str, session: ReadSession, sparse: Sparse) -> Response:
    """A component: its entry of the manifest, and what was measured of its mesh."""
    product, row = ProductRepository(session).component(product_id, component_id)
    return sparse.answer(ComponentView.of(product, row), tag=version_tag(product.version))


@router.patch(
    "/{component_id}",
    operation_id="patch_component",
    responses=problems(404, 412, 415, 422),
    openapi_extra=patch_schema(ComponentPatch),
)
def patch_component(
    product_id: str,
    component_id: str,
    patch: MergePatch,
    session: WriteSession,
    artifacts: Artifacts,
    now: Now,
    response: Response,
    if_match: IfMatch = None,
) -> ComponentView:
    """Merge a patch (RFC 7396): `no_grasp`, `may_grasp`, `density`, `friction`, `texture`, `ferrous`, `external_ids`.

    Null restores the default.
    """
    product, row = ProductRepository(session).component(product_id, component_id)
    check_match(if_match, version_tag(product.version))
    change_component(session, artifacts, product, row, patch, now)
    response.headers["ETag"] = version_tag(product.version)
    return ComponentView.of(product, row)


@router.get(
    "/{component_id}/mesh.glb",
    operation_id="get_component_mesh",
    response_class=Response,
    responses={
        200: {"content": {"model/gltf-binary": {}}, "description": "The mesh, metres as glTF says"},
        206: {"description": "The range that was asked for"},
        304: {"description": "Not modified"},
        **problems(404, 409, 416),
    },
)
def get_component_mesh(
    product_id: str,
    component_id: str,
    session: ReadSession,
    artifacts: Artifacts,
    colour: Annotated[Literal["segment", "sdf"] | None, Query(description="by the latest design's analysis")] = None,
    if_none_match: IfNoneMatch = None,
    if_range: IfRange = None,
    range_: Range = None,
) -> Response:
    """A component's mesh as GLB, in its own frame; coloured by segment or by shape diameter once a design has analysed it."""
    sha256 = component_mesh(session, product_id, component_id, colour)
    name = f"{component_id}.glb"
    return file_response(artifacts, sha256, media_type=media_type_of(name), name=name, if_none_match=if_none_match)
