"""Laws of the single gages: own noise, own difference, and what is said of them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.inference.compare.compare_synthetic import bump, model_file, waveforms
from tirelib.inference.compare.document import comparison_document
from tirelib.inference.compare.model import model_of
from tirelib.inference.compare.sectors import weighted_variance
from tirelib.inference.compare.strain import Comparison, compare_strain
from tirelib.measured.waveforms import GRID, Waveforms
from tirelib.report.comparison import strain_parts

MODEL = model_of(model_file())
PLANT, NOISE = 3e-4, 4e-6


def apart(waves: Waveforms, gage: int | None) -> Waveforms:
    """Return waveforms whose gages have noise of their own, and one a plateau in the contact."""
    rng = np.random.default_rng(7)
    orders = rng.standard_normal((*waves.strain.shape[:2], 40, 2)) @ np.array([1.0, 1j])
    own = np.fft.irfft(np.pad(orders, ((0, 0), (0, 0), (1, GRID.size // 2 - 40))), n=GRID.size)
    strain = waves.strain + NOISE * own / own.std()
    if gage is not None:
        strain[:, gage] += bump(-0.1, 0.1, PLANT)(waves.conditions["Fz"], GRID)
    return replace(waves, strain=strain - strain.mean(axis=2, keepdims=True))


@pytest.fixture(scope="module")
def found() -> Comparison:
    return compare_strain(apart(waveforms(), 3), MODEL)


def test_the_gage_that_differs_is_told_by_its_place_and_no_other(found: Comparison) -> None:
    departing = [gage.number for gage in found.gages if gage.departure is not None]
    assert departing == [3]
    departure = found.gages[3].departure
    assert departure is not None
    assert departure.region.start == pytest.approx(-0.1, abs=0.026)
    assert departure.region.stop == pytest.approx(0.1, abs=0.026)
    # set points of the mean take some per cent of a plateau
    assert departure.mean == pytest.approx(-PLANT, rel=0.12)
    assert departure.of_all == pytest.approx(-PLANT / 5, rel=0.35)
    # the mean over a region's runs is surer than one run by the root of their number
    inside = (departure.region.start <= GRID) & (departure.region.stop > GRID)
    weights = np.tile(inside / inside.sum(), (len(found.run), 1))
    each = weighted_variance(weights, found.gages[3].noise, found.points)
    one = np.sqrt(each[departure.region.member].mean())
    assert departure.std == pytest.approx(one / np.sqrt(departure.region.runs))
    said = [text for text in found.sentences if text.startswith("At the gage")]
    assert len(said) == 1
    assert said[0].startswith("At the gage at y = -30 mm, in the contact, from -0.10 to 0.10 rad")
    assert "too little tension" in said[0]


def test_gages_that_differ_by_noise_alone_are_not_told() -> None:
    quiet = compare_strain(apart(waveforms(seed=2), None), MODEL)
    assert all(gage.departure is None for gage in quiet.gages)
    assert not any("gage" in text for text in quiet.sentences)


def test_the_noise_of_a_gage_is_its_own(found: Comparison) -> None:
    # common noise of 3 and own noise of 4 microstrain; eight repeats tell it to some per cent
    for gage in found.gages:
        assert gage.noise.std == pytest.approx(np.hypot(3e-6, NOISE), rel=0.2)
    assert found.noise.std == pytest.approx(np.hypot(3e-6, NOISE / np.sqrt(5)), rel=0.2)


def test_sectors_of_gages_average_to_those_of_the_mean(found: Comparison) -> None:
    whole = {cell.sector: cell.mean for cell in found.table if cell.by == "all"}
    for k, (name, mean) in enumerate(whole.items()):
        each = [gage.table[k].mean for gage in found.gages]
        assert found.gages[0].table[k].sector == name
        # taking the mean over gages and over runs commutes
        assert np.mean(each) == pytest.approx(mean, abs=1e-12)


def test_json_and_page_hold_every_gage_by_its_lateral_position(found: Comparison) -> None:
    rows = comparison_document(found)["gages"]
    assert [row["lateral_mm"] for row in rows] == [60.0, 30.0, 0.0, -30.0, -60.0]
    contact = [row["sectors"][0]["mean"] for row in rows]
    assert int(np.argmin(contact)) == 3
    assert rows[3]["departure"]["mean"] == pytest.approx(-1e6 * PLANT, rel=0.12)
    assert rows[0]["departure"] is None
    part = next(part for part in strain_parts(found) if part.anchor == "gages")
    assert [row[0] for row in part.tables[0].rows] == [
        "+60 mm",
        "+30 mm",
        "0 mm",
        "-30 mm",
        "-60 mm",
    ]
    heat = part.plots[0].figure
    # from the right to the left, upward
    assert next(iter(heat.layout.yaxis.ticktext)) == "y = -60 mm"
    z = np.array(heat.data[0].z)
    assert int(np.argmin(z[:, 180])) == 1


def test_one_gage_has_a_table_and_no_departure() -> None:
    waves = waveforms()
    header = replace(waves.header, gage_lateral=(0.0,))
    single = compare_strain(replace(waves, header=header, strain=waves.strain[:, :1]), MODEL)
    assert len(single.gages) == 1
    assert single.gages[0].departure is None
    assert single.gages[0].rms == pytest.approx(single.rms)
