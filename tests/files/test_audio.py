"""Sound as pictures for shaders: against SciPy, against the AnalyserNode of Chromium, and in videos."""

from __future__ import annotations

import struct
import subprocess
import sys
import wave
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import fft, signal

import passgraph as pg
from passgraph.backends.webgpu.chromium import executable
from passgraph.commands.entry import run
from passgraph.files.audio import FFT_SIZE, SAMPLE_RATE, Audio
from passgraph.files.video import opened
from tests.files.made import video

av: Any = pytest.importorskip("av")
#: Columns of the two rows as a shader reads them: red has the spectrum, green the waveform.
READS = """#iChannel1 "audio"
void mainImage(out vec4 c, in vec2 f) {
    ivec2 at = ivec2(f);
    c = vec4(texelFetch(iChannel1, at, 0).x, texelFetch(iChannel1, at + ivec2(0, 1), 0).x, 0.0, 1.0);
}"""


def sound(path: Path, samples: NDArray[Any], rate: int = SAMPLE_RATE) -> Path:
    """Write samples, (count,) or (count, channels), as WAV of 16 bits."""
    columns = np.atleast_2d(samples.T).T
    with wave.open(str(path), "wb") as file:
        file.setnchannels(columns.shape[1])
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes(np.round(columns * 32767).astype("<i2").tobytes())
    return path


def sine(frequency: float, seconds: float, level: float = 0.05, rate: int = SAMPLE_RATE) -> NDArray[Any]:
    return level * np.sin(2 * np.pi * frequency * np.arange(round(seconds * rate)) / rate)


def tune() -> NDArray[Any]:
    """A second and a half of two tones that rise and fade, and noise."""
    t = np.arange(round(1.5 * SAMPLE_RATE)) / SAMPLE_RATE
    rising = np.sin(2 * np.pi * (300 * t + 900 * t**2)) * 0.2
    noise = np.random.default_rng(0).normal(size=len(t)) * 0.003
    return rising + sine(5000, 1.5, 0.1) * np.exp(-4 * t) + noise


def analysed(samples: NDArray[Any], step: float, count: int) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    """Spectrum and waveform of each frame, smoothed from the first one on, by SciPy."""
    before = np.concatenate([np.zeros(FFT_SIZE), samples, np.zeros(SAMPLE_RATE)])
    smoothed, rows = np.zeros(512), []
    for frame in range(count):
        block = before[round(frame * step * SAMPLE_RATE) :][:FFT_SIZE]
        magnitude = np.abs(fft.rfft(block * signal.get_window("blackman", FFT_SIZE)))[:512] / FFT_SIZE
        smoothed = 0.8 * smoothed + 0.2 * magnitude
        levels = 20 * np.log10(np.maximum(smoothed, 1e-30))
        spectrum = np.interp(levels, [-100, -30], [0, 255])
        rows.append((spectrum, np.clip(128 * (1 + block[:512]), 0, 255)))
    return rows


@pytest.mark.parametrize("bin", [40, 100, 400])
def test_a_sine_has_its_level_in_its_bin(tmp_path: Path, bin: int) -> None:
    """A window's mean is 0.42 and the amplitude of one side half: 20 log10(0.05 / 2 * 0.42) = -39.6 decibels."""
    audio = Audio(sound(tmp_path / "sine.wav", sine(bin * SAMPLE_RATE / FFT_SIZE, 4.0)))
    spectrum = audio.picture(100, 1 / 30)[1, :, 0]
    assert int(spectrum.argmax()) == bin
    assert spectrum[bin] == int(255 * (20 * np.log10(0.0105) + 100) / 70) == 220
    assert spectrum[: bin - 5].max(initial=0) <= 30  # quantization of the file, at its loudest
    assert spectrum[bin + 6 :].max(initial=0) <= 30


@pytest.mark.parametrize("step", [1 / 30, 1 / 25, 0.001])
def test_rows_are_those_of_scipy(tmp_path: Path, step: float) -> None:
    audio = Audio(sound(tmp_path / "tune.wav", tune()))
    for frame, (spectrum, waveform) in enumerate(analysed(audio.samples, step, 60)):
        seen = audio.picture(frame, step)[:, :, 0].astype(float)
        assert np.abs(seen[1] - np.floor(spectrum + 1e-6)).max() <= 1
        assert np.abs(seen[1] - spectrum).max() < 1.0 + 1e-6
        assert np.array_equal(seen[0], np.floor(waveform))


@pytest.mark.skipif(executable() is None, reason="Chromium is not installed")
def test_rows_are_those_of_an_analyser_node(tmp_path: Path) -> None:
    """The same samples in Chromium's OfflineAudioContext, at frames of eleven of its blocks."""
    from playwright.sync_api import sync_playwright

    audio, count, block = Audio(sound(tmp_path / "tune.wav", tune())), 40, 11 * 128
    code = """async ([samples, count, block]) => {
        const context = new OfflineAudioContext(1, samples.length, 44100), found = [];
        const buffer = context.createBuffer(1, samples.length, 44100);
        buffer.copyToChannel(new Float32Array(samples), 0);
        const source = new AudioBufferSourceNode(context, { buffer }), analyser = context.createAnalyser();
        source.connect(analyser).connect(context.destination);
        source.start();
        for (let frame = 1; frame < count; frame++)
            context.suspend(frame * block / 44100).then(() => {
                const spectrum = new Uint8Array(512), wave = new Uint8Array(512);
                analyser.getByteFrequencyData(spectrum); analyser.getByteTimeDomainData(wave);
                found.push([[...wave], [...spectrum]]);
                context.resume();
            });
        await context.startRendering();
        return found;
    }"""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable(), args=["--no-sandbox"])
        found = browser.new_page().evaluate(code, [audio.samples.tolist(), count, block])
        browser.close()
    assert len(found) == count - 1
    for frame, rows in enumerate(found, 1):
        seen = audio.picture(frame, block / SAMPLE_RATE)[:, :, 0].astype(int)
        assert np.abs(seen - np.array(rows)).max() <= 1
        assert np.mean(seen == np.array(rows)) > 0.99


def test_a_frame_does_not_depend_on_those_that_were_asked_before(tmp_path: Path) -> None:
    path = sound(tmp_path / "tune.wav", tune())
    played, sought = Audio(path), Audio(path)
    pictures = [played.picture(frame, 1 / 30) for frame in range(50)]
    assert np.array_equal(sought.picture(44, 1 / 30), pictures[44])
    assert not np.array_equal(pictures[43], pictures[44])
    # A later start is a later frame.
    assert np.array_equal(sought.picture(14, 1 / 32, start=0.5), played.picture(30, 1 / 32))


def test_silence_and_what_is_outside_of_the_file(tmp_path: Path) -> None:
    audio = Audio(sound(tmp_path / "silence.wav", np.zeros(SAMPLE_RATE)))
    short = Audio(sound(tmp_path / "short.wav", sine(1000, 0.5, 0.5)))
    for picture in (audio.picture(20, 1 / 30), short.picture(300, 1 / 30), short.picture(0, 1 / 30)):
        assert (picture[0] == 128).all()
        assert (picture[1] == 0).all()
    fading = [int(short.picture(frame, 1 / 30)[1, 46, 0]) for frame in range(16, 30)]
    assert fading == sorted(fading, reverse=True) and fading[0] > fading[-1]
    assert short.frame_count(30) == 15
    assert Audio(sound(tmp_path / "empty.wav", np.zeros(0))).frame_count(30) == 1


def test_channels_are_averaged_and_rates_converted(tmp_path: Path) -> None:
    left = sine(1000, 1.0, 0.4, 48000)
    stereo = Audio(sound(tmp_path / "stereo.wav", np.stack([left, 0 * left], axis=1), 48000))
    mono = Audio(sound(tmp_path / "mono.wav", sine(1000, 1.0, 0.2)))
    assert len(stereo.samples) == pytest.approx(SAMPLE_RATE, abs=2)
    inside = slice(1000, 40000)
    assert np.abs(stereo.samples[inside] - mono.samples[inside]).max() < 1e-3
    assert int(stereo.picture(20, 1 / 30)[1, :, 0].argmax()) == round(1000 * FFT_SIZE / SAMPLE_RATE) == 46


def late_sound(path: Path, samples: NDArray[np.int16], begin: int) -> Path:
    """PCM in Matroska, whose first packet is at a sample."""
    with av.open(str(path), "w") as container:
        pictures = container.add_stream("ffv1", rate=25)
        pictures.width, pictures.height, pictures.pix_fmt = 16, 16, "yuv420p"
        stream = container.add_stream("pcm_s16le", rate=SAMPLE_RATE, layout="mono")
        container.mux(pictures.encode(av.VideoFrame(16, 16, "yuv420p")))
        frame = av.AudioFrame.from_ndarray(samples[None], format="s16", layout="mono")
        frame.sample_rate, frame.pts = SAMPLE_RATE, begin
        for packet in (*stream.encode(frame), *stream.encode(None), *pictures.encode(None)):
            container.mux(packet)
    return path


def test_sound_of_a_video_begins_where_its_file_says(tmp_path: Path) -> None:
    samples = (sine(441, 0.5, 0.5) * 32767).astype(np.int16)
    read = Audio(late_sound(tmp_path / "late.mkv", samples, SAMPLE_RATE // 4)).samples
    assert not read[: SAMPLE_RATE // 4 - 50].any()
    np.testing.assert_allclose(read[-len(samples) :], samples / 32768, atol=1e-6)
    assert len(read) == pytest.approx(0.75 * SAMPLE_RATE, abs=50)


def test_what_is_no_sound_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(pg.InputError, match="has no sound; expected an audio file, or a video with sound"):
        Audio(video(tmp_path / "silent.mp4", 3))
    (tmp_path / "text.wav").write_text("no sound")
    with pytest.raises(pg.InputError, match=r"text.wav: cannot be read as a sound \("):
        Audio(tmp_path / "text.wav")
    with pytest.raises(pg.InputError, match=r"gone.wav"):
        Audio(tmp_path / "gone.wav")
    reader = tmp_path / "plain.glsl"
    reader.write_text("void mainImage(out vec4 c, in vec2 f) { c = vec4(f, 0.0, 1.0); }")
    assert run(["apply", str(reader), "--audio", str(tmp_path / "text.wav"), "-o", str(tmp_path / "a.png")]) == 2
    assert "No such option '--audio'" in capsys.readouterr().err


def test_a_sound_that_is_too_long_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = sound(tmp_path / "long.wav", np.zeros(61 * SAMPLE_RATE))
    monkeypatch.setattr("passgraph.files.audio.MOST_SECONDS", 60)
    with pytest.raises(pg.InputError, match=r"long.wav: is longer than 1 minutes; cut it"):
        Audio(path)
    late = late_sound(tmp_path / "late.mkv", np.ones(9, np.int16), 1_000_000 * SAMPLE_RATE)
    with pytest.raises(pg.InputError, match=r"late.mkv: is longer than 1 minutes; cut it"):
        Audio(late)


@pytest.mark.parametrize("rate", [1, 999, 768_001])
def test_a_rate_that_no_sound_has_is_told(tmp_path: Path, rate: int) -> None:
    path = sound(tmp_path / "odd.wav", np.zeros(500), rate)
    with pytest.raises(pg.InputError, match=f"odd.wav: has {rate} samples a second; expected 1000 to 768000; convert"):
        Audio(path)


@pytest.mark.parametrize("rate", [1000, 768_000])
def test_rates_at_the_limits_are_read(tmp_path: Path, rate: int) -> None:
    assert Audio(sound(tmp_path / "a.wav", np.zeros(rate), rate)).seconds == pytest.approx(1.0, abs=0.01)


def test_a_small_file_takes_little_memory(tmp_path: Path) -> None:
    """One block of 4000 bytes of IMA ADPCM, labeled 1 Hz, would last for two hours, and a FLAC frame for as long."""
    size = 4000
    format = struct.pack("<HHIIHHHH", 0x11, 1, 1, 1, size, 4, 2, (size - 4) * 2 + 1)
    chunks = b"WAVEfmt " + struct.pack("<I", len(format)) + format + b"data" + struct.pack("<I", size) + bytes(size)
    (tmp_path / "block.wav").write_bytes(b"RIFF" + struct.pack("<I", len(chunks)) + chunks)
    sound(tmp_path / "plain.wav", np.zeros(4 * 65535), 1000)
    with av.open(tmp_path / "plain.wav") as source, av.open(tmp_path / "frame.flac", "w") as made:
        stream = made.add_stream("flac", rate=1000)
        for frame in source.decode(audio=0):
            made.mux(stream.encode(frame))
        made.mux(stream.encode())
    data = bytearray((tmp_path / "frame.flac").read_bytes())
    data[18:20] = b"\x00\x00"  # 20 bits of the rate in STREAMINFO (RFC 9639, 8.2): 1 Hz
    data[20] = 0x10 | (data[20] & 0x0F)
    (tmp_path / "frame.flac").write_bytes(data)
    for name in ("block.wav", "frame.flac"):
        code = (
            f"import re, passgraph as pg; from passgraph.files import Audio\ntry: Audio({name!r})\n"
            "except pg.InputError as error: print(error)\n"
            "print(re.search(r'VmHWM:\\s*([0-9]+) kB', open('/proc/self/status').read())[1])"
        )
        told = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
        text, peak = told.stdout.strip().splitlines()
        assert text.startswith(f"{name}: is longer than 60 minutes") or "samples a second" in text
        assert int(peak) < 200 << 10  # KiB


def test_a_long_sound_is_not_decoded_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = sound(tmp_path / "long.wav", np.zeros(30 * SAMPLE_RATE))
    frames: list[Any] = []

    @contextmanager
    def spied(path: Path, what: str) -> Iterator[Any]:
        with opened(path, what) as container:
            decoded = (frames.append(frame) or frame for frame in container.decode(audio=0))
            yield SimpleNamespace(
                streams=container.streams, start_time=container.start_time, duration=None, decode=lambda _: decoded
            )

    monkeypatch.setattr("passgraph.files.audio.opened", spied)
    Audio(path)
    whole = len(frames)
    monkeypatch.setattr("passgraph.files.audio.MOST_SECONDS", 1)
    frames.clear()
    with pytest.raises(pg.InputError, match="is longer than"):
        Audio(path)
    assert len(frames) < whole / 10


def test_frames_of_apply_have_the_sound_of_their_time(tmp_path: Path) -> None:
    reads, path = tmp_path / "reads.glsl", sound(tmp_path / "tune.wav", tune())
    reads.write_text(READS)
    words = ["apply", str(reads), "--audio", str(path), "--size", "512x1", "-b", "numpy"]
    assert run([*words, "--frames", "4", "-o", str(tmp_path / "out.%04d.png")]) == 0
    audio = Audio(path)
    for frame in range(4):
        seen = np.round(pg.load(tmp_path / f"out.{frame + 1:04d}.png")[0] * 255)
        picture = audio.picture(frame, 1 / 30)[:, :, 0]
        assert np.array_equal(seen[:, 0], picture[1]) and np.array_equal(seen[:, 1], picture[0])
    assert run([*words[:2], *words[4:], "-o", str(tmp_path / "none.png")]) == 0
    assert not pg.load(tmp_path / "none.png")[..., :3].any()


def test_one_picture_has_the_sound_of_its_time(tmp_path: Path) -> None:
    reads, path = tmp_path / "reads.glsl", sound(tmp_path / "tune.wav", tune())
    reads.write_text(READS.replace("0.0, 1.0)", "0.0 * iTime, 1.0)"))
    words = ["apply", str(reads), "--audio", str(path), "--size", "512x1", "--time", "0.75"]
    assert run([*words, "-o", str(tmp_path / "one.png")]) == 0
    seen = np.round(pg.load(tmp_path / "one.png")[0] * 255)
    assert np.array_equal(seen[:, 0], Audio(path).picture(0, 1 / 30, 0.75)[1, :, 0])


@pytest.mark.parametrize("rate", [25, 10])
def test_a_video_lasts_as_long_as_its_sound_and_has_it(tmp_path: Path, rate: int) -> None:
    reads, path, out = tmp_path / "reads.glsl", sound(tmp_path / "tune.wav", tune()), tmp_path / "out.mkv"
    reads.write_text(READS)
    words = ["apply", str(reads), "--audio", str(path), "--size", "512x2", "--rate", str(rate), "--codec", "ffv1"]
    assert run([*words, "-o", str(out)]) == 0
    assert np.array_equal(Audio(out).samples, Audio(path).samples)
    with av.open(str(out)) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == np.ceil(1.5 * rate)
    for number in (3, len(frames) - 1):
        spectrum = Audio(path).picture(number, 1 / rate)[1, :, 0].astype(int)
        assert np.corrcoef(frames[number][1, :, 0], spectrum)[0, 1] > 0.9  # chroma is subsampled
    assert run([*words, "--frames", "5", "-o", str(out)]) == 0
    assert Audio(out).seconds == pytest.approx(5 / rate, abs=4096 / SAMPLE_RATE)  # packets of the file
    reads.write_text(READS.replace("0.0, 1.0)", "0.0 * iTime, 1.0)"))
    for without in (["--no-sound"], ["--time", "1"]):  # pictures of a later time would not fit the sound
        assert run([*words, *without, "-o", str(out)]) == 0
        with pytest.raises(pg.InputError, match="has no sound"):
            Audio(out)


def test_an_input_brings_its_sound(tmp_path: Path) -> None:
    """A sound for what reads no picture; a video for what reads pictures too, if it has sound."""
    reads, path, out = tmp_path / "reads.glsl", sound(tmp_path / "tune.wav", tune()), tmp_path / "out.mkv"
    reads.write_text(READS)
    assert run(["apply", str(reads), str(path), "--size", "512x2", "-o", str(out)]) == 0
    assert np.array_equal(Audio(out).samples, Audio(path).samples)
    both = tmp_path / "both.glsl"
    both.write_text(READS.replace("0.0, 1.0);", "texture(iChannel0, f / iResolution.xy).r, 1.0);"))
    assert run(["apply", str(both), str(out), "-o", str(tmp_path / "twice.%04d.png")]) == 0
    seen = np.round(pg.load(tmp_path / "twice.0031.png")[-1] * 255)
    assert np.array_equal(seen[:, 0], Audio(out).picture(30, 1 / 25)[1, :, 0])
    silent = video(tmp_path / "silent.mp4", 3)
    assert run(["apply", str(both), str(silent), "-o", str(tmp_path / "none.%04d.png")]) == 0
    assert not pg.load(tmp_path / "none.0003.png")[..., :2].any()


def test_a_picture_and_sound_make_a_video(tmp_path: Path) -> None:
    """The picture is the first channel, and repeated for the length of the sound."""
    reads, path = tmp_path / "reads.glsl", sound(tmp_path / "tune.wav", tune())
    reads.write_text(READS.replace("0.0, 1.0);", "texture(iChannel0, f / iResolution.xy).r, 1.0);"))
    pg.save(tmp_path / "in.png", np.full((4, 512, 4), 255, np.uint8))
    words = ["apply", str(reads), str(tmp_path / "in.png"), "--audio", str(path), "-o", str(tmp_path / "out.mkv")]
    assert run(words) == 0
    with av.open(str(tmp_path / "out.mkv")) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == 38
    assert frames[5][..., 2].min() > 200
