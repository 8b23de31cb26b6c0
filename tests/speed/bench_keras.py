"""Epochs of training next to Keras: the same layers, widths, initial weights, optimiser, batches and windows."""

import statistics
from time import perf_counter

import numpy as np
import pytest
import torch

from simgap.data import load
from simgap.neural.training.loop import Recipe, train
from simgap.neural.training.threads import one_thread
from simgap.registry import MODELS

EPOCHS, SEEDS = 3, 3
RECIPE = Recipe(epochs=EPOCHS, batch=32, learning_rate=1e-4, patience=100, early_stop=100)


@pytest.fixture(scope="module")
def keras():
    tensorflow = pytest.importorskip("tensorflow", reason="Keras is not installed: make peers")
    tensorflow.config.threading.set_intra_op_parallelism_threads(0)  # as many as there are cores
    return tensorflow.keras


def body_of(keras, name, x):
    layers, model = keras.layers, MODELS[name]
    if name in ("srnn", "gru", "lstm"):
        kind = {"srnn": layers.SimpleRNN, "gru": layers.GRU, "lstm": layers.LSTM}[name]
        return kind(model.units)(x)
    if name == "conv1d":
        for _ in range(2):
            x = layers.Conv1D(model.channels, model.kernel, padding="causal", activation="relu")(x)
            x = layers.AveragePooling1D(2)(x)
        return layers.Dense(model.channels, activation="relu")(layers.Flatten()(x))
    for level in range(model.blocks):
        inner = x
        for _ in range(2):
            inner = layers.Conv1D(
                model.channels, model.kernel, padding="causal", dilation_rate=2**level, activation="relu"
            )(inner)
        skip = x if level else layers.Dense(model.channels)(x)
        x = layers.ReLU()(layers.Add()([inner, skip]))
    return x[:, -1]


def weights_of(name, net):
    """Our initial weights in the shapes and the order of Keras' layers."""

    def turned(layer):  # a convolution [G, C, K] to [K, C, G]
        return [layer.weight.permute(2, 1, 0), layer.bias]

    def full(layer):
        return [layer.weight.t(), layer.bias]

    body = net.body
    if name == "conv1d":
        flat = body.full.weight.transpose(1, 2).flatten(1).t()
        found = [*turned(body.first), *turned(body.second), flat, body.full.bias]
    elif name == "tcn":
        found = []
        for block in body.blocks:
            found += turned(block.one) + turned(block.two) + (full(block.through) if block.through else [])
    else:
        layer = body.layers[0]
        order = {"srnn": [0], "gru": [1, 0, 2], "lstm": [0, 1, 2, 3]}[name]  # of the gates
        w, u, b, c = (
            torch.cat([part.chunk(len(order))[gate] for gate in order])
            for part in (layer.weight_ih_l0, layer.weight_hh_l0, layer.bias_ih_l0, layer.bias_hh_l0)
        )
        found = [w.t(), u.t(), torch.stack((b, c)) if name == "gru" else b + c]
    return [value.detach().numpy() for value in found + full(net.head)]


@pytest.mark.parametrize("name", ["srnn", "gru", "lstm", "conv1d", "tcn"])
def test_an_epoch_next_to_keras(name, keras, note, row):
    data = load("gimbal").training
    ours, theirs, losses = [], [], []
    for seed in range(SEEDS):
        examples, held_out, net = MODELS[name](mode="windowed").prepare(data, seed)
        if name in ("srnn", "lstm"):  # Keras' have one bias; a second one that is trained, too, learns twice as fast
            net.body.layers[0].bias_hh_l0.register_hook(torch.zeros_like)
        x, y = (part.numpy() for part in examples.batch(torch.arange(len(examples))))
        validation = tuple(part.numpy() for part in held_out.batch(torch.arange(len(held_out))))
        keras.utils.set_random_seed(seed)
        given = keras.Input(x.shape[1:])
        model = keras.Model(given, keras.layers.Dense(y.shape[1])(body_of(keras, name, given)))
        model.compile(keras.optimizers.Adam(1e-4), "mse")
        model.train_on_batch(x[:32], y[:32])  # traces the graph, and changes the weights
        model.set_weights(weights_of(name, net))
        model.optimizer.build(model.trainable_variables)
        for variable in model.optimizer.variables:  # Adam forgets that batch too
            if "learning_rate" not in variable.path:
                variable.assign(np.zeros(variable.shape, variable.dtype))
        with torch.no_grad():
            answers = model.predict_on_batch(x[:32]), net.last(torch.from_numpy(x[:32])).numpy()
        np.testing.assert_allclose(*answers, atol=1e-5)
        model.evaluate(*validation, batch_size=512, verbose=0)
        loss = []

        order = torch.Generator().manual_seed(seed)

        def theirs_too(epoch, history, model=model, data=(x, y), held_out=validation, loss=loss, order=order):
            same = torch.randperm(len(data[0]), generator=order).numpy()  # the batches of our epoch
            given = [part[same] for part in data]
            start = perf_counter()
            known = model.fit(*given, batch_size=32, epochs=1, shuffle=False, verbose=0, validation_data=held_out,
                              validation_batch_size=512)  # fmt: skip
            theirs.append(perf_counter() - start)
            loss.append(known.history["val_loss"][-1])

        with one_thread():  # as `fit` does; Keras has threads of its own
            history = train(net, examples, held_out, RECIPE, seed, tell=theirs_too)
        ours += history.seconds
        losses.append((history.valid[-1], loss[-1]))
    mine, other = statistics.median(ours), statistics.median(theirs)
    ratio = other / mine
    mine_loss, other_loss = np.mean(losses, axis=0)
    worse = np.log([a / b for a, b in losses])
    row(f"epoch of {name}, batch 32", mine, "Keras on TensorFlow", other, 3)
    note(f"{name}: validation loss after {EPOCHS} epochs {mine_loss:.5f}, Keras {other_loss:.5f}; "
         f"ratios of the seeds {np.round(np.exp(worse), 3)}.")  # fmt: skip
    assert ratio >= 3, f"{name}: {ratio:.1f} times Keras"
    assert abs(worse).max() < 0.05  # rounding in single precision, over 2265 steps
