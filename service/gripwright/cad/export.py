"""Files of made parts: STEP, STL, 3MF. The same input gives the same bytes: no times, no counters."""

import io
import zipfile
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Gravity
from OCP.StepBasic import StepBasic_Product
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_Controller
from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from gripwright.cad.stl import RECORD
from gripwright.domain.shape import Mesh
from gripwright.geometry.brep import read_brep
from gripwright.geometry.measures import face_normals

_EPOCH = "1970-01-01T00:00:00"
_ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)


def step_bytes(brep: bytes, *, name: str, part_number: str, description: str = "") -> bytes:
    """A STEP file (AP242, mm) of a binary BRep stream (geometry/brep.py), its product named; text other than ASCII is escaped."""
    _silence()
    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    label = XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).AddShape(read_brep(brep), False)
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    STEPControl_Controller.Init_s()  # makes the parameters below known
    for parameter, value in (("write.step.schema", "AP242DIS"), ("write.step.unit", "MM"), ("write.step.assembly", "Off")):
        if not Interface_Static.SetCVal_s(parameter, value):
            raise RuntimeError(f"Open CASCADE does not know {parameter} = {value}")
    writer = STEPCAFControl_Writer()
    if not writer.Transfer(document):
        raise RuntimeError("Open CASCADE does not write this solid as STEP")
    _identify(writer.ChangeWriter().Model(), name, part_number, description)
    stream = io.BytesIO()
    if writer.WriteStream(stream) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise RuntimeError("Open CASCADE does not write this solid as STEP")
    return stream.getvalue()


def _identify(model: Any, name: str, part_number: str, description: str) -> None:
    """Product and file header, instead of the translator's own names and the time."""
    for k in range(1, model.NbEntities() + 1):
        entity = model.Value(k)
        if isinstance(entity, StepBasic_Product):
            entity.SetId(_text(part_number))
            entity.SetName(_text(name))
            entity.SetDescription(_text(description))
    header = APIHeaderSection_MakeHeader(model)
    header.SetName(_text(part_number))
    header.SetTimeStamp(_text(_EPOCH))
    header.SetOriginatingSystem(_text("gripwright"))


def _text(text: str) -> Any:
    """A STEP string; characters beyond ASCII as ISO 10303-21 writes them, eight hexadecimal digits each, a backslash as /."""
    plain = text.replace("\\", "/")
    return TCollection_HAsciiString("".join(c if c.isascii() else f"\\X4\\{ord(c):08X}\\X0\\" for c in plain))


def _silence() -> None:
    """Open CASCADE reports its progress on standard output, which is ours."""
    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)


def stl_bytes(mesh: Mesh) -> bytes:
    """A binary STL file in mm, faces in the mesh's order."""
    records = np.zeros(len(mesh.faces), dtype=RECORD)
    records["normal"] = face_normals(mesh)
    records["corners"] = mesh.triangles_mm
    return b"gripwright, mm".ljust(80) + np.uint32(len(records)).tobytes() + records.tobytes()


def threemf_bytes(mesh: Mesh, name: str) -> bytes:
    """A 3MF file of one object, mm."""
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in mesh.vertices_mm.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces.tolist())
    model = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f'<resources><object id="1" type="model" name={quoteattr(name)}><mesh>'
        f"<vertices>{vertices}</vertices><triangles>{triangles}</triangles>"
        '</mesh></object></resources><build><item objectid="1"/></build></model>'
    )
    types = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
    )
    relations = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
        'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
    )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, content in (("[Content_Types].xml", types), ("_rels/.rels", relations), ("3D/3dmodel.model", model)):
            entry = zipfile.ZipInfo(path, date_time=_ZIP_EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return buffer.getvalue()
