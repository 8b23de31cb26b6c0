"""The inner loops of grey boxes with forces, compiled."""

from __future__ import annotations

import warnings

import numpy as np
from numba import NumbaExperimentalFeatureWarning, njit, types

# Function pointers as arguments are called experimental since 2020; what is used of them is tested.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

# Every force term: (x, v, t, h, p, i, m, j) -> number, see simgap.greybox.effects.effect.ForceEffect.
TERM = types.float64(
    types.float64, types.float64, types.float64, types.float64,
    types.float64[::1], types.int64, types.float64[::1], types.int64,
)  # fmt: skip
SLOTS = 5  # force terms that one model may have; the tuple has this length, so that the loop is compiled once
# In the order of simgap.greybox.effects.effect.Role.
FORCE, FRICTION, OUTFLOW, RIM, STOP = range(5)

_matrix, _cube, _places = types.float64[:, ::1], types.float64[:, :, ::1], types.int64[::1]
_loop = types.void(
    _cube, _cube, _cube, _matrix, types.int64, _cube, _cube, types.int64, types.float64,
    types.UniTuple(types.FunctionType(TERM), SLOTS), _places, _matrix, _places, _places, types.float64[::1],
    types.float64[:, :, :, ::1],
)  # fmt: skip


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


@njit(_loop, cache=True, nogil=True)
def run_body(  # noqa: PLR0912 - one loop, so that it stays in registers
    es, g0s, g1s, rates, entry, drive, start, substeps, h, terms, until, thetas, p_at, m_at, memory, states
):
    """Fill states [S, E, T, n] of a body, for S parameter vectors thetas [S, p], from start [S, E, n].

    The drive [S, E, T * substeps] is constant over each substep. Linear parts are exact; forces are extrapolated
    linearly over a substep (exponential Adams-Bashforth of order 2); dry friction is the impulse within its bound
    that brings the velocity nearest to zero (Moreau 1988), so that it sticks without events. The terms come sorted by
    their role; until[role] counts those of this role and of the ones before.
    """
    _, experiments, samples, n = states.shape
    fast = min(1, n - 1)
    z, new, g0, g1, e = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty((n, n))
    for s in range(len(states)):
        p = thetas[s]
        for i in range(n):
            g0[i], g1[i] = g0s[s, i, entry], g1s[s, i, entry]
            for j in range(n):
                e[i, j] = es[s, i, j]
        gain = g0[fast] + 1e-300
        spring = rates[s, 0] if n > 1 else 0.0
        for experiment in range(experiments):
            u, motion = drive[s, experiment], states[s, experiment]
            for i in range(n):
                z[i] = start[s, experiment, i]
            for i in range(len(memory)):
                memory[i] = 0.0
            before, step = 0.0, 0
            for k in range(samples):
                for i in range(n):
                    motion[k, i] = z[i]
                if k == samples - 1:
                    break
                for _ in range(substeps):
                    force = 0.0
                    for q in range(until[FORCE]):
                        force += terms[q](z[0], z[fast], step * h, h, p, p_at[q], memory, m_at[q])
                    hold = 0.0
                    for q in range(until[FORCE], until[FRICTION]):
                        if m_at[q] < m_at[q + 1]:
                            # What the transmission carries: the drive against spring and forces.
                            memory[m_at[q]] = abs(u[step] + spring * z[0] - force)
                        hold += terms[q](z[0], z[fast], step * h, h, p, p_at[q], memory, m_at[q])
                    change = force - before if step > 0 else 0.0
                    for i in range(n):
                        total = g0[i] * u[step]
                        for j in range(n):
                            total += e[i, j] * z[j]
                        new[i] = total + (g0[i] * force + g1[i] * change)
                    if hold > 0.0:
                        impulse = dry_friction(z[fast], new[fast], gain, hold)
                        for i in range(n):
                            new[i] += g0[i] * impulse
                    for q in range(until[RIM], until[STOP]):
                        end = min(max(new[0], p[p_at[q]]), p[p_at[q] + 1])
                        if new[0] != end:
                            # The impact takes the velocity towards the stop and leaves one that is away from it.
                            new[fast] = min(new[fast], 0.0) if new[0] > end else max(new[fast], 0.0)
                            new[0] = end
                    for i in range(n):
                        z[i] = new[i]
                    before = force
                    step += 1


@njit(_loop, cache=True, nogil=True)
def run_tanks(  # noqa: PLR0912 - as above
    es, g0s, g1s, rates, entry, drive, start, substeps, h, terms, until, thetas, p_at, m_at, memory, states
):
    """Fill states [S, E, T, n] of a cascade of tanks, as run_body does; forces act on the first one as inflows."""
    _, experiments, samples, n = states.shape
    z, new, flow, before = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for run in range(len(states) * experiments):
        s, experiment = run // experiments, run % experiments
        e, g0, g1, p = es[s], g0s[s], g1s[s], thetas[s]
        u, levels, last = drive[s, experiment], states[s, experiment], rates[s, n - 1]
        for i in range(n):
            z[i] = start[s, experiment, i]
            before[i] = 0.0
        for i in range(len(memory)):
            memory[i] = 0.0
        step = 0
        for k in range(samples):
            for i in range(n):
                levels[k, i] = z[i]
            if k == samples - 1:
                break
            for _ in range(substeps):
                for i in range(n):
                    flow[i] = 0.0
                for q in range(until[FORCE]):
                    flow[entry] += terms[q](z[0], z[0], step * h, h, p, p_at[q], memory, m_at[q])
                for q in range(until[FRICTION], until[OUTFLOW]):
                    for i in range(n):
                        # In units of the last tank's level, so that one law serves tanks of any size.
                        level = z[i] * rates[s, i] / (last + 1e-300)
                        out = last * terms[q](level, 0.0, step * h, h, p, p_at[q], memory, m_at[q])
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


@njit(
    types.void(
        _matrix, _matrix, types.float64, types.UniTuple(types.FunctionType(TERM), SLOTS), _places, types.float64[::1],
        _places, _places, _matrix, types.float64[::1], _cube,
    ),
    cache=True, nogil=True,
)  # fmt: skip
def follow_motion(drive, motion, dt, terms, until, theta, p_at, m_at, begun, memory, states):
    """Fill states [E, T, 2] with the force that an imposed motion [E, T] takes, and with the rate of the drive [E, T].

    Between two samples the motion is even. Where it stands still, dry friction goes on holding as it did before.
    """
    for experiment in range(len(drive)):
        for i in range(len(memory)):
            memory[i] = begun[experiment, i]
        side = 0.0
        for k in range(drive.shape[1]):
            x, h = motion[experiment, k], dt if k > 0 else 0.0
            before, after, last = max(k - 1, 0), min(k + 1, drive.shape[1] - 1), max(k, 1)
            v = (motion[experiment, last] - motion[experiment, last - 1]) / dt if after > before else 0.0
            rate = (drive[experiment, after] - drive[experiment, before]) / (max(after - before, 1) * dt)
            if v != 0.0:
                side = 1.0 if v > 0.0 else -1.0
            force = drive[experiment, k]
            for q in range(until[FORCE]):
                force -= terms[q](x, v, k * dt, h, theta, p_at[q], memory, m_at[q])
            for q in range(until[FORCE], until[FRICTION]):
                if m_at[q] < m_at[q + 1]:
                    memory[m_at[q]] = abs(force)
                force += side * terms[q](x, v, k * dt, h, theta, p_at[q], memory, m_at[q])
            states[experiment, k, 0] = force
            states[experiment, k, 1] = rate


# The compiled functions themselves: numba would work out the types of the terms anew at every call, which takes longer
# than most simulations. Whoever calls them keeps to the one signature.
run_body_directly, run_tanks_directly, follow_motion_directly = (
    f.overloads[f.signatures[0]].entry_point for f in (run_body, run_tanks, follow_motion)
)
