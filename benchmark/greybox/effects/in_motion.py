"""What delays and lags have in common in records that do not begin settled."""

from __future__ import annotations

from typing import ClassVar

from simgap.greybox.effects.effect import Effect, Parameter, Start
from simgap.greybox.effects.scales import SignalScales


class InMotion(Effect):
    """A law whose records begin away from where it would settle, by the share of a signal's range that each tells."""

    memory: ClassVar[int] = 1

    def parameters(self, scales: SignalScales) -> tuple[Parameter, ...]:
        """Return those of the settled law, and the range of the input or the reading."""
        of_input = self.port == "input"
        low, high = (scales.u_low, scales.u_high) if of_input else (scales.y_low, scales.y_high)
        name, unit = ("input", scales.u_unit) if of_input else ("reading", scales.y_unit)
        reach = Parameter(f"range of the {name}", unit, high - low, high - low, fixed=True, told=False)
        return (*super().parameters(scales), reach)

    def starts(self, scales: SignalScales) -> list[Start]:
        """Start from where the settled law does."""
        reach = self.parameters(scales)[-1].low
        return [Start((*start.values, reach)) for start in super().starts(scales)]
