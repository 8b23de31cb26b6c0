"""Epochs of training next to torch.nn on the CPU: the same networks, weights, batches and loop, other layers.

PyTorch's LSTM is one compiled loop as well: alone it is 1.0 to 1.3 times as slow as ours, in the two narrow layers of
the encoder and the decoder 1.5 to 1.9 times.
"""

import copy
import statistics
import time
from dataclasses import replace

import pytest
import torch
from threadpoolctl import threadpool_limits
from torch.nn import functional

from simgap.data import load
from simgap.neural.training.blocks import Block
from simgap.neural.training.loop import Recipe, train
from simgap.registry import MODELS

ROUNDS = 5
RECIPE = Recipe(epochs=1, batch=32, learning_rate=1e-4, patience=100, early_stop=100, batches=20)
AT_LEAST = 1.5  # times as fast on one thread, or a pass of our own is not worth its lines
# A TCN with a state shares the pass with the windows, where most samples of a block are left out.
NO_LIMIT = {("tcn", "stateful"), *((name, "windowed") for name in ("lstm", "encoder", "decoder")), ("lstm", "stateful")}
CASES = [(name, width) for name in ("srnn", "gru", "conv1d", "tcn") for width in (64, 32)]
CASES += [("lstm", 32), ("encoder", None), ("decoder", None)]  # as wide as the bench runs them


class NativeRecurrence(Block):
    """A recurrent layer as PyTorch runs it."""

    def __init__(self, body):
        super().__init__()
        self.layers = body.layers

    def forward(self, x):
        for layer in self.layers:
            x = layer(x)[0]
        return x

    def last(self, x):
        return self.forward(x)[:, -1]


def convolved(layer, x, dilation=1, step=1):
    """ReLU of a causal convolution of x [B, C, T], at every `step`-th sample counted from the end."""
    padded = functional.pad(x, ((layer.kernel_size[0] - 1) * dilation, 0))[:, :, (x.shape[2] - 1) % step :]
    return torch.relu(functional.conv1d(padded, layer.weight, layer.bias, stride=step, dilation=dilation))


class NativePooling(Block):
    """Two convolutions with average pooling and a fully connected layer, of windows of a multiple of four samples."""

    def __init__(self, body):
        super().__init__()
        self.first, self.second, self.full = body.first, body.second, body.full

    def last(self, x):
        x = x.transpose(1, 2)
        for layer in (self.first, self.second):
            x = functional.avg_pool1d(convolved(layer, x), 2)
        return torch.relu(functional.linear(x.flatten(1), self.full.weight.flatten(1), self.full.bias))


class NativeTcn(Block):
    """Residual blocks with the same samples left out as in ours, by strides."""

    def __init__(self, body):
        super().__init__()
        self.blocks = body.blocks

    def block(self, block, x, dilation=1, step=1):
        inner = convolved(block.two, convolved(block.one, x, dilation), dilation, step)
        x = x[:, :, (x.shape[2] - 1) % step :: step]
        if block.through is not None:
            x = functional.conv1d(x, block.through.weight[:, :, None], block.through.bias)
        return torch.relu(inner + x)

    def forward(self, x):
        x = x.transpose(1, 2)
        for level, block in enumerate(self.blocks):
            x = self.block(block, x, 2**level)
        return x.transpose(1, 2)

    def last(self, x):
        x = x.transpose(1, 2)
        for block in self.blocks[:-1]:
            x = self.block(block, x, step=2)
        return self.block(self.blocks[-1], x, step=x.shape[2])[:, :, 0]


NATIVE = {"conv1d": NativePooling, "tcn": NativeTcn}


@pytest.fixture(scope="module")
def data():
    full = load("gimbal").training
    return replace(full, train=full.train[:32], valid=full.valid[:1])


def seconds_of_an_epoch(net, examples, held_out, threads):
    """Seconds of the processor for one thread, which others on the machine do not lengthen; for two, of the clock."""
    clock = time.process_time if threads == 1 else time.perf_counter
    before = torch.get_num_threads()
    with threadpool_limits(threads):
        torch.set_num_threads(threads)
        try:
            start = clock()
            train(net, examples, held_out, RECIPE, seed=0)
            return clock() - start
        finally:
            torch.set_num_threads(before)


def medians(nets, examples, held_out, threads):
    seconds = [[seconds_of_an_epoch(net, examples, held_out, threads) for net in nets] for _ in range(1 + ROUNDS)]
    return [statistics.median(taken) for taken in zip(*seconds[1:], strict=True)]  # the first round warms up


@pytest.mark.parametrize(("name", "width"), CASES)
@pytest.mark.parametrize("mode", ["windowed", "stateful"])
def test_an_epoch_next_to_torch(name, mode, width, data, row):
    if (name, mode) == ("conv1d", "stateful"):
        pytest.skip("PyTorch has no layer that pools a sequence at every sample")
    sizes = {} if width is None else {"channels" if name in NATIVE else "units": width}
    examples, held_out, ours = MODELS[name](mode=mode, **sizes).prepare(data, 0)
    theirs = copy.deepcopy(ours)
    theirs.body = NATIVE.get(name, NativeRecurrence)(theirs.body)
    x, _ = examples.batch(torch.arange(32))
    torch.testing.assert_close(examples.answer(ours, x), examples.answer(theirs, x), atol=1e-5, rtol=1e-4)
    mine, other = medians((ours, theirs), examples, held_out, threads=1)
    limit = None if (name, mode) in NO_LIMIT else AT_LEAST
    row(f"20 {mode} batches of {name}, width {width or 16}", mine, "torch.nn", other, limit)
    if mode == "windowed":
        on_two = medians((ours, theirs), examples, held_out, threads=2)
        row("the same on two threads", on_two[0], "torch.nn", on_two[1], None)
    assert limit is None or other / mine >= limit
