"""What an identification returns: the model, its coefficients with standard errors, and its warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from simgap.baselines.estimation.levenberg import Minimum
from simgap.baselines.estimation.orders import Orders
from simgap.baselines.estimation.polynomial import Polynomial


@dataclass(frozen=True, eq=False)
class Row:
    """The equation of one output: coefficient names, values [p], covariance [p, p] and residual variance."""

    names: tuple[str, ...]
    values: Float[np.ndarray, " p"]
    covariance: Float[np.ndarray, "p p"]
    variance: float
    rank: int
    converged: bool = True

    @classmethod
    def at(cls, minimum: Minimum, names: Sequence[str], which: Sequence[int], samples: int) -> Row:
        """Take the coefficients `which` of a least-squares minimum, with covariance variance * (J' J)^-1."""
        cost, theta = minimum.cost, minimum.theta
        variance = cost.squares / max(samples - len(theta), 1)
        scale = np.sqrt(np.diag(cost.hessian))
        scale[scale == 0] = 1.0
        values, vectors = np.linalg.eigh(cost.hessian / scale / scale[:, None])
        significant = values > len(theta) * 1e-14 * values[-1]  # what is less is rounding of J' J
        inverse = (vectors[:, significant] / values[significant]) @ vectors[:, significant].T / scale / scale[:, None]
        covariance = (variance * inverse)[np.ix_(which, which)]
        # A constant that cannot be told from the start state is no reason to doubt the coefficients.
        rank = len(which) - max(0, int((~significant).sum()) - (len(theta) - len(which)))
        return cls(tuple(names), theta[which], covariance, variance, rank, minimum.converged)

    @property
    def standard_errors(self) -> Float[np.ndarray, " p"]:
        """One standard deviation of each estimate."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))


@dataclass(frozen=True, eq=False)
class LinearFit:
    """An identified linear model, one `Row` per output, from `samples` samples.

    `constants` [ny] is what each equation adds for an operating point away from that of the estimation.
    """

    polynomial: Polynomial
    orders: Orders
    rows: tuple[Row, ...]
    constants: Float[np.ndarray, " ny"]
    samples: int

    @property
    def operating_point(self) -> Float[np.ndarray, " S"]:
        """The levels of outputs, then inputs, around which the model has no constant."""
        return np.concatenate((self.polynomial.y_mean, self.polynomial.u_mean))

    @property
    def n_params(self) -> int:
        """How many coefficients were estimated."""
        return sum(len(row.values) for row in self.rows)

    def criterion(self, penalty: float, samples: int) -> float:
        """Compute sum_i N log(V_i) + penalty * p: AIC for penalty 2, BIC for log N (Ljung 1999, section 16.4).

        N is the same for all that are compared, though a higher order leaves fewer samples to estimate from: else the
        unit of the output would decide.
        """
        variances = [row.variance * max(1 - len(row.values) / self.samples, 1e-9) for row in self.rows]
        return float(samples * np.sum(np.log(np.maximum(variances, 1e-300)))) + penalty * self.n_params

    def complaints(self) -> list[str]:
        """List why the coefficients or the free run may be useless: what to know before trusting the model."""
        complaints = []
        if not all(row.converged for row in self.rows):
            complaints.append("the search stopped before the error was at its minimum; try a lower order")
        weak = next((row for row in self.rows if row.rank < len(row.values)), None)
        if weak:
            complaints.append(
                f"only {weak.rank} of {len(weak.values)} coefficients can be told apart: the input does not excite the "
                f"rest, or the order is higher than the data ask for; lower it or use a richer input"
            )
        radius = float(np.abs(self.polynomial.poles).max(initial=0.0))
        # Integrators are identified as poles at 1 give or take noise; they grow like t, not exponentially.
        if radius > 1 + 1e-3:
            tenfold = self.polynomial.dt * np.log(10) / np.log(radius)
            complaints.append(
                f"the identified model is unstable: a pole of magnitude {radius:.4g} makes a free run grow tenfold "
                f"every {tenfold:.3g} s; try another order, simulation error (oe), or data without feedback"
            )
        return complaints

    def table(self, outputs: Sequence[str]) -> str:
        """Format every coefficient with its standard error, under the names of the outputs."""
        lines = []
        for output, row in zip(outputs, self.rows, strict=True):
            lines.append(f"{output}: residual standard deviation {np.sqrt(row.variance):.4g}")
            for name, value, error in zip(row.names, row.values, row.standard_errors, strict=True):
                lines.append(f"  {name:<8} {value:>12.6g} +- {error:.2g}")
        return "\n".join(lines)


def moved_operating_point(
    a: Float[np.ndarray, "N1 ny ny"],
    b: Float[np.ndarray, "N1 ny nu"],
    constant: Float[np.ndarray, " ny"],
    shift: Float[np.ndarray, " S"],
    spread: Float[np.ndarray, " S"],
) -> tuple[Float[np.ndarray, " ny"], Float[np.ndarray, " nu"]]:
    """Find y_mean and u_mean that absorb the constant of A(q) (y - y_0) = B(q) (u - u_0) + constant.

    The smallest move from `shift`, in units of `spread`, with A(1) dy - B(1) du = constant; it exists for an
    integrator, too, where A(1) = 0.
    """
    ny = a.shape[1]
    if not constant.any():
        return shift[:ny], shift[ny:]
    gains = np.hstack((a.sum(axis=0), -b.sum(axis=0))) * spread  # [ny, ny + nu]
    moved = shift + spread * (np.linalg.pinv(gains) @ constant)
    return moved[:ny], moved[ny:]
