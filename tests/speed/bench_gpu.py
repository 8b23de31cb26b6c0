"""Training on a GPU beside the CPU of the same machine: the same networks, weights and batches; and short whole fits.

Skipped where PyTorch finds no GPU. Simulation runs on the CPU wherever a network was trained.
"""

import copy
import statistics
import time
from dataclasses import replace

import pytest
import torch
from torch.nn.functional import mse_loss

from simgap.data import load
from simgap.metrics import free_run_nrmse
from simgap.neural.training.loop import Recipe, exact_on_a_gpu, train
from simgap.neural.training.network import Network
from simgap.registry import MODELS

if not torch.cuda.is_available():
    pytest.skip("PyTorch finds no GPU", allow_module_level=True)

NETWORKS = [name for name in MODELS if isinstance(MODELS[name], type) and issubclass(MODELS[name], Network)]
ROUNDS = 3
BATCHES = {32: 20, 512: 4}  # examples of a batch: batches that are timed; every fit of the bench takes 32
SHORT = {"epochs": 20, "batches": 20}
SEEDS = range(3)


@pytest.fixture(scope="module")
def data():
    """32 experiments to train on, and next to nothing to validate on, which would be timed along."""
    full = load("gimbal").training
    few = replace(full.valid[0], u=full.valid[0].u[:60], y=full.valid[0].y[:60])
    return replace(full, train=full.train[:32], valid=(few,))


@exact_on_a_gpu()
def answers_and_gradient(net, examples, device):
    """Outputs of 32 examples on that device, and the gradient of their error."""
    net = copy.deepcopy(net).to(device).train()
    x, y = (part.to(device) for part in examples.batch(torch.arange(32)))
    answer = examples.answer(net, x)
    mse_loss(answer, y).backward()
    return answer.detach().cpu(), torch.cat([p.grad.flatten().cpu() for p in net.parameters()])


def seconds_of_a_batch(net, examples, held_out, size, device):
    recipe = Recipe(epochs=1, batch=size, learning_rate=1e-4, patience=100, early_stop=100, batches=BATCHES[size])
    start = time.perf_counter()
    train(copy.deepcopy(net), examples, held_out, recipe, seed=0, device=device)  # its losses wait for the GPU
    return (time.perf_counter() - start) / BATCHES[size]


@pytest.mark.parametrize("mode", ["stateful", "windowed"])
@pytest.mark.parametrize("name", NETWORKS)
def test_a_batch_on_a_gpu_next_to_the_cpu(name, mode, data, row):
    examples, held_out, net = MODELS[name](mode=mode, dropout=0.0).prepare(data, 0)
    (on_cpu, slope), (on_gpu, its_slope) = (answers_and_gradient(net, examples, device) for device in ("cpu", "cuda"))
    torch.testing.assert_close(on_gpu, on_cpu, atol=1e-5, rtol=1e-4)
    assert (its_slope - slope).norm() < 1e-4 * slope.norm()
    for size in BATCHES:
        turns = [
            [seconds_of_a_batch(net, examples, held_out, size, device) for device in ("cuda", "cpu")]
            for _ in range(1 + ROUNDS)
        ]
        gpu, cpu = (statistics.median(taken) for taken in zip(*turns[1:], strict=True))  # the first round warms up
        row(f"a batch of {size}, {mode} {name}, on a GPU", gpu, "the CPU", cpu, None)


@pytest.mark.parametrize("name", NETWORKS)
def test_a_fit_on_a_gpu_ends_where_one_on_the_cpu_does(name, note):
    data = load("wiener_hammerstein")

    def nrmse_of(seed, device):
        model = MODELS[name](device=device, **SHORT)
        model.fit(data.training, seed)
        return free_run_nrmse(model.simulate, data.test, data.n_init)

    cpu, gpu = ([nrmse_of(seed, device) for seed in SEEDS] for device in ("cpu", "cuda"))
    again = nrmse_of(0, "cuda")
    shown = (" ".join(f"{100 * nrmse:.4g}" for nrmse in errors) for errors in (cpu, gpu, [again]))
    note("NRMSE in %, {}: CPU {}; GPU {}; the first on the GPU again {}".format(name, *shown))
    assert again == gpu[0]
    assert min(cpu) / 2 < statistics.median(gpu) < 2 * max(cpu)
