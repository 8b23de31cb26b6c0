"""Orders na nb nc nd nf nk in the toolbox convention, for one or several inputs and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Int

from simgap.records import UnusableInput

# One number for every pair of channels, or a matrix with a row per output.
Order = int | Sequence[Sequence[int]] | Sequence[int]


@dataclass(frozen=True, eq=False)
class Orders:
    """na [ny, ny], nb [ny, nu], nk [ny, nu], nc [ny], nf [ny, nu], nd [ny]: how many past samples enter each equation.

    A(q) = 1 + a_1 q^-1 + .. + a_na q^-na,  B(q) = b_1 q^-nk + .. + b_nb q^-(nk+nb-1),  C(q) = 1 + c_1 q^-1 + ..
    so that ARX321 is na = 3, nb = 2, nk = 1 and ARMAX2221 is na = nb = nc = 2, nk = 1 (Ljung 1999, section 4.2).
    F(q) divides B(q) in an output-error model, which has neither A nor C; D(q) divides C(q) in a Box-Jenkins model.
    """

    na: Int[np.ndarray, "ny ny"]
    nb: Int[np.ndarray, "ny nu"]
    nk: Int[np.ndarray, "ny nu"]
    nc: Int[np.ndarray, " ny"]
    nf: Int[np.ndarray, "ny nu"]
    nd: Int[np.ndarray, " ny"]

    @classmethod
    def of(
        cls,
        ny: int,
        nu: int,
        na: Order = 0,
        nb: Order = 0,
        nk: Order = 0,
        nc: Order = 0,
        nf: Order = 0,
        nd: Order = 0,
    ) -> Orders:
        """Spread plain numbers over all pairs of channels. Raises UnusableInput for a wrong shape or sign."""
        orders = cls(
            na=_spread("na", na, (ny, ny)),
            nb=_spread("nb", nb, (ny, nu)),
            nk=_spread("nk", nk, (ny, nu)),
            nc=_spread("nc", nc, (ny,)),
            nf=_spread("nf", nf, (ny, nu)),
            nd=_spread("nd", nd, (ny,)),
        )
        if not (orders.na.any() or orders.nb.any()):
            raise UnusableInput("na and nb are both zero; a model needs at least one coefficient")
        return orders

    @property
    def max_lag(self) -> int:
        """The oldest measured sample in any equation."""
        return int(max(self.na.max(), np.where(self.nb > 0, self.nb + self.nk - 1, 0).max()))

    @property
    def state(self) -> int:
        """How many past samples the model's state holds."""
        return int(max(self.max_lag, self.nc.max()))

    def lagged(self, row: int) -> list[tuple[int, int]]:
        """List (signal, lag) of every regressor of output `row`; outputs are signals 0..ny-1, inputs follow."""
        ny = len(self.na)
        past = [(j, k) for j in range(ny) for k in range(1, self.na[row, j] + 1)]
        for j in range(self.nb.shape[1]):
            past += [(ny + j, int(self.nk[row, j]) + k) for k in range(self.nb[row, j])]
        return past

    def as_dict(self) -> dict[str, object]:
        """Give plain numbers where all channels agree, for tables and results."""
        named = {"na": self.na, "nb": self.nb, "nc": self.nc, "nd": self.nd, "nf": self.nf, "nk": self.nk}
        return {
            name: int(value.flat[0]) if np.all(value == value.flat[0]) else value.tolist()
            for name, value in named.items()
            if name in ("nb", "nk") or value.any()
        }


def check_limits(model: Any) -> None:
    """Raise UnusableInput where a limit of a search, `max_..`, or an order that was asked for is below 1."""
    for name, limit in vars(model).items():
        if (name.startswith("max_") or name == "order") and isinstance(limit, int) and limit < 1:
            raise UnusableInput(f"{name} is {limit}; give a whole number from 1")


def _spread(name: str, value: Order, shape: tuple[int, ...]) -> np.ndarray:
    orders = np.asarray(value)
    if orders.dtype.kind not in "iu" or (orders.size and orders.min() < 0):
        raise UnusableInput(f"{name} = {value} is not an order; give whole numbers from 0")
    if orders.ndim and orders.shape != shape:
        raise UnusableInput(f"{name} has shape {orders.shape}; give one number, or a matrix of shape {shape}")
    return np.broadcast_to(orders, shape).astype(int)
