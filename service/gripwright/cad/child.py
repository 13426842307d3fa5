"""The process that parses CAD files: `python -m gripwright.cad.child LIMITS`. It may crash or be killed at any time.

It answers requests on standard input (cad/wire.py) one by one. What a parser does not expect ends the process, with the
reason as its last message.
"""

import ctypes
import io
import json
import os
import resource
import signal
import sys
from importlib import import_module
from types import TracebackType
from typing import Any, BinaryIO

from gripwright.cad import wire
from gripwright.cad.limits import Limits
from gripwright.domain.errors import GripwrightError, LimitExceeded
from gripwright.domain.shape import Mesh

_PR_SET_PDEATHSIG = 1
_NICENESS = 5  # between the service, which many wait for, and the workers
_DETAIL_MAX = 1000  # characters: what a file says of itself may be quoted in it


def main() -> None:
    """Answer until the requests end."""
    limits = Limits(**json.loads(sys.argv[1]))
    _die_with_parent()
    os.nice(_NICENESS)
    resource.setrlimit(resource.RLIMIT_AS, (limits.memory_bytes, limits.memory_bytes))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    requests, answers = _private_streams()
    sys.excepthook = _last_words(answers, limits)
    import_module("gripwright.cad.read")  # after the limits were set, and before the first file, whose time it is not
    while True:
        try:
            header, data = wire.receive(requests)
        except wire.Closed:
            return
        # processor time, not the clock: a busy machine makes no file slow. SIGPROF ends the process
        signal.setitimer(signal.ITIMER_PROF, limits.seconds_for(len(data)))
        try:
            answer, meshes = _answer(header, data, limits)
        except GripwrightError as error:
            wire.send(answers, {"status": "refused", "code": error.code, "detail": error.detail[:_DETAIL_MAX]})
        else:
            sizes, payload = wire.pack(meshes)
            wire.send(answers, {"status": "read", "sizes": sizes, **answer}, payload)


def _answer(header: dict[str, Any], data: bytes, limits: Limits) -> tuple[dict[str, Any], list[Mesh]]:
    from gripwright.cad import part21, read  # after the limits were set

    if header["task"] == "mesh":
        meshes = [read.read_mesh(data, header["format"], header["units"], limits)]
        answer: dict[str, Any] = {}
    else:
        part21.check_frame(data)
        from gripwright.cad import step

        assembly = step.read_step_assembly(data, limits)
        meshes = [read.checked(mesh) for mesh in assembly.meshes]
        instances = [
            {"path": instance.path, "product": instance.product, "pose": instance.X_PC.tolist(), "mesh": instance.mesh}
            for instance in assembly.instances
        ]
        answer = {"name": assembly.name, "instances": instances}
    for mesh in meshes:
        if len(mesh.faces) > limits.max_triangles:
            raise LimitExceeded(f"holds {len(mesh.faces)} triangles, at most {limits.max_triangles}")
    return answer, meshes


def _die_with_parent() -> None:
    parent = os.getppid()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it ended in between
        sys.exit(1)


def _private_streams() -> tuple[BinaryIO, BinaryIO]:
    """Standard input and output for messages alone; what the parsers print goes to the error stream."""
    requests = io.BufferedReader(io.FileIO(os.dup(0), "rb"))
    answers = io.BufferedWriter(io.FileIO(os.dup(1), "wb"))
    os.dup2(2, 1)
    return requests, answers


def _last_words(answers: BinaryIO, limits: Limits) -> Any:
    def report(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if issubclass(kind, MemoryError):
            code, reason = "limit-exceeded", f"needs more memory than allowed, which is {limits.memory_bytes / 2**20:.0f} MiB"
        else:
            code, reason = "invalid-geometry", f"cannot be read: {str(error)[:_DETAIL_MAX]} ({kind.__name__})"
        wire.send(answers, {"status": "failed", "code": code, "detail": reason})

    return report


if __name__ == "__main__":
    main()
