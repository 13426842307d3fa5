"""Every promise of a design folder, checked with nothing but the folder and the product package."""

from __future__ import annotations

import json
from pathlib import Path

from checker.coverage import check_coverage
from checker.fault import Fault, Limits
from checker.gripper import Gripper
from checker.grippers import check_gripper, check_jaw_offsets, missing_files
from checker.handles import check_handle
from checker.package import read_package


def check_design(
    design_folder: Path,
    package: Path,
    release_clearance: float = 1.0,
    margin: float = 0.1,
    min_contact: float = 3.0,
    finer: int = 1,
) -> list[Fault]:
    """All faults of a design; lengths in mm, as the options of the same names; `finer` steps of a motion for one."""
    limits = Limits(release_clearance, margin, min_contact, finer)
    product = read_package(package)
    design = json.loads((design_folder / "design.json").read_text())
    faults = list(check_coverage(design_folder, design, product))
    missing = [fault for record in design["grippers"] for fault in missing_files(design_folder, record)]
    if missing:
        return faults + missing
    grippers = [Gripper.read(design_folder, record) for record in design["grippers"]]
    faults += check_jaw_offsets(grippers)
    for gripper in grippers:
        faults += check_gripper(gripper, limits)
        for handle in gripper.record["handles"]:
            if handle["operation"] in product.operations and handle["component"] in product.components:
                faults += check_handle(gripper, handle, product, limits)
    return faults
