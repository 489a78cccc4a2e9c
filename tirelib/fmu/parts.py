"""What every FMU of this library is made of, whoever computes in it.

Same content, same bytes: the GUID and the version follow from all that goes into an FMU.
"""

import json
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from uuid import UUID, uuid5

from tirelib.core.compiled import shipped
from tirelib.core.errors import FormatError
from tirelib.core.version import __version__
from tirelib.fmu.bundle import content_hash
from tirelib.fmu.describe import described, repack
from tirelib.fmu.spec import SlaveSpec

DEFAULT_RATE = 1e4
"""Sample rate of the gages where nothing else is said, [Hz]."""
_NAMESPACE = UUID("5b1f6a2e-3c7d-5e84-9a10-7469726c6962")


@dataclass(frozen=True, slots=True)
class Identity:
    """What tells an FMU from all others.

    Attributes
    ----------
    digest : str
        Twelve hexadecimal digits that stand for its content.
    guid : str
        In braces, as in the model description.
    version : str
    """

    digest: str
    guid: str
    version: str


def identity_of(spec: SlaveSpec, parts: Mapping[str, str | bytes]) -> Identity:
    """Return the identity of an FMU: of its description, and of the parts that compute."""
    settings = {**spec.settings, "description": spec.description, "step_size": spec.step_size}
    every: dict[str, str | bytes] = {
        **parts,
        "settings": json.dumps(settings),
        **{f"resources/{name}": data for name, data in spec.resources.items()},
        **{f"documentation/{name}": data for name, data in spec.documentation.items()},
        "icon": spec.icon,
    }
    digest = content_hash(
        {name: part if isinstance(part, str) else part.hex() for name, part in every.items()}
    )
    return Identity(digest, f"{{{uuid5(_NAMESPACE, digest)}}}", f"{__version__}+{digest}")


def write_fmu(
    files: Mapping[str, bytes],
    spec: SlaveSpec,
    identity: Identity,
    target: Path,
    *,
    packages: Iterable[str] = (),
) -> None:
    """Write the archive: `files`, with the model description completed, and what all FMUs bring.

    Parameters
    ----------
    files : mapping of str to bytes
        ``modelDescription.xml``, that of FMI 3.0 complete, and all that the FMU runs with.
    packages : iterable of str, optional
        Installed packages that are inside, whose licences are added.

    Raises
    ------
    FormatError
        If the FMU cannot be written.
    """
    brought = {"model.png": spec.icon, **_licenses(packages)}
    if spec.fmi == 2:
        brought["modelDescription.xml"] = described(
            files["modelDescription.xml"], spec.table, spec.start_depends_on
        )
    for name, data in spec.documentation.items():
        brought[f"documentation/{name}"] = data.replace(b"{version}", identity.version.encode())
    try:
        repack({**files, **brought}, target)
    except OSError as error:
        raise _unwritable(target, error) from None


def check_writable(target: Path) -> None:
    """Refuse a name that is no FMU's or cannot be written before the work is done, not after.

    Raises
    ------
    FormatError
        Which it is.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=target.parent):
            pass
        if target.is_dir():
            raise IsADirectoryError(21, "is a folder")
    except OSError as error:
        raise _unwritable(target, error) from None
    if target.suffix.lower() != ".fmu":
        raise FormatError(
            f"{target}: ends in {target.suffix!r}; allowed is .fmu, the ending that importers "
            "expect; choose another name"
        )


def _unwritable(target: Path, error: OSError) -> FormatError:
    return FormatError(f"{target}: cannot be written ({error.strerror}); choose another file")


def source_file(name: str) -> Path:
    """Return a file of ``fmu_src``: beside the package in a checkout, inside it when installed.

    Raises
    ------
    FormatError
        If it is in neither.
    """
    found = shipped(name)
    if found is not None:
        return found
    raise FormatError(
        f"{Path(__file__).parents[2]}: holds no fmu_src/{name}, a source of the FMU; install "
        "tirelib from its repository or its wheel"
    )


def _licenses(packages: Iterable[str]) -> dict[str, bytes]:
    """Return the licences of all that is inside."""
    own = Path(__file__).parents[2] / "LICENSE"
    texts = {"license.txt": own.read_bytes() if own.is_file() else _installed_license("tirelib")}
    texts |= {f"{name}.txt": _installed_license(name) for name in packages}
    return {f"documentation/licenses/{name}": text for name, text in texts.items() if text}


def _installed_license(package: str) -> bytes:
    for file in metadata.files(package) or []:
        if file.name.upper().startswith("LICENSE"):
            return Path(str(file.locate())).read_bytes()
    return b""
