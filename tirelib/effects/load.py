"""Effects of users: from a Python file, or from installed packages (entry points)."""

import traceback
from collections.abc import Iterable, Mapping
from importlib.metadata import entry_points
from pathlib import Path
from types import MappingProxyType

from tirelib.core.errors import FormatError
from tirelib.effects import CATALOGUE
from tirelib.effects.effect import Effect

GROUP = "tirelib.effects"
"""Entry-point group: each entry names an `Effect`, or a list or mapping of them."""

_EXAMPLE = "see docs/howto/effects.md for one of 15 lines"


def all_effects(
    files: Iterable[Path | str] = (), *, installed: bool = True
) -> Mapping[str, Effect]:
    """Return the catalogue with the effects of installed packages and of files added.

    Parameters
    ----------
    files : iterable of path
        Python files, as of the option --effects.
    installed : bool
        Whether entry points are looked up.

    Raises
    ------
    FormatError
        If a source cannot be read, holds no effect, or has a name that another has already.
        All faults are collected.
    """
    sources: list[tuple[str, list[Effect]]] = []
    problems: list[str] = []
    if installed:
        for entry in entry_points(group=GROUP):
            label = f"entry point {entry.name} = {entry.value}"
            try:
                sources.append((label, _listed(entry.load(), label)))
            except FormatError as error:
                problems.extend(error.problems)
            except Exception as error:
                problems.append(
                    f"{label}: {type(error).__name__}: {error}; repair or uninstall the package"
                )
    for file in files:
        try:
            sources.append((str(file), read_effects(file)))
        except FormatError as error:
            problems.extend(error.problems)
    found = dict(CATALOGUE)
    for label, effects in sources:
        for effect in effects:
            if effect.name in found:
                first = found[effect.name].origin
                problems.append(
                    f"{label}: effect {effect.name!r} ({effect.origin}) has the same name as "
                    f"another effect ({first}); names must be unique; choose another name"
                )
            else:
                found[effect.name] = effect
    if problems:
        raise FormatError(problems)
    return MappingProxyType(found)


def read_effects(file: Path | str) -> list[Effect]:
    """Return the effects that a Python file defines, in its order.

    Raises
    ------
    FormatError
        If the file is not there, is not Python, fails as it runs, or defines no effect.
    """
    path = Path(file)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"{path}: cannot be read ({error}); give a Python file") from error
    names: dict[str, object] = {"__name__": f"effects_of_{path.stem}", "__file__": str(path)}
    try:
        exec(compile(text, str(path), "exec"), names)
    except SyntaxError as error:
        raise FormatError(
            f"{path}, line {error.lineno}: not Python: {error.msg}: "
            f"{(error.text or '').strip()!r}; correct the line"
        ) from error
    except Exception as error:
        raise FormatError(
            f"{path}, line {_line(error, path)}: {type(error).__name__}: {error}; correct it "
            f"({_EXAMPLE})"
        ) from error
    return _listed(names, str(path))


def _listed(source: object, label: str) -> list[Effect]:
    """Return the effects in an object: one itself, or the members of a mapping or list."""
    if isinstance(source, Effect):
        return [source]
    if isinstance(source, Mapping):
        members: list[object] = list(source.values())
    elif isinstance(source, list | tuple):
        members = list(source)
    else:
        members = []
    own = {id(effect) for effect in CATALOGUE.values()}
    found = {id(m): m for m in members if isinstance(m, Effect) and id(m) not in own}
    if not found:
        raise FormatError(
            f"{label}: holds no effect; a function with the decorator @effect(...) of "
            f"tirelib.effects is needed ({_EXAMPLE})"
        )
    return list(found.values())


def _line(error: BaseException, path: Path) -> int | str:
    """Return the last line of the file itself that an error went through."""
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == str(path) and frame.lineno is not None
    ]
    return lines[-1] if lines else "?"
