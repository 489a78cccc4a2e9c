"""The suspects: the effects of a diagnosis that its campaign does not tell apart."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from tirelib.core.errors import ParameterError
from tirelib.effects import Effect

MOST_SUSPECTS = 3
"""Suspects taken at most."""


@dataclass(frozen=True, slots=True)
class Suspects:
    """Effects between which a further test is to decide.

    Attributes
    ----------
    names : tuple of str
    beside : tuple of str
        Named effects that nobody doubts; the model needs them.
    with_nothing : bool
        Whether that none of them acts is possible too.
    why : str
        In words.
    """

    names: tuple[str, ...]
    beside: tuple[str, ...]
    with_nothing: bool
    why: str


def suspects_of(told: Mapping[str, Any], catalogue: Mapping[str, Effect]) -> Suspects:
    """Return the suspects of a diagnosis.

    Effects of the smallest sets that are not in all of them; else a named effect with its twins
    that are alarms or hints; else, where nothing is named, the leading hints, each against
    nothing. `told` is a diagnosis as JSON, ``tirelib-diagnosis/1``.

    Raises
    ------
    ParameterError
        If the diagnosis names an effect that the catalogue does not hold.
    """
    entries = {entry["effect"]: entry for entry in told["candidates"]}
    named = list(told["named"])
    alive = [
        name for name, e in entries.items() if e["level"] in ("alarm", "hint") and e["in_range"]
    ]
    alone = [[name] for name in named] if told["verdict"] == "indistinguishable" else []
    sets = told.get("sets") or alone
    if len(sets) > 1:
        common = [name for name in named if all(name in names for names in sets)]
        every = dict.fromkeys(name for names in sets for name in names)
        differ = [name for name in every if not all(name in names for names in sets)]
        why = "the campaign cannot distinguish them"
        return _known(differ[:MOST_SUSPECTS], common, catalogue, False, why)
    for name in named:
        twins = [twin["effect"] for twin in entries.get(name, {}).get("twins", [])]
        doubtful = [twin for twin in twins if twin in alive and twin not in named]
        if doubtful:
            others = [other for other in named if other != name]
            rivals = " and ".join(doubtful[: MOST_SUSPECTS - 1])
            why = f"{name} is named, and looks much like {rivals}"
            chosen = [name, *doubtful][:MOST_SUSPECTS]
            return _known(chosen, others, catalogue, False, why)
    if named or not alive:
        why = "nothing is in doubt"
        if named:
            why += f"; for a run that would confirm {named[0]} give --suspects {named[0]}"
        return Suspects((), (), False, why)
    why = f"no more than a hint: {', '.join(alive[:MOST_SUSPECTS])}"
    return _known(alive[:MOST_SUSPECTS], [], catalogue, True, why)


def _known(
    names: Sequence[str],
    beside: Sequence[str],
    catalogue: Mapping[str, Effect],
    with_nothing: bool,
    why: str,
) -> Suspects:
    """Return suspects of a diagnosis; raise ParameterError if the catalogue lacks one."""
    for name in (*names, *beside):
        if name not in catalogue:
            raise ParameterError(
                f"the diagnosis names {name!r}, which is not known; load the file that defines it "
                "with --effects, or diagnose again"
            )
    return Suspects(tuple(names), tuple(beside), with_nothing, why)


def given_suspects(
    names: Sequence[str],
    has: Sequence[str],
    catalogue: Mapping[str, Effect],
    quantity: str = "strain",
    in_base: Collection[str] = (),
) -> Suspects:
    """Return suspects by name; one alone stands against nothing.

    Raises
    ------
    ParameterError
        If a name is unknown or given twice, the model has the effect or fits it, or it does not
        act on the quantity; with every fault.
    """
    faults = []
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            faults.append(f"{name} is given {names.count(name)} times")
        if name not in catalogue:
            faults.append(f"{name!r} is not known, {_nearest(name, catalogue)}")
        elif name in has:
            faults.append(f"the model has {name} already")
        elif name in in_base:
            faults.append(f"the base model fits {name} as a number")
        elif catalogue[name].hook == "brush" and quantity == "strain":
            faults.append(f"{name} acts on the brush, which strain does not show")
        elif catalogue[name].hook != "brush" and quantity != "strain":
            faults.append(f"{name} acts on strain, which {quantity} does not show")
        elif catalogue[name].untestable:
            faults.append(f"{name} cannot be tested: {catalogue[name].untestable}")
    if not names or len(names) > MOST_SUSPECTS:
        faults.append(f"{len(names)} effects are given; 1 to {MOST_SUSPECTS} are allowed")
    if faults:
        raise ParameterError(f"suspects: {'; '.join(faults)}; correct --suspects")
    return Suspects(tuple(names), (), len(names) == 1, "given")


def _nearest(name: str, catalogue: Mapping[str, Effect]) -> str:
    near = get_close_matches(name, catalogue, n=3)
    return f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(catalogue)}"
