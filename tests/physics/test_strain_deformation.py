"""Laws of strain from deformation and of the way back, Eq. (29)-(40)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ParameterError, ShapeError
from tirelib.physics.contact.static import StaticTire, press_to_deflection, road_gap
from tirelib.physics.ring.green import pressed_shape
from tirelib.physics.strain.deformation import (
    arc_condition,
    arc_nodes,
    contact_deformation,
    recomputed_strain,
    series_strain,
    symmetric_series,
)
from tirelib.physics.strain.full_turn import full_ring_deformation, undetermined_part
from tirelib.physics.strain.relations import (
    BeltShape,
    bending_strain,
    full_strain,
    inextensible_strain,
    inextensible_tangential,
    sampled_shape,
    series_shape,
)

R, R0, Y = 0.3, 0.3125, -0.002
BELT = {"ring_radius": R, "layer_offset": Y}
GAGE = {"ring_radius": R, "liner_offset": Y}
ROAD = {**GAGE, "free_radius": R0}
PHI = np.linspace(-np.pi, np.pi, 256, endpoint=False)
TIRE = StaticTire(
    ring_radius=R,
    free_radius=R0,
    bending_stiffness=1.144,
    radial_stiffness=6.24e5,
    tread_stiffness=7.5e7,
)
SMALL = st.floats(-1e-3, 1e-3)


def flat_belt(angle: np.ndarray, d0: float) -> BeltShape:
    """u = -d0 + R0 (1 - cos phi), with the derivatives; v' = -u as the belt keeps its length."""
    u = road_gap(angle, d0, R0)
    return BeltShape(u, np.zeros_like(u), R0 * np.sin(angle), -u, R0 * np.cos(angle))


def test_flat_belt_puts_the_innerliner_in_tension() -> None:
    angle = np.linspace(-0.3, 0.3, 7)
    shape = flat_belt(angle, 0.02)
    for strain in (inextensible_strain, bending_strain):
        np.testing.assert_allclose(strain(shape, **BELT), 6.5e-3, rtol=1e-12)
        outside = strain(shape, ring_radius=R, layer_offset=-Y)
        np.testing.assert_allclose(outside, -6.5e-3, rtol=1e-12)


@given(dx=SMALL, dz=SMALL)
def test_rigid_shift_strains_nothing(dx: float, dz: float) -> None:
    u = dx * np.sin(PHI) + dz * np.cos(PHI)
    v = dx * np.cos(PHI) - dz * np.sin(PHI)
    for strain in (full_strain, bending_strain, inextensible_strain):
        assert np.abs(strain(sampled_shape(u, v), **BELT)).max() < 1e-14


@given(turn=st.floats(-0.1, 0.1))
def test_second_order_term_keeps_a_turned_belt_unstrained(turn: float) -> None:
    u, v = np.full(16, R * (np.cos(turn) - 1.0)), np.full(16, R * np.sin(turn))
    # what remains is of fourth order; without the square it would be turn^2 / 2
    strain = full_strain(sampled_shape(u, v), ring_radius=R, layer_offset=0.0)
    assert np.abs(strain).max() <= 0.2 * turn**4 + 1e-15


@given(order=st.integers(2, 20), layer=st.floats(-0.015, 0.015))
def test_inextensible_modes_bend_only(order: int, layer: float) -> None:
    a = 1e-3
    u = a * np.cos(order * PHI)
    shape = sampled_shape(u, inextensible_tangential(u))
    expected = layer / R**2 * (order**2 - 1) * u
    belt = {"ring_radius": R, "layer_offset": layer}
    for strain in (bending_strain, inextensible_strain):
        np.testing.assert_allclose(strain(shape, **belt), expected, atol=1e-14)
    rotation = (order - 1.0 / order) * a / R * np.sin(order * PHI)
    full = full_strain(shape, **belt)
    np.testing.assert_allclose(full - expected, 0.5 * rotation**2, atol=1e-13)


@given(stretch=st.floats(-1e-3, 1e-3), layer=st.floats(-0.01, 0.01))
def test_the_two_bending_forms_differ_by_the_stretch(stretch: float, layer: float) -> None:
    u = 1e-3 * np.cos(3 * PHI)
    v = inextensible_tangential(u) + stretch * np.sin(2 * PHI)
    shape, belt = sampled_shape(u, v), {"ring_radius": R, "layer_offset": layer}
    difference = bending_strain(shape, **belt) - inextensible_strain(shape, **belt)
    expected = layer / R**2 * (shape.u + shape.v_prime)
    np.testing.assert_allclose(difference, expected, atol=1e-14)


def test_uniform_growth_is_pure_stretch() -> None:
    shape = sampled_shape(np.full(16, 3e-4), np.zeros(16))
    np.testing.assert_allclose(full_strain(shape, **BELT), 1e-3, rtol=1e-12)


@given(data=st.lists(SMALL, min_size=16, max_size=16))
def test_samples_and_coefficients_give_the_same_strain(data: list[float]) -> None:
    uc, us, vc, vs = np.array(data).reshape(4, 4)
    series = series_shape(PHI, uc, us, vc, vs)
    sampled = sampled_shape(series.u, series.v)
    for strain in (full_strain, bending_strain, inextensible_strain):
        np.testing.assert_allclose(
            strain(series, **BELT), strain(sampled, **BELT), atol=1e-13, rtol=0
        )


def test_each_trace_may_have_its_own_layer() -> None:
    u = np.stack((1e-3 * np.cos(2 * PHI), 2e-3 * np.cos(5 * PHI)))
    shape = sampled_shape(u, inextensible_tangential(u))
    together = full_strain(shape, ring_radius=R, layer_offset=np.array([-0.002, 0.004]))
    for row, layer in enumerate((-0.002, 0.004)):
        alone = full_strain(sampled_shape(u[row], shape.v[row]), ring_radius=R, layer_offset=layer)
        np.testing.assert_allclose(together[row], alone, rtol=1e-14)


def test_bad_shapes_are_refused() -> None:
    with pytest.raises(ShapeError, match=r"radial has shape \(8,\), tangential \(9,\)"):
        sampled_shape(np.zeros(8), np.zeros(9))
    with pytest.raises(ParameterError, match="not finite"):
        sampled_shape(np.full(8, np.nan), np.zeros(8))
    with pytest.raises(ShapeError, match="all four need the same"):
        series_shape(PHI, np.zeros(3), np.zeros(3), np.zeros(2), np.zeros(3))
    with pytest.raises(ParameterError, match="an angle or a coefficient"):
        series_shape(PHI, np.full(3, np.inf), np.zeros(3), np.zeros(3), np.zeros(3))
    with pytest.raises(ParameterError, match=r"mean of u is 0\.001 m; must be 0"):
        inextensible_tangential(np.full(8, 1e-3))
    shape = sampled_shape(np.zeros(8), np.zeros(8))
    with pytest.raises(ParameterError, match=r"ring_radius = -0\.3 m"):
        full_strain(shape, ring_radius=-0.3, layer_offset=Y)
    with pytest.raises(ParameterError, match="layer_offset = -2 m"):
        full_strain(shape, ring_radius=R, layer_offset=-2.0)


def exact_trace(angle: np.ndarray, lead: float, trail: float, d0: float) -> tuple:
    """A deformation that meets the road at both edges, and its strain (35) worked out by hand."""
    bump = np.sin(np.pi * (angle - lead) / (trail - lead))
    k = np.pi / (trail - lead)
    u = road_gap(angle, d0, R0) + 1e-3 * bump
    curved = (R0 - d0) + 1e-3 * (1.0 - k**2) * bump
    return u, -Y / R**2 * curved


def test_deformation_in_the_contact_is_found_to_second_order() -> None:
    errors = []
    for nodes in (21, 41, 81, 161):
        angle = arc_nodes(-0.35, 0.25, nodes)
        u, strain = exact_trace(angle, -0.35, 0.25, 0.02)
        found = contact_deformation(strain, -0.35, 0.25, deflection=0.02, **ROAD)
        errors.append(np.abs(found.deformation - u).max())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(rates, 2.0, atol=0.05)
    assert errors[-1] < 1e-6


@given(
    lead=st.floats(-0.6, -0.1),
    trail=st.floats(0.1, 0.6),
    d0=st.floats(0.005, 0.05),
    exact_gap=st.booleans(),
    data=st.lists(st.floats(-1e-2, 1e-2), min_size=31, max_size=31),
)
def test_recomputed_strain_is_the_input(
    lead: float, trail: float, d0: float, exact_gap: bool, data: list[float]
) -> None:
    strain = np.array(data)
    found = contact_deformation(strain, lead, trail, deflection=d0, exact_gap=exact_gap, **ROAD)
    again = recomputed_strain(found.angle, found.deformation, **GAGE)
    # 1e-16 of u over dphi^2 = 4e-5
    np.testing.assert_allclose(again, strain[1:-1], atol=1e-11)
    edges = road_gap([lead, trail], d0, R0, exact=exact_gap)
    np.testing.assert_allclose(found.deformation[[0, -1]], edges, rtol=0.0, atol=1e-15)


def test_traces_with_their_own_edges_are_solved_together_as_alone() -> None:
    rng = np.random.default_rng(3)
    strain = 5e-3 * rng.standard_normal((2, 3, 25))
    lead, trail = -rng.uniform(0.1, 0.5, (2, 3)), rng.uniform(0.1, 0.5, (2, 3))
    d0 = rng.uniform(0.01, 0.03, 3)
    together = contact_deformation(strain, lead, trail, deflection=d0, **ROAD)
    assert together.deformation.shape == together.angle.shape == (2, 3, 25)
    alone = contact_deformation(strain[1, 2], lead[1, 2], trail[1, 2], deflection=d0[2], **ROAD)
    np.testing.assert_allclose(together.deformation[1, 2], alone.deformation, rtol=1e-12)
    assert together.condition[1, 2] == pytest.approx(float(alone.condition))


def test_pressed_tire_is_found_back_from_its_strain() -> None:
    """Ring under its contact pressure -> strain -> cosine series -> deformation in the contact."""
    d0 = np.array([0.015, 0.03])
    contact = press_to_deflection(TIRE, d0, nodes=721)
    turn = np.linspace(-np.pi, np.pi, 2048, endpoint=False)

    def shape(angle: np.ndarray, derivative: int) -> np.ndarray:
        return pressed_shape(
            angle,
            contact.angle,
            contact.pressure,
            ring_radius=R,
            bending_stiffness=1.144,
            radial_stiffness=6.24e5,
            derivative=derivative,
        )

    offset = np.array([[3e-4], [-2e-4]])  # of the gages
    strain = -Y / R**2 * (shape(turn, 0) + shape(turn, 2)) + offset
    series = symmetric_series(turn, strain, 0.0, terms=300)
    nodes = arc_nodes(-contact.half_angle, contact.half_angle, 201)
    found = contact_deformation(
        series_strain(series, nodes),
        -contact.half_angle,
        contact.half_angle,
        deflection=d0,
        **ROAD,
    )
    truth = shape(nodes, 0)
    # series to order 300, differences on 201 nodes: micrometres in 15 and 30 mm
    assert np.abs(found.deformation - truth).max() < 5e-6


def test_offset_of_the_liner_must_be_negative() -> None:
    for call in (
        lambda y: contact_deformation(
            np.zeros(9), -0.2, 0.2, deflection=0.02, ring_radius=R, free_radius=R0, liner_offset=y
        ),
        lambda y: full_ring_deformation(np.zeros(9), ring_radius=R, liner_offset=y),
        lambda y: recomputed_strain(np.arange(9.0), np.zeros(9), ring_radius=R, liner_offset=y),
    ):
        with pytest.raises(ParameterError, match=r"liner_offset = 0\.002 m.*negative"):
            call(0.002)


@pytest.mark.parametrize("turns", [1, 2])
def test_arc_of_half_turns_is_refused_with_its_condition(turns: int) -> None:
    arc = turns * np.pi
    with pytest.raises(ParameterError, match=r"condition number is \d\.\d+e\+\d+"):
        contact_deformation(np.zeros(101), -0.5 * arc, 0.5 * arc, deflection=0.02, **ROAD)


@given(length=st.floats(0.2, 2.8), nodes=st.integers(5, 60))
def test_condition_is_that_of_the_matrix(length: float, nodes: int) -> None:
    h = length / (nodes - 1)
    inner = nodes - 2
    matrix = (1.0 - 2.0 / h**2) * np.eye(inner)
    matrix += (np.eye(inner, k=1) + np.eye(inner, k=-1)) / h**2
    assert float(arc_condition(length, nodes)) == pytest.approx(np.linalg.cond(matrix), rel=1e-6)


@given(shift=st.floats(-1e-2, 1e-2), sideways=st.floats(-1e-2, 1e-2), growth=st.floats(-1e-3, 1e-3))
def test_full_ring_tells_all_but_mean_and_shift(
    shift: float, sideways: float, growth: float
) -> None:
    bent = 1e-3 * np.cos(2 * PHI) - 4e-4 * np.sin(7 * PHI)
    rigid = growth + shift * np.cos(PHI) + sideways * np.sin(PHI)
    shape = sampled_shape(bent + rigid, np.zeros(PHI.size))
    strain = inextensible_strain(shape, **BELT)
    found = full_ring_deformation(strain, **GAGE)
    np.testing.assert_allclose(found.determined, bent, atol=1e-12)
    np.testing.assert_allclose(undetermined_part(bent + rigid), rigid, atol=1e-14)
    np.testing.assert_allclose(
        found.determined + undetermined_part(bent + rigid), bent + rigid, atol=1e-12
    )
    assert found.contradiction < 1e-15
    assert np.isnan(found.cosine[:2]).all()
    assert np.isnan(found.sine[:2]).all()
    # the grid starts at -pi: cos 2 phi = cos 2 (phi + pi), sin 7 phi = -sin 7 (phi + pi)
    assert found.cosine[2] == pytest.approx(1e-3)
    assert found.sine[7] == pytest.approx(4e-4)
    assert np.abs(found.cosine[3:]).max() < 1e-12


def test_first_harmonic_of_strain_is_reported_as_contradiction() -> None:
    strain = np.stack((np.zeros(64), 2e-4 * np.cos(2 * np.pi * np.arange(64) / 64 + 0.3)))
    found = full_ring_deformation(strain, **GAGE)
    np.testing.assert_allclose(found.contradiction, [0.0, 2e-4], atol=1e-18)
    np.testing.assert_allclose(found.determined, 0.0, atol=1e-18)


@given(centre=st.floats(-1.0, 1.0), start=st.floats(-4.0, 4.0), offset=st.floats(-1.0, 1.0))
def test_series_keeps_the_even_part_about_the_centre(
    centre: float, start: float, offset: float
) -> None:
    angle = start + np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    x = angle - centre
    even, odd = 2.0 * np.cos(x) - 0.5 * np.cos(9 * x), np.sin(2 * x) - 3.0 * np.sin(5 * x)
    found = symmetric_series(angle, np.stack((even + odd + offset, even)), centre, terms=12)
    expected = np.zeros(12)
    expected[[0, 8]] = 2.0, -0.5
    np.testing.assert_allclose(found, [expected, expected], atol=1e-13)
    np.testing.assert_allclose(series_strain(found[0], x), even, atol=1e-12)


def test_bad_traces_are_refused() -> None:
    with pytest.raises(ShapeError, match="one uniform turn"):
        symmetric_series(PHI, np.zeros(10), 0.0, terms=5)
    with pytest.raises(ShapeError, match="angle must advance"):
        symmetric_series(0.5 * PHI, np.zeros(256), 0.0, terms=5)
    with pytest.raises(ParameterError, match="terms = 128; must be 2 to below 128"):
        symmetric_series(PHI, np.zeros(256), 0.0, terms=128)
    with pytest.raises(ParameterError, match="a sample is not finite"):
        symmetric_series(PHI, np.full(256, np.nan), 0.0, terms=5)
    with pytest.raises(ShapeError, match="5 nodes or more"):
        contact_deformation(np.zeros(4), -0.2, 0.2, deflection=0.02, **ROAD)
    with pytest.raises(ParameterError, match="a strain is not finite"):
        contact_deformation(np.full(9, np.nan), -0.2, 0.2, deflection=0.02, **ROAD)
    flat = np.full((2, 9), 6.5e-3)
    for d0, shown in ((20.0, "20 m"), (-0.02, "-0.02 m"), (np.nan, "nan m"), (0.0, "0 m")):
        with pytest.raises(ParameterError, match=f"trace 1 has deflection = {shown}; .*metres"):
            contact_deformation(flat, -0.2, 0.2, deflection=[0.02, d0], **ROAD)
    with pytest.raises(ParameterError, match=r"trace 1 has a strain of 6500.*microstrain"):
        contact_deformation(flat * [[1.0], [1e6]], -0.2, 0.2, deflection=0.02, **ROAD)
    with pytest.raises(ShapeError, match="do not fit traces"):
        contact_deformation(np.zeros((2, 9)), np.full(3, -0.2), 0.2, deflection=0.02, **ROAD)
    with pytest.raises(ParameterError, match="leading must be finite and below trailing"):
        contact_deformation(np.zeros(9), 0.2, -0.2, deflection=0.02, **ROAD)
    with pytest.raises(ParameterError, match="count = 3"):
        arc_nodes(-0.1, 0.1, 3)
    with pytest.raises(ShapeError, match="one turn needs 8"):
        undetermined_part(np.zeros(5))
    with pytest.raises(ParameterError, match="0 < ring_radius < free_radius"):
        contact_deformation(
            np.zeros(9), -0.2, 0.2, deflection=0.02, ring_radius=R, free_radius=0.2, liner_offset=Y
        )
