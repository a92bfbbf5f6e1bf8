"""Path to Recording: one file a format family, one table of formats (`impactsig.io.formats`)."""

from ._info import ChannelInfo, FileInfo, info
from ._limits import Limits
from ._raw import RawLayout
from .many import read_many
from .reading import Blocks, read, read_blocks

__all__ = [
    "Blocks",
    "ChannelInfo",
    "FileInfo",
    "Limits",
    "RawLayout",
    "info",
    "read",
    "read_blocks",
    "read_many",
]
