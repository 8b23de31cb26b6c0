"""Findings about a cart, one for each verdict, and one whose every string is hostile; shared by two files of tests."""

from dataclasses import replace

import numpy as np
import pytest

from simgap.error_views.wrong import Wrong
from simgap.findings import Budget, Cause, Findings, Gain, Offer, Profile, Separation, Trace, Value

HOSTILE = (
    "</script><script>alert(1)</script><img src=x onerror=alert(2)><a href='http://e.example'>\x1b[2J\u202e&lt;{{7*7}}"
)


@pytest.fixture
def named() -> Findings:
    """A cart with dry friction, three test experiments of 400 samples."""
    t = np.arange(5, 405) * 0.05
    traces = []
    for i, size in enumerate((1.0, 2.0, 0.5)):
        y = np.sin(t + i)[:, None]
        traces.append(Trace(f"test_{i}", t, np.cos(t)[:, None], y, y + size * np.sign(np.cos(t))[:, None], y + 0.1))
    cause = Cause(
        "coulomb_friction", "Coulomb friction", "Dry friction: a force of constant size against the motion.",
        "Armstrong-Helouvry 1994", "", evidence=0.91, gain=0.62, log_likelihood_ratio=412.0,
        parameters=(Value("friction force", "mm/s^2", 6.8432, 6.7112, 6.9743),),
        confounded_with=(
            Separation("backlash", "backlash", "stop and start again in the same direction: play is already taken up"),
        ),
        shows_in=("sign of velocity",),
        profiles=(Profile("friction force", "mm/s^2", (6.6, 6.7, 6.84, 7.0, 7.1), (13.0, 4.6, 0.0, 5.2, 15.0)),),
    )  # fmt: skip
    return Findings(
        dataset="cart",
        verdict="named",
        baseline={"order": 2, "rmse": {"x": 1.2402}, "fit_percent": {"x": 81.2}},
        wrong=(
            Wrong("sign of velocity", "x", 0.61, 0.001, "The simulation of x is 0.8 mm too high when moving forwards: "
                  "61 % of its squared error.", (-1.0, 1.0), (0.7, -0.8), ""),
            Wrong("velocity", "x", 0.22, 0.001, "The simulation of x is too high at high speed: 22 % of its squared "
                  "error.", (-2.0, 0.1, 2.1), (0.4, 0.0, -0.5), "mm/s"),
        ),
        causes=(cause,),
        runner_up={"effect": "viscous_drag", "title": "Viscous drag", "gain": 0.21, "margin": 35.2},
        gain=Gain({"x": 1.2402}, {"x": 0.768}, 0.3807, 0.33, 0.43),
        seconds=3.1,
        units={"x": "mm"},
        inputs=(("force", "N"),),
        kinds={"x": "position"},
        checks=("Only 150 training samples: weak effects cannot be told from noise.",),
        traces=tuple(traces),
        budget=(Budget("x", {"coulomb_friction": 0.617}, 0.13, 0.1, 0.153),),
    )  # fmt: skip


@pytest.fixture
def nothing_found(named) -> Findings:
    """The same cart, and the plain model suffices."""
    same = replace(named.gain, after=named.gain.before, share=0.0, low=0.0, high=0.0)
    traces = tuple(replace(trace, after=trace.before) for trace in named.traces)
    budget = (Budget("x", {}, 0.0, None, 1.0),)
    return replace(named, verdict="nothing_found", causes=(), runner_up=None, gain=same, traces=traces, budget=budget)


@pytest.fixture
def suspected(named) -> Findings:
    """The same cart, whose test experiments do not show whether the friction is there."""
    decide = "record more and longer test experiments at several speeds, slow and fast"
    suspects = (replace(named.causes[0], confounded_with=(), deciding_experiment=decide),)
    gain = replace(named.gain, after={"x": 1.1}, share=0.113, low=-0.05, high=0.27)
    return replace(
        named, verdict="suspected", causes=(), suspects=suspects, gain=gain, budget=(Budget("x", {}, 0.3, 0.1, 0.6),)
    )


@pytest.fixture
def unexplained(nothing_found) -> Findings:
    """The same cart with a force that no effect has."""
    offer = Offer("x", "force ~ +1 x^3 -0.2 v", 0.44, "relative")
    return replace(nothing_found, verdict="unexplained", left=0.27, offers=(offer,))


@pytest.fixture
def hostile(unexplained, named) -> Findings:
    """Every string that a data set or somebody's effect can bring is hostile."""
    x = HOSTILE
    cause = named.causes[0]
    cause = replace(
        cause, title=x, text=x, reference=x, channel=x, effect=x,
        parameters=tuple(replace(p, name=x, unit=x) for p in cause.parameters),
        confounded_with=(Separation(x, x, x),),
        profiles=tuple(replace(p, name=x, unit=x) for p in cause.profiles),
    )  # fmt: skip
    bins = (Wrong("input", x, 0.1, 0.0, x, (0.0, 1.0), (1.0, 2.0), x, channel=x),)
    return replace(
        unexplained,
        dataset=x,
        verdict="named",
        baseline={"order": 2, "rmse": {x: 1.0}, "fit_percent": {x: 2.0}},
        causes=(cause,),
        wrong=tuple(replace(view, output=x, text=x, unit=x) for view in named.wrong) + bins,
        runner_up={"effect": x, "title": x, "gain": 0.1, "margin": 2.0},
        gain=replace(named.gain, before={x: 1.0}, after={x: 0.5}),
        units={x: x},
        inputs=((x, x),),
        kinds={x: "position"},
        checks=(x,),
        offers=(Offer(x, x, 0.1, x),),
        traces=tuple(replace(trace, experiment=x) for trace in named.traces),
        budget=(Budget(x, {x: 0.5}, 0.2, 0.1, 0.2),),
    )
