"""Components of a product: what they are, their mesh, and what of them may be touched."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Query, Response, status

from gripwright.http.deps import Artifacts, Now, ReadSession, WriteSession
from gripwright.http.downloads import file_response
from gripwright.http.preconditions import IfMatch, IfNoneMatch, check_match, is_known, version_tag
from gripwright.http.schemas.problem import problems
from gripwright.http.schemas.products import ComponentView
from gripwright.jobs.products import change_component, component_mesh
from gripwright.store.media_types import media_type_of
from gripwright.store.products import ProductRepository

router = APIRouter(prefix="/products/{product_id}/components/{component_id}", tags=["products"])

_PATCH_SCHEMA: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            media_type: {"schema": {"$ref": "#/components/schemas/ComponentPatch"}}
            for media_type in ("application/merge-patch+json", "application/json")
        },
    }
}


@router.get(
    "",
    operation_id="get_component",
    response_model=ComponentView,
    responses={304: {"description": "Not modified"}, **problems(404)},
)
def get_component(
    product_id: str, component_id: str, session: ReadSession, response: Response, if_none_match: IfNoneMatch = None
) -> object:
    """A component: its entry of the manifest, and what was measured of its mesh."""
    product, row = ProductRepository(session).component(product_id, component_id)
    tag = version_tag(product.version)
    if is_known(if_none_match, tag):
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers={"ETag": tag})
    response.headers["ETag"] = tag
    return ComponentView.of(product, row)


@router.patch(
    "",
    operation_id="patch_component",
    responses=problems(404, 412, 415, 422),
    openapi_extra=_PATCH_SCHEMA,
)
def patch_component(
    product_id: str,
    component_id: str,
    body: Annotated[dict[str, Any], Body()],
    session: WriteSession,
    artifacts: Artifacts,
    now: Now,
    response: Response,
    if_match: IfMatch = None,
) -> ComponentView:
    """Merge a patch (RFC 7396): `no_grasp`, `may_grasp`, `density`, `friction`; null restores the default."""
    product, row = ProductRepository(session).component(product_id, component_id)
    check_match(if_match, version_tag(product.version))
    change_component(session, artifacts, product, row, body, now)
    response.headers["ETag"] = version_tag(product.version)
    return ComponentView.of(product, row)


@router.get(
    "/mesh.glb",
    operation_id="get_component_mesh",
    response_class=Response,
    responses={
        200: {"content": {"model/gltf-binary": {}}, "description": "The mesh, metres as glTF says"},
        304: {"description": "Not modified"},
        **problems(404, 409),
    },
)
def get_component_mesh(
    product_id: str,
    component_id: str,
    session: ReadSession,
    artifacts: Artifacts,
    colour: Annotated[Literal["segment", "sdf"] | None, Query(description="by the latest design's analysis")] = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """A component's mesh as GLB, in its own frame; coloured by segment or by shape diameter once a design has analysed it."""
    sha256 = component_mesh(session, product_id, component_id, colour)
    name = f"{component_id}.glb"
    return file_response(artifacts, sha256, media_type=media_type_of(name), name=name, if_none_match=if_none_match)
