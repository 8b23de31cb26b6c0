"""What to say of outputs whose kind nobody said: what each is taken for, and where the answer hangs on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from shlex import quote

from simgap.findings import Cause, Separation
from simgap.greybox.identification import Identified
from simgap.records import Channel, Channels, Kind

CALLED = {"position": "a position", "velocity": "a velocity", "level": "a level", "other": "anything else"}


def taken_for(identified: Sequence[Identified], channels: Channels) -> tuple[str, ...]:
    """Say in a sentence for what each output is taken that nobody said anything of."""
    as_well = {one.selection.baseline.outputs[0]: one.settled.as_well for one in identified if one.settled}
    return tuple(
        _taken_for(channel, as_well.get(i, ()))
        for i, channel in enumerate(channels.outputs)
        if channel.kind_from == "evidence"
    )


def _taken_for(channel: Channel, as_well: Sequence[Kind]) -> str:
    if channel.kind == "other":
        return (
            f"Nobody says what {channel.name} is, and the records do not show a position, a velocity or a level: where "
            f"it is one, say so with --kind {quote(channel.name)}=position, velocity or level."
        )
    claims = [CALLED[kind] for kind in as_well if kind != "other"]
    why = (
        f"which is simpler than {' or '.join(claims)} and does as well"
        if claims
        else "because the records speak for it"
    )
    return (
        f"{channel.name} is taken as {CALLED[channel.kind]}, {why}: where it is anything else, say so with "
        f"--kind {quote(channel.name)}=position, velocity, level or other."
    )


def undecided(identified: Sequence[Identified], channels: Channels) -> tuple[str, ...]:
    """Say where nothing is named, but would be if the output were of a kind that the records do not exclude."""
    sentences = []
    for one in identified:
        rivals = one.settled.rivals if one.settled else ()
        if rivals and not one.selection.trial.terms:
            name = channels.outputs[one.selection.baseline.outputs[0]].name
            listed = " and ".join(f"as {CALLED[kind]} it has {effect.title}" for kind, effect in rivals)
            sentences.append(
                f"What {name} is decides the answer, and the records do not show it: {listed}. Say what it is with "
                f"--kind {quote(name)}=position, velocity, level or other."
            )
    return tuple(sentences)


def confounded(causes: list[Cause], one: Identified, channels: Channels) -> list[Cause]:
    """Add to the first cause of a plant the names that it would have if its output were of another kind."""
    rivals = one.settled.rivals if one.settled else ()
    if not causes or not rivals:
        return causes
    first, name = causes[0], channels.outputs[one.selection.baseline.outputs[0]].name
    known = {first.effect, *(other.effect for other in first.confounded_with)}
    more = tuple(
        Separation(effect.name, effect.title, f"say what {name} is with --kind; this is the name for {CALLED[kind]}")
        for kind, effect in rivals
        if effect.name not in known
    )
    return [replace(first, confounded_with=first.confounded_with + more), *causes[1:]]
