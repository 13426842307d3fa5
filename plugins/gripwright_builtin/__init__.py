"""The built-in plug-ins: the first users of the public contract."""

from gripwright.plugin_api.manifest import API_VERSION, Manifest, PluginEntry

_HERE = "gripwright_builtin"
_SHAPES = f"{_HERE}.shapes"

manifest = Manifest(
    version="0.1.0",
    api_version=API_VERSION,
    plugins=(
        PluginEntry(kind="segmenter", key="sdf", target=f"{_HERE}.segmenters.sdf:SdfSegmenter"),
        PluginEntry(kind="segmenter", key="primitives", target=f"{_HERE}.segmenters.primitives:PrimitivesSegmenter"),
        PluginEntry(kind="segmenter", key="brep", target=f"{_HERE}.segmenters.brep:BrepSegmenter"),
        PluginEntry(kind="fitter", key="cylinder", target=f"{_HERE}.fitters.cylinder:CylinderFitter"),
        PluginEntry(kind="fitter", key="box", target=f"{_HERE}.fitters.box:BoxFitter"),
        PluginEntry(
            kind="fitter",
            key="cone",
            target=f"{_SHAPES}.cone:ConeFitter",
            primitives=(f"{_SHAPES}.cone:Cone",),
        ),
        PluginEntry(
            kind="fitter",
            key="pyramid",
            target=f"{_SHAPES}.pyramid:PyramidFitter",
            primitives=(f"{_SHAPES}.pyramid:Pyramid",),
        ),
        PluginEntry(
            kind="fitter",
            key="sphere",
            target=f"{_SHAPES}.sphere:SphereFitter",
            primitives=(f"{_SHAPES}.sphere:Sphere",),
        ),
        PluginEntry(
            kind="fitter",
            key="torus",
            target=f"{_SHAPES}.torus:TorusFitter",
            primitives=(f"{_SHAPES}.torus:Torus",),
        ),
        PluginEntry(
            kind="fitter",
            key="prism",
            target=f"{_SHAPES}.prism:PrismFitter",
            primitives=(f"{_SHAPES}.prism:Prism",),
        ),
        PluginEntry(
            kind="fitter",
            key="extrusion",
            target=f"{_SHAPES}.extrusion:ExtrusionFitter",
            primitives=(f"{_SHAPES}.extrusion:Extrusion",),
        ),
        PluginEntry(kind="affordance", key="marked", target=f"{_HERE}.affordance.marked:MarkedRegions"),
        PluginEntry(kind="affordance", key="threads", target=f"{_HERE}.affordance.threads:ThreadDetector"),
        PluginEntry(kind="affordance", key="teeth", target=f"{_HERE}.affordance.teeth:TeethDetector"),
        PluginEntry(kind="rule", key="three_finger_cylinder", target=f"{_HERE}.rules.cylinder:ThreeFingerCylinder"),
        PluginEntry(kind="rule", key="three_finger_bore", target=f"{_HERE}.rules.cylinder:ThreeFingerBore"),
        PluginEntry(kind="rule", key="two_finger_box", target=f"{_HERE}.rules.box:TwoFingerBox"),
        PluginEntry(kind="rule", key="two_finger_prism", target=f"{_SHAPES}.hold_prism:TwoFingerPrism"),
        PluginEntry(kind="rule", key="three_finger_prism", target=f"{_SHAPES}.hold_prism:ThreeFingerPrism"),
        PluginEntry(kind="rule", key="two_finger_extrusion", target=f"{_SHAPES}.hold_extrusion:TwoFingerExtrusion"),
        PluginEntry(kind="rule", key="two_finger_ends", target=f"{_SHAPES}.hold_ends:TwoFingerEnds"),
        PluginEntry(kind="rule", key="three_finger_sphere", target=f"{_SHAPES}.hold_sphere:ThreeFingerSphere"),
        PluginEntry(kind="rule", key="two_finger_torus", target=f"{_SHAPES}.hold_torus:TwoFingerTorus"),
        PluginEntry(kind="rule", key="three_finger_torus", target=f"{_SHAPES}.hold_torus:ThreeFingerTorus"),
        PluginEntry(kind="rule", key="straight_cone", target=f"{_SHAPES}.hold_taper:StraightCone"),
        PluginEntry(kind="rule", key="straight_pyramid", target=f"{_SHAPES}.hold_taper:StraightPyramid"),
        PluginEntry(kind="hand", key="centric_3", target=f"{_HERE}.hands.centric:CentricHand"),
        PluginEntry(kind="hand", key="parallel_2", target=f"{_HERE}.hands.parallel:ParallelHand"),
        PluginEntry(kind="planner", key="axial", target=f"{_HERE}.planners.axial:AxialPlanner"),
        PluginEntry(kind="planner", key="facet_pairs", target=f"{_HERE}.planners.facet_pairs:FacetPairPlanner"),
        PluginEntry(kind="optimizer", key="set_cover", target=f"{_HERE}.optimizers.set_cover:SetCoverOptimizer"),
        PluginEntry(kind="finger", key="straight", target=f"{_HERE}.fingers.straight:StraightFinger"),
        PluginEntry(kind="finger", key="concave", target=f"{_HERE}.fingers.concave:ConcaveFinger"),
        PluginEntry(kind="policy", key="only_makers", target=f"{_HERE}.policies.makers:OnlyMakers"),
        PluginEntry(kind="policy", key="prefer_makers", target=f"{_HERE}.policies.makers:PreferMakers"),
        PluginEntry(kind="policy", key="never_grip", target=f"{_HERE}.policies.surfaces:NeverGrip"),
    ),
)
