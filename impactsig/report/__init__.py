"""Results to one self-contained HTML page."""

from .analysis import Analysis, analyse
from .page import analyse_to_page, write_page, write_report

__all__ = ["Analysis", "analyse", "analyse_to_page", "write_page", "write_report"]
