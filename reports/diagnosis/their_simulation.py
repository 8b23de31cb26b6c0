"""Words for a diagnosis of somebody's simulation, in the place of those about the plain linear model."""

from __future__ import annotations

from collections.abc import Iterator

from simgap.findings import Cause, Findings, Value
from simgap.reports.diagnosis import numbers
from simgap.wording import amount, number, percent

HARDLY = 0.1  # of the plain model's squared error
HOLDS = {
    "missing": "Your simulation does not have it.",
    "other size": "Your simulation has it, in another size.",
    "not in the machine": "Your simulation has it, and the records do not show it in the machine.",
}


def model_of(findings: Findings) -> str:
    """Name the model whose error is diagnosed."""
    return "your simulation" if findings.simulation else "plain linear model"


def owner_of(findings: Findings) -> str:
    """Name it in the genitive, as the owner of an error."""
    return "your simulation's" if findings.simulation else "the plain model's"


def nothing_found(findings: Findings) -> str:
    """Say in a sentence that no effect is missing, or none but the right numbers of somebody's linear part."""
    if not findings.simulation:
        better = "no effect of the catalogue makes the plain linear model simulate these data better"
        learnable = max((budget.learnable for budget in findings.budget), default=0.0)
        if learnable > HARDLY:
            return (
                f"Nothing is named: {better}, although {percent(learnable)} of its squared error on the test "
                "experiments can be learned from the input."
            )
        fits = findings.baseline.get("fit_percent", {}).values()
        worse = " The mean of the output would be a better guess than this model." if any(f < 0 for f in fits) else ""
        return f"Nothing found: {better}, and hardly any of its error can be learned from the input.{worse}"
    if not findings.simulation.linear_differs:
        return "Nothing found: your simulation lacks nothing that these data show."
    return (
        "Your simulation lacks no effect that these data show, but the parameters of its linear part are not those of "
        f"the machine; corrected, its free-run error on the test experiments falls by {percent(findings.gain.share)}."
    )


def errors(findings: Findings) -> Iterator[str]:
    """Tell the errors of each output on test and training experiments."""
    assert findings.simulation is not None
    for name, of in findings.simulation.errors.items():
        unit = findings.units.get(name, "")
        for split, called in (("test", "test experiments"), ("train", "training experiments")):
            rmse, mae = amount(of[split]["rmse"], unit), amount(of[split]["mae"], unit)
            yield f"{name}, {called}: RMSE {rmse}, mean absolute error {mae}"


def evidence(cause: Cause) -> str:
    """Say how the simulation holds the effect, and how large an error that makes by itself."""
    assert cause.holds is not None
    made = f"By itself this makes {percent(cause.evidence)} of your simulation's squared error in training."
    if cause.evidence > 1:
        made = (
            "By itself this would make a larger error than your simulation has: its other parameters make up for part "
            "of it."
        )
    return f"{HOLDS[cause.holds]} {made}"


def simulated(cause: Cause, parameter: Value) -> str:
    """Tell the simulation's own value of a parameter; empty where it has none."""
    if parameter.name not in cause.simulated:
        return ""
    return f"; in your simulation {number(cause.simulated[parameter.name])} {parameter.unit}".rstrip()


def linear_part(findings: Findings) -> list[str]:
    """List the numbers of the linear part where they are wrong, and what that makes of the error."""
    about = findings.simulation
    if about is None or not about.linear_differs:
        return []
    share = percent(min(about.linear_share, 1.0))
    lines = [f"By themselves, wrong parameters make {share} of your simulation's squared error in training."]
    for n in about.linear:
        value = Value(n.name, n.unit, n.value, n.low, n.high)
        said = f"{n.name} = {numbers.estimate(value)} ({numbers.interval(value)})"
        lines.append(f"{said}; in your simulation {number(n.simulated)} {n.unit}".rstrip())
    return lines
