"""The inner loop of a machine with a controller inside, compiled."""

from __future__ import annotations

import math

from numba import types

from simgap.greybox.kernels import FORCE, FRICTION, OUTFLOW, RIM, SLOTS, STOP, TERM, directly, dry_friction, pointer

_row, _matrix, _cube = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
_places, _terms = types.int64[::1], types.UniTuple(types.FunctionType(TERM), SLOTS)


@directly(
    types.void(
        types.boolean, _matrix, _matrix, _matrix, _matrix, _row, _row, _row, _matrix, _row, types.int64, types.float64,
        _terms, _places, _row, _places, _places, _row, _terms, _places, types.int64, _cube,
    )
)  # fmt: skip
def run_machine(  # noqa: PLR0912 - one loop, so that it stays in registers
    loop, goal, gain, supply, enabled, inertias, weights, numbers, start, since, substeps, h,
    terms, until, theta, p_at, m_at, memory, commands, c_at, n_commands, states,
):  # fmt: skip
    """Fill states [E, T, n], (q, q') or (q'), from start [E, n]: the equation of `Machine`, by the leapfrog method.

    goal [E, T * substeps] is r, or the drive; gain, supply (times the drive's gain) and enabled [E, T]. numbers:
    damping, back-EMF, derivative, stiffness, radian, q0. Commands pass their terms in order, term(c, r - q, ..).
    Forces act at the position in the middle of a substep, damping acts exactly (Hairer, Lubich, Wanner 2003, 1.5).
    Dry friction is an impulse that brings the velocity nearest to zero, as in `run_body`.
    """
    damping, back_emf, derivative, stiffness, radian, rest = numbers
    experiments, samples, n = states.shape
    p, held = pointer(theta), pointer(memory)
    for experiment in range(experiments):
        inertia, weight = inertias[experiment] * radian, weights[experiment]
        q = start[experiment, 0] if n > 1 else 0.0
        v = start[experiment, n - 1]
        for i in range(len(memory)):
            memory[i] = 0.0
        step = 0
        for k in range(samples):
            if n > 1:
                states[experiment, k, 0] = q
            states[experiment, k, n - 1] = v
            if k == samples - 1:
                break
            on = enabled[experiment, k]
            d = damping + back_emf * on
            # What a unit of force adds to the velocity in a substep, while damping takes it away again.
            scale = -math.expm1(-h * d / (inertia + 1e-300)) / d if d > 0.0 else h / (inertia + 1e-300)
            for _ in range(substeps):
                middle = q + 0.5 * h * v
                x = middle if n > 1 else v
                t = since[experiment] + step * h
                error = goal[experiment, step] - middle
                command = goal[experiment, step]
                if loop:
                    command = gain[experiment, k] * error - derivative * v
                for c in range(n_commands):
                    command = commands[c](command, error, t, h, p, c_at[c], held, 0)
                drive = supply[experiment, k] * on * command
                other = -stiffness * x if n > 1 else 0.0
                if weight != 0.0:
                    other -= weight * math.sin(radian * (x - rest))
                for j in range(until[FORCE]):
                    other += terms[j](x, v, t, h, p, p_at[j], held, m_at[j])
                hold = 0.0
                for j in range(until[FORCE], until[FRICTION]):
                    if m_at[j] < m_at[j + 1]:
                        memory[m_at[j]] = drive - back_emf * on * v - other
                    hold += terms[j](x, v, t, h, p, p_at[j], held, m_at[j])
                for j in range(until[FRICTION], until[OUTFLOW]):
                    other -= d * terms[j](x, 0.0, t, h, p, p_at[j], held, m_at[j])
                new = v + scale * (drive + other - d * v)
                if hold > 0.0:
                    new += scale * dry_friction(v, new, scale, hold)
                for j in range(until[OUTFLOW], until[RIM]):
                    new = min(new, p[p_at[j]])
                if n > 1:
                    q += 0.5 * h * (v + new)
                    for j in range(until[RIM], until[STOP]):
                        end = min(max(q, p[p_at[j]]), p[p_at[j] + 1])
                        if q != end:
                            new = min(new, 0.0) if q > end else max(new, 0.0)
                            q = end
                v = new
                step += 1
