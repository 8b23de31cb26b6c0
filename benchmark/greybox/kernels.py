"""The inner loops of grey boxes with forces, compiled."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache, wraps
from typing import Any

import numpy as np
from numba import NumbaExperimentalFeatureWarning, njit, types
from numba.extending import intrinsic

# Function pointers as arguments are called experimental since 2020; what is used of them is tested.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

# Every force term: (x, v, t, h, p, i, m, j) -> number, see simgap.greybox.effects.effect.ForceEffect.
TERM = types.float64(
    types.float64, types.float64, types.float64, types.float64,
    types.CPointer(types.float64), types.int64, types.CPointer(types.float64), types.int64,
)  # fmt: skip
SLOTS = 5  # force terms that one model may have; the tuple has this length, so that the loop is compiled once
# In the order of simgap.greybox.effects.effect.Role.
FORCE, FRICTION, OUTFLOW, RIM, STOP, BRAKING = range(6)

_row, _matrix, _cube, _places = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1], types.int64[::1]
_loop = types.void(
    _cube, _cube, _cube, _matrix, _matrix, types.int64, _cube, _cube, _row, types.int64, types.float64,
    types.UniTuple(types.FunctionType(TERM), SLOTS), _places, _matrix, _places, _places, _cube,
    types.float64[:, :, :, ::1],
)  # fmt: skip


def directly(signature: Any) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Compile a loop when it is first called, and call it without numba's dispatch.

    The dispatch would work out the types of the terms anew at every call, which takes longer than most simulations.
    Whoever calls the loop keeps to the signature.
    """

    def decorate(loop: Callable[..., None]) -> Callable[..., None]:
        kernel = njit(cache=True, nogil=True)(loop)

        @cache
        def compiled() -> Callable[..., None]:
            kernel.compile(signature)
            return kernel.overloads[kernel.signatures[0]].entry_point

        @wraps(loop)
        def run(*arguments: Any) -> None:
            compiled()(*arguments)

        return run

    return decorate


def _beginning(context, array):
    """Return where the numbers of an array begin; a pointer costs a call of a term a third of what an array does."""

    def data(context, builder, signature, arguments):
        return context.make_array(signature.args[0])(context, builder, arguments[0]).data

    return types.CPointer(types.float64)(array), data


pointer: Any = intrinsic(_beginning)  # called with the array alone


@njit(types.float64(types.float64, types.float64, types.float64, types.float64), cache=True, nogil=True)
def dry_friction(v, new, gain, hold):
    """Compute the impulse of a friction of up to `hold` that brings a velocity, `new` without it, nearest to zero."""
    speed, side = abs(v), 1.0 if v > 0.0 else -1.0
    braking = speed - side * new  # what the rest does to the speed in this step
    if 0.0 < speed < braking + gain * hold:
        # It comes to rest within the step, and sticks, or turns back for what is left of it.
        left = 1.0 - speed / (braking + gain * hold)
        back = max(braking - gain * hold, 0.0) * left
        return (-side * back - new) / gain
    return min(max(-new / gain, -hold), hold)


@directly(_loop)
def run_body(  # noqa: PLR0912, PLR0915 - one loop, so that it stays in registers
    es, g0s, g1s, rates, seen, entry, drive, start, since, substeps, h, terms, until, thetas, p_at, m_at, begun, states
):
    """Fill states [S, E, T, n] of a body, for S parameter vectors thetas [S, p], from start [S, E, n].

    What the terms remember begins at `begun` [S, E, m].

    The drive [S, E, T * substeps] is constant over each substep. Linear parts are exact; forces are extrapolated
    linearly over a substep (exponential Adams-Bashforth of order 2); dry friction is the impulse within its bound
    that brings the velocity nearest to zero (Moreau 1988), so that it sticks without events. The terms come sorted by
    their role; until[role] counts those of this role and of the ones before. Four states stand in registers; what a
    smaller body lacks of them stays zero, what a larger one has beyond is in `far`. All runs take a substep before the
    next one begins: each has to wait for its own last substep, and the processor works on the others meanwhile. The
    rates [S, 5] say what the transmission carries, see `simulation.carried`; seen [S, 4] is c of the velocity c z that
    forces see, in the place of a position too where that is no single state.
    """
    runs, experiments, samples, n = states.shape
    size, mixed = max(n, 4), n > 1 and seen[0, 0] != 0.0
    e, g0, g1, far = np.zeros((runs, size, size)), np.zeros((runs, size)), np.zeros((runs, size)), np.zeros(size)
    z, held, before = np.zeros((runs, size)), np.zeros((runs, begun.shape[2])), np.zeros(runs)
    for s in range(runs):
        for i in range(n):
            g0[s, i], g1[s, i] = g0s[s, i, entry], g1s[s, i, entry]
            for j in range(n):
                e[s, i, j] = es[s, i, j]
    for experiment in range(experiments):
        for s in range(runs):
            for i in range(size):
                z[s, i] = start[s, experiment, i] if i < n else 0.0
            for i in range(begun.shape[2]):
                held[s, i] = begun[s, experiment, i]
            before[s] = 0.0
        step = 0
        for k in range(samples):
            for s in range(runs):
                for i in range(n):
                    states[s, experiment, k, i] = z[s, i]
            if k == samples - 1:
                break
            for _ in range(substeps):
                t = since[experiment] + step * h
                for s in range(runs):
                    z0, z1, z2, z3 = z[s, 0], z[s, 1], z[s, 2], z[s, 3]
                    x, v = z0, z1 if n > 1 else z0
                    if mixed:
                        x = v = seen[s, 0] * z0 + seen[s, 1] * z1 + seen[s, 2] * z2 + seen[s, 3] * z3
                    u, p, m = drive[s, experiment, step], pointer(thetas[s]), pointer(held[s])
                    force = 0.0
                    for q in range(until[FORCE]):
                        force += terms[q](x, v, t, h, p, p_at[q], m, m_at[q])
                    hold = 0.0
                    for q in range(until[FORCE], until[FRICTION]):
                        if m_at[q] < m_at[q + 1]:
                            # What the transmission carries, and what damping takes of it.
                            c = rates[s]
                            held[s, m_at[q]] = u + (c[0] * z0 + c[1] * z1 + c[2] * z2 + c[3] * z3) - force
                            held[s, m_at[q] + 1] = c[4] * v
                        hold += terms[q](x, v, t, h, p, p_at[q], m, m_at[q])
                    rise = force - before[s] if step > 0 else 0.0
                    a, a0, a1, a2, a3 = e[s], g0[s, 0], g0[s, 1], g0[s, 2], g0[s, 3]
                    b0, b1, b2, b3 = g1[s, 0], g1[s, 1], g1[s, 2], g1[s, 3]
                    new0 = a0 * u + a[0, 0] * z0 + a[0, 1] * z1 + a[0, 2] * z2 + a[0, 3] * z3 + (a0 * force + b0 * rise)
                    new1 = a1 * u + a[1, 0] * z0 + a[1, 1] * z1 + a[1, 2] * z2 + a[1, 3] * z3 + (a1 * force + b1 * rise)
                    new2 = a2 * u + a[2, 0] * z0 + a[2, 1] * z1 + a[2, 2] * z2 + a[2, 3] * z3 + (a2 * force + b2 * rise)
                    new3 = a3 * u + a[3, 0] * z0 + a[3, 1] * z1 + a[3, 2] * z2 + a[3, 3] * z3 + (a3 * force + b3 * rise)
                    for i in range(4, n):
                        new0 += a[0, i] * z[s, i]
                        new1 += a[1, i] * z[s, i]
                        new2 += a[2, i] * z[s, i]
                        new3 += a[3, i] * z[s, i]
                        far[i] = g0[s, i] * u + (g0[s, i] * force + g1[s, i] * rise)
                        for j in range(n):
                            far[i] += a[i, j] * z[s, j]
                    if hold > 0.0:
                        gain, new = (a1, new1) if n > 1 else (a0, new0)
                        if mixed:
                            gain = seen[s, 0] * a0 + seen[s, 1] * a1 + seen[s, 2] * a2 + seen[s, 3] * a3
                            new = seen[s, 0] * new0 + seen[s, 1] * new1 + seen[s, 2] * new2 + seen[s, 3] * new3
                        # A negative gain is not that of the mass whose velocity is measured.
                        impulse = 0.0 if mixed and gain < 0.0 else dry_friction(v, new, gain + 1e-300, hold)
                        new0 += a0 * impulse
                        new1 += a1 * impulse
                        new2 += a2 * impulse
                        new3 += a3 * impulse
                        for i in range(4, n):
                            far[i] += g0[s, i] * impulse
                    for q in range(until[RIM], until[STOP]):
                        end = min(max(new0, p[p_at[q]]), p[p_at[q] + 1])
                        if new0 != end:
                            # The impact takes the velocity towards the stop and leaves one that is away from it.
                            new1 = min(new1, 0.0) if new0 > end else max(new1, 0.0)
                            new0 = end
                    for q in range(until[STOP], until[BRAKING]):
                        most = terms[q](z0, v, t, h, p, p_at[q], m, m_at[q])
                        rate = new1 if n > 1 else (new0 - z0) / h
                        kept = max(rate, -most) if z0 > 0.0 else min(rate, most) if z0 < 0.0 else rate
                        if kept != rate and n > 1:
                            new0 += 0.5 * h * (kept - rate)  # the mean rate of the substep was that much less, too
                            new1 = kept
                        elif kept != rate:
                            # It is free for what is left of the substep where it gets to zero within it.
                            new0 = z0 + h * kept if abs(z0) > h * most else rate * (h - abs(z0) / (most + 1e-300))
                    z[s, 0], z[s, 1], z[s, 2], z[s, 3] = new0, new1, new2, new3
                    for i in range(4, n):
                        z[s, i] = far[i]
                    before[s] = force
                step += 1


@directly(_loop)
def run_tanks(  # noqa: PLR0912 - as above
    es, g0s, g1s, rates, seen, entry, drive, start, since, substeps, h, terms, until, thetas, p_at, m_at, begun, states
):
    """Fill states [S, E, T, n] of a cascade of tanks, as run_body does; forces act on the first one as inflows."""
    _, experiments, samples, n = states.shape
    z, new, flow, before = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for run in range(len(states) * experiments):
        s, experiment = run // experiments, run % experiments
        e, g0, g1, p = es[s], g0s[s], g1s[s], pointer(thetas[s])
        u, levels, last = drive[s, experiment], states[s, experiment], rates[s, n - 1]
        held = pointer(begun[s, experiment])
        for i in range(n):
            z[i] = start[s, experiment, i]
            before[i] = 0.0
        step = 0
        for k in range(samples):
            for i in range(n):
                levels[k, i] = z[i]
            if k == samples - 1:
                break
            for _ in range(substeps):
                t = since[experiment] + step * h
                for i in range(n):
                    flow[i] = 0.0
                for q in range(until[FORCE]):
                    flow[entry] += terms[q](z[0], z[0], t, h, p, p_at[q], held, m_at[q])
                for q in range(until[FRICTION], until[OUTFLOW]):
                    for i in range(n):
                        # In units of the last tank's level, so that one law serves tanks of any size.
                        level = z[i] * rates[s, i] / (last + 1e-300)
                        out = last * terms[q](level, 0.0, t, h, p, p_at[q], held, m_at[q])
                        flow[i] -= out
                        if i + 1 < n:
                            flow[i + 1] += out
                for i in range(n):
                    total = g0[i, entry] * u[step]
                    for j in range(n):
                        total += e[i, j] * z[j]
                    for j in range(n):
                        change = flow[j] - before[j] if step > 0 else 0.0
                        total += g0[i, j] * flow[j] + g1[i, j] * change
                    new[i] = total
                for q in range(until[OUTFLOW], until[RIM]):
                    at = p_at[q]
                    for i in range(n):
                        # An upper tank's rim is told as the last one's level that it would feed.
                        rim = p[at] if i == n - 1 else p[at + 1] * last / (rates[s, i] + 1e-300)
                        if new[i] > rim:
                            if i + 1 < n:
                                new[i + 1] += p[at + 2] * (new[i] - rim)
                            new[i] = rim
                for i in range(n):
                    z[i], before[i] = new[i], flow[i]
                step += 1


@directly(
    types.void(
        _matrix,
        _matrix,
        _matrix,
        _row,
        types.float64,
        types.UniTuple(types.FunctionType(TERM), SLOTS),
        _places,
        _row,
        _places,
        _places,
        _matrix,
        _row,
        _cube,
    )
)
def follow_motion(drive, motion, velocity, since, dt, terms, until, theta, p_at, m_at, begun, memory, states):
    """Fill states [E, T, 2] with the force that an imposed motion [E, T] takes, and with the rate of the drive [E, T].

    Where it stands still, dry friction goes on holding as it did before.
    """
    p, held = pointer(theta), pointer(memory)
    for experiment in range(len(drive)):
        for i in range(len(memory)):
            memory[i] = begun[experiment, i]
        side = 0.0
        for k in range(drive.shape[1]):
            x, v, h = motion[experiment, k], velocity[experiment, k], dt if k > 0 else 0.0
            before, after = max(k - 1, 0), min(k + 1, drive.shape[1] - 1)
            rate = (drive[experiment, after] - drive[experiment, before]) / (max(after - before, 1) * dt)
            if v != 0.0:
                side = 1.0 if v > 0.0 else -1.0
            t, force = since[experiment] + k * dt, drive[experiment, k]
            for q in range(until[FORCE]):
                force -= terms[q](x, v, t, h, p, p_at[q], held, m_at[q])
            for q in range(until[FORCE], until[FRICTION]):
                if m_at[q] < m_at[q + 1]:
                    memory[m_at[q]] = force
                force += side * terms[q](x, v, t, h, p, p_at[q], held, m_at[q])
            states[experiment, k, 0] = force
            states[experiment, k, 1] = rate
