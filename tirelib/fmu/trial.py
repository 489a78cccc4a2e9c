"""Try an FMU with FMPy in a process of its own, which a foreign binary may bring down.

``python -m tirelib.fmu.trial X.fmu FOLDER`` writes ``FOLDER/trial.json`` part by part, so that what
was found before a crash is known, and the outputs of the reference run as ``FOLDER/result.csv``.
Started by `tirelib.fmu.check`; it runs the code that the FMU holds.
"""

import json
import shutil
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu, supported_platforms
from fmpy.util import read_csv
from fmpy.validation import validate_fmu

MOST_STEPS = 100
"""Largest number of steps of a run without reference signals."""
_FACTS = ("modelName", "fmiVersion", "guid", "generationTool", "version", "description")


class Record:
    """What was found so far, on disk after every part."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.content: dict[str, Any] = {"parts": []}

    def add(self, name: str, passed: bool, detail: str) -> bool:
        """Note a part; return whether it passed."""
        self.content["parts"].append({"name": name, "passed": passed, "detail": detail})
        self.write()
        return passed

    def write(self) -> None:
        """Bring it to disk."""
        self._file.write_text(json.dumps(self.content))


def attempt(record: Record, name: str, work: Callable[[], str]) -> bool:
    """Do a part; whatever it raises is its result."""
    try:
        return record.add(name, True, work())
    except Exception as error:  # FMPy, lxml and ctypes raise whatever they like
        return record.add(name, False, f"{type(error).__name__}: {error}".strip()[:2000])


def trial(fmu: Path, folder: Path) -> None:
    """Validate, load, run."""
    record = Record(folder / "trial.json")

    def validate() -> str:
        problems = validate_fmu(str(fmu))
        if problems:
            raise ValueError("; ".join(problems))
        return "fmpy validate finds no problem"

    attempt(record, "validation", validate)
    try:
        description = read_model_description(str(fmu), validate=False)
    except Exception as error:  # as above
        record.add("description", False, f"{type(error).__name__}: {error}"[:2000])
        return
    record.content["facts"] = {name: getattr(description, name, None) for name in _FACTS}
    record.content["variables"] = len(description.modelVariables)
    record.content["units"] = {
        v.name: getattr(v.declaredType, "unit", None) or v.unit or ""
        for v in description.modelVariables
    }
    record.write()
    unpacked = Path(extract(str(fmu), unzipdir=str(folder / "fmu")))
    try:
        _run(record, description, unpacked, fmu, folder)
    finally:
        shutil.rmtree(unpacked, ignore_errors=True)


def _run(record: Record, description: Any, unpacked: Path, fmu: Path, folder: Path) -> None:
    messages: list[str] = []

    def keep(*said: Any) -> None:  # the message is the last argument in FMI 2.0 and 3.0
        messages.append(said[-1].decode("utf-8", "replace"))

    common: dict[str, Any] = {
        "filename": str(unpacked),
        "model_description": description,
        "validate": False,
        "logger": keep,
        "debug_logging": True,
        "timeout": 300.0,
    }
    model = description.modelName
    signals = unpacked / "resources" / "reference"
    if (folder / "reference").is_dir():
        signals = folder / "reference"

    def simulate() -> str:
        options = read_options(signals / f"{model}_ref.opt")
        names = [v.name for v in description.modelVariables if v.causality == "output"]
        if not options:
            experiment = description.defaultExperiment
            step = float(getattr(experiment, "stepSize", None) or 1e-3)
            start = float(getattr(experiment, "startTime", None) or 0.0)
            result = simulate_fmu(
                **common,
                start_time=start,
                stop_time=start + MOST_STEPS * step,
                output_interval=step,
            )
            return f"{len(result) - 1} steps of {step:g} s without input"
        given = read_csv(signals / f"{model}_in.csv")
        wanted = read_csv(signals / f"{model}_ref.csv").dtype.names[1:]
        missing = sorted(set(wanted) - set(names))
        if missing:
            raise ValueError(f"outputs of the reference are missing: {', '.join(missing[:8])}")
        result = simulate_fmu(
            **common,
            start_time=options["StartTime"],
            stop_time=options["StopTime"],
            output_interval=options["StepSize"],
            input=given,
            output=list(wanted),
        )
        _write(folder / "result.csv", result)
        return f"{len(result) - 1} steps of {options['StepSize']:g} s with the reference input"

    record.content["platforms"] = sorted(supported_platforms(str(fmu)))
    if not attempt(record, "run", simulate) and messages:
        record.content["messages"] = messages[:20]
    record.write()


def _write(file: Path, result: Any) -> None:
    """Write a result; elements of an array are columns ``name[1]``, ``name[2]`` .."""
    head: list[str] = []
    columns = []
    for name in result.dtype.names:
        values = np.asarray(result[name], dtype=np.float64).reshape(len(result), -1)
        several = values.shape[1] > 1
        head += [f"{name}[{i}]" if several else name for i in range(1, values.shape[1] + 1)]
        columns.append(values)
    np.savetxt(file, np.hstack(columns), delimiter=",", header=",".join(head), comments="")


def read_options(file: Path) -> Mapping[str, float]:
    """Return the options of a reference run; empty where there are none."""
    if not file.is_file():
        return {}
    rows = (line.split(",") for line in file.read_text().splitlines() if line.strip())
    return {name.strip(): float(value) for name, value in rows}


if __name__ == "__main__":
    trial(Path(sys.argv[1]), Path(sys.argv[2]))
