"""The workshop drawing of a finger as SVG: three views in first-angle projection, main dimensions, holes, title block. A4, mm."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np

from gripwright.design.stages.fingers import GripperCad
from gripwright.domain.grasp import SURFACE
from gripwright.domain.gripper import second_part
from gripwright.domain.shape import FloatArray
from gripwright.domain.taper import Taper
from gripwright.domain.v_tip import VTip
from gripwright.geometry import brep
from gripwright.geometry.projection import Projection, project
from gripwright.report.dimension import Point, horizontal, millimetres, text, vertical
from gripwright.report.drawing_notes import bonding_notes, gripping_surface_notes

_SHEET = (297.0, 210.0)
_MARGIN, _GAP = 10.0, 34.0
_NOTES_WIDTH, _TITLE_HEIGHT = 120.0, 42.0
_LETTER_ROOM_MM = 5.0
_SCALES = (5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05)  # ISO 5455


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _View:
    """A projection on the sheet: `origin` is where the solid's origin lies, y of the sheet points down."""

    projection: Projection
    origin: Point
    scale: float

    def at(self, right_mm: float, up_mm: float) -> Point:
        return (self.origin[0] + right_mm * self.scale, self.origin[1] - up_mm * self.scale)

    def svg(self) -> str:
        return _paths(self, self.projection.hidden, "hidden") + _paths(self, self.projection.visible, "visible")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Measures:
    """What the dimensions state, read off the solid itself."""

    low: FloatArray  # (3,) of the whole finger
    high: FloatArray
    stem_low: FloatArray  # (3,) of what lies before z = −L
    stem_high: FloatArray
    length_mm: float
    bores: tuple[brep.Bore, ...]
    touch_mm: float  # x where the tip touches: 0, or the depth of its groove
    seat_mm: float  # x of the face that carries the pad, where it is deepest: from there the holes are measured


def finger_drawing(cad: GripperCad, *, title: str, part_number: str) -> str:
    """The drawing of one finger of a gripper, its pad in place. The same finger gives the same text."""
    solid, bonded = brep.single_solid(brep.read_brep(cad.finger.brep)), cad.finger.bonded
    measures = _measure(cad, solid)
    if bonded is not None:
        solid = brep.together([brep.read_brep(part.brep) for part in (bonded.bare, bonded.pad)])
    front, side, top = _views(solid, measures)
    notes, column = _notes(cad, measures), _SHEET[0] - _MARGIN - _NOTES_WIDTH + 2.0
    body = "".join(
        [
            *(view.svg() for view in (front, side, top)),
            _front_dimensions(front, measures),
            _side_dimensions(side, measures),
            _top_dimensions(top, measures),
            _tip_radius(top, measures, cad),
            _incline(front, cad),
            _opening_of_v(top, measures, cad),
            _title_block(cad, title, part_number, front.scale),
            *(text((column, 20.0 + 5.0 * i), note, anchor="start") for i, note in enumerate(notes)),
        ]
    )
    width, height = _SHEET
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm" viewBox="0 0 {width:g} {height:g}">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style>"
        f'<rect x="0" y="0" width="{width:g}" height="{height:g}" fill="#fff"/>'
        f'<rect class="frame" x="{_MARGIN:g}" y="{_MARGIN:g}" width="{width - 2 * _MARGIN:g}" height="{height - 2 * _MARGIN:g}"/>'
        f"{body}</svg>\n"
    )


_STYLE = (
    "path,line,rect.frame{fill:none;stroke:#000}.visible{stroke-width:.5}.hidden{stroke-width:.25;stroke-dasharray:1.6 .8}"
    ".thin{stroke-width:.18}.arrow{fill:#000;stroke:none}.frame{stroke-width:.5}"
    "text{font:3.2px sans-serif;fill:#000}"
)


def _measure(cad: GripperCad, solid: brep.Shape) -> _Measures:
    low, high = brep.bounds_mm(solid)
    length = cad.spec.finger_length_mm
    vertices = cad.finger.mesh.vertices_mm
    stem = vertices[vertices[:, 2] > -length + 1e-3]
    return _Measures(
        low=low,
        high=high,
        stem_low=stem.min(axis=0),
        stem_high=stem.max(axis=0),
        length_mm=length,
        bores=tuple(bore for bore in brep.bores_z(solid) if bore.z_max_mm < -length + 1e-3),  # not the groove of a tip
        touch_mm=cad.finger.properties.get("contact_offset_mm", 0.0),
        seat_mm=_seat_mm(cad),
    )


def _seat_mm(cad: GripperCad) -> float:
    if cad.finger.bonded is None or cad.spec.taper_rad or cad.spec.vee or cad.spec.grip == SURFACE:
        return 0.0
    x = brep.bounds_mm(brep.read_brep(cad.finger.bonded.pad.brep))[:, 0]
    return float(x[np.argmax(np.abs(x))])


def _views(solid: brep.Shape, measures: _Measures) -> tuple[_View, _View, _View]:
    """From the front (x right, z up), from the left beside it (−y right), from above below it (y up)."""
    size = measures.high - measures.low  # (3,)
    room = np.array([_SHEET[0] - 2 * _MARGIN - 2.2 * _GAP - _NOTES_WIDTH, _SHEET[1] - 2 * _MARGIN - 2.2 * _GAP])
    needed = np.array([size[0] + size[1], size[2] + size[1]])
    scale = next((s for s in _SCALES if (needed * s <= room).all()), _SCALES[-1])
    left, ceiling = _MARGIN + _GAP, _MARGIN + 0.7 * _GAP
    x = left - measures.low[0] * scale
    beside = left + size[0] * scale + _GAP + measures.high[1] * scale
    below = ceiling + size[2] * scale + _GAP + measures.high[1] * scale
    zero = ceiling + measures.high[2] * scale
    front = _View(projection=project(solid, (0, -1, 0), (1, 0, 0)), origin=(x, zero), scale=scale)
    side = _View(projection=project(solid, (-1, 0, 0), (0, -1, 0)), origin=(beside, zero), scale=scale)
    top = _View(projection=project(solid, (0, 0, 1), (1, 0, 0)), origin=(x, below), scale=scale)
    return front, side, top


def _paths(view: _View, lines: Iterable[FloatArray], css: str) -> str:
    drawn = dict.fromkeys("M" + "L".join("{:.3f} {:.3f}".format(*view.at(*point)) for point in line) for line in lines)
    return "".join(f'<path class="{css}" d="{path}"/>' for path in drawn)


def _front_dimensions(view: _View, m: _Measures) -> str:
    """Finger length, thickness of base, stem and pad, overall size."""
    right, left = m.high[0], m.low[0]
    return "".join(
        [
            vertical(view.at(m.stem_high[0], 0.0), view.at(right, -m.length_mm), 7.0, m.length_mm),
            vertical(view.at(m.stem_high[0], 0.0), view.at(right, m.low[2]), 15.0, -m.low[2]),
            vertical(view.at(left, -m.length_mm), view.at(left, m.low[2]), -7.0, -m.length_mm - m.low[2]),
            horizontal(view.at(m.stem_low[0], 0.0), view.at(m.stem_high[0], 0.0), -7.0, m.stem_high[0] - m.stem_low[0]),
            horizontal(view.at(m.touch_mm, 0.0), view.at(m.seat_mm, 0.0), -14.0, abs(m.seat_mm - m.touch_mm))
            if m.seat_mm
            else "",
            horizontal(view.at(0.0, 0.0), view.at(m.touch_mm, 0.0), -21.0, m.touch_mm) if m.touch_mm else "",
            horizontal(view.at(left, m.low[2]), view.at(right, m.low[2]), 9.0, right - left),
        ]
    )


def _side_dimensions(view: _View, m: _Measures) -> str:
    """Width of the gripping surface and of the base; the view looks along +x, so −y is on its right."""
    width, base = m.stem_high[1] - m.stem_low[1], m.high[1] - m.low[1]
    return "".join(
        [
            horizontal(view.at(-m.stem_high[1], 0.0), view.at(-m.stem_low[1], 0.0), -7.0, width),
            horizontal(view.at(-m.high[1], m.low[2]), view.at(-m.low[1], m.low[2]), 9.0, base),
        ]
    )


def _top_dimensions(view: _View, m: _Measures) -> str:
    """Where the holes are: from what carries the pad, or the gripping surface where there is none, and among each other."""
    if not m.bores:
        return ""
    parts = []
    for row, x in enumerate(sorted({bore.x_mm for bore in m.bores})):
        parts.append(horizontal(view.at(x, m.low[1]), view.at(m.seat_mm, m.low[1]), 8.0 + 7.0 * row, abs(x - m.seat_mm)))
    ys = sorted({bore.y_mm for bore in m.bores})
    column = min(bore.x_mm for bore in m.bores)
    if len(ys) > 1:
        parts.append(vertical(view.at(column, ys[-1]), view.at(column, ys[0]), _left_of(view, m, column), ys[-1] - ys[0]))
    for letter, (x, y) in zip(_letters(m.bores), _places(m.bores), strict=True):
        radius = max(bore.diameter_mm for bore in m.bores if bore[:2] == (x, y)) / 2.0
        room = (m.high[0] - x - radius) * view.scale
        side = 1.0 if room > _LETTER_ROOM_MM else -1.0
        beside = view.at(x + side * radius, y)
        parts.append(text((beside[0] + side * 2.2, beside[1] + 1.1), letter))
    return "".join(parts)


def _tip_radius(view: _View, m: _Measures, cad: GripperCad) -> str:
    """The radius of a rounded gripping surface, beside it, or of a hollow one, on the stem behind it."""
    nose, groove = (cad.finger.properties.get(f"{tip}_radius_mm") for tip in ("nose", "groove"))
    radius, at = (nose, view.at(0.0, 0.0)) if groove is None else (groove, view.at(m.seat_mm, m.stem_low[1] / 2.0))
    return "" if radius is None else text((at[0] + 1.0, at[1] + 1.1), f"R{millimetres(radius)}", anchor="start")


def _incline(view: _View, cad: GripperCad) -> str:
    """Height and angle of a tapered gripping surface, or of a V, before it."""
    spec = cad.spec
    if spec.vee is not None:
        v = VTip(vee=spec.vee, taper_rad=spec.taper_rad)
        tip, incline_rad = (v.tip_mm, v.stem_mm, v.height_mm), v.incline_rad
    elif spec.taper_rad:
        taper = Taper(angle_rad=spec.taper_rad)
        tip, incline_rad = (taper.tip_mm, taper.stem_mm, taper.height_mm), abs(spec.taper_rad)
    else:
        return ""
    at_end, at_stem, height = tip
    middle = view.at(0.0, -height / 2.0)
    angle = text((middle[0] - 7.0, middle[1] + 1.1), f"{math.degrees(incline_rad):.1f}°") if spec.taper_rad else ""
    return vertical(view.at(at_end, 0.0), view.at(at_stem, -height), -15.0, height) + angle


def _opening_of_v(view: _View, m: _Measures, cad: GripperCad) -> str:
    """Angle and depth of a V, beside the view along the finger."""
    if cad.spec.vee is None:
        return ""
    at = view.at(m.low[0], m.high[1])
    return text((at[0], at[1] - 2.0), f"V {cad.spec.vee.degrees:.1f}° × {millimetres(cad.spec.vee.depth_mm)}", anchor="start")


def _left_of(view: _View, m: _Measures, x_mm: float) -> float:
    """Offset on the sheet that puts a dimension of a feature at x to the left of the view."""
    return float((m.low[0] - x_mm) * view.scale - 7.0)


def _places(bores: Sequence[brep.Bore]) -> list[tuple[float, float]]:
    return list(dict.fromkeys((bore.x_mm, bore.y_mm) for bore in bores))


def _hole_kinds(bores: Sequence[brep.Bore]) -> dict[tuple[float, float], str]:
    """What is to be drilled at each place, from the base's back at the least z to its front."""
    back, front = min(bore.z_min_mm for bore in bores), max(bore.z_max_mm for bore in bores)
    at: dict[tuple[float, float], list[str]] = defaultdict(list)
    for bore in bores:
        depth = millimetres(bore.z_max_mm - bore.z_min_mm)
        through = any(other[:2] == bore[:2] and other.z_max_mm >= front - 1e-6 for other in bores)
        if bore.z_min_mm > back + 1e-6:
            at[bore[:2]].append(f"⌀{millimetres(bore.diameter_mm)} × {depth} deep from the front")
        elif through:
            at[bore[:2]].append(f"⌀{millimetres(bore.diameter_mm)} through")
        else:
            at[bore[:2]].append(f"⌀{millimetres(bore.diameter_mm)} × {depth} deep from the back")
    return {place: ", ".join(kinds) for place, kinds in at.items()}


def _letters(bores: Sequence[brep.Bore]) -> list[str]:
    kinds = _hole_kinds(bores)
    names = {kind: chr(ord("A") + i) for i, kind in enumerate(dict.fromkeys(kinds.values()))}
    return [names[kinds[place]] for place in _places(bores)]


def _notes(cad: GripperCad, m: _Measures) -> list[str]:
    """Holes, quantity, mounting, making, stiffness; what the designer says of a finger that no jaw carries."""
    spec, figures = cad.spec, cad.finger.properties
    pin, notes = spec.jaw.pin_diameter_mm, []
    if m.bores:
        counted = Counter(_hole_kinds(m.bores).values())
        notes += [f"{chr(ord('A') + i)}: {count} × {kind}" for i, (kind, count) in enumerate(counted.items())]
    if cad.finger.notes is not None:
        return [*notes, f"Make {spec.fingers}, for {spec.actuator.name}.", *cad.finger.notes]
    notes += [
        f"Make {spec.fingers} alike, one for each jaw of {spec.actuator.name}.",
        f"Screws ISO 4762 M{spec.jaw.bolt_thread_mm:g}" + (f", pin ⌀{pin:g} locates it on the jaw." if pin else "."),
        *gripping_surface_notes(cad),
        *bonding_notes(cad),
        "Outline of the base as in the STEP file.",
        "Where printed: base's back on the bed, no support.",
    ]
    if "deflection_mm" in figures and "finger_force_N" in figures:
        notes.append(f"Tip bends {figures['deflection_mm']:.2f} mm under {figures['finger_force_N']:.1f} N on this finger.")
    if cad.grip_force_max_N is not None:
        notes.append(f"Regulate the actuator to {cad.grip_force_max_N:.0f} N at most.")
    return notes


def _title_block(cad: GripperCad, title: str, part_number: str, scale: float) -> str:
    x, y = _SHEET[0] - _MARGIN - _NOTES_WIDTH, _SHEET[1] - _MARGIN - _TITLE_HEIGHT
    bonded, ratio = cad.finger.bonded, f"{scale:g} : 1" if scale >= 1 else f"1 : {1 / scale:g}"
    rows = [
        ("Part", part_number),
        ("Title", title),
        ("Material", cad.finger.material + ("" if bonded is None else f"; {second_part(bonded)} {bonded.pad.material}")),
        ("Mass", f"{cad.finger.mass_kg * 1000:.1f} g"),
        ("Tolerances", "ISO 2768-mK, dimensions in mm"),
        ("Scale, projection", f"{ratio}, first angle"),
    ]
    step = _TITLE_HEIGHT / len(rows)
    parts = [f'<rect class="frame" x="{x:g}" y="{y:g}" width="{_NOTES_WIDTH:g}" height="{_TITLE_HEIGHT:g}"/>']
    for i, (name, value) in enumerate(rows):
        parts.append(text((x + 2.0, y + step * i + 4.6), name, anchor="start"))
        parts.append(text((x + 34.0, y + step * i + 4.6), value, anchor="start"))
        if i:
            parts.append(f'<line class="thin" x1="{x:g}" y1="{y + step * i:g}" x2="{x + _NOTES_WIDTH:g}" y2="{y + step * i:g}"/>')
    return "".join(parts)
