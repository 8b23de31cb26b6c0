"""One substep of each kind of plant, written as step forms are; `simgap.greybox.kernels` says what is solved and how.

Every function advances the state z [n] in place by h, with the transition matrices e, g0, g1 of `transition` as flat
lists, and works in `new` [n]. tests/exports/test_grey_boxes.py holds each to the compiled loops, effect by effect.
"""

from __future__ import annotations

from simgap.greybox.kernels import dry_friction as kernel

dry_friction = kernel.py_func


def move_body(
    s: list, at: int, new: list, e: list, g0: list, g1: list, n: int, entry: int, seen: list,
    drive: float, force: float, change: float, hold: float,
):  # fmt: skip
    """Take s[at], s[at + 1], .. to the end of a substep; dry friction holds up to `hold`.

    `seen` weighs the states in the velocity.
    """
    for i in range(n):
        total = g0[i * n + entry] * drive
        for j in range(n):
            total += e[i * n + j] * s[at + j]
        new[i] = total + (g0[i * n + entry] * force + g1[i * n + entry] * change)
    if hold > 0.0:
        v, ahead, gain = 0.0, 0.0, 1e-300
        for i in range(n):
            v += seen[i] * s[at + i]
            ahead += seen[i] * new[i]
            gain += seen[i] * g0[i * n + entry]
        if gain > 0.0:
            impulse = dry_friction(v, ahead, gain, hold)
            for i in range(n):
                new[i] += g0[i * n + entry] * impulse


def stop_body(new: list, fast: int, low: float, high: float):
    """Stop at either end; the impact takes the velocity towards the stop and leaves one that is away from it."""
    end = min(max(new[0], low), high)
    if new[0] != end:
        new[fast] = min(new[fast], 0.0) if new[0] > end else max(new[fast], 0.0)
        new[0] = end


def brake_body(new: list, n: int, x: float, most: float, h: float):
    """Let x, a substep of h seconds ago, return to zero no faster than at the rate `most`."""
    rate = new[1] if n > 1 else (new[0] - x) / h
    kept = rate
    if x > 0.0:
        kept = max(rate, -most)
    elif x < 0.0:
        kept = min(rate, most)
    if kept != rate and n > 1:
        new[0] += 0.5 * h * (kept - rate)
        new[1] = kept
    elif kept != rate:
        new[0] = x + h * kept if abs(x) > h * most else rate * (h - abs(x) / (most + 1e-300))


def flow_out(flow: list, i: int, n: int, out: float):
    """Let so much more flow out of tank i, into the next one if there is one."""
    flow[i] -= out
    if i + 1 < n:
        flow[i + 1] += out


def fill_tanks(
    s: list, at: int, new: list, flow: list, before: int, e: list, g0: list, g1: list, n: int, drive: float, begun: int
):
    """Take the levels s[at], .. to the end of a substep; s[before], .. are the flows of the substep before."""
    for i in range(n):
        total = g0[i * n] * drive
        for j in range(n):
            total += e[i * n + j] * s[at + j]
        for j in range(n):
            change = flow[j] - s[before + j] if begun > 0 else 0.0
            total += g0[i * n + j] * flow[j] + g1[i * n + j] * change
        new[i] = total
    for i in range(n):
        s[before + i] = flow[i]


def spill_tanks(new: list, n: int, rates: list, rim_of_last: float, rim_of_upper: float, caught: float):
    """Cut each level at its rim; a share of what an upper tank spills falls into the next one."""
    for i in range(n):
        rim = rim_of_last if i == n - 1 else rim_of_upper * rates[n - 1] / (rates[i] + 1e-300)
        if new[i] > rim:
            if i + 1 < n:
                new[i + 1] += caught * (new[i] - rim)
            new[i] = rim


def take(s: list, at: int, new: list, n: int):
    """Make `new` the state."""
    for i in range(n):
        s[at + i] = new[i]
