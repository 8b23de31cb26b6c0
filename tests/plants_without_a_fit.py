"""Grey boxes with chosen parameters, of every kind of plant, and a record for each."""

import numpy as np
from parameters_of_effects import scales, signal

from simgap.greybox.model import FittedPlant, GreyBoxModel
from simgap.greybox.noise import white
from simgap.greybox.plant import Plant
from simgap.greybox.terms import PlantScales, Term

DT = 0.1
# kind, order, other fields of Plant, theta of the linear plant
PLANTS = {
    "velocity": ("velocity", 1, {}, [0.8, 1.5]),
    "position": ("position", 2, {}, [1.1, 4.0, 6.0]),
    "several masses": ("velocity", 3, {"offset": True, "zeros": 2}, [0.8, 90.0, 0.9, 60.0, 0.5, 0.01, 0.016]),
    "smooth input": ("position", 2, {"taps": (0, -1, 1), "zeros": 1}, [1.1, 4.0, 3.0, 1.0, 2.0, 0.02]),
    "two outputs": ("position", 2, {"two_outputs": True}, [1.1, 4.0, 6.0, 0.9]),
    "two masses": ("position", 4, {"joint": "load"}, [0.9, 1.0, 60.0, 80.0, 0.01, 6.0]),
    "order 3": ("other", 3, {"offset": True, "zeros": 1}, [1.1, 4.0, 2.0, 9.0, 0.3, 0.05]),
    "tanks": ("level", 2, {"offset": True}, [0.5, 0.8, 0.4, 0.3]),
    "imposed": ("other", 0, {"offset": True}, [2.0, 0.1]),
}


def grey_box(name, terms=(), values=()):
    """A model of one plant of PLANTS with these effects; its readings are those of the scales of the tests."""
    kind, order, fields, linear = PLANTS[name]
    seen = scales(kind, order)
    plant = Plant(kind, order, 1, DT, scales=PlantScales((seen,), (seen, seen)), **fields).having(
        [Term(term) for term in terms]
    )
    theta = np.zeros(plant.size)
    theta[: plant.n_linear] = linear
    for term, of_term in zip(terms, values, strict=True):
        theta[plant.part_of(Term(term))] = of_term
    state = {"plant": plant, "theta": theta, "noise": white(np.ones(plant.ny)), "outputs": tuple(range(plant.ny)),
             "outliers": (), "usual": None}  # fmt: skip
    return GreyBoxModel([FittedPlant.from_saved(state)])


def record(name):
    level = name == "tanks"
    u = signal(3)[:, None]
    u = np.abs(u) if level else u
    ny = 2 if name == "two outputs" else 1
    return u, np.abs(np.random.default_rng(4).normal(size=(6, ny))) * (1.0 if level else 0.3)
