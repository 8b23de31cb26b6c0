import pytest

from simgap.contract import toy_experiment
from simgap.records import TrainingSet, UnusableInput
from simgap.registry import MODELS

LIMITS = [
    ("arx", "max_order"), ("armax", "max_order"), ("oe", "max_order"), ("box-jenkins", "max_order"),
    ("n4sid", "order"), ("n4sid", "max_order"), ("wiener", "max_order"), ("hammerstein", "max_order"),
    ("wiener-hammerstein", "max_order"), ("narx", "max_lags"), ("narx", "max_degree"), ("narx", "max_terms"),
    ("kernel-narx", "max_lags"), ("kernel-narx", "max_centres"), ("sindy", "max_order"), ("sindy", "max_degree"),
]  # fmt: skip


@pytest.mark.parametrize("limit", [0, -2])
@pytest.mark.parametrize(("name", "parameter"), LIMITS)
def test_a_limit_below_one_is_refused_in_one_sentence(name, parameter, limit):
    model = MODELS[name](**{parameter: limit})
    data = TrainingSet((toy_experiment(0, 80),), (toy_experiment(1, 80),), 10)
    with pytest.raises(UnusableInput, match=f"^{parameter} is {limit}; give a whole number from 1$"):
        model.fit(data, 0)
