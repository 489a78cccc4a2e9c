"""Suspects fitted one after the other, whatever they are fitted to."""

from collections.abc import Callable, Mapping
from typing import TypeVar

from tirelib.errors import TirelibError
from tirelib.planning.criterion import Rival

LOST = 0.5
"""Chi-square by which a rival may be worse than without its effect before its fit has failed."""

Fitted = TypeVar("Fitted", bound=Rival)


def fitted_rivals(
    fits: Mapping[str, Callable[[], Fitted]],
    nothing: Fitted,
    *,
    with_nothing: bool = False,
    progress: Callable[[str], None] | None = None,
) -> tuple[tuple[Fitted, ...], dict[str, str]]:
    """Return the rivals whose fits are good, and why the others are left out.

    Parameters
    ----------
    fits : mapping of name to callable
        Return the fit with that effect, or raise `TirelibError`.
    nothing : Rival
        The fit without any of them, which none can be worse than.
    with_nothing : bool
        Whether that is a rival too, the first.
    progress : callable, optional
    """
    rivals, left_out = [nothing] if with_nothing else [], {}
    for name, fit in fits.items():
        if progress is not None:
            progress(f"fit with {name}")
        try:
            rival = fit()
        except TirelibError as error:
            left_out[name] = f"its fit did not converge: {error}"
            continue
        if rival.cost > nothing.cost + LOST:
            left_out[name] = (
                f"its fit did not reach the minimum: chi-square {rival.cost:.1f} with it, "
                f"{nothing.cost:.1f} without"
            )
        else:
            rivals.append(rival)
    return tuple(rivals), left_out
