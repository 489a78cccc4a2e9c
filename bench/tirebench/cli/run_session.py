"""What happens while ``tirebench run`` runs, and what it prints at the end."""

import time
from contextlib import ExitStack

import numpy as np
from rich.console import Console

from tirebench.cli.bridges import Bridges
from tirebench.cli.live import Screen, counters
from tirebench.cli.page import Shown
from tirebench.estimator.dead_gages import DeadGages
from tirebench.estimator.estimation import News
from tirebench.estimator.session import Outcome, Session, Source
from tirebench.page.recording_switch import RecordingSwitch
from tirebench.recording.header import parts_of
from tirebench.recording.journal import Journal
from tirebench.recording.link import ReplayLink

SPOILED = 3
"""Flags that are named at the end of a run, the most frequent first."""


def run_session(
    session: Session,
    source: Source,
    screen: Screen | None,
    dead: DeadGages,
    bridges: Bridges,
    shown: Shown,
    journal: Journal | None,
    switch: RecordingSwitch | None,
) -> tuple[Outcome, float]:
    """Run until something ends it; return the outcome and the share of a core that it used."""
    with ExitStack() as stack:
        if screen is not None:
            stack.enter_context(screen)
        said = ""

        def watch(news: News) -> None:
            nonlocal said
            news.alarms += dead.take(news.levels)
            if journal is not None:
                journal.add(news.turns)
                if journal.error != said:
                    said = journal.error
                    text = said or "the file is writable again and holds every turn"
                    news.alarms.append(text)
                    if switch is not None:
                        switch.alarm("json", text, on=bool(said))
            if screen is not None:
                screen.watch(news)
            bridges.send(news.turns)
            shown.watch(news, said)

        session.watch = watch
        start = time.monotonic(), _cpu_time(source, shown)
        outcome = session.run()
        spent = _cpu_time(source, shown) - start[1]
        used = spent / max(time.monotonic() - start[0], 1e-9)
        shown.end(outcome.reason)
    return outcome, used


def _cpu_time(source: Source, shown: Shown) -> float:
    """Return what all processes of the run have used, [s]."""
    return time.process_time() + source.cpu_time() + shown.cpu_time()


def print_summary(
    console: Console,
    outcome: Outcome,
    source: Source,
    dead: DeadGages,
    used: float,
    link: ReplayLink | None,
    switch: RecordingSwitch | None,
) -> None:
    """Print how the run ended, and its result."""
    if outcome.message:
        console.print(f"unplugged: {outcome.message}", soft_wrap=True, markup=False)
    console.print(
        f"ended: {outcome.reason}; {outcome.count} turns, {outcome.valid} complete, Fz valid in "
        f"{outcome.with_load} of {outcome.count} (ISO 8855 axes); "
        f"{counters(source.wheels, live=source.live)}",
        soft_wrap=True,
    )
    if outcome.spoiled:
        why = ", ".join(f"{name} {count}" for name, count in outcome.spoiled.most_common(SPOILED))
        console.print(f"turns without Fz, by flag: {why} (Flags, in the reference, has remedies)")
    for text in dead.said:
        console.print(text, soft_wrap=True, markup=False)
    if link is not None and link.recording.complete is False:
        console.print(
            f"note: the recording is incomplete ({link.recording.damage})", soft_wrap=True
        )
    counts = source.counts()
    for name, number in counts.get("restarts", {}).items():
        if number:
            console.print(f"note: the {name} stopped unexpectedly and was restarted {number} times")
    for wheel, mine in counts.get("wheels", {}).items():
        if mine["skipped_samples"]:
            console.print(f"note: wheel {wheel}: {mine['skipped_turns']} turns were skipped")
    if counts and counts["raw"]["lost_bytes"]:
        console.print(f"note: {counts['raw']['lost_bytes']} raw bytes were not recorded")
    if source.live and outcome.latency:
        middle, high = np.percentile(np.array(outcome.latency) * 1e3, (50, 99))
        console.print(
            f"delay from the last byte to the estimate: median {middle:.1f} ms, 99 % {high:.1f} "
            f"ms; {100 * used:.0f} % of a core"
        )
    triggered = counts.get("recording", {}).get("recordings", 0)
    if triggered > 1:
        console.print(f"{triggered} recordings, numbered from the first")
    for file in () if switch is None else switch.files:
        for part in parts_of(file):
            console.print(f"recorded: {part}", soft_wrap=True)
