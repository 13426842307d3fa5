"""What the children of a fake worker are forked with."""

import fake_calculation  # noqa: F401
import staged_calculation  # noqa: F401

from gripwright.design.toolbox import record_classes

record_classes()
