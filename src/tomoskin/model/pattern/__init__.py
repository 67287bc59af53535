"""Drive and measurement tables: THE order of the rows, shared by firmware, decoder and Jacobian."""

from tomoskin.model.pattern.match import RowMatch, RowSums, match_rows, sum_rows
from tomoskin.model.pattern.pattern import (
    NAMED,
    Pattern,
    check_drives,
    drive_table,
    electrodes_of,
    named,
    signed,
    undirected,
)
from tomoskin.model.pattern.scan import Scan

__all__ = [
    "NAMED",
    "Pattern",
    "RowMatch",
    "RowSums",
    "Scan",
    "check_drives",
    "drive_table",
    "electrodes_of",
    "match_rows",
    "named",
    "signed",
    "sum_rows",
    "undirected",
]
