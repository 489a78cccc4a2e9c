"""The order in which jobs start, and how much they give way, without any process."""

from pathlib import Path
from typing import Any

import pytest

from tirelib.studio.jobs import AT_ONCE, NICE, Jobs

ABOUT = {"campaign": "c", "model": "m", "effect": "e"}


class Endless:
    """Stands for the process that starts jobs: none of them ends."""

    def __init__(self) -> None:
        self.running: dict[int, int] = {}
        self.nice: dict[int, int] = {}

    def ended(self) -> dict[int, int]:
        return {}

    def start(self, number: int, words: dict[str, Any]) -> None:
        self.running[number], self.nice[number] = 1, words["nice"]


@pytest.mark.parametrize(
    "kind", ["check", "show", "identify", "compare", "add", "suggest", "effects"]
)
def test_what_the_user_waits_for_waits_for_no_diagnosis(kind: str, tmp_path: Path) -> None:
    jobs, starter = Jobs(tmp_path), Endless()
    jobs._starter = starter  # type: ignore[assignment]
    others = [jobs.add("diagnose", ABOUT, {"of": k}) for k in range(AT_ONCE + 1)]
    jobs.look()
    wanted = jobs.add(kind, ABOUT | {"files": []}, {})
    jobs.look()
    assert wanted.state == "running"
    assert [job.state for job in others] == ["running"] * AT_ONCE + ["waiting"]
    assert starter.nice == {job.number: NICE for job in others[:AT_ONCE]} | {wanted.number: 0}


def test_a_folder_without_a_record_is_taken_by_the_next_job(tmp_path: Path) -> None:
    (tmp_path / "0001" / "out").mkdir(parents=True)  # the server was killed before the record
    jobs = Jobs(tmp_path)
    try:
        job = jobs.add("catalogue", {}, {})
        assert jobs.place(job) == tmp_path / "0001"
        assert (tmp_path / "0001" / "job.json").exists()
    finally:
        jobs.close()
