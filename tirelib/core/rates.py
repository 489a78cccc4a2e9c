"""Sample rates of strain gages."""

from tirelib.core.errors import ParameterError

RATES = (100.0, 1e5)
"""Sample rates that are allowed, [Hz]; an estimator holds 6 to 12 s of samples."""


def check_rate(rate: float) -> None:
    """Check a sample rate [Hz].

    Raises
    ------
    ParameterError
        If it is not allowed.
    """
    low, high = RATES
    if not low <= rate <= high:
        raise ParameterError(
            f"sample rate = {rate} Hz; allowed are {low:g} .. {high:g} Hz; give the rate of the "
            "gages"
        )
