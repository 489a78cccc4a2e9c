"""What the ring can do beyond the dissertation: stretch, shear, turn its sections, soften."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ParameterError
from tirelib.core.parameters import read_tire
from tirelib.physics.ring.compliance import Compliance, compliance
from tirelib.physics.ring.ring import Ring, dashpots, modal_stiffness

TIRE = read_tire("table-6-1").tire
RING = replace(Ring.of(TIRE, TIRE.pressure), damping=0.0)
OPTIONS = {
    "plain": {},
    "extensible": {"extension_stiffness": 4e6},
    "shearable": {"shear_stiffness": 2e5},
    "both": {"extension_stiffness": 4e6, "shear_stiffness": 2e5},
    "rotary": {"extension_stiffness": 4e6, "shear_stiffness": 2e5, "rotary_inertia": 1e-4},
    "pulled": {"extension_stiffness": 4e6, "shear_stiffness": 2e5, "tension": 800.0},
}
every_option = pytest.mark.parametrize("option", list(OPTIONS))


def difference(a: Compliance, b: Compliance) -> float:
    """Largest difference, each entry in units of its own largest harmonic."""
    scale = np.abs(b.matrix).max(axis=1, keepdims=True) + 1e-30
    return float((np.abs(a.matrix - b.matrix) / scale).max())


@every_option
def test_without_damping_the_compliance_is_hermitian(option: str) -> None:
    """Reciprocity: what q_u at A does to beta at B, the moment at B does to u at A."""
    matrix = compliance(replace(RING, **OPTIONS[option]), 59.0, 40).matrix
    across = matrix.conj().swapaxes(-1, -2)
    scale = np.sqrt(np.einsum("pnii,pnjj->pnij", np.abs(matrix), np.abs(matrix))) + 1e-300
    assert (np.abs(matrix - across) <= 1e-9 * scale).all()


def test_each_dashpot_damps_the_spring_beside_it() -> None:
    """The damping ratio c / (2 sqrt(k m)) is lambda, along the radius and along the belt."""
    found = dashpots(replace(RING, dashpots=0.03))
    for c, stiffness in zip(found, (RING.radial_stiffness, RING.tangential_stiffness), strict=True):
        assert c.item() / (2.0 * np.sqrt(stiffness * RING.mass)) == pytest.approx(0.03)
    assert found[0].item() > 1.2 * found[1].item()  # the two springs differ


@every_option
@given(omega=st.floats(-200.0, 200.0), lam=st.floats(0.001, 0.2))
def test_damping_takes_energy_from_every_load(option: str, omega: float, lam: float) -> None:
    ring = replace(RING, **OPTIONS[option], damping=lam)
    matrix = compliance(ring, omega, 30).matrix[0] * np.sign(omega)
    lag = (matrix - matrix.conj().swapaxes(-1, -2)) / 2j
    units = np.array([1.0, 1.0, TIRE.ring_radius])
    lag = lag * units[:, None] * units
    # rounding of the inverse, against the compliance itself
    assert np.linalg.eigvalsh(lag).max() <= 1e-12 * np.abs(matrix * units[:, None] * units).max()


@every_option
def test_compliance_inverts_the_stiffness_with_extension_and_shear(option: str) -> None:
    """D X = Q in the directions that are free, D written out here from the energies."""
    ring = replace(RING, **OPTIONS[option])
    r, n = TIRE.ring_radius, np.arange(21.0)
    stiffness = modal_stiffness(ring, 40.0, 20)[0]
    found = compliance(ring, 40.0, 20).matrix[0]
    stretch = np.stack([1 + 0j * n, 1j * n, 0j * n], axis=-1) / r
    shear = np.stack([1j * n / r, -1 / r + 0j * n, 1 + 0j * n], axis=-1)
    for k in range(21):
        total = stiffness[k].copy()
        free = np.eye(3, dtype=complex)
        held = []
        for row, size in (
            (stretch[k], float(ring.extension_stiffness)),
            (shear[k], float(ring.shear_stiffness)),
        ):
            if np.isinf(size):
                held.append(row)
            else:
                total += size * np.outer(row.conj(), row)
        if held:
            free = np.linalg.svd(np.array(held))[2][len(held) :].conj().T
        expected = free @ np.linalg.solve(free.conj().T @ total @ free, free.conj().T)
        # the extensible ring's stiffnesses span six decades
        np.testing.assert_allclose(found[k], expected, atol=1e-8 * np.abs(expected).max())


@given(st.floats(-200.0, 200.0))
def test_rolling_softens_a_belt_that_stretches_by_its_inertia(omega: float) -> None:
    """Without damping, rolling acts like EA - rho A (R Omega)^2 at rest: nothing else is left."""
    ring = replace(RING, extension_stiffness=2e6, shear_stiffness=3e5)
    softer = replace(ring, extension_stiffness=2e6 - TIRE.mass * (TIRE.ring_radius * omega) ** 2)
    assert difference(compliance(ring, omega, 30), compliance(softer, 0.0, 30)) < 1e-9


@given(st.floats(-200.0, 200.0))
def test_shear_alone_leaves_the_rolling_ring_as_it_rests(omega: float) -> None:
    ring = replace(RING, shear_stiffness=3e5)
    assert difference(compliance(ring, omega, 30), compliance(ring, 0.0, 30)) < 1e-12


@given(st.floats(-200.0, 200.0))
def test_rotary_inertia_acts_like_less_bending_stiffness(omega: float) -> None:
    """EI - rho I (R Omega)^2, in both solution routes."""
    less = TIRE.bending_stiffness - 1e-4 * (TIRE.ring_radius * omega) ** 2
    for option in ({}, {"shear_stiffness": 3e5}):
        ring = replace(RING, rotary_inertia=1e-4, **option)
        equal = replace(RING, bending_stiffness=less, **option)
        assert difference(compliance(ring, omega, 30), compliance(equal, 0.0, 30)) < 1e-10


@pytest.mark.parametrize("name", ["extension_stiffness", "shear_stiffness"])
@pytest.mark.parametrize("own", [{"damping": 0.04}, {"dashpots": 0.04}, {"tension": 800.0}])
def test_the_stiff_limit_is_the_dissertations_ring_at_first_order(
    name: str, own: dict[str, float]
) -> None:
    ring = replace(RING, **own)
    limit = compliance(ring, 59.0, 30)
    error = [
        difference(compliance(replace(ring, **{name: stiff}), 59.0, 30), limit)
        for stiff in (1e9, 1e10, 1e11)
    ]
    assert error[2] < 1e-4
    assert error[0] / error[1] == pytest.approx(10.0, rel=0.1)
    assert error[1] / error[2] == pytest.approx(10.0, rel=0.1)


def test_share_of_inertia_does_nothing_to_the_plain_ring_and_all_to_a_stretching_one() -> None:
    for share in (0.0, 0.5):
        plain = replace(RING, inertia_share=share)
        assert difference(compliance(plain, 80.0, 30), compliance(RING, 80.0, 30)) < 1e-13
    ring = replace(RING, extension_stiffness=1e6)
    none = compliance(replace(ring, inertia_share=0.0), 150.0, 30)
    assert difference(none, compliance(ring, 0.0, 30)) < 1e-13
    assert difference(none, compliance(ring, 150.0, 30)) > 1e-4


def test_a_belt_without_tangential_sidewall_does_not_wind_up() -> None:
    """K_v = 0 (Jenkins): the rotation of the whole belt is held, all else stays."""
    for option in OPTIONS.values():
        free = compliance(replace(RING, tangential_stiffness=0.0, damping=0.04, **option), 59.0, 20)
        assert np.isfinite(free.matrix).all()
        assert abs(free.matrix[0, 0, 1, 1]) < 1e-12
        held = replace(RING, tangential_stiffness=1e-6, damping=0.04, **option)
        np.testing.assert_allclose(
            free.radial[0, 1:], compliance(held, 59.0, 20).radial[0, 1:], rtol=1e-9
        )


@every_option
def test_many_points_at_once_are_the_points_alone(option: str) -> None:
    pressures = np.array([1.0e5, 1.6e5, 2.4e5])
    omegas = np.array([0.0, 30.0, 90.0])
    tire = read_tire("table-6-2-195-65r15").tire
    together = compliance(replace(Ring.of(tire, pressures), **OPTIONS[option]), omegas, 20)
    assert len(together) == 3
    for i in range(3):
        alone = compliance(
            replace(Ring.of(tire, pressures[i]), **OPTIONS[option]), float(omegas[i]), 20
        )
        np.testing.assert_allclose(together.matrix[i], alone.matrix[0], rtol=1e-9, atol=1e-20)
    some = together.take(np.array([2, 0]))
    np.testing.assert_array_equal(some.matrix, together.matrix[[2, 0]])


@given(st.floats(1e5, 3e5), st.floats(0.0, 0.05))
def test_sidewall_follows_pressure_on_a_line_and_deflection_exponentially(
    pressure: float, deflection: float
) -> None:
    """Eq. (54): k_u = A exp(B d0)."""
    tire = TIRE.changed(
        radial_pressure_slope=0.3, tangential_pressure_slope=0.1, radial_deflection_rate=-8.0
    )
    ring = Ring.of(tire, pressure, deflection)
    above = pressure - tire.pressure
    expected = (6.24e5 + 0.3 * above) * np.exp(-8.0 * deflection)
    assert ring.radial_stiffness == pytest.approx(expected, rel=1e-12)
    assert ring.tangential_stiffness == pytest.approx(2.18e5 + 0.1 * above, rel=1e-12)
    assert ring.inflation == pytest.approx(pressure * tire.belt_width, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: Ring.of(TIRE, -1e4), ["inflation pressure -0.1 bar", ">= 0"]),
        (lambda: Ring.of(TIRE, np.array([1e5, np.nan])), ["inflation pressure", "finite"]),
        (
            lambda: Ring.of(TIRE.changed(radial_pressure_slope=10.0), 0.5e5),
            ["radial_stiffness", "> 0", "pressure"],
        ),
        (lambda: replace(RING, mass=-1.0), ["mass = -1", "> 0"]),
        (lambda: replace(RING, bending_stiffness=np.nan), ["bending_stiffness = nan"]),
        (lambda: replace(RING, damping=-0.01), ["damping = -0.01", ">= 0"]),
        (lambda: replace(RING, radial_stiffness=np.inf), ["radial_stiffness = inf", "finite"]),
        (lambda: replace(RING, mass=np.array([3.0, np.inf])), ["mass = inf at point 1", "finite"]),
        (
            lambda: replace(RING, mass=np.ones(2), damping=np.zeros(3)),
            ["mass 2, damping 3", "same length"],
        ),
        (lambda: replace(RING, radius="0.3 m"), ["radius is '0.3 m'", "number"]),
        (lambda: replace(RING, mass=np.ones((2, 2))), ["mass has shape (2, 2)"]),
        (lambda: compliance(RING, np.nan), ["turn rate", "rad/s"]),
        (lambda: compliance(RING, 59.0, 1), ["1 modes", "at least 2"]),
        (
            lambda: compliance(replace(RING, extension_stiffness=1e4), 300.0, 10),
            ["no stiffness left in harmonic", "critical speed"],
        ),
        (
            lambda: compliance(replace(RING, rotary_inertia=1.0), np.array([0.0, 59.0]), 10),
            ["point 1", "no stiffness left", "critical speed"],
        ),
    ],
)
def test_what_no_ring_can_be_is_refused(make: object, parts: list[str]) -> None:
    with pytest.raises(ParameterError) as caught:
        make()
    for part in parts:
        assert part in str(caught.value)
