"""What every neural model shares: it is scaled, trained, simulated and stored in one way."""

from __future__ import annotations

import copy
import hashlib
import math
import os
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import torch
from jaxtyping import Float

from simgap.neural.training import checkpoints, graph, sequences, stepping, weights, windows
from simgap.neural.training.blocks import Block
from simgap.neural.training.examples import Examples
from simgap.neural.training.loop import DECAYED, History, NotANumber, Recipe, figures, range_test, train
from simgap.neural.training.scaling import Scaling, features, scalings
from simgap.neural.training.threads import one_thread
from simgap.protocol import progress
from simgap.records import TrainingSet, UnusableInput
from simgap.step_form import StepForm

WINDOWED = Recipe(epochs=30, batch=32, learning_rate=1e-4, patience=1, early_stop=10)
# Chosen on validation data: networks have not learnt in 30 epochs what longer records can teach them.
STATEFUL = Recipe(epochs=300, batch=32, learning_rate=3e-3, patience=15, early_stop=60, improvement=0.0, batches=60)
# Free runs of held-out data on which the best epoch is chosen: samples of each, and how many.
HELD_OUT = (1000, 32)
# Samples that are simulated at once.
AT_ONCE = 20_000


@dataclass
class Network(ABC):
    """A neural model; a subclass has one method, `net`.

    mode "windowed" is the paper's: `window` samples of time and input in, the next outputs out, no state, no measured
    output; Adam 1e-4, batch 32, at most `epochs` epochs, sections 3.4 and 3.5. At most `batches` batches make an epoch
    (0: all windows). Mode "stateful": the network reads n_init measured samples and then runs free, trained on pieces
    of experiments. device "cpu", "cuda" or "mps" trains; simulation is always in double precision on the CPU, so that
    an experiment does not depend on those beside it. resident=False trains on windows without a copy of the data in
    memory. log: folder for TensorBoard. Raises UnusableInput.
    """

    stochastic: ClassVar[bool] = True
    parts: ClassVar = (Scaling,)  # records in a saved model
    stateful: ClassVar[Recipe] = STATEFUL
    free: ClassVar[int] = sequences.FREE  # samples of a free run in training, of records ten times as long

    mode: Literal["windowed", "stateful"] = "stateful"
    window: int = 40
    epochs: int = 0  # 0, as for the next two: the paper's windowed; stateful what the model says
    batches: int = 0
    learning_rate: float = 0.0
    l2: float = 0.0
    dropout: float = 0.0
    resident: bool = True
    device: str = "cpu"
    log: str = ""
    trained: Block = field(init=False, repr=False)
    of_x: Scaling = field(init=False, repr=False)
    of_y: Scaling = field(init=False, repr=False)
    dt: float = field(init=False, repr=False)
    inputs: int = field(init=False, repr=False)
    earlier_seconds: float = field(default=0.0, init=False, repr=False)
    fitted: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    @abstractmethod
    def net(self, inputs: int, outputs: int) -> Block:
        """Build an untrained network with random weights."""

    @property
    def windowed(self) -> bool:
        """Whether the network sees windows of inputs only."""
        return self.mode == "windowed"

    @property
    def recipe(self) -> Recipe:
        """How this model is trained."""
        usual = WINDOWED if self.windowed else self.stateful
        return replace(usual, epochs=self.epochs or usual.epochs, batches=self.batches or usual.batches, l2=self.l2,
                       learning_rate=self.learning_rate or usual.learning_rate)  # fmt: skip

    def fit(self, data: TrainingSet, seed: int) -> None:
        """Train; carry on from the last epoch of an interrupted run where SIMGAP_CHECKPOINTS names a folder."""
        examples, held_out, net = self.prepare(data, seed)
        checkpoint, recipe = self._checkpoint(data, seed), self.recipe
        writer = _Log(self.log)

        def tell(epoch: int, history: History) -> None:
            progress(epoch, recipe.epochs)
            writer.write(epoch, history)

        with torch.random.fork_rng(devices=[]), one_thread():
            torch.manual_seed(seed)
            try:
                history = train(net, examples, held_out, recipe, seed, self.device, checkpoint, tell)
            except NotANumber:  # and would be again from there
                if checkpoint is not None:
                    checkpoints.remove(checkpoint)
                raise
            scores = figures(net, examples), figures(net, held_out)
            reach = {"reach": windows.reach(net, held_out)} if isinstance(held_out, windows.Windows) else {}
        self.trained, self.earlier_seconds = net, history.earlier
        self.fitted = {
            "epochs": len(history.valid), "best_epoch": history.best, "train": scores[0], "valid": scores[1],
            "train_loss": history.train, "valid_loss": history.valid,
            "seconds_per_epoch": float(np.median(history.seconds)), "device": self.device, **reach,
        }  # fmt: skip
        if checkpoint is not None:
            checkpoints.remove(checkpoint)

    def prepare(self, data: TrainingSet, seed: int) -> tuple[Examples, Examples, Block]:
        """Make the examples to train on and to validate on, and the untrained network."""
        self.check()
        self.dt = data.dt
        nu, ny = len(data.channels.inputs), len(data.channels.outputs)
        self.of_x, self.of_y = scalings(data.train, time=self.windowed)
        valid = data.held_out
        examples: Examples
        held_out: Examples
        if self.windowed:
            options = (self.of_x, self.of_y, self.window, True, self.resident)
            examples, held_out = windows.Windows(data.train, *options), windows.Windows(valid, *options)
            self.inputs = 1 + nu
        else:
            n = data.n_init
            free = self.free if max(map(len, data.train)) >= 10 * self.free else sequences.FREE
            examples = sequences.Sequences(data.train, self.of_x, self.of_y, n, free)
            held_out = sequences.Sequences(valid, self.of_x, self.of_y, n, *HELD_OUT)
            self.inputs = nu + ny + 1
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            net = self.net(self.inputs, ny)
        self._check_use(net)
        return examples, held_out, net

    def _check_use(self, net: Block) -> None:
        """Raise UnusableInput for a regularisation that this network has no layer for."""
        if self.dropout and not any(isinstance(part, torch.nn.Dropout) for part in net.modules()):
            raise UnusableInput(f"dropout is {self.dropout}; this network has no layer with dropout, so leave it out")
        if self.l2 and not any(isinstance(part, DECAYED) for part in net.modules()):
            raise UnusableInput(f"l2 is {self.l2}; this network has no layer that l2 acts on, so leave it out")

    def simulate(
        self, u: Float[np.ndarray, "B T nu"], y_init: Float[np.ndarray, "B n ny"]
    ) -> Float[np.ndarray, "B T-n ny"]:
        """Run free, in double precision."""
        net = copy.deepcopy(self.trained).double()
        at_once = max(1, AT_ONCE // u.shape[1])
        with torch.no_grad(), one_thread():
            parts = [self._some(net, u[i : i + at_once], y_init[i : i + at_once]) for i in range(0, len(u), at_once)]
        return np.concatenate(parts)

    def _some(self, net: Block, u: np.ndarray, y_init: np.ndarray) -> np.ndarray:
        x = torch.from_numpy(self.of_x.inside(np.stack([features(one, self.dt, self.windowed) for one in u])))
        if self.windowed:
            y_hat = windows.simulate(net, x, y_init.shape[1], self.window)
        else:
            y_hat = sequences.simulate(net, x, torch.from_numpy(self.of_y.inside(y_init)))
        return self.of_y.outside(y_hat.numpy())

    def range_test(self, data: TrainingSet, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Give learning rates and the losses while the rate grows from batch to batch (paper, 3.4)."""
        examples, _, net = self.prepare(data, seed)
        with torch.random.fork_rng(devices=[]), one_thread():
            torch.manual_seed(seed)
            rates, losses = range_test(net, examples, self.recipe.batch, seed=seed, device=self.device)
        return rates.numpy().astype(float), losses.numpy().astype(float)

    @property
    def n_params(self) -> int:
        """Number of weights."""
        return sum(p.numel() for p in self.trained.parameters())

    def saved_state(self) -> dict[str, Any]:
        """What a saved model holds of it."""
        return weights.state_of(self)

    @classmethod
    def from_saved(cls, state: dict[str, Any]) -> Any:
        """Build the network that `saved_state` describes. Raises UnusableInput, ValueError, TypeError, RuntimeError."""
        return weights.build(cls, state)

    def step_form(self, nu: int, ny: int) -> StepForm:
        """Write the network as a step, for exports. Raises UnusableInput for parts that have none."""
        return stepping.step_form(self, nu, ny)

    def step_start(self, u: Float[np.ndarray, "T nu"], y_init: Float[np.ndarray, "n ny"]) -> Float[np.ndarray, " ns"]:
        """Return the state of that step before sample n."""
        return stepping.start(self, u, y_init)

    def to_onnx(self, n: int) -> Any:
        """Convert to an ONNX graph that simulates as `simulate` does, from any number of measured samples."""
        return graph.build(self)

    def hyper_parameters(self) -> dict[str, Any]:
        """Give the fields that a user may choose."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.init}

    def check(self) -> None:
        """Raise UnusableInput for hyper-parameters that make no sense."""
        if self.mode not in ("windowed", "stateful"):
            raise UnusableInput(f"the mode {self.mode!r} is not known; it is windowed or stateful")
        if self.window < 8:
            raise UnusableInput("a network needs a window of at least 8 samples")
        for f in (f for f in fields(self) if f.init):
            value = getattr(self, f.name)
            if f.name in ("epochs", "batches", "learning_rate", "l2") and not 0 <= value < math.inf:
                raise UnusableInput(f"{f.name} is {value}; give a number from 0")
            if "dropout" in f.name and not 0 <= value < 1:
                raise UnusableInput(f"{f.name} is {value}; give a share from 0 to below 1")
            size = isinstance(f.default, int) and not isinstance(f.default, bool) and f.default >= 1
            if size and f.name not in Network.__dataclass_fields__ and value < 1:
                raise UnusableInput(f"{f.name} is {value}; a network needs at least 1")
        if self.device != "cpu":
            try:
                torch.zeros(1, device=self.device)
            except (RuntimeError, AssertionError) as error:
                text = str(error).splitlines()[0]
                raise UnusableInput(f"the device {self.device!r} cannot be used: {text}") from error

    def _checkpoint(self, data: TrainingSet, seed: int) -> Path | None:
        folder = os.environ.get("SIMGAP_CHECKPOINTS")
        if not folder:
            return None
        lengths = [len(x) for x in data.train], [len(x) for x in data.valid]
        about = type(self).__qualname__, self.hyper_parameters(), seed, data.n_init, data.dt, lengths
        digest = hashlib.sha256(repr(about).encode())
        for x in data.train + data.valid:
            digest.update(x.u.tobytes() + x.y.tobytes())
        return Path(folder) / f"{digest.hexdigest()[:24]}.safetensors"


class _Log:
    """TensorBoard, if a folder is given."""

    def __init__(self, folder: str) -> None:
        self.writer = None
        if folder:
            try:
                from torch.utils.tensorboard import SummaryWriter
            except ImportError as error:
                raise UnusableInput("log: TensorBoard is not installed: pip install tensorboard") from error
            self.writer = SummaryWriter(folder)

    def write(self, epoch: int, history: History) -> None:
        if self.writer is not None:
            for name in ("train", "valid", "rate"):
                self.writer.add_scalar(name, getattr(history, name)[-1], epoch)
            self.writer.flush()
