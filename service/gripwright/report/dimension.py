"""Dimension lines and text of a drawing, as SVG. Sheet coordinates in mm, y down."""

from xml.sax.saxutils import escape

Point = tuple[float, float]

_ARROW_MM, _OVERSHOOT_MM, _LETTER_MM = 2.2, 1.2, 1.9


def millimetres(value_mm: float) -> str:
    """A length as a drawing states it: at most two decimals, none that are zero."""
    return f"{value_mm:.2f}".rstrip("0").rstrip(".")


def text(at: Point, words: str, *, anchor: str = "middle", turned: bool = False) -> str:
    """One line of text; `turned` reads from below."""
    turn = f' transform="rotate(-90 {at[0]:.3f} {at[1]:.3f})"' if turned else ""
    return f'<text x="{at[0]:.3f}" y="{at[1]:.3f}" text-anchor="{anchor}"{turn}>{escape(words)}</text>'


def horizontal(first: Point, second: Point, offset: float, value_mm: float) -> str:
    """The horizontal distance of two points, its line `offset` below the lower one (above the upper one if negative)."""
    left, right = sorted((first, second))
    y = (max(first[1], second[1]) if offset > 0 else min(first[1], second[1])) + offset
    over = _OVERSHOOT_MM if offset > 0 else -_OVERSHOOT_MM
    return (
        _line((left[0], left[1]), (left[0], y + over))
        + _line((right[0], right[1]), (right[0], y + over))
        + _arrows((left[0], y), (right[0], y))
        + _words(left[0], right[0], y, millimetres(value_mm))
    )


def _words(left: float, right: float, y: float, words: str) -> str:
    """Above a horizontal line between its ends; beside it, past the arrow, where there is no room."""
    if len(words) * _LETTER_MM <= right - left:
        return text(((left + right) / 2.0, y - 0.9), words)
    return text((right + 2.0 * _ARROW_MM + 0.6, y + 1.1), words, anchor="start")


def vertical(first: Point, second: Point, offset: float, value_mm: float) -> str:
    """The vertical distance of two points, its line `offset` right of the rightmost one (left of the leftmost if negative)."""
    upper, lower = sorted((first, second), key=lambda point: point[1])
    x = (max(first[0], second[0]) if offset > 0 else min(first[0], second[0])) + offset
    over = _OVERSHOOT_MM if offset > 0 else -_OVERSHOOT_MM
    return (
        _line((upper[0], upper[1]), (x + over, upper[1]))
        + _line((lower[0], lower[1]), (x + over, lower[1]))
        + _arrows((x, upper[1]), (x, lower[1]))
        + text((x - 0.9, (upper[1] + lower[1]) / 2.0), millimetres(value_mm), turned=True)
    )


def _line(start: Point, end: Point) -> str:
    return f'<line class="thin" x1="{start[0]:.3f}" y1="{start[1]:.3f}" x2="{end[0]:.3f}" y2="{end[1]:.3f}"/>'


def _arrows(start: Point, end: Point) -> str:
    """A line with an arrow at either end; from outside where there is no room between."""
    length = ((end[0] - start[0]) ** 2 + (end[1] - start[1]) ** 2) ** 0.5
    if length < 1e-9:
        return ""
    along = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
    inside = length > 3.0 * _ARROW_MM
    reach = 0.0 if inside else 2.0 * _ARROW_MM
    line = _line(
        (start[0] - along[0] * reach, start[1] - along[1] * reach), (end[0] + along[0] * reach, end[1] + along[1] * reach)
    )
    sign = 1.0 if inside else -1.0
    return line + _arrow(start, along, sign) + _arrow(end, along, -sign)


def _arrow(tip: Point, along: Point, sign: float) -> str:
    """A filled arrow head at `tip` whose body lies towards sign · along."""
    foot = (tip[0] + along[0] * sign * _ARROW_MM, tip[1] + along[1] * sign * _ARROW_MM)
    side = (-along[1] * 0.35, along[0] * 0.35)
    corners = (tip, (foot[0] + side[0], foot[1] + side[1]), (foot[0] - side[0], foot[1] - side[1]))
    points = "L".join(f"{x:.3f} {y:.3f}" for x, y in corners)
    return f'<path class="arrow" d="M{points}Z"/>'
