"""Reports: results as one self-contained HTML page."""

from .analysing.analysis import Analysis, analyse
from .analysing.dynamics import Dynamics
from .batches import Detected, Entry, detect_many, write_reports
from .page import analyse_to_page, write_page, write_report

__all__ = [
    "Analysis",
    "Detected",
    "Dynamics",
    "Entry",
    "analyse",
    "analyse_to_page",
    "detect_many",
    "write_page",
    "write_report",
    "write_reports",
]
