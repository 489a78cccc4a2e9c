"""Who is let in, and what a page, a file or an archive with bad intent achieves: nothing."""

import io
import stat
import zipfile
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.unit.studio.conftest import TOKEN, Served
from tirelib.core.errors import FormatError
from tirelib.studio import intake
from tirelib.studio.server import STATIC
from tirelib.web.assets import CHARTS

ATTACKS: dict[str, tuple[int, dict[str, Any]]] = {
    "no token": (403, {"Cookie": ""}),
    "a guessed token": (403, {"Cookie": "tirelib-{port}=abcdef"}),
    "the token of another port": (403, {"Cookie": "tirelib-1={token}"}),
    "a name that was rebound": (400, {"Host": "evil.example:{port}"}),
    "a page of another site": (403, {"Origin": "http://evil.example"}),
    "a page without origin": (403, {"Origin": "null"}),
    "a frame of another site": (403, {"Sec_Fetch_Site": "cross-site"}),
}


def test_an_attack_is_refused_on_every_way_in(served: Served) -> None:
    for attack, (expected, changed) in ATTACKS.items():
        known = {"port": served.port, "token": TOKEN}
        headers = served.good | {k: v.format(**known) for k, v in changed.items()}
        for path in ("/", "/studio.js", "/home", "/browse", "/taken?what=model", "/nowhere"):
            assert served.ask(path, **headers)[0] == expected, (attack, path)
        for path in ("/do", "/upload?name=a.csv"):
            answer = served.ask(
                path, method="POST", body=b"{}", Content_Type="application/json", **headers
            )
            assert answer[0] == expected, (attack, path)
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        host, origin = named.pop("Host"), named.pop("Origin", None)
        with pytest.raises((InvalidStatus, OSError)):
            connect(
                f"ws://127.0.0.1:{served.port}/news" if "evil" not in host else f"ws://{host}/news",
                additional_headers=named,
                origin=origin,  # type: ignore[arg-type]
                proxy=None,
            )
    assert not (served.folder / "session" / "files").exists()


def test_the_files_of_the_page_are_served_and_load_nothing_from_elsewhere(served: Served) -> None:
    for path, name in (STATIC | CHARTS).items():
        status, headers, body = served.ask(path, **served.good)
        assert status == 200, path
        assert "default-src 'none'" in headers["content-security-policy"]
        if not name.startswith("uplot"):
            for bad in (b"https://", b"//cdn", b"@import", b"eval(", b"innerHTML"):
                assert bad not in body, name


def test_no_address_leads_out_of_the_session(served: Served, opened: str) -> None:
    for path in (
        "/../server.py",
        "/%2e%2e/server.py",
        "/campaign?campaign=../..",
        "/campaign?campaign=%2e%2e",
        f"/document?campaign={opened}&model=../001&quantity=strain&name=comparison",
        f"/document?campaign={opened}&model=001&quantity=../..&name=comparison",
        f"/document?campaign={opened}&model=001&quantity=strain&name=../../M",
        f"/arrays?campaign={opened}&model=001&quantity=strain&name=../x",
        f"/taken?campaign={opened}&model=001&what=../../../studio.json",
        "/import-form?files=../..",
        "/browse?path=/etc",
        f"/browse?path={served.measured}/../..",
    ):
        status, _, body = served.ask(path, **served.good)
        assert status in (400, 404), (path, body)
        assert TOKEN.encode() not in body
    (served.measured / "out").symlink_to("/etc")
    assert served.ask(f"/browse?path={served.measured}/out", **served.good)[0] == 400
    assert served.do(do="open", path="/etc")[0] == 400
    assert served.get(f"/browse?path={served.measured.parent}")["folders"][0]["campaign"] is True


def test_only_a_post_of_json_changes_anything(served: Served) -> None:
    for method in ("GET", "PUT", "DELETE"):
        assert served.ask("/do", method=method, **served.good)[0] == 405
    for body, kind, expected in (
        (b"{}", "text/plain", 415),
        (b"no json", "application/json", 400),
        (b"[" * 5000, "application/json", 400),
        (b"[]", "application/json", 400),
        (b'{"do": "cancel", "job": {}}', "application/json", 400),
        (b'{"do": "look", "campaign": 3}', "application/json", 400),
    ):
        answer = served.ask("/do", method="POST", body=body, Content_Type=kind, **served.good)
        assert answer[0] == expected, body
    long = served.ask("/do", method="POST", body=b"{}", length=1 << 20, **served.good)
    assert long[0] == 413


def test_a_dropped_name_stays_inside_and_a_large_file_is_refused(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("../evil.csv", "/etc/evil.csv", "a/../../evil.csv", "", "a/b/c/d/e/f/g.csv"):
        assert served.upload(name, b"x")[0] == 400, name
    status, told = served.upload("..evil%00.csv", b"1,2\n")
    assert status == 200
    kept = list((served.folder / "session" / "files" / told["files"]).iterdir())
    assert [p.name for p in kept] == ["evil-.csv"]
    monkeypatch.setattr(intake, "MOST_BYTES", 1000)
    assert served.upload("big.csv", b"x" * 2000, told["files"])[0] == 413
    assert not (kept[0].parent / "big.csv").exists()
    assert served.upload("more.csv", b"x", "../..")[0] == 400


def archive(path: Path, files: dict[str, bytes], link: bool = False) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, data in files.items():
            info = zipfile.ZipInfo(name)
            info.compress_type = zipfile.ZIP_DEFLATED
            if link:
                info.external_attr = (stat.S_IFLNK | 0o777) << 16
            opened.writestr(info, data)
    return path


def test_an_archive_cannot_fill_the_disk_or_write_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(intake, "MOST_FILES", 5)
    target = tmp_path / "out"
    for name, made, said in (
        ("bomb", archive(tmp_path / "a.zip", {"x": b"0" * 50_000_000}), "it grows"),
        ("many", archive(tmp_path / "b.zip", {str(k): b"" for k in range(6)}), "6 files"),
        ("link", archive(tmp_path / "c.zip", {"x": b"/etc/passwd"}, link=True), "links"),
        ("up", archive(tmp_path / "d.zip", {"../../x": b"1"}), "inside the dropped folder"),
    ):
        with pytest.raises(FormatError, match=said):
            intake.unpack(made, target)
        assert not list(tmp_path.parent.glob("x")), name
    lying = tmp_path / "e.zip"
    data = archive(lying, {"x": b"0" * 5000}).read_bytes()
    lying.write_bytes(data.replace((5000).to_bytes(4, "little"), (10).to_bytes(4, "little")))
    with pytest.raises(FormatError, match=r"cannot be unpacked|holds more"):
        intake.unpack(lying, target)
    intake.unpack(archive(tmp_path / "f.zip", {"a/campaign.toml": b"x"}), target)
    assert intake.campaign_in(target) == target / "a"


def test_an_effect_file_is_run_only_after_it_was_shown_and_confirmed(served: Served) -> None:
    mark = served.folder / "executed"
    code = f"open({str(mark)!r}, 'w')\n".encode()
    number = served.upload("mine.py", code)[1]["files"]
    told = served.do(do="dropped", files=number)[1]["effect"]
    assert told["code"].encode() == code
    assert served.desk.session.effect_files == []
    assert served.do(do="confirm-effect", name="mine.py", sha256="0" * 64)[0] == 400
    assert served.do(do="confirm-effect", name="../mine.py", sha256=told["sha256"])[0] == 200
    job = list(served.desk.jobs.all.values())[-1]
    assert job.kind == "effects"
    assert job.argv[1] == "--effects"
    assert job.argv[2].endswith("session/effects/mine.py")
    assert not mark.exists()  # the server itself has not run it


def test_an_archive_with_a_campaign_is_opened(served: Served) -> None:
    with io.BytesIO() as memory:
        with zipfile.ZipFile(memory, "w") as made:
            made.writestr("mine/campaign.toml", "x = 1")
        number = served.upload("mine.zip", memory.getvalue())[1]["files"]
    name = served.do(do="dropped", files=number)[1]["campaign"]
    assert served.campaign(name)["folder"].endswith("mine/mine")
    status, told = served.do(do="dropped", files=served.upload("a.pdf", b"x")[1]["files"])
    assert status == 400
    assert "campaign folder" in told["error"]
