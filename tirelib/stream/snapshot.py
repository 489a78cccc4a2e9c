"""The private state of the signal chain as JSON, exactly.

Floats are written as their bytes, so that NaN and the last digit survive. Every attribute of the
cutter and its contact finder is taken, so one that is added later cannot be forgotten; a type that
is not known here is an error.
"""

from base64 import b64decode, b64encode
from collections import deque
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from tirelib.core.errors import FormatError
from tirelib.estimators.estimate import Estimates
from tirelib.measured.features.extract import Features
from tirelib.measured.signal.contacts import Contact, ContactFinder
from tirelib.measured.signal.lowpass import LowPass
from tirelib.measured.signal.turns import TurnCutter

_OWN = ("_finder", "_samples")
"""What a cutter consists of that has a state of its own."""


def to_plain(value: Any) -> Any:
    """Return a value as JSON knows it; `from_plain` gives it back exactly.

    Raises
    ------
    FormatError
        If the type is unknown.

    Examples
    --------
    >>> from_plain(to_plain((1, [np.nan, None], np.array([0.1]))))
    (1, [nan, None], array([0.1]))
    """
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, np.generic):
        value = value.item() if isinstance(value, np.bool_ | np.integer) else float(value)
        return to_plain(value)
    if isinstance(value, float):
        return {"float": value.hex()}
    if isinstance(value, np.ndarray):
        data = b64encode(np.ascontiguousarray(value).tobytes()).decode("ascii")
        return {"array": data, "type": value.dtype.str, "shape": list(value.shape)}
    for name, kind in _CONTAINERS.items():
        if type(value) is kind:
            return {name: [to_plain(item) for item in value]}
    if isinstance(value, dict):
        return {"dict": [[key, to_plain(item)] for key, item in value.items()]}
    name = type(value).__name__
    if is_dataclass(value) and name in _classes():
        return {name: [to_plain(getattr(value, field.name)) for field in fields(value)]}
    raise FormatError(
        f"state: {type(value).__name__} cannot be saved; add its type to tirelib.stream.snapshot"
    )


def from_plain(plain: Any) -> Any:
    """Return what `to_plain` was given."""
    if not isinstance(plain, dict):
        return plain
    if "array" in plain:
        flat = np.frombuffer(b64decode(plain["array"]), dtype=np.dtype(plain["type"]))
        return flat.reshape(plain["shape"]).copy()
    ((name, content),) = plain.items()
    if name == "float":
        return float.fromhex(content)
    if name == "dict":
        return {key: from_plain(item) for key, item in content}
    items = [from_plain(item) for item in content]
    if name in _CONTAINERS:
        return _CONTAINERS[name](items)
    return _classes()[name](*items)


def snapshot_cutter(cutter: TurnCutter) -> dict[str, Any]:
    """Return the state of a cutter: its finder, and the samples that it still needs."""
    state = {name: to_plain(value) for name, value in vars(cutter).items() if name not in _OWN}
    finder = vars(cutter)["_finder"]
    state["_finder"] = {name: to_plain(value) for name, value in vars(finder).items()}
    state["_samples"] = to_plain((cutter.needed(), cutter.taken))
    return state


def restore_cutter(cutter: TurnCutter, state: dict[str, Any]) -> None:
    """Bring a new cutter of the same rate and gages into a saved state."""
    finder = vars(cutter)["_finder"]
    for name, value in state.items():
        if name not in _OWN:
            setattr(cutter, name, from_plain(value))
    for name, value in state["_finder"].items():
        setattr(finder, name, from_plain(value))
    cutter.refill(*from_plain(state["_samples"]))


_CONTAINERS: dict[str, Callable[[list[Any]], Any]] = {"list": list, "tuple": tuple, "deque": deque}


def _classes() -> dict[str, Callable[..., Any]]:
    from tirelib.stream.estimate import TurnEstimate

    known = (Contact, ContactFinder, Estimates, Features, LowPass, TurnEstimate)
    return {kind.__name__: kind for kind in known}
