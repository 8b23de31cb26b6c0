"""Texts that several formats share."""

from __future__ import annotations

from collections.abc import Iterable

from simgap.exports.subjects import Subject
from simgap.records import Channels

A_LINE = 5  # numbers
FEW = 4


def heading(subject: Subject) -> str:
    """Say in one line what was exported; plain ASCII without quotes, so that it fits into a comment of any language."""
    return plain(f"{subject.name}, fitted on {subject.fitted_on.dataset} by simgap.")


def plain(text: str) -> str:
    """Leave of a text what is safe in a comment of any language."""
    return "".join(c if c.isascii() and (c.isalnum() or c in " .,:;+-_()[]=") else "?" for c in text)


def numbers(values: Iterable[float], indent: str = "    ") -> str:
    """Write numbers so that no bit is lost, several on a line."""
    texts = [repr(float(value)) for value in values]
    if len(texts) <= FEW:
        return ", ".join(texts)
    lines = [", ".join(texts[i : i + A_LINE]) for i in range(0, len(texts), A_LINE)]
    return "\n" + "".join(f"{indent}{line},\n" for line in lines)


def variable_names(channels: Channels) -> tuple[list[str], list[str]]:
    """Name inputs and outputs so that no two are the same."""
    inputs, outputs = ([c.name for c in part] for part in (channels.inputs, channels.outputs))
    twice = {*inputs} & {*outputs}
    return inputs, [f"{name} (output)" if name in twice else name for name in outputs]
