"""Minimum cut of a sparse undirected graph by two search trees (Boykov and Kolmogorov, 2004), compiled by numba."""

from dataclasses import dataclass

import numba
import numpy as np
import numpy.typing as npt

from gripwright.domain.shape import BoolArray, IntArray

Int8Array = npt.NDArray[np.int8]

FREE, FROM_SOURCE, FROM_SINK = 0, 1, 2
NO_ARC, TERMINAL, ORPHAN = -1, -2, -3
"""What a node's parent arc may be besides an arc: none (not in a tree), its terminal, or lost."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arcs:
    """Arcs 2i and 2i + 1 run along pair i and back; those that begin at node v are `order[start[v] : start[v + 1]]`."""

    heads: IntArray  # (2e,) where each ends
    order: IntArray  # (2e,)
    start: IntArray  # (n + 1,)


def arcs_of(pairs: IntArray, count: int) -> Arcs:
    """The arcs along pairs (e, 2) of `count` nodes."""
    tails = pairs.ravel()
    return Arcs(
        heads=np.ascontiguousarray(pairs[:, ::-1]).ravel(),
        order=np.argsort(tails, kind="stable"),
        start=np.concatenate(([0], np.cumsum(np.bincount(tails, minlength=count)))),
    )


def minimum_cut(take: IntArray, pairs: IntArray, capacities: IntArray, arcs: Arcs | None = None) -> BoolArray:
    """Which items to take, (n,), so that their sum of `take` (n,) and the `capacities` (e,) ≥ 0 of the pairs (e, 2) that part is
    least. Of several such choices the one that takes fewest. `arcs` are those of the pairs, if known."""
    arcs = arcs_of(pairs, len(take)) if arcs is None else arcs
    return np.asarray(_solve(take.copy(), np.repeat(capacities, 2), arcs.heads, arcs.order, arcs.start))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _solve(terminal: IntArray, residual: IntArray, heads: IntArray, order: IntArray, start: IntArray) -> BoolArray:
    """Push all the flow there is; afterwards the items that the source still reaches, (n,).

    `terminal` is negative towards the source, positive towards the sink; it and `residual` are used up. Both trees grow
    from their terminals until they meet; the path found is filled; nodes cut off look for a new parent or become free.
    """
    n = len(terminal)
    tree = np.zeros(n, dtype=np.int8)
    parent = np.full(n, NO_ARC, dtype=np.int64)  # the arc from a node to its parent
    distance = np.zeros(n, dtype=np.int64)  # to the terminal, a bound that helps to choose near parents
    stamp = np.zeros(n, dtype=np.int64)  # when it was last known to be right
    queue = np.empty(n + 1, dtype=np.int64)  # active nodes, a ring
    queued = np.zeros(n, dtype=np.bool_)
    head, tail, time = 0, 0, 0
    for v in range(n):
        if terminal[v] != 0:
            tree[v] = FROM_SOURCE if terminal[v] < 0 else FROM_SINK
            parent[v] = TERMINAL
            distance[v] = 1
            queue[tail] = v
            tail += 1
            queued[v] = True
    orphans = np.empty(n, dtype=np.int64)
    while head != tail:
        v = queue[head]
        if tree[v] == FREE:
            queued[v] = False
            head = (head + 1) % (n + 1)
            continue
        bridge, tail = _grow(v, tree, parent, distance, stamp, residual, heads, order, start, queue, queued, tail)
        if bridge == NO_ARC:
            queued[v] = False
            head = (head + 1) % (n + 1)
            continue
        time += 1
        count = _augment(bridge, parent, terminal, residual, heads, orphans)
        tail = _adopt(orphans, count, tree, parent, distance, stamp, time, residual, heads, order, start, queue, queued, tail)
    taken: BoolArray = tree == FROM_SOURCE
    return taken


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _grow(
    v: int,
    tree: Int8Array,
    parent: IntArray,
    distance: IntArray,
    stamp: IntArray,
    residual: IntArray,
    heads: IntArray,
    order: IntArray,
    start: IntArray,
    queue: IntArray,
    queued: BoolArray,
    tail: int,
) -> tuple[int, int]:
    """Take free neighbours of v into its tree; the arc from the source's to the sink's tree if one is met, else NO_ARC."""
    for k in range(start[v], start[v + 1]):
        arc = order[k]
        if residual[arc if tree[v] == FROM_SOURCE else arc ^ 1] == 0:
            continue
        w = heads[arc]
        if tree[w] == FREE:
            tree[w] = tree[v]
            parent[w] = arc ^ 1
            distance[w] = distance[v] + 1
            stamp[w] = stamp[v]
            if not queued[w]:
                queue[tail] = w
                queued[w] = True
                tail = (tail + 1) % len(queue)
        elif tree[w] != tree[v]:
            return (arc if tree[v] == FROM_SOURCE else arc ^ 1), tail
        elif stamp[w] <= stamp[v] and distance[w] > distance[v] + 1 and parent[w] >= 0:
            parent[w] = arc ^ 1
            distance[w] = distance[v] + 1
            stamp[w] = stamp[v]
    return NO_ARC, tail


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _augment(bridge: int, parent: IntArray, terminal: IntArray, residual: IntArray, heads: IntArray, orphans: IntArray) -> int:
    """Fill the path through the bridge; the nodes whose parent arc is full then, as a number of `orphans`."""
    flow = residual[bridge]
    for side in range(2):
        v = heads[bridge ^ 1] if side == 0 else heads[bridge]
        while parent[v] != TERMINAL:
            arc = parent[v]
            flow = min(flow, residual[arc ^ 1] if side == 0 else residual[arc])
            v = heads[arc]
        flow = min(flow, abs(terminal[v]))
    residual[bridge] -= flow
    residual[bridge ^ 1] += flow
    count = 0
    for side in range(2):
        v = heads[bridge ^ 1] if side == 0 else heads[bridge]
        while parent[v] != TERMINAL:
            arc = parent[v]
            along = arc ^ 1 if side == 0 else arc
            residual[along] -= flow
            residual[along ^ 1] += flow
            above = heads[arc]
            if residual[along] == 0:
                parent[v] = ORPHAN
                orphans[count] = v
                count += 1
            v = above
        terminal[v] += flow if side == 0 else -flow
        if terminal[v] == 0:
            parent[v] = ORPHAN
            orphans[count] = v
            count += 1
    return count


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _adopt(
    orphans: IntArray,
    count: int,
    tree: Int8Array,
    parent: IntArray,
    distance: IntArray,
    stamp: IntArray,
    time: int,
    residual: IntArray,
    heads: IntArray,
    order: IntArray,
    start: IntArray,
    queue: IntArray,
    queued: BoolArray,
    tail: int,
) -> int:
    """Find each orphan the nearest new parent that still hangs from its terminal; else set it free, and its children after it."""
    while count > 0:
        count -= 1
        v = orphans[count]
        best, best_distance = NO_ARC, np.int64(2**62)
        for k in range(start[v], start[v + 1]):
            arc = order[k]
            w = heads[arc]
            if tree[w] == tree[v] and residual[arc ^ 1 if tree[v] == FROM_SOURCE else arc] > 0:
                d = _distance(w, parent, distance, stamp, time, heads)
                if 0 <= d < best_distance:
                    best, best_distance = arc, d
        parent[v] = best
        if best != NO_ARC:
            stamp[v] = time
            distance[v] = best_distance + 1
            continue
        for k in range(start[v], start[v + 1]):
            arc = order[k]
            w = heads[arc]
            if tree[w] != tree[v]:
                continue
            if residual[arc ^ 1 if tree[v] == FROM_SOURCE else arc] > 0 and not queued[w]:
                queue[tail] = w
                queued[w] = True
                tail = (tail + 1) % len(queue)
            if parent[w] == (arc ^ 1):
                parent[w] = ORPHAN
                orphans[count] = w
                count += 1
        tree[v] = FREE
    return tail


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _distance(w: int, parent: IntArray, distance: IntArray, stamp: IntArray, time: int, heads: IntArray) -> int:
    """Number of arcs from w up to its terminal, −1 where it hangs from an orphan; marks the way for later questions."""
    d, v = 0, w
    while True:
        if stamp[v] == time:
            d += distance[v]
            break
        d += 1
        if parent[v] == TERMINAL:
            stamp[v] = time
            distance[v] = 1
            break
        if parent[v] < 0:
            return -1
        v = heads[parent[v]]
    result, v = d, w
    while stamp[v] != time:
        stamp[v] = time
        distance[v] = d
        d -= 1
        v = heads[parent[v]]
    return result
