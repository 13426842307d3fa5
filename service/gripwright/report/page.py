"""The report: one self-contained page on which a person can judge a design."""

import base64
import math
from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np

from gripwright.cad.colour import segment_colours
from gripwright.design.miss_document import vee_of_document
from gripwright.design.result import DesignResult
from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import SURFACE
from gripwright.domain.v_tip import tip_words
from gripwright.report.views import Views

_STYLE = """
:root{color-scheme:light;--line:#d5d9de;--ink:#1c2733;--soft:#5b6875;--good:#00664a;--bad:#a33a00}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);max-width:75rem;margin:2rem auto;padding:0 1rem}
h1,h2,h3{line-height:1.2}
h2{margin-top:2.5rem;border-bottom:1px solid var(--line);padding-bottom:.3rem}
table{border-collapse:collapse;width:100%;font-size:.9rem}
th,td{text-align:left;padding:.3rem .6rem;border-bottom:1px solid var(--line);vertical-align:top}
th{color:var(--soft);font-weight:600}
.scroll{overflow-x:auto}
figure{margin:0;border:1px solid var(--line);border-radius:6px;overflow:hidden;background:#fff}
figure img{display:block;width:100%;height:auto}
figcaption{padding:.4rem .7rem;font-size:.85rem;color:var(--soft);border-top:1px solid var(--line)}
.cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(19rem,1fr));gap:1rem;margin:1rem 0}
.ok{color:var(--good);font-weight:600}
.no{color:var(--bad);font-weight:600}
.swatch{display:inline-block;width:.9em;height:.9em;border-radius:2px;margin-right:.4em;vertical-align:-1px}
.split{display:grid;grid-template-columns:minmax(16rem,22rem) 1fr;gap:1rem;align-items:start}
@media(max-width:50rem){.split{grid-template-columns:1fr}}
"""

_QUALITY = frozenset({"rms", "volume_ratio"})
"""Numbers of a primitive that say how well it fits, not what it is."""


def report_page(result: DesignResult, views: Views) -> str:
    """The page as HTML text, pictures included."""
    document = result.document
    title = f"{document['product']['name'] or document['product']['part_number']} · revision {document['product']['revision']}"
    body = "".join(
        [
            f"<h1>Grippers for {escape(title)}</h1>",
            _summary(document),
            _grippers(result, views),
            _not_chosen(document),
            _bill(document),
            _operations(document, views),
            _handles(result, views),
            _components(result, views),
            _warnings(document),
        ]
    )
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head><body>{body}</body></html>"
    )


def _summary(document: Mapping[str, Any]) -> str:
    operations = document["operations"]
    covered = sum(operation["status"] == "covered" for operation in operations)
    optimum = document["optimum"]
    proof = (
        f"Fewer than {_counted(optimum['lower_bound'], 'gripper')} cannot do it (proven)."
        if optimum["proven"]
        else f"At least {optimum['lower_bound']} are needed; that this set is the smallest is not proven."
    )
    return (
        f'<p><span class="{_tone(document["status"] == "complete")}">{escape(document["status"])}</span>: '
        f"{_counted(len(document['grippers']), 'gripper')}, {optimum['new']} of them new, "
        f"{'does' if len(document['grippers']) == 1 else 'do'} {covered} of {_counted(len(operations), 'operation')}. "
        f"{proof} {_objectives(optimum['objectives'])}</p>"
    )


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _objectives(objectives: Mapping[str, str]) -> str:
    """What is known of the objectives after the number of grippers."""
    further = {name: detail for name, detail in objectives.items() if name != "grippers"}
    proven = [name for name, detail in further.items() if detail == "proven"]
    told = [f"Least of those, in this order (proven): {', '.join(proven)}."] if proven else []
    return escape(" ".join([*told, *(f"{name}: {detail}." for name, detail in further.items() if detail != "proven")]))


def _grippers(result: DesignResult, views: Views) -> str:
    cards = []
    for gripper, cad, entry in zip(result.grippers, result.cads, result.document["grippers"], strict=True):
        actuator = entry["actuator"]
        text = (
            f"<strong>{entry['id']}</strong> · {escape(entry['gripper_type'])} · {_measures(entry)}<br>"
            f"{escape(actuator['maker'])} {escape(actuator['model'])}"
        )
        if entry["grip"] != SURFACE:
            text += f", stroke {actuator['stroke']:g} mm, jaw offset {actuator['jaw_offset']:.4g} mm"
        text += "".join(f"<br>{escape(remark)}" for remark in entry["remarks"])
        if isinstance(cad, Rejection):
            cards.append(f'<p>{text}<br><span class="no">{escape(cad.detail)}</span></p>')
        elif cad is None:
            cards.append(f"<p>{text}<br>at hand: {escape(entry['owned'])}; checked by its hand model, no CAD is made</p>")
        else:
            cards.append(_figure(views.grippers[gripper.id], text, f"gripper {gripper.id}, open"))
    return f'<h2>Grippers</h2><div class="cards">{"".join(cards)}</div>'


def _measures(gripper: Mapping[str, Any]) -> str:
    if gripper["grip"] == SURFACE:
        return f"holds by a face of ⌀{gripper['opening_max']:.4g} mm · {gripper['finger_length']:g} mm long"
    tips = tip_words(math.radians(gripper.get("taper", 0.0)), vee_of_document(gripper))
    opens = f"opens {gripper['opening_min']:.4g} to {gripper['opening_max']:.4g} mm"
    return f"{opens} · fingers {gripper['finger_length']:g} mm{', ' if tips else ''}{tips}"


def _not_chosen(document: Mapping[str, Any]) -> str:
    tables = [
        f"<details><summary>Why {escape(gripper['id'])} has none of {len(gripper['not_chosen'])} other actuators</summary>"
        + _table(["actuator", "reason"], [[_text(one["actuator"]), _text(one["detail"])] for one in gripper["not_chosen"]])
        + "</details>"
        for gripper in document["grippers"]
        if gripper["not_chosen"]
    ]
    return "".join(tables)


def _bill(document: Mapping[str, Any]) -> str:
    rows = document["bom"]
    if not rows:
        return ""
    columns = [key for key in rows[0] if key != "files"]
    return "<h2>Bill of materials</h2>" + _table(columns, [[_text(row.get(key)) for key in columns] for row in rows])


def _operations(document: Mapping[str, Any], views: Views) -> str:
    rows = [
        [
            escape(operation["id"]),
            f'<span class="{_tone(operation["status"] == "covered")}">{operation["status"]}</span>',
            _text(operation["kind"]),
            _text(operation["component"]),
            _text(operation["gripper"]),
            _text(operation["detail"]),
        ]
        for operation in document["operations"]
    ]
    cards = [
        _figure(
            views.misses[operation["id"]],
            f"<strong>{escape(operation['id'])}</strong>: closest came {_text(operation['nearest_miss']['grasp'])}; "
            f"{_text(operation['nearest_miss']['sentence'])}",
            f"nearest miss of {operation['id']}",
        )
        for operation in document["operations"]
        if operation["id"] in views.misses
    ]
    table = _table(["operation", "status", "kind", "component", "gripper", "reason"], rows)
    return f"<h2>Operations</h2>{table}" + (f'<div class="cards">{"".join(cards)}</div>' if cards else "")


def _handles(result: DesignResult, views: Views) -> str:
    cards = []
    for gripper, cad, entry in zip(result.grippers, result.cads, result.document["grippers"], strict=True):
        for handle, record in zip(gripper.handles, entry["handles"], strict=True):
            gap = "no gap measured" if cad is None else "nothing stands around"
            gap = gap if record["gap"] is None else f"gap {record['gap']:.2f} mm"
            safety = record["hold"]["safety_factor"]
            force = "actuator's force unknown" if safety is None else f"safety factor {safety:.1f}"
            text = (
                f"<strong>{escape(handle.operation)}</strong>: {gripper.id} holds {escape(handle.component)}, segment "
                f"{handle.segment}, {_at(entry, record)}, {escape(record['grasp'])}; {gap}; needs "
                f"{record['hold']['required_force']:.0f} N, {force}"
            )
            if not isinstance(cad, GripperCad):
                cards.append(f"<p>{text}</p>")
                continue
            cards.append(_figure(views.handles[handle.operation], text, f"{gripper.id} at the end of {handle.operation}"))
    return f'<h2>Grasps, at the end of each operation</h2><div class="cards">{"".join(cards)}</div>'


def _at(gripper: Mapping[str, Any], handle: Mapping[str, Any]) -> str:
    width_mm = f"{handle['opening_width']:.2f} mm"
    return f"by a face of ⌀{width_mm}" if gripper["grip"] == SURFACE else f"at {width_mm}"


def _components(result: DesignResult, views: Views) -> str:
    parts = ["<h2>Components and their segments</h2>"]
    pictures = zip(views.components, views.primitives, strict=True)
    entries = zip(result.task.components, result.analyses, result.document["components"], pictures, strict=True)
    for component, analysis, entry, (view, primitives) in entries:
        rows = [_segment_row(segment) for segment in entry["segments"]]
        head = ["segment", "primitive", "gripper", "opening, mm", "L⁻, mm", "grasps free / planned", "rejected because"]
        caption = f"{_counted(len(rows), 'segment')} by {escape(analysis.segmenter)}"
        said = [text for text in (entry["detail"], *entry["remarks"]) if text]
        detail = "".join(f"<p>{escape(text)}</p>" for text in said)
        parts.append(
            f'<h3>{escape(component.id)} · <span class="{_tone(entry["status"] == "covered")}">{escape(entry["status"])}'
            f'</span></h3>{detail}<div class="split">'
            f"<div>{_figure(view, caption, f'{component.id}, coloured by segment')}{_primitives(component.id, primitives)}</div>"
            f"{_table(head, rows)}</div>"
        )
    return "".join(parts)


def _primitives(component_id: str, picture: bytes | None) -> str:
    return "" if picture is None else _figure(picture, "the primitives fitted to them", f"primitives of {component_id}")


def _segment_row(segment: Mapping[str, Any]) -> list[str]:
    red, green, blue = (int(255 * value) for value in segment_colours(np.array([segment["id"]]))[0])
    primitive = segment["primitive"]
    shape = "–" if primitive is None else escape(f"{primitive['kind']} {_size(primitive)}")
    return [
        f'<span class="swatch" style="background:rgb({red},{green},{blue})"></span>{segment["id"]}',
        shape,
        _text(segment["gripper_type"]),
        _number(segment["opening_width"]),
        _number(segment["finger_length_min"]),
        f"{segment['grasps_free']} / {segment['grasps_planned']}",
        "" if segment["graspable"] else f"<strong>{_text(segment['rejection'])}</strong> {_text(segment['detail'])}",
    ]


def _size(primitive: Mapping[str, Any]) -> str:
    """The size of a primitive: of a kind that is not known here, its plain numbers by name."""
    match primitive["kind"]:
        case "cylinder":
            return f"⌀{2 * primitive['radius']:.2f} × {primitive['height']:.2f}"
        case "box":
            return " × ".join(f"{extent:.2f}" for extent in primitive["extents"])
    numbers = {name: value for name, value in primitive.items() if isinstance(value, int | float) and name not in _QUALITY}
    return ", ".join(f"{name.replace('_', ' ')} {value:.4g}" for name, value in numbers.items() if not isinstance(value, bool))


def _warnings(document: Mapping[str, Any]) -> str:
    if not document["warnings"]:
        return ""
    return "<h2>Warnings</h2><ul>" + "".join(f"<li>{escape(text)}</li>" for text in document["warnings"]) + "</ul>"


def _figure(png: bytes, caption: str, alternative: str) -> str:
    data = base64.b64encode(png).decode()
    return (
        f'<figure><img alt="{escape(alternative)}" src="data:image/png;base64,{data}"><figcaption>{caption}</figcaption></figure>'
    )


def _table(head: list[str], rows: list[list[str]]) -> str:
    top = "".join(f"<th>{escape(name)}</th>" for name in head)
    lines = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{lines}</tbody></table></div>'


def _tone(good: bool) -> str:
    return "ok" if good else "no"


def _text(value: Any) -> str:
    if isinstance(value, list):
        return escape(", ".join(str(item) for item in value))
    if isinstance(value, float):
        return f"{value:.4g}"
    return "–" if value is None else escape(str(value))


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"
