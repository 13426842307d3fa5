"""The frame of a STEP file (ISO 10303-21), looked at before Open CASCADE, which takes long to load, is asked."""

from gripwright.domain.errors import InvalidGeometry

_BEGIN, _END = b"ISO-10303-21;", b"END-ISO-10303-21;"
_FRAME_BYTES = 2**16  # blanks and comments may stand around, and a signature after the end


def check_frame(data: bytes) -> None:
    """InvalidGeometry for what is not a whole file: the importer makes what it can of a part of one."""
    if _BEGIN not in data[:_FRAME_BYTES]:
        raise InvalidGeometry(f"cannot be read as STEP: it does not begin with {_BEGIN.decode()}")
    if _END not in data[-_FRAME_BYTES:]:
        raise InvalidGeometry(f"ends early: it does not end with {_END.decode()}")
