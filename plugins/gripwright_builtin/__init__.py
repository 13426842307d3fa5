"""The built-in plug-ins: the first users of the public contract."""

from gripwright.plugin_api.manifest import API_VERSION, Manifest, PluginEntry

_HERE = "gripwright_builtin"

manifest = Manifest(
    name="gripwright-builtin",
    version="0.1.0",
    api_version=API_VERSION,
    plugins=(
        PluginEntry(kind="segmenter", key="sdf", target=f"{_HERE}.segmenters.sdf:SdfSegmenter"),
        PluginEntry(kind="segmenter", key="primitives", target=f"{_HERE}.segmenters.primitives:PrimitivesSegmenter"),
        PluginEntry(kind="segmenter", key="brep", target=f"{_HERE}.segmenters.brep:BrepSegmenter"),
        PluginEntry(kind="fitter", key="cylinder", target=f"{_HERE}.fitters.cylinder:CylinderFitter"),
        PluginEntry(kind="fitter", key="box", target=f"{_HERE}.fitters.box:BoxFitter"),
        PluginEntry(kind="affordance", key="marked", target=f"{_HERE}.affordance.marked:MarkedRegions"),
        PluginEntry(kind="affordance", key="threads", target=f"{_HERE}.affordance.threads:ThreadDetector"),
        PluginEntry(kind="affordance", key="teeth", target=f"{_HERE}.affordance.teeth:TeethDetector"),
        PluginEntry(kind="rule", key="three_finger_cylinder", target=f"{_HERE}.rules.cylinder:ThreeFingerCylinder"),
        PluginEntry(kind="rule", key="three_finger_bore", target=f"{_HERE}.rules.cylinder:ThreeFingerBore"),
        PluginEntry(kind="rule", key="two_finger_box", target=f"{_HERE}.rules.box:TwoFingerBox"),
        PluginEntry(kind="rule", key="four_finger_cylinder", target=f"{_HERE}.rules.cylinder:FourFingerCylinder"),
        PluginEntry(kind="rule", key="four_finger_box", target=f"{_HERE}.rules.box:FourFingerBox"),
        PluginEntry(kind="hand", key="centric_3", target=f"{_HERE}.hands.centric:CentricHand"),
        PluginEntry(kind="hand", key="centric_4", target=f"{_HERE}.hands.centric:FourFingerHand"),
        PluginEntry(kind="hand", key="parallel_2", target=f"{_HERE}.hands.parallel:ParallelHand"),
        PluginEntry(kind="planner", key="axial", target=f"{_HERE}.planners.axial:AxialPlanner"),
        PluginEntry(kind="planner", key="facet_pairs", target=f"{_HERE}.planners.facet_pairs:FacetPairPlanner"),
        PluginEntry(kind="optimizer", key="set_cover", target=f"{_HERE}.optimizers.set_cover:SetCoverOptimizer"),
        PluginEntry(kind="finger", key="straight", target=f"{_HERE}.fingers.straight:StraightFinger"),
        PluginEntry(kind="finger", key="concave", target=f"{_HERE}.fingers.concave:ConcaveFinger"),
    ),
)
