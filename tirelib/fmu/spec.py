"""Description of a slave from which `tirelib.fmu.export.export` makes an FMU."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tirelib.fmu.variables import Variable


@dataclass(frozen=True, slots=True)
class SlaveSpec:
    """One FMU to be made.

    Attributes
    ----------
    model : str
        Name of the model and of the slave's class, such as ``StrainTire``.
    script : str
        File in ``fmu_src`` that holds the class, such as ``strain_tire.py``.
    description : str
        One line for the model description.
    table : sequence of Variable
        What the slave's `table` returns.
    step_size : float, [s]
        Communication step of the default experiment.
    settings : mapping
        Becomes part of ``resources/settings.json``.
    resources : mapping of str to bytes
        Further files of ``resources``, by path.
    documentation : mapping of str to bytes
        Files of ``documentation``, by path; ``index.html`` among them. ``{version}`` in it is
        replaced.
    icon : bytes
        PNG shown by tools.
    start_depends_on : sequence of str, optional
        Names of the variables that the outputs at the start depend on; None: maybe all.
    fmi : int
        Version of FMI, 2 or 3.
    texts : sequence of str, optional
        What the compiled slave logs, see `tirelib.fmu.remarks`.
    """

    model: str
    script: str
    description: str
    table: Sequence[Variable]
    step_size: float
    settings: Mapping[str, int | float | str | bool]
    resources: Mapping[str, bytes] = field(repr=False)
    documentation: Mapping[str, bytes] = field(repr=False)
    icon: bytes = field(repr=False)
    start_depends_on: Sequence[str] | None = None
    fmi: int = 2
    texts: Sequence[str] = ()
