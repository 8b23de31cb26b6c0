"""Whether a value is of the type that a class gives an attribute."""

from __future__ import annotations

from collections.abc import Sequence
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

# What else passes for a number in Python.
ALSO = {float: (float, int, np.floating, np.integer), int: (int, np.integer), bool: (bool, np.bool_)}
NAMES = {int: "a whole number", float: "a number", bool: "true or false", str: "a text", type(None): "null"}


def hints_of(kind: type) -> dict[str, Any]:
    """Give the types of a class by attribute; none where a stranger's annotations cannot be evaluated."""
    try:
        return get_type_hints(kind)
    except Exception:  # prose, or a name that is not there at run time
        return {}


def fits(value: Any, hint: Any) -> bool:
    """Whether a value is of an annotated type, as far as that is made of classes, Literal, unions, lists and tuples."""
    origin, args = get_origin(hint), get_args(hint)
    if origin is Literal:
        return value in args
    if origin in (Union, UnionType):
        return any(fits(value, one) for one in args)
    if origin in (list, tuple):
        if not isinstance(value, origin):
            return False
        items = args if origin is tuple and args[-1] is not ... else args[:1] * len(value)
        return len(value) == len(items) and all(map(fits, value, items))
    if hint is Any or not isinstance(origin or hint, type):
        return True
    return isinstance(value, ALSO.get(hint, origin or hint))


def in_words(hint: Any) -> str:
    """Say what a parameter may be."""
    if get_origin(hint) is Literal:
        return " or ".join(map(str, get_args(hint)))
    if get_origin(hint) in (Union, UnionType):
        return " or ".join(dict.fromkeys(map(in_words, get_args(hint))))
    if get_origin(hint) in (Sequence, list, tuple):
        return "a list"
    return NAMES.get(hint, str(hint))
