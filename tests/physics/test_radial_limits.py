"""Limits, options, convergence and refusals of the radial contact."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.physics.radial_case import TIRE, TREAD, on_a_grid, ring
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.core.parameters import read_tire
from tirelib.physics.contact.checks import LARGEST_ANGLE, carried
from tirelib.physics.contact.radial import RadialContact, fit_edges, load, press
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance, compliance
from tirelib.physics.ring.ring import Ring
from tirelib.report.simulation import simulate


def test_a_belt_that_stretches_gives_way_as_a_whole_too() -> None:
    """The mean: u (k_u - p b / R + EA / R^2) = -mean pressure; zero for the dissertation's ring."""
    stretching = replace(Ring.of(TIRE, TIRE.pressure), extension_stiffness=5e5)
    contact = press(compliance(stretching, 0.0, 60), TREAD, 0.025)
    np.testing.assert_allclose(contact.compression(contact.phi), contact.delta, atol=1e-12)
    mean = (contact.weights * contact.pressure).sum() / (2 * np.pi)
    r, line = TIRE.ring_radius, TIRE.pressure * TIRE.belt_width
    hold = TIRE.radial_stiffness - line / r + 5e5 / r**2
    assert contact.displacement[0, 0, 0].real == pytest.approx(-mean / hold, rel=1e-9)
    stiff = press(ring(0.0), TREAD, 0.025)
    assert stiff.displacement[0, 0, 0] == 0
    assert contact.load[0] < stiff.load[0]


def test_modes_and_nodes_converge() -> None:
    """Fz for 30, 60, 120 modes as in the errata; nodes converge faster than any power."""
    fz = [press(ring(n_modes=n), TREAD, 0.025).load[0] for n in (30, 60, 120)]
    np.testing.assert_allclose(fz, [5129.40, 5128.73, 5128.73], atol=0.02)
    for d0 in (0.01, 0.025, 0.045):
        best = press(ring(), TREAD, d0, n_nodes=120).load[0]
        error = [abs(press(ring(), TREAD, d0, n_nodes=n).load[0] / best - 1) for n in (12, 20, 40)]
        assert error[0] < 1e-4
        assert error[1] < 1e-6
        assert error[2] < 1e-9  # the stopping tolerance; a uniform grid of 200 is at 1e-4


def test_forty_gauss_nodes_beat_two_hundred_uniform_ones() -> None:
    best = press(ring(), TREAD, 0.03, n_nodes=120).load[0]
    gauss = abs(press(ring(), TREAD, 0.03).load[0] - best)
    uniform = abs(on_a_grid(0.04, 0.03, 301)[0] - best)  # some 200 of the 301 are in contact
    assert gauss < 1e-4 * uniform


@given(st.floats(0.005, 0.045), st.floats(1.0, 150.0))
def test_without_damping_speed_changes_nothing(d0: float, omega: float) -> None:
    still, rolling = press(ring(0.0, 0.0), TREAD, d0), press(ring(0.0, omega), TREAD, d0)
    assert rolling.load[0] == pytest.approx(still.load[0], rel=1e-10)
    np.testing.assert_allclose(rolling.edges, still.edges, atol=1e-10)
    np.testing.assert_allclose(still.edges[0, 0], -still.edges[0, 1], rtol=1e-9)


def test_damping_moves_the_pressure_to_the_entry() -> None:
    lam = np.linspace(0.0, 0.12, 7)
    wheel = replace(Ring.of(TIRE, TIRE.pressure), damping=lam)
    contact = press(compliance(wheel, 59.0, 60), TREAD, 0.03)
    assert abs(contact.pressure_centre[0]) < 1e-9
    assert (np.diff(contact.pressure_centre) < -1e-4).all()
    assert (np.diff(contact.edges, axis=0) < 0).all()
    back = press(compliance(wheel, -59.0, 60), TREAD, 0.03)
    np.testing.assert_allclose(back.pressure_centre, -contact.pressure_centre, atol=1e-9)
    np.testing.assert_allclose(back.edges[:, ::-1], -contact.edges, atol=1e-9)


def test_more_load_makes_a_longer_patch_and_a_deeper_one() -> None:
    contact = load(ring(), TREAD, np.linspace(300, 11000, 30))
    assert (np.diff(contact.deflection) > 0).all()
    assert (np.diff(contact.edges[:, 1] - contact.edges[:, 0]) > 0).all()


def test_more_pressure_makes_a_shorter_patch_at_equal_load() -> None:
    for name in ("table-6-2-195-65r15", "jenkins"):
        tire = read_tire(name).tire
        wheel = Ring.of(tire, np.linspace(1.3e5, 2.5e5, 7))
        contact = load(compliance(wheel, 59.0, 60), Tread.of(tire), 4266.0)
        assert (np.diff(contact.deflection) < 0).all()
        assert (np.diff(contact.edges[:, 1] - contact.edges[:, 0]) < 0).all()


def test_stiff_tread_and_small_load_limits() -> None:
    """A stiff tread bends the belt onto the road; a small load presses only tread and belt."""
    soft, stiff = (
        press(ring(), replace(TREAD, normal_stiffness=k), 0.02).load[0] for k in (3e7, 3e8)
    )
    assert soft < stiff
    d0 = np.array([1e-9, 1e-8, 1e-7])
    tiny = press(ring(), TREAD, d0)
    half = np.sqrt(2 * d0 / TIRE.free_radius)  # a parabola of pressure on a belt that stays round
    expected = TIRE.ring_radius * TIRE.tread_stiffness * 4 / 3 * d0 * half
    # the belt gives way by some C Fz / d0, which falls as the root of d0
    share = 1 - tiny.load / expected
    assert share[0] < 0.03
    np.testing.assert_allclose(share[1:] / share[:-1], np.sqrt(10.0), rtol=0.15)


@pytest.mark.parametrize("given_load", [True, False])
def test_sidewall_softens_with_the_deflection_that_it_yields(given_load: bool) -> None:
    """Eq. (54): the ring at the solution is the ring of the solution's own deflection."""
    tire = TIRE.changed(radial_deflection_rate=-12.0)
    wheel = Ring.of(tire, tire.pressure)

    def at(deflection: np.ndarray) -> Compliance:
        return compliance(Ring.of(tire, tire.pressure, deflection), 59.0, 60)

    if given_load:
        contact = load(at, TREAD, np.array([1500.0, 4000.0, 7000.0]))
        np.testing.assert_allclose(contact.load, [1500.0, 4000.0, 7000.0], rtol=1e-9)
    else:
        contact = press(at, TREAD, np.array([0.01, 0.02, 0.04]))
    again = press(at(contact.deflection), TREAD, contact.deflection)
    np.testing.assert_allclose(again.load, contact.load, rtol=1e-8)
    stiffer = press(compliance(wheel, 59.0, 60), TREAD, contact.deflection)
    assert (stiffer.load > 1.05 * contact.load).all()


def test_hardening_tread_is_the_linear_one_at_first_order() -> None:
    base = load(ring(), TREAD, 4000.0)
    drop = []
    for c in (0.1, 0.2, 4.0):
        hard = load(ring(), replace(TREAD, hardening=c), 4000.0)
        drop.append(base.deflection[0] - hard.deflection[0])
        delta = hard.delta
        expected = TIRE.tread_stiffness * delta * (1 + c * delta / TIRE.tread_thickness)
        np.testing.assert_allclose(hard.pressure, expected, rtol=1e-12)
        np.testing.assert_allclose(hard.compression(hard.phi), delta, atol=1e-9 * delta.max())
    assert drop[0] > 0
    assert drop[1] / drop[0] == pytest.approx(2.0, rel=0.02)
    assert drop[2] < 40 * drop[0]


def test_other_line_loads_move_the_belt_as_the_ring_says() -> None:
    """Traction of one sign shifts the contact; its opposite mirrors it without damping."""
    extra = np.zeros((1, 61, 3), dtype=complex)
    extra[0, 1:6, 1] = 2000.0
    one = press(ring(0.0), TREAD, 0.025, extra=extra)
    other = press(ring(0.0), TREAD, 0.025, extra=-extra)
    none = press(ring(0.0), TREAD, 0.025)
    np.testing.assert_allclose(one.edges[:, ::-1], -other.edges, atol=1e-9)
    assert abs(one.pressure_centre[0]) > 1e-4
    np.testing.assert_allclose(one.compression(one.phi), one.delta, atol=1e-12)
    assert one.edges[0, 0] != pytest.approx(none.edges[0, 0], abs=1e-4)


@settings(max_examples=10)
@given(st.lists(st.floats(500.0, 9000.0), min_size=2, max_size=70))
def test_many_points_at_once_are_the_points_alone(loads: list[float]) -> None:
    together = load(ring(), TREAD, np.array(loads))
    assert len(together) == len(loads)
    for i in {0, len(loads) // 2, len(loads) - 1}:
        alone = load(ring(), TREAD, loads[i])
        assert together.deflection[i] == pytest.approx(alone.deflection[0], rel=1e-10)
        np.testing.assert_allclose(together.edges[i], alone.edges[0], atol=1e-9)


def _softening(deflection: np.ndarray) -> Compliance:
    tire = TIRE.changed(radial_deflection_rate=-99.0)
    return compliance(Ring.of(tire, tire.pressure, deflection), 59.0, 60)


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: load(ring(), TREAD, -100.0), ["vertical load = -100 N", "> 0"]),
        (
            lambda: load(ring(), TREAD, np.array([4000.0, np.nan])),
            ["vertical load = nan", "at point 1"],
        ),
        (lambda: press(ring(), TREAD, 0.0), ["deflection = 0 m", "> 0"]),
        (lambda: press(ring(), TREAD, np.inf), ["deflection = inf m"]),
        (lambda: press(ring(), TREAD, np.ones((2, 2))), ["shape (2, 2)"]),
        (
            lambda: load(
                compliance(replace(Ring.of(TIRE, 1e5), damping=[0.0, 0.1]), 59.0, 60),
                TREAD,
                np.array([1e3, 2e3, 3e3]),
            ),
            ["2", "3 points"],
        ),
        (lambda: press(ring(), TREAD, 0.2), ["200.0 mm", "free radius, 312.5 mm", "its unit"]),
        (lambda: press(ring(), TREAD, 25.0), ["25000.0 mm", "half of the free radius", "its unit"]),
        (lambda: press(ring(), TREAD, 0.13), ["0.75 rad", "lower"]),
        (lambda: load(ring(), TREAD, 60000.0), ["0.75 rad", "lower", "carries 0 to about 3"]),
        (lambda: load(ring(), TREAD, "4 kN"), ["vertical load is '4 kN'", "number"]),
        (lambda: press(ring(), Tread(0.3, 7.5e7), 0.02), ["point 0", "h_0", "outside the belt"]),
        (
            lambda: load(ring(), replace(TREAD, thickness=4e-4), np.array([500.0, 6e3])),
            ["point 1 at Fz = 6000 N", "pressed by 0.", "thickness 0.4 mm", "lower"],
        ),
        (
            lambda: load(lambda _: ring().spread(2), TREAD, np.array([1e3, 2e3, 3e3])),
            ["callable", "2 points for 3 points"],
        ),
        (lambda: fit_edges(ring(), TREAD, [-0.2, 0.2]), ["shape (2,)"]),
        (lambda: fit_edges(ring(), TREAD, "edges"), ["edges is 'edges'"]),
        (lambda: Tread("wide", 1e7), ["free_radius is 'wide'"]),
        (lambda: load(ring(), TREAD, 1e9), ["load", "lower"]),
        (lambda: press(ring(), TREAD, 0.02, n_nodes=41), ["41 nodes", "even"]),
        (lambda: press(ring(), TREAD, 0.02, n_nodes=2), ["2 nodes", ">= 4"]),
        (lambda: fit_edges(ring(), TREAD, np.array([[0.2, -0.2]])), ["leading < trailing"]),
        (lambda: fit_edges(ring(), TREAD, np.array([-0.2, 0.2])), ["shape (2,)"]),
        (lambda: fit_edges(ring(), TREAD, np.array([[-0.2, np.nan]])), ["leading < trailing"]),
        (lambda: fit_edges(ring(), TREAD, np.array([[-0.2, 1.2]])), ["1.200 rad", "0.75"]),
        (lambda: Tread(0.3, -1.0), ["normal_stiffness = -1", "> 0"]),
        (lambda: Tread(np.array([0.3, np.nan]), 1e7), ["free_radius = nan"]),
        (lambda: Tread(0.3, 1e7, hardening=-0.5), ["hardening = -0.5", ">= 0"]),
        (
            lambda: press(ring(), TREAD, 0.02, extra=np.zeros((1, 12, 3), dtype=complex)),
            ["extra", "(1, 12, 3)", "(1, 61, 3)"],
        ),
    ],
)
def test_bad_input_is_named(make: object, parts: list[str]) -> None:
    with pytest.raises(ParameterError) as caught:
        make()
    for part in parts:
        assert part in str(caught.value)


def test_the_range_in_a_refusal_is_what_the_tire_carries() -> None:
    """Just below it is solved, above it is refused."""
    most, deflection = carried(lambda _: ring(0.0), TREAD.spread(1), 0)
    solved = load(ring(0.0), TREAD, 0.995 * most)
    assert solved.edges[0, 1] == pytest.approx(LARGEST_ANGLE, rel=0.01)
    assert solved.deflection[0] == pytest.approx(deflection, rel=0.01)
    with pytest.raises(ParameterError, match=f"{most:.0f} N, at {1e3 * deflection:.3g} mm"):
        load(ring(0.0), TREAD, 1.01 * most)


def test_edges_may_be_a_list_and_a_callable_ring_may_have_one_row() -> None:
    contact = press(ring(), TREAD, 0.025)
    listed = fit_edges(ring(), TREAD, contact.edges.tolist())
    assert listed.load[0] == pytest.approx(contact.load[0], rel=1e-7)
    given = np.array([2000.0, 4000.0, 6000.0])
    called = load(lambda _: ring(), TREAD, given)
    np.testing.assert_allclose(called.deflection, load(ring(), TREAD, given).deflection, rtol=1e-8)


@pytest.mark.parametrize(("size", "where"), [(1e4, 0.0), (1e4, 0.1)])
def test_a_belt_that_lifts_off_is_refused_with_the_last_contact(size: float, where: float) -> None:
    """An inward pull inside the patch lifts the tread there: two patches, which this is not."""
    n = np.arange(61)
    extra = np.zeros((1, 61, 3), dtype=complex)
    extra[0, :, 0] = -size * np.exp(-0.001 * n**2) * np.exp(-1j * n * where)
    with pytest.raises(ConvergenceError) as caught:
        press(ring(), TREAD, 0.02, extra=extra)
    assert isinstance(caught.value.iterate, RadialContact)
    assert caught.value.residual > 1e-6
    assert "not one patch" in str(caught.value) or "still change" in str(caught.value)


def test_a_bicycles_short_contact_is_one_patch() -> None:
    """The nodes at its ends keep a tension of 3e-5 of the peak, which is no lift-off."""
    base = read_tire("table-6-1").tire
    bicycle = base.changed(
        ring_radius=0.330,
        free_radius=0.3335,
        belt_width=0.04065,
        tread_thickness=0.0035,
        innerliner_offset=-0.001,
        bending_stiffness=0.009382,
        mass=0.25,
        pressure=2.946e5,
        radial_stiffness=1.73e5,
        tangential_stiffness=4e4,
        tread_stiffness=1.191e8,
    )
    assert simulate(bicycle, load=100.0).load[0] == pytest.approx(100.0)
