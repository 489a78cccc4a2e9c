"""Campaigns from other formats: MATLAB, CSV, Parquet, TYDEX and loose MDF 4, by a small map.

Data flow: `formats` reads a file as named columns, `mapfile` the map, `convert` joins both to runs
in SI and ISO, `importer` writes the campaign and has it checked.
"""

from tirelib.campaign.importing.columns import Column, Table
from tirelib.campaign.importing.delimited import CsvOptions
from tirelib.campaign.importing.formats import read_table
from tirelib.campaign.importing.importer import ImportReport, import_campaign
from tirelib.campaign.importing.mapfile import read_map
from tirelib.campaign.importing.plans import ImportedRun
from tirelib.campaign.importing.rules import ImportMap
from tirelib.campaign.importing.suggest import ColumnSummary, list_columns, suggest_map
from tirelib.campaign.importing.tydex import (
    TydexChannel,
    TydexEntry,
    TydexFile,
    read_tydex,
    write_tydex,
)

__all__ = [
    "Column",
    "ColumnSummary",
    "CsvOptions",
    "ImportMap",
    "ImportReport",
    "ImportedRun",
    "Table",
    "TydexChannel",
    "TydexEntry",
    "TydexFile",
    "import_campaign",
    "list_columns",
    "read_map",
    "read_table",
    "read_tydex",
    "suggest_map",
    "write_tydex",
]
