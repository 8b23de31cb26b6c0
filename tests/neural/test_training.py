"""Training by the paper's protocol: rate, early stop, the best epoch, and carrying on after an interruption."""

import os
import resource
import signal
from dataclasses import replace

import numpy as np
import pytest
import torch

from simgap.neural.gru import GRU
from simgap.neural.inception_regularised import InceptionRegularised
from simgap.neural.training import checkpoints, loop, network
from simgap.neural.training.loop import History, NotANumber, Recipe
from simgap.records import UnusableInput

RECIPE = Recipe(epochs=30, batch=32, learning_rate=1e-4, patience=1, early_stop=3)


def small(kind=GRU, **chosen):
    return kind(**{"mode": "windowed", "window": 12, "epochs": 4, "learning_rate": 1e-3} | chosen)


@pytest.mark.parametrize(
    ("losses", "plateau"),
    [([1.0], False), ([1.0, 0.9], False), ([1.0, 0.9, 0.9], True), ([1.0, 1.1], True), ([1.0, 0.99995], True)],
)
def test_the_rate_is_halved_when_the_training_loss_no_longer_falls(losses, plateau):
    history = History(train=losses, rate=[1e-4] * len(losses))
    assert loop._plateau(history, RECIPE) is plateau


def test_after_a_halving_the_plateau_is_counted_anew():
    history = History(train=[1.0, 1.0, 0.5], rate=[1e-3, 1e-3, 5e-4])
    assert not loop._plateau(history, RECIPE)


def test_training_stops_when_the_validation_loss_has_not_fallen_for_a_while():
    assert not loop._hopeless(History(valid=[3.0, 2.0, 2.5, 2.5]), RECIPE)
    assert loop._hopeless(History(valid=[3.0, 2.0, 2.5, 2.5, 2.5]), RECIPE)


@pytest.mark.parametrize("mode", ["windowed", "stateful"])
@pytest.mark.parametrize("kind", [GRU, InceptionRegularised])  # with and without dropout, whose dice are stored too
def test_an_interrupted_training_carries_on_as_if_nothing_had_been(mode, kind, tmp_path, monkeypatch, data, simulated):
    model = small(kind, mode=mode, batches=5)
    model.fit(data, 7)
    whole, losses = simulated(model), model.fitted["train_loss"]

    monkeypatch.setenv("SIMGAP_CHECKPOINTS", str(tmp_path))

    def interrupt(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(network, "progress", interrupt)
        with pytest.raises(KeyboardInterrupt):
            small(kind, mode=mode, batches=5).fit(data, 7)
    assert len(list(tmp_path.iterdir())) == 1
    epochs = []
    monkeypatch.setattr(network, "progress", lambda done, total: epochs.append(done))
    again = small(kind, mode=mode, batches=5)
    again.fit(data, 7)
    assert epochs == [3, 4]
    assert again.fitted["train_loss"] == losses
    assert again.earlier_seconds > 0
    np.testing.assert_array_equal(simulated(again), whole)
    assert not list(tmp_path.iterdir())


def test_a_damaged_checkpoint_is_no_reason_to_fail(tmp_path, monkeypatch, data):
    monkeypatch.setenv("SIMGAP_CHECKPOINTS", str(tmp_path))
    model = small(epochs=1)
    model.check()
    model._checkpoint(data, 0).write_bytes(b"\x08\x00\x00\x00\x00\x00\x00\x00{torn")
    model.fit(data, 0)
    assert model.fitted["epochs"] == 1


@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded")  # from Python 3.12 on, at fork
def test_what_a_killed_training_wrote_by_half_goes_with_its_checkpoint(tmp_path):
    net = torch.nn.Linear(64, 64)
    adam = torch.optim.Adam(net.parameters())
    net(torch.zeros(64)).sum().backward()
    adam.step()
    path = tmp_path / "state.safetensors"
    checkpoint = checkpoints.Checkpoint(path, net, adam, {}, torch.Generator(), {"train": [1.0]})
    child = os.fork()
    if child == 0:  # the kernel kills it in the middle of the file
        signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        checkpoint.save()
        os._exit(0)
    assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGXFSZ
    assert len(list(tmp_path.iterdir())) == 1
    checkpoints.remove(path)
    assert not list(tmp_path.iterdir())


def test_a_loss_that_is_no_number_is_said_to_be_one(data):
    with pytest.raises(NotANumber, match="not a number after epoch 1; choose a lower learning rate"):
        small(learning_rate=1e30).fit(data, 0)


def test_training_leaves_the_dice_of_others_alone(data):
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    small(epochs=1).fit(data, 0)
    torch.testing.assert_close(torch.rand(3), expected)


def test_data_that_do_not_stay_in_memory_train_the_same_network(data, simulated):
    held, made = small(epochs=1), small(epochs=1, resident=False)
    for model in (held, made):
        model.fit(data, 0)
    np.testing.assert_allclose(simulated(made), simulated(held), atol=1e-6)


def test_l2_makes_weights_smaller(data):
    free, decayed = small(epochs=8), small(epochs=8, l2=0.02)
    for model in (free, decayed):
        model.fit(data, 0)
    size = [float(m.trained.body.layers[0].weight_ih_l0.detach().square().sum()) for m in (free, decayed)]
    assert size[1] < 0.8 * size[0]


def test_the_learning_rate_range_test_ends_where_the_loss_explodes(data):
    rates, losses = small().range_test(data, 0)
    assert rates[0] == pytest.approx(1e-8)
    assert (np.diff(rates) > 0).all()
    assert losses.min() < 0.8 * losses[0]


@pytest.mark.parametrize(
    ("chosen", "complaint"),
    [
        ({"mode": "sideways"}, "the mode 'sideways' is not known"),
        ({"device": "cuda:77"}, "the device 'cuda:77' cannot be used"),
        ({"epochs": -1}, "epochs is -1; give a number from 0"),
        ({"learning_rate": float("nan")}, "learning_rate is nan; give a number from 0"),
        ({"l2": float("inf")}, "l2 is inf; give a number from 0"),
        ({"dropout": 1.0}, "dropout is 1.0; give a share from 0 to below 1"),
        ({"dropout": 0.2}, "this network has no layer with dropout"),
        ({"units": 0}, "units is 0; a network needs at least 1"),
        ({"window": 500}, "longer than the window of 500 samples"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_sentence(chosen, complaint, data):
    with pytest.raises(UnusableInput, match=complaint):
        small(**chosen).fit(data, 0)


def test_a_log_for_tensorboard_is_written(tmp_path, data):
    pytest.importorskip("tensorboard")
    small(epochs=1, log=str(tmp_path)).fit(data, 0)
    assert list(tmp_path.glob("events.out.tfevents.*"))


def test_a_checkpoint_is_that_of_one_division_into_training_and_validation(tmp_path, monkeypatch, data):
    monkeypatch.setenv("SIMGAP_CHECKPOINTS", str(tmp_path))
    moved = replace(data, train=data.train[:-1], valid=(data.train[-1], *data.valid))
    assert small()._checkpoint(data, 0) != small()._checkpoint(moved, 0)


def test_a_training_that_ended_in_no_number_leaves_no_checkpoint(tmp_path, monkeypatch, data):
    monkeypatch.setenv("SIMGAP_CHECKPOINTS", str(tmp_path))
    losses = iter([0.5, float("nan")])
    monkeypatch.setattr(loop, "error", lambda *_: next(losses))
    with pytest.raises(NotANumber, match="after epoch 2"):
        small().fit(data, 0)
    assert not list(tmp_path.iterdir())


def test_the_same_seed_gives_the_same_range_test_in_spite_of_dropout(data):
    losses = [small(InceptionRegularised).range_test(data, 3)[1] for _ in range(2)]
    np.testing.assert_array_equal(*losses)
