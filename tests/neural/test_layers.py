"""The compiled passes do what PyTorch's own layers do, forwards and backwards."""

import pytest
import torch
from torch import nn

from simgap.neural.training.attention import Attending, Attention
from simgap.neural.training.blocks import Parallel, Pooled, Recurrences, Tcn
from simgap.neural.training.convolution import Convolution, Residual, pooled
from simgap.neural.training.recurrent import Gru, Lstm, Srnn, recurrent


def gradients(value, parts):
    weights = torch.linspace(-1, 1, value.numel()).reshape(value.shape)
    return torch.autograd.grad((value * weights).sum(), parts)


@pytest.mark.parametrize("kind", [Srnn, Gru, Lstm])
@pytest.mark.parametrize("only_last", [False, True])
def test_a_recurrent_layer_is_that_of_pytorch(kind, only_last):
    torch.manual_seed(0)
    layer = recurrent(kind, 3, 5)
    for p in layer.parameters():
        nn.init.uniform_(p, -0.8, 0.8)
    x = torch.randn(2, 9, 3, requires_grad=True)
    ours = layer.last(x) if only_last else layer.states(x)
    theirs = layer(x)[0][:, -1] if only_last else layer(x)[0]
    torch.testing.assert_close(ours, theirs, atol=2e-6, rtol=1e-5)
    parts = [x, *layer.parameters()]
    for mine, reference in zip(gradients(ours, parts), gradients(theirs, parts), strict=True):
        torch.testing.assert_close(mine, reference, atol=1e-5, rtol=1e-4)


@pytest.mark.parametrize("dilation", [1, 2, 4])
def test_a_convolution_is_that_of_pytorch_with_zeros_before_the_start(dilation):
    torch.manual_seed(0)
    layer = Convolution(3, 5, 4).double()
    nn.init.uniform_(layer.bias, -0.5, 0.5)
    x = torch.randn(2, 11, 3, dtype=torch.double, requires_grad=True)
    padded = nn.functional.pad(x.transpose(1, 2), (3 * dilation, 0))
    theirs = torch.relu(nn.functional.conv1d(padded, layer.weight, layer.bias, dilation=dilation)).transpose(1, 2)
    ours = layer.over(x, dilation)
    torch.testing.assert_close(ours, theirs)
    parts = [x, layer.weight, layer.bias]
    torch.testing.assert_close(gradients(ours, parts), gradients(theirs, parts))


@pytest.mark.parametrize(("inputs", "step", "dilation"), [(3, 1, 1), (5, 1, 4), (5, 2, 1), (3, 2, 2), (5, 13, 1)])
def test_a_residual_block_is_two_convolutions_and_a_way_around(inputs, step, dilation):
    torch.manual_seed(0)
    block = Residual(inputs, 5, 3, dropout=0.5).double()
    for p in block.parameters():
        nn.init.uniform_(p, -0.7, 0.7)
    x = torch.randn(2, 13, inputs, dtype=torch.double, requires_grad=True)
    block.eval()  # the pass of its own; with dropout it is made of PyTorch's operations
    ours = block.over(x, dilation, step)
    inner = block.two.over(block.one.over(x, dilation), dilation)
    theirs = torch.relu(inner + (x if block.through is None else block.through(x)))[:, (13 - 1) % step :: step]
    torch.testing.assert_close(ours, theirs)
    parts = [x, *block.parameters()]
    torch.testing.assert_close(gradients(ours, parts), gradients(theirs, parts))


def test_pooling_takes_the_mean_of_two_samples():
    torch.manual_seed(0)
    layers = [Convolution(3, 5, 4).double(), Convolution(5, 6, 3).double(), Convolution(6, 2, 3).double()]
    x = torch.randn(2, 12, 3, dtype=torch.double, requires_grad=True)
    theirs = x
    for layer in layers[:2]:
        theirs = layer.over(theirs).unflatten(1, (-1, 2)).mean(2)
    ours, theirs = pooled(x, *layers), layers[2].over(theirs)[:, -1]
    torch.testing.assert_close(ours, theirs)
    parts = [x, *(p for layer in layers for p in layer.parameters())]
    torch.testing.assert_close(gradients(ours, parts), gradients(theirs, parts))


def test_attention_is_a_weighted_mean_of_the_past_with_zeros_before_the_start():
    torch.manual_seed(0)
    layer, x = Attention(6, 2, 5).double(), torch.randn(3, 23, 6, dtype=torch.double)
    nn.init.normal_(layer.offsets)
    q, k, v = layer.qkv(x).unflatten(2, (3, 2, 3)).unbind(2)  # each [B, T, heads, d]
    k, v = (nn.functional.pad(of, (0, 0, 0, 0, 4, 0)) for of in (k, v))
    theirs = torch.zeros_like(q)
    for t in range(23):
        past_k, past_v = (of[:, t : t + 5].flip(1) for of in (k, v))  # delays 0 to 4
        score = torch.einsum("bhd,bjhd->bhj", q[:, t], past_k) / 3**0.5 + layer.offsets
        theirs[:, t] = torch.einsum("bhj,bjhd->bhd", score.softmax(2), past_v)
    torch.testing.assert_close(layer(x), layer.out(theirs.flatten(2)))


def blocks(window):
    return {
        "recurrent": Recurrences([recurrent(Lstm, 2, 4), recurrent(Gru, 4, 3)]),
        "pooled": Pooled(2, 4, 5, window),
        "tcn": Tcn(2, 4, 3, 4),
        "attending": Attending(2, 2, 5, 6),
        "parallel": Parallel([Tcn(2, 4, 3, 2), Pooled(2, 3, 3, window)], 7, 5),
    }


@pytest.mark.parametrize("name", blocks(40))
def test_the_last_sample_of_a_window_is_the_last_one_of_a_sequence(name):
    torch.manual_seed(0)
    block = blocks(40)[name].double()
    x = torch.randn(3, 40, 2, dtype=torch.double)
    torch.testing.assert_close(block.last(x), block(x)[:, -1])


@pytest.mark.parametrize("name", blocks(8))
def test_a_sequence_depends_on_nothing_that_comes_later(name):
    torch.manual_seed(0)
    block = blocks(8)[name].double()
    x = torch.randn(1, 60, 2, dtype=torch.double)
    changed = x.clone()
    changed[:, 30:] += 1
    torch.testing.assert_close(block(x)[:, :30], block(changed)[:, :30])
    assert not torch.allclose(block(x)[:, 30:], block(changed)[:, 30:])


@pytest.mark.parametrize("length", [37, 38, 39, 41])
def test_a_window_need_not_be_a_multiple_of_four(length):
    block = Pooled(2, 4, 5, length)
    assert block.last(torch.randn(3, length, 2)).shape == (3, 4)
