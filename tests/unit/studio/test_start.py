"""What the command line says before the server runs."""

import sys
from pathlib import Path

import pytest

from tirelib.cli import main
from tirelib.core.errors import FormatError
from tirelib.studio.disk import hold
from tirelib.studio.parts import PARTS


def said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *words: str) -> str:
    monkeypatch.setattr(sys, "argv", ["tirelib", "studio", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    return capsys.readouterr().err


def test_a_missing_extra_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "starlette", None)
    assert "pip install 'tirelib[studio]'" in said(monkeypatch, capsys, "--no-browser")


def test_a_folder_that_is_no_campaign_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    words = (str(tmp_path), "--session", str(tmp_path / "s"), "--no-browser")
    assert "it holds no campaign.toml" in said(monkeypatch, capsys, *words)


@pytest.mark.skipif(sys.platform == "win32", reason="sessions are held on POSIX systems only")
def test_one_server_at_a_time_has_a_session(tmp_path: Path) -> None:
    with hold(tmp_path), pytest.raises(FormatError, match="another `tirelib studio`"):
        hold(tmp_path)
    hold(tmp_path).close()


def test_every_effect_of_the_catalogue_has_one_part() -> None:
    from tirelib.effects import CATALOGUE

    listed = [name for names in PARTS.values() for name in names]
    assert sorted(listed) == sorted(CATALOGUE)
