"""Checks of hand models: frames F and G as the contract states them."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from gripwright.domain.grasp import EXTERNAL, INTERNAL, SURFACE
from gripwright.domain.gripper import ConvexSolid
from gripwright.domain.shape import FloatArray
from gripwright.geometry.frames import is_rigid
from gripwright.testing.trial import Case, Check, Trial, is_length, is_vectors

_WIDTHS_MM = (0.0, 12.0, 60.0)
_LENGTHS_MM = (20.0, 45.0)
_FACES_MM = (10.0, 40.0)
_WIDEST = 1.1  # of a face, for one that spreads
_ENVELOPE_MM, _DEPTH_MM = 50.0, 80.0
_TOLERANCE_MM = 1e-6
_ROUND = 1.1  # a prism around the envelope's cylinder, of eight sides or more


def cases(trial: Trial) -> list[Case]:
    """Several openings and lengths, both grips of jaws; of a face its own."""
    grips, lengths = _grips(trial.plugin), _lengths_mm(trial.plugin)
    return [
        *(Case(name=f"W = {w:g} mm", method="finger_poses", arguments={"opening_width_mm": w}) for w in _WIDTHS_MM),
        *(
            Case(name=f"L = {length:g} mm, {grip}", method="finger", arguments={"finger_length_mm": length, "grip": grip})
            for length in lengths
            for grip in grips
        ),
        *(
            Case(
                name=f"L = {length:g} mm",
                method="palm",
                arguments={"finger_length_mm": length, "envelope_mm": _ENVELOPE_MM, "depth_mm": _DEPTH_MM},
            )
            for length in lengths
        ),
        *(Case(name=grip, method="opening_floor_mm", arguments={"grip": grip}) for grip in grips),
        *(Case(name="as it comes", method="finger_length_min_mm", arguments={}) for grip in grips if grip == SURFACE),
    ]


def _grips(plugin: Any) -> tuple[str, ...]:
    return (SURFACE,) if hasattr(plugin, "sized") else (EXTERNAL, INTERNAL)


def _lengths_mm(plugin: Any) -> tuple[float, ...]:
    """A face is asked from the length on at which it is whole."""
    if not hasattr(plugin, "sized"):
        return _LENGTHS_MM
    least = plugin(plugin.params_model()).finger_length_min_mm()
    return tuple(least + beyond for beyond in (0.0, 25.0))


def poses(trial: Trial) -> Iterable[str]:
    """X_GF = Rz(θi)·Tx(W/2)."""
    for case, found in _of(trial, "finger_poses"):
        half = case.arguments["opening_width_mm"] / 2.0
        if not isinstance(found, np.ndarray) or found.shape != (trial.plugin.fingers, 4, 4):
            yield f"{case.name}: finger_poses must be ({trial.plugin.fingers}, 4, 4), is {np.shape(found)}"
            continue
        for number, X in enumerate(found, 1):
            if not is_rigid(X) or not np.allclose(X[:3, 2], [0, 0, 1], atol=1e-9):
                yield f"{case.name}: the pose of finger {number} is no rotation about z"
            elif hasattr(trial.plugin, "sized"):
                if abs(X[2, 3]) > _TOLERANCE_MM:
                    yield f"{case.name}: face {number} stands at z = {X[2, 3]:g} mm, 0 was expected"
            elif not np.allclose(X[:3, 3], half * X[:3, 0], atol=_TOLERANCE_MM):
                stands = np.round(X[:3, 3], 3).tolist()
                yield f"{case.name}: finger {number} stands at {stands}, {half:g} mm along its own x was expected"


def finger(trial: Trial) -> Iterable[str]:
    """Within x ≥ 0 (x ≤ 0 from inside) and −L ≤ z ≤ 0, its tip at z = 0 and its gripping surface at x = 0; a face at z = 0."""
    for case, found in _of(trial, "finger"):
        points = _points(found)
        if points is None:
            yield f"{case.name}: finger must be a sequence of ConvexSolid with a volume"
            continue
        length, sign = case.arguments["finger_length_mm"], 1.0 if case.arguments["grip"] == EXTERNAL else -1.0
        outwards = float((sign * points[:, 0]).min())
        if abs(outwards) > _TOLERANCE_MM and case.arguments["grip"] != SURFACE:
            side = "x ≥ 0" if sign > 0 else "x ≤ 0"
            yield f"{case.name}: the gripping surface lies at x = {sign * outwards:.6g} mm; the finger fills {side} from x = 0"
        low, high = points[:, 2].min(), points[:, 2].max()
        if low < -length - _TOLERANCE_MM or abs(high) > _TOLERANCE_MM:
            yield f"{case.name}: the finger reaches from z = {low:.6g} to {high:.6g} mm, within −{length:g} to 0 was expected"


def face(trial: Trial) -> Iterable[str]:
    """A face, sized, is that wide at z = 0, and as long as it says at least."""
    if not hasattr(trial.plugin, "sized"):
        return
    for width in _FACES_MM:
        hand = trial.instance().sized(width)
        length = hand.finger_length_min_mm()
        if not is_length(length):
            yield f"W = {width:g} mm: finger_length_min_mm is {length}"
            continue
        points = _points(hand.finger(length, SURFACE))
        if points is None:
            yield f"W = {width:g} mm: finger must be a sequence of ConvexSolid with a volume"
            continue
        for axis in (0, 1):
            extent = float(np.ptp(points[points[:, 2] > -_TOLERANCE_MM][:, axis]))
            if not width - _TOLERANCE_MM <= extent <= _WIDEST * width:
                yield f"W = {width:g} mm: the face is {extent:.6g} mm wide, {width:g} to {_WIDEST * width:g} was expected"


def palm(trial: Trial) -> Iterable[str]:
    """Behind z = −L, within the envelope, and the same at another length, farther back."""
    shapes = []
    for case, found in _of(trial, "palm"):
        points = _points(found)
        if points is None:
            yield f"{case.name}: palm must be a sequence of ConvexSolid with a volume"
            continue
        length = case.arguments["finger_length_mm"]
        low, high = points[:, 2].min(), points[:, 2].max()
        if high > -length + _TOLERANCE_MM or low < -length - _DEPTH_MM - _TOLERANCE_MM:
            expected = f"−{length + _DEPTH_MM:g} to −{length:g}"
            yield f"{case.name}: the palm reaches from z = {low:.6g} to {high:.6g} mm, {expected} was expected"
        radius = float(np.hypot(points[:, 0], points[:, 1]).max())
        if radius > _ROUND * _ENVELOPE_MM:
            yield f"{case.name}: the palm reaches {radius:.3f} mm from the axis, its envelope is {_ENVELOPE_MM:g} mm"
        shapes.append(points + np.array([0.0, 0.0, length]))
    if len({shape.shape for shape in shapes}) > 1 or any(not np.allclose(shape, shapes[0], atol=1e-6) for shape in shapes[1:]):
        yield "the palm has another shape at another finger length; it may only stand farther back"


def opening_floor(trial: Trial) -> Iterable[str]:
    """A length, or zero."""
    for case, found in _of(trial, "opening_floor_mm"):
        if not isinstance(found, int | float) or not np.isfinite(found) or found < 0:
            yield f"{case.name}: opening_floor_mm is {found}"


def _of(trial: Trial, method: str) -> Iterable[tuple[Case, Any]]:
    return ((case, answer) for case, answer in trial.answers() if case.method == method)


def _points(solids: Any) -> FloatArray | None:
    """All corners (n, 3); None where these are no solids."""
    if not isinstance(solids, Sequence) or not solids or not all(isinstance(solid, ConvexSolid) for solid in solids):
        return None
    for solid in solids:
        corners = solid.vertices_mm
        if not is_vectors(corners) or np.linalg.matrix_rank(corners - corners.mean(axis=0), tol=1e-9) < 3:
            return None
    return np.concatenate([solid.vertices_mm for solid in solids])


CHECKS = (
    Check("finger poses", "X_GF of each finger is Rz(θ)·Tx(W/2)", poses),
    Check("finger", "a finger lies behind its gripping surface and its tip", finger),
    Check("sized", "a face is as wide as the opening width says", face),
    Check("palm", "the palm lies behind z = −L and within its envelope", palm),
    Check("opening floor", "the least opening is a length", opening_floor),
)
