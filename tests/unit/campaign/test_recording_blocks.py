"""A continuous recording in blocks: every sample with what was known of it, whatever the blocks."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from asammdf import MDF, Signal

from tirelib.campaign import blocks as module
from tirelib.campaign.blocks import blocks
from tirelib.campaign.recording import read_recording

RATE, SLOW, SECONDS, BEGIN = 1000.0, 20.0, 2.0, 1.78e9
GAP = 500
"""Place of the first of four samples that are lost."""
TEXT = """
format = "tirelib-recording/1"
axes = "{axes}"
[wheels.FL]
tire = "made-up tire"
lateral_m = [0.06, 0.0, -0.03]
strain = "strain_{{}}"
[wheels.FL.conditions]
speed = "speed"
camber = "camber"
"""


def told(time: np.ndarray) -> np.ndarray:
    """Speed that holds at times of the recording, [m/s]: the newest of a ramp."""
    return 10.0 + np.floor(time * SLOW + 1e-6) / SLOW


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two files, each of two seconds with four samples lost, the second 5 s after the first."""
    folder = tmp_path_factory.mktemp("drive")
    for number, start in enumerate((0.0, 5.0)):
        time = np.delete(np.arange(round(SECONDS * RATE)) / RATE, np.arange(GAP, GAP + 4))
        slow = np.arange(round(SECONDS * SLOW)) / SLOW
        with MDF(version="4.10") as mdf:
            mdf.start_time = datetime.fromtimestamp(BEGIN + start, UTC)
            counts = np.arange(time.size).astype(np.float64)
            gages = [(f"strain_{k}", k * counts) for k in (1, 2, 3)]
            strain = [Signal(each, time, unit="ustrain", name=name) for name, each in gages]
            mdf.append(strain, common_timebase=True)
            speed = Signal(3.6 * told(slow + start), slow, unit="km/h", name="speed")
            camber = Signal(np.full(slow.size, 2.0), slow, unit="deg", name="camber")
            mdf.append([speed, camber], common_timebase=True)
            mdf.save(folder / f"{number}.mf4", overwrite=True)
    return folder


def described(drive: Path, axes: str = "iso") -> Path:
    (drive / "recording.toml").write_text(TEXT.format(axes=axes))
    return drive


@pytest.mark.parametrize("size", [1 << 17, 250, 37])
def test_every_sample_has_its_time_and_the_newest_condition_whatever_the_blocks(
    size: int, drive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 250 samples, the third block begins with the gap."""
    monkeypatch.setattr(module, "BLOCK", size)
    found = read_recording(described(drive))
    every = list(blocks(found, found.wheels[0]))
    time = np.concatenate([block.time for block in every])
    strain = np.concatenate([block.strain for block in every], axis=1)
    n = round(SECONDS * RATE)
    whole = np.arange(n) / RATE
    np.testing.assert_allclose(time, np.concatenate([whole, 5.0 + whole]), atol=1e-9)
    lost = np.flatnonzero(np.isnan(strain[0]))
    np.testing.assert_array_equal(lost, [f + GAP + k for f in (0, n) for k in range(4)])
    np.testing.assert_allclose(strain[2], 3.0 * strain[0])
    assert [k for k, block in enumerate(every) if block.fresh] == [0, len(every) // 2]
    speed = np.concatenate([block.held["speed"] for block in every])
    np.testing.assert_allclose(speed, told(time), atol=1e-9)


@pytest.mark.parametrize(("axes", "flips"), [("iso", 1.0), ("adapted_sae", -1.0), ("sae", -1.0)])
def test_a_recording_is_turned_from_its_axes(axes: str, flips: float, drive: Path) -> None:
    """Left is right in both kinds of SAE; camber has one sign in all three."""
    found = read_recording(described(drive, axes))
    assert found.wheels[0].lateral == pytest.approx(flips * np.array([0.06, 0.0, -0.03]))
    held = next(blocks(found, found.wheels[0])).held
    assert held["camber"] == pytest.approx(np.deg2rad(2.0))
