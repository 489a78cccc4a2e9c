"""An archive that could do harm is refused before anything of it is unpacked."""

import stat
import zipfile
from pathlib import Path

import pytest

from tirebench.errors import FmuError
from tirebench.estimator import fmu_archive
from tirebench.estimator.fmu_archive import read_fmu

XML = "modelDescription.xml"


def write(
    path: Path, *entries: tuple[str | zipfile.ZipInfo, bytes], description: bool = True
) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        if description:
            archive.writestr(XML, "<fmiModelDescription/>")
        for name, content in entries:
            archive.writestr(name, content)
    return path


def test_a_good_archive_is_unpacked_where_it_belongs(tmp_path: Path) -> None:
    archive = read_fmu(write(tmp_path / "a.fmu", ("resources/x.txt", b"hello")))
    assert len(archive.sha256) == 64
    with archive.unpack() as folder:
        assert (Path(folder) / "resources" / "x.txt").read_bytes() == b"hello"


@pytest.mark.parametrize(
    "name", ["../evil", "a/../../evil", "/etc/evil", "C:/evil", "a\\..\\evil", "..", "C:evil"]
)
def test_a_name_that_leads_out_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(FmuError, match=r"a.fmu: .*(leads out|not a relative path).*; do not use"):
        read_fmu(write(tmp_path / "a.fmu", (name, b"x")))
    assert not (tmp_path.parent / "evil").exists()


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR])
def test_links_and_devices_are_refused(tmp_path: Path, kind: int) -> None:
    entry = zipfile.ZipInfo("resources/link")
    entry.create_system = 3
    entry.external_attr = (kind | 0o777) << 16
    with pytest.raises(FmuError, match="is a link or a device"):
        read_fmu(write(tmp_path / "a.fmu", (entry, b"/etc/passwd")))


def test_a_bomb_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FmuError, match=r"'resources/zeros' unpacks to \d+ times its size"):
        read_fmu(write(tmp_path / "a.fmu", ("resources/zeros", bytes(20 * 2**20))))


def test_size_and_number_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "a.fmu", ("a", b"x" * 600), ("b", b"y" * 600))
    monkeypatch.setattr(fmu_archive, "LARGEST_TOTAL", 1000)
    monkeypatch.setattr(fmu_archive, "LARGEST_FILE", 500)
    monkeypatch.setattr(fmu_archive, "LARGEST_COUNT", 2)
    with pytest.raises(FmuError) as caught:
        read_fmu(path)
    assert str(caught.value).count("at most") == 4


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_names_that_come_twice_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FmuError, match="occurs twice"):
        read_fmu(write(tmp_path / "a.fmu", ("a", b"x"), ("a", b"y")))


def test_an_archive_without_description_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FmuError, match=r"modelDescription.xml is missing"):
        read_fmu(write(tmp_path / "a.fmu", ("a", b"x"), description=False))


def test_what_is_no_archive_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.fmu").write_bytes(b"MZ" * 100)
    with pytest.raises(FmuError, match=r"not an FMU"):
        read_fmu(tmp_path / "a.fmu")
    with pytest.raises(FmuError, match=r"cannot be read"):
        read_fmu(tmp_path / "b.fmu")


def test_damaged_content_is_found_while_unpacking_and_leaves_nothing(tmp_path: Path) -> None:
    path = write(tmp_path / "a.fmu", ("resources/x", b"some text " * 50))
    data = bytearray(path.read_bytes())
    at = data.find(b"resources/x") + 20
    data[at] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(FmuError, match=r"cannot be unpacked"):
        read_fmu(path).unpack()


def changed(path: Path, header: bytes, offset: int, value: int) -> None:
    """Set two bytes behind the beginning of every such header of an archive."""
    data = bytearray(path.read_bytes())
    place = data.find(header)
    while place >= 0:
        data[place + offset : place + offset + 2] = value.to_bytes(2, "little")
        place = data.find(header, place + 1)
    path.write_bytes(data)


def test_an_archive_of_a_later_format_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.fmu", ("resources/x", b"some text " * 50))
    changed(path, b"PK\1\2", 10, 99)  # the way of compression, in the directory and in each entry
    changed(path, b"PK\3\4", 8, 99)
    with pytest.raises(FmuError, match=r"cannot be unpacked .*compression"):
        read_fmu(path).unpack()
    changed(path, b"PK\1\2", 6, 250)  # the version that is needed to read it
    with pytest.raises(FmuError, match=r"not an FMU .*version"):
        read_fmu(path)


def test_a_folder_that_would_crash_the_fmu_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    odd = tmp_path / "caf\u00e9%20"
    odd.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(odd))
    with pytest.raises(FmuError, match="set TMPDIR"):
        read_fmu(write(tmp_path / "a.fmu")).unpack()
    assert list(odd.iterdir()) == []
