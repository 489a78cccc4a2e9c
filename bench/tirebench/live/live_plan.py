"""What a live run consists of."""

from dataclasses import dataclass, field
from pathlib import Path

from tirebench.estimator.fmu_model import FmuFile
from tirebench.live.reader import ReaderPlan
from tirebench.live.recording_state import RecordingRule
from tirebench.recording.header import RecordingHeader
from tirebench.wire.conditions import Conditions


@dataclass(frozen=True, slots=True)
class LivePlan:
    """What runs.

    Attributes
    ----------
    reader : ReaderPlan
    file : FmuFile or None
        None: nothing is estimated.
    conditions : Conditions
    header : RecordingHeader
        Header of every recording.
    record : Path or None
        File of the recording that begins with the run.
    laps : bool
        Whether anybody looks at laps.
    rule : RecordingRule
    """

    reader: ReaderPlan
    file: FmuFile | None
    conditions: Conditions
    header: RecordingHeader
    record: Path | None = None
    laps: bool = True
    rule: RecordingRule = field(default_factory=RecordingRule)
