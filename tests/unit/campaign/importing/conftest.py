"""Fixtures: one call that writes a map and imports."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from tests.unit.campaign.importing.importing_synthetic import sae_map, write_map
from tirelib.campaign.importing import ImportReport, import_campaign
from tirelib.core.errors import FormatError

Importer = Callable[..., ImportReport]
Refused = Callable[..., tuple[str, ...]]


@pytest.fixture
def imported(tmp_path: Path) -> Importer:
    """Import files into ``tmp_path/campaign`` by a map given as a document."""

    def run(
        *files: Path, by: Mapping[str, Any] | str | None = None, **options: Any
    ) -> ImportReport:
        path = write_map(tmp_path, sae_map() if by is None else by)
        return import_campaign(files, path, tmp_path / "campaign", **options)

    return run


@pytest.fixture
def refused(imported: Importer, tmp_path: Path) -> Refused:
    """Import, expect a refusal that leaves nothing behind, and return its lines."""

    def run(*files: Path, by: Mapping[str, Any] | str | None = None) -> tuple[str, ...]:
        before = set(tmp_path.iterdir()) | {tmp_path / "map.toml"}
        with pytest.raises(FormatError) as caught:
            imported(*files, by=by)
        assert set(tmp_path.iterdir()) == before
        return caught.value.problems

    return run
