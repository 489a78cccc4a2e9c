"""A comparison as JSON (``tirelib-comparison/1``): N, deg, bar, km/h, microstrain, mm."""

from typing import Any

import numpy as np

from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.force_curves import Curve, curves_of, ranked
from tirelib.inference.compare.forces import ForceCell, ForceComparison
from tirelib.inference.compare.gages import Gage
from tirelib.inference.compare.regions import Region
from tirelib.inference.compare.sectors import Cell
from tirelib.inference.compare.sentences import place
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.compare.tracks import Track, track_fit

FORMAT = "tirelib-comparison/1"


def comparison_document(found: Comparison | ForceComparison) -> dict[str, Any]:
    """Return a comparison's numbers; keys are the same for strain and forces."""
    own = _forces(found) if isinstance(found, ForceComparison) else _strain(found)
    return {
        "format": FORMAT,
        "effects": [{"effect": u.effect.name, "strength": u.strength} for u in found.used],
        "axes": "iso",
        "quantity": found.quantity,
        "verdict": found.verdict,
        **found.told,
        "p": found.p,
        "smooth_floor": None,
        "smooth_share": None,
        "statements": list(found.sentences),
        "messages": list(found.messages),
        **{name: [] for name in ("regions", "set_points", "tracks", "gages", "curves", "runs")},
        "sources": [
            {"what": u.effect.name, "title": u.effect.title, "source": u.effect.source}
            for u in found.used
        ],
        **own,
        "floor_source": "history" if np.isfinite(own["floor"]) else None,
    }


def _strain(found: Comparison) -> dict[str, Any]:
    noise, floor, counted = found.noise, found.floor, found.chosen.straight
    errors = dict(zip(np.flatnonzero(counted).tolist(), found.error.by_run.tolist(), strict=True))
    return {
        "campaign": found.chosen.waves.header.name,
        "model": found.model.name,
        "unit": "ustrain",
        "repeats": noise.repeats,
        "residual_rms": 1e6 * found.rms,
        "residual_rms_noise": found.rms / noise.std,
        "measured_rms": 1e6 * found.measured_rms,
        "delay_us": 1e6 * found.error.delay,
        "delay_std_us": 1e6 * found.error.delay_std,
        "floor": floor.value,
        "smooth_floor": floor.smooth,
        "smooth_share": floor.share,
        "regions": [_region(region, found) for region in found.regions],
        "table": [_cell(cell, noise.std) for cell in found.table],
        "set_points": [
            row | {"largest_in_tolerances": abs(row["largest_in_tolerances"])}
            for row in found.points.told(found.run)
        ],
        "tracks": [_track(track, found) for track in found.tracks],
        "gages": [_gage(gage, found) for gage in found.gages],
        "runs": [
            {
                "run": int(found.run[i]),
                "counted": bool(counted[i]),
                "rms": 1e6 * float(found.run_rms[i]),
                "rms_noise": float(found.run_rms[i]) / noise.std,
                "error": errors.get(i),
                "model_edges_deg": np.rad2deg(found.prediction.edges[i]),
            }
            for i in range(len(found.run))
        ],
        "ranked": {name: int(found.run[i]) for name, i in found.ranked().items()},
    }


def _forces(found: ForceComparison) -> dict[str, Any]:
    curves = curves_of(found)
    return {
        "campaign": found.name,
        "model": found.model,
        "unit": found.unit,
        "repeats": found.repeats,
        "residual_rms": found.rms,
        "residual_rms_noise": found.rms / found.noise,
        "measured_rms": found.measured_rms,
        "floor": found.floor,
        "table": [_force_cell(cell, found.noise) for cell in found.table],
        "curves": [_curve(curve, found) for curve in curves],
        "ranked": {name: curve.words for name, curve in ranked(curves).items()} or None,
    }


def edge_value(by: str, value: float) -> float:
    """Return a condition in the unit that users see."""
    return float(QUANTITIES[by].told(value)) if by in QUANTITIES and np.isfinite(value) else value


def _unit(by: str) -> str:
    return QUANTITIES[by].words if by in QUANTITIES else ""


def _cell(cell: Cell, noise: float) -> dict[str, Any]:
    return {
        "by": cell.by,
        "value": edge_value(cell.by, cell.value),
        "unit": _unit(cell.by),
        "sector": cell.sector,
        "runs": cell.runs,
        "rms": 1e6 * cell.rms,
        "rms_noise": cell.rms / noise,
        "mean": 1e6 * cell.mean,
        "mean_std": 1e6 * cell.std,
    }


def _where(region: Region, found: Comparison) -> dict[str, Any]:
    return {
        "sector": place(region, found.prediction.edges),
        "from_rad": region.start,
        "to_rad": region.stop,
        "p": region.p,
    }


def _region(region: Region, found: Comparison) -> dict[str, Any]:
    return {
        **_where(region, found),
        "by": region.by,
        "side": region.side or None,
        "value": edge_value(region.by, region.value),
        "unit": _unit(region.by),
        "runs": region.runs,
        "mean": 1e6 * region.mean,
        "mean_std": 1e6 * region.std,
        "share": region.share,
    }


def _track(track: Track, found: Comparison) -> dict[str, Any]:
    fit = track_fit(track, found.chosen.straight)
    return {
        "name": track.name,
        "unit": track.unit,
        "noise": track.scale * track.noise,
        "rms": track.scale * fit.rms,
        "rms_noise": track.in_noise(fit.rms),
        "mean": track.scale * fit.mean,
        "mean_std": track.scale * fit.std,
        "rms_beside_mean": track.scale * fit.rms_beside,
        "runs": [int(run) for run in found.run],
        "measured": track.scale * track.measured,
        "model": track.scale * track.model,
        "model_std": track.scale * track.model_std,
    }


def _gage(gage: Gage, found: Comparison) -> dict[str, Any]:
    departure = gage.departure
    return {
        "gage": gage.number + 1,
        "lateral_mm": 1e3 * gage.lateral,
        "noise": 1e6 * gage.noise.std,
        "rms": 1e6 * gage.rms,
        "rms_noise": gage.rms / gage.noise.std,
        "sectors": [_cell(cell, gage.noise.std) for cell in gage.table],
        "departure": departure
        and {
            **_where(departure.region, found),
            "mean": 1e6 * departure.mean,
            "mean_std": 1e6 * departure.std,
            "mean_of_all_gages": 1e6 * departure.of_all,
        },
    }


def _force_cell(cell: ForceCell, noise: float) -> dict[str, Any]:
    return {
        "by": cell.by,
        "low": edge_value(cell.by, cell.low),
        "high": edge_value(cell.by, cell.high),
        "unit": _unit(cell.by),
        "points": cell.points,
        "rms": cell.rms,
        "rms_noise": cell.rms / noise,
        "mean": cell.mean,
        "excess": cell.excess,
        "excess_std": cell.excess_std,
    }


def _curve(curve: Curve, found: ForceComparison) -> dict[str, Any]:
    return {
        "words": curve.words,
        "load": curve.load,
        "pressure": edge_value("pressure", curve.pressure),
        "camber": edge_value("camber", curve.camber),
        "points": curve.points,
        "rms": curve.rms,
        "rms_noise": curve.rms / found.noise,
    }
