"""What an uploaded package may cost. The service's settings say it (settings.py); here is what each is by default."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Upper bounds of one package, all closed; `seconds` is wall time for all its CAD files together."""

    max_file_bytes: int = 256 * 2**20
    max_total_bytes: int = 1024 * 2**20  # after decompression
    max_document_bytes: int = 16 * 2**20  # product.json, operations, the JSON of a GLB
    max_files: int = 2000
    max_ratio: float = 200.0  # decompressed over compressed size of one file of an archive
    max_triangles: int = 5_000_000  # of one component
    max_levels: int = 100  # of JSON values, XML elements, nodes, components and subassemblies one in the other
    max_instances: int = 100_000  # parts that one file places
    max_crashes: int = 3  # files of a package that may end the process that reads them, before the rest is left unread
    seconds: float = 300.0
    seconds_per_file: float = 7.0  # of processor time, and in addition
    seconds_per_mebibyte: float = 4.0  # of the file
    memory_bytes: int = 6 * 2**30  # address space of the process that parses

    def seconds_for(self, size: int) -> float:
        """Longest processor time for one file of that many bytes."""
        return self.seconds_per_file + self.seconds_per_mebibyte * size / 2**20


DEFAULT_LIMITS = Limits()
