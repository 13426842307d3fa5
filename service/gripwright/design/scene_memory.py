"""Answers about a scene, remembered beyond a change of what stands in it.

With an answer is kept which of the standing bodies had a say in it, and how far each of the others might have grown without one
(`geometry.rooms`). It is given again only in a scene in which the former are the same and the latter keep to their rooms: there
every question on the way to it would be answered as it was.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from gripwright.design.hand_check import OperationScene
from gripwright.design.memory import Memory
from gripwright.domain.shape import FloatArray
from gripwright.geometry.collision import Scene
from gripwright.geometry.rooms import Rooms

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneAnswer:
    """An answer, what stood there when it was found, and the rooms (s, 3) of these bodies."""

    answer: Any
    bodies: tuple[str, ...]  # contents of the s standing bodies
    room_low: FloatArray
    room_high: FloatArray


class SceneMemory:
    """Answers about one operation's scene, in which nothing but `scene.standing` may differ from what they were found in."""

    def __init__(self, memory: Memory, scene: OperationScene) -> None:
        self._memory, self._standing = memory, scene.standing
        self._bodies = _contents(memory, scene.standing)
        names = (scene.attached.names, scene.standing.names)
        lengths_mm = (scene.far_mm, scene.margin_mm, scene.release_clearance_mm)
        self._other = (_contents(memory, scene.attached), names, scene.X_PC, scene.motion, lengths_mm)

    def answer(self, name: str, made_from: Any, find: Callable[[], T]) -> T:
        """What `find` returns, or returned for the same `made_from` in a scene that differs where it does not matter."""
        key = self._memory.key(name, (made_from, self._other))
        known: SceneAnswer | None = self._memory.find(key)
        if known is not None and self._holds(known):
            found: T = known.answer
            return found
        with self._standing.watched() as watch:
            found = find()
        rooms = watch.rooms()
        self._memory.save(key, SceneAnswer(answer=found, bodies=self._bodies, room_low=rooms.low, room_high=rooms.high))
        return found

    def _holds(self, known: SceneAnswer) -> bool:
        apart = Rooms(low=known.room_low, high=known.room_high).hold(self._standing.low, self._standing.high)
        return all(here == there or kept for here, there, kept in zip(self._bodies, known.bodies, apart, strict=True))


def _contents(memory: Memory, scene: Scene) -> tuple[str, ...]:
    """A name for each body's shape and place by its content."""
    return tuple(memory.key("body", (item.surface.mesh, item.X)) for item in scene.items)
