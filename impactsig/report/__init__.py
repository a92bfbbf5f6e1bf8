"""Results to one self-contained HTML page."""

from .analysis import Analysis, analyse
from .dynamics import Dynamics
from .page import analyse_to_page, write_page, write_report

__all__ = ["Analysis", "Dynamics", "analyse", "analyse_to_page", "write_page", "write_report"]
