"""Audio files: exact samples, types, parts, files cut short, codecs refused."""

import struct
import wave

import numpy as np
import pytest
import soundfile

import impactsig.io as io
from impactsig.errors import ImpactsigWarning, UnreadableFile

COUNTS = np.random.default_rng(1).integers(-(2**15), 2**15, (5000, 2)).astype(np.int16)

LOSSLESS = [
    ("WAV", "PCM_16", np.float32),
    ("WAV", "PCM_24", np.float64),
    ("WAV", "PCM_32", np.float64),
    ("WAV", "FLOAT", np.float32),
    ("WAV", "DOUBLE", np.float64),
    ("WAVEX", "PCM_16", np.float32),
    ("RF64", "PCM_16", np.float32),
    ("W64", "PCM_16", np.float32),
    ("AIFF", "PCM_16", np.float32),
    ("AIFF", "FLOAT", np.float32),
    ("FLAC", "PCM_16", np.float32),
    ("FLAC", "PCM_24", np.float64),
]


def write(path, container="WAV", codec="PCM_16", rate=50_000, samples=COUNTS / 32768):
    soundfile.write(str(path), samples, rate, format=container, subtype=codec)
    return path


def cut(path, share=0.6):
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    return path


@pytest.mark.parametrize(("container", "codec", "dtype"), LOSSLESS)
def test_samples_are_exact_and_parts_are_slices(tmp_path, container, codec, dtype):
    path = write(tmp_path / "name.without.meaning", container, codec)
    rec = io.read(path)
    assert (rec.rate, rec.samples.dtype, rec.truncated) == (50_000.0, dtype, False)
    np.testing.assert_array_equal(rec.samples, COUNTS / 32768)
    part = io.read(path, channel=1, start=0.01, stop=0.03)
    assert part.start == 0.01
    np.testing.assert_array_equal(part.samples, COUNTS[500:1500, 1] / 32768)
    assert io.info(path).format == ("WAV" if container == "WAVEX" else container)


@pytest.mark.parametrize(("codec", "rate"), [("VORBIS", 44_100), ("OPUS", 48_000)])
def test_parts_of_lossy_files_are_slices(tmp_path, codec, rate):
    path = write(tmp_path / "a.ogg", "OGG", codec, rate, np.zeros((20_000, 1)) + 0.1)
    rec = io.read(path)
    assert (len(rec), rec.samples.dtype) == (20_000, np.float32)
    part = io.read(path, start=0.1, stop=0.2)
    first = round(0.1 * rate)
    np.testing.assert_array_equal(part.samples, rec.samples[first : 2 * first])


@pytest.mark.parametrize("container", ["WAV", "WAVEX", "RF64", "W64", "AIFF"])
def test_a_file_shorter_than_its_header_says_is_told(tmp_path, container):
    whole = write(tmp_path / "a", container).stat().st_size
    path = cut(tmp_path / "a")
    missing = whole - path.stat().st_size  # the samples are the last of these files
    words = f"cut short: {missing} of the 20000 bytes of samples in its header are missing"
    assert io.info(path).truncated is True
    assert repr(io.info(path)).splitlines()[0].endswith(", TRUNCATED")
    with pytest.warns(ImpactsigWarning, match=words):
        rec = io.read(path)
    assert rec.truncated is True
    assert "TRUNCATED" in repr(rec)
    np.testing.assert_array_equal(rec.samples, COUNTS[: (20_000 - missing) // 4] / 32768)
    with pytest.warns(ImpactsigWarning, match=words):
        assert io.read_blocks(path).truncated is True
    # What is asked for may lie before the cut; the file lacks its end none the less.
    with pytest.warns(ImpactsigWarning, match=words):
        assert io.read(path, stop=0.01).truncated is True


def test_a_vorbis_file_without_its_last_page_is_told(tmp_path):
    noise = np.random.default_rng(0).uniform(-0.5, 0.5, 100_000)
    path = cut(write(tmp_path / "a.ogg", "OGG", "VORBIS", 44_100, noise))
    with pytest.warns(ImpactsigWarning, match="cut short: the last page of its stream is missing"):
        rec = io.read(path)
    assert rec.truncated is True
    assert 0 < len(rec) < 100_000


def test_a_flac_file_cut_short_is_an_error_but_its_beginning_can_be_read(tmp_path):
    samples = np.random.default_rng(0).uniform(-1, 1, 50_000)
    path = cut(write(tmp_path / "a.flac", "FLAC", samples=samples))
    with pytest.raises(UnreadableFile, match="cut short or corrupt") as caught:
        io.read(path)
    assert isinstance(caught.value.__cause__, soundfile.LibsndfileError)
    assert len(io.read(path, stop=0.2)) == 10_000


def test_a_wav_file_written_to_a_pipe_has_no_length_to_fall_short_of(tmp_path):
    path = write(tmp_path / "a.wav")
    content = bytearray(path.read_bytes())
    place = content.index(b"data") + 4
    content[place : place + 4] = b"\xff\xff\xff\xff"
    path.write_bytes(content)
    assert len(io.read(path)) == 5000


@pytest.mark.parametrize(
    ("container", "codec"),
    [
        ("WAV", "MS_ADPCM"),
        ("WAV", "IMA_ADPCM"),
        ("WAV", "ULAW"),
        ("W64", "IMA_ADPCM"),
        ("AIFF", "IMA_ADPCM"),
        ("AIFF", "ULAW"),
    ],
)
def test_compressed_codecs_are_refused_with_a_remedy(tmp_path, container, codec):
    path = write(tmp_path / "a.wav", container, codec)
    with pytest.raises(UnreadableFile, match=r"is compressed .*Convert it to PCM WAV or FLAC"):
        io.read(path)


def test_refused_codecs_never_reach_the_library(tmp_path, monkeypatch):
    path = write(tmp_path / "a.wav", "WAV", "MS_ADPCM")
    monkeypatch.setattr(soundfile, "SoundFile", None)
    with pytest.raises(UnreadableFile, match="codec 0x0002"):
        io.read(path)


def test_a_codec_is_found_behind_the_extensible_tag_too(tmp_path):
    content = bytearray(write(tmp_path / "a.wav", "WAVEX").read_bytes())
    subformat = content.index(b"fmt ") + 8 + 24
    assert content[subformat : subformat + 2] == b"\x01\x00"
    content[subformat] = 2
    (tmp_path / "a.wav").write_bytes(content)
    with pytest.raises(UnreadableFile, match="codec 0x0002"):
        io.read(tmp_path / "a.wav")


@pytest.mark.parametrize("rate", [8000, 22_050, 44_100, 48_000, 96_000])
def test_audio_at_an_audio_rate_is_sound_unless_it_has_a_unit(tmp_path, rate):
    path = write(tmp_path / "a.wav", rate=rate)
    assert io.read(path).sensor == io.read_blocks(path).sensor == "sound"
    assert io.read(path, unit="N").sensor == "force"
    assert io.read(path, sensor="force").sensor == "force"


def test_audio_at_a_measuring_rate_is_force(tmp_path):
    path = write(tmp_path / "a.wav", rate=51_200)
    assert io.read(path).sensor == "force"
    assert io.read(path, sensor="sound").sensor == "sound"
    assert io.read(path, rate=44_100).sensor == "sound"


@pytest.mark.parametrize("order", ["fmt first", "data first", "none"])
def test_chunks_in_impossible_order_are_an_error(tmp_path, order):
    fmt = b"fmt " + struct.pack("<IHHIIHH", 16, 1, 1, 8000, 16_000, 2, 16)
    data = b"data" + struct.pack("<I", 8) + bytes(8)
    body = {"fmt first": fmt + data, "data first": data + fmt, "none": fmt}[order]
    path = tmp_path / "a.wav"
    path.write_bytes(b"RIFF" + struct.pack("<I", 4 + len(body)) + b"WAVE" + body)
    if order == "fmt first":
        assert len(io.read(path)) == 4
    else:
        with pytest.raises(UnreadableFile, match="chunk"):
            io.read(path)


def test_a_file_without_samples_is_an_error(tmp_path):
    path = tmp_path / "a.wav"
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(8000)
    with pytest.raises(UnreadableFile, match="contains no samples"):
        io.read(path)


def test_what_would_not_fit_in_memory_is_offered_in_blocks(tmp_path):
    path = write(tmp_path / "a.flac", "FLAC")
    tight = io.Limits(size=10_000)
    with pytest.raises(UnreadableFile, match="read_blocks"):
        io.read(path, limits=tight)
    joined = np.concatenate([b.samples for b in io.read_blocks(path, 0.005, limits=tight)])
    np.testing.assert_array_equal(joined, COUNTS / 32768)
