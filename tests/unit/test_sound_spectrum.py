"""Power of narrow bands of a sound: transforms of many frames side by side."""

import numpy as np
import pytest

from impactsig.detect.sound._scale import scale_at
from impactsig.detect.sound.powers._radix_kernels import LANES, order_after, radices_of
from impactsig.detect.sound.powers.bands import Spectrum, bands_at
from tests import naive_sound


# Windows of 96, 192, 256, 384, 512, 750, 1024, 1152 and 2250 samples: all radices, in several
# orders, two or three passes at a time.
@pytest.mark.parametrize(
    "rate", [4000, 8000, 11_025, 16_000, 22_050, 32_000, 44_100, 48_000, 96_000]
)
def test_powers_are_those_of_fourier_coefficients(rate):
    bands = bands_at(rate, 16 * scale_at(rate).hop)
    size, frames = len(bands.window), LANES + 3
    rng = np.random.default_rng(rate)
    x = 3.0 + rng.standard_normal(frames * bands.hop)
    beside = np.concatenate((np.full(size, x[0]), x, np.full(size + bands.hop, x[-1])))
    found = Spectrum(bands).powers(beside, size, frames)
    slow = naive_sound.band_powers(x, rate, bands.hop, bands)
    np.testing.assert_allclose(found, slow, rtol=2e-5, atol=1e-6 * slow.max())


def test_powers_of_a_frame_do_not_depend_on_the_frames_beside_it():
    bands = bands_at(22_050, 128)
    x = np.random.default_rng(1).uniform(-1.0, 1.0, 200 * 128)
    x[::128] = 1.0  # the scale is the same wherever a part begins
    spectrum = Spectrum(bands)
    all_frames = spectrum.powers(x, 1024, 150)
    for first, count in ((1, 149), (40, 7), (149, 1)):
        part = spectrum.powers(x, 1024 + 128 * first, count)
        np.testing.assert_array_equal(part, all_frames[:, first : first + count])


def test_digital_silence_has_no_power():
    spectrum = Spectrum(bands_at(22_050, 128))
    spectrum.powers(np.ones(4096), 1024, 5)  # what is left of it must not be heard
    assert not spectrum.powers(np.zeros(4096), 1024, 5).any()


@pytest.mark.parametrize("count", [1, 2, 96, 375, 512, 1125])
def test_every_frequency_has_a_row(count):
    passes = radices_of(count)
    assert np.prod(passes) == count
    np.testing.assert_array_equal(np.sort(order_after(passes)), np.arange(count))
