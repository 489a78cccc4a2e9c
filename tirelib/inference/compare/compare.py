"""Hold a model against a campaign."""

from collections.abc import Callable, Mapping

from tirelib.campaign import Campaign
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.core.parameters import TireFile
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.compare.forces import ForceComparison, compare_forces
from tirelib.inference.compare.model import model_of
from tirelib.inference.compare.strain import Comparison, compare_strain
from tirelib.inference.identify.force_data import FORCES
from tirelib.measured.waveforms import measure_waveforms

QUANTITIES = ("strain", *FORCES)
BRUSH = ("bristle_lateral", "bristle_longitudinal", "friction")
"""Numbers that a model of the brush states."""


@one_thread()
def compare(
    campaign: Campaign,
    file: TireFile,
    quantity: str | None = None,
    *,
    effects: Mapping[str, Effect] = CATALOGUE,
    progress: Callable[[str], None] | None = None,
) -> Comparison | ForceComparison:
    """Hold a model against one quantity of a campaign.

    Parameters
    ----------
    campaign : Campaign
    file : TireFile
        A model or a tire.
    quantity : str, optional
        strain, Fy, Fx or Mz; by default strain where the campaign has it, else the force with the
        largest lack of fit.
    effects : mapping
        By name, as the model's file names them.
    progress : callable, optional
        Called with a label after each run.

    Raises
    ------
    ParameterError
        If the quantity is unknown.
    CalibrationError
        If the campaign does not hold it, or the model cannot say it.
    """
    if quantity is not None and quantity not in QUANTITIES:
        raise ParameterError(f"compare: quantity {quantity!r}; allowed are {', '.join(QUANTITIES)}")
    has_strain = bool(campaign.header.gage_lateral)
    if quantity == "strain" and not has_strain:
        raise CalibrationError(
            f"{campaign.header.name}: it has no strain gages; compare its forces: --quantity "
            f"{', '.join(FORCES)}"
        )
    if quantity == "strain" or (quantity is None and has_strain):
        needs_ring(campaign, file)
        waves = measure_waveforms(campaign, progress=progress)
        return compare_strain(waves, model_of(file, effects), campaign.content_hash())
    return compare_forces(campaign, file, quantity, effects)


def needs_ring(campaign: Campaign, file: TireFile) -> None:
    """Refuse to predict strain from a file that states no ring."""
    if not file.missing:
        return
    name, brush = campaign.header.name, [key for key in BRUSH if key in file.numbers]
    lacks = f"{len(file.missing)} numbers of the ring are missing ({', '.join(file.missing)})"
    if brush:
        raise CalibrationError(
            f"{file.name}: it is a model of the brush only ({', '.join(brush)}) and says nothing "
            f"of the strain of {name}: {lacks}; look at its forces in runs with slip, --quantity "
            f"{', '.join(FORCES)}, or identify the ring from straight runs with `tirelib identify`"
        )
    raise CalibrationError(
        f"{file.name}: it states no complete ring, so it says nothing about the strain of {name}: "
        f"{lacks}; identify the tire from straight runs with `tirelib identify`, or add them"
    )
