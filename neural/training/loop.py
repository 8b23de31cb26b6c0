"""Training by the paper's protocol (section 3.5), which carries on where it was interrupted."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor, nn

from simgap.neural.training.blocks import Block
from simgap.neural.training.checkpoints import Checkpoint
from simgap.neural.training.examples import Examples
from simgap.neural.training.linear import Diagonal, Filters
from simgap.neural.training.state_space import StateSpace

# Windows or pieces whose error is computed at once, after an epoch, and at the end: the paper's 24,160 to train on and
# 5,400 to validate on are all among them.
AT_ONCE = 256
AFTER_AN_EPOCH = 6000
AT_THE_END = 30_000
# Layers whose weights L2 keeps small, but those that say how long a layer remembers, which it would shorten.
DECAYED = nn.RNNBase | nn.Conv1d | Diagonal | Filters | StateSpace
MEMORY = ("weight_hh", "nu", "theta", "gamma", "weight_den", "radius", "angle")


class NotANumber(ArithmeticError):
    """The loss grew beyond all bounds."""


@dataclass(frozen=True)
class Recipe:
    """Adam (Kingma and Ba 2015) on the MSE; learning rate halved on a plateau of the training loss; early stop.

    patience: epochs without a better training loss before the rate is halved; early_stop: epochs without a better
    validation loss before training ends; the weights of the best validation loss are kept. l2 is the coefficient of
    the squared weights of recurrent, convolutional and linear dynamic layers that is added to the loss.
    """

    epochs: int
    batch: int
    learning_rate: float
    patience: int
    early_stop: int
    l2: float = 0.0
    improvement: float = 1e-4  # of the training loss that counts; Keras' default
    batches: int = 0  # per epoch; 0 for all examples


@dataclass
class History:
    """What happened, epoch by epoch; losses on scaled data, the training loss a mean over the epoch, as in Keras."""

    train: list[float] = field(default_factory=list)
    valid: list[float] = field(default_factory=list)
    rate: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    earlier: float = 0.0  # seconds of an interrupted training that this one carried on

    @property
    def lists(self) -> dict[str, list[float]]:
        """What is known of every epoch."""
        return {"train": self.train, "valid": self.valid, "rate": self.rate, "seconds": self.seconds}

    @property
    def best(self) -> int:
        """Number of the epoch with the lowest validation loss, from 1."""
        return 1 + self.valid.index(min(self.valid))


def optimiser(net: nn.Module, recipe: Recipe) -> torch.optim.Adam:
    """Make Adam with weight decay 2 l2, the gradient of l2 w^2, on input, convolution and filter weights."""
    decayed = {
        id(p) for m in net.modules() if recipe.l2 and isinstance(m, DECAYED)
        for name, p in m.named_parameters() if not name.startswith(MEMORY)
    }  # fmt: skip
    groups = [
        {"params": [p for p in net.parameters() if id(p) in decayed], "weight_decay": 2 * recipe.l2},
        {"params": [p for p in net.parameters() if id(p) not in decayed]},
    ]
    return torch.optim.Adam([g for g in groups if g["params"]], lr=recipe.learning_rate, fused=True)


@contextmanager
def exact_on_a_gpu() -> Iterator[None]:
    """Let cuDNN compute in single precision, as a CPU does, not in TF32; and the same each time from the same seed."""
    with torch.backends.cudnn.flags(enabled=True, deterministic=True, allow_tf32=False):
        yield


@exact_on_a_gpu()
def train(
    net: Block, examples: Examples, held_out: Examples, recipe: Recipe, seed: int, device: str = "cpu",
    checkpoint: Path | None = None, tell: Callable[[int, History], None] = lambda epoch, history: None,
) -> History:  # fmt: skip
    """Train in place; afterwards the network has the weights of its best epoch. Raises NotANumber."""
    net.to(device)
    adam = optimiser(net, recipe)
    parameters = list(net.parameters())
    order = torch.Generator().manual_seed(seed)
    history = History()
    best = {name: value.clone() for name, value in net.state_dict().items()}
    state = Checkpoint(checkpoint, net, adam, best, order, history.lists)
    if state.restore():
        history.earlier = sum(history.seconds)
    while len(history.valid) < recipe.epochs and not _hopeless(history, recipe):
        begin = time.perf_counter()
        net.train()
        losses = []
        batches = _shuffled(len(examples), recipe, order)
        for chosen in batches:
            x, y = (part.to(device) for part in examples.batch(chosen))
            for p in parameters:
                p.grad = None
            loss = nn.functional.mse_loss(examples.answer(net, x), y)
            loss.backward()
            adam.step()
            losses.append(loss.detach())
        sizes = torch.tensor([len(chosen) for chosen in batches], dtype=torch.double)
        history.train.append(float(torch.stack(losses).cpu().double() @ sizes / sizes.sum()))
        history.valid.append(error(net, held_out, device))
        history.rate.append(adam.param_groups[0]["lr"])
        history.seconds.append(time.perf_counter() - begin)
        if not math.isfinite(history.train[-1] + history.valid[-1]):
            raise NotANumber(f"the loss is not a number after epoch {len(history.valid)}; choose a lower learning rate")
        if history.best == len(history.valid):
            for name, value in net.state_dict().items():
                best[name].copy_(value)
        if _plateau(history, recipe):
            for group in adam.param_groups:
                group["lr"] *= 0.5
        state.save()
        tell(len(history.valid), history)
    net.load_state_dict(best)
    net.to("cpu").eval()
    return history


def _shuffled(examples: int, recipe: Recipe, order: torch.Generator) -> tuple[Tensor, ...]:
    """Draw the batches of an epoch: all examples once, or as many as the recipe says in repeated rounds."""
    wanted = recipe.batches * recipe.batch or examples
    rounds = [torch.randperm(examples, generator=order) for _ in range(-(-wanted // examples))]
    return torch.cat(rounds)[:wanted].split(recipe.batch)


def error(net: Block, examples: Examples, device: str = "cpu") -> float:
    """Compute the mean square error on scaled data, without dropout."""
    return float(
        torch.cat(
            [(answer - y).square().flatten() for answer, y in _answers(net, examples, AFTER_AN_EPOCH, device)]
        ).mean()
    )


def figures(net: Block, examples: Examples) -> dict[str, float]:
    """Compute MSE, MAE and R2 on scaled data; R2 is the mean over the outputs, as in scikit-learn and Keras."""
    answers, targets = zip(*_answers(net, examples, AT_THE_END), strict=True)
    y = torch.cat([part.flatten(0, -2) for part in targets]).double()
    e = torch.cat([part.flatten(0, -2) for part in answers]).double() - y
    explained = 1 - e.square().sum(0) / (y - y.mean(0)).square().sum(0).clamp(min=1e-300)
    return {"mse": float(e.square().mean()), "mae": float(e.abs().mean()), "r2": float(explained.mean())}


def _answers(net: Block, examples: Examples, at_most: int, device: str = "cpu") -> Iterator[tuple[Tensor, Tensor]]:
    """Yield outputs and targets of all examples, or of `at_most`, evenly spread."""
    net.eval()
    chosen = torch.linspace(0, len(examples) - 1, min(len(examples), at_most), dtype=torch.double).round().long()
    for part in chosen.split(AT_ONCE):
        x, y = (values.to(device) for values in examples.batch(part))
        with torch.no_grad():
            yield examples.answer(net, x), y


def _hopeless(history: History, recipe: Recipe) -> bool:
    return bool(history.valid) and len(history.valid) - history.best >= recipe.early_stop


def _plateau(history: History, recipe: Recipe) -> bool:
    """Return whether the training loss has not fallen for `patience` epochs since the rate was last halved."""
    last = history.rate[-1]
    since = [loss for loss, rate in zip(history.train, history.rate, strict=True) if rate == last]
    best = min(history.train[: len(history.train) - len(since)], default=math.inf)
    waited = 0
    for loss in since:
        if loss < best - recipe.improvement:
            best, waited = loss, 0
        else:
            waited += 1
    return waited >= recipe.patience


def range_test(
    net: Block,
    examples: Examples,
    batch: int,
    low: float = 1e-8,
    high: float = 1.0,
    steps: int = 400,
    seed: int = 0,
    device: str = "cpu",
) -> tuple[Float[Tensor, " n"], Float[Tensor, " n"]]:
    """Give rates and losses while the learning rate grows from batch to batch (paper, 3.4; Smith 2017).

    Ends early when the loss is ten times the lowest one.
    """
    net.to(device)
    adam = optimiser(net, Recipe(1, batch, low, 1, 1))
    order = torch.Generator().manual_seed(seed)
    rates, losses = torch.logspace(math.log10(low), math.log10(high), steps), []
    net.train()
    for rate in rates:
        for group in adam.param_groups:
            group["lr"] = float(rate)
        chosen = torch.randint(len(examples), (batch,), generator=order)
        x, y = (part.to(device) for part in examples.batch(chosen))
        adam.zero_grad()
        loss = nn.functional.mse_loss(examples.answer(net, x), y)
        loss.backward()
        adam.step()
        losses.append(float(loss.detach()))
        if not math.isfinite(losses[-1]) or losses[-1] > 10 * min(losses):
            break
    return rates[: len(losses)], torch.tensor(losses)
