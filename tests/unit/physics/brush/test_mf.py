"""Magic Formula 6.1 and 5.2: each law isolates a group of equations. All numbers are invented."""

from dataclasses import replace

import numpy as np
import pytest

from tirelib.core.errors import FormatError, ParameterError, ShapeError
from tirelib.core.parameters.tir import parse_tir
from tirelib.inference.magic.file import magic_tire
from tirelib.physics.brush.mf import magic_forces
from tirelib.physics.brush.mf_tire import Coefficients, MagicTire

HEAD = """[UNITS]
LENGTH='meter'
FORCE='newton'
ANGLE='radians'
MASS='kg'
TIME='second'
PRESSURE='Pa'
[MODEL]
FITTYP={fit}
[DIMENSION]
UNLOADED_RADIUS=0.32
[OPERATING_CONDITIONS]
NOMPRES=220000
[VERTICAL]
FNOMIN=4000
[VERTICAL_FORCE_RANGE]
FZMIN=200
FZMAX=9000
[SLIP_ANGLE_RANGE]
ALPMIN=-0.3
[LATERAL_COEFFICIENTS]
"""
PLAIN = {
    "PCX1": 1.6,
    "PDX1": 1.1,
    "PDX2": -0.1,
    "PEX1": -0.4,
    "PEX2": 0.2,
    "PEX3": 0.1,
    "PKX1": 22.0,
    "PKX2": 0.6,
    "PKX3": 0.2,
    "PCY1": 1.35,
    "PDY1": 1.0,
    "PDY2": -0.14,
    "PEY1": -0.8,
    "PEY2": -0.5,
    "PKY1": -19.0,
    "PKY2": 1.7,
    "QBZ1": 9.0,
    "QBZ2": -1.2,
    "QBZ3": -0.6,
    "QCZ1": 1.15,
    "QDZ1": 0.11,
    "QDZ2": -0.005,
    "QEZ1": -1.5,
    "QEZ2": 0.3,
    "QEZ3": -0.4,
    "RBX1": 12.0,
    "RBX2": -10.0,
    "RCX1": 1.05,
    "REX1": -0.5,
    "REX2": -0.2,
    "RBY1": 11.0,
    "RBY2": 8.0,
    "RCY1": 1.02,
    "REY1": -0.3,
    "REY2": 0.1,
}
SHIFTS = {
    "PHX1": 1e-3,
    "PHX2": 4e-4,
    "PVX1": 2e-3,
    "PVX2": 1e-3,
    "PEX4": 0.1,
    "PHY1": 2e-3,
    "PHY2": 1e-3,
    "PVY1": 0.02,
    "PVY2": -0.01,
    "PEY3": 0.1,
    "QHZ1": 3e-3,
    "QHZ2": -1e-3,
    "QEZ4": 0.2,
    "QBZ10": -0.5,
    "QDZ6": -2e-3,
    "QDZ7": 1e-3,
    "RHX1": 5e-3,
    "RBY3": 0.02,
    "RHY1": 4e-3,
    "RHY2": 2e-3,
    "RVY1": 0.05,
    "RVY2": 0.02,
    "RVY4": 12.0,
    "RVY5": 1.8,
    "RVY6": -9.0,
    "SSZ1": 0.01,
    "SSZ2": -0.02,
    "QBZ9": 8.0,
}
CAMBER = {
    "PDX3": 2.0,
    "PDY3": 1.5,
    "PEY4": -3.0,
    "PEY5": 4.0,
    "PKY3": 0.4,
    "PKY5": 0.8,
    "PKY6": -0.9,
    "PKY7": -0.2,
    "PVY3": -0.3,
    "PVY4": -0.1,
    "QBZ4": 0.3,
    "QBZ5": -0.3,
    "QDZ3": 0.4,
    "QDZ4": 3.0,
    "QDZ8": 0.15,
    "QDZ9": 0.05,
    "QDZ10": 0.2,
    "QDZ11": 0.1,
    "QEZ5": -2.0,
    "QHZ3": 0.05,
    "QHZ4": 0.02,
    "RBX3": 20.0,
    "RBY4": 15.0,
    "RVY3": -0.3,
    "SSZ3": 0.3,
    "SSZ4": 0.1,
    "QBZ6": 1.1,
}
PRESSURE = {
    "PPX1": -0.3,
    "PPX2": 0.2,
    "PPX3": -0.08,
    "PPX4": 0.1,
    "PPY1": 0.5,
    "PPY2": 0.8,
    "PPY3": -0.1,
    "PPY4": 0.05,
    "PPY5": 0.3,
    "PPZ1": -0.4,
    "PPZ2": 0.2,
}
EVERY = {**PLAIN, "PKY4": 1.9, **SHIFTS, **CAMBER, **PRESSURE}
EVERY_5 = {
    **PLAIN,
    **SHIFTS,
    **{
        k: v
        for k, v in CAMBER.items()
        if k not in ("PEY5", "PKY5", "PKY6", "PKY7", "RBX3", "RBY4", "QDZ10", "QDZ11", "QBZ6")
    },
    "PHY3": 0.03,
}
SCALES = {
    "LFZO": 0.9,
    "LCX": 1.1,
    "LMUX": 0.8,
    "LEX": 1.1,
    "LKX": 1.2,
    "LHX": 1.3,
    "LVX": 0.7,
    "LCY": 1.1,
    "LMUY": 0.8,
    "LEY": 1.2,
    "LKY": 0.9,
    "LHY": 1.3,
    "LVY": 0.7,
    "LTR": 0.9,
    "LRES": 1.2,
    "LXAL": 1.1,
    "LYKA": 0.9,
    "LVYKA": 1.2,
    "LS": 0.8,
}
FZ0, R0, P0 = 4000.0, 0.32, 220_000.0


def tire(values: dict[str, float], fit: int = 61) -> MagicTire:
    lines = "".join(f"{key}={value!r}\n" for key, value in values.items())
    return magic_tire(parse_tir(HEAD.format(fit=fit) + lines))


FULL, PURE, FIVE = tire(EVERY), tire(PLAIN), tire(EVERY_5, 52)
LOADS = np.array([2000.0, 4000.0, 7000.0])
DFZ = (LOADS - FZ0) / FZ0
h = 1e-6


@pytest.mark.parametrize("one", [PURE, tire(PLAIN, 52)])
def test_slopes_at_zero_slip_are_the_stiffnesses(one: MagicTire) -> None:
    """(4.E15) and (4.E25), written out here once more."""
    found = magic_forces(one, LOADS, h, combined=False)
    Ky = -19.0 * FZ0 * np.sin(2 * np.arctan(LOADS / (1.7 * FZ0)))
    np.testing.assert_allclose(found.Fy / h, Ky, rtol=1e-5)
    np.testing.assert_allclose(found.cornering_stiffness, Ky, rtol=1e-12)
    Kx = LOADS * (22.0 + 0.6 * DFZ) * np.exp(0.2 * DFZ)
    np.testing.assert_allclose(magic_forces(one, LOADS, 0.0, h).Fx / h, Kx, rtol=1e-4)


@pytest.mark.parametrize("one", [PURE, tire(PLAIN, 52)])
def test_peaks_are_friction_times_load(one: MagicTire) -> None:
    slip = np.linspace(0.0, 1.5, 3001)[:, None]
    found = magic_forces(one, LOADS, slip, slip, combined=False)
    np.testing.assert_allclose(found.Fx.max(axis=0), (1.1 - 0.1 * DFZ) * LOADS, rtol=1e-5)
    np.testing.assert_allclose(-found.Fy.min(axis=0), (1.0 - 0.14 * DFZ) * LOADS, rtol=1e-5)


@pytest.mark.parametrize("one", [PURE, tire(PLAIN, 52)])
def test_without_shifts_everything_is_odd(one: MagicTire) -> None:
    a, b = (magic_forces(one, LOADS, s * 0.07, s * 0.04) for s in (1.0, -1.0))
    for name in ("Fx", "Fy", "Mz"):
        np.testing.assert_allclose(getattr(a, name), -getattr(b, name), rtol=1e-12)
    assert np.all(a.Fy < 0.0)
    assert np.all(a.Mz > 0.0)


@pytest.mark.parametrize("one", [FULL, FIVE])
def test_combined_without_the_other_slip_is_pure(one: MagicTire) -> None:
    none = {"SSZ1": 0.0, "SSZ2": 0.0, "SSZ3": 0.0, "SSZ4": 0.0}  # s Fx acts even without kappa
    still = tire({**one.coefficients.values, **none}, one.fit_type)
    a, b = (magic_forces(still, LOADS, 0.06, 0.0, combined=c) for c in (True, False))
    np.testing.assert_allclose(a.Fy, b.Fy, rtol=1e-12)
    np.testing.assert_allclose(a.Mz, b.Mz, rtol=1e-9)
    a, b = (magic_forces(one, LOADS, 0.0, 0.06, combined=c) for c in (True, False))
    np.testing.assert_allclose(a.Fx, b.Fx, rtol=1e-12)


def test_small_slip_trail_is_the_peak_trail() -> None:
    """(4.E42) with (4.E33): Mz = -Dt Fy near zero."""
    for one in (PURE, tire(PLAIN, 52)):
        found = magic_forces(one, LOADS, 1e-5)
        trail = LOADS * (R0 / FZ0) * (0.11 - 0.005 * DFZ)
        np.testing.assert_allclose(-found.Mz / found.Fy, trail, rtol=1e-4)


def test_pressure_scales_peak_and_stiffness_as_written() -> None:
    dpi = 0.2
    one = tire({**PLAIN, **PRESSURE})
    slip = np.linspace(0.0, 1.5, 3001)[:, None]
    found = magic_forces(one, LOADS, slip, slip, pressure=P0 * 1.2, combined=False)
    base = magic_forces(one, LOADS, slip, slip, combined=False)
    up, side = 1 - 0.08 * dpi + 0.1 * dpi**2, 1 - 0.1 * dpi + 0.05 * dpi**2
    # The largest of samples misses the peak by a few millionths.
    np.testing.assert_allclose(found.Fx.max(0) / base.Fx.max(0), up, rtol=1e-5)
    np.testing.assert_allclose(found.Fy.min(0) / base.Fy.min(0), side, rtol=1e-5)
    np.testing.assert_allclose(
        found.slip_stiffness[0] / base.slip_stiffness[0], 1 - 0.3 * dpi + 0.2 * dpi**2
    )
    Ky = -19.0 * FZ0 * (1 + 0.5 * dpi)
    Ky = Ky * np.sin(2 * np.arctan(LOADS / (1.7 * FZ0 * (1 + 0.8 * dpi))))
    np.testing.assert_allclose(found.cornering_stiffness[0], Ky)


def test_camber_stiffness_at_zero_slip_is_k_gamma() -> None:
    """(4.E27) to (4.E30): dFy/dgamma = Kygo, the shift taking over what SVygamma does not give."""
    values = {k: v for k, v in CAMBER.items() if k in ("PKY6", "PKY7", "PVY3", "PVY4")}
    one = tire({**PLAIN, **values, "PPY5": 0.3})
    found = magic_forces(one, LOADS, 0.0, camber=1e-6, pressure=1.1 * P0)
    np.testing.assert_allclose(found.Fy / 1e-6, LOADS * (-0.9 - 0.2 * DFZ) * 1.03, rtol=1e-4)


def test_camber_stiffens_and_grips_as_written() -> None:
    one, gamma = tire({**PLAIN, **{k: CAMBER[k] for k in ("PKY3", "PKY5", "PDY3", "PDX3")}}), 0.1
    found = magic_forces(one, LOADS, 0.0, camber=gamma)
    s = np.sin(gamma)
    Ky = -19.0 * FZ0 * (1 - 0.4 * s) * np.sin(2 * np.arctan(LOADS / FZ0 / (1.7 + 0.8 * s**2)))
    np.testing.assert_allclose(found.cornering_stiffness, Ky)
    np.testing.assert_allclose(found.friction_y, (1.0 - 0.14 * DFZ) * (1 - 1.5 * s**2))
    np.testing.assert_allclose(found.friction_x, (1.1 - 0.1 * DFZ) * (1 - 2.0 * gamma**2))


def test_slip_ratio_brings_a_side_force_of_its_own() -> None:
    """(4.E66), (4.E67): with no slip angle and no shifts Fy is SVyk, and Mz has none of it."""
    values = {k: SHIFTS[k] for k in ("RVY1", "RVY2", "RVY4", "RVY5", "RVY6")}
    kappa = np.array([[-0.1], [0.05]])
    found = magic_forces(tire({**PLAIN, **values}), LOADS, 0.0, kappa)
    expected = (1.0 - 0.14 * DFZ) * LOADS * (0.05 + 0.02 * DFZ)
    expected = expected * np.sin(1.8 * np.arctan(-9.0 * kappa))
    np.testing.assert_allclose(found.Fy, expected, rtol=1e-10)
    np.testing.assert_allclose(found.Mz, 0.0, atol=1e-9)


def test_longitudinal_force_has_its_arm() -> None:
    """(4.E76): what SSZ1, SSZ2 add to Mz is s Fx."""
    arms = {"SSZ1": 0.01, "SSZ2": -0.02}
    a = magic_forces(tire({**PLAIN, **arms}), LOADS, 0.05, -0.06)
    b = magic_forces(PURE, LOADS, 0.05, -0.06)
    np.testing.assert_allclose(a.Mz - b.Mz, R0 * (0.01 - 0.02 * a.Fy / FZ0) * a.Fx, rtol=1e-9)


def test_residual_moment_at_zero_slip() -> None:
    """(4.E47): D_r at no slip; its camber part changes sign with camber."""
    one = tire({**PLAIN, "QDZ6": -2e-3, "QDZ7": 1e-3, "QDZ8": 0.15, "QDZ10": 0.2, "PPZ2": 0.2})
    found = magic_forces(one, LOADS, 0.0, pressure=1.1 * P0)
    np.testing.assert_allclose(found.Mz, LOADS * R0 * (-2e-3 + 1e-3 * DFZ), rtol=1e-9)
    g = np.sin(0.05)
    lean = magic_forces(one, LOADS, 0.0, camber=0.05, pressure=1.1 * P0).Mz - found.Mz
    np.testing.assert_allclose(lean, LOADS * R0 * (0.15 * 1.02 * g + 0.2 * g * g), rtol=1e-9)


@pytest.mark.parametrize(
    ("values", "fit"),
    [
        ({**EVERY, **SCALES, "LKYC": 1.1, "LKZC": 0.9}, 61),
        ({**EVERY_5, **SCALES, "LGAX": 1.1, "LGAY": 0.9, "LGAZ": 1.2}, 52),
    ],
)
def test_every_coefficient_counts(values: dict[str, float], fit: int) -> None:
    """A term that was forgotten would not notice its coefficient."""
    at = {"load": 5500.0, "slip_angle": 0.06, "slip_ratio": -0.04, "camber": 0.05}
    extra = {"pressure": 1.1 * P0} if fit == 61 else {}

    def forces(v: dict[str, float]) -> np.ndarray:
        found = magic_forces(tire(v, fit), **at, **extra)
        return np.array([found.Fx, found.Fy, found.Mz])

    base = forces(values)
    for name, value in values.items():
        moved = forces({**values, name: value * 1.1})
        assert np.abs(moved / base - 1.0).max() > 1e-8, name


def test_range_is_flagged_and_nothing_is_clamped() -> None:
    found = magic_forces(PURE, [100.0, 4000.0, 9500.0], [0.0, -0.29, 0.0])
    np.testing.assert_array_equal(found.in_range, [False, True, False])
    assert not magic_forces(PURE, 4000.0, -0.31).in_range
    steep = magic_forces(tire({**PLAIN, "PEY1": 1.5}), 4000.0, 0.05)
    assert not steep.curved_well
    assert PURE.pressure is None


def test_missing_entries_are_listed_at_once() -> None:
    text = HEAD.format(fit=61).replace("UNLOADED_RADIUS=0.32", "").replace("NOMPRES=220000", "")
    with pytest.raises(FormatError) as caught:
        magic_tire(parse_tir(text + "PCY1=1.3\nPPY1=0.1\n"))
    problems = "\n".join(caught.value.problems)
    for name in ("PCX1", "PDX1", "PKX1", "PDY1", "PKY1", "PKY2", "UNLOADED_RADIUS", "NOMPRES"):
        assert name in problems, name
    assert "PCY1" not in problems


def test_bad_inputs_are_refused() -> None:
    with pytest.raises(ParameterError, match="load = 0 N"):
        magic_forces(PURE, 0.0, 0.1)
    with pytest.raises(ParameterError, match="in radians"):
        magic_forces(PURE, 4000.0, 5.0)
    with pytest.raises(ParameterError, match="has no pressure terms"):
        magic_forces(FIVE, 4000.0, 0.1, pressure=2e5)
    with pytest.raises(ParameterError, match="fit type 7; allowed are 5, 6, 52, 60, 61, 62"):
        magic_forces(replace(PURE, fit_type=7), 4000.0, 0.1)
    with pytest.raises(ParameterError, match="pressure coefficients PPX1"):
        magic_forces(tire({**PLAIN, "PPX1": 0.1}, 6), 4000.0, 0.1)
    with pytest.raises(ParameterError, match="camber is not finite"):
        magic_forces(PURE, 4000.0, 0.1, camber=np.nan)
    with pytest.raises(ShapeError, match="do not broadcast"):
        magic_forces(PURE, [1.0, 2.0], [0.1, 0.1, 0.1])


BASE = HEAD.format(fit=61) + "".join(f"{key}={value!r}\n" for key, value in PLAIN.items())


def test_only_the_tires_own_sections_feed_the_model() -> None:
    """A vendor's section that comes later has its own numbers under the same names."""
    vendor = magic_tire(parse_tir(BASE + "[VENDOR_WET]\nPDY1 = -0.4\nPKY1 = -5\nRBX3 = 7\n"))
    assert dict(vendor.coefficients.values) == dict(magic_tire(parse_tir(BASE)).coefficients.values)


def test_contradictions_are_refused_with_both_places() -> None:
    text = BASE + "[ALIGNING_COEFFICIENTS]\nPDY1 = 0.4\nPCY1 = 1.35\n[OTHER]\nFNOMIN = 1\n"
    with pytest.raises(FormatError) as caught:
        magic_tire(parse_tir(text, where="x.tir"))
    first, second = caught.value.problems[:2]
    assert "PDY1 = 1 in [LATERAL_COEFFICIENTS] but 0.4 in [ALIGNING_COEFFICIENTS]" in first
    assert "FNOMIN = 4000.0 in [VERTICAL] but 1.0 in [OTHER]" in second
    assert all(problem.startswith("x.tir: ") for problem in caught.value.problems)


def test_a_required_coefficient_in_a_strange_section_is_found_for_the_reader() -> None:
    text = BASE.replace("PDY1=1.0\n", "") + "[LATERAL_COEFFICIENTS_WET]\nPDY1 = 0.4\n"
    with pytest.raises(FormatError, match=r"PDY1 is missing.*\[LATERAL_COEFFICIENTS_WET\]"):
        magic_tire(parse_tir(text))


@pytest.mark.parametrize("fit", [52, 61])
@pytest.mark.parametrize(("name", "value"), [("LFZO", 0.0), ("PKY2", 0.0), ("LMUY", 0.0)])
def test_what_the_formula_divides_by_is_not_zero(name: str, value: float, fit: int) -> None:
    with pytest.raises(FormatError, match=f"{name} = 0"):
        tire({**PLAIN, name: value}, fit)
    sound = tire(PLAIN, fit)
    broken = replace(sound, coefficients=Coefficients({**PLAIN, name: value}))
    with pytest.raises(ParameterError, match=f"{name} = 0"):
        magic_forces(broken, 4000.0, 0.05)
