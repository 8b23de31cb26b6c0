"""Linear recurrences do what a loop over samples does, forwards and backwards, and stay stable whatever the weights."""

import numpy as np
import pytest
import torch
from scipy.signal import lfilter

from simgap.neural.training.blocks import Headed
from simgap.neural.training.linear import Diagonal, Filters, _Diagonal, _doubled, _Section, scan
from simgap.neural.training.linear_blocks import Entry, Filtered, Lru, Stacked, Static
from simgap.neural.training.loop import Recipe, optimiser

RADII = 0.4, 0.95


def drawn(*shape):
    return torch.randn(*shape, dtype=torch.double, generator=torch.Generator().manual_seed(0))


def diagonal(features=3, states=4):
    torch.manual_seed(0)
    return Diagonal(features, states, RADII, 2.0).double()


def filters(channels=3, sections=2):
    torch.manual_seed(0)
    return Filters(channels, sections, RADII, 2.0).double()


def sample_by_sample(layer, x):
    """The LRU as its equation says it, in complex numbers and in PyTorch's own operations."""
    n = len(layer.nu)
    size, angle = torch.exp(-torch.exp(layer.nu)), torch.exp(layer.theta)
    pole = torch.polar(size, angle)
    b = torch.exp(layer.gamma)[:, None] * torch.complex(layer.weight_in[:n], layer.weight_in[n:])
    c = torch.complex(layer.weight_out[:, :n], -layer.weight_out[:, n:])
    s, rows = torch.zeros(len(x), n, dtype=torch.cdouble), []
    for k in range(x.shape[1]):
        s = pole * s + x[:, k].to(torch.cdouble) @ b.t()
        rows.append((s @ c.t()).real + layer.through * x[:, k])
    return torch.stack(rows, 1)


def test_the_recurrence_is_that_of_its_equation_forwards_and_backwards():
    layer, x = diagonal(), drawn(2, 30, 3).requires_grad_()
    ours, theirs = layer.outputs(x, layer.states(x)), sample_by_sample(layer, x)
    torch.testing.assert_close(ours, theirs)
    parts, weights = [x, *layer.parameters()], drawn(*ours.shape)
    gradients = [torch.autograd.grad((y * weights).sum(), parts) for y in (ours, theirs)]
    torch.testing.assert_close(*gradients)


def test_its_gradients_are_those_of_finite_differences():
    inputs = drawn(2, 9, 6), drawn(3) / 3, drawn(3) / 3
    assert torch.autograd.gradcheck(_Diagonal.apply, [value.requires_grad_() for value in inputs])


def test_a_cascade_of_sections_is_the_transfer_function_of_their_products():
    layer, x = filters(), drawn(2, 50, 3)
    ours = layer.over(x)
    for c in range(3):
        num, den = np.ones(1), np.ones(1)
        for b, a in layer.sections():
            num, den = np.convolve(num, b[:, c].detach()), np.convolve(den, [1, *a[:, c].detach()])
        np.testing.assert_allclose(ours[:, :, c].detach(), lfilter(num, den, x[:, :, c], axis=1), atol=1e-12)


@pytest.mark.parametrize("length", [1, 2, 3, 12])
def test_the_adjoint_of_a_section_is_its_gradient(length):
    inputs = drawn(2, length, 3), drawn(3, 3), drawn(2, 3) / 3
    assert torch.autograd.gradcheck(_Section.apply, [value.requires_grad_() for value in inputs])


def test_off_the_cpu_a_scan_of_doubled_steps_gives_the_same_gradients_too():
    x, num, den = (value.requires_grad_() for value in (drawn(2, 37, 3), drawn(3, 3), drawn(2, 3) / 3))
    weights = drawn(2, 37, 3)
    both = [_Section.apply(x, num, den), _doubled(x, num, den)]
    torch.testing.assert_close(*both)
    torch.testing.assert_close(*(torch.autograd.grad((y * weights).sum(), (x, num, den)) for y in both))
    re, im = drawn(4) / 3, drawn(4) / 4
    a = torch.stack((torch.stack((re, -im), 1), torch.stack((im, re), 1)), 1)
    v = drawn(2, 37, 8)
    theirs = scan(v.unflatten(2, (2, -1)).transpose(2, 3), a).transpose(2, 3).flatten(2)
    torch.testing.assert_close(_Diagonal.apply(v, re, im), theirs)


@pytest.mark.parametrize("spread", [0.1, 1.0, 10.0])
def test_no_weights_make_it_unstable(spread):
    layer = filters(50, 4)
    layer.weight_den.data = spread * drawn(4, 2, 50)
    for a1, a2 in torch.cat([den.detach() for _, den in layer.sections()], 1).t().tolist():
        assert np.abs(np.roots([1, a1, a2])).max() <= 1 + 1e-7
    ring = diagonal(3, 50)
    ring.nu.data, ring.theta.data = spread * drawn(50), spread * drawn(50)
    re, im = ring.poles()
    assert torch.hypot(re, im).max() <= 1


def test_poles_begin_within_their_radii():
    re, im = diagonal(3, 200).poles()
    size = torch.hypot(re, im).detach()
    assert size.min() == pytest.approx(RADII[0], abs=0.05)
    assert size.max() == pytest.approx(RADII[1], abs=0.05)
    a1, a2 = torch.cat([den.detach() for _, den in filters(100, 2).sections()], 1)
    assert a2.sqrt().min() == pytest.approx(RADII[0], abs=0.05)
    assert a2.sqrt().max() == pytest.approx(RADII[1], abs=0.05)
    assert (a1.square() < 4 * a2).all()  # pairs


def blocks():
    return {
        "lru": Stacked([Entry(2, 5), Lru(5, 4, RADII, 1.0), Lru(5, 3, RADII, 1.0)]),
        "gated": Entry(4, 5, 2),
        "dynonet": Stacked([Entry(2, 4, 1), Filtered(4, 2, RADII, 1.0), Static(4, 6), Filtered(4, 1, RADII, 1.0)]),
    }


@pytest.mark.parametrize("name", blocks())
def test_the_last_sample_is_the_last_of_the_sequence_and_nothing_looks_ahead(name):
    torch.manual_seed(0)
    block = Headed(blocks()[name].double(), {"dynonet": 4}.get(name, 5), 2).double()
    x = drawn(3, 40, 4 if name == "gated" else 2)
    torch.testing.assert_close(block.last(x), block(x)[:, -1])
    changed = x.clone()
    changed[:, 25:] += 1
    torch.testing.assert_close(block(x)[:, :25], block(changed)[:, :25], rtol=0, atol=0)
    assert not torch.allclose(block(x)[:, 25:], block(changed)[:, 25:])


def test_while_outputs_are_measured_the_inputs_come_twice():
    entry, x = Entry(4, 5, 2), torch.tensor([[[1.0, 2.0, 3.0, 1.0], [1.0, 2.0, 0.0, 0.0]]])
    twice = torch.tensor([[[1.0, 2.0, 3.0, 1.0, 1.0, 2.0], [1.0, 2.0, 0.0, 0.0, 0.0, 0.0]]])
    torch.testing.assert_close(entry(x), entry.full(twice))


def test_l2_leaves_out_what_says_how_long_a_layer_remembers():
    net = Stacked([Lru(3, 4, RADII, 1.0), Filtered(3, 1, RADII, 1.0)])
    decayed, _ = optimiser(net, Recipe(1, 1, 1e-3, 1, 1, l2=0.1)).param_groups
    names = {name for name, p in net.named_parameters() if any(p is other for other in decayed["params"])}
    recurrence = {f"blocks.0.recurrence.{name}" for name in ("weight_in", "weight_out", "through")}
    assert names == recurrence | {"blocks.1.filters.weight_num"}
