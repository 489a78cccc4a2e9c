"""Export a Python slave of ``fmu_src`` with pythonfmu. Same input and code, same bytes."""

import json
import re
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from types import ModuleType

from tirelib.core.errors import FormatError
from tirelib.core.version import __version__
from tirelib.fmu.bundle import BROUGHT, collect, write_package
from tirelib.fmu.parts import check_writable, identity_of, source_file, write_fmu
from tirelib.fmu.spec import SlaveSpec

_OPTIONS = {"canGetAndSetFMUstate": True, "canSerializeFMUstate": True}
_FOREIGN = re.compile(r"^(\s*(?:from|import)\s+)pythonfmu(?=[.\s])", re.MULTILINE)
_MODULE = re.compile(r"^import (\S+\.pythonfmu)$", re.MULTILINE)
_LAUNCHER = '''"""Finds the slave. pythonfmu 0.7.0 runs this file anew for every instance.

Whatever class it finds among the names that are new, it never lets go, so there is none, and it
looks for a name without letters in the module. It gives up a reference to the module's names that
it never took; one more is taken here.
"""

import ctypes

import {package}.{module} as slave

globals().update(dict.fromkeys(("", "{model}"), slave.{model}))
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))
'''


def export(spec: SlaveSpec, out: str | Path, progress: Callable[[str], None] | None = None) -> Path:
    """Write the FMU of a slave.

    Every module inside is named by version and content, pythonfmu's included, so that FMUs of
    several versions can live in one process.

    Raises
    ------
    FormatError
        If pythonfmu is not installed, or the FMU cannot be written.
    """
    tell = progress or (lambda _: None)
    target = Path(out)
    check_writable(target)
    slave = source_file(spec.script)
    sources = {**collect(slave), slave.name: slave.read_text(encoding="utf-8")}
    gate = source_file("gate/linux64.so").read_bytes()
    parts: dict[str, str | bytes] = {
        **sources,
        "launcher": _LAUNCHER,
        "pythonfmu": _pythonfmu(),
        "gate": gate,
    }
    identity = identity_of(spec, parts)
    settings = {
        **spec.settings,
        "description": spec.description,
        "step_size": spec.step_size,
        "guid": identity.guid,
        "version": identity.version,
    }
    suffix = f"{re.sub(r'[^0-9a-zA-Z]', '_', __version__)}_{identity.digest}"
    package = f"tirelib_{suffix}"
    tell("modules collected")
    with tempfile.TemporaryDirectory(prefix="tirelib_fmu_") as name:
        folder = Path(name)
        script = folder / f"{slave.stem}_{suffix}.py"
        launcher = _LAUNCHER.format(package=package, module=slave.stem, model=spec.model)
        script.write_text(launcher, encoding="utf-8")
        content = [write_package(folder, sources, package)]
        for path, data in {
            **spec.resources,
            "settings.json": json.dumps(settings, indent=1).encode(),
            "guid.txt": identity.guid.encode(),
        }.items():
            place = folder / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
            top = folder / Path(path).parts[0]
            content += [top] if top not in content else []
        raw = _export(script, folder / "raw" / f"{spec.model}.fmu", content, suffix)
        tell("exported by pythonfmu")
        files = _own_pythonfmu(_unzipped(raw), slave.name, package)
    files |= _gated(files, f"binaries/linux64/{spec.model}.so", gate)
    write_fmu(files, spec, identity, target, packages=("pythonfmu", BROUGHT))
    tell("described and packed")
    return target


def _pythonfmu() -> str:
    """Return the version of pythonfmu."""
    try:
        return metadata.version("pythonfmu")
    except metadata.PackageNotFoundError:
        raise FormatError(
            "fmu build: the package pythonfmu, which writes the FMU, is not installed; install it "
            "with pip install 'tirelib[fmu]'"
        ) from None


def _export(script: Path, target: Path, content: list[Path], suffix: str) -> Path:
    """Let pythonfmu write the FMU."""
    from pythonfmu import FmuBuilder

    target.parent.mkdir()
    with _imports_undone(suffix):
        FmuBuilder.build_FMU(script, dest=target, project_files=content, **_OPTIONS)
    return target


@contextmanager
def _imports_undone(suffix: str) -> Iterator[None]:
    """Forget what the builder imports and where it looked: it runs the slave in this process.

    Modules of the same FMU, loaded here by an importer, stand aside meanwhile.
    """
    path, bytecode = list(sys.path), sys.dont_write_bytecode
    loaded = _take_out(suffix)
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        sys.dont_write_bytecode = bytecode
        sys.path[:] = path
        _take_out(suffix)
        sys.modules.update(loaded)


def _take_out(suffix: str) -> dict[str, ModuleType]:
    """Remove the modules of an FMU from this process and return them."""
    names = [name for name in sys.modules if name.split(".")[0].endswith(suffix)]
    return {name: sys.modules.pop(name) for name in names}


def _unzipped(raw: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(raw) as archive:
        return {name: archive.read(name) for name in archive.namelist() if name[-1] != "/"}


def _own_pythonfmu(files: Mapping[str, bytes], slave: str, package: str) -> dict[str, bytes]:
    """Move pythonfmu's modules into the FMU's own package, where no other version can be met."""
    moved = {}
    for name, data in files.items():
        if name == f"resources/{package}/{slave}":
            text = _FOREIGN.sub(rf"\g<1>{package}.pythonfmu", data.decode())
            moved[name] = _MODULE.sub(r"import \1 as pythonfmu", text).encode()
        else:
            place = name.replace("resources/pythonfmu/", f"resources/{package}/pythonfmu/", 1)
            moved[place] = data
    return moved


def _gated(files: Mapping[str, bytes], library: str, gate: bytes) -> dict[str, bytes]:
    """Return the gate in the place of pythonfmu's library, and that among the resources."""
    return {"resources/binaries/linux64/pythonfmu.so": files[library], library: gate}
