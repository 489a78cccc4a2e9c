"""Faults of header, plan, files, channels and clocks: one at a time, exactly its message."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.unit.campaign.campaign_faults import channel, says, the_one
from tests.unit.campaign.campaign_synthetic import Write, changed, rewrite
from tirelib.campaign import FloatArray, Run, check_campaign, read_campaign
from tirelib.campaign.mdf import Channel, Group, read_mdf, write_mdf
from tirelib.core.errors import FormatError

Runs = tuple[Run, ...]


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
    "gage beside the belt": ("belt_width_m = 0.165", "belt_width_m = 0.08", "lie outside the belt"),
    "one place twice": ("0.03,", "0.06,", "holds a position twice"),
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


@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_plan_with_another_separator_is_one_fault(write: Write, mark: str) -> None:
    folder = write()
    plan = folder / "runs.csv"
    plan.write_text(plan.read_text().replace(",", mark))
    problem = the_one(check_campaign(folder))
    says(problem, "runs.csv, line 1: the columns are separated by")
    says(problem, "export it again as comma-separated text")


def test_straight_runs_alone_do_not_tell_that_the_gages_are_in_order(
    write: Write, sound_runs: Runs
) -> None:
    straight = [
        replace(
            run,
            plan=replace(run.plan, slip_angle=0.0, camber=0.0),
            rig={
                name: value for name, value in run.rig.items() if name not in ("Fy", "slip_angle")
            },
        )
        for run in sound_runs
    ]
    texts = [str(problem) for problem in check_campaign(write(runs=straight))]
    assert any("the order of the gages was not checked" in text for text in texts)


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


@pytest.mark.parametrize("share", [0.0005, 0.003, 0.05, 0.5, 0.9, 0.96, 0.98, 0.99, 0.999])
def test_a_truncated_file_is_told_from_a_sound_one_wherever_it_ends(
    write: Write, share: float
) -> None:
    folder = write()
    file = folder / "runs" / "005.mf4"
    content = file.read_bytes()
    file.write_bytes(content[: int(len(content) * share)])
    says(the_one(check_campaign(folder)), "runs/005.mf4: truncated or damaged MDF 4 file of")


def test_runs_without_strain_in_a_campaign_with_gages_are_a_warning(
    write: Write, sound_runs: Runs
) -> None:
    def forces_only(run: Run) -> Run:
        return replace(run, strain=None, trigger=None)

    problems = check_campaign(write(changed(sound_runs, 3, forces_only)))
    says(the_one(problems, "warning"), "[gages] declares 5 gages, but 1 of 12 runs have no strain")


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


def without(which: str) -> Callable[[Group], Group]:
    """Return a change of a group that drops one channel."""

    def apply(group: Group) -> Group:
        return replace(group, channels=tuple(c for c in group.channels if c.name != which))

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
        without("strain_5"),
        "4 strain channels (strain_1, strain_2, strain_3, strain_4); [gages] lateral_m declares 5",
    ),
    "a name twice": (channel("Fx", name="Fy"), "channel Fy: the channel occurs twice"),
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
        "runs/003.mf4, channel humour: its unit 'grin'",
    )
    campaign = read_campaign(folder)
    assert "humour" not in campaign.load(campaign.plans[3]).rig


def test_a_rig_quantity_at_gage_rate_is_left_out_with_a_warning(write: Write) -> None:
    folder = write()

    def add(group: Group) -> Group:
        first = group.channels[0]
        odd = (Channel("Fx", "N", first.samples),) if first.name == "strain_1" else ()
        return replace(group, channels=(*group.channels, *odd))

    rewrite(folder / "runs" / "003.mf4", add)
    says(
        the_one(check_campaign(folder), "warning"),
        "003.mf4, channel Fx: it is recorded at the rate",
    )


def test_one_group_for_all_at_gage_rate_is_read(write: Write, sound_runs: Runs) -> None:
    folder = write()
    file = folder / "runs" / "003.mf4"
    gages, _ = read_mdf(file)
    load = Channel("Fz", "kN", np.full(len(gages.channels[0].samples), 3.0))
    write_mdf(file, [replace(gages, channels=(load, *gages.channels))])
    campaign = read_campaign(folder)
    run = campaign.load(campaign.plans[3])
    assert run.mean("Fz") == pytest.approx(3000.0)
    assert run.rig_time is not None
    np.testing.assert_array_equal(run.rig_time, run.time())
    assert run.strain is not None
    assert run.strain.shape == (5, 1800)


def test_groups_are_found_by_their_channels_in_any_order(write: Write, sound_runs: Runs) -> None:
    folder = write()
    file = folder / "runs" / "003.mf4"
    gages, rig = read_mdf(file)
    backwards = replace(gages, channels=gages.channels[::-1])
    write_mdf(file, [rig, backwards])
    assert check_campaign(folder) == []
    run = next(r for r in read_campaign(folder).runs() if r.plan.run == 3)
    before = sound_runs[3].strain
    assert run.strain is not None
    assert before is not None
    np.testing.assert_allclose(run.strain, before, rtol=1e-12)


def test_samples_that_the_logger_marked_invalid_become_nan(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    times = np.arange(4) / 10.0
    bits = np.array([False, True, False, False])
    with MDF(version="4.10") as mdf:
        mdf.append([Signal(np.arange(4.0), times, unit="N", name="Fz", invalidation_bits=bits)])
        mdf.save(tmp_path / "a.mf4")
    (group,) = read_mdf(tmp_path / "a.mf4")
    np.testing.assert_array_equal(group.channels[0].samples, [0.0, np.nan, 2.0, 3.0])


def test_damage_inside_the_file_never_takes_the_reader_down(write: Write, tmp_path: Path) -> None:
    content = (write() / "runs" / "003.mf4").read_bytes()
    random = np.random.default_rng(0)
    damaged = tmp_path / "damaged.mf4"
    refused = 0
    for _ in range(150):
        copy = bytearray(content)
        for place in random.integers(1, 4500, 5):  # the blocks stand behind the samples
            copy[-int(place)] = int(random.integers(256))
        damaged.write_bytes(copy)
        try:
            read_mdf(damaged)
        except FormatError:
            refused += 1
    assert refused > 50  # many others only change a name or a comment


CLOCK_FAULTS = {
    "rate": (lambda t: t * 2.0, "the samples come at 2500 Hz; campaign.toml declares 5000 Hz"),
    "slight rate": (lambda t: t * 1.01, "the samples come at 4950.5 Hz; campaign.toml declares"),
    "gap": (
        lambda t: t + 0.01 * (np.arange(t.size) > 700),
        "1 gap(s), the first of 10.2 ms after sample 700 (t = 0.1400 s), about 50 samples are lost",
    ),
    "backwards": (
        lambda t: np.where(np.arange(t.size) == 700, 0.0, t),
        "the time does not increase after sample 699 (0.1398 s, then 0 s), 1 time(s)",
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
