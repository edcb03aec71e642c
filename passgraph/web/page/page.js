// The page of an exported effect: controls, input, zoom, and the value under the pointer.

import { load } from "./passgraph.js";
import { keyboard, sound } from "./signals.js";

/** @param {string} id @returns {any} */
const $ = (id) => document.getElementById(id);
/** @type {import("./passgraph.js").Program} */
let program;
/** @type {Record<string, any>} */
const values = {};
/** Pictures that change by themselves, by input. @type {Record<string, HTMLVideoElement>} */
const films = {};
/** Of an effect that reads them. @type {{ keyboard?: ReturnType<typeof keyboard>, audio?: ReturnType<typeof sound> }} */
const signals = {};
const view = { x: 0, y: 0, zoom: 0 };
/** The camera: radians to the right and up, and the factor of its distance, relative to the exported one. */
const orbit = { azimuth: 0, elevation: 0, distance: 1 };
let isPlaying = true, isDue = true, isBusy = false, last = 0, times = /** @type {number[]} */ ([]), pointer = /** @type {[number, number]|null} */ (null);

/** @param {unknown} error */
function fail(error) {
  $("error").textContent = error instanceof Error ? error.message : String(error);
  $("error").hidden = false;
  $("status").textContent = "Stopped";
  document.body.dataset.failed = "";
}

/** @param {string} tag @param {Record<string, any>} [set] @param {...(Node|string)} inner */
function element(tag, set = {}, ...inner) {
  const made = Object.assign(document.createElement(tag), set);
  made.append(...inner);
  return made;
}

// Parameters

/** @param {any} control @param {number} [part] @param {string} [label] */
function numberInputs(control, part, label) {
  const whole = control.kind === "int", given = part === undefined ? control.default : control.default[part];
  const low = control.low ?? Math.min(0, -2 * Math.abs(given)), high = control.high ?? Math.max(control.low === null ? 1 : control.low + 1, 4 * Math.abs(given));
  const step = whole ? 1 : (high - low) / 1000, name = label ?? control.name;
  const slider = element("input", { type: "range", min: low, max: high, step, value: given, id: `value-${name}` });
  const number = element("input", { type: "number", min: control.low ?? "", max: control.high ?? "", step: whole ? 1 : "any", value: given, ariaLabel: `${name}, number` });
  if (label) slider.ariaLabel = label;
  const change = (/** @type {any} */ from, /** @type {any} */ to) => () => {
    const set = from.valueAsNumber;
    if (!Number.isFinite(set) || !from.checkValidity()) return;
    to.value = from.value;
    if (part === undefined) values[control.name] = set;
    else values[control.name] = values[control.name].map((/** @type {number} */ one, /** @type {number} */ i) => i === part ? set : one);
    isDue = true;
  };
  slider.oninput = change(slider, number);
  number.oninput = change(number, slider);
  return element("div", { className: "inputs" }, slider, number);
}

/** @param {any} control */
function controlOf(control) {
  const unit = element("span", { className: "unit", textContent: control.unit }), help = element("p", { className: "help", textContent: control.help });
  const title = control.name.replaceAll("_", " ");
  if (Array.isArray(control.default)) {
    const letters = control.kind === "color" ? ["red", "green", "blue"] : ["x", "y", "z", "w"];
    const rows = control.default.map((/** @type {any} */ _, /** @type {number} */ i) => numberInputs(control, i, `${control.name} ${letters[i] ?? i}`));
    return element("fieldset", { className: "control" }, element("legend", { textContent: title }), ...rows, unit, help);
  }
  const label = element("label", { htmlFor: `value-${control.name}`, textContent: title }), head = element("div", { className: "head" }, label, unit);
  if (control.choices.length) {
    const select = element("select", { id: `value-${control.name}` }, ...control.choices.map((/** @type {[string, number]} */ [text, value]) => element("option", { textContent: text, value, selected: value === control.default })));
    select.onchange = () => { values[control.name] = Number(select.value); isDue = true; };
    return element("div", { className: "control" }, head, select, help);
  }
  if (control.kind === "bool") {
    const box = element("input", { type: "checkbox", id: `value-${control.name}`, checked: control.default });
    box.onchange = () => { values[control.name] = box.checked; isDue = true; };
    return element("div", { className: "control" }, element("div", { className: "inputs" }, box, label), help);
  }
  return element("div", { className: "control" }, head, numberInputs(control), help);
}

function showControls() {
  const { parameters, fixed, constants } = program.effect;
  for (const one of parameters) values[one.name] = one.default;
  $("controls").replaceChildren(...parameters.map(controlOf));
  $("reset").hidden = !parameters.length;
  const rows = [...Object.entries(fixed), ...constants.map((/** @type {string} */ name) => [name, "as exported"])];
  $("fixed").hidden = !rows.length;
  $("fixed-list").replaceChildren(...rows.flatMap(([name, value]) => [element("dt", { textContent: name.replaceAll("_", " ") }), element("dd", { textContent: value === null ? "chosen by the effect" : String(value) })]));
  $("parameters").hidden = !parameters.length && !rows.length;
}

// Input

/** @param {string} name @param {any} picture */
function take(name, picture) {
  /** @type {any} */ (films[name]?.srcObject)?.getTracks().forEach((/** @type {MediaStreamTrack} */ track) => track.stop());
  if (films[name]?.src) { films[name].pause(); URL.revokeObjectURL(films[name].src); }
  delete films[name];
  if (picture instanceof HTMLVideoElement) films[name] = picture;
  program.given[name] = picture;
  view.zoom = 0;
  isDue = true;
  $("camera").ariaPressed = String(Boolean(films[name]?.srcObject));
}

/** @param {Partial<HTMLVideoElement>} from */
async function film(from) {
  const video = element("video", { muted: true, loop: true, playsInline: true, ...from });
  await /** @type {HTMLVideoElement} */ (video).play();
  return video;
}

/** @param {File|undefined} file */
async function openFile(file) {
  if (!file) return;
  const src = file.type.startsWith("video/") && URL.createObjectURL(file);
  try {
    take($("input-name").value, src ? await film({ src }) : await createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" }));
    $("error").hidden = true;
  } catch { if (src) URL.revokeObjectURL(src); fail(`${file.name}: this browser cannot read it as a picture or video`); }
}

async function useCamera() {
  const name = $("input-name").value;
  if (films[name]?.srcObject) return take(name, card(program.effect.size));
  try { take(name, await film({ srcObject: await navigator.mediaDevices.getUserMedia({ video: true }) })); }
  catch (error) { fail(`The camera cannot be used: ${error instanceof Error ? error.message : error}`); }
}

/** A picture for inputs without one. @param {[number, number]} size */
function card([width, height]) {
  const canvas = new OffscreenCanvas(width, height), context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d"));
  for (let i = 0; i < 8; i++) for (let k = 0; k < 6; k++) {
    context.fillStyle = `hsl(${45 * i} ${20 * k}% ${12 + 14 * k}%)`;
    context.fillRect(Math.floor(i * width / 8), Math.floor(k * height / 6), Math.ceil(width / 8), Math.ceil(height / 6));
  }
  return canvas;
}

// Camera

/** Turn the camera to the right and up, and away; the runtime takes the nearest exported pose.
 *  @param {number} right @param {number} up @param {number} [factor] */
function turn(right, up, factor = 1) {
  const { elevations, distances } = program.effect.orbit, before = program.poseAt;
  orbit.azimuth += right;
  orbit.elevation = Math.min(Math.max(orbit.elevation + up, elevations[0]), elevations.at(-1));
  orbit.distance = Math.min(Math.max(orbit.distance * factor, distances[0]), distances.at(-1));
  program.pose(orbit);
  isDue ||= program.poseAt !== before;
}

// Look

const ratio = () => globalThis.devicePixelRatio || 1;
function fit() {
  const [width, height] = program.sizeOf($("target").value), { canvas } = look();
  view.zoom = Math.min(canvas.width / width, canvas.height / height);
  view.x = (width - canvas.width / view.zoom) / 2;
  view.y = (height - canvas.height / view.zoom) / 2;
}
/** @param {number} zoom @param {number} [x] @param {number} [y]  The point of the canvas that stays. */
function zoomTo(zoom, x = $("canvas").width / 2, y = $("canvas").height / 2) {
  const next = Math.min(Math.max(zoom, 1 / 64), 256);
  view.x += x / view.zoom - x / next;
  view.y += y / view.zoom - y / next;
  view.zoom = next;
  show();
}
function look() {
  const canvas = $("canvas"), [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side * ratio())));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  return { canvas, gain: 2 ** $("exposure").valueAsNumber, encode: $("encode").checked, ...view };
}
function show() {
  if (!program.frame) return;
  if (!view.zoom) fit();
  const { canvas, ...how } = look();
  program.draw(canvas, $("target").value, how);
}

/** Show the value of the texel under the pointer. */
async function showTexel() {
  if (!program.frame) return;
  const name = $("target").value, [width, height] = program.sizeOf(name);
  const at = pointer && /** @type {[number, number]} */ (pointer.map((place, i) => Math.floor((i ? view.y : view.x) + place * ratio() / view.zoom)));
  if (!at || at[0] < 0 || at[1] < 0 || at[0] >= width || at[1] >= height) return void ($("texel").textContent = `${name}: ${width} x ${height}`);
  const { data } = await program.read(name, [...at, 1, 1]);
  $("texel").textContent = `${name} (${at.join(", ")}): ${[...data].map((one) => Number(one.toPrecision(6))).join("  ")}`;
}

// Runs

/** @param {number} now  Milliseconds. */
async function tick(now) {
  requestAnimationFrame(tick);
  if (isBusy) return;
  const step = program.effect.frameTime ? 1000 * (values[program.effect.frameTime] ?? 0) : 0;
  const moves = isPlaying && (isAnimated() || Object.keys(films).length > 0 || Boolean(signals.audio?.isOn())) && now - last >= step - 4;
  if (!isDue && !moves) return;
  isBusy = true;
  isDue = false;
  last = now;
  try {
    const begin = performance.now();
    if (signals.audio?.isOn()) signals.audio.hear();
    program.run({ ...films, ...Object.fromEntries(Object.entries(signals).map(([name, { picture }]) => [name, picture])) }, values);
    if (signals.keyboard?.endFrame()) isDue = true;
    await program.device.queue.onSubmittedWorkDone();
    times = [...times.slice(-29), performance.now() - begin];
    show();
    const median = [...times].sort((a, b) => a - b)[times.length >> 1];
    $("status").textContent = `${program.size.join(" x ")}, ${median.toFixed(1)} ms a frame, frame ${program.frame}`;
    await showTexel();
    document.body.dataset.shown = String(program.frame);
  } catch (error) { fail(error); } finally { isBusy = false; }
}
const isAnimated = () => program.effect.history.length > 0 || program.steps.some((/** @type {any} */ step) => step.stages.some((/** @type {any} */ stage) => stage.values.some((/** @type {any} */ one) => one.value === "frame_index")));

// Keyboard and sound

/** @param {string|undefined} file */
function useSignals(file) {
  const { keyboard: keys, audio } = signals;
  $("keys").hidden = !keys;
  $("sound").hidden = !audio;
  if (keys) {
    const stage = $("stage"), isKept = (/** @type {KeyboardEvent} */ event) => event.key === "Tab" || event.key === "Escape" || event.ctrlKey || event.altKey || event.metaKey || /^F\d/.test(event.key);
    stage.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
      if (event.key === "Escape") stage.blur();
      if (isKept(event)) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      if (!event.repeat) { keys.set(event.keyCode, true); isDue = true; }
    }, { capture: true });
    stage.addEventListener("keyup", (/** @type {KeyboardEvent} */ event) => { keys.set(event.keyCode, false); isDue = true; });
    stage.addEventListener("blur", () => { keys.release(); isDue = true; });
  }
  if (!audio) return;
  let source = file;
  const shown = () => { $("hear").textContent = audio.isOn() ? "Stop the sound" : "Play the sound"; $("hear").ariaPressed = String(audio.isOn()); $("hear").hidden = !source && !audio.isOn(); isDue = true; };
  const begin = async (/** @type {() => Promise<void>} */ what, /** @type {string} */ failure) => {
    audio.stop();
    try { await what(); program.reset(); $("error").hidden = true; } catch (error) { fail(`${failure}: ${error instanceof Error ? error.message : error}`); }
    shown();
  };
  const play = () => begin(() => audio.play(source), "This browser cannot play the sound");
  $("hear").onclick = () => { if (audio.isOn()) { audio.stop(); shown(); } else play(); };
  $("open-sound").onclick = () => $("sound-file").click();
  $("sound-file").onchange = () => { const [one] = $("sound-file").files; if (one) { source = URL.createObjectURL(one); play(); } };
  $("microphone").onclick = () => begin(audio.listen, "The microphone cannot be used");
  shown();
}

async function save() {
  const { data, width, height, channels } = await program.read($("target").value), bytes = new Uint8ClampedArray(4 * width * height);
  for (let i = 0; i < width * height; i++) for (let c = 0; c < 4; c++) bytes[4 * i + c] = c === 3 ? (channels === 4 ? 255 * data[4 * i + 3] : 255) : 255 * data[channels * i + (channels < 3 ? Math.min(c, channels - 1) : c)];
  const canvas = new OffscreenCanvas(width, height);
  /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d")).putImageData(new ImageData(bytes, width, height), 0, 0);
  const link = element("a", { href: URL.createObjectURL(await canvas.convertToBlob()), download: `${$("target").value}.png` });
  link.click();
  URL.revokeObjectURL(link.href);
}

function listen() {
  const stage = $("stage"), redraw = () => { show(); showTexel().catch(fail); };
  $("open").onclick = () => $("file").click();
  $("file").onchange = () => openFile($("file").files[0]);
  $("camera").onclick = useCamera;
  $("reset").onclick = () => { showControls(); isDue = true; };
  $("target").onchange = () => { view.zoom = 0; redraw(); };
  $("exposure").oninput = () => { $("exposure-value").textContent = $("exposure").value; show(); };
  $("encode").onchange = show;
  $("fit").onclick = () => { view.zoom = 0; show(); };
  $("actual").onclick = () => zoomTo(1);
  $("save").onclick = () => save().catch(fail);
  $("play").onclick = () => { isPlaying = !isPlaying; if (!isPlaying) signals.audio?.element.pause(); $("play").ariaPressed = String(isPlaying); $("play").textContent = isPlaying ? "Pause" : "Play"; for (const one of Object.values(films)) isPlaying ? one.play() : one.pause(); };
  $("restart").onclick = () => { program.reset(); isDue = true; };
  const turns = (/** @type {MouseEvent} */ event) => Boolean(program.effect.orbit) && !event.altKey;
  stage.onwheel = (/** @type {WheelEvent} */ event) => {
    event.preventDefault();
    if (turns(event)) turn(0, 0, 2 ** (event.deltaY / 240));
    else zoomTo(view.zoom * 2 ** (-event.deltaY / 240), event.offsetX * ratio(), event.offsetY * ratio());
  };
  stage.onpointermove = (/** @type {PointerEvent} */ event) => {
    pointer = [event.offsetX, event.offsetY];
    if (event.buttons && turns(event)) turn(-event.movementX / 200, event.movementY / 200);
    else if (event.buttons) { view.x -= event.movementX * ratio() / view.zoom; view.y -= event.movementY * ratio() / view.zoom; show(); }
    showTexel().catch(fail);
  };
  stage.onpointerleave = () => { pointer = null; };
  stage.onkeydown = (/** @type {KeyboardEvent} */ event) => {
    const ways = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }), way = ways[event.key];
    if (way && event.ctrlKey && program.effect.orbit) { turn(0.1 * way[0], -0.1 * way[1]); event.preventDefault(); }
    else if (way) { view.x += way[0] * 32 / view.zoom; view.y += way[1] * 32 / view.zoom; show(); event.preventDefault(); }
    else if ("+=".includes(event.key)) zoomTo(view.zoom * 1.25);
    else if (event.key === "-") zoomTo(view.zoom / 1.25);
    else if (event.key === "0") $("fit").click();
  };
  document.ondragover = (event) => { event.preventDefault(); $("drop").hidden = $("input").hidden; };
  document.ondragleave = (event) => { if (!event.relatedTarget) $("drop").hidden = true; };
  document.ondrop = (event) => { event.preventDefault(); $("drop").hidden = true; if (!$("input").hidden) openFile(event.dataTransfer?.files[0]); };
  new ResizeObserver(() => { view.zoom = 0; show(); }).observe(stage);
}

try {
  program = await load("effect.json", undefined, { keep: true });
  Object.assign(globalThis, { program });
  program.device.lost.then((why) => fail(`The graphics device was lost: ${why.message || why.reason}. Load the page again.`));
  const { name, summary, inputs, size } = program.effect;
  document.title = $("name").textContent = name;
  $("summary").textContent = summary;
  for (const one of program.effect.signals) Object.assign(signals, { [one]: one === "keyboard" ? keyboard() : sound() });
  const pictures = Object.keys(inputs).filter((input) => !(input in signals));
  for (const [input, { data }] of Object.entries(inputs)) {
    if (input in signals) continue;
    if (!data && !program.given[input]) program.given[input] = card(size);
    $("input-name").append(element("option", { textContent: input }));
  }
  $("input").hidden = !pictures.length;
  $("input-row").hidden = pictures.length < 2;
  $("target").append(...program.targets.map((/** @type {string} */ one) => element("option", { textContent: one })));
  $("time").hidden = !isAnimated() && !Object.keys(inputs).length;
  useSignals(program.effect.sound ?? undefined);
  if (program.effect.orbit) $("stage").ariaLabel = "Picture: drag or Ctrl and arrows turn the camera, wheel changes its distance; with Alt they move and zoom the picture, 0 fits it";
  $("camera-help").hidden = !program.effect.orbit;
  showControls();
  listen();
  requestAnimationFrame(tick);
} catch (error) { fail(error); }
