"""A load cycle of a scene with friction as a picture: force over displacement, and where a contact sticks and slips."""

import dataclasses
import json
import tomllib

import h5py
import matplotlib.pyplot as plt
import numpy as np
from figures import units_of

STATES = [("open", "0.82"), ("sticks", "#0072b2"), ("slips", "#d55e00")]
"""By `contact_status`."""


@dataclasses.dataclass
class Cycle:
    """What to draw of a scene."""

    title: str
    support: str
    """That which is moved to and fro along x."""
    closed: tuple
    """Load steps at whose ends the loop begins and ends."""
    height: float
    """Of the plane of the contact that is shown."""
    shown: tuple
    """Increments whose contact is shown, counted from the beginning of the loop."""
    copies: int = 1
    """Parts that symmetry makes of the scene; the other one lies where y is negative."""


class History:
    """Of each increment the time in load steps, displacement and force of the support, and what friction dissipated."""

    def __init__(self, summary, scene, cycle):
        steps = summary["steps"]
        factors = [step.get("support", {}).get(cycle.support, step.get("amplitude", 1.0)) for step in scene["step"]]
        self.time = np.array([step["time"] for step in steps])
        moved = np.interp(self.time, np.arange(len(factors) + 1), [0.0, *factors])
        self.displacement = moved * scene["support"][cycle.support]["displacement"][0]
        self.force = cycle.copies * np.array([step["reactions"][cycle.support][0] for step in steps])
        self.dissipation = cycle.copies * np.array([sum(of["dissipation"] for of in step["friction"].values()) for step in steps])
        first, last = (int(np.argmin(abs(self.time - end))) for end in cycle.closed)
        self.loop = np.arange(first, last + 1)

    def area(self):
        """That the loop encloses: the work of the support, by trapezoids."""
        force = self.force[self.loop]
        return (0.5 * (force[1:] + force[:-1]) * np.diff(self.displacement[self.loop])).sum()

    def dissipated(self):
        """In the increments of the loop."""
        return self.dissipation[self.loop[1:]].sum()


def draw(name, cycle, path, out):
    with h5py.File(path) as file:
        scene, units = file["provenance/scene"][()].decode(), units_of(file)
        grid = file["VTKHDF"]
        points, status = grid["Points"][:], grid["PointData/contact_status"][:].reshape(len(grid["Steps/Values"]), -1)
    history = History(json.loads(path.with_suffix(".json").read_text()), tomllib.loads(scene), cycle)
    figure = plt.figure(figsize=(9, 4.6), dpi=200)
    figure.suptitle(cycle.title, x=0.02, ha="left", fontsize=12)
    shown = history.loop[list(cycle.shown)]
    draw_loop(figure.add_axes((0.09, 0.12, 0.56, 0.78)), history, shown, units)
    seen = (abs(points[:, 2] - cycle.height) < 1e-6) & (status >= 0).any(axis=0)
    for place, increment in enumerate(shown):
        axes = figure.add_axes((0.69, 0.655 - 0.275 * place, 0.29, 0.25))
        draw_contact(axes, points[seen], status[increment, seen], "abc"[place], cycle)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.02), ncols=3, frameon=False, fontsize=8, handletextpad=0.1)
    figure.savefig(out / f"{name}.png", facecolor="white")
    plt.close(figure)


def draw_loop(axes, history, shown, units):
    x, y, loop = history.displacement, history.force / 1000, history.loop
    axes.axhline(0, color="0.8", linewidth=0.8)
    axes.axvline(0, color="0.8", linewidth=0.8)
    axes.fill(x[loop], y[loop], color="#d55e00", alpha=0.12)
    axes.plot(x[: loop[0] + 1], y[: loop[0] + 1], ".-", color="0.6", markersize=4, linewidth=1, label="first pull")
    axes.plot(x[loop], y[loop], ".-", color="0.1", markersize=4, linewidth=1.2, label="cycle")
    for letter, increment in zip("abc", shown):
        axes.plot(x[increment], y[increment], "o", color="#d55e00", markersize=6)
        axes.annotate(letter, (x[increment], y[increment]), (7, -11), textcoords="offset points", fontsize=10, weight="bold")
    area, dissipated = history.area(), history.dissipated()
    work = f"{units['force']} {units['length']}"
    told = f"area of the loop {area:.1f} {work}\nfriction dissipates {dissipated:.1f} {work}\ndifference {abs(dissipated / area - 1):.2%}"
    axes.text(0.33, 0.36, told, transform=axes.transAxes, ha="center", va="center", fontsize=9)
    axes.set_xlabel(f"displacement [{units['length']}]")
    axes.set_ylabel(f"force [k{units['force']}]")
    axes.legend(loc="lower right", frameon=False, fontsize=8)


def draw_contact(axes, points, status, letter, cycle):
    for state, (name, colour) in enumerate(STATES):
        x, y, _ = points[status == state].T
        places = (x, y) if cycle.copies == 1 else (np.tile(x, 2), np.concatenate([y, -y]))
        axes.scatter(*places, s=7, color=colour, label=name, linewidths=0)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(letter, x=0.06, y=0.85, fontsize=10, weight="bold")
