"""What a structural variant has beside other constants: a crown, and a belt that grows."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.diagnose.planted import runs
from tests.unit.identify.model_waves import TIRE
from tirelib.arrays import FloatArray
from tirelib.contact.layout import GAGES
from tirelib.diagnose import ensemble
from tirelib.diagnose import variant as module
from tirelib.diagnose.ensemble import variants
from tirelib.diagnose.refit import refit
from tirelib.diagnose.variant import CARRIED, CROWN, SHARES, STRIPS, crowned, flung, grown
from tirelib.errors import ParameterError
from tirelib.model.base import predict, values_of
from tirelib.model.state import Operating, State
from tirelib.waveforms import GRID

LOADS = np.array([2400.0, 4200.0, 6000.0])
VALUES = values_of(replace(TIRE, extension_stiffness=2e6))


def points(speed: float = 20.0, pressure: float = 2e5) -> Operating:
    n = LOADS.size
    still = np.zeros(n)
    return Operating(
        load=LOADS,
        pressure=np.full(n, pressure),
        omega=np.full(n, speed / TIRE.ring_radius),
        speed=np.full(n, speed),
        camber=still,
        slip_angle=still,
        slip_ratio=still,
        side_force=still,
        drive_force=still,
        order=np.linspace(0.0, 1.0, n),
        temperature=np.full(n, np.nan),
    )


def wave(curvature: float) -> FloatArray:
    return predict(VALUES, points(), [("contact", crowned(curvature))]).wave


def test_half_the_strips_stand_for_all() -> None:
    assert SHARES.sum() == pytest.approx(1.0)
    assert pytest.approx(np.mean(np.square(GAGES))) == SHARES @ STRIPS**2


def test_a_flat_tread_is_the_ring() -> None:
    np.testing.assert_allclose(wave(0.0), predict(VALUES, points()).wave, atol=2e-8)


def test_a_crown_takes_the_same_load_deeper_and_by_no_more_than_its_height() -> None:
    flat = predict(VALUES, points()).deflection
    crown = predict(VALUES, points(), [("contact", crowned(1.0))]).deflection
    assert (crown > flat).all()
    assert (crown - flat < 0.5 * max(STRIPS) ** 2).all()


def test_a_crown_carries_the_load() -> None:
    seen: list[FloatArray] = []

    def look(state: State) -> State:
        before = state.contact
        assert before is not None
        after = crowned(0.8)(state)
        # the belt's displacement is linear in the pressure: the first order tells the load
        assert after.belt is not None
        c_u = np.real(before.compliance.radial[:, 1])
        seen.append(-np.real(after.belt[:, 1, 0]) / c_u)
        seen.append(-np.real(before.displacement[:, 1, 0]) / c_u)
        return after

    predict(VALUES, points(), [("contact", look)])
    strips, whole = seen
    np.testing.assert_allclose(strips, whole, rtol=10 * CARRIED)


@settings(max_examples=8, deadline=None)
@given(curvature=st.floats(0.1, 1.2))
def test_what_a_crown_changes_grows_with_it(curvature: float) -> None:
    def size(c: float) -> float:
        return float(np.sqrt(np.mean((wave(c) - wave(0.0)) ** 2)))

    assert size(curvature) > size(0.5 * curvature) > 0.0


def test_every_variant_is_crowned_grown_and_flung(monkeypatch: pytest.MonkeyPatch) -> None:
    straight = runs()
    data = straight.data(with_deflection=False)
    base = refit(data, values_of(TIRE))
    seen: list[str] = []

    def spy(name: str) -> Callable[[State], State]:
        def change(state: State) -> State:
            seen.append(name)
            return state

        return change

    curvatures: list[float] = []

    def crown(curvature: float) -> Callable[[State], State]:
        curvatures.append(curvature)
        return spy("crown")

    monkeypatch.setattr(module, "crowned", crown)
    monkeypatch.setattr(module, "grown", spy("grown"))
    monkeypatch.setattr(module, "flung", spy("flung"))
    random = np.random.default_rng(4)
    for _ in range(3):
        assert np.isfinite(module.variant(data, base, random)).all()
    assert set(seen) == {"crown", "grown", "flung"}
    # the sidewalls hold a part of what makes the belt grow, so growth comes first
    assert seen.index("grown") < seen.index("flung") < seen.index("crown")
    assert len(set(curvatures)) == 3
    assert 0.0 <= min(curvatures) < max(curvatures) <= CROWN


def test_the_belt_grows_with_pressure_and_speed_as_a_hoop_does() -> None:
    n = LOADS.size
    at = points()
    run = replace(at, pressure=np.array([1.6e5, 2e5, 2.4e5]), omega=np.array([40.0, 40.0, 120.0]))
    state = State.of(VALUES, run, GRID)
    larger = grown(state)
    more = larger.radius - state.radius
    assert more.mean() == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_allclose(larger.free_radius - state.free_radius, more, rtol=1e-9)
    r = TIRE.ring_radius
    spin = TIRE.mass * (r * run.omega) ** 2
    hoop = (run.pressure * TIRE.belt_width * r + spin) * r / (2e6 + state.k_u * r**2)
    np.testing.assert_allclose(more, hoop - hoop.mean(), rtol=1e-9)
    assert more.shape == (n,)


def test_a_belt_that_does_not_stretch_keeps_its_radius_and_its_tension() -> None:
    run = replace(points(), omega=np.array([40.0, 80.0, 120.0]))
    state = State.of({**VALUES, "extension_stiffness": np.inf}, run, GRID)
    np.testing.assert_array_equal(grown(state).radius, state.radius)
    np.testing.assert_array_equal(flung(state).belt_tension, state.belt_tension)


def test_sidewalls_hold_a_part_of_what_spins() -> None:
    run = replace(points(), omega=np.array([40.0, 80.0, 120.0]))
    state = State.of(VALUES, run, GRID)
    lost = state.belt_tension - flung(state).belt_tension
    held = state.k_u * TIRE.ring_radius**2
    spin = TIRE.mass * (TIRE.ring_radius * run.omega) ** 2
    np.testing.assert_allclose(lost, spin * held / (held + 2e6), rtol=1e-9)


@pytest.mark.parametrize("stretch", [np.inf, 2e6])
def test_a_belt_that_does_not_stretch_has_variants_as_well(stretch: float) -> None:
    data = runs().data(with_deflection=False)
    model = refit(data, values_of(replace(TIRE, extension_stiffness=stretch)))
    rests = variants(data, model, members=3)
    assert rests.shape == (3, data.strain.size)
    assert np.isfinite(rests).all()


def test_no_variant_at_all_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> FloatArray:
        raise ParameterError("no tire")

    monkeypatch.setattr(ensemble, "variant", none)
    data = runs().data(with_deflection=False)
    with pytest.raises(ParameterError, match="none of 6 variants of the model has a solution"):
        variants(data, refit(data, values_of(TIRE)), members=2)
