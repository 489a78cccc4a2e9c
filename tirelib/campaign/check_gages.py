"""Checks of each gage by itself: numbers, rails, life, sign, spikes."""

import math

import numpy as np
import numpy.typing as npt

from tirelib.campaign.finding import RunFinding, finding
from tirelib.campaign.model import BoolArray, CampaignHeader, FloatArray, Run
from tirelib.campaign.turns import turn_samples, turn_stack
from tirelib.core.units import from_si

PLAUSIBLE_STRAIN = (2e-4, 0.1)
"""Peak-to-peak strain of a turn that a rolling, loaded tire may have."""

DEAD = 0.05
"""A gage with less than this share of its neighbours' peak-to-peak strain is dead."""

SPIKE = 0.02
"""A sample that deviates by less than this share of the peak-to-peak strain is not a spike."""

_CONTACT = 45.0 / 360.0  # the dips before and behind the contact lie within this part of a turn


def gage_findings(run: Run, header: CampaignHeader, *, whole: bool) -> list[RunFinding]:
    """Return the faults of the gages of one run.

    Parameters
    ----------
    run : Run
        With strain.
    header : CampaignHeader
    whole : bool
        False when the clock has gaps; then only those checks are made that need no clock.
    """
    if run.strain is None:
        return []
    found: list[RunFinding] = []
    spread = _spread(run.strain)
    sound = np.zeros(len(run.strain), dtype=bool)
    for gage, samples in enumerate(run.strain):
        faults = _numbers(run, gage, samples, header) or _life(run, gage, samples, spread, header)
        faults = faults or _rails(run, gage, samples, header)
        found += faults
        sound[gage] = not faults
    if (
        sound.any()
        and not PLAUSIBLE_STRAIN[0] <= float(np.median(spread[sound])) <= PLAUSIBLE_STRAIN[1]
    ):
        return [*found, _implausible(run, float(np.median(spread[sound])), header)]
    if whole:
        found += _inverted(run, sound, header)
        found += _spikes(run, sound, spread, header)
    return found


def _spread(strain: FloatArray) -> FloatArray:
    """Return the peak-to-peak strain of each gage, NaN for one without finite samples."""
    finite = np.isfinite(strain)
    high = np.max(np.where(finite, strain, -np.inf), axis=1)
    low = np.min(np.where(finite, strain, np.inf), axis=1)
    return np.where(finite.any(axis=1), high - low, np.nan)


def _numbers(run: Run, gage: int, samples: FloatArray, header: CampaignHeader) -> list[RunFinding]:
    return not_finite(run.plan.file, f"strain_{gage + 1}", samples, run.time())


def not_finite(file: str, channel: str, samples: FloatArray, times: FloatArray) -> list[RunFinding]:
    """Return the finding for samples that are NaN or infinite; one for a whole channel."""
    bad = ~np.isfinite(samples)
    if not bad.any():
        return []
    first = int(np.argmax(bad))
    blocks = int(np.count_nonzero(np.diff(bad.astype(np.int8), prepend=0) == 1))
    kind = "NaN" if np.isnan(samples[first]) else "infinite"
    count = int(np.count_nonzero(bad))
    dropouts = f" in {blocks} dropouts" if blocks > 1 else ""
    return [
        finding(
            "not finite",
            file,
            channel,
            f"{count} of {samples.size} samples are not finite{dropouts}, the first is {kind}",
            "every sample must be a finite number",
            "repair the wiring or the export, or take the run out of runs.csv",
            at=f"sample {first} (t = {times[first]:.4f} s)",
        )
    ]


def _life(
    run: Run, gage: int, samples: FloatArray, spread: FloatArray, header: CampaignHeader
) -> list[RunFinding]:
    """Find a dead gage: constant, noise only, or far weaker than the others."""
    others = np.delete(spread, gage)
    usual = float(np.nanmedian(others)) if np.isfinite(others).any() else math.nan
    if spread[gage] == 0.0:
        given = f"dead: every sample is {_shown(samples[0], header)}"
    elif _neighbours_agree(samples) < 0.5:
        given = (
            f"dead: only noise of {_shown(float(np.std(samples)), header)} rms, no contact in it"
        )
    elif spread[gage] < DEAD * usual:
        given = (
            f"dead: it varies by {_shown(spread[gage], header)}, "
            f"the other gages by {_shown(usual, header)}"
        )
    else:
        return []
    return [
        finding(
            "dead",
            run.plan.file,
            f"strain_{gage + 1}",
            given,
            "every turn must show the contact",
            "check gage and cable; drop the gage or the run",
        )
    ]


def _neighbours_agree(samples: FloatArray) -> float:
    """Return the correlation of each sample with the next: near 1 for a signal, 0 for noise."""
    deviation = samples - np.mean(samples)
    return float(np.sum(deviation[1:] * deviation[:-1]) / np.sum(deviation**2))


def longest_by_chance(samples: FloatArray, rails: BoolArray) -> float:
    r"""Return the longest run of equal samples that quantised noise explains.

    With the share rho of equal neighbours off the rails, the longest of n is about :math:`\ln n /
    \ln(1 / \rho)`. Infinite when nearly all are equal, so that nothing can be concluded.
    """
    free = ~(rails[1:] | rails[:-1])
    equal = float(np.mean(samples[1:][free] == samples[:-1][free])) if free.any() else 0.0
    return math.inf if equal > 0.9 else math.log(samples.size) / math.log(1.0 / max(equal, 0.01))


def _rails(run: Run, gage: int, samples: FloatArray, header: CampaignHeader) -> list[RunFinding]:
    """Find flat tops, flat bottoms and values that stay.

    A real extreme is curved and carries noise, so it holds one quantised value for a few samples
    only; a rail holds it for as long as the strain lies beyond, turn after turn. Away from the
    extremes a channel that keeps one value has lost its signal.
    """
    rails = (samples == samples.max()) | (samples == samples.min())
    chance = longest_by_chance(samples, rails)
    begins = np.concatenate(([0], np.flatnonzero(np.diff(samples) != 0.0) + 1))
    lengths = np.diff(np.concatenate((begins, [samples.size])))
    at_rail = rails[begins]
    once, again = max(8.0, 2.0 * chance), max(5.0, 1.2 * chance)
    flat = np.flatnonzero(at_rail & (lengths > again))
    if flat.size < 2:
        flat = np.flatnonzero(at_rail & (lengths > once))
    stays = max(20.0, 5.0 * chance)
    stuck = np.flatnonzero(~at_rail & (lengths > stays))
    found: list[RunFinding] = []
    if flat.size:
        longest = int(flat[np.argmax(lengths[flat])])
        top = "maximum" if samples[begins[longest]] == samples.max() else "minimum"
        found.append(
            _held(
                run,
                gage,
                int(begins[longest]),
                header,
                "saturated",
                f"saturated: flat {top}",
                f"{lengths[longest]} consecutive samples, {flat.size} time(s)",
                again,
                "widen the amplifier's range and record again",
            )
        )
    if stuck.size and _is_lively(samples, int(lengths[stuck].max())):
        longest = int(stuck[np.argmax(lengths[stuck])])
        found.append(
            _held(
                run,
                gage,
                int(begins[longest]),
                header,
                "stuck",
                "dropout: the signal stays",
                f"{lengths[longest]} consecutive samples, {stuck.size} time(s)",
                stays,
                "check cable and transmitter, or drop the run",
            )
        )
    return found


def _is_lively(samples: FloatArray, length: int) -> bool:
    """Return whether a channel, where it moves, moves by 3 steps of its converter or more.

    Looked at in windows of `length` samples. In one that does not, a calm stretch of the turn may
    well hold one value.
    """
    window = min(length, max(20, samples.size // 20))
    count = samples.size // window
    ranges = np.ptp(samples[: count * window].reshape(count, window), axis=1)
    steps = np.abs(np.diff(samples))
    moving = ranges > 0.0
    if not moving.any():
        return False
    return bool(np.quantile(ranges[moving], 0.2) >= 2.5 * steps[steps > 0.0].min())


def _held(
    run: Run,
    gage: int,
    begin: int,
    header: CampaignHeader,
    key: str,
    what: str,
    how_long: str,
    normal: float,
    remedy: str,
) -> RunFinding:
    """Return the finding for a value that is held too long."""
    value = 0.0 if run.strain is None else float(run.strain[gage, begin])
    return finding(
        key,
        run.plan.file,
        f"strain_{gage + 1}",
        f"{what} at {_shown(value, header)} for {how_long}",
        f"at most {normal:.0f} equal consecutive samples are normal",
        remedy,
        at=f"sample {begin} (t = {run.time()[begin]:.4f} s)",
    )


def _implausible(run: Run, spread: float, header: CampaignHeader) -> RunFinding:
    low, high = PLAUSIBLE_STRAIN
    factor = next((f for f in (1e3, 1e6, 1e-3, 1e-6) if low <= spread * f <= high), None)
    guess = (
        f"a factor of {factor:g} is suspected: check [gages] unit" if factor else "check the gain"
    )
    return finding(
        "strain unit",
        run.plan.file,
        "strain_1 and others",
        f"the strain of a turn varies by {spread * 1e6:.3g} microstrain",
        f"{low * 1e6:g} .. {high * 1e6:g} microstrain are plausible under load",
        guess,
    )


def contact_sign(turn: FloatArray) -> FloatArray:
    """Return, for each gage, how much more the turn looks upright than inverted.

    At the contact the innerliner is in tension between two compressive dips. Upright, the largest
    strain has a dip on both sides; inverted, the smallest has a hump on both sides.

    Parameters
    ----------
    turn : array, shape (n_gages, n_samples)
        One whole turn.

    Returns
    -------
    sign : array, shape (n_gages,)
        Depth of the lesser dip minus height of the lesser hump; negative when inverted.
    """
    level = turn - np.median(turn, axis=1, keepdims=True)
    return _flanks(level) - _flanks(-level)


def _flanks(level: FloatArray) -> FloatArray:
    """Return the depth of the lesser of the two dips beside the maximum of each row."""
    reach = max(2, round(_CONTACT * level.shape[1]))
    top = np.argmax(level, axis=1)[:, None]
    around = np.arange(1, reach + 1)
    before = np.take_along_axis(level, (top - around) % level.shape[1], axis=1)
    behind = np.take_along_axis(level, (top + around) % level.shape[1], axis=1)
    lesser: FloatArray = np.minimum(-before.min(axis=1), -behind.min(axis=1))
    return lesser


def _inverted(run: Run, sound: BoolArray, header: CampaignHeader) -> list[RunFinding]:
    samples = turn_samples(run, header)
    stack = None if run.strain is None or samples is None else turn_stack(run.strain, samples)
    if stack is None:
        return []
    signs = np.median([contact_sign(stack[:, turn]) for turn in range(stack.shape[1])], axis=0)
    noise = 0.02 * np.ptp(stack, axis=(1, 2))
    wrong = np.flatnonzero(sound & (signs < -noise))
    channels = [f"strain_{gage + 1}" for gage in wrong]
    if wrong.size > 1 and wrong.size == np.count_nonzero(sound):
        channels = [f"{channels[0]} to {channels[-1]}"]
    return [
        finding(
            "inverted",
            run.plan.file,
            channel,
            "inverted: the contact peak is compressive",
            "tension is positive, so the peak points up",
            "swap the gage's wires or correct the sign of its gain",
        )
        for channel in channels
    ]


def _spikes(
    run: Run, sound: BoolArray, spread: FloatArray, header: CampaignHeader
) -> list[RunFinding]:
    samples = turn_samples(run, header)
    if run.strain is None or samples is None or samples < 150:
        return []  # the contact itself is only a few samples long, like a spike
    found: list[RunFinding] = []
    scale = float(np.median(spread[sound])) if sound.any() else math.nan
    window = 3 if samples < 600 else 7
    for gage in np.flatnonzero(sound):
        spikes = spike_samples(run.strain[gage], scale, window)
        if spikes.size:
            first = int(spikes[0])
            height = run.strain[gage, first] - np.median(
                run.strain[gage, max(first - 3, 0) : first + 4]
            )
            found.append(
                finding(
                    "spike",
                    run.plan.file,
                    f"strain_{gage + 1}",
                    f"{spikes.size} sample(s) in spikes, the first of {_shown(height, header)}",
                    "the strain of a belt cannot jump and come back within 3 samples",
                    "check slip ring or radio link, or cut the run there",
                    at=f"sample {first} (t = {run.time()[first]:.4f} s)",
                )
            )
    return found


def spike_samples(samples: FloatArray, scale: float, window: int) -> npt.NDArray[np.intp]:
    """Return the indices of samples that leave their neighbours and come back.

    Out of line with the median of `window` neighbours by more than `SPIKE` of the scale, by more
    than 12 sigma of the noise and by more than 4 times the usual step around: that last one
    excuses the steep flanks of the contact.
    """
    from scipy.ndimage import median_filter  # slow to import, and only the check needs it

    excess = np.abs(samples - median_filter(samples, size=window, mode="nearest"))
    noise = 1.4826 * float(np.median(np.abs(np.diff(samples)))) / math.sqrt(2.0)
    candidates: npt.NDArray[np.intp] = np.flatnonzero(excess > max(SPIKE * scale, 12.0 * noise))
    if not candidates.size:
        return candidates
    steps = np.abs(np.diff(samples, append=samples[-1]))
    around = np.clip(candidates[:, None] + np.arange(-10, 11), 0, samples.size - 1)
    usual = np.quantile(steps[around], 0.7, axis=1)
    return np.compress(excess[candidates] > 4.0 * usual, candidates)


def _shown(strain: float, header: CampaignHeader) -> str:
    """Return a strain in the unit of the files."""
    return f"{from_si(float(strain), header.strain_unit, 'strain'):.6g} {header.strain_unit}"
