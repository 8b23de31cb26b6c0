"""The order of the plain model: given by what is measured, or the simplest that forecasts as well as the best."""

import numpy as np
import pytest

from simgap.data.simulated import field
from simgap.greybox.identification import identify
from simgap.records import TrainingSet

from .building import order_chosen, order_of, orders_tried, plain_errors, plain_search
from .parts import channels, experiments
from .plants import Plant, free_run, position, steps, third_order, velocity

DT = 0.1


def measured(plant, seed=0, noise=0.02, shape=(4, 200), hold=8):
    """Training and held-out experiments; the noise is a share of the spread."""
    rng = np.random.default_rng(seed)
    u = steps(rng, shape, hold=hold)
    y, _ = free_run(plant, u, DT)
    made = experiments(u, y + noise * y.std() * rng.standard_normal(y.shape), DT)
    return made[:-1], made[-1:]


@pytest.mark.parametrize(("kind", "plant", "order"), [("velocity", position(), 1), ("position", third_order(), 2)])
def test_a_velocity_has_one_state_and_a_position_two_whatever_the_data_ask_for(kind, plant, order):
    train, valid = measured(plant)
    assert orders_tried(train, valid, kind) == [order]
    assert order_of(plain_search(train, valid, kind)) == order


@pytest.mark.parametrize(
    ("plant", "order"), [(velocity(), 1), (position(), 2), (third_order(), 3)], ids=["first", "second", "third"]
)
def test_a_signal_of_no_known_kind_gets_the_order_of_the_plant_behind_it(plant, order):
    train, valid = measured(plant)
    assert orders_tried(train, valid, "other")[-1] == order
    assert order_of(plain_search(train, valid, "other")) == order


@pytest.mark.parametrize("seed", range(2))
def test_a_slow_pole_beside_its_zero_is_found_behind_a_fast_plant(seed):
    # A reading that is half of what follows the input fast, and half of what follows it in five seconds.
    fast = position()
    a = np.zeros((3, 3))
    a[:2, :2], a[2, 2] = fast.a, -0.2
    plant = Plant(a, np.array([[0.0], [3.0], [0.2 * 3.0 / 4.0]]), np.array([[1.0, 0.0, 1.0]]))
    train, valid = measured(plant, seed, noise=0.01, shape=(2, 800))
    search = plain_search(train, valid, "other")
    assert order_of(search) >= 3
    assert plain_errors(search).std() < 0.012 * train[0].y.std()


@pytest.mark.parametrize("slow", [0.05, 0.2])
def test_a_heater_with_a_fast_and_a_slow_lag_side_by_side_gets_both(slow):
    plant = Plant(np.diag([-2.0, -slow]), np.array([[1.0], [0.5 * slow]]), np.array([[1.0, 1.0]]))
    train, valid = measured(plant, noise=0.01, shape=(2, 400), hold=100)
    search = plain_search(train, valid, "other")
    assert order_of(search) == 2
    assert plain_errors(search).std() < 0.015 * train[0].y.std()


@pytest.mark.parametrize("seed", [1, 4])
def test_an_order_is_not_blamed_for_what_ten_noisy_samples_tell_of_a_slow_state(seed):
    swinging = np.array([[0.0, 1.0], [-0.01, -0.05]])
    a = np.zeros((3, 3))
    a[:2, :2], a[2, 2] = swinging, -0.7
    plant = Plant(a, np.array([[0.0], [0.01], [0.7]]), np.array([[1.0, 0.0, 1.0]]))
    train, valid = measured(plant, seed, shape=(2, 800), hold=30)
    search = plain_search(train, valid, "other")
    assert order_of(search) >= 3
    assert plain_errors(search).std() < 0.03 * train[0].y.std()


def test_three_resonances_of_a_structure_are_found_together():
    # Accelerations and flexible arms look so; one resonance more explains little as long as others are missing.
    a, b, c = np.zeros((6, 6)), np.zeros((6, 1)), np.zeros((1, 6))
    for k, (hertz, sign) in enumerate([(0.4, 1.0), (0.9, 1.0), (2.1, -1.0)]):
        w = 2 * np.pi * hertz
        a[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[0.0, w], [-w, -0.04 * w]]
        b[2 * k + 1], c[0, 2 * k + 1] = 1.0, sign
    train, valid = measured(Plant(a, b, c), noise=0.05, shape=(3, 600), hold=2)
    search = plain_search(train, valid, "other")
    assert order_of(search) == 6
    assert plain_errors(search).std() < 0.06 * train[0].y.std()


def test_beyond_four_an_order_must_be_likelier_in_training_too():
    held_out = {0: blocks(9.0), 1: blocks(8.0), 2: blocks(6.0), 3: blocks(4.0), 4: blocks(2.0), 5: blocks(1.0)}
    assert order_chosen(held_out) == 4
    assert order_chosen(held_out, trained={5: 0.1}) == 5


def test_models_come_from_the_simplest_on_and_end_with_the_chosen_one():
    orders = orders_tried(*measured(third_order()), "other")
    assert orders[0] == 0 and orders == sorted(orders)


def blocks(mean, swing=0.0):
    """Squares of twenty held-out blocks."""
    return mean + swing * np.array([1.0, -1.0] * 10)


@pytest.mark.parametrize(("swing", "order"), [(0.9, 2), (0.85, 3)])
def test_the_simplest_within_one_standard_error_of_the_best_is_chosen(swing, order):
    # Order 2 is worse than order 3 by 0.2 in the mean; its standard error is swing / sqrt(20), 0.2 at a swing of 0.894.
    held_out = {0: blocks(9.0), 1: blocks(9.0), 2: blocks(2.2, swing), 3: blocks(2.0), 4: blocks(2.0)}
    assert order_chosen(held_out) == order


def test_one_order_in_vain_is_followed_by_another_try_and_two_are_not():
    resonance = {
        0: blocks(9.0),
        1: blocks(5.0),
        2: blocks(4.99),
        3: blocks(1.0),
        4: blocks(1.0),
    }  # a resonance takes two orders
    assert order_chosen(resonance) == 3
    far = {0: blocks(9.0), 1: blocks(5.0), 2: blocks(4.99), 3: blocks(4.98), 4: blocks(1.0)}
    assert order_chosen(far) == 3  # of what was tried the best; 4 was not


@pytest.mark.parametrize("seed", [0, 1])
def test_a_delay_does_not_buy_a_higher_order(seed):
    rng = np.random.default_rng(seed)
    u = steps(rng, (4, 200), hold=8)
    late = np.concatenate((np.repeat(u[:, :1], 3, axis=1), u[:, :-3]), axis=1)
    y, _ = free_run(velocity(), late, DT)
    made = experiments(u, y + 0.02 * y.std() * rng.standard_normal(y.shape), DT)
    # Three parameters of the true plant and its delay forecast within 2 % of the noise, as nine of fourth order do.
    assert order_of(plain_search(made[:3], made[3:], "other")) == 1


def test_a_hot_body_that_radiates_is_of_first_order_with_a_loss_that_grows_faster_than_its_temperature():
    dt, zero, surroundings = 2.0, 273.15, 20.0  # s, K, deg C
    rng = np.random.default_rng(2)
    heater = steps(rng, (1, 2000), hold=120, low=0.0, high=100.0)
    body, y = surroundings, np.zeros((1, 2000, 1))
    for k, power in enumerate(heater[0]):
        y[0, k] = body
        for _ in range(10):  # 20 W per percent, 2 W/K to the air, 0.18 m2 of a black body, 400 J/K
            radiated = 5.67e-8 * 0.18 * ((body + zero) ** 4 - (surroundings + zero) ** 4)
            body += dt / 10 * (20.0 * power - 2.0 * (body - surroundings) - radiated) / 400.0
    made = experiments(heater, y + 0.2 * rng.standard_normal(y.shape), dt)
    (one,) = identify(TrainingSet((made[0][:1500],), (made[0][1500:],), 10, channels("other")))
    assert one.linear is None
    assert one.selection.baseline.plant.order == 1
    assert one.selection.trial.names == ("cubic_stiffness",)
    assert one.selection.trial.estimate.errors.std() < 0.3  # the plain model errs by some 10 K


@pytest.mark.slow
def test_a_saturation_that_makes_lags_look_unneeded_is_found_with_the_order_that_it_hides():
    data = field.hide("heat_loop", {"input_saturation": 1.0}, 0.02, 0.8, 301001)
    training = data.training
    assert order_of(plain_search(training.train, training.valid, "other")) == 0
    (one,) = identify(training)
    assert one.selection.trial.names == ("input_saturation",)
    assert one.selection.baseline.plant.order == 2  # the truth
