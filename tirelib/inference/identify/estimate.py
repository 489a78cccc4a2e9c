"""An identified number of ring or brush with its interval."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Estimate:
    """One identified number, SI.

    Attributes
    ----------
    name : str
        Name of a tire's number, or of a parameter of the brush's law.
    value, std : float
        Structural misfit included.
    low, high : float
        95 % interval, structural misfit included; not symmetric where the surface is no parabola,
        or the number is fitted by its logarithm.
    fit_std : float
        What the fit alone knows.
    flags : tuple of str
        not_identifiable, at_boundary, not_quadratic, beyond_geometry.
    helps : str
        The run or test that would make it identifiable; empty when it is.
    """

    name: str
    value: float
    std: float
    low: float
    high: float
    fit_std: float
    flags: tuple[str, ...]
    helps: str = ""

    @property
    def notes(self) -> dict[str, object]:
        """What a file holds beside value and deviation."""
        notes: dict[str, object] = {
            "interval_SI": [self.low, self.high],
            "flags": list(self.flags),
        }
        return notes | ({"helps": self.helps} if self.helps else {})
