import numpy as np

from tirelib.rig.mesh import mesh


def test_splines_add_up_to_one_and_their_slopes_to_zero() -> None:
    grid = mesh()
    np.testing.assert_allclose(grid.value.sum(axis=1), 1.0, atol=1e-13)
    np.testing.assert_allclose(grid.slope.sum(axis=1), 0.0, atol=1e-10)
    assert abs(grid.weight.sum() - 2.0 * np.pi) < 1e-12


def test_fields_are_periodic_and_their_slope_is_their_derivative() -> None:
    grid = mesh()
    control = np.random.default_rng(1).standard_normal((grid.n, 3))
    phi = np.array([-np.pi, 0.3, 2.0])
    value, slope = grid.field(control, phi)
    np.testing.assert_allclose(grid.field(control, phi + 2.0 * np.pi)[0], value, atol=1e-12)
    ahead, behind = grid.field(control, phi + 1e-6)[0], grid.field(control, phi - 1e-6)[0]
    np.testing.assert_allclose((ahead - behind) / 2e-6, slope, rtol=1e-5, atol=1e-5)


def test_gauss_points_and_field_agree() -> None:
    grid = mesh()
    control = np.random.default_rng(2).standard_normal((grid.n, 2))
    at_points = np.einsum("pa,paf->pf", grid.value, control[grid.control])
    np.testing.assert_allclose(grid.field(control, grid.phi)[0], at_points, atol=1e-12)


def test_contact_zone_is_the_finest_part() -> None:
    grid = mesh(fine=0.02, coarse=0.2, zone=0.4)
    sizes = np.diff(grid.knots)
    inside = np.abs(0.5 * (grid.knots[1:] + grid.knots[:-1])) < 0.4
    assert sizes[inside].max() <= 0.02 + 1e-12
    assert sizes[~inside].min() >= 0.02 - 1e-12
    assert np.ptp(sizes[inside]) < 1e-12
