"""A neural state space does what its equation says, forwards and backwards, and stays bounded whatever the weights."""

import pytest
import torch

from simgap.neural.training.loop import Recipe, optimiser
from simgap.neural.training.sequences import with_start
from simgap.neural.training.state_space import StateSpace, _Pass, sample_by_sample

NU, NY = 2, 1


def drawn(*shape):
    return torch.randn(*shape, dtype=torch.double, generator=torch.Generator().manual_seed(len(shape)))


def block(measured=NY + 1, integrated=0, past=4):
    torch.manual_seed(0)
    return StateSpace(NU + measured, measured, 3, 5, past, integrated).double()


def record(n, length=30):
    return with_start(drawn(3, length, NU), drawn(3, n, NY))


def test_the_gradients_of_its_pass_are_those_of_finite_differences():
    arrays = drawn(3, 3) / 3, drawn(4, 3), drawn(3, 4), drawn(7, 3, 2), drawn(7, 4, 2), drawn(3, 2)
    # the compiled tanh is right to 3e-7
    assert torch.autograd.gradcheck(_Pass.apply, [x.clone().requires_grad_() for x in arrays], eps=1e-4, atol=1e-4)


def test_off_the_cpu_it_gives_the_same_states_and_gradients():
    drawings = drawn(3, 3) / 3, drawn(4, 3), drawn(3, 4) / 3, drawn(9, 3, 2), drawn(9, 4, 2), drawn(3, 2)
    *arrays, start = (x.requires_grad_() for x in drawings)
    weights = drawn(10, 3, 2)
    both = [run(*arrays, start) for run in (_Pass.apply, sample_by_sample)]
    torch.testing.assert_close(*both, atol=1e-5, rtol=1e-5)
    gradients = [torch.autograd.grad((s * weights).sum(), (*arrays, start)) for s in both]
    torch.testing.assert_close(*gradients, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("n", [1, 3, 4, 9])
def test_behind_measured_samples_the_state_is_the_encoders_and_then_that_of_the_equation(n):
    layer, x = block(), record(n)
    features = layer(x)
    rows = torch.cat((torch.zeros(3, 4, NU + NY + 1, dtype=torch.double), x[:, :n]), 1)[:, -4:].flatten(1)
    psi = layer.encoder
    s = psi.linear(rows) + psi.outer(torch.tanh(psi.inner(rows)))
    a, b = layer.linear().split((6, NU), 1)
    for k in range(n, 30):
        torch.testing.assert_close(features[:, k], torch.cat((s, x[:, k, :NU]), 1), atol=1e-5, rtol=1e-5)
        bent = torch.tanh(layer.inner(torch.cat((s, x[:, k, :NU]), 1)))
        s = s @ a.t() + x[:, k, :NU] @ b.t() + bent @ layer.weight_out.t()


@pytest.mark.parametrize("integrated", [0, 1])
def test_nothing_looks_ahead_and_the_last_sample_is_that_of_the_sequence(integrated):
    layer, x = block(integrated=integrated), record(5)
    changed = x.clone()
    changed[:, 20:, :NU] += 1
    torch.testing.assert_close(layer(x)[:, :20], layer(changed)[:, :20])
    torch.testing.assert_close(layer.last(x), layer(x)[:, -1])


def test_without_measured_samples_it_begins_at_zero():
    layer = block(measured=0)
    assert layer.encoder is None
    assert not layer(drawn(3, 8, NU))[:, 0, :6].any()


def test_integrated_outputs_begin_at_the_last_measured_ones():
    layer, x = block(integrated=NY), record(5)
    for weights in (layer.encoder.linear, layer.encoder.outer):
        torch.nn.init.zeros_(weights.weight)
    torch.testing.assert_close(layer(x)[:, 5], x[:, 4, NU : NU + NY])


@pytest.mark.parametrize("spread", [0.1, 1.0, 10.0])
def test_no_weights_let_a_state_run_away(spread):
    layer = block()
    for weights in layer.parameters():
        weights.data = spread * torch.randn_like(weights)
    with torch.no_grad():
        early, late = (layer(record(5, length)).abs().max() for length in (2000, 20_000))
    radius = torch.exp(-torch.exp(layer.radius)).max()
    push = layer.weight_out.abs().sum(1).max() + layer.weight_in.abs().sum(1).max() * 6
    assert torch.isfinite(late)
    assert late <= max(early, 2 * push / (1 - radius + 1e-12))


def test_l2_leaves_out_what_says_how_long_a_state_remembers():
    layer = block()
    groups = optimiser(layer, Recipe(1, 1, 1e-3, 1, 1, l2=0.1)).param_groups
    free = {id(p) for group in groups if not group.get("weight_decay") for p in group["params"]}
    assert {id(layer.radius), id(layer.angle)} == free
