"""The part of the library that an FMU carries: every module that its slave needs, renamed.

A process holds one module of a name, so an FMU that brought ``tirelib`` would run the code of
whichever version came first. The copy is therefore called ``tirelib_<hash>``, by its content.
"""

import ast
import hashlib
import importlib
import inspect
import re
import sys
from collections.abc import Mapping
from pathlib import Path

from tirelib.core.errors import FormatError

PACKAGE = "tirelib"
ALLOWED = frozenset({"numpy", "scipy", "pythonfmu", "tomli_w"})
"""What a bundled module may import beside the standard library; `tomli_w` writes files only."""
BROUGHT = "threadpoolctl"
"""A module that comes along, because it is one file."""
_IMPORT = re.compile(rf"^(\s*(?:from|import)\s+){PACKAGE}(?=[.\s])", re.MULTILINE)
_BROUGHT = re.compile(rf"^(\s*from\s+)({BROUGHT}\s+import)", re.MULTILINE)


def collect(slave: Path) -> dict[str, str]:
    """Return the sources that a slave needs, by path within the package.

    The package's own ``__init__`` files are left empty, unless a name is imported from them, so
    that what they gather for users does not come along.

    Raises
    ------
    FormatError
        If a module needs more than numpy and scipy.
    """
    root = Path(__file__).parents[1]
    sources: dict[str, str] = {}
    waiting = _imports(slave.read_text(encoding="utf-8"), slave.name)
    while waiting:
        name = waiting.pop()
        path = _module_file(root, name)
        key = path.relative_to(root).as_posix()
        if key not in sources:
            sources[key] = path.read_text(encoding="utf-8")
            waiting |= _imports(sources[key], key)
    if any(_BROUGHT.search(source) for source in sources.values()):
        module = importlib.import_module(BROUGHT)
        sources[f"{BROUGHT}.py"] = inspect.getsource(module)
    for key in list(sources):
        for folder in Path(key).parents:
            sources.setdefault((folder / "__init__.py").as_posix(), '"""Part of an FMU."""\n')
    return dict(sorted(sources.items()))


def content_hash(parts: Mapping[str, str]) -> str:
    """Return twelve hexadecimal digits that stand for names and texts."""
    digest = hashlib.sha256()
    for name, text in sorted(parts.items()):
        digest.update(f"{name}\0{len(text)}\0{text}".encode())
    return digest.hexdigest()[:12]


def renamed(source: str, package: str) -> str:
    """Return a source that imports from `package` instead of ``tirelib``.

    Examples
    --------
    >>> renamed("from tirelib.core.errors import TirelibError", "tirelib_0")
    'from tirelib_0.core.errors import TirelibError'
    """
    return _BROUGHT.sub(rf"\g<1>{package}.\g<2>", _IMPORT.sub(rf"\g<1>{package}", source))


def write_package(folder: Path, sources: Mapping[str, str], package: str) -> Path:
    """Write the renamed sources as a package and return its folder."""
    for key, source in sources.items():
        path = folder / package / key
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(renamed(source, package), encoding="utf-8")
    return folder / package


def _imports(source: str, where: str) -> set[str]:
    """Return the library's modules that a source imports; refuse others that an FMU lacks."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
            if node.module.split(".")[0] == PACKAGE:
                names |= {f"{node.module}.{alias.name}" for alias in node.names}
    own = {name for name in names if name.split(".")[0] == PACKAGE}
    other = {name.split(".")[0] for name in names - own}
    strange = other - ALLOWED - {BROUGHT} - sys.stdlib_module_names
    if strange:
        raise FormatError(
            f"{where}: imports {', '.join(sorted(strange))}; an FMU may import numpy and scipy "
            "only; keep other packages out of the modules that tirelib.fmu.wheel needs"
        )
    root = Path(__file__).parents[1]
    return {name for name in own if name != PACKAGE and _module_file(root, name).is_file()}


def _module_file(root: Path, name: str) -> Path:
    path = root.joinpath(*name.split(".")[1:])
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
