"""A tire as a sensor: innerliner strain to load, slip angle, slip ratio and lateral force.

The names that a user needs are here. Each is imported when it is first used, so ``import tirelib``
is quick:

=====================================================  ==========================================
`read_campaign`, `check_campaign`, `import_campaign`   measurements
`observe`, `train`                                     strain to features, features to a calibration
`read_calibration`, `write_calibration`                calibrations
`StreamEstimator`                                      estimates from a live signal
`read_tire`, `write_tire`                              tires and models
`identify`, `compare`, `diagnose`, `add`, `simulate`   what a model holds, lacks, gains and predicts
`build_fmu`, `check_fmu`                               the estimator as an FMU
`feature_table`, `estimate_table`                      turns as pandas tables
`parameter_table`, `candidate_table`                   numbers and suspected effects as tables
=====================================================  ==========================================
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tirelib.core.version import __version__ as __version__

if TYPE_CHECKING:
    from tirelib.campaign import check_campaign, read_campaign
    from tirelib.campaign.importing.importer import import_campaign
    from tirelib.core.parameters import read_tire, write_tire
    from tirelib.estimators.calibration_file import read_calibration, write_calibration
    from tirelib.estimators.train import train
    from tirelib.fmu.build import build_fmu
    from tirelib.fmu.check import check_fmu
    from tirelib.journey import add, compare, diagnose, identify, simulate
    from tirelib.measured.observations import observe
    from tirelib.stream import StreamEstimator
    from tirelib.tables import candidate_table, estimate_table, feature_table, parameter_table

__all__ = [
    "StreamEstimator",
    "add",
    "build_fmu",
    "candidate_table",
    "check_campaign",
    "check_fmu",
    "compare",
    "diagnose",
    "estimate_table",
    "feature_table",
    "identify",
    "import_campaign",
    "observe",
    "parameter_table",
    "read_calibration",
    "read_campaign",
    "read_tire",
    "simulate",
    "train",
    "write_calibration",
    "write_tire",
]
_JOURNEY = "tirelib.journey"
_HOMES = {
    "StreamEstimator": "tirelib.stream",
    "add": _JOURNEY,
    "build_fmu": "tirelib.fmu.build",
    "candidate_table": "tirelib.tables",
    "check_campaign": "tirelib.campaign",
    "check_fmu": "tirelib.fmu.check",
    "compare": _JOURNEY,
    "diagnose": _JOURNEY,
    "estimate_table": "tirelib.tables",
    "feature_table": "tirelib.tables",
    "identify": _JOURNEY,
    "import_campaign": "tirelib.campaign.importing.importer",
    "observe": "tirelib.measured.observations",
    "parameter_table": "tirelib.tables",
    "read_calibration": "tirelib.estimators.calibration_file",
    "read_campaign": "tirelib.campaign",
    "read_tire": "tirelib.core.parameters",
    "simulate": _JOURNEY,
    "train": "tirelib.estimators.train",
    "write_calibration": "tirelib.estimators.calibration_file",
    "write_tire": "tirelib.core.parameters",
}
"""The module of each name."""


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value = getattr(import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
