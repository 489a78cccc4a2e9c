"""The first round of a diagnosis, as a judge of any residual."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import Candidates
from tirelib.diagnose.noise import noise_in, white_noise
from tirelib.diagnose.plain import usual
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.stage import ALARM, Stage
from tirelib.diagnose.stored import ensemble_of
from tirelib.effects import Effect
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.waveform_fit import Data


@dataclass(frozen=True, slots=True)
class FirstRound:
    """A model's ranking with its thresholds.

    Attributes
    ----------
    stage : Stage
    """

    stage: Stage

    @classmethod
    def of(
        cls,
        runs: StraightRuns,
        data: Data,
        base: Refit,
        catalogue: Sequence[Effect],
        *,
        members: int,
        seed: int,
        progress: Callable[[str], None] | None = None,
    ) -> "FirstRound":
        """Return the ranking of a fitted model at a campaign's plan and noise.

        Parameters
        ----------
        members, seed : int
            Of the ensemble that the thresholds are from.
        """
        rests = ensemble_of(
            data, base, noise=noise_in(runs), members=members, seed=seed, progress=progress
        )
        level = white_noise(runs, base, data.strain)
        return cls(Stage.of(data, base, catalogue, rests, level, {}))

    @property
    def found(self) -> Candidates:
        """The living candidates and the dead."""
        return self.stage.found

    def first(self, rest: FloatArray) -> str:
        """Return who comes first for a residual (n_runs, n_phi), empty without an alarm.

        Empty as well if it is in no catalogue, which names nobody, or no more than plain tires
        show beside the effects of the model.
        """
        judged = self.stage.of_residual(rest)
        leaders = judged.leaders(set(judged.names), ALARM, 1.0)
        if not leaders or judged.unlisted[leaders[0]]:
            return ""
        effect = judged.found.living[leaders[0]].effect
        strength = judged.scores.strength[leaders[0]]
        return "" if usual(judged.model.effects, effect, strength) else effect.name
