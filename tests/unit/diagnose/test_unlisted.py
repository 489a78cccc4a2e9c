"""Gains that go with a condition: told for what they are, and never named."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.diagnose.planted import model_file, waves
from tirelib.arrays import FloatArray
from tirelib.compare.model import model_of
from tirelib.diagnose.diagnose import Diagnosis, diagnose
from tirelib.diagnose.document import assess, diagnosis_document, told_like
from tirelib.diagnose.unlisted import UNLISTED
from tirelib.effects import CATALOGUE, Effect
from tirelib.identify.campaign_data import straight_runs
from tirelib.waveforms import Waveforms

MEMBERS = 12
OWN = [CATALOGUE[name] for name in ("sidewall_load", "gage_drift", "gage_saturation", "tread_load")]


def with_gain(share: FloatArray) -> Waveforms:
    """Return runs that lack nothing but whose gages show more by a share of their own."""
    plain = waves()
    return replace(plain, strain=plain.strain * (1.0 + share)[:, None, None])


def condition(name: str) -> FloatArray:
    values = waves().conditions[name]
    return np.asarray(values / values.mean() - 1.0)


def verdict(measured: Waveforms, catalogue: list[Effect]) -> Diagnosis:
    runs = straight_runs(measured)
    values = model_of(model_file()).values
    return diagnose(runs, values, catalogue, members=MEMBERS)


@pytest.fixture(scope="module")
def by_pressure() -> Diagnosis:
    return verdict(with_gain(0.3 * condition("pressure")), OWN)


def test_a_gain_that_goes_with_pressure_is_unknown_and_told_by_its_law(
    by_pressure: Diagnosis,
) -> None:
    assert by_pressure.verdict == "unknown"
    assert by_pressure.named == ()
    assert by_pressure.like is not None
    assert by_pressure.like.effect.name == "gain_by_pressure"
    told = told_like(by_pressure.like)
    assert "gain of the gages that goes with the inflation pressure" in told
    assert "no catalogue" in told


def test_a_candidate_of_no_catalogue_is_in_no_table(by_pressure: Diagnosis) -> None:
    names = {effect.name for effect in UNLISTED}
    document = diagnosis_document(assess(by_pressure, model_of(model_file())))
    shown = {entry["effect"] for entry in document["candidates"]}
    twins = {twin["effect"] for entry in document["candidates"] for twin in entry["twins"]}
    assert not names & (shown | twins | set(document["dead"]))
    assert shown == {effect.name for effect in OWN}
    assert document["unexplained"]["like"]["title"].startswith("Gain of the gages")
    assert "bond and amplifier" in document["next_test"]["what"]


def test_the_same_law_in_the_users_catalogue_is_named() -> None:
    law = next(effect for effect in UNLISTED if effect.name == "gain_by_pressure")
    mine = replace(law, name="mine", low=-0.5, high=0.5)
    found = verdict(with_gain(0.3 * condition("pressure")), [*OWN, mine])
    assert found.named == ("mine",)
    assert found.like is None


def test_a_gain_that_drifts_is_an_effect_of_the_catalogue() -> None:
    place = np.linspace(-0.5, 0.5, len(waves()))
    found = verdict(with_gain(0.06 * place), OWN)
    assert found.named == ("gage_drift",)
    assert found.like is None


def test_nothing_is_told_where_nothing_is_missing() -> None:
    found = verdict(waves(), OWN)
    assert found.verdict == "none"
    assert found.like is None
