"""CAD files read in a child process that a crash, a hang or a hunger for memory cannot outgrow."""

import signal
import subprocess
import threading
import time
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np

from gripwright.cad import wire
from gripwright.cad.limits import Limits
from gripwright.cad.spare import SpareReader, end_reader, start_reader
from gripwright.domain.errors import Fault, InvalidGeometry, LimitExceeded
from gripwright.domain.shape import FloatArray, Mesh


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AssemblyInstance:
    """A component of a STEP assembly."""

    path: tuple[str, ...]  # names of the instances below the root, outermost first
    product: str
    X_PC: FloatArray  # (4, 4), P is the root's frame
    mesh: Mesh  # shared by the instances of one part


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assembly:
    """What a STEP file says of its structure."""

    name: str
    instances: tuple[AssemblyInstance, ...]


class CadReader:
    """Reads the CAD files of one package, all in one child process, which a file that kills it renews.

    `limits.seconds` counts from the first file, for all of them together. After `limits.max_crashes` renewals no more is read.
    """

    def __init__(self, limits: Limits, spare: SpareReader | None = None) -> None:
        self._limits, self._spare = limits, spare
        self._deadline: float | None = None
        self._child: subprocess.Popen[bytes] | None = None
        self._crashes = 0

    def __enter__(self) -> "CadReader":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._end()

    def mesh(self, name: str, data: bytes, format: str, units: str | None) -> Mesh:
        """The mesh of a file (cad/read.py); `name` is for messages. InvalidGeometry or LimitExceeded says what is wrong."""
        header, payload = self._ask(name, {"task": "mesh", "format": format, "units": units}, data)
        return wire.unpack(header["sizes"], payload)[0]

    def assembly(self, name: str, data: bytes) -> Assembly:
        """Components, names and poses of a STEP file."""
        header, payload = self._ask(name, {"task": "assembly"}, data)
        meshes = wire.unpack(header["sizes"], payload)
        instances = (
            AssemblyInstance(
                path=tuple(instance["path"]),
                product=instance["product"],
                X_PC=np.array(instance["pose"]),
                mesh=meshes[instance["mesh"]],
            )
            for instance in header["instances"]
        )
        return Assembly(name=header["name"], instances=tuple(instances))

    def _ask(self, name: str, request: dict[str, Any], data: bytes) -> tuple[dict[str, Any], bytes]:
        now = time.monotonic()
        self._deadline = self._deadline or now + self._limits.seconds
        if self._crashes >= self._limits.max_crashes:
            detail = f"{name} is not read: {self._crashes} files before it ended the process that reads them"
            raise LimitExceeded(detail, faults=(Fault(name, detail),), file=name)
        child = self._child = self._child or self._started()
        assert child.stdin is not None
        assert child.stdout is not None
        watchdog = threading.Timer(max(0.0, self._deadline - now), child.kill)
        watchdog.start()
        try:
            wire.send(child.stdin, request, (data,))  # type: ignore[arg-type]
            header, payload = wire.receive(child.stdout)  # type: ignore[arg-type]
        except (wire.Closed, BrokenPipeError):
            header, payload = self._obituary(child, len(data)), b""
        finally:
            watchdog.cancel()
        if header["status"] == "failed":
            self._crashes += 1
            self._end()
        if header["status"] != "read":
            kind = LimitExceeded if header["code"] == LimitExceeded.code else InvalidGeometry
            detail = f"{name} {header['detail']}"
            raise kind(detail, faults=(Fault(name, detail),), file=name)
        return header, payload

    def _started(self) -> "subprocess.Popen[bytes]":
        ready = None if self._spare is None else self._spare.take(self._limits)
        return ready or start_reader(self._limits)

    def _obituary(self, child: "subprocess.Popen[bytes]", size: int) -> dict[str, Any]:
        code = child.wait()
        assert self._deadline is not None
        detail = None
        if code == -signal.SIGKILL and time.monotonic() >= self._deadline:
            detail = f"is not read within the {self._limits.seconds:g} s that all files together may take"
        if code == -signal.SIGPROF:
            detail = f"is not read within the {self._limits.seconds_for(size):.1f} s of processor time that its size allows"
        if detail is not None:
            return {"status": "failed", "code": LimitExceeded.code, "detail": detail}
        how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        memory = self._limits.memory_bytes / 2**20
        detail = f"ends the process that reads it ({how}): the file is damaged, or {memory:.0f} MiB of memory are not enough"
        return {"status": "failed", "code": InvalidGeometry.code, "detail": detail}

    def _end(self) -> None:
        child, self._child = self._child, None
        if child is not None:
            end_reader(child)
