"""What the motions of all systems have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .._showing import Shown

if TYPE_CHECKING:
    from .spectrum import PowerSpectrum


class Moved(Shown):
    """Base of motions: the end of their span, and their spectrum."""

    @property
    def stop(self: Any) -> float:
        """End of the span."""
        end: float = self.start + self.duration
        return end

    def power_spectrum(self, quantity: str | int | None = None, **options: Any) -> PowerSpectrum:
        """Power spectral density; see `impactsig.simulation.spectrum.power_spectrum`."""
        from .spectrum import power_spectrum

        return power_spectrum(self, quantity, **options)
