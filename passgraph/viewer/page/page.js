// The page of `passgraph view`: draw the pictures of the session, and send it the settings.
import { make, passParts, pixelParts, planParts } from "./debug.js";

const CHANNELS = ["color", "red", "green", "blue", "alpha", "luminance", "false color"];

// Show the page in a document or a shadow root that has its elements; return a function that ends it. `link` carries
// messages and files: see socket.js and widget.js.
export function showPage(root, link) {
  const $ = (id) => root.getElementById(id), frame = root.host ?? document.body;
  const stage = $("stage"), canvas = $("picture"), context = canvas.getContext("2d");
  let pictures = {}, showing = Promise.resolve(), state = {}, controls = [];
  let values = {}, history = [], zoom = 0, offset = [0, 0], steps = 0, restarts = 0, playing = false;
  let orbit = [0, 0, 1], split = 0.5, flickers = 0, drag = null, times = [], pointed = null, picked = null, texels = null, backendChosen = false, isFitted = true;

  const { send } = link, say = (text) => { $("status").textContent = text; };
  const ask = (changes) => { if (changes.look === undefined) unmask(); send({ kind: "ask", changes }); };

  function askAll() {
    const compare = { verdict: "", flicker: "both" }[$("compare").value] ?? $("compare").value;
    ask({
      values, target: $("target").value, look: look(), ...(backendChosen && { backend: $("backend").value }), playing, orbit,
      other: compare ? { kept: "file" }[$("other").value] ?? $("other").value : "", compare, gain: Number($("gain").value) || 1,
    });
    send({ kind: "ready" });
  }

  // Take a message, and the encoded pictures that it lists.
  function take(message, data = []) {
    if (message.kind === "state") {
      if (message.pictures.length) arrive(message, data);
      showState(message);
    } else if (message.kind === "values") showTexel(message);
    else if (message.kind === "statistics") showStatistics(message);
    else if (message.kind === "inspect") $("pixel").replaceChildren(...pixelParts(message, markTexels));
    else if (message.kind === "profile") $("plan").replaceChildren(...planParts(message, (name) => send({ kind: "code", name })));
    else if (message.kind === "code") showPass(message);
    else if (message.kind === "verdict") showVerdict(message);
    else if (message.kind === "keep") askAll();
    else if (message.kind === "refused") say(message.text);
  }

  // Pictures are shown in order. They are decoded while the last ones wait for the screen, and the next ones are requested
  // when these begin to be shown, so that the session computes meanwhile and at most one set is queued. They have no color
  // profile, so nothing is converted.
  function arrive({ number, pictures: slots }, data) {
    const decoded = slots.map(({ type }, k) => createImageBitmap(new Blob([data[k]], { type })));
    showing = showing.then(() => show({ number, slots, decoded })).catch(() => {});
  }

  async function show({ number, slots, decoded }) {
    send({ kind: "ready" });
    const bitmaps = await Promise.all(decoded);
    Object.values(pictures).forEach((bitmap) => bitmap.close());
    pictures = Object.fromEntries(slots.map(({ slot }, k) => [slot, bitmaps[k]]));
    draw();
    times.push(performance.now());
    times = times.filter((time) => time > performance.now() - 2000);
    frame.dataset.shown = number;
    if (slots[0].type === "image/png") send({ kind: "statistics" }); // PNG is sent once the picture no longer changes
    await new Promise(requestAnimationFrame);
  }

  // The picture

  function draw() {
    const first = pictures.a ?? pictures.b ?? pictures.difference ?? pictures.flip;
    if (!first) return;
    if (canvas.width !== first.width || canvas.height !== first.height) {
      canvas.width = first.width; canvas.height = first.height;
      fit();
    }
    const mode = $("compare").value;
    context.drawImage(mode === "flicker" && pictures.b && flickers % 2 ? pictures.b : first, 0, 0);
    if (mode === "both" && pictures.b) {
      const x = Math.round(canvas.width * split);
      context.drawImage(pictures.b, x, 0, canvas.width - x, canvas.height, x, 0, canvas.width - x, canvas.height);
      context.fillStyle = "#fff"; context.fillRect(x, 0, Math.max(1, 1 / zoom), canvas.height);
    }
  }
  const flicker = setInterval(() => { if ($("compare").value === "flicker") { flickers++; draw(); } }, 500);

  function place() {
    canvas.style.transform = `translate(${offset[0]}px, ${offset[1]}px) scale(${zoom})`;
    canvas.style.imageRendering = zoom >= 2 ? "pixelated" : "auto";
    Object.assign($("mask").style, { transform: canvas.style.transform, imageRendering: "pixelated" });
    drawMarks();
  }

  // Mark the chosen pixel, and the texels that it reads if their target is shown.
  function drawMarks() {
    const layer = $("marks"), pen = layer.getContext("2d");
    layer.width = stage.clientWidth; layer.height = stage.clientHeight;
    const box = ([x, y], color) => {
      const side = Math.max(zoom, 5), shift = (zoom - side) / 2;
      for (const [style, more] of [["#000", 1], [color, 0]]) {
        pen.strokeStyle = style;
        pen.strokeRect(offset[0] + x * zoom + shift - more, offset[1] + y * zoom + shift - more, side + 2 * more, side + 2 * more);
      }
    };
    if ($("pixel-panel").hidden) return;
    if (texels && texels.target === state.target) texels.at.forEach((at) => box(at, "#ffd400"));
    if (picked && picked.target === state.target) box(picked.at, "#ff4fa3");
  }

  function markTexels(read) {
    texels = read;
    $("target").value = read.target;
    ask({ target: read.target });
  }

  function fit() {
    isFitted = true;
    zoom = Math.min(stage.clientWidth / canvas.width, stage.clientHeight / canvas.height, 8) || 1;
    offset = [(stage.clientWidth - canvas.width * zoom) / 2, (stage.clientHeight - canvas.height * zoom) / 2];
    place();
  }
  const resized = new ResizeObserver(() => (isFitted ? fit() : place()));
  resized.observe(stage);

  function texelAt(event) {
    const box = stage.getBoundingClientRect();
    return [(event.clientX - box.left - offset[0]) / zoom, (event.clientY - box.top - offset[1]) / zoom].map(Math.floor);
  }
  const isInside = ([x, y]) => x >= 0 && y >= 0 && x < canvas.width && y < canvas.height;

  function showState(message) {
    const isOtherLight = message.light !== undefined && message.light !== Boolean(state.light);
    state = message;
    if (isOtherLight) { $("srgb").checked = message.light; ask({ look: look() }); }
    $("name").textContent = message.name;
    if (root === document) document.title = `${message.name} · passgraph`;
    $("error").hidden = !message.error;
    $("error").textContent = message.error;
    const { compile_ms = 0, run_ms = 0 } = message.times ?? {};
    const rate = times.length > 1 ? `, ${((times.length - 1) * 1000 / (times.at(-1) - times[0])).toFixed(0)} pictures/s` : "";
    const flip = message.flip === undefined ? "" : `  ·  mean FLIP ${message.flip.toPrecision(3)}`;
    const differs = message.differs ? `  ·  largest difference ${message.differs.largest.toPrecision(3)} at ${message.differs.at}, ${message.differs.pixels} pixels differ` : "";
    $("status").textContent = message.error ? "error" : `${message.target ?? ""} ${(message.size ?? []).join("×")} on ${message.backend ?? ""}: run ${run_ms.toFixed(1)} ms${compile_ms > 1 ? `, compile ${compile_ms.toFixed(0)} ms` : ""}${rate}${differs}${flip}`;
    if (!$("backend").length) {
      $("backend").append(...message.backends.map((name) => new Option(name)));
      $("other").options[0].after(...message.backends.slice(1).map((name) => new Option(name)));
    }
    if (message.backend && !backendChosen) $("backend").value = message.backend;
    if (message.controls) showControls(message.controls);
    if (message.targets) options($("target"), message.targets.map(({ name, format }) => [name, `${name}  ${format}`]), message.target);
    $("keys").hidden = !message.keyboard;
    $("frame").hidden = !(message.frames > 1);
    $("seek-label").hidden = message.frames > 1 || !message.moves;
    if (root.activeElement !== $("seek")) $("seek").value = message.frame;
    $("frame").max = (message.frames ?? 1) - 1;
    if (root.activeElement !== $("frame")) $("frame").value = message.frame;
    $("frame-number").textContent = message.frames > 1 ? `${message.frame + 1} / ${message.frames}` : "";
    drawMarks();
  }

  function options(select, pairs, chosen) {
    const text = JSON.stringify(pairs);
    if (select.dataset.pairs !== text) {
      select.dataset.pairs = text;
      select.replaceChildren(...pairs.map(([value, label]) => new Option(label, value)));
    }
    if (root.activeElement !== select) select.value = chosen;
  }

  // Parameters

  function showControls(list) {
    const text = JSON.stringify(list);
    if ($("controls").dataset.text === text) return;
    $("controls").dataset.text = text;
    controls = list;
    $("controls").replaceChildren(...list.map(controlOf));
    list.forEach(showValue);
  }

  function controlOf(control) {
    const box = document.createElement("div");
    box.className = "control"; box.id = `control-${control.name}`;
    const label = document.createElement("label");
    label.textContent = control.name.replaceAll("_", " "); label.htmlFor = `value-${control.name}`;
    const inputs = document.createElement("div");
    inputs.className = "inputs";
    const set = (value, done) => change(control.name, value, done);
    if (control.kind === "bool") inputs.append(make("input", { type: "checkbox", id: `value-${control.name}`, onchange: (e) => set(e.target.checked, true) }));
    else if (control.kind === "choice") {
      const select = make("select", { id: `value-${control.name}`, onchange: (e) => set(e.target.value, true) });
      select.append(...control.choices.map((word) => new Option(word, word)));
      inputs.append(select);
    } else if (control.kind === "stack") inputs.append(make("ol", { className: "stack" }));
    else if (control.kind === "text") inputs.append(make("input", { type: "text", id: `value-${control.name}`, onchange: (e) => set(e.target.value, true) }));
    else if (control.kind === "color" || control.kind === "vector") {
      const count = control.kind === "color" ? 3 : control.default.length;
      if (control.kind === "color") inputs.append(make("input", { type: "color", ariaLabel: `${control.name}, picked`, oninput: (e) => set(ofHex(e.target.value), false), onchange: (e) => set(ofHex(e.target.value), true) }));
      for (let k = 0; k < count; k++) inputs.append(make("input", {
        type: "number", step: "any", id: k ? `value-${control.name}-${k}` : `value-${control.name}`, ariaLabel: `${control.name} ${k + 1}`,
        oninput: () => set(numbersIn(inputs), false), onchange: () => set(numbersIn(inputs), true),
      }));
    } else {
      const step = control.kind === "int" ? 1 : "any", [low, high] = ends(control);
      const read = (e) => (control.kind === "int" ? Math.round(Number(e.target.value)) : Number(e.target.value));
      inputs.append(
        make("input", { type: "range", min: low, max: high, step, id: `value-${control.name}`, oninput: (e) => set(read(e), false), onchange: (e) => set(read(e), true) }),
        make("input", { type: "number", step, ariaLabel: control.name, onchange: (e) => set(read(e), true) }),
      );
      if (control.low !== null) inputs.lastChild.min = control.low;
      if (control.high !== null) inputs.lastChild.max = control.high;
    }
    if (control.unit) inputs.append(make("span", { className: "unit", textContent: control.unit }));
    box.append(label, inputs, make("p", { className: "help", textContent: control.help }));
    return box;
  }

  const numbersIn = (inputs) => [...inputs.querySelectorAll("input[type=number]")].map((e) => Number(e.value));
  const ofHex = (text) => [1, 3, 5].map((at) => Number((parseInt(text.slice(at, at + 2), 16) / 255).toFixed(4)));
  const toHex = (color) => `#${color.map((x) => Math.round(255 * Math.min(1, Math.max(0, x))).toString(16).padStart(2, "0")).join("")}`;

  // Return the two ends of a slider; an open end is placed at a multiple of the default.
  function ends(control) {
    const middle = control.default ?? 1, reach = Math.max(1, Math.abs(middle)) * 4;
    let low = control.low ?? middle - reach, high = control.high ?? middle + reach;
    if (high - low > 1e4 * Math.max(1, Math.abs(middle))) { low = Math.max(low, middle - reach * 8); high = Math.min(high, middle + reach * 8); }
    return [low, high];
  }

  function showValue(control) {
    const value = values[control.name] ?? control.default, box = $(`control-${control.name}`);
    if (!box) return;
    if (control.kind === "stack") return showStack(control, box.querySelector("ol"), value);
    const inputs = [...box.querySelectorAll("input, select")];
    if (control.kind === "bool") inputs[0].checked = Boolean(value);
    else if (control.kind === "color" || control.kind === "vector") {
      box.querySelectorAll("input[type=number]").forEach((input, k) => { if (root.activeElement !== input) input.value = value ? Number(value[k].toPrecision(7)) : ""; });
      if (control.kind === "color" && value) inputs[0].value = toHex(value);
    }
    else for (const input of inputs) if (root.activeElement !== input || input.type === "range") input.value = typeof value === "number" ? Number(value.toPrecision(7)) : value ?? "";
  }

  // Show the effects of a chain in their order: a switch and two arrows each. "-" is before the name of one that is off.
  function showStack(control, list, value) {
    const names = value.split(",").map((name) => name.trim()), active = root.activeElement?.getAttribute("aria-label");
    const set = (next) => change(control.name, next.join(", "), true);
    const swap = (k, other) => set(names.with(k, names[other]).with(other, names[k]));
    list.replaceChildren(...names.map((entry, k) => {
      const isOff = entry.startsWith("-"), name = entry.replace("-", isOff ? "" : "-"), item = make("li", {});
      const arrow = (sign, other, word) => make("button", { textContent: sign, ariaLabel: `${name} ${word}`, disabled: other < 0 || other >= names.length, onclick: () => swap(k, other) });
      const toggle = make("input", { type: "checkbox", checked: !isOff, onchange: () => set(names.with(k, isOff ? name : `-${name}`)) });
      const label = make("label", {});
      label.append(toggle, ` ${name}`);
      item.append(label, arrow("↑", k - 1, "earlier"), arrow("↓", k + 1, "later"));
      return item;
    }));
    if (active) [...list.querySelectorAll("button")].find((button) => button.ariaLabel === active)?.focus();
  }

  let valuesBefore = null;
  function change(name, value, done) {
    valuesBefore ??= { ...values };
    values = { ...values, [name]: value };
    if (done) { history.push(valuesBefore); valuesBefore = null; $("undo").disabled = false; }
    showValue(controls.find((control) => control.name === name));
    ask({ values });
  }

  function setValues(next) {
    history.push(values); values = next;
    $("undo").disabled = false;
    controls.forEach(showValue);
    ask({ values });
  }

  $("undo").onclick = () => { values = history.pop() ?? {}; $("undo").disabled = !history.length; controls.forEach(showValue); ask({ values }); };
  $("reset").onclick = () => setValues({});
  $("copy-command").onclick = () => copy(state.command);
  $("copy-python").onclick = () => copy(`{${Object.entries(values).map(([name, value]) => `"${name}": ${python(value)}`).join(", ")}}`);
  const python = (value) => (value === true ? "True" : value === false ? "False" : Array.isArray(value) ? `(${value.join(", ")})` : JSON.stringify(value));
  async function copy(text) {
    try { await navigator.clipboard.writeText(text); } catch { /* no permission: the text is shown, to be copied by hand */ }
    say(text);
  }
  $("preset-save").onclick = () => {
    make("a", { href: `data:application/json,${encodeURIComponent(JSON.stringify(values, null, 2))}`, download: `${state.name}.json` }).click();
  };
  $("preset-open").onclick = () => $("preset-load").click();
  chosen("preset-load", async (file) => {
    try { setValues(JSON.parse(await file.text())); } catch { say("that file is no preset: expected a JSON object of values by name"); }
  });
  function chosen(id, use) {
    $(id).onchange = async () => { if ($(id).files.length) await use($(id).files[0]); $(id).value = ""; };
  }

  // Look

  options($("channel"), CHANNELS.map((word) => [word, word]), "color");
  function look() {
    const low = Number($("low").value), high = Number($("high").value);
    return { channel: $("channel").value, exposure: Number($("exposure").value), low, high: high === low ? low + 1e-6 : high, srgb: $("srgb").checked, mark: $("mark").checked };
  }
  for (const id of ["channel", "exposure", "low", "high", "srgb", "mark"]) $(id).oninput = () => { $("exposure-value").textContent = $("exposure").value; ask({ look: look() }); };
  let fitsRange = false;
  $("auto").onclick = () => { fitsRange = true; send({ kind: "statistics" }); };
  $("look-reset").onclick = () => { $("channel").value = "color"; $("exposure").value = 0; $("low").value = 0; $("high").value = 1; $("srgb").checked = Boolean(state.light); $("exposure-value").textContent = "0"; ask({ look: look() }); };
  function showStatistics(statistics) {
    if (statistics.low === undefined) return;
    $("statistics").textContent = `${statistics.low.toPrecision(5)} to ${statistics.high.toPrecision(5)}; ${statistics.nan} texels NaN, ${statistics.infinite} infinite`;
    const chart = $("histogram").getContext("2d"), most = Math.max(1, ...statistics.histogram.flat());
    chart.clearRect(0, 0, 256, 64); chart.globalCompositeOperation = "lighter";
    statistics.histogram.forEach((bins, k) => {
      chart.fillStyle = statistics.histogram.length === 1 ? "#aaa" : ["#c33", "#3a3", "#44f"][k];
      bins.forEach((count, bin) => { const tall = 64 * Math.sqrt(count / most); chart.fillRect(bin * 4, 64 - tall, 4, tall); });
    });
    if (!fitsRange) return;
    fitsRange = false;
    $("low").value = Number(statistics.low.toPrecision(6)); $("high").value = Number(statistics.high.toPrecision(6));
    ask({ look: look() });
  }

  // Targets, backends, comparison, time

  $("target").onchange = () => ask({ target: $("target").value });
  $("backend").onchange = () => { backendChosen = true; askAll(); };
  for (const id of ["compare", "other", "gain"]) $(id).onchange = () => {
    const mode = $("compare").value;
    $("other-label").hidden = !mode || mode === "verdict"; $("gain-label").hidden = mode !== "difference";
    if (id === "other" && $("other").value === "file") return $("reference").click();
    if (id === "other" && $("other").value === "kept") return send({ kind: "keep" });
    askAll();
    if (mode === "verdict") { say("looking for the bounds of each pixel"); send({ kind: "verdict" }); }
  };
  chosen("reference", async (file) => { if (await put("reference", file)) askAll(); });
  function showVerdict(verdict) {
    say(verdict.text);
    if (!verdict.mask || $("compare").value !== "verdict") return;
    Object.assign($("mask"), { src: `data:image/png;base64,${verdict.mask}`, alt: verdict.text, hidden: false });
  }
  function unmask() {
    if ($("mask").hidden) return;
    $("mask").hidden = true;
    if ($("compare").value === "verdict") $("compare").value = "";
  }
  function play(on) { playing = on; $("play").setAttribute("aria-pressed", on); $("play").textContent = on ? "❚❚" : "▶"; ask({ playing }); send({ kind: "ready" }); }
  $("play").onclick = () => play(!playing);
  $("step").onclick = () => ask({ steps: ++steps });
  $("restart").onclick = () => ask({ restarts: ++restarts });
  for (const id of ["frame", "seek"]) $(id).oninput = () => ask({ frame: Number($(id).value) });
  $("profile").onclick = () => { $("plan").textContent = "measuring"; send({ kind: "profile" }); };
  function showPass(pass) {
    $("pass").replaceChildren(...passParts(pass));
    $("pass").scrollIntoView({ block: "nearest" });
    if (pass.target) { $("target").value = pass.target; ask({ target: pass.target }); }
  }

  // Save and record

  $("save").onclick = () => download("save", { as: $("save-as").value }, $("save-as").value.replace(/\d+$/, ""), "saved");
  $("record").onclick = async () => {
    const query = { first: $("record-first").value, last: $("record-last").value, rate: $("record-rate").value, as: $("record-as").value };
    $("record").disabled = true; say("recording");
    await download("record", query, query.as, "recorded");
    $("record").disabled = false;
  };
  async function download(what, query, suffix, done) {
    try {
      const file = make("a", { href: URL.createObjectURL(await link.get(what, query)), download: `${state.name}.${suffix}` });
      file.click(); URL.revokeObjectURL(file.href);
      say(done);
    } catch (error) { say(error.message); }
  }

  // Pointer and keys

  stage.addEventListener("wheel", (event) => {
    // In a cell the wheel scrolls the notebook, until the picture is clicked.
    if (root.host && root.activeElement !== stage && !event.ctrlKey) return;
    event.preventDefault();
    const box = stage.getBoundingClientRect(), at = [event.clientX - box.left, event.clientY - box.top];
    zoomBy(2 ** (-event.deltaY / 300), at);
  }, { passive: false });
  function zoomBy(factor, at) {
    const next = Math.min(64, Math.max(0.05, zoom * factor));
    offset = offset.map((value, k) => at[k] - (at[k] - value) * next / zoom);
    zoom = next; isFitted = false; place();
  }
  stage.addEventListener("pointerdown", (event) => { drag = { x: event.clientX, y: event.clientY, offset: [...offset], orbit: [...orbit], moved: false, mouse: !event.altKey && controls.some(({ name }) => name === "iMouse") ? texelAt(event) : null, split: $("compare").value === "both" && event.shiftKey }; stage.setPointerCapture(event.pointerId); });
  stage.addEventListener("pointermove", (event) => {
    const at = texelAt(event);
    if (isInside(at)) point(at);
    if (!drag) return;
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    if (Math.abs(dx) + Math.abs(dy) > 3) drag.moved = true;
    if (!drag.moved) return;
    if (drag.split) { split = Math.min(1, Math.max(0, at[0] / canvas.width)); draw(); }
    else if (drag.mouse) moveMouse(at, drag.mouse, 1);
    else if (state.camera && !event.altKey) turn(drag.orbit[0] - dx / 200, drag.orbit[1] + dy / 200);
    else { offset = [drag.offset[0] + dx, drag.offset[1] + dy]; isFitted = false; place(); }
  });
  stage.addEventListener("pointerup", (event) => {
    const at = texelAt(event);
    if (drag && !drag.moved && isInside(at)) lookInto(at);
    else if (drag?.moved && drag.mouse) moveMouse(at, drag.mouse, -1);
    drag = null;
  });
  function turn(right, up) { orbit = [right, up, orbit[2]]; ask({ orbit }); }
  function point(at) { pointed = at; send({ kind: "values", x: at[0], y: at[1] }); hover(at); }
  // Keys of a shader that reads the keyboard, while the picture has the focus. Esc and Tab leave it, and the page and the
  // browser keep combinations with Ctrl, Alt and Meta, and the function keys.
  const keysDown = new Set();
  function key(code, down) {
    if (down) keysDown.add(code); else keysDown.delete(code);
    send({ kind: "key", code, down });
  }
  stage.addEventListener("keydown", (event) => {
    if (!state.keyboard || event.key === "Tab") return;
    event.stopImmediatePropagation();
    if (event.key === "Escape") { closePixel(); stage.blur(); return; }
    if (!event.repeat && event.keyCode < 256) key(event.keyCode, true);
    if (!event.ctrlKey && !event.altKey && !event.metaKey && !/^F\d/.test(event.key)) event.preventDefault();
  });
  stage.addEventListener("keyup", (event) => { if (keysDown.has(event.keyCode)) key(event.keyCode, false); });
  const releaseKeys = () => keysDown.forEach((code) => key(code, false));
  stage.addEventListener("blur", releaseKeys);
  // Keys that act as the pointer; only while the picture has the focus, since arrows move sliders and cursors elsewhere.
  const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  stage.addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key], middle = [stage.clientWidth / 2, stage.clientHeight / 2];
    if (arrow && event.altKey) { offset = offset.map((value, k) => value - 40 * arrow[k]); isFitted = false; place(); }
    else if (arrow && event.ctrlKey && state.camera) turn(orbit[0] + 0.1 * arrow[0], orbit[1] - 0.1 * arrow[1]);
    else if (arrow) {
      const far = event.shiftKey ? 10 : 1, ends = [canvas.width - 1, canvas.height - 1];
      point(pointed ? pointed.map((value, k) => Math.min(ends[k], Math.max(0, value + far * arrow[k]))) : ends.map((end) => end >> 1));
    } else if (event.key === "Enter" && pointed && isInside(pointed)) lookInto(pointed);
    else if (event.key === "+" || event.key === "=") zoomBy(Math.SQRT2, middle);
    else if (event.key === "-") zoomBy(Math.SQRT1_2, middle);
    else if (event.key === "[" || event.key === "]") { split = Math.min(1, Math.max(0, split + (event.key === "[" ? -0.05 : 0.05))); draw(); }
    else return;
    event.preventDefault();
  });
  function lookInto(at) {
    picked = { at, target: state.target }; texels = null;
    $("pixel-panel").hidden = false; $("pixel").textContent = `computing the lines of (${at})`;
    drawMarks();
    send({ kind: "inspect", x: at[0], y: at[1] });
  }
  // Set Shadertoy's iMouse: the position in pixels from the bottom left, then that of the button press, negative after its
  // release.
  function moveMouse([x, y], [startX, startY], sign) {
    change("iMouse", [x + 0.5, canvas.height - y - 0.5, sign * (startX + 0.5), sign * (canvas.height - startY - 0.5)], sign < 0);
  }
  function hover([x, y]) {
    const box = $("hover");
    box.style.display = zoom >= 6 ? "block" : "none";
    Object.assign(box.style, { left: `${offset[0] + x * zoom}px`, top: `${offset[1] + y * zoom}px`, width: `${zoom}px`, height: `${zoom}px` });
  }
  function showTexel({ x, y, values: texels }) {
    const text = Object.entries(texels).map(([slot, numbers]) => `${slot === "b" ? "  other " : ""}${numbers.map((n) => (typeof n === "number" ? Number(n.toPrecision(7)) : n)).join("  ")}`);
    $("texel").textContent = `(${x}, ${y})  ${text.join("  |")}`;
  }
  root.addEventListener("keydown", (event) => {
    if (event.target.matches("input, select, textarea, button, summary, a") && event.key !== "Escape") return;
    if (event.key === "Escape") closePixel();
    else if (event.key === " ") { event.preventDefault(); play(!playing); }
    else if (event.key === ".") $("step").click();
    else if (event.key === "Home") $("restart").click();
    else if (event.key === "f") fit();
    else if (event.key === "1") { zoom = 1; offset = [0, 0]; isFitted = false; place(); }
    else if (event.key === "z" && (event.ctrlKey || event.metaKey)) $("undo").click();
  });

  function closePixel() { $("pixel-panel").hidden = true; drawMarks(); }
  $("pixel-close").onclick = closePixel;

  // Dropped and uploaded files

  stage.addEventListener("dragover", (event) => { event.preventDefault(); $("drop").hidden = false; });
  stage.addEventListener("dragleave", () => { $("drop").hidden = true; });
  stage.addEventListener("drop", async (event) => {
    event.preventDefault(); $("drop").hidden = true;
    if (event.dataTransfer.files.length) await put("input", event.dataTransfer.files[0]);
  });
  $("input-open").onclick = () => $("input-file").click();
  chosen("input-file", (file) => put("input", file));
  async function put(use, file) {
    try { await link.put(use, file); } catch (error) { say(error.message); return false; }
    say(`${use}: ${file.name}`);
    return true;
  }

  link.open({ take, say, opened() { say("connected"); askAll(); } });
  return () => { clearInterval(flicker); resized.disconnect(); };
}
