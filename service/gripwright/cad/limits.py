"""What an uploaded package may cost."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Upper bounds of one package, all closed; `seconds` is wall time for all its CAD files together."""

    max_file_bytes: int = 256 * 2**20
    max_total_bytes: int = 1024 * 2**20  # after decompression
    max_document_bytes: int = 16 * 2**20  # product.json, operations
    max_files: int = 2000
    max_ratio: float = 200.0  # decompressed over compressed size of one file of an archive
    max_triangles: int = 5_000_000  # of one component
    seconds: float = 300.0
    memory_bytes: int = 6 * 2**30  # address space of the process that parses


DEFAULT_LIMITS = Limits()
