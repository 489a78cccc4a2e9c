"""A physical effect: a named change of the model's state with a strength."""

import re
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, TirelibError
from tirelib.core.units import TABLE
from tirelib.effects.brush_state import BrushState
from tirelib.effects.state import State

S = TypeVar("S")

HOOKS = {
    "stiffness": "constants",
    "inertia": "constants",
    "tread": "constants",
    "contact": "contact",
    "strain": "strain",
    "gage": "gage",
    "brush": "brush",
}
"""Stage of an effect, and where in the chain it acts."""

VARIES_WITH = frozenset(
    {
        "load",
        "pressure",
        "speed",
        "deflection",
        "slip_angle",
        "camber",
        "slip_ratio",
        "temperature",
        "order",
        "angle",
        "lateral",
    }
)

UNITS = frozenset(row.unit for row in TABLE) | {"MN"}
"""Parts of which a strength's unit may consist, with blanks, `/` and `^`."""

Strength = float | Sequence[float]
Law = (
    Callable[[State, float], State]
    | Callable[[State, Sequence[float]], State]
    | Callable[[BrushState, float], BrushState]
    | Callable[[BrushState, Sequence[float]], BrushState]
)
"""A law of the strain, or of stage brush; its strength is a number, or one of each component."""

TRIAL = 1e-3
"""Strength of a trial step, relative to the range."""


@dataclass(frozen=True)
class Effect:
    """One physical effect.

    Attributes
    ----------
    name, title : str
        Name as verdicts use it, and what it is in plain words.
    stage : str
        What it acts on (`HOOKS`).
    unit : str
        Unit of the strength.
    low, high : float
        Plausible strengths; the sign is part of it. Zero, which is the base model, lies inside.
        They hold for each component.
    varies_with : tuple of str
        Conditions with which its signature changes (`VARIES_WITH`): without variation of them it
        is dead or has twins.
    source : str
    law : callable
        (state, strength) -> changed state, see `Law`.
    components : int
        How many numbers the strength has; more than one where a phase is unknown as well
        (cosine, sine), or a form. The law then takes a sequence.
    needs : tuple of str
        Fields of the conditions that must be measured, for instance side_force.
    untestable : str
        Why no campaign can ever show it; empty if one can.
    exact : bool
        Whether the law is a definition, such as where an angle has its zero, which no tire can
        follow otherwise. All other laws are only roughly right.
    start : tuple of float
        Strength from which a fit starts, where at zero it could go either way; zero if empty.
    lacking : str
        What is wrong with a plan that cannot show the effect, for instance "no run rolls the other
        way"; by default, that no run varies one of the conditions in `varies_with`.
    """

    name: str
    title: str
    stage: str
    unit: str
    low: float
    high: float
    varies_with: tuple[str, ...]
    source: str
    law: Callable[[Any, Any], Any]
    components: int = 1
    needs: tuple[str, ...] = ()
    untestable: str = ""
    exact: bool = False
    start: tuple[float, ...] = ()
    lacking: str = ""

    def __post_init__(self) -> None:
        faults = []
        if not re.fullmatch(r"[a-z][a-z0-9_]*", self.name):
            faults.append(f"name {self.name!r} is not lower_case_with_underscores")
        if self.stage not in HOOKS:
            faults.append(f"stage {self.stage!r}; allowed are {', '.join(HOOKS)}")
        if not _known_unit(self.unit):
            faults.append(
                f"unit {self.unit!r}; allowed are units of the library such as 1, mm, mm^2, "
                "kg m, 1/kN or ustrain"
            )
        if not (-np.inf < self.low <= 0.0 <= self.high < np.inf and self.low < self.high):
            faults.append(
                f"range {self.low} .. {self.high}; finite numbers with low <= 0 <= high and "
                "low < high are needed (zero is the base model)"
            )
        unknown = set(self.varies_with) - VARIES_WITH
        if unknown:
            faults.append(
                f"varies_with {', '.join(sorted(unknown))}; allowed are "
                f"{', '.join(sorted(VARIES_WITH))}"
            )
        if not (isinstance(self.components, int) and self.components >= 1):
            faults.append(f"components {self.components!r}; a whole number from 1 on is needed")
        elif len(self.start) not in (0, self.components):
            faults.append(f"start {self.start!r}; it needs {self.components} numbers, or none")
        if faults:
            raise ParameterError(f"effect {self.name!r}, {self.origin}: " + "; ".join(faults))

    @property
    def origin(self) -> str:
        """File and line of the law."""
        code = getattr(self.law, "__code__", None)
        return f"{code.co_filename}, line {code.co_firstlineno}" if code else "unknown place"

    @property
    def hook(self) -> str:
        """Where in the chain the effect acts."""
        return HOOKS[self.stage]

    @property
    def step(self) -> float:
        """Strength of a small trial step toward the wider side of the range."""
        return TRIAL * self.toward

    @property
    def toward(self) -> float:
        """End of the range on its wider side."""
        return self.high if self.high >= -self.low else self.low

    @property
    def scale(self) -> float:
        """Largest plausible magnitude of the strength."""
        return max(self.high, -self.low)

    def along(self, component: int, strength: float) -> Strength:
        """Return a strength that has one component only; a plain number if there is but one."""
        if self.components == 1:
            return strength
        return tuple(strength if k == component else 0.0 for k in range(self.components))

    @property
    def trials(self) -> tuple[Strength, ...]:
        """Small trial strengths, one per component: a tangent is the change over `step`."""
        return tuple(self.along(k, self.step) for k in range(self.components))

    def unknown(self, conditions: object) -> tuple[str, ...]:
        """Return which of the needed conditions are not measured at every point."""
        return tuple(
            name for name in self.needs if not np.isfinite(getattr(conditions, name)).all()
        )

    def at(self, strength: Strength | FloatArray) -> tuple[str, Callable[[Any], Any]]:
        """Return hook and change for the chain at one strength, or its array of components.

        The change raises `ParameterError` with name, file and line if the law fails, returns no
        state, changes the shape of a field, or makes numbers that are none; and if a condition
        that the effect needs is not measured.
        """
        if isinstance(strength, np.ndarray):
            strength = float(strength[0]) if strength.size == 1 else tuple(strength.tolist())
        given = 1 if np.ndim(strength) == 0 else len(strength)  # type: ignore[arg-type]
        if given != self.components:
            raise ParameterError(
                f"effect {self.name!r}: the strength has {given} numbers, {strength!r}; "
                f"{self.components} are needed, in {self.unit}"
            )
        return self.hook, lambda state: self._change(state, strength)

    def _change(self, state: S, strength: Strength) -> S:
        missing = self.unknown(getattr(state, "conditions", None)) if self.needs else ()
        if missing:
            raise ParameterError(
                f"effect {self.name!r} needs {', '.join(missing)}, which is not measured in every "
                "run; record it, leave such runs out, or leave the effect out"
            )
        where = f"effect {self.name!r}, {self.origin}"
        try:
            changed: S = self.law(state, strength)
        except TirelibError as error:
            error.add_note(f"in {where}, strength {strength}")
            raise
        except Exception as error:
            # the first frame is this one, the second the law's own
            line = traceback.extract_tb(error.__traceback__)[:2][-1].lineno
            raise ParameterError(
                f"{where}: its law raised {type(error).__name__} in line {line} at strength "
                f"{strength}: {error}; correct the law"
            ) from error
        if type(changed) is not type(state):
            raise ParameterError(
                f"{where}: its law returned {type(changed).__name__}; the changed state is "
                "needed: end the law with `return state.but(...)`"
            )
        for fault in _faults(state, changed):
            raise ParameterError(f"{where}, strength {strength}: {fault}; correct the law")
        return changed


def _faults(before: S, after: S) -> list[str]:
    """Return what is wrong with the fields that a law has changed."""
    if not is_dataclass(after):
        return []
    found = []
    kind: Any = type(after)
    names, held = _held(kind)
    for name, old, new in zip(names, held(before), held(after), strict=True):
        if new is old or not isinstance(old, np.ndarray):
            continue
        if np.shape(new) != old.shape:
            found.append(f"{name} has shape {np.shape(new)}; {old.shape} is needed")
        elif np.asarray(new).dtype.kind not in "fc":
            found.append(f"{name} holds {np.asarray(new).dtype}; real numbers are needed")
        elif (none := np.isnan(new)).any() and (none & ~np.isnan(old)).any():
            point = int(np.argwhere(none)[0][0])
            found.append(f"{name} is not a number (NaN) at point {point}")
        elif np.iscomplexobj(new) and not np.iscomplexobj(old):
            found.append(f"{name} is complex; real numbers are needed")
    return found


@cache
def _held(kind: Any) -> tuple[tuple[str, ...], Callable[[object], tuple[Any, ...]]]:
    """Return the fields of a kind of state, and what gets them all at once."""
    names = tuple(field.name for field in fields(kind))
    return names, attrgetter(*names)


def _known_unit(unit: str) -> bool:
    """Whether a unit consists of known units."""
    if not isinstance(unit, str) or not unit.strip():
        return False
    if unit in UNITS:
        return True
    parts = [re.sub(r"\^-?\d$", "", part) for part in re.split(r"[ /*]", unit)]
    return all(part in UNITS for part in parts)


def effect(
    name: str,
    *,
    stage: str,
    unit: str,
    low: float,
    high: float,
    varies_with: tuple[str, ...] = (),
    source: str = "",
    components: int = 1,
    needs: tuple[str, ...] = (),
    untestable: str = "",
    exact: bool = False,
    start: tuple[float, ...] = (),
    lacking: str = "",
) -> Callable[[Law], Effect]:
    """Make an effect of a law; its docstring's first line is the title.

    Examples
    --------
    >>> @effect("stiffer", stage="stiffness", unit="1", low=0, high=1, source="example")
    ... def stiffer(state, strength):
    ...     'The sidewall is stiffer than thought.'
    ...     return state.but(k_u=state.k_u * (1 + strength))
    >>> stiffer.name, stiffer.hook
    ('stiffer', 'constants')
    """

    def make(law: Law) -> Effect:
        title = (law.__doc__ or name).strip().splitlines()[0]
        return Effect(
            name,
            title,
            stage,
            unit,
            float(low),
            float(high),
            tuple(varies_with),
            source,
            law,
            components,
            tuple(needs),
            untestable,
            exact,
            start,
            lacking,
        )

    return make
