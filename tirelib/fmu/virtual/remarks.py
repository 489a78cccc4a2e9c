"""What ``VirtualTire.fmu`` logs, once of each input, where one is out of range.

The Python FMU fills the texts in here, the compiled one reads them from its resources.
"""

from collections.abc import Mapping

REMEDY: Mapping[str, tuple[str, str]] = {
    "Fz": ("N", "newtons, positive"),
    "alpha": ("rad", "radians"),
    "kappa": ("1", "shares of the speed, negative when braking"),
    "camber": ("rad", "radians"),
    "speed": ("m/s", "metres per second, positive forward"),
    "pressure": ("Pa", "pascal above the atmosphere"),
    "friction": ("1", "shares of the load"),
}
"""By input, in the order of the surface: its unit, and how it is to be given."""


def lines() -> list[str]:
    """Return the texts, in the order of the inputs."""
    return [
        f"{name}_out_of_range: {name} [{unit}] = {{value}}; the virtual tire holds for {{low}} .. "
        f"{{high}}; beyond, the last frame is held: give it in {way}"
        for name, (unit, way) in REMEDY.items()
    ]


def text(name: str, value: float, low: float, high: float) -> str:
    """Return what is logged of an input.

    Examples
    --------
    >>> text("speed", 65.0, 5.0, 42.0)[:51]
    'speed_out_of_range: speed [m/s] = 65; the virtual t'
    """
    line = lines()[list(REMEDY).index(name)]
    return line.format(value=f"{value:g}", low=f"{low:g}", high=f"{high:g}")
