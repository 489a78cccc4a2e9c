"""The journey over the server: what follows what, cancel, history, and what a restart keeps."""

import json
import os
import signal
import sys
from pathlib import Path

import pytest

from tests.unit.studio.conftest import RUNNER, Served, until
from tirelib.core.version import __version__
from tirelib.studio.desk import Desk
from tirelib.studio.jobs import AT_ONCE, Jobs, Progress
from tirelib.studio.session import Session
from tirelib.studio.starter import Starter
from tirelib.studio.state import _error


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z"
    except OSError:
        return False


def verbs(served: Served) -> list[str]:
    return [each["argv"][0] for each in served.said()]


def test_opening_a_campaign_leads_to_a_verdict_and_the_page_gets_what_the_commands_wrote(
    served: Served, opened: str
) -> None:
    told = served.campaign(opened)
    model = told["models"][0]
    assert (told["current"], told["quantity"]) == ("001", "strain")
    assert told["quantities"] == ["strain", "Fy"]
    assert (model["error"], model["verdict"], model["named"]) == (15.25, "named", ["sidewall_load"])
    assert [said for _, said in model["lines"]] == ["A.", "B.", "C.", "D."]
    asked = f"campaign={opened}&model=001&quantity=strain"
    assert served.get(f"/document?{asked}&name=comparison")["error"] == 15.25
    traced = next(each["argv"] for each in served.said() if "--trace" in each["argv"])
    assert "sidewall_load=0.3" in traced
    assert "nonuniformity=1.0,2.0" in traced
    body = served.ask(f"/arrays?{asked}&name=plots", **served.good)[2]
    assert b'"angle": {"shape": [3], "at": 0}' in body
    assert body.endswith(bytes([0, 0, 0, 0, 0, 0, 128, 63, 0, 0, 0, 64]))  # 0, 1, 2 as floats
    served.do(do="look", campaign=opened, model="001")
    assert verbs(served).count("diagnose") == 1  # nothing is computed twice


def test_a_fitted_ring_is_compared_before_its_intervals_are_known(served: Served) -> None:
    served.hold.write_text("first")  # the fit goes on after its ring was told
    name = served.do(do="open", path=str(served.measured))[1]["campaign"]
    until(lambda: "strain/plots.npz" in str(served.campaign(name)["models"]))
    told = served.campaign(name)
    model = told["models"][0]
    assert (told["current"], told["quantity"]) == ("001", "strain")
    assert (model["ready"], model["error"]) == (False, 15.25)
    served.hold.unlink()
    until(lambda: served.campaign(name)["models"][0]["verdict"])
    assert verbs(served).count("compare") == 1
    whole = next(each["argv"] for each in served.said() if each["argv"][0] == "diagnose")
    assert whole[whole.index("--model") + 1].endswith("M.toml")


def test_a_base_fit_that_ends_before_the_check_waits_for_it(served: Served) -> None:
    served.hold.write_text("check")  # the check goes on after the fit has ended
    name = served.do(do="open", path=str(served.measured))[1]["campaign"]

    def fitted() -> bool:
        return "done" in [
            j["state"] for j in served.campaign(name)["jobs"] if j["kind"] == "identify"
        ]

    until(fitted)
    assert served.campaign(name)["models"][0]["ready"] is False
    served.hold.unlink()
    until(lambda: served.campaign(name)["models"][0]["verdict"])
    assert verbs(served).count("identify") == 1


def test_a_campaign_with_errors_keeps_no_fit_until_it_is_mended(served: Served) -> None:
    header = served.measured / "campaign.toml"
    header.write_text("bad = 1\n")
    served.hold.touch()  # the fit goes on while the check finds the error
    name = served.do(do="open", path=str(served.measured))[1]["campaign"]
    until(lambda: (served.campaign(name)["check"] or {}).get("errors"))

    def fits() -> list[str]:
        return [j["state"] for j in served.campaign(name)["jobs"] if j["kind"] == "identify"]

    until(lambda: fits() == ["cancelled"])
    assert served.campaign(name)["models"][0]["ready"] is False
    header.write_text("x = 1\n")
    served.hold.unlink()
    served.do(do="open", campaign=name)
    until(lambda: served.campaign(name)["models"][0]["verdict"])
    assert len(served.campaign(name)["models"]) == 1


def test_a_campaign_has_its_own_name_at_once_and_the_list_tells_that_it_is_worked_on(
    served: Served,
) -> None:
    (served.measured / "campaign.toml").write_text('name = "winter tire"\n')
    served.hold.write_text("")
    served.do(do="open", path=str(served.measured))
    told = until(lambda: served.get("/home")["campaigns"])[0]
    assert told["title"] == "winter tire"
    assert "fit the base model" in told["busy"]
    served.hold.unlink()
    until(lambda: not served.get("/home")["campaigns"][0]["busy"])


def test_a_fault_of_the_program_itself_is_told_without_its_traceback(tmp_path: Path) -> None:
    jobs = Jobs(tmp_path, RUNNER)
    job = jobs.add("check", {"campaign": "c"}, {})
    said = "Traceback (most recent call last):\n  File x, line 1\nValueError: no such run\n"
    (jobs.place(job) / "stderr.txt").write_text(said)
    jobs._finish(job, 1)
    assert job.message.startswith("tirelib has a fault of its own here (ValueError: no such run).")
    assert "Traceback" not in job.message
    assert str(jobs.place(job) / "stderr.txt") in job.message


def test_each_quantity_has_its_own_error_of_a_model() -> None:
    others = {"Fy": {"error_before": 4.7, "error_after": 71.6, "error_unit": "noise"}}
    added = {"error_after": 8.6, "error_unit": "Nm", "others": others}
    assert _error({}, added, "Mz", "Mz") == {"error": 8.6, "error_unit": "Nm"}
    assert _error({}, added, "Mz", "Fy") == {"error": 71.6, "error_unit": "noise"}
    assert _error({}, added, "Mz", "Fx") == {"error": None, "error_unit": None}
    compared = {"error": 71.5, "error_unit": "noise"}
    assert _error(compared, added, "Mz", "Fy") == compared
    base = {"error": 15.2, "force_errors": {"Fy": {"error": 3.0, "error_unit": "noise"}}}
    assert _error({}, base, "", "Fy") == {"error": 3.0, "error_unit": "noise"}


def test_the_commands_of_an_imported_campaign_begin_with_its_import(served: Served) -> None:
    files = served.upload("few.csv", b"a\n1\n")[1]["files"]
    served.do(do="dropped", files=files)
    served.do(do="import", files=files, map={"name": "good"})
    until(lambda: served.get("/home")["campaigns"])
    name = served.get("/home")["campaigns"][0]["campaign"]
    until(lambda: served.campaign(name)["models"][0]["ready"])
    lines = served.get(f"/taken?campaign={name}&model=001&what=commands")["commands"]
    source = next((served.folder / "session" / "files").rglob("few.csv"))
    out = served.campaign(name)["title"]
    assert lines[0] == f"tirelib import {source} --map {source.parent / 'map.toml'} --out {out}"
    assert lines[1:3] == [
        f"tirelib campaign check {out}",
        f"tirelib identify {out} --out M.toml --json M.json",
    ]


def test_two_ticked_effects_are_added_one_after_the_other_and_undo_goes_back(
    served: Served, opened: str
) -> None:
    status, told = served.do(do="add", campaign=opened, model="001", effects=["sidewall_load"])
    assert (status, told["models"]) == (200, ["002"])
    until(lambda: served.campaign(opened)["current"] == "002")
    model = served.campaign(opened)["models"][1]
    assert (model["parent"], model["fit"]["error_after"]) == ("001", 5.5)
    served.do(do="look", campaign=opened, model="001")
    assert served.campaign(opened)["current"] == "001"
    served.do(do="mark", campaign=opened, model="002", label="mine", pinned=True, hidden=True)
    model = served.campaign(opened)["models"][1]
    assert (model["label"], model["pinned"], model["hidden"]) == ("mine", True, True)
    lines = served.get(f"/taken?campaign={opened}&model=002&what=commands")["commands"]
    assert lines[1] == f"tirelib identify {served.measured} --out M.toml --json M.json"
    assert lines[2].startswith("tirelib add sidewall_load --model M.toml --data ")
    assert lines[2].endswith("--quantity strain --out M2.toml --json M2.json")
    names = ["nonuniformity", "sidewall_load"]
    served.do(do="add", campaign=opened, model="001", effects=names)
    until(lambda: served.campaign(opened)["current"] == "004")
    second, third, fourth = served.campaign(opened)["models"][1:]
    names_by_hand = [(m["saved_as"], m["next_as"]) for m in (second, third, fourth)]
    assert names_by_hand == [("M2.toml", "M3.toml")] * 2 + [("M3.toml", "M4.toml")]
    assert (third["parent"], third["action"], third["effect"]) == ("001", "add", names[0])
    assert (fourth["parent"], fourth["action"], fourth["effect"]) == ("003", "add", names[1])
    until(lambda: served.campaign(opened)["models"][3]["verdict"])
    assert served.campaign(opened)["models"][2]["verdict"] is None  # of the last one alone


def test_a_refit_does_not_wait_for_what_follows_by_itself(tmp_path: Path) -> None:
    os.environ["HOLD"], os.environ["SAID"] = str(tmp_path / "hold"), str(tmp_path / "said")
    (tmp_path / "hold").touch()
    jobs = Jobs(tmp_path / "jobs", RUNNER)
    order = {"campaign": "c", "model": "m", "effect": "e", "quantity": "Fy"}
    for kind in (*["diagnose"] * 5, "add"):
        jobs.add(kind, order, {})
    jobs.look()
    states = [job.state for job in jobs.all.values()]
    jobs.close()
    assert states == [*["running"] * AT_ONCE, *["waiting"] * (5 - AT_ONCE), "running"]


def test_a_refit_is_cancelled_at_once_and_can_be_run_again(served: Served, opened: str) -> None:
    served.hold.touch()
    changed = served.studio.changed
    served.do(do="add", campaign=opened, model="001", effects=["sidewall_load"])
    # once for the new job, and once when it has begun
    until(lambda: served.studio.changed == changed + 2)
    pid = until(lambda: [each["pid"] for each in served.said() if each["argv"][0] == "add"])[0]
    job = next(j for j in served.campaign(opened)["jobs"] if j["kind"] == "add")
    until(lambda: served.desk.jobs.progress[job["job"]].costs)
    served.do(do="cancel", job=job["job"])
    assert not alive(pid)
    told = served.campaign(opened)
    assert next(j for j in told["jobs"] if j["kind"] == "add")["state"] == "cancelled"
    assert (told["current"], told["models"][1]["ready"]) == ("001", False)
    served.hold.unlink()
    served.do(do="again", job=job["job"])
    until(lambda: served.campaign(opened)["current"] == "002")


def test_a_command_that_fails_says_why(served: Served, opened: str) -> None:
    served.desk.jobs.add(
        "add",
        {"campaign": "c", "model": "m", "effect": "sidewall_pressure"},
        {"campaign": opened, "model": "001", "quantity": "strain"},
    )
    failed = until(lambda: [j for j in served.campaign(opened)["jobs"] if j["state"] == "failed"])
    assert failed[0]["message"] == "it does not fit; choose another"
    status, told = served.do(do="add", campaign=opened, model="001", effects=["nonsense"])
    assert status == 400
    assert "nonsense" in told["error"]


def test_a_restart_shows_the_same_and_what_ran_is_interrupted(served: Served, opened: str) -> None:
    served.hold.touch()
    served.do(do="add", campaign=opened, model="001", effects=["sidewall_load"])
    pid = until(lambda: [each["pid"] for each in served.said() if each["argv"][0] == "add"])[0]
    before = served.campaign(opened)["models"][0]
    folder = served.folder / "session"
    again = Desk(Session(folder), Jobs(folder / "jobs", RUNNER), [])  # as after kill -9
    assert [job.state for job in again.jobs.all.values()][-1] == "interrupted"
    kept = next(iter(again.session)).models[0]
    assert kept.told["number"] == before["number"]
    assert kept.ready
    served.close()
    until(lambda: not alive(pid))


def test_a_diagnosis_that_was_never_recorded_is_made_after_a_restart(
    served: Served, opened: str
) -> None:
    until(lambda: served.campaign(opened)["models"][0]["verdict"])
    folder = served.folder / "session"
    served.close()
    for record in (folder / "jobs").glob("*/job.json"):
        if json.loads(record.read_text())["kind"] == "diagnose":
            record.unlink()
    for document in folder.rglob("diagnosis.json"):
        document.unlink()
    jobs = Jobs(folder / "jobs", RUNNER)
    Desk(Session(folder), jobs, [])
    assert [job.kind for job in jobs.all.values() if not job.over] == ["diagnose"]


def test_what_nobody_has_asked_for_goes_on_after_a_restart(tmp_path: Path) -> None:
    session, folder = Session(tmp_path / "session"), tmp_path / "session" / "jobs"
    (tmp_path / "session" / "effects.json").write_text("{}")
    killed = Jobs(folder, RUNNER)
    subject = {"campaign": "tire-00000000", "model": "001", "quantity": "Fy"}
    order = {"campaign": "c", "model": "m", "effect": "e"}
    for kind in ("compare", "diagnose", "diagnose", "add"):
        killed.add(kind, order, subject)
    killed.cancel(killed.all[3])  # the user has ended the second diagnosis
    for _ in range(2):  # two restarts in a row do not add it twice
        jobs = Jobs(folder, RUNNER)
        Desk(session, jobs, [])
    assert [(j.kind, j.state) for j in jobs.all.values() if j.number > 4] == [
        ("compare", "interrupted"),
        ("compare", "waiting"),
    ]


def test_the_fall_of_a_fit_is_read_from_its_steps(tmp_path: Path) -> None:
    labels = ["run 7", "step 1, cost 45123", "testing it", "step 2, cost 1e3", "step 1, cost 7"]
    lines = [
        json.dumps({"progress": "fitting", "done": k, "total": None, "label": label})
        for k, label in enumerate(labels)
    ]
    said, progress = tmp_path / "stderr.txt", Progress()
    said.write_text("\n".join(lines[:3]) + "\n")
    assert progress.read(said)
    assert (progress.label, progress.costs) == ("testing it", [45123.0])
    for count, costs in ((4, [45123.0, 1000.0]), (5, [7.0])):  # the last begins another fit
        said.write_text("\n".join(lines[:count]) + "\n")
        assert progress.read(said)
        assert progress.costs == costs


def add_that_goes_on(folder: Path) -> tuple[Jobs, int]:
    os.environ["HOLD"], os.environ["SAID"] = str(folder / "hold"), str(folder / "said")
    (folder / "hold").touch()
    jobs = Jobs(folder / "jobs", RUNNER)
    jobs.add("add", {"campaign": "c", "model": "m", "effect": "e"}, {})
    jobs.look()
    until(lambda: (folder / "said").exists() and (folder / "said").read_text().endswith("\n"))
    return jobs, int(json.loads((folder / "said").read_text())["pid"])


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="it reads /proc")
def test_a_job_has_a_group_of_its_own_in_the_session_of_those_that_it_gives_way_to(
    tmp_path: Path,
) -> None:
    jobs, pid = add_that_goes_on(tmp_path)
    starter = os.getpgid(int(Path(f"/proc/{pid}/stat").read_text().split()[3]))
    assert (os.getpgid(pid), os.getsid(pid)) == (pid, os.getsid(starter))
    jobs.close()


def test_a_job_ends_when_its_server_is_gone(tmp_path: Path) -> None:
    jobs, pid = add_that_goes_on(tmp_path)
    assert alive(pid)
    jobs.close()  # closes the pipe, as the system does with that of a server that was killed
    until(lambda: not alive(pid))


def test_jobs_go_on_after_the_process_that_starts_them_was_killed(tmp_path: Path) -> None:
    jobs, pid = add_that_goes_on(tmp_path)
    os.kill(int(Path(f"/proc/{pid}/stat").read_text().split()[3]), signal.SIGKILL)
    until(lambda: not alive(pid))
    until(lambda: jobs.look()[0])
    assert jobs.all[1].state == "failed"
    (tmp_path / "hold").unlink()
    jobs.add("check", {"campaign": "c"}, {})
    until(lambda: jobs.look()[0])
    assert jobs.all[2].message == ""
    jobs.close()


@pytest.mark.parametrize("copies", [True, False])
def test_a_job_is_the_program_itself(tmp_path: Path, copies: bool) -> None:
    main = f"from tirelib.studio import runner; runner.COPIES = {copies}; runner.main(loaded=())"
    starter = Starter((sys.executable, "-c", main))
    files = {name: str(tmp_path / name) for name in ("stdout", "stderr")}
    starter.start(7, {"argv": ["--version"], **files})
    assert until(starter.ended) == {7: 0}
    assert __version__ in (tmp_path / "stdout").read_text()
    starter.start(8, {"argv": ["nonsense"], **files})
    assert until(starter.ended) == {8: 2}
    assert "nonsense" in (tmp_path / "stderr").read_text()
    starter.close()


MANY = """
import sys
from tirelib.studio import runner
runner.main(lambda words: sys.exit(int(words[0])), loaded=())
"""


def test_jobs_that_end_at_the_same_time_are_all_told(tmp_path: Path) -> None:
    starter = Starter((sys.executable, "-c", MANY))
    files = {name: str(tmp_path / name) for name in ("stdout", "stderr")}
    for number in range(60):
        starter.start(number, {"argv": [str(number)], **files})
    codes: dict[int, int] = {}

    def all_told() -> bool:
        codes.update(starter.ended())
        return len(codes) == 60

    until(all_told)
    starter.close()
    assert codes == {number: number for number in range(60)}
