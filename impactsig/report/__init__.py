"""Results to one self-contained HTML page."""

from .analysis import Analysis, analyse
from .page import write_page, write_report

__all__ = ["Analysis", "analyse", "write_page", "write_report"]
