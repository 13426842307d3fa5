"""The search for free grasps on one component in one operation, segment by segment, remembered where nothing near has changed."""

from collections.abc import Sequence
from functools import partial
from typing import Any

from gripwright.design.grasp_judge import GraspJudge
from gripwright.design.scene_memory import SceneMemory
from gripwright.design.stages.constraints import SegmentSearch, search_between
from gripwright.design.toolbox import Toolbox
from gripwright.domain.errors import Rejection
from gripwright.domain.grasp import GripRequirement, SegmentVerdict
from gripwright.domain.shape import FloatArray, SegmentAnalysis
from gripwright.plugin_api import RunContext

Asked = tuple[SegmentAnalysis, tuple[GripRequirement, ...] | Rejection]


class ComponentSearch:
    """Verdicts on the segments of a component; `grippers` is what besides component and scene the envelopes are made of."""

    def __init__(
        self, judge: GraspJudge, asked: Sequence[Asked], known: SceneMemory, grippers: Any, toolbox: Toolbox, ctx: RunContext
    ) -> None:
        self._judge, self._asked, self._known, self._grippers, self._ctx = judge, asked, known, grippers, ctx
        self._searches = {
            item.segment.id: SegmentSearch(item, needs, judge, toolbox, ctx)
            for item, needs in asked
            if not isinstance(needs, Rejection)
        }

    def planned(self) -> tuple[SegmentVerdict, ...]:
        """Of the grasps that the planners name."""
        verdicts = []
        for number, (item, needs) in enumerate(self._asked, start=1):
            if isinstance(needs, Rejection):
                verdicts.append(_refused(item, needs))
            else:
                made_from = (self._judge.held, item, needs, self._grippers)
                verdicts.append(self._known.answer("segment", made_from, partial(self._planned, item)))
            self._ctx.progress(number / len(self._asked), self._judge.held.component.id)
        return tuple(verdicts)

    def between(self, finest: FloatArray) -> tuple[SegmentVerdict, ...]:
        """Of these and the grasps between them, as finely as it takes, at most as `search_between` says."""
        made_from = (self._judge.held, self._asked, self._grippers, finest)
        return self._known.answer("between", made_from, lambda: self._between(finest))

    def _planned(self, item: SegmentAnalysis) -> SegmentVerdict:
        search = self._searches[item.segment.id]
        search.planned()
        return search.verdict("")

    def _between(self, finest: FloatArray) -> tuple[SegmentVerdict, ...]:
        searches = list(self._searches.values())

        def progress(number: int) -> None:
            self._ctx.progress((number + 1) / len(searches), f"{self._judge.held.component.id}, between the planned grasps")

        searched = search_between(searches, finest, progress)
        return tuple(
            _refused(item, needs) if isinstance(needs, Rejection) else self._searches[item.segment.id].verdict(searched)
            for item, needs in self._asked
        )


def _refused(item: SegmentAnalysis, reason: Rejection) -> SegmentVerdict:
    return SegmentVerdict(segment=item.segment.id, requirement=None, grasps_planned=0, free=(), rejection=reason)
