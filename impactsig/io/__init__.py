"""Readers of recordings: one module a format family, listed in `impactsig.io.formats`."""

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
