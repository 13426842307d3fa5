"""A family of small parts made by code: cones, pyramids, spheres, tori, prisms, profiles, and mixtures of them. Lengths in mm."""

import manifold3d

from shape_solids import cone, d_shaft, profile, pyramid, slot, torus, zone

Manifold = manifold3d.Manifold
_FINE, _BALL, _LARGE_BALL = 64, 96, 192
"""Facets around: chords stay within 0.02 mm. A ball is touched along one or two rows of them."""


def parts() -> dict[str, Manifold]:
    """Name → solid, standing on z = 0."""
    return {name: _standing(solid) for name, solid in {**_single(), **_profiles(), **_turned(), **_mixed()}.items()}


def _standing(solid: Manifold) -> Manifold:
    low = solid.bounding_box()[2]
    return solid.translate((0.0, 0.0, -low))


def _single() -> dict[str, Manifold]:
    found = {
        f"cone {radius:g} x {height:g}": cone(radius, 0.0, height, _FINE) for radius, height in ((12, 30), (20, 20), (8, 45))
    }
    found |= {
        f"frustum {low:g} to {top:g} x {height:g}": cone(low, top, height, _FINE)
        for low, top, height in ((15, 14.8, 30), (15, 10, 20), (20, 8, 15), (10, 6, 40), (25, 20, 6))
    }
    found |= {f"pyramid of {sides}": pyramid(sides, 24.0, 0.0, 28.0) for sides in range(3, 9)}
    found |= {f"frustum of a pyramid of {sides}": pyramid(sides, 26.0, 16.0, 18.0) for sides in range(3, 9)}
    found |= {f"prism of {sides}": pyramid(sides, 22.0, 22.0, 20.0) for sides in range(3, 9)}
    found |= {
        f"ball of {2 * radius:g}": zone(radius, -radius, radius, _BALL if radius < 20.0 else _LARGE_BALL)
        for radius in (8.0, 15.0, 28.0, 40.0)
    }
    found |= {f"dome of {radius:g}": zone(radius, 0.0, radius, 96) for radius in (15.0, 40.0)}
    found["barrel zone"] = zone(30.0, -18.0, 18.0, 96)
    found |= {f"ring {major:g}, {minor:g}": torus(major, minor, 360.0, 96) for major, minor in ((20, 4), (30, 8), (12, 5))}
    found |= {f"bend of {arc:g}°": torus(25.0, 7.0, arc, 144) for arc in (90.0, 180.0)}
    return found


def _profiles() -> dict[str, Manifold]:
    angle = [(0.0, 0.0), (35.0, 0.0), (35.0, 6.0), (6.0, 6.0), (6.0, 25.0), (0.0, 25.0)]
    channel = [(0.0, 0.0), (40.0, 0.0), (40.0, 20.0), (34.0, 20.0), (34.0, 6.0), (6.0, 6.0), (6.0, 20.0), (0.0, 20.0)]
    tee = [(-20.0, 0.0), (20.0, 0.0), (20.0, 6.0), (4.0, 6.0), (4.0, 24.0), (-4.0, 24.0), (-4.0, 6.0), (-20.0, 6.0)]
    dovetail = [(-18.0, 0.0), (18.0, 0.0), (10.0, 12.0), (-10.0, 12.0)]
    wedge = [(0.0, 0.0), (36.0, 0.0), (0.0, 18.0)]
    house = [(-15.0, 0.0), (15.0, 0.0), (15.0, 14.0), (0.0, 24.0), (-15.0, 14.0)]
    return {
        "angle": profile(angle, 30.0),
        "channel": profile(channel, 30.0),
        "tee": profile(tee, 30.0),
        "dovetail": profile(dovetail, 40.0),
        "wedge": profile(wedge, 20.0),
        "house": profile(house, 30.0),
        "D shaft": profile(d_shaft(10.0, 6.0, 64), 40.0),
        "key": profile(slot(40.0, 14.0), 10.0),
        "rhomb": profile([(-20.0, 0.0), (0.0, -10.0), (20.0, 0.0), (0.0, 10.0)], 20.0),
    }


def _turned() -> dict[str, Manifold]:
    shaft = Manifold.cylinder(30.0, 8.0, 8.0, _FINE)
    return {
        "shaft with conical shoulder": shaft + cone(8.0, 20.0, 12.0, _FINE).translate((0.0, 0.0, 29.0)),
        "pin with point": shaft + cone(8.0, 0.0, 14.0, _FINE).translate((0.0, 0.0, 30.0)),
        "countersunk head": shaft.translate((0.0, 0.0, 10.0)) + cone(18.0, 8.0, 10.0, _FINE),
        "nozzle": cone(18.0, 6.0, 30.0, _FINE) + Manifold.cylinder(10.0, 22.0, 22.0, _FINE).translate((0.0, 0.0, -10.0)),
        "ball stud": Manifold.cylinder(30.0, 6.0, 6.0, _FINE) + zone(14.0, -14.0, 14.0, 96).translate((0.0, 0.0, 40.0)),
        "ball stud of 56": Manifold.cylinder(30.0, 10.0, 10.0, _FINE)
        + zone(28.0, -28.0, 28.0, _LARGE_BALL).translate((0.0, 0.0, 54.0)),
        "domed pin": Manifold.cylinder(25.0, 12.0, 12.0, 96) + zone(12.0, 0.0, 12.0, 96).translate((0.0, 0.0, 25.0)),
        "ring on a neck": torus(22.0, 6.0, 360.0, 96) + Manifold.cylinder(6.0, 20.0, 20.0, 96).translate((0.0, 0.0, -3.0)),
    }


def _mixed() -> dict[str, Manifold]:
    shank = Manifold.cylinder(40.0, 6.0, 6.0, _FINE)
    head = pyramid(6, 19.0, 19.0, 8.0).translate((0.0, 0.0, 40.0))
    nut = pyramid(6, 24.0, 24.0, 12.0) - Manifold.cylinder(20.0, 7.0, 7.0, _FINE).translate((0.0, 0.0, -4.0))
    block = Manifold.cube((40.0, 40.0, 12.0)).translate((-20.0, -20.0, 0.0))
    return {
        "hexagon bolt": shank + head,
        "hexagon nut": nut,
        "triangular knob": Manifold.cylinder(20.0, 6.0, 6.0, _FINE) + pyramid(3, 24.0, 24.0, 14.0).translate((0.0, 0.0, 20.0)),
        "octagon flange": pyramid(8, 40.0, 40.0, 8.0) + Manifold.cylinder(20.0, 12.0, 12.0, _FINE).translate((0.0, 0.0, 8.0)),
        "block with cone": block + cone(16.0, 6.0, 20.0, _FINE).translate((0.0, 0.0, 12.0)),
        "block with pyramid": block + pyramid(4, 30.0, 10.0, 20.0).translate((0.0, 0.0, 12.0)),
        "block with dome": block + zone(16.0, 0.0, 16.0, 96).translate((0.0, 0.0, 12.0)),
        "block with hexagon": block + pyramid(6, 24.0, 24.0, 16.0).translate((0.0, 0.0, 12.0)),
        "block with conical seat": block - cone(14.0, 8.0, 14.0, _FINE).mirror((0, 0, 1)).translate((0.0, 0.0, 13.0)),
        "frame": Manifold.cube((50.0, 36.0, 10.0)).translate((-25.0, -18.0, 0.0))
        - pyramid(6, 22.0, 22.0, 14.0).translate((0, 0, -2)),
    }
