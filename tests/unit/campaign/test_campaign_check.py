"""One fault at a time is planted, and exactly its message is asserted."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from campaign_synthetic import HEADER, Write, changed, make_run, rewrite, with_rig, with_strain

from tirelib.campaign import FloatArray, Problem, Run, check_campaign, read_campaign
from tirelib.campaign.mdf import Channel, Group
from tirelib.errors import FormatError

Runs = tuple[Run, ...]


def the_one(problems: list[Problem], severity: str = "error") -> str:
    """Return the only problem as text; fail and show them when there are others."""
    assert [p.severity for p in problems] == [severity], "\n".join(map(str, problems))
    assert problems[0].where
    assert problems[0].given
    assert problems[0].allowed
    assert problems[0].remedy
    return str(problems[0])


def says(text: str, *parts: str) -> None:
    """Assert that every part stands in the text."""
    missing = [part for part in parts if part not in text]
    assert not missing, f"{missing} not in: {text}"


def test_a_sound_campaign_has_no_problem(write: Write) -> None:
    assert check_campaign(write()) == []


# --- campaign.toml ---------------------------------------------------------------------------

HEADER_FAULTS = {
    "unknown version": ("tirelib-campaign/1", "tirelib-campaign/9", "'tirelib-campaign/9' is an"),
    "no format": ('format = "tirelib-campaign/1"\n', "", "format: the key is missing"),
    "no axes": ('axes = "adapted_sae"\n', "", "axes: the key is missing"),
    "unknown axes": ('"adapted_sae"', '"din"', "'din' is an unknown axis system; iso, sae, adap"),
    "no name": ('name = "synthetic"\n', "", "name: the key is missing"),
    "no radius": ("free_radius_m = 0.32\n", "", "[tire] free_radius_m: the key is missing"),
    "text for a number": ("rate_hz = 5000.0", 'rate_hz = "fast"', "'fast' is given; a number is"),
    "number for a text": ('name = "test tire"', "name = 5", "[tire] name: 5 is given; a text is"),
    "millimetres": (
        "free_radius_m = 0.32",
        "free_radius_m = 320.0",
        "320 m is not plausible; 0.1 .. 1.5 m is allowed; it looks like millimetres: write 0.32",
    ),
    "lateral in mm": ("0.03,", "30.0,", "[gages] lateral_m[1]: -30 m is not plausible"),
    "positive offset": ("-0.0033", "0.0033", "its sign looks wrong: write -0.0033"),
    "ring outside": ("ring_radius_m = 0.305", "ring_radius_m = 0.33", "does not fit the free"),
    "gage beside the belt": ("belt_width_m = 0.165", "belt_width_m = 0.08", "lie beside the belt"),
    "one place twice": ("0.03,", "0.06,", "holds one position twice"),
    "no strain unit": (
        'unit = "ustrain"',
        'unit = "mV"',
        "'mV' is not a unit of strain; 1, strain",
    ),
    "tolerance in percent": ("load = 0.005", "load = 5", "it looks like percent: write 0.05"),
    "half a tolerance": ("gain = 0.003\n", "", "[tolerance] gain: the key is missing"),
    "not TOML": ("[gages]", "[gages", "not TOML"),
}


@pytest.mark.parametrize("fault", HEADER_FAULTS)
def test_each_fault_of_the_header_has_its_message(write: Write, fault: str) -> None:
    old, new, message = HEADER_FAULTS[fault]
    folder = write()
    text = (folder / "campaign.toml").read_text()
    assert old in text
    (folder / "campaign.toml").write_text(text.replace(old, new, 1))
    errors = [problem for problem in check_campaign(folder) if problem.severity == "error"]
    says(the_one(errors), "campaign.toml", message)
    with pytest.raises(FormatError, match=r"campaign\.toml"):
        read_campaign(folder)


def test_a_misspelt_key_is_a_warning(write: Write) -> None:
    folder = write()
    text = (folder / "campaign.toml").read_text().replace("belt_width_m", "beltwidth_m")
    (folder / "campaign.toml").write_text(text)
    says(the_one(check_campaign(folder), "warning"), "[tire] beltwidth_m: the key is unknown")


def test_a_missing_header_is_named_and_the_runs_are_still_opened(write: Write) -> None:
    folder = write()
    (folder / "campaign.toml").unlink()
    (folder / "runs" / "002.mf4").write_bytes(b"nonsense")
    problems = check_campaign(folder)
    assert [p.severity for p in problems] == ["error", "error", "warning"]
    says(str(problems[0]), "campaign.toml: it cannot be read (No such file or directory)")
    says(str(problems[1]), "runs/002.mf4: not an MDF file (begins with b'nonsense')")
    says(str(problems[2]), "contents of the runs could not be checked")


# --- runs.csv --------------------------------------------------------------------------------

PLAN_FAULTS = {
    "no column": ("slip_ratio", "kappa", "line 1: column 'slip_ratio' is missing"),
    "no number": ("3000.0", "much", "line 2, load_N: 'much' is given; a finite number is needed"),
    "nan": ("3000.0", "nan", "line 2, load_N: 'nan' is given; a finite number is needed"),
    "empty": ("3000.0", "", "line 2, load_N: the set point is empty; only a sweep may"),
    "negative load": ("3000.0", "-3000.0", "-3000 N is not plausible; 0 .. 500000 N is allowed"),
    "pascal": ("2.3,", "230000,", "line 2, pressure_bar: 230000 bar is not plausible"),
    "unknown kind": ("corner", "turn", "line 2, kind: 'turn' is given; free, corner, camber"),
    "no run number": ("0,runs/000", "first,runs/000", "run: 'first' is given; a whole number"),
    "file elsewhere": ("runs/000.mf4", "../000.mf4", "file: '../000.mf4' is given; a file inside"),
    "short row": (",0.0,0.0,0.0\n", "\n", "line 2: 7 cells are given; 10 columns are declared"),
}


@pytest.mark.parametrize("fault", PLAN_FAULTS)
def test_each_fault_of_the_plan_has_its_message(write: Write, fault: str) -> None:
    old, new, message = PLAN_FAULTS[fault]
    folder = write()
    text = (folder / "runs.csv").read_text()
    assert old in text
    (folder / "runs.csv").write_text(text.replace(old, new, 1))
    errors = [problem for problem in check_campaign(folder) if problem.severity == "error"]
    says(the_one(errors), "runs.csv", message)
    with pytest.raises(FormatError, match=r"runs\.csv"):
        read_campaign(folder)


def test_a_run_number_given_twice_is_a_duplicate_run(write: Write) -> None:
    folder = write()
    text = (folder / "runs.csv").read_text().replace("\n3,runs", "\n2,runs")
    (folder / "runs.csv").write_text(text)
    says(the_one(check_campaign(folder)), "runs.csv, lines 4, 5: run 2 is listed 2 times")


def test_a_file_used_by_two_runs_is_named(write: Write) -> None:
    folder = write()
    text = (folder / "runs.csv").read_text().replace("runs/003.mf4", "runs/001.mf4")
    (folder / "runs.csv").write_text(text)
    texts = [str(problem) for problem in check_campaign(folder)]
    says(texts[0], "runs.csv, lines 3, 5: file runs/001.mf4 is listed 2 times")
    assert any("runs/003.mf4: the file is not listed in runs.csv" in text for text in texts)


def test_a_missing_plan_is_named(write: Write) -> None:
    folder = write()
    (folder / "runs.csv").unlink()
    errors = [problem for problem in check_campaign(folder) if problem.severity == "error"]
    says(the_one(errors), "runs.csv: it cannot be read (No such file or directory)")


def test_a_plan_without_repeats_is_a_warning(write: Write, sound_runs: Runs) -> None:
    problems = check_campaign(write(sound_runs[:10]))
    says(the_one(problems, "warning"), "runs.csv: none of the 10 set points was measured twice")


# --- files -----------------------------------------------------------------------------------


def test_a_missing_run_is_named(write: Write) -> None:
    folder = write()
    (folder / "runs" / "004.mf4").unlink()
    says(the_one(check_campaign(folder)), "runs/004.mf4: the run file cannot be read (No such file")
    campaign = read_campaign(folder)
    with pytest.raises(FormatError, match=r"004\.mf4: the run file cannot be read"):
        campaign.load(campaign.plans[4])


def test_a_file_that_no_row_lists_is_a_warning(write: Write) -> None:
    folder = write()
    (folder / "runs" / "099.mf4").write_bytes(b"")
    says(the_one(check_campaign(folder), "warning"), "runs/099.mf4: the file is not listed")


@pytest.mark.parametrize("share", [0.0005, 0.003, 0.05, 0.5, 0.9, 0.99])
def test_a_truncated_file_is_told_from_a_sound_one_wherever_it_ends(
    write: Write, share: float
) -> None:
    folder = write()
    file = folder / "runs" / "005.mf4"
    content = file.read_bytes()
    file.write_bytes(content[: int(len(content) * share)])
    says(the_one(check_campaign(folder)), "runs/005.mf4: truncated or damaged MDF 4 file of")


def test_an_unfinished_or_old_recording_is_told_from_a_damaged_one(write: Write) -> None:
    folder = write()
    file = folder / "runs" / "005.mf4"
    content = file.read_bytes()
    file.write_bytes(b"UnFinMF " + content[8:])
    says(the_one(check_campaign(folder)), "005.mf4: the recording was never finished")
    file.write_bytes(content[:8] + b"3.30    " + content[16:])
    says(the_one(check_campaign(folder)), "005.mf4: MDF version 3.30; version 4 is needed")


def test_a_copied_run_is_a_duplicate(write: Write, sound_runs: Runs) -> None:
    copy = replace(sound_runs[2], plan=sound_runs[10].plan)  # the repeat of run 2
    says(
        the_one(check_campaign(write(changed(sound_runs, 10, lambda _: copy)))),
        "runs/010.mf4: duplicate run: its samples are those of runs/002.mf4",
    )


def channel(which: str, **new: object) -> Callable[[Group], Group]:
    """Return a change of a group that edits one channel."""

    def apply(group: Group) -> Group:
        edited = [
            replace(c, **new) if c.name == which else c  # type: ignore[arg-type]
            for c in group.channels
        ]
        return replace(group, channels=tuple(edited))

    return apply


def gage_clock(change: Callable[[FloatArray], FloatArray]) -> Callable[[Group], Group]:
    """Return a change of the strain group that edits its clock."""

    def apply(group: Group) -> Group:
        if group.channels[0].name != "strain_1" or group.time is None:
            return group
        return replace(group, time=replace(group.time, samples=change(group.time.samples)))

    return apply


CHANNEL_FAULTS = {
    "no unit": (channel("Fz", unit=""), "channel Fz: the channel has no unit; each channel carr"),
    "wrong dimension": (channel("Fz", unit="bar"), "channel Fz: unit 'bar' is a unit of pressure"),
    "unknown unit": (channel("Fz", unit="stone"), "channel Fz: unit 'stone' is not a unit that is"),
    "strain without unit": (channel("strain_2", unit=""), "strain_2: the channel has no unit"),
    "strain in another unit": (
        channel("strain_2", unit="mm/m"),
        "channel strain_2: its unit is 'mm/m'; campaign.toml declares 'ustrain'",
    ),
    "trigger without unit": (channel("trigger", unit=""), "trigger: the channel has no unit"),
    "too few gages": (
        channel("strain_5", name="spare", unit="ustrain"),
        "4 strain channels (strain_1, strain_2, strain_3, strain_4); [gages] lateral_m declares 5",
    ),
    "a name twice": (channel("Fx", name="Fy"), "channel Fy: the channel is there twice"),
}


@pytest.mark.parametrize("fault", CHANNEL_FAULTS)
def test_each_fault_of_a_channel_has_its_message(write: Write, fault: str) -> None:
    change, message = CHANNEL_FAULTS[fault]
    folder = write()
    rewrite(folder / "runs" / "003.mf4", change)
    says(the_one(check_campaign(folder)), "runs/003.mf4", message)
    campaign = read_campaign(folder)
    with pytest.raises(FormatError, match=r"runs/003\.mf4"):
        campaign.load(campaign.plans[3])


def test_a_unit_of_the_same_dimension_is_converted(write: Write, sound_runs: Runs) -> None:
    folder = write()

    def kilo(group: Group) -> Group:
        edited = [
            Channel("Fz", "kN", c.samples / 1e3) if c.name == "Fz" else c for c in group.channels
        ]
        return replace(group, channels=tuple(edited))

    rewrite(folder / "runs" / "003.mf4", kilo)
    assert check_campaign(folder) == []
    campaign = read_campaign(folder)
    back = campaign.load(campaign.plans[3])
    np.testing.assert_allclose(back.rig["Fz"], sound_runs[3].rig["Fz"], rtol=1e-12)


def test_an_unknown_channel_in_an_unknown_unit_is_left_out_with_a_warning(write: Write) -> None:
    folder = write()

    def add(group: Group) -> Group:
        if group.channels[0].name == "strain_1":
            return group
        odd = Channel("humour", "grin", group.channels[0].samples)
        return replace(group, channels=(*group.channels, odd))

    rewrite(folder / "runs" / "003.mf4", add)
    says(
        the_one(check_campaign(folder), "warning"),
        "runs/003.mf4, channel humour: nobody knows its unit 'grin'",
    )
    campaign = read_campaign(folder)
    assert "humour" not in campaign.load(campaign.plans[3]).rig


CLOCK_FAULTS = {
    "rate": (lambda t: t * 2.0, "the samples come at 2500 Hz; campaign.toml declares 5000 Hz"),
    "slight rate": (lambda t: t * 1.01, "the samples come at 4950.5 Hz; campaign.toml declares"),
    "gap": (
        lambda t: t + 0.01 * (np.arange(t.size) > 700),
        "1 gap(s), the first of 10.2 ms after sample 700 (t = 0.1400 s), about 50 samples are lost",
    ),
    "backwards": (
        lambda t: np.where(np.arange(t.size) == 700, 0.0, t),
        "the time does not grow after sample 699 (0.1398 s, then 0 s), 1 time(s)",
    ),
    "jitter": (
        lambda t: t - 1.2e-4 * (np.arange(t.size) >= 700),
        "not uniform: a step of 0.08 ms after sample 699",
    ),
    "nan": (lambda t: np.where(np.arange(t.size) == 7, np.nan, t), "no finite time at sample 7"),
}


@pytest.mark.parametrize("fault", CLOCK_FAULTS)
def test_each_fault_of_the_clock_has_its_message(write: Write, fault: str) -> None:
    change, message = CLOCK_FAULTS[fault]
    folder = write()
    rewrite(folder / "runs" / "003.mf4", gage_clock(change))
    says(the_one(check_campaign(folder)), "runs/003.mf4, time of the gages", message)


# --- gages -----------------------------------------------------------------------------------


def put(gage: int, where: object, value: float) -> Callable[[FloatArray], None]:
    def apply(strain: FloatArray) -> None:
        strain[gage, where] = value  # type: ignore[index]

    return apply


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
    "stuck": (freeze, "strain_4, sample 200 (t = 0.0400 s): dropout: it stays at"),
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


def test_saturation_says_rail_value_and_length(write: Write, sound_runs: Runs) -> None:
    text = the_one(check_campaign(write(changed(sound_runs, 9, with_strain(clip)))))
    says(text, "saturated: flat maximum at", "samples on end", "equal samples on end are normal")


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
        "channel Fz: wrong sign: -2999 N in the middle, axes = 'adapted_sae'; Fz of a loaded",
    ),
    "negative Fy": (with_rig(Fy=minus), "channel Fy: wrong sign: Fy against slip angle is not as"),
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
    says(str(problems[1]), "channel omega: omega times the free radius is 66.33 km/h, speed and")


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
