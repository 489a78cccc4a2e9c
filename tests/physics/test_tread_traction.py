"""Laws of the innerliner's compression by the tread's outward shear."""

import numpy as np
import pytest

from tirelib.core.errors import ParameterError, ShapeError
from tirelib.core.parameters import Tire
from tirelib.physics.contact.fourier import evaluate
from tirelib.physics.contact.strips import Layout, StripContact, press_strips
from tirelib.physics.strain.gages import gage_trace
from tirelib.physics.strain.tread_traction import TreadBeam, outward_shear, tread_strain

TIRE = Tire(
    ring_radius=0.3035,
    free_radius=0.3165,
    belt_width=0.168,
    tread_thickness=0.0115,
    innerliner_offset=-0.003,
    bending_stiffness=2.6,
    mass=3.6,
    pressure=2.3e5,
    radial_stiffness=4.83e5,
    tangential_stiffness=1.9e5,
    tread_stiffness=5.38e7,
    damping=0.03,
    tread_hardening=1.0,
    tread_shear_stiffness=1.7e7,
    friction=0.95,
)
LOADS = np.array([2400.0, 3600.0, 4800.0, 6000.0, 7200.0])
CENTRE = np.zeros(1)


def one_strip(
    fz: np.ndarray | float = LOADS, tire: Tire = TIRE, *, modes: int = 60, nodes: int = 24
) -> StripContact:
    return press_strips(
        tire, fz, layout=Layout.even((0.0,)), n_modes=modes, n_nodes=nodes, omega=59.0
    )


def tension(contact: StripContact, beam: TreadBeam) -> np.ndarray:
    """Strain in the middle of the contact."""
    added = tread_strain(contact, outward_shear(contact, TIRE), beam)
    return gage_trace(contact, TIRE.innerliner_offset, tread=added, phi=CENTRE).strain[:, 0, 0]


def test_zero_strength_is_the_ring_alone() -> None:
    c = one_strip()
    off = TreadBeam.of(TIRE, 0.0)
    added = tread_strain(c, outward_shear(c, TIRE), off)
    with_it = gage_trace(c, TIRE.innerliner_offset, tread=added)
    without = gage_trace(c, TIRE.innerliner_offset)
    for name in ("strain", "rate", "pulse", "axis_shift"):
        np.testing.assert_array_equal(getattr(with_it, name), getattr(without, name))


def test_strength_scales_the_added_strain() -> None:
    c = one_strip()
    tau = outward_shear(c, TIRE)
    one, two = (tread_strain(c, tau, TreadBeam.of(TIRE, s)) for s in (0.1, 0.2))
    np.testing.assert_allclose(two, 2.0 * one, rtol=1e-12)


def test_the_ring_alone_shows_a_rise_and_then_a_level() -> None:
    loads = np.array([600.0, 1200.0, 2400.0, 3600.0, 4800.0, 6000.0, 7200.0])
    alone = tension(one_strip(loads), TreadBeam.of(TIRE, 0.0))
    assert np.all(np.diff(alone[:5]) > 0.0)
    assert np.ptp(alone[4:]) < 0.03 * alone.max()


def test_tension_falls_with_load_at_sufficient_strength() -> None:
    c = one_strip(LOADS[1:])
    assert not np.all(np.diff(tension(c, TreadBeam.of(TIRE, 0.0))) < 0.0)
    falling = tension(c, TreadBeam.of(TIRE, 0.15))
    assert np.all(np.diff(falling) < 0.0)
    assert falling[-1] < 0.9 * falling[0]


def test_outward_shear_grows_from_the_middle_and_keeps_to_friction() -> None:
    c = one_strip()
    tau, q = outward_shear(c, TIRE), c.line_pressure
    middle = c.edges.mean(axis=-1)[..., None]
    side = c.phi - middle
    inner = np.abs(side) < 0.5 * np.abs(side).max()
    assert np.all((tau * side)[inner] > -1e-3 * np.abs(tau).max())
    np.testing.assert_allclose((tau * c.weights).sum(axis=-1), 0.0, atol=1e-9 * tau.max())
    # the resultant that was taken off is small: damping tilts the pressure
    assert np.all(np.abs(tau) <= 1.1 * TIRE.friction * q + 1.0)
    smooth = outward_shear(c, TIRE.changed(friction=0.0))
    assert np.abs(smooth).max() == 0.0
    even = outward_shear(one_strip(tire=TIRE.changed(damping=0.0)), TIRE)
    np.testing.assert_allclose(even, -even[..., ::-1], atol=1e-3 * even.max())


def test_the_free_beams_strain_is_force_over_stiffness() -> None:
    # tau = c x on a patch of half length a: N = c (a^2 - x^2) / 2
    c = one_strip(4800.0, modes=400, nodes=100)
    a = 0.5 * c.radius[0] * np.diff(c.edges[0, 0])[0]
    middle = c.edges[0, 0].mean()
    x = c.radius[0] * (c.phi - middle)
    rise = 3e5
    beam = TreadBeam(2.6, 0.013, -0.003, extension_stiffness=4e6)
    added = tread_strain(c, rise * x, beam)
    places = np.array([-0.8, 0.0, 0.5]) * a
    axial = 0.5 * rise * (a**2 - places**2)
    wanted = axial * (1.0 / 4e6 - 0.003 * 0.013 / 2.6)
    got = evaluate(added[:, 0], middle + places / c.radius[0])[0]
    np.testing.assert_allclose(got, wanted, rtol=1e-3)
    outside = evaluate(added[:, 0], middle + np.array([1.5, 3.0]) * a / c.radius[0])[0]
    np.testing.assert_allclose(outside, 0.0, atol=1e-3 * np.abs(wanted).max())


def test_restraint_takes_the_strain_down_to_the_shear_beams_and_then_away() -> None:
    c = one_strip(4800.0, modes=400, nodes=100)
    x = c.radius[0] * (c.phi - c.edges.mean(axis=-1)[..., None])
    free, held, fixed = (
        evaluate(tread_strain(c, 3e5 * x, TreadBeam(2.6, 0.013, -0.003, restraint=k))[:, 0], CENTRE)
        for k in (0.0, 7e4, 1e9)
    )
    assert free.item() < held.item() < fixed.item() <= 0.0
    # y h tau' / GA, away from the edges by many sqrt(EI / GA) = 6 mm
    assert held.item() == pytest.approx(-0.003 * 0.013 * 3e5 / 7e4, rel=0.1)
    assert abs(fixed.item()) < 1e-3 * abs(held.item())


def test_strips_share_the_beam() -> None:
    flat = TIRE.changed(crown_curvature=0.0)
    one, five = one_strip(4800.0, flat), press_strips(flat, 4800.0, omega=59.0)
    beam = TreadBeam.of(flat, 0.1)
    a = tread_strain(five, outward_shear(five, flat), beam)
    b = tread_strain(one, outward_shear(one, flat), beam)
    np.testing.assert_allclose(a[0], np.repeat(b[0], 5, axis=0), atol=1e-5 * np.abs(b).max())


def test_bad_input_is_refused() -> None:
    c = one_strip(4800.0)
    beam = TreadBeam.of(TIRE, 0.1)
    with pytest.raises(ShapeError, match="traction has shape"):
        tread_strain(c, np.zeros(3), beam)
    with pytest.raises(ParameterError, match="resultant"):
        tread_strain(c, c.line_pressure, beam)
    with pytest.raises(ParameterError, match="gathering"):
        outward_shear(c, TIRE, -0.1)
    for change in ({"strength": -1.0}, {"offset": 0.003}, {"lever": 0.0}, {"restraint": np.inf}):
        values = {"bending_stiffness": 2.6, "lever": 0.013, "offset": -0.003} | change
        with pytest.raises(ParameterError, match=next(iter(change))):
            TreadBeam(**values)
