"""What there is to do: campaigns and recordings below folders, globs and URLs."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fsspec
from fsspec.core import url_to_fs

from tirelib.campaign.header import FILE as CAMPAIGN
from tirelib.campaign.recording import FILE as RECORDING
from tirelib.core.errors import FormatError

CHUNK = 1 << 20


@dataclass(frozen=True, slots=True)
class Source:
    """A campaign or a recording: its address, and whether it is one of this machine's folders."""

    url: str
    local: bool


def find_sources(
    paths: Sequence[str], left_out: Callable[[Exception], None] = lambda error: None
) -> list[Source]:
    """Return every campaign and recording below the paths, each once, in the order of addresses.

    Parameters
    ----------
    paths : sequence of str
        Folders, patterns with ``*``, or URLs that fsspec knows (``s3://bucket/campaigns``). A
        folder that is neither a campaign nor a recording is searched through.
    left_out : callable
        Called with the error of each folder that cannot be searched.

    Raises
    ------
    FormatError
        Naming each path below which there is nothing, or that cannot be reached.
    """
    found: dict[str, Source] = {}
    problems = []
    for path in paths:
        try:
            below = list(_below(path, left_out))
        except FileNotFoundError as error:
            problems.append(f"{path}: {error}; a folder, a pattern or a URL is needed; correct it")
            continue
        except Exception as error:  # each kind of storage has errors of its own
            problems.append(f"{path}: cannot be reached ({error}); check the address and its keys")
            continue
        if not below:
            problems.append(
                f"{path}: no campaign ({CAMPAIGN}) and no recording ({RECORDING}) below it; name a "
                "folder that holds some"
            )
        found |= {source.url: source for source in below}
    if problems:
        raise FormatError(problems)
    return [found[url] for url in sorted(found)]


def _below(path: str, left_out: Callable[[Exception], None]) -> Iterator[Source]:
    fs, root = url_to_fs(path, use_listings_cache=False)
    local = "file" in _protocols(fs)
    roots = sorted(fs.glob(root)) if any(sign in root for sign in "*?[") else [root]
    for each in roots:
        if not fs.isdir(each):
            if each == root:
                kind = "a file and no folder" if fs.exists(each) else "no such folder"
                raise FileNotFoundError(kind)
            continue
        for folder in _holding(fs, each, left_out):
            yield Source(folder if local else fs.unstrip_protocol(folder), local)


def _holding(fs: Any, folder: str, left_out: Callable[[Exception], None]) -> Iterator[str]:
    """Yield the folders of campaigns and recordings; `walk` hands its `on_error` no level down."""
    for _, below, files in fs.walk(folder, maxdepth=1, on_error=left_out):
        if CAMPAIGN in files or RECORDING in files:
            yield folder
        else:
            for name in below:
                yield from _holding(fs, f"{folder.rstrip('/')}/{name}", left_out)


def _protocols(fs: Any) -> tuple[str, ...]:
    return (fs.protocol,) if isinstance(fs.protocol, str) else tuple(fs.protocol)


def fingerprint(source: Source) -> str:
    """Return a hash of names, sizes and dates of a source's files: it shows that nothing changed.

    It serves to skip what is finished without reading it; the content has a hash of its own.
    """
    fs, root = url_to_fs(source.url, use_listings_cache=False)
    files = fs.find(root, detail=True)
    digest = hashlib.sha256(source.url.encode())
    for name in sorted(files):
        about = files[name]
        state = [about.get(key) for key in ("size", "ETag", "mtime", "LastModified", "etag")]
        digest.update(f"\0{name}\0{state}".encode())
    return digest.hexdigest()


def fetched(source: Source, folder: Path) -> Path:
    """Return a source as a folder of this machine; one from elsewhere is copied into `folder`."""
    if source.local:
        return Path(source.url)
    fs, root = url_to_fs(source.url, use_listings_cache=False)
    target: Path = folder / root.rstrip("/").rpartition("/")[2]
    fs.get(root, str(target), recursive=True)
    return target


def content_hash(folder: Path) -> str:
    """Return the SHA-256, in hex, of names and bytes of all files of a folder.

    A file may be larger than the memory. It does not depend on where the folder lies.
    """
    digest = hashlib.sha256()
    for path in sorted(each for each in folder.rglob("*") if each.is_file()):
        digest.update(f"{path.relative_to(folder).as_posix()}\0{path.stat().st_size}\0".encode())
        with path.open("rb") as stream:
            while chunk := stream.read(CHUNK):
                digest.update(chunk)
    return digest.hexdigest()


def filesystem(url: str) -> tuple[Any, str]:
    """Return the file system of an address and the path on it.

    Raises
    ------
    FormatError
        If the protocol is unknown, or needs a package that is not installed.
    """
    try:
        return url_to_fs(url, use_listings_cache=False)  # type: ignore[no-any-return]
    except (ValueError, ImportError) as error:
        known = ", ".join(sorted({"file", "s3", "gs", "abfs"} & set(fsspec.available_protocols())))
        raise FormatError(
            f"{url}: {error}; a folder or an address that fsspec knows ({known}, ...) is needed"
        ) from None
