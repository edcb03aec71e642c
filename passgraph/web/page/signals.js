// The keyboard and the sound as pictures, in the layout that Shadertoy gives them.

const KEYS = 256, BINS = 512;
/** @param {number} width @param {number} height */
const blank = (width, height) => ({ data: new Float32Array(width * height), width, height });

/** The state of each key, by `keyCode`. Rows from the top: toggled, pressed since the last frame, down. */
export function keyboard() {
  const picture = blank(KEYS, 3), { data } = picture;
  return {
    picture,
    /** @param {number} code @param {boolean} isDown */
    set(code, isDown) {
      if (code >= KEYS) return;
      if (isDown && !data[2 * KEYS + code]) { data[KEYS + code] = 1; data[code] = 1 - data[code]; }
      data[2 * KEYS + code] = Number(isDown);
    },
    release() { data.fill(0, 2 * KEYS); },
    /** Forget what was pressed; return true if that changes the next frame. */
    endFrame() {
      const changes = data.subarray(KEYS, 2 * KEYS).some(Boolean);
      data.fill(0, KEYS, 2 * KEYS);
      return changes;
    },
  };
}

/** A sound and its picture: the waveform in row 0, the spectrum in row 1. Browsers play it after a click only. */
export function sound() {
  const element = new Audio(), picture = blank(BINS, 2), bytes = new Uint8Array(BINS);
  element.loop = true;
  /** @type {AudioContext|undefined} */ let context;
  /** @type {AnalyserNode} */ let analyser;
  /** @type {MediaStreamAudioSourceNode|undefined} */ let microphone;
  /** Begin with the analysis, and with a context, which needs a click. */
  async function begin() {
    if (!context) {
      context = new AudioContext();
      analyser = context.createAnalyser();
      context.createMediaElementSource(element).connect(analyser);
      analyser.connect(context.destination);
    }
    await context.resume();
  }
  return {
    element, picture,
    isOn: () => Boolean(microphone) || !element.paused,
    /** Play a sound from its beginning. @param {string} [source] */
    async play(source) {
      await begin();
      if (source) element.src = source;
      element.currentTime = 0;
      await element.play();
    },
    async listen() {
      await begin();
      element.pause();
      const stream = await navigator.mediaDevices.getUserMedia({ audio: true });
      microphone = /** @type {AudioContext} */ (context).createMediaStreamSource(stream);
      analyser.disconnect();  // the speakers would be heard by the microphone
      microphone.connect(analyser);
    },
    stop() {
      element.pause();
      microphone?.mediaStream.getTracks().forEach((track) => track.stop());
      if (microphone) { microphone.disconnect(); analyser.connect(/** @type {AudioContext} */ (context).destination); }
      microphone = undefined;
      picture.data.fill(0);
    },
    /** Take the picture of the sound as it is now. */
    hear() {
      if (!analyser) return;
      analyser.getByteTimeDomainData(bytes);
      bytes.forEach((byte, i) => { picture.data[i] = byte / 255; });
      analyser.getByteFrequencyData(bytes);
      bytes.forEach((byte, i) => { picture.data[BINS + i] = byte / 255; });
    },
  };
}
