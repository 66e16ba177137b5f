"""One semismooth Newton method for plasticity and contact: a primal-dual active set, an energy line search, linear tolerances
after Eisenstat and Walker, and fetiplast's tolerances at the end."""

import typing

import numpy as np
from ranks import MPI, dot, total

NEWTON_TOLERANCE, RESIDUAL_TOLERANCE, NEWTON_LIMIT = 1e-4, 1e-6, 40
LOOSEST = 1e-2
"""Relative tolerance of the first linear solves; later ones follow the residual."""


class Step(typing.NamedTuple):
    """Of one linear system."""

    motion: np.ndarray
    closing: np.ndarray
    """What closes the gaps of the active contacts; the motion comes on top."""
    pressure: np.ndarray
    """Linearised contact forces."""
    stiffness: float
    """That weighs a gap against a contact force."""
    iterations: int


def step_length(slope, before, after):
    """Zero of the energy's slope along the step, roughly; the full step unless that overshoots."""
    if before >= 0 or after <= 0.5 * abs(before):
        return 1.0
    low, high, at_low, at_high, tried = 0.0, 1.0, before, after, 1.0
    for _ in range(7):
        tried = low - (high - low) * at_low / (at_high - at_low)
        tried = min(max(tried, low + 0.1 * (high - low)), high - 0.1 * (high - low))
        found = slope(tried)
        if abs(found) < 0.2 * abs(before):
            break
        if found > 0:
            high, at_high = tried, found
        else:
            low, at_low = tried, found
    return tried


def newton(system, u, active):
    """Of a system with `load`, `state(u)`, `norm(strain)`, `step(state, active, tolerance)`, `gap(u)` and `free(force, active)`,
    which is what remains of forces on the motions that are free. Last state, active set, a row for each step, and whether it
    converged."""
    load, state = system.load, system.state(u)
    scale = np.sqrt(dot(load, load))
    norm, before, tolerance, rows, converged = system.norm(state.strain), None, LOOSEST, [], False
    while len(rows) < NEWTON_LIMIT and not converged:
        found = system.step(state, active, tolerance)
        base = u + found.closing
        closed = total(int(np.count_nonzero(found.closing))) > 0
        at_start = system.state(base) if closed else state
        new = system.state(base + found.motion)

        def slope(length, known=None):
            return dot((known or system.state(base + length * found.motion)).force - load, found.motion)

        length = step_length(slope, slope(0, at_start), slope(1, new))
        if length != 1:
            new = system.state(base + length * found.motion)
        new_norm = system.norm(new.strain)
        criterion = system.norm(new.strain - state.strain) / (norm + new_norm)
        u, state, norm = new.u, new, new_norm
        wanted = found.pressure - found.stiffness * system.gap(u) > 0
        changed = total(int((wanted != active).sum()))
        active = wanted
        left = system.free(load - state.force, active)
        residual = np.sqrt(dot(left, left)) / scale
        if before is not None:
            tolerance = min(LOOSEST, max(0.9 * (residual / before) ** 2, 1e-8, 0.1 * RESIDUAL_TOLERANCE / residual))
        before = residual
        row = {"criterion": criterion, "residual": residual, "damping": length, "iterations": found.iterations}
        row |= {"changed": changed, "plastic_elements": state.plastic_elements(), "active_contacts": total(int(active.sum()))}
        rows.append(row)
        converged = bool(changed == 0 and length == 1 and criterion < NEWTON_TOLERANCE and residual < RESIDUAL_TOLERANCE)
    return state, active, rows, converged


def summary(system, state, rows, converged):
    """What all programs of PETSc tell of their last Newton's method."""
    work = dot(system.load, state.u)
    return {
        "converged": converged,
        "newton_iterations": len(rows),
        "iterations": sum(row["iterations"] for row in rows),
        "energy": state.energy() - work,
        "external_work": work,
        "max_displacement": total(float(np.sqrt((state.u**2).sum(1)).max()), MPI.MAX),
        **{key: rows[-1][key] for key in ("plastic_elements", "active_contacts", "residual")},
    }
