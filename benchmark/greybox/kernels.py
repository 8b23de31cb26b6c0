"""The inner loops of the grey-box simulation, compiled."""

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
FORCE, FRICTION, OUTFLOW, RIM, STOP = range(5)

_matrix, _cube, _places = types.float64[:, ::1], types.float64[:, :, ::1], types.int64[::1]


@njit(types.void(_matrix, _matrix, _matrix), cache=True, nogil=True)
def _multiply(a, b, product):
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            product[i, j] = 0.0
            for q in range(a.shape[1]):
                product[i, j] += a[i, q] * b[q, j]


@njit(types.void(_matrix, types.float64, _matrix, _matrix, _matrix), cache=True, nogil=True)
def transition(a, h, e, g0, g1):  # noqa: PLR0912
    """Fill exp(A h), integral of exp(A s), and integral of exp(A (h - s)) s / h, over s from 0 to h.

    Taylor series with scaling and doubling: for phi_1(A h) h and phi_2(A h) h (Hochbruck and Ostermann 2010, 2.10).
    """
    n = a.shape[0]
    size = 0.0
    for i in range(n):
        for j in range(n):
            size += abs(a[i, j])
    halvings = 0
    while size * h > 0.5:
        h *= 0.5
        halvings += 1
    power, product = np.zeros((n, n)), np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            power[i, j] = e[i, j] = 1.0 if i == j else 0.0
            g0[i, j], g1[i, j] = h * power[i, j], 0.5 * h * power[i, j]
    factor = 1.0
    for k in range(1, 13):
        _multiply(power, a, product)
        factor *= k
        for i in range(n):
            for j in range(n):
                power[i, j] = h * product[i, j]
                e[i, j] += power[i, j] / factor
                g0[i, j] += h * power[i, j] / (factor * (k + 1))
                g1[i, j] += h * power[i, j] / (factor * (k + 1) * (k + 2))
    for _ in range(halvings):
        # Over two steps: e e; the constant enters twice; the ramp is half a ramp, then half a ramp on a half.
        _multiply(e, g1, product)
        for i in range(n):
            for j in range(n):
                g1[i, j] = 0.5 * (product[i, j] + g1[i, j] + g0[i, j])
        _multiply(e, g0, product)
        for i in range(n):
            for j in range(n):
                g0[i, j] += product[i, j]
        _multiply(e, e, product)
        for i in range(n):
            for j in range(n):
                e[i, j] = product[i, j]


@njit(
    types.void(
        _cube, _cube, _cube, _matrix, types.int64, types.int64, _cube, _cube,
        types.int64, types.float64, types.UniTuple(types.FunctionType(TERM), SLOTS), types.int64, _places,
        _matrix, _places, _places, types.float64[::1], types.float64[:, :, :, ::1],
    ),
    cache=True, nogil=True,
)  # fmt: skip
def run_plant(  # noqa: PLR0912, PLR0915 - one loop, so that it stays in registers
    es, g0s, g1s, rates, entry, fast, drive, start, substeps, h, terms, n_terms, roles, thetas, p_at, m_at, memory,
    states,
):  # fmt: skip
    """Fill states [S, E, T, n] of S parameter vectors thetas [S, p] from start [S, E, n].

    The drive [S, E, T * substeps] is constant over each substep. Linear parts are exact; forces are extrapolated
    linearly over a substep (exponential Adams-Bashforth of order 2); dry friction is the impulse within its bound
    that brings the velocity nearest to zero (Moreau 1988), so that it sticks without events.
    """
    _, experiments, samples, n = states.shape
    z, new = np.empty(n), np.empty(n)
    force, before = np.empty(n), np.empty(n)
    for run in range(len(states) * experiments):
        s, experiment = run // experiments, run % experiments
        e, g0, g1, p = es[s], g0s[s], g1s[s], thetas[s]
        for i in range(n):
            z[i] = start[s, experiment, i]
            before[i] = 0.0
        for i in range(len(memory)):
            memory[i] = 0.0
        step = 0
        for k in range(samples):
            for i in range(n):
                states[s, experiment, k, i] = z[i]
            if k == samples - 1:
                break
            for _ in range(substeps):
                t = step * h
                for i in range(n):
                    force[i] = 0.0
                hold = 0.0
                for q in range(n_terms):
                    if roles[q] == FORCE:
                        force[entry] += terms[q](z[0], z[fast], t, h, p, p_at[q], memory, m_at[q])
                    elif roles[q] == OUTFLOW:
                        last = rates[s, n - 1]
                        for i in range(n):
                            # In units of the last tank's level, so that one law serves tanks of any size.
                            level = z[i] * rates[s, i] / (last + 1e-300)
                            flow = last * terms[q](level, 0.0, t, h, p, p_at[q], memory, m_at[q])
                            force[i] -= flow
                            if i + 1 < n:
                                force[i + 1] += flow
                for q in range(n_terms):
                    if roles[q] == FRICTION:
                        if m_at[q] < m_at[q + 1]:
                            # What the transmission carries: the drive against spring and forces.
                            spring = rates[s, 0] * z[0] if n > 1 else 0.0
                            memory[m_at[q]] = abs(drive[s, experiment, step] + spring - force[entry])
                        hold += terms[q](z[0], z[fast], t, h, p, p_at[q], memory, m_at[q])
                for i in range(n):
                    total = g0[i, entry] * drive[s, experiment, step]
                    for j in range(n):
                        total += e[i, j] * z[j]
                    if n_terms > 0:
                        for j in range(n):
                            change = force[j] - before[j] if step > 0 else 0.0
                            total += g0[i, j] * force[j] + g1[i, j] * change
                    new[i] = total
                if hold > 0.0:
                    gain = g0[fast, entry] + 1e-300
                    impulse = min(max(-new[fast] / gain, -hold), hold)
                    v = abs(z[fast])
                    side = 1.0 if z[fast] > 0.0 else -1.0
                    braking = v - side * new[fast]  # what the rest does to the speed in this step
                    if 0.0 < v < braking + gain * hold:
                        # It comes to rest within the step, and sticks, or turns back for what is left of it.
                        left = 1.0 - v / (braking + gain * hold)
                        back = max(braking - gain * hold, 0.0) * left
                        impulse = (-side * back - new[fast]) / gain
                    for i in range(n):
                        new[i] += g0[i, entry] * impulse
                for q in range(n_terms):
                    if roles[q] == RIM:
                        at = p_at[q]
                        for i in range(n):
                            # An upper tank's rim is told as the last one's level that it would feed.
                            rim = p[at] if i == n - 1 else p[at + 1] * rates[s, n - 1] / (rates[s, i] + 1e-300)
                            if new[i] > rim:
                                if i + 1 < n:
                                    new[i + 1] += p[at + 2] * (new[i] - rim)
                                new[i] = rim
                    elif roles[q] == STOP:
                        end = min(max(new[0], p[p_at[q]]), p[p_at[q] + 1])
                        if new[0] != end:
                            # The impact takes the velocity towards the stop and leaves one that is away from it.
                            new[fast] = min(new[fast], 0.0) if new[0] > end else max(new[fast], 0.0)
                            new[0] = end
                for i in range(n):
                    z[i], before[i] = new[i], force[i]
                step += 1


@njit(
    types.void(
        _matrix, _matrix, types.float64, types.UniTuple(types.FunctionType(TERM), SLOTS), types.int64, _places,
        types.float64[::1], _places, _places, _matrix, types.float64[::1], _cube,
    ),
    cache=True, nogil=True,
)  # fmt: skip
def follow_motion(drive, motion, dt, terms, n_terms, roles, theta, p_at, m_at, begun, memory, states):
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
            for q in range(n_terms):
                if roles[q] == FORCE:
                    force -= terms[q](x, v, k * dt, h, theta, p_at[q], memory, m_at[q])
            for q in range(n_terms):
                if roles[q] == FRICTION:
                    if m_at[q] < m_at[q + 1]:
                        memory[m_at[q]] = abs(force)
                    force += side * terms[q](x, v, k * dt, h, theta, p_at[q], memory, m_at[q])
            states[experiment, k, 0] = force
            states[experiment, k, 1] = rate


# The compiled function itself: numba would work out the types of the terms anew at every call, which takes longer than
# most simulations. Whoever calls it keeps to the one signature.
run_plant_directly = run_plant.overloads[run_plant.signatures[0]].entry_point
