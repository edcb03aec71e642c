"""The sound of a file as pictures for shaders: spectrum and waveform, as the Web Audio API's ``AnalyserNode``."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import lru_cache
from itertools import chain
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import InputError, reason
from passgraph.files.video import import_av, opened
from passgraph.shaders.containers.signals import SIGNALS

#: Samples a second to which sounds are converted; Shadertoy's ``iSampleRate``.
SAMPLE_RATE = 44100
#: Longest sound in seconds; an hour takes 635 MB.
MOST_SECONDS = 3600
#: Samples a second of a file: at fewer, one small block would last for hours. AudioBuffer has 3000 to 768000.
LEAST_SAMPLE_RATE, MOST_SAMPLE_RATE = 1000, 768_000
#: Samples of a Fourier transform, weight of the frame before, and the levels in decibels of the bytes 0 and 255:
#: ``fftSize``, ``smoothingTimeConstant``, ``minDecibels`` and ``maxDecibels`` of an AnalyserNode, by default.
FFT_SIZE, SMOOTHING, MIN_DB, MAX_DB = 2048, 0.8, -100.0, -30.0
#: Most frames a second, and largest number of a frame.
MOST_RATE, MOST_FRAMES = 1e4, 1 << 31
#: Frames that are smoothed over; the weight of earlier ones is below one in 10^9.
_FRAMES = 96
_PHASE = 2.0 * np.pi * np.arange(FFT_SIZE) / FFT_SIZE
#: Blackman window of the Web Audio API.
_WINDOW = 0.42 - 0.5 * np.cos(_PHASE) + 0.08 * np.cos(2.0 * _PHASE)
_BINS = SIGNALS["audio"][0]


class Audio:
    """The first sound of an audio or video file, as the picture that Shadertoy gives to shaders for each frame.

    Channels are averaged. Before the file begins and after it ends there is silence.

    Parameters
    ----------
    path : the file; it is decoded at once

    Attributes
    ----------
    path : the file
    samples : float32, `SAMPLE_RATE` a second
    seconds : the duration

    Raises
    ------
    InputError : the file is missing, has no sound, is longer than an hour, has fewer than 1000 or more than 768000
        samples a second, or PyAV is not installed.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = arguments.path(path, "a sound")
        self.samples = decoded(self.path)
        self.seconds = len(self.samples) / SAMPLE_RATE
        # A frame needs the magnitudes of those before it, so consecutive frames compute one each.
        self._magnitudes = lru_cache(4 * _FRAMES)(self._magnitudes_until)

    def frame_count(self, rate: float) -> int:
        """Return the number of frames that the sound lasts at a rate, at least 1.

        Parameters
        ----------
        rate : frames a second
        """
        return max(1, ceil(self.seconds * arguments.real(rate, "frames a second", 0.0, MOST_RATE, above=True)))

    def picture(self, frame: int, step: float, start: float = 0.0) -> NDArray[np.uint8]:
        """Return the picture of a frame, (2, 512, 1): row 0 has the waveform, row 1 the spectrum.

        Shaders count rows from the bottom, so they find the spectrum in row 0. Both are of the 2048 samples before the
        frame; the waveform is of the first 512 of them.

        Parameters
        ----------
        frame : the number, from 0
        step : seconds from frame to frame; spectra are smoothed over frames
        start : seconds at frame 0
        """
        arguments.whole_number(frame, "frame of a sound", -MOST_FRAMES, MOST_FRAMES)
        step, start = (arguments.real(time, "time of a sound", -1e6, 1e6) for time in (step, start))
        # In the order of time, so that the result is the same whatever was computed before.
        first = frame - _FRAMES + 1
        smoothed = np.zeros(_BINS)
        for number in range(first, frame + 1):
            end = round((start + number * step) * SAMPLE_RATE)
            smoothed = SMOOTHING * smoothed + (1.0 - SMOOTHING) * self._magnitudes(end)
        with np.errstate(divide="ignore"):
            decibels = 20.0 * np.log10(smoothed)
        spectrum = 255.0 / (MAX_DB - MIN_DB) * (decibels - MIN_DB)
        wave = 128.0 * (1.0 + self._until(end)[:_BINS])
        rows = np.floor(np.clip(np.stack([wave, spectrum]), 0.0, 255.0))
        return rows.astype(np.uint8)[:, :, np.newaxis]

    def _until(self, end: int) -> NDArray[np.float64]:
        """Return `FFT_SIZE` samples before a sample, silence outside of the file."""
        samples = np.zeros(FFT_SIZE)
        begin = end - FFT_SIZE
        low, high = max(begin, 0), min(end, len(self.samples))
        if low < high:
            samples[low - begin : high - begin] = self.samples[low:high]
        return samples

    def _magnitudes_until(self, end: int) -> NDArray[np.float64]:
        spectrum = np.fft.rfft(self._until(end) * _WINDOW)[:_BINS]
        magnitudes: NDArray[np.float64] = np.abs(spectrum) / FFT_SIZE
        return magnitudes


def has_sound(path: Path) -> bool:
    """Return True if a video has sound."""
    with opened(path) as container:
        return bool(container.streams.audio)


def decoded(path: Path) -> NDArray[np.float32]:
    """Return the samples of a file's first sound, the mean of its channels, `SAMPLE_RATE` a second."""
    with opened(path, "a sound") as container:
        if not container.streams.audio:
            raise InputError(f"{path}: has no sound; expected an audio file, or a video with sound")
        if (container.duration or 0) / 1e6 > MOST_SECONDS:
            raise _too_long(path)
        samples = bytearray()  # grows in place; joined blocks would take twice the memory
        try:
            for block in _blocks(path, container):
                samples += block.data
        except import_av(path).error.FFmpegError as error:
            raise InputError(f"{path}: cannot be decoded as sound ({reason(error)}); make or copy it again") from error
    return np.frombuffer(samples, np.float32)


def _blocks(path: Path, container: Any) -> Iterator[NDArray[np.float32]]:
    """Yield the samples in blocks, the first of them silence if the sound begins after the file does."""
    # Packed samples, since PyAV 18.1 cannot convert planar frames of many channels.
    resampler = import_av(path).AudioResampler(format="flt", rate=SAMPLE_RATE)
    begin, count, seconds = (container.start_time or 0) / 1e6, 0, 0.0
    for frame in chain(container.decode(container.streams.audio[0]), (None,)):
        if frame is not None:  # before it is converted: a file may say one rate, and its frames another
            rate = frame.sample_rate
            if not LEAST_SAMPLE_RATE <= rate <= MOST_SAMPLE_RATE:
                expected = f"expected {LEAST_SAMPLE_RATE} to {MOST_SAMPLE_RATE}"
                raise InputError(f"{path}: has {rate} samples a second; {expected}; convert it to 44100")
            seconds += frame.samples / rate
            if seconds > MOST_SECONDS:
                raise _too_long(path)
        for converted in resampler.resample(frame):
            samples = converted.to_ndarray().reshape(-1, len(converted.layout.channels))
            block = np.nan_to_num(samples.mean(axis=1, dtype=np.float32))
            late = converted.time - begin if count == 0 and converted.time is not None else 0.0
            silence = round(max(late, 0.0) * SAMPLE_RATE)
            count += silence + len(block)
            if count > MOST_SECONDS * SAMPLE_RATE:
                raise _too_long(path)
            yield np.zeros(silence, np.float32)
            yield block


def _too_long(path: Path) -> InputError:
    return InputError(f"{path}: is longer than {MOST_SECONDS // 60} minutes; cut it")
