"""The least gap along a motion, where poses taken at regular places pass it by."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gripwright.design.least_gap import least_gap_mm
from gripwright.design.motion import sampled
from gripwright.domain.shape import FloatArray

POINT_B = np.array([[30.0, 0.0, 0.0]])


def place(z: float, turned_deg: float = 0.0) -> FloatArray:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("y", turned_deg, degrees=True).as_matrix()
    X[:3, 3] = 0.0, 0.0, z
    return X


@pytest.mark.parametrize(
    "motion",
    [np.stack([place(200.0), place(0.0)]), np.stack([place(150.0, 80.0), place(60.0), place(0.0)])],
    ids=["straight", "tilted, then straight"],
)
@pytest.mark.parametrize("share", [0.013, 0.31, 0.777])
def test_a_peak_beside_the_way_is_not_passed_by(motion: FloatArray, share: float) -> None:
    poses = sampled(motion, 5000)
    peak = (poses[int(share * len(poses))] @ [30.0, 0.7, 0.0, 1.0])[:3]
    asked = 0

    def distance(X: FloatArray, limit_mm: float) -> float:
        nonlocal asked
        asked += 1
        return min(limit_mm, float(np.linalg.norm((X @ [*POINT_B[0], 1.0])[:3] - peak)))

    found = least_gap_mm(motion, np.eye(4), POINT_B, distance)

    assert found == pytest.approx(0.7, abs=0.03)
    assert asked < 90


def test_a_gap_that_stays_the_same_is_told_as_it_is() -> None:
    motion = np.stack([place(60.0), place(0.0)])

    assert least_gap_mm(motion, np.eye(4), POINT_B, lambda X, limit_mm: min(limit_mm, 0.4)) == 0.4
