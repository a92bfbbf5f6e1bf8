"""Random disturbances of sound: what is added to a record, and what is made of its samples.

`benchmarks.varied_sound` puts one on each of its records.
"""

from __future__ import annotations

import io

import numpy as np
from scipy import ndimage, signal

from .recordings import coloured

CODECS = ("WAV", "ULAW"), ("MP3", "MPEG_LAYER_III"), ("OGG", "VORBIS")


def added(rng, x: np.ndarray, rate: float, height: float, kind: str) -> np.ndarray:
    """What a disturbance adds to the sound, of which `height` is the median peak."""
    n = len(x)
    t = np.arange(n) / rate
    out = np.zeros(n)
    if kind == "hum":
        base = rng.choice([50.0, 60.0]) * (1 + 1e-4 * rng.standard_normal())
        level = height * rng.choice([0.1, 1.0, 3.0])
        for m in range(1, int(rng.integers(2, 30))):
            if m * base < 0.45 * rate:
                out += level / m * np.sin(2 * np.pi * m * base * t + rng.uniform(0, 6.3))
    elif kind == "machine":
        level = height * rng.choice([0.03, 0.1, 0.3])
        turn = rng.uniform(5.0, 60.0)
        wander = 0.01 * np.cumsum(rng.standard_normal(n)) / np.sqrt(n)
        for m in rng.integers(1, 60, 6):
            if m * turn < 0.45 * rate:
                swell = 1 + 0.5 * np.sin(2 * np.pi * turn / 7 * t + rng.uniform(0, 6.3))
                out += level * swell * np.sin(2 * np.pi * m * turn * (t + wander))
        fan = coloured(rng, n, rate, 1.0)
        out += 0.5 * level * fan * (1 + 0.5 * np.sin(2 * np.pi * turn * t))
    elif kind == "1/f noise":
        out = height * rng.choice([0.1, 0.3, 1.0]) * coloured(rng, n, rate, rng.choice([1.5, 2.0]))
    elif kind == "room":
        time = 10 ** rng.uniform(-1.0, 0.2)
        k = np.arange(int(time * rate))
        room = rng.standard_normal(len(k)) * 10 ** (-3.0 * k / rate / time)
        room[: round(rng.uniform(1e-3, 6e-3) * rate)] = 0.0
        room *= rng.choice([0.3, 0.7, 1.0]) / np.sqrt(np.sum(room**2))
        out = signal.fftconvolve(x, room)[:n]
    elif kind == "speech":
        for start in rng.uniform(0, t[-1], max(3, int(t[-1] / 2))):
            size = int(rng.uniform(0.08, 0.4) * rate)
            first = int(start * rate)
            size = min(size, n - first)
            since = np.arange(size) / rate
            pitch = rng.uniform(90, 250) * (1 + 0.1 * np.sin(2 * np.pi * rng.uniform(2, 5) * since))
            pulses = np.diff(np.floor(np.cumsum(pitch) / rate), prepend=0.0)
            voice = pulses + 0.02 * rng.standard_normal(size)
            for formant in (rng.uniform(300, 800), rng.uniform(900, 2200), rng.uniform(2300, 3200)):
                voice = signal.lfilter(*signal.iirpeak(formant, 8, fs=rate), voice)[:] + 0.1 * voice
            voice *= np.sin(np.pi * (np.arange(size) + 0.5) / size) ** 0.7
            out[first : first + size] += (
                height * rng.choice([0.1, 0.3]) * voice / max(np.abs(voice).max(), 1e-9)
            )
    elif kind == "music":
        level = height * rng.choice([0.1, 0.3])
        at = 0.0
        while at < t[-1]:
            length = rng.uniform(0.2, 1.0)
            pick = (t >= at) & (t < at + length)
            since = t[pick] - at
            envelope = np.minimum(since / 0.05, 1) * np.minimum((length - since) / 0.08, 1)
            tone = 220 * 2 ** (rng.integers(0, 24) / 12)
            for m in (1, 2, 3, 4):
                if m * tone < 0.45 * rate:
                    out[pick] += level / m * envelope * np.sin(2 * np.pi * m * tone * since)
            at += length
    elif kind == "drift":
        out = height * rng.uniform(-20, 20) + height * rng.uniform(1, 10) * np.sin(
            2 * np.pi * t / rng.uniform(0.5, 20) + 1
        )
    return out


def changed(rng, x: np.ndarray, rate: float, height: float, noise: float, kind: str) -> np.ndarray:
    """What a disturbance makes of the samples, of noise of that standard deviation."""
    n = len(x)
    t = np.arange(n) / rate
    if kind == "gate":
        before, after = round(rng.uniform(5e-3, 0.05) * rate), round(rng.uniform(0.02, 0.2) * rate)
        size = before + after + 1
        near = ndimage.maximum_filter1d(np.abs(x), size, origin=(after - before) // 2)
        quiet = np.quantile(np.abs(x), 0.2) * rng.uniform(4.0, 8.0)
        x = np.where(near >= min(quiet, 0.3 * height), x, 0.0)
    elif kind == "codec":
        import soundfile

        if rng.random() < 0.3:
            corner = rng.uniform(0.3, 0.45) * rate
            return signal.sosfiltfilt(signal.butter(8, corner, fs=rate, output="sos"), x)
        file, top = io.BytesIO(), 1.1 * np.abs(x).max()
        name, subtype = CODECS[rng.integers(3)]
        soundfile.write(file, x / top, int(rate), format=name, subtype=subtype)
        file.seek(0)
        return top * soundfile.read(file)[0][:n]
    elif kind == "clipping":
        limit = max(height * rng.choice([0.1, 0.3, 1.0]), 4.0 * noise)
        x = np.clip(x, -limit, limit)
    elif kind == "gain":
        power = signal.lfilter(
            *signal.butter(1, 1 / (2 * np.pi * rng.uniform(0.1, 1.0)), fs=rate), x**2
        )
        power = np.maximum(power, 1e-3 * power.max())
        x = x * height / np.sqrt(power) ** rng.uniform(0.3, 0.9)
        x = x * (1 + 0.5 * np.sin(2 * np.pi * t / rng.uniform(2, 10)))
    elif kind == "clicks":
        at = rng.integers(0, n, max(3, int(t[-1] * rng.choice([0.5, 3.0]))))
        x = x.copy()
        x[at] += height * rng.uniform(0.5, 5, len(at)) * rng.choice([-1, 1], len(at))
    elif kind == "dropouts":
        x = x.copy()
        for start in rng.uniform(0, t[-1], 8):
            x[int(start * rate) : int((start + rng.uniform(1e-3, 0.05)) * rate)] = 0.0
    elif kind == "8 bit":
        step = max(np.abs(x).max(), 1e-9) * rng.choice([1.0, 4.0]) / 127
        x = step * np.round(x / step)
    return x
