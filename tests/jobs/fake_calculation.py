"""A calculation that does what tests of the jobs need: nothing, wait, crash, hang, take memory. Runs in real children."""

import ctypes
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class Stage:
    """As `gripwright.design.stage_table.Stage`, with the function itself."""

    name: str
    function: Callable
    uses: tuple = ()
    plan_fields: tuple = ()
    version: int = 1
    remembers: bool = False


def _note(log, name):
    """Append to the log of executed steps, whole lines even where many processes write."""
    handle = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.write(handle, f"{name}\n".encode())
    os.close(handle)


def executed(log):
    return Path(log).read_text().split() if Path(log).exists() else []


def _act(inputs, plan, toolbox, ctx):
    """Do what the call's `act` says, having noted that it began and, at last, that it ended."""
    name, act, log = inputs["name"], inputs.get("act", "add"), inputs["log"]
    _note(log, f"begin:{name}")
    ctx.progress(0.5, f"{act} {name}")
    match act:
        case "wait":
            flag = Path(log).with_name(f"go-{name}")
            while not flag.exists():
                time.sleep(0.02)
        case "sleep":
            time.sleep(inputs["seconds"])
        case "segfault":
            ctypes.string_at(0)
        case "hang":
            while True:
                pass
        case "memory":
            [bytearray(2**28) for _ in range(64)]
        case "once":
            if executed(log).count(f"begin:{name}") == 1:
                raise ZeroDivisionError("only the first time")
        case "killed-once":
            if executed(log).count(f"begin:{name}") == 1:
                os.kill(os.getpid(), signal.SIGKILL)
        case "raise":
            raise ZeroDivisionError("secret of the code")
        case "plugin":
            toolbox.optimizer.solve(None, ctx)
        case "undeclared":
            plan.safety_factor  # noqa: B018
        case "grandchild":
            pid = os.fork()
            if pid == 0:
                time.sleep(600)
            _note(log, f"pid:{pid}")
            time.sleep(600)
    _note(log, f"end:{name}")
    return sum(inputs.get("values", [])) + plan.seed


def _export(inputs, plan, toolbox, ctx):
    return {"design.json": b'{"status": "complete", "total": %d}' % inputs["result"], "bom.csv": b"item\n"}


STAGES = {
    "first": Stage(name="first", function=_act, plan_fields=("seed",)),
    "second": Stage(name="second", function=_act, plan_fields=("seed",), uses=("optimizer",)),
    "export": Stage(name="export", function=_export),
}
STAGES_AT = "fake_calculation:STAGES"


def design(task, actuators, plan, runner):
    """Two stages of which the first fans out. What each call does is named in the task: `name` holds "a b:segfault c:wait"."""
    log = os.environ["FAKE_LOG"]
    words = [word.partition(":") for word in task.name.split()]
    calls = [
        {"name": name, "act": act or "add", "values": [1], "log": log} for name, _, act in words if not name.startswith("second")
    ]
    firsts = runner.map("first", calls)
    last = next((act for name, _, act in words if name == "second"), "add")
    (second,) = runner.map("second", [{"name": "second", "act": last, "log": log, "values": [{"ref": ref} for ref in firsts]}])
    return second
