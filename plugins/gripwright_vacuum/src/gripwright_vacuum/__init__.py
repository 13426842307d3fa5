"""Grippers that hold by a face: a suction cup (`vacuum-1`) and a magnet (`magnetic-1`)."""

from gripwright.plugin_api import Manifest, PluginEntry

_HERE = "gripwright_vacuum"

manifest = Manifest(
    version="0.1.0",
    api_version="1.2",
    plugins=(
        PluginEntry(kind="planner", key="flat_faces", target=f"{_HERE}.flat_faces:FlatFacePlanner"),
        PluginEntry(kind="rule", key="vacuum_face", target=f"{_HERE}.vacuum.rule:VacuumFace"),
        PluginEntry(kind="hand", key="vacuum_1", target=f"{_HERE}.vacuum.hand:VacuumHand"),
        PluginEntry(kind="holding", key="vacuum", target=f"{_HERE}.vacuum.holding:VacuumHolding"),
        PluginEntry(kind="finger", key="suction_cup", target=f"{_HERE}.vacuum.finger:SuctionCup"),
        PluginEntry(kind="rule", key="magnetic_face", target=f"{_HERE}.magnetic.rule:MagneticFace"),
        PluginEntry(kind="hand", key="magnetic_1", target=f"{_HERE}.magnetic.hand:MagneticHand"),
        PluginEntry(kind="holding", key="magnetic", target=f"{_HERE}.magnetic.holding:MagneticHolding"),
        PluginEntry(kind="finger", key="pole_shoe", target=f"{_HERE}.magnetic.finger:PoleShoe"),
    ),
)
