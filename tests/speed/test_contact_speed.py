"""Cost of the contact, beside the dissertation's route in the same run.

Run by `make bench`. Goals: one contact (60 modes) in under 1 ms; cost per point flat from 10 to
10,000. Times are the least over rounds: whatever else the machine does only adds. 40 Gauss nodes
stand here for the dissertation's 200 uniform ones, and are the more exact of the two; a contact on
200 Gauss nodes is timed and printed beside them. Finite elements: wall time of one load step of the
stored reference, from its solver's log, not from the same run.
"""

import tomllib
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pytest
from scipy.optimize import fsolve

from tirelib.core.parameters import Tire, read_tire
from tirelib.physics.contact import shear
from tirelib.physics.contact.radial import load, press
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance, compliance
from tirelib.physics.ring.ring import Ring, plain_stiffness

pytestmark = pytest.mark.speed
TIRE = read_tire("table-6-1").tire
TREAD = Tread.of(TIRE)
SLIDING = shear.Shear(TIRE.tread_shear_stiffness or TIRE.tread_stiffness / 3.0, 0.05)
"""Friction so low that a part of the contact slides."""
OMEGA, MODES = 59.0, 60
D0 = 0.025
GOLDEN = Path(__file__).parents[1] / "golden"


@pytest.fixture(scope="module")
def ring() -> Compliance:
    return compliance(Ring.of(TIRE, TIRE.pressure), OMEGA, MODES)


def least(work: Any, rounds: int) -> float:
    """Return the least time of one call, [s]."""
    times = []
    for _ in range(rounds):
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return min(times)


@pytest.mark.benchmark(group="one contact", min_rounds=200)
def test_one_contact_at_a_deflection(benchmark: Any, ring: Compliance) -> None:
    benchmark(press, ring, TREAD, D0)
    benchmark.extra_info["ms"] = round(1e3 * benchmark.stats.stats.min, 3)


@pytest.mark.benchmark(group="one contact", min_rounds=200)
def test_one_contact_at_a_load(benchmark: Any, ring: Compliance) -> None:
    benchmark(load, ring, TREAD, 5000.0)
    benchmark.extra_info["ms"] = round(1e3 * benchmark.stats.stats.min, 3)


@pytest.mark.benchmark(group="one contact", min_rounds=200)
def test_one_contact_and_its_pressure_at_200_angles(benchmark: Any, ring: Compliance) -> None:
    phi = np.linspace(-0.25, 0.25, 200)
    benchmark(lambda: press(ring, TREAD, D0).pressure_at(phi))


@pytest.mark.benchmark(group="one contact", min_rounds=50)
def test_one_contact_on_200_gauss_nodes(benchmark: Any, ring: Compliance) -> None:
    benchmark(press, ring, TREAD, D0, n_nodes=200)


@pytest.mark.benchmark(group="one contact with shear", min_rounds=20)
@pytest.mark.parametrize("n_nodes", [40, 200])
def test_one_sliding_contact_with_shear(benchmark: Any, ring: Compliance, n_nodes: int) -> None:
    contact = benchmark(shear.load, ring, TREAD, SLIDING, 5000.0, n_nodes=n_nodes)
    assert contact.sliding.any()
    assert not contact.sliding.all()
    benchmark.extra_info["ms"] = round(1e3 * benchmark.stats.stats.min, 2)
    benchmark.extra_info["finite elements to one"] = round(
        golden_time() / benchmark.stats.stats.min
    )


@pytest.mark.benchmark(group="a hundred contacts with shear")
def test_batch_of_a_hundred_sliding_contacts(benchmark: Any, ring: Compliance) -> None:
    loads = np.linspace(1000.0, 9000.0, 100)
    contact = benchmark.pedantic(shear.load, (ring, TREAD, SLIDING, loads), rounds=3)
    assert contact.sliding.any(axis=1).all()
    benchmark.extra_info["ms per point"] = round(10.0 * benchmark.stats.stats.min, 2)


@pytest.mark.benchmark(group="one contact", min_rounds=50)
def test_the_ring_itself(benchmark: Any) -> None:
    benchmark(lambda: compliance(Ring.of(TIRE, TIRE.pressure), OMEGA, MODES))


@pytest.mark.benchmark(group="a thousand contacts")
def test_batch_of_a_thousand_loads(benchmark: Any, ring: Compliance) -> None:
    loads = np.linspace(1000.0, 9000.0, 1000)
    benchmark.pedantic(load, (ring, TREAD, loads), rounds=5, warmup_rounds=1)
    benchmark.extra_info["ms per point"] = round(benchmark.stats.stats.min, 3)


@pytest.mark.benchmark(group="cost per point")
def test_cost_per_point_from_ten_to_ten_thousand(benchmark: Any, ring: Compliance) -> None:
    """A batch costs per point what its points cost: no term grows with the number."""
    per_point = {
        n: 1e3 * least(lambda n=n: load(ring, TREAD, np.linspace(1000.0, 9000.0, n)), rounds) / n
        for n, rounds in ((10, 40), (100, 20), (1000, 3), (10_000, 1))
    }
    benchmark.extra_info["ms per point"] = {n: round(t, 3) for n, t in per_point.items()}
    benchmark.pedantic(load, (ring, TREAD, np.linspace(1000.0, 9000.0, 100)), rounds=5)


@pytest.mark.benchmark(group="one contact")
def test_baseline_dissertations_route(benchmark: Any, ring: Compliance) -> None:
    """Eq. (93)-(97) as described there: quadrature, linear solve, two angles by fsolve."""
    angles, fz = benchmark.pedantic(by_the_book, (TIRE, D0), rounds=5, warmup_rounds=1)
    ours = press(ring, TREAD, D0)
    np.testing.assert_allclose(angles, ours.edges[0], atol=1e-6)  # the same work was done
    assert fz == pytest.approx(ours.load[0], rel=1e-6)
    one = least(lambda: press(ring, TREAD, D0), 200)
    benchmark.extra_info["ratio to one contact"] = round(benchmark.stats.stats.min / one, 1)
    many = least(lambda: press(ring, TREAD, D0, n_nodes=200), 50)
    benchmark.extra_info["ratio to one contact on 200 nodes"] = round(
        benchmark.stats.stats.min / many, 1
    )
    finite_elements = golden_time()
    benchmark.extra_info["finite elements to one contact"] = round(finite_elements / one)
    benchmark.extra_info["finite elements to one contact on 200 nodes"] = round(
        finite_elements / many
    )


def by_the_book(tire: Tire, d0: float) -> tuple[np.ndarray, float]:
    """Contact angles and load; 2 x 60 unknowns, 200 quadrature nodes."""
    n = np.arange(1.0, MODES + 1)
    k = plain_stiffness(Ring.of(tire, tire.pressure), MODES)[0, 1:]
    c = OMEGA * n * 2 * tire.damping * np.sqrt(tire.mass * (1 + n**2) * k)
    amplitude, lag = -(n**2) / (np.pi * np.hypot(k, c)), np.arctan2(c, k)
    xi, weights = np.polynomial.legendre.leggauss(200)

    def solve(angles: np.ndarray) -> tuple[np.ndarray, float]:
        middle, half = angles.mean(), 0.5 * (angles[1] - angles[0])
        phi, w = middle + half * xi, half * weights
        turn, rear = np.outer(n, phi), n * angles[1] - lag
        cos, sin = np.cos(turn), np.sin(turn)
        late = turn - lag[:, None]
        waves = np.concatenate(
            [
                amplitude[:, None] * (np.cos(late) - np.cos(rear)[:, None]),
                amplitude[:, None] * (np.sin(late) - np.sin(rear)[:, None]),
            ]
        )
        rows = np.concatenate([cos, sin]) * w
        left = rows @ waves.T - np.eye(2 * MODES) / tire.tread_stiffness
        right = tire.free_radius * rows @ (np.cos(angles[1]) - np.cos(phi))
        harmonics = np.linalg.solve(left, right)

        def displacement(at: np.ndarray) -> np.ndarray:
            x = np.outer(at, n) - lag
            return np.cos(x) @ (amplitude * harmonics[:MODES]) + np.sin(x) @ (
                amplitude * harmonics[MODES:]
            )

        rest = d0 - tire.free_radius * (1 - np.cos(angles)) + displacement(angles)
        q = tire.tread_stiffness * (d0 - tire.free_radius * (1 - np.cos(phi)) + displacement(phi))
        return rest, tire.ring_radius * float((w * q * np.cos(phi)).sum())

    half = 0.6 * np.arccos(1 - d0 / tire.free_radius)
    angles = fsolve(lambda x: solve(x)[0], np.array([-half, half]), xtol=1e-10)
    return angles, solve(angles)[1]


def golden_time() -> float:
    """Return the stored wall time of one load step of finite elements with friction, [s]."""
    recipe = tomllib.loads((GOLDEN / "fem_tire.toml").read_text(encoding="utf-8"))
    return float(recipe["cases"]["solid_mu050"]["seconds_per_load_step"])
