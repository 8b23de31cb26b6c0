"""From a fitted search to causes: what each explains, how sure it is, and what it may be confused with."""

from __future__ import annotations

from typing import Any

from simgap.findings import Cause, Profile, Separation, Value
from simgap.records import Channels
from simgap.registry import EFFECTS

# Two sets of effects whose scores (log-likelihood, less what the parameters cost) differ by less are not told apart.
CONFOUNDED = 6.0


def causes_of(model: Any, channels: Channels, profiles: bool) -> tuple[Cause, ...]:
    """The named effects of all plants, in the order of what they explain."""
    found = []
    for part in model.parts():
        for named in part.named():
            effect = named.term.effect
            rivals = [rival for rival in part.rivals(named.term) if rival.behind < CONFOUNDED]
            found.append(
                Cause(
                    effect.name,
                    effect.title,
                    effect.describe({p.name: p.value for p in named.parameters}),
                    effect.reference,
                    part.channel(named.term, channels),
                    evidence=named.evidence,
                    gain=named.gain,
                    log_likelihood_ratio=named.log_likelihood_ratio,
                    parameters=tuple(Value(p.name, p.unit, p.value, p.low, p.high) for p in named.parameters),
                    per_experiment=effect.per_experiment,
                    confounded_with=tuple(separation(effect, EFFECTS[rival.name]()) for rival in rivals),
                    shows_in=effect.shows_in,
                    profiles=tuple(Profile(*p) for p in part.profiles(named.term)) if profiles else (),
                )
            )
    return tuple(sorted(found, key=lambda cause: -cause.evidence))


def separation(effect: Any, other: Any) -> Separation:
    """The experiment that would tell two effects apart, as either of them knows it."""
    experiment = effect.twins.get(other.name) or other.twins.get(effect.name)
    if not experiment:
        shows = " and ".join(dict.fromkeys(effect.shows_in[:1] + other.shows_in[:1]))
        experiment = f"vary the amplitude and the speed of the input more, and look at the error against {shows}"
    return Separation(other.name, other.title, experiment)


def runner_up(model: Any) -> dict[str, Any] | None:
    """The best single effect that was not named, and how far it stayed behind."""
    rivals = [rival for part in model.parts() for rival in part.runners_up()]
    if not rivals:
        return None
    best = max(rivals, key=lambda rival: rival.gain)
    title = EFFECTS[best.name].title
    return {"effect": best.name, "title": title, "gain": best.gain, "margin": best.behind}
