"""The files of the documentation: their parts refer to each other, and their commands exist."""

import re
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("yaml", reason="PyYAML comes with the extra tirelib[fleet]")

import dask.config
import yaml
from distributed.cli.dask_scheduler import main as dask_scheduler
from distributed.cli.dask_worker import main as dask_worker

from tirelib.cli.fleet import fleet
from tirelib.fleet.cluster import NO_PROFILER

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "howto" / "fleet"
COMMANDS = {
    ("dask", "scheduler"): dask_scheduler,
    ("dask", "worker"): dask_worker,
    ("tirelib", "fleet"): fleet,
}


def check_command(words: list[str]) -> None:
    """Parse the words as the program would."""
    command = COMMANDS[words[0], words[1]]
    command.make_context(words[1], list(words[2:]), resilient_parsing=False)


def test_compose_builds_one_image_and_its_commands_exist() -> None:
    document = yaml.safe_load((FOLDER / "compose.yaml").read_text())
    services = document["services"]
    for service in services.values():
        build = service["build"]
        place = (FOLDER / build["context"]).resolve()
        assert (place / build["dockerfile"]).is_file()
        assert (place / "pyproject.toml").is_file()
        assert set(service.get("depends_on", ())) <= set(services)
        check_command(service["command"])
    assert (
        f"tcp://scheduler:{_port(services['scheduler']['command'])}"
        in services["worker"]["command"]
    )


def _port(command: list[str]) -> str:
    return command[command.index("--port") + 1]


def test_kubernetes_selects_its_pods_and_its_commands_exist() -> None:
    parts: list[dict[str, Any]] = list(yaml.safe_load_all((FOLDER / "kubernetes.yaml").read_text()))
    pods = [part["spec"]["template"] for part in parts if "template" in part["spec"]]
    labels = [pod.get("metadata", {}).get("labels", {}) for pod in pods]
    (service,) = (part for part in parts if part["kind"] == "Service")
    assert service["spec"]["selector"] in labels
    commands = {}
    for part in parts:
        if part["kind"] == "Deployment":
            chosen = part["spec"]["selector"]["matchLabels"]
            assert chosen == part["spec"]["template"]["metadata"]["labels"]
        if "template" in part["spec"]:
            (container,) = part["spec"]["template"]["spec"]["containers"]
            check_command(container["command"])
            commands[part["metadata"]["name"]] = container["command"]
    port = _port(commands["tirelib-scheduler"])
    address = f"tcp://{service['metadata']['name']}:{port}"
    assert address in commands["tirelib-worker"]
    assert address in commands["tirelib-fleet"]
    assert int(port) in [each["port"] for each in service["spec"]["ports"]]


def test_the_image_installs_the_extra_that_exists() -> None:
    extra = re.search(r"/src\[(\w+)\]", (FOLDER / "Dockerfile").read_text())
    assert extra is not None
    assert f"\n{extra[1]} = [" in (ROOT / "pyproject.toml").read_text()


def test_the_image_turns_off_the_profiler_as_a_cluster_of_this_machine_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for pair in re.findall(r"^ENV (DASK_\S+)=(\S+)", (FOLDER / "Dockerfile").read_text(), re.M):
        monkeypatch.setenv(*pair)
    found = dask.config.collect_env()
    for name, value in NO_PROFILER.items():
        assert dask.config.get(name, config=found) is value
