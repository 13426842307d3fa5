"""A calculation with as many stages as the real one has, by the same names, which adds up numbers. Runs in real children.

Every stage makes two calls, the first and the last two of them one. Each notes that it began and, as its last act, that it ended.
The call that the task names waits until it is let go.
"""

import os
import time
from pathlib import Path

from fake_calculation import Stage, _note

from gripwright.jobs.stages import STAGES as REAL_STAGES


def _act(inputs, plan, toolbox, ctx):
    name, log = inputs["name"], inputs["log"]
    _note(log, f"begin:{name}")
    _note(log, f"pid:{name}:{os.getpid()}")
    ctx.progress(0.5, name)
    flag = Path(log).with_name(f"go-{name}")
    while inputs["waits"] and not flag.exists():
        time.sleep(0.01)
    total = sum(value["total"] for value in inputs["values"]) + 1
    _note(log, f"end:{name}")
    return {"total": total, "padding": "x" * 50_000}


def _export(inputs, plan, toolbox, ctx):
    result = inputs["result"]
    return {
        "design.json": b'{"status": "complete", "total": %d}'
        % _act({**inputs, **result, "values": [result]}, plan, toolbox, ctx)["total"]
    }


def _result(inputs, plan, toolbox, ctx):
    """The last before the export, which it tells what it was told."""
    told = {"name": f"{inputs['run']}.export.0", "waits": inputs["waits_in"] == "export", "log": inputs["log"]}
    return {**_act(inputs, plan, toolbox, ctx), **told}


STAGES = {
    name: Stage(name=name, function={"export": _export, "result": _result}.get(name, _act), plan_fields=("seed",))
    for name in REAL_STAGES
}
STAGES_AT = "staged_calculation:STAGES"
CALLS = {name: 1 if name in ("owned", "result", "export") else 2 for name in STAGES}


def total():
    """What a design comes to that lost nothing and doubled nothing."""
    results = []
    for calls in CALLS.values():
        results = [sum(results) + 1] * calls
    return results[0]


def steps_of(run):
    """The names of all steps of a design."""
    return [f"{run}.{stage}.{number}" for stage, calls in CALLS.items() for number in range(calls)]


def design(task, actuators, plan, runner):
    """`name` of the task is "run place": who asks, and the stage whose first step waits."""
    run, place = task.name.split()
    refs = []
    for stage in list(STAGES)[:-1]:
        calls = [
            {
                "name": f"{run}.{stage}.{number}",
                "run": run,
                "waits": stage == place and number == 0,
                "waits_in": place,
                "log": os.environ["FAKE_LOG"],
                "values": [{"ref": ref} for ref in refs],
            }
            for number in range(CALLS[stage])
        ]
        refs = runner.map(stage, calls)
    (ref,) = refs
    return ref
