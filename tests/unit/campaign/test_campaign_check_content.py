"""Faults of what was measured: one at a time, exactly its message; and many at once."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.unit.campaign.campaign_faults import channel, put, says, the_one
from tests.unit.campaign.campaign_synthetic import (
    HEADER,
    Write,
    changed,
    make_run,
    rewrite,
    with_rig,
    with_strain,
)
from tirelib.campaign import FloatArray, Run, check_campaign, read_campaign
from tirelib.core.errors import FormatError

Runs = tuple[Run, ...]


# --- gages -----------------------------------------------------------------------------------


def clip(strain: FloatArray) -> None:
    np.minimum(strain[1], np.quantile(strain[1], 0.97), out=strain[1])


def spikes(strain: FloatArray) -> None:
    strain[2, 300] += 0.001
    strain[2, 900] -= 0.002


def freeze(strain: FloatArray) -> None:
    strain[3, 200:330] = strain[3, 200]


def noise(strain: FloatArray) -> None:
    strain[4] = 0.002 + 3e-6 * np.random.default_rng(1).standard_normal(strain.shape[1])


def negate(strain: FloatArray) -> None:
    strain *= -1.0


def shrink(strain: FloatArray) -> None:
    strain /= 1e6


def upside_down(strain: FloatArray) -> None:
    strain[0] *= -1.0


GAGE_FAULTS = {
    "nan": (
        put(1, 400, np.nan),
        "channel strain_2, sample 400 (t = 0.0800 s): 1 of 1800 samples are not finite, the first",
    ),
    "dropouts": (
        put(1, [400, 401, 402, 900], np.nan),
        "sample 400 (t = 0.0800 s): 4 of 1800 samples are not finite in 2 dropouts",
    ),
    "infinite": (put(1, 400, np.inf), "the first is infinite; every sample must be a finite"),
    "saturated": (clip, "channel strain_2, sample"),
    "spikes": (
        spikes,
        "channel strain_3, sample 300 (t = 0.0600 s): 2 sample(s) in spikes, the first of",
    ),
    "stuck": (freeze, "strain_4, sample 200 (t = 0.0400 s): dropout: the signal stays at"),
    "constant": (put(2, slice(None), 0.0025), "strain_3: dead: every sample is 2500 ustrain"),
    "noise": (noise, "channel strain_5: dead: only noise of"),
    "inverted": (upside_down, "channel strain_1: inverted: the contact peak is compressive"),
}


@pytest.mark.parametrize("fault", GAGE_FAULTS)
@pytest.mark.parametrize("number", [2, 9])
def test_each_fault_of_a_gage_has_its_message(
    write: Write, sound_runs: Runs, fault: str, number: int
) -> None:
    change, message = GAGE_FAULTS[fault]
    folder = write(changed(sound_runs, number, with_strain(change)))
    says(the_one(check_campaign(folder)), f"runs/{number:03d}.mf4", message)


@pytest.mark.parametrize(("share", "dead"), [(0.04, True), (0.06, False)])
def test_a_gage_with_less_than_a_twentieth_of_the_others_swing_is_dead(
    write: Write, sound_runs: Runs, share: float, dead: bool
) -> None:
    def weak(strain: FloatArray) -> None:
        swing = np.median(np.ptp(np.delete(strain, 4, axis=0), axis=1))
        strain[4] *= share * swing / np.ptp(strain[4])

    found = check_campaign(write(changed(sound_runs, 9, with_strain(weak))))
    said = [str(problem) for problem in found if "strain_5: dead: it varies by" in str(problem)]
    assert bool(said) == dead


@pytest.mark.parametrize("quantum", [1e-7, 2.5e-6, 5e-6, 1e-5, 2e-5])
def test_equal_samples_of_a_coarse_converter_are_no_rail(
    write: Write, sound_runs: Runs, quantum: float
) -> None:
    def coarse(strain: FloatArray) -> None:
        strain += 3e-6 * np.random.default_rng(5).standard_normal(strain.shape)
        np.round(strain / quantum, out=strain)
        strain *= quantum

    assert check_campaign(write(changed(sound_runs, 9, with_strain(coarse)))) == []


def test_saturation_says_rail_value_and_length(write: Write, sound_runs: Runs) -> None:
    text = the_one(check_campaign(write(changed(sound_runs, 9, with_strain(clip)))))
    says(
        text,
        "saturated: flat maximum at",
        "consecutive samples",
        "equal consecutive samples are normal",
    )


def test_strain_inverted_everywhere_is_one_line(write: Write, sound_runs: Runs) -> None:
    folder = write(changed(sound_runs, None, with_strain(negate)))
    says(
        the_one(check_campaign(folder)),
        "12 of 12 runs (runs/000.mf4, runs/001.mf4, runs/002.mf4, ...), "
        "channel strain_1 to strain_5: inverted",
    )


def test_strain_in_a_wrong_unit_names_the_factor(write: Write, sound_runs: Runs) -> None:
    folder = write(changed(sound_runs, None, with_strain(shrink)))
    says(
        the_one(check_campaign(folder)), "are plausible under load; a factor of 1e+06 is suspected"
    )


@pytest.mark.parametrize("pair", [(0, 4), (1, 3), (0, 1), (2, 3)])
@pytest.mark.parametrize("number", [0, 9])
def test_gages_swapped_in_one_run_are_named(
    write: Write, sound_runs: Runs, pair: tuple[int, int], number: int
) -> None:
    one, other = pair

    def swap(strain: FloatArray) -> None:
        strain[[one, other]] = strain[[other, one]]

    text = the_one(check_campaign(write(changed(sound_runs, number, with_strain(swap)))))
    says(
        text, f"runs/{number:03d}.mf4, channel strain_{one + 1}, strain_{other + 1}: swapped gages"
    )


@pytest.mark.parametrize("pair", [(1, 3), (0, 1), (2, 3)])
def test_gages_swapped_in_all_runs_contradict_their_positions(
    write: Write, sound_runs: Runs, pair: tuple[int, int]
) -> None:
    one, other = pair

    def swap(strain: FloatArray) -> None:
        strain[[one, other]] = strain[[other, one]]

    text = the_one(check_campaign(write(changed(sound_runs, None, with_strain(swap)))))
    says(text, f"lateral_m, channels strain_{one + 1}, strain_{other + 1}: swapped gages")


# --- turns and trigger -----------------------------------------------------------------------


def test_less_than_two_turns_are_refused(write: Write, sound_runs: Runs) -> None:
    def cut(run: Run) -> Run:
        assert run.strain is not None
        assert run.trigger is not None
        return replace(run, strain=run.strain[:, :1000], trigger=run.trigger[:1000])

    text = the_one(check_campaign(write(changed(sound_runs, 4, cut))))
    says(text, "runs/004.mf4: 1.83 turns of 0.1091 s; two turns or more are needed")


def test_a_trigger_that_contradicts_the_wheel_speed_is_named(
    write: Write, sound_runs: Runs
) -> None:
    def twice(run: Run) -> Run:
        assert run.trigger is not None
        trigger = run.trigger.copy()
        trigger[np.flatnonzero(trigger)[:-1] + 273] = True
        return replace(run, trigger=trigger)

    text = the_one(check_campaign(write(changed(sound_runs, 4, twice))))
    says(text, "004.mf4, channel trigger: its period is 54.6 ms, by omega a turn takes 109.1 ms")


def test_a_trigger_that_missed_a_turn_is_named(write: Write, sound_runs: Runs) -> None:
    def miss(run: Run) -> Run:
        plan = run.plan
        longer = make_run(plan.run, plan.load, plan.slip_angle, start=plan.start, turns=5.3)
        assert longer.trigger is not None
        trigger = longer.trigger.copy()
        trigger[np.flatnonzero(trigger)[2]] = False
        return replace(longer, trigger=trigger)

    text = the_one(check_campaign(write(changed(sound_runs, 4, miss))))
    says(
        text, "sample 1057 (t = 0.2114 s): 1 uneven period(s), the first of 2.00 turns: a pulse is"
    )


# --- rig -------------------------------------------------------------------------------------


def minus(x: FloatArray) -> FloatArray:
    return -x


RIG_FAULTS = {
    "kN": (
        with_rig(Fz=lambda x: x / 1e3),
        "channel Fz: mean 3.001 N, the set point is 3000 N (ratio 0.001); within 15 % of the set "
        "point or 100 N is allowed; a factor of 0.001 is suspected (N and kN mixed up)",
    ),
    "kgf": (with_rig(Fz=lambda x: x / 9.80665), "a factor of 0.102 is suspected (kgf and N mixed"),
    "kPa": (
        with_rig(pressure=lambda x: x * 100),
        "a factor of 100 is suspected (kPa and bar mixed",
    ),
    "psi": (
        with_rig(pressure=lambda x: x * 14.5),
        "a factor of 14.5 is suspected (psi and bar mix",
    ),
    "rad": (
        with_rig(slip_angle=np.rad2deg),
        "a factor of 57.3 is suspected (rad and deg mixed up)",
    ),
    "negative Fz": (
        with_rig(Fz=minus),
        "channel Fz: wrong sign: -2999 N in the median, axes = 'adapted_sae'; Fz of a loaded",
    ),
    "negative Fy": (with_rig(Fy=minus), "channel Fy: wrong sign: Fy against slip angle is not as"),
    "negative Mz": (
        with_rig(Mz=minus),
        "channel Mz: wrong sign: Mz against Fy at small slip angles is not as in the other runs",
    ),
    "nan": (
        with_rig(Mz=lambda x: np.where(np.arange(x.size) == 3, np.nan, x)),
        "channel Mz, sample 3 (t = 0.0300 s): 1 of 36 samples are not finite",
    ),
    "loaded radius": (
        with_rig(loaded_radius=lambda x: x * 1e3),
        "channel loaded_radius: 3.061e+05 mm, the free radius is 320 mm; 60 .. 110 %",
    ),
}


@pytest.mark.parametrize("fault", RIG_FAULTS)
def test_each_fault_of_the_rig_has_its_message(write: Write, sound_runs: Runs, fault: str) -> None:
    change, message = RIG_FAULTS[fault]
    says(the_one(check_campaign(write(changed(sound_runs, 1, change)))), "runs/001.mf4", message)


def test_speed_in_a_wrong_unit_shows_in_set_point_and_wheel_speed(
    write: Write, sound_runs: Runs
) -> None:
    problems = check_campaign(write(changed(sound_runs, 1, with_rig(speed=lambda x: x / 3.6))))
    assert len(problems) == 2
    says(str(problems[0]), "channel speed: mean 18.05 km/h, the set point is 65 km/h (ratio 0.278)")
    says(str(problems[0]), "a factor of 0.2778 is suspected (km/h and m/s mixed up)")
    says(str(problems[1]), "channel omega: omega times the free radius is 66.32 km/h, speed and")


def test_a_set_point_missed_by_a_little_is_a_warning(write: Write, sound_runs: Runs) -> None:
    problems = check_campaign(write(changed(sound_runs, 1, with_rig(Fz=lambda x: 1.2 * x))))
    says(the_one(problems, "warning"), "channel Fz: mean 3602 N, the set point is 3000 N")


def test_a_spike_of_the_rig_is_a_warning(write: Write, sound_runs: Runs) -> None:
    def spike(x: FloatArray) -> FloatArray:
        return np.where(np.arange(x.size) == 9, x + 2000.0, x)

    problems = check_campaign(write(changed(sound_runs, 1, with_rig(Fz=spike))))
    says(the_one(problems, "warning"), "channel Fz, sample 9 (t = 0.0900 s): 1 sample(s) in spikes")


@pytest.mark.parametrize("axes", ["iso", "sae", "adapted_sae"])
def test_signs_that_contradict_the_axes_everywhere_are_one_line(
    write: Write, sound_runs: Runs, axes: str
) -> None:
    header = replace(HEADER, axes=axes)
    problems = check_campaign(write(changed(sound_runs, None, with_rig(Fy=minus)), header))
    same = "the same sign" if axes == "adapted_sae" else "opposite signs"
    says(
        the_one(problems),
        f"campaign.toml, axes: wrong sign: Fy against slip angle contradicts axes = {axes!r} in "
        f"9 of 9 runs with a slip angle (runs/000.mf4 first); Fy and slip angle have {same}",
    )


@pytest.mark.parametrize("axes", ["iso", "sae", "adapted_sae"])
def test_an_aligning_moment_turned_everywhere_is_one_line(
    write: Write, sound_runs: Runs, axes: str
) -> None:
    header = replace(HEADER, axes=axes)
    problems = check_campaign(write(changed(sound_runs, None, with_rig(Mz=minus)), header))
    says(
        the_one(problems),
        f"campaign.toml, axes: wrong sign: Mz against Fy at small slip angles contradicts axes = "
        f"{axes!r} in ",
        "Mz and Fy at small slip angles have opposite signs in these axes",
        "or correct the sign of Mz",
    )


def test_wrong_axes_are_told_by_fz(write: Write) -> None:
    folder = write(header=replace(HEADER, axes="sae"))
    text = (folder / "campaign.toml").read_text().replace('"sae"', '"iso"')
    (folder / "campaign.toml").write_text(text)
    texts = [str(problem) for problem in check_campaign(folder)]
    says("\n".join(texts), "12 of 12 runs", "channel Fz: wrong sign: -2996 N", "axes = 'iso'")


# --- all at once -----------------------------------------------------------------------------


def test_many_faults_appear_at_once(write: Write, sound_runs: Runs) -> None:
    runs = list(sound_runs)
    for number, change in (
        (0, with_strain(put(1, 400, np.nan))),
        (1, with_strain(clip)),
        (2, with_strain(upside_down)),
        (3, with_rig(Fz=lambda x: x / 1e3)),
        (4, with_strain(spikes)),
    ):
        runs = changed(runs, number, change)
    folder = write(runs)
    rewrite(folder / "runs" / "005.mf4", channel("Fy", unit=""))
    content = (folder / "runs" / "006.mf4").read_bytes()
    (folder / "runs" / "006.mf4").write_bytes(content[:5000])
    (folder / "runs" / "007.mf4").unlink()
    (folder / "runs" / "old.mf4").write_bytes(content)
    text = (folder / "campaign.toml").read_text().replace("0.0033", "3.3")
    (folder / "campaign.toml").write_text(text)
    table = (folder / "runs.csv").read_text().replace("8,runs/008.mf4,corner", "8,runs/008.mf4,x")
    (folder / "runs.csv").write_text(table)

    expected = (
        "[tire] innerliner_offset_m: -3.3 m is not plausible",
        "runs.csv, line 10, kind: 'x' is given",
        "runs/000.mf4, channel strain_2, sample 400",
        "runs/001.mf4, channel strain_2, sample",
        "runs/002.mf4, channel strain_1: inverted",
        "runs/003.mf4, channel Fz: mean 3.003 N",
        "runs/004.mf4, channel strain_3, sample 300",
        "runs/005.mf4, channel Fy: the channel has no unit",
        "runs/006.mf4: truncated or damaged",
        "runs/007.mf4: the run file cannot be read",
        "runs/old.mf4: the file is not listed",
    )
    problems = check_campaign(folder)
    texts = [str(problem) for problem in problems]
    assert len(texts) == len(expected), "\n".join(texts)
    for line, part in zip(texts, expected, strict=True):
        assert part in line
    with pytest.raises(FormatError) as caught:
        read_campaign(folder)
    assert len(caught.value.problems) == 2


def test_a_file_is_not_a_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FormatError, match="not a readable folder"):
        check_campaign(tmp_path / "file")


def test_progress_counts_the_runs(write: Write) -> None:
    steps: list[tuple[int, int]] = []
    check_campaign(write(), progress=lambda done, total: steps.append((done, total)))
    assert steps == [(n, 12) for n in range(1, 13)]
