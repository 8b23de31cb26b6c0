"""Numbers that a fit cannot take, each refused in a sentence; whatever passes here ends in an answer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simgap.records import Channels, Experiment, UnusableInput

# Powers of a signal, and of a rate up to the order of a plant, must stay numbers.
LARGEST_SIGNAL = 1e30
LONGEST_SAMPLE = 1e12  # s


def check_numbers(experiments: Sequence[Experiment], channels: Channels) -> None:
    """Raise UnusableInput for an empty record, and for signals or times in units far from those of a machine."""
    for x in experiments:
        if not len(x):
            raise UnusableInput(f"{x.name} has no samples; leave it out")
        if not 1 / LONGEST_SAMPLE <= x.dt <= LONGEST_SAMPLE:
            raise UnusableInput(
                f"{x.name}: the sampling time is {x.dt:.3g} s; a fit takes {1 / LONGEST_SAMPLE:g} to "
                f"{LONGEST_SAMPLE:g} s, so count time in another unit"
            )
    for column, listed in (("u", channels.inputs), ("y", channels.outputs)):
        largest = [np.max(np.abs(getattr(x, column)), axis=0) for x in experiments]  # of each experiment, [n]
        for i, channel in enumerate(listed):
            x = max(range(len(experiments)), key=lambda k, i=i: largest[k][i])
            size = float(largest[x][i])
            if size > LARGEST_SIGNAL or 0 < size < 1 / LARGEST_SIGNAL:
                raise UnusableInput(
                    f"{experiments[x].name}: {channel.name} is at most {f'{size:.3g} {channel.unit}'.rstrip()}; a fit "
                    f"takes {1 / LARGEST_SIGNAL:g} to {LARGEST_SIGNAL:g}, so give it in another unit"
                )
