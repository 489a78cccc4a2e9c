"""A case: the waveforms of a campaign and their truth, in one file that needs no simulator to read.

case = load_case(Path("build/out/structure/rig/7-none.npz"))
case.waves, case.floor_waves, case.strength, case.truth["numbers"]["EI"]
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.campaign import CampaignHeader, TireGeometry, Tolerance
from tirelib.core.arrays import BoolArray
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import Waveforms

NONE = "none"
_PLAIN = ("run", "turns", "scatter", "angle_std", "start", "group")


@dataclass(frozen=True)
class Case:
    """A campaign of a simulated tire.

    Attributes
    ----------
    family : str
        rig, continuum or ring.
    seed : int
        Seed of the tire, the plan and the day, counted within the family.
    kind : str
        none, an effect's name, or two joined by +.
    wanted : float
        Error ratio that was asked for; 1 of a plain tire.
    waves, floor_waves : Waveforms
        Waveforms with the hidden effect and without it: same tire, set points and noise.
    strength : mapping of effect to float
    known : bool
        Whether the catalogue has all that is hidden.
    ratio, white_ratio : float
        Reached ratio of the base model's rms residual, plain and with set points discounted.
    floor : float
        Rms residual of the base model without the effects [1]; NaN of a plain tire.
    truth : mapping
        numbers (of a ring, SI), vertical_stiffness and height by run, tire, seconds.
    """

    family: str
    seed: int
    kind: str
    wanted: float
    waves: Waveforms
    floor_waves: Waveforms
    strength: Mapping[str, float]
    known: bool
    ratio: float
    white_ratio: float
    floor: float
    truth: Mapping[str, Any]

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that are hidden."""
        return () if self.kind == NONE else tuple(self.kind.split("+"))

    @property
    def held_out(self) -> BoolArray:
        """Runs that take no part in a fit: none."""
        return np.zeros(len(self.waves), dtype=bool)


def case_file(out: Path, family: str, seed: int, kind: str, ratio: float) -> Path:
    """Return where a case is kept."""
    ending = "" if kind == NONE else f"-{ratio:.2f}"
    return out / family / f"{seed}-{kind}{ending}.npz"


def save_case(case: Case, file: Path) -> None:
    """Write a case whole or not at all; the waveforms in single precision."""
    file.parent.mkdir(parents=True, exist_ok=True)
    w = case.waves
    document = {
        name: getattr(case, name)
        for name in ("family", "seed", "kind", "wanted", "known", "ratio", "white_ratio", "floor")
    }
    document |= {
        "strength": dict(case.strength),
        "truth": dict(case.truth),
        "header": asdict(w.header),
    }
    arrays: dict[str, Any] = {name: getattr(w, name) for name in _PLAIN}
    arrays |= {f"c_{k}": v for k, v in w.conditions.items()}
    arrays |= {f"f_{k}": v for k, v in case.floor_waves.conditions.items()}
    part = file.with_suffix(".part.npz")
    np.savez_compressed(
        part,
        document=json.dumps(document),
        strain=w.strain.astype(np.float32),
        floor=(case.floor_waves.strain - w.strain).astype(np.float32),
        **arrays,
    )
    part.rename(file)


def load_case(file: Path | str) -> Case:
    """Read a case."""
    with np.load(file) as stored:
        document = json.loads(str(stored["document"]))
        strain = stored["strain"].astype(np.float64)
        floor = strain + stored["floor"]
        plain = {name: stored[name] for name in _PLAIN}
        header = _header(document["header"])

        def waves(values: Any, prefix: str) -> Waveforms:
            names = [n[2:] for n in stored.files if n.startswith(prefix)]
            return Waveforms(
                header=header,
                strain=values,
                conditions={n: stored[prefix + n] for n in names},
                extra={},
                low_pass=LowPass(),
                left_out={},
                **plain,
            )

        return Case(
            waves=waves(strain, "c_"),
            floor_waves=waves(floor, "f_"),
            strength=document["strength"],
            truth=document["truth"],
            **{
                name: document[name]
                for name in (
                    "family",
                    "seed",
                    "kind",
                    "wanted",
                    "known",
                    "ratio",
                    "white_ratio",
                    "floor",
                )
            },
        )


def _header(stored: dict[str, Any]) -> CampaignHeader:
    given = dict(stored)
    given["tire"] = TireGeometry(**given["tire"])
    given["tolerance"] = Tolerance(**given["tolerance"])
    given["gage_lateral"] = tuple(given["gage_lateral"])
    return CampaignHeader(**given)
