"""Laws of instances: each is its own, forgets and remembers exactly, and leaves nothing behind."""

import gc
import multiprocessing
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from tests.fmu import live, virtual_host
from tests.fmu.player import CONDITIONS, play, same, strain
from tirelib.fmu.run import LoadedFmu


def test_four_instances_are_independent() -> None:
    loads = (3e3, 3.5e3, 4.2e3, 5e3)
    fmus = [LoadedFmu(live.fmu_file(10), name=f"wheel_{n}") for n in range(4)]
    records = [strain(load) for load in loads]
    try:
        for fmu in fmus:
            fmu.start(live.RATE)
        n = min(record.shape[1] for record in records)
        for first in range(0, n, 10):
            for fmu, record in zip(fmus, records, strict=True):
                fmu.step(record[:, first : first + 10], CONDITIONS)
        together = [fmu.read() for fmu in fmus]
        alone = []
        for record in records:
            fmus[0].start(live.RATE)
            alone.append(play(fmus[0], record[:, :n])[-1])
        assert same(together, alone)
        assert len({values["Fz"] for values in together}) == 4
    finally:
        for fmu in fmus:
            fmu.close()


def test_reset_forgets_everything(fmu: LoadedFmu) -> None:
    samples = strain()
    fmu.start(live.RATE)
    first = play(fmu, samples)
    fmu.start(live.RATE)
    assert fmu.read()["turn"] == 0
    assert same(play(fmu, samples), first)


def test_a_state_rolls_back_exactly_and_survives_reset_and_serialisation(fmu: LoadedFmu) -> None:
    samples = strain()
    fmu.start(live.RATE)
    play(fmu, samples[:, :1130])
    state = fmu.slave.getFMUState()
    text = fmu.slave.serializeFMUState(state)
    count, now = fmu.count, fmu.read()
    wanted = play(fmu, samples[:, 1130:])
    fmu.slave.setFMUState(state)
    fmu.count = count
    assert same([fmu.read()], [now])
    assert same(play(fmu, samples[:, 1130:]), wanted)
    fmu.start(live.RATE)
    again = fmu.slave.deSerializeFMUstate(text)
    fmu.slave.setFMUState(again)
    fmu.count = count
    assert same([fmu.read()], [now])
    assert same(play(fmu, samples[:, 1130:]), wanted)
    for used in (state, again):
        fmu.slave.freeFMUState(used)


@pytest.mark.parametrize("at", [5, 200, -40, None])
def test_a_damaged_state_is_refused_in_the_same_words_and_nothing_changes(
    fmu: LoadedFmu, at: int | None
) -> None:
    fmu.start(live.RATE)
    play(fmu, strain())
    now = fmu.read()
    text = bytearray(fmu.slave.serializeFMUState(fmu.slave.getFMUState()))
    if at is None:
        del text[-7:]
    else:
        text[at] ^= 1
    with pytest.raises(FMICallException, match="fmi2SetFMUstate failed with status 3"):
        fmu.slave.setFMUState(fmu.slave.deSerializeFMUstate(bytes(text)))
    assert fmu.messages[-1].startswith(
        "FormatError: the bytes are not a saved state of this FMU; save the state again"
    )
    assert same([fmu.read()], [now])


def test_a_state_needs_no_file_but_the_calibration_that_it_was_saved_with(
    ten: LoadedFmu, tmp_path: Path
) -> None:
    """A roll-back reads nothing; after a reset the file is read, and must hold the same."""
    known, samples = live.calibration(), strain()
    wider = replace(known.chains[-1].laws, contact_width=0.2)
    path = tmp_path / "a calibration"
    ten.start(live.RATE, calibration=live.write_other(known, path, ten))
    play(ten, samples[:, :1130])
    state, count = ten.slave.getFMUState(), ten.count
    wanted = play(ten, samples[:, 1130:])
    path.unlink()
    ten.slave.setFMUState(state)
    ten.count = count
    assert same(play(ten, samples[:, 1130:]), wanted)
    chains = {**known.chains, -1: replace(known.chains[-1], laws=wider)}
    other = replace(known, chains=chains)
    ten.start(live.RATE, calibration=live.write_other(other, path, ten))
    before = play(ten, samples)[-1]
    with pytest.raises(FMICallException, match="fmi2SetFMUstate failed with status 3"):
        ten.slave.setFMUState(state)
    assert "not a saved state of this FMU" in ten.messages[-1]
    assert same([ten.read()], [before])
    live.write_other(known, path, ten)
    ten.start(live.RATE, calibration=str(path))
    ten.slave.setFMUState(state)
    ten.count = count
    assert same(play(ten, samples[:, 1130:]), wanted)


def python_file(samples: int) -> Path:
    return live.fmu_file(samples, python=True)


def growth(path: str) -> tuple[int, int]:
    """Return how many objects, and references to the slave's module, thirty instances leave."""
    description = read_model_description(path)
    folder = extract(path)

    def cycle() -> None:
        slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            instanceName="cycle",
            modelIdentifier=description.coSimulation.modelIdentifier,
        )
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        slave.doStep(0.0, float(description.defaultExperiment.stepSize))
        slave.freeInstance()

    def left() -> tuple[int, int]:
        gc.collect()
        name = (Path(folder) / "resources" / "slavemodule.txt").read_text()
        return len(gc.get_objects()), sys.getrefcount(vars(sys.modules[name]))

    try:
        for _ in range(3):
            cycle()
        before = left()
        for _ in range(30):
            cycle()
        after = left()
    finally:
        shutil.rmtree(folder)
    return after[0] - before[0], after[1] - before[1]


@pytest.mark.parametrize("file", [python_file, partial(virtual_host.file, python=True)])
def test_instances_come_and_go_without_growth(file: Callable[[int], Path]) -> None:
    # a process of its own: threads that other tests left make and drop objects meanwhile
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        objects, references = pool.apply(growth, (str(file(10)),))
    assert objects < 15  # an empty slave of pythonfmu leaves 14 objects each time
    assert references == 0  # what pythonfmu gives up is what the launcher takes


def test_a_freed_instance_leaves_at_once_with_its_memory() -> None:
    def alive() -> int:
        return sum(
            type(thing).__name__ == "StrainTire" and thing.instance_name == "gone"
            for thing in gc.get_objects()
        )

    gc.collect()
    gc.disable()
    try:
        with LoadedFmu(python_file(10), name="gone") as fmu:
            fmu.start(live.RATE)
            play(fmu, strain(turns=1.0))
            assert alive() >= 1
        assert alive() == 0
    finally:
        gc.enable()
