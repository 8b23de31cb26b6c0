"""Draws stage.svg, the picture of the README: python docs/picture.py."""

from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

import simgap
from simgap.data.simulated.rigs import hide

SHOWN = slice(0, 300)


def main() -> None:
    """Diagnose the stage of diagnosis.md and draw one test experiment, simulated without and with the cause."""
    mpl.rcParams |= {"svg.hashsalt": "simgap", "font.size": 9, "svg.fonttype": "none"}
    trace = simgap.diagnose(hide("stage", {"coulomb_friction": 0.5})).findings.traces[0]
    t, y, before, after = (of[SHOWN] for of in (trace.t, trace.y[:, 0], trace.before[:, 0], trace.after[:, 0]))
    figure = Figure(figsize=(8, 3.6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    upper.plot(t, y, color="black", linewidth=1.6, label="measured")
    upper.plot(t, before, color="#c1272d", linewidth=1, label="plain linear simulation")
    upper.plot(t, after, color="#0b62a4", linewidth=1, label="with Coulomb friction, 24.9 mm/s²")
    upper.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False)
    lower.plot(t, y - before, color="#c1272d", linewidth=1)
    lower.plot(t, y - after, color="#0b62a4", linewidth=1)
    upper.set_ylabel("x in mm")
    lower.set_ylabel("error in mm")
    lower.set_xlabel("time in s")
    figure.savefig(Path(__file__).with_name("stage.svg"), metadata={"Date": None})


if __name__ == "__main__":
    main()
