"""Spheres found by the RANSAC of pyransac3d."""

from gripwright.plugin_api import Manifest, PluginEntry

manifest = Manifest(
    version="0.1.0",
    api_version="1.2",
    plugins=(
        PluginEntry(
            kind="fitter",
            key="ransac_sphere",
            target="gripwright_ransac.sphere:RansacSphereFitter",
            primitives=("gripwright_ransac.sphere:RansacSphere",),
        ),
    ),
)
