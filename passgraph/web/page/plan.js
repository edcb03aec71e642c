// The plan of an effect: checks of effect.json, sizes of pictures, and numbers as WebGPU stores them.

/** @typedef {[number, number]} Size  Width and height in pixels. */
/** @typedef {{at: number, bytes: number}} Part  A part of effect.bin. */
/** @typedef {Uint8Array|Uint8ClampedArray|Uint16Array|Float32Array} Numbers */
/** @typedef {{data: Numbers, width: number, height: number}} Raw  Numbers row by row, the top row first. */

const VERSION = 1, MAX_SIDE = 32768, MAX_BYTES = 2 ** 31, DEEPEST = 64;
const TEXELS = { uint8: 1, float16: 2, float32: 4 };
const KINDS = { float: "setFloat32", int: "setInt32", uint: "setUint32", bool: "setInt32" };

/** What is wrong with an effect, a picture or a value. */
export class EffectError extends Error { name = "EffectError"; }

/** @param {unknown} value */
const shown = (value) => (JSON.stringify(value) ?? String(value)).slice(0, 60);
/** @returns {never} @param {string} where @param {string} expected @param {unknown} got */
const wrong = (where, expected, got) => {
  throw new EffectError(`effect.json: ${where}: expected ${expected}, got ${shown(got)}. Export the effect again.`);
};
/** @param {any} value @param {string} where @param {number} low @param {number} high */
const whole = (value, where, low, high) =>
  Number.isInteger(value) && value >= low && value <= high ? value : wrong(where, `a whole number from ${low} to ${high}`, value);
/** @param {any} value @param {string} where @param {any[]} known */
const index = (value, where, known) =>
  known.length ? whole(value, where, 0, known.length - 1) : wrong(where, "nothing to refer to", value);
/** @param {any} value @param {string} where @returns {any[]} */
const list = (value, where) => Array.isArray(value) && value.length < 1e5 ? value : wrong(where, "a list", value);
/** @param {any} value @param {string} where @returns {Record<string, any>} */
const record = (value, where) => value && typeof value === "object" && !Array.isArray(value) ? value : wrong(where, "an object", value);
/** @param {any} value @param {string} where @returns {string} */
const text = (value, where) => typeof value === "string" ? value : wrong(where, "a text", value);

/**
 * Check a document, so that a damaged one is an error that names the place.
 * @param {any} effect
 */
export function check(effect) {
  record(effect, "the document");
  if (effect.format !== "passgraph effect") wrong("format", '"passgraph effect"', effect.format);
  if (effect.version !== VERSION) wrong("version", `${VERSION}, which this runtime reads`, effect.version);
  const bytes = whole(record(effect.data, "data").bytes, "data.bytes", 0, MAX_BYTES);
  fileName(effect.data.file, "data.file");
  size(effect.size, "size");
  for (const name of ["modules", "features", "staticValues", "meshes", "pipelines", "resources", "steps", "history", "parameters"]) list(effect[name], name);
  for (const name of ["limits", "inputs", "outputs"]) record(effect[name], name);
  effect.modules.forEach((/** @type {any} */ one, /** @type {number} */ i) => text(one, `modules[${i}]`));
  index(effect.fullscreen, "fullscreen", effect.modules);
  whole(effect.memories, "memories", 0, 1e5);
  /** @param {any} one @param {string} where */
  const part = (one, where) => whole(record(one, where).at, `${where}.at`, 0, bytes - whole(one.bytes, `${where}.bytes`, 0, bytes));
  effect.resources.forEach((/** @type {any} */ one, /** @type {number} */ i) => checkResource(one, `resources[${i}]`, effect, part));
  for (const [name, one] of Object.entries(effect.inputs)) {
    index(record(one, `inputs.${name}`).resource, `inputs.${name}.resource`, effect.resources);
    if (one.data) part(one.data, `inputs.${name}.data`);
    if (one.picture != null) fileName(one.picture, `inputs.${name}.picture`);
  }
  for (const [name, one] of Object.entries(effect.outputs)) index(one, `outputs.${name}`, effect.resources);
  if (effect.sizeFrom != null && !(effect.sizeFrom in effect.inputs)) wrong("sizeFrom", "the name of an input", effect.sizeFrom);
  if (effect.orbit) checkOrbit(effect.orbit);
  effect.history.forEach((/** @type {any} */ pair, /** @type {number} */ i) => {
    for (const one of list(pair, `history[${i}]`)) index(one, `history[${i}]`, effect.resources);
  });
  effect.meshes.forEach((/** @type {any} */ one, /** @type {number} */ i) => {
    whole(record(one, `meshes[${i}]`).count, `meshes[${i}].count`, 0, bytes / 4);
    part(one.indices, `meshes[${i}].indices`);
    for (const [name, data] of Object.entries(record(one.attributes, `meshes[${i}].attributes`))) part(data, `meshes[${i}].attributes.${name}`);
  });
  effect.pipelines.forEach((/** @type {any} */ one, /** @type {number} */ i) => {
    list(record(one, `pipelines[${i}]`).layout, `pipelines[${i}].layout`);
    index(record(one.vertex, `pipelines[${i}].vertex`).module, `pipelines[${i}].vertex.module`, effect.modules);
    if (one.fragment) index(one.fragment.module, `pipelines[${i}].fragment.module`, effect.modules);
  });
  effect.steps.forEach((/** @type {any} */ one, /** @type {number} */ i) => checkStep(one, `steps[${i}]`, effect, part));
}

/** @param {any} value @param {string} where  A file beside effect.json, never one elsewhere. */
function fileName(value, where) {
  if (!/^[\w-][\w.-]*$/.test(text(value, where))) wrong(where, "the name of a file beside it", value);
}

/** @param {any} orbit */
function checkOrbit(orbit) {
  fileName(record(orbit, "orbit").file, "orbit.file");
  let numbers = whole(orbit.azimuths, "orbit.azimuths", 1, 1e4) * whole(orbit.columns, "orbit.columns", 0, 1e6);
  for (const name of ["elevations", "distances"]) {
    numbers *= list(orbit[name], `orbit.${name}`).length;
    if (!orbit[name].length || !orbit[name].every(Number.isFinite)) wrong(`orbit.${name}`, "numbers", orbit[name]);
  }
  if (orbit.bytes !== 4 * numbers) wrong("orbit.bytes", `${4 * numbers}, 4 for each number of its poses`, orbit.bytes);
}

/** @param {any} value @param {string} where */
function size(value, where) {
  if (list(value, where).length !== 2) wrong(where, "width and height", value);
  for (const side of value) whole(side, where, 1, MAX_SIDE);
}

/** @param {any} one @param {string} where @param {any} effect @param {(one: any, where: string) => void} part */
function checkResource(one, where, effect, part) {
  text(record(one, where).name, `${where}.name`);
  text(one.texture, `${where}.texture`);
  if (!(one.texel in TEXELS)) wrong(`${where}.texel`, Object.keys(TEXELS).join(", "), one.texel);
  whole(one.stored, `${where}.stored`, 1, 4);
  whole(one.channels, `${where}.channels`, 1, one.stored);
  whole(one.steps, `${where}.steps`, 0, 65535);
  whole(one.memory, `${where}.memory`, 0, effect.memories - 1);
  size(one.size, `${where}.size`);
  checkRule(one.rule, `${where}.rule`, effect, 0);
  if (one.data) part(one.data, `${where}.data`);
}

/** @param {any} rule @param {string} where @param {any} effect @param {number} depth */
function checkRule(rule, where, effect, depth) {
  if (depth > DEEPEST) wrong(where, `at most ${DEEPEST} rules within rules`, depth);
  record(rule, where);
  if ("fixed" in rule) size(rule.fixed, where);
  else if ("input" in rule) { if (!(rule.input in effect.inputs)) wrong(where, "the name of an input", rule.input); }
  else if ("formulas" in rule) list(rule.formulas, where);
  else if ("of" in rule) {
    for (const number of list(rule.scale ?? rule.blocks, where)) if (!(number > 0)) wrong(where, "numbers above 0", number);
    checkRule(rule.of, where, effect, depth + 1);
  } else if (rule.output !== true) wrong(where, "a rule of a size", rule);
}

/** @param {any} one @param {string} where @param {any} effect @param {(one: any, where: string) => void} part */
function checkStep(one, where, effect, part) {
  if (!["pixel", "draw", "copy"].includes(record(one, where).kind)) wrong(`${where}.kind`, "pixel, draw or copy", one.kind);
  text(one.name, `${where}.name`);
  list(one.outputs, `${where}.outputs`).forEach((id) => index(id, `${where}.outputs`, effect.resources));
  if (one.kind === "copy") return index(one.source, `${where}.source`, effect.resources);
  index(one.pipeline, `${where}.pipeline`, effect.pipelines);
  list(one.stages, `${where}.stages`).forEach((stage, i) => {
    const place = `${where}.stages[${i}]`;
    for (const id of list(record(stage, place).images, `${place}.images`)) index(id, `${place}.images`, effect.resources);
    part(stage.constants, `${place}.constants`);
    for (const value of list(stage.values, `${place}.values`)) {
      if (!(record(value, place).type in KINDS)) wrong(`${place}.values`, "a type of numbers", value.type);
      whole(value.count, `${place}.values`, 1, 65536);
      whole(value.at, `${place}.values`, HEAD, HEAD + stage.constants.bytes - 4 * value.count);
    }
    for (const one of list(stage.poses ?? [], `${place}.poses`)) {
      whole(record(one, place).count, `${place}.poses`, 1, 65536);
      whole(one.at, `${place}.poses`, HEAD, HEAD + stage.constants.bytes - 4 * one.count);
      whole(one.column, `${place}.poses`, 0, (effect.orbit?.columns ?? 0) - one.count);
    }
  });
  if (one.kind !== "draw") return;
  index(one.mesh, `${where}.mesh`, effect.meshes);
  if (one.depth !== null) index(one.depth, `${where}.depth`, effect.resources);
  if (list(one.clears, `${where}.clears`).length !== one.outputs.length) wrong(`${where}.clears`, "one for each output", one.clears);
  for (const name of list(one.attributes, `${where}.attributes`)) if (!(name in effect.meshes[one.mesh].attributes)) wrong(`${where}.attributes`, "an attribute of the mesh", name);
}

// Sizes

/** @type {Record<string, (...numbers: number[]) => number>} */
const OPERATIONS = {
  add: (a, b) => a + b, sub: (a, b) => a - b, mul: (a, b) => a * b, div: (a, b) => a / b, min: Math.min, max: Math.max,
  floor: Math.floor, ceil: Math.ceil, neg: (a) => -a, abs: Math.abs, rest: (a, b) => a % b,
  less: (a, b) => Number(a < b), equal: (a, b) => Number(a === b),
};
/** @param {any} formula @param {Size} output @returns {number} */
const evaluate = (formula, output) => typeof formula === "number" ? formula
  : formula === "width" ? output[0] : formula === "height" ? output[1]
  : (OPERATIONS[formula?.[0]] ?? wrong("a size", "a formula", formula))(...formula.slice(1).map((/** @type {any} */ one) => evaluate(one, output)));

/**
 * The size that a rule gives.
 * @param {any} rule @param {Size} output @param {Record<string, Size>} inputs @returns {Size}
 */
export function sizeOf(rule, output, inputs) {
  if (rule.fixed) return rule.fixed;
  if (rule.input !== undefined) return inputs[rule.input];
  if (rule.formulas) return rule.formulas.map((/** @type {any} */ one) => Math.max(1, Math.floor(evaluate(one, output))));
  if (!rule.of) return output;
  const [width, height] = sizeOf(rule.of, output, inputs);
  if (rule.blocks) return [rule.blocks[2] * Math.ceil(width / rule.blocks[0]), Math.ceil(height / rule.blocks[1])];
  return [Math.max(1, Math.ceil(width * rule.scale[0])), Math.max(1, Math.ceil(height * rule.scale[1]))];
}

// Numbers

/** Bytes of a stage's parameters before its own: four zeros, the size of the target, the factor of the guard band. */
export const HEAD = 32;

/**
 * Write a value into a stage's parameters.
 * @param {DataView} block @param {any} place @param {any} value
 */
export function pack(block, place, value) {
  const numbers = Array.isArray(value) || ArrayBuffer.isView(value) ? [.../** @type {any} */ (value)].flat(3) : [value];
  if (numbers.length !== place.count) throw new EffectError(`value ${shown(place.value)}: expected ${place.count} number(s), got ${shown(value)}`);
  const { low = null, high = null, above = false, odd = false } = place.range ?? {};
  numbers.forEach((given, i) => {
    const number = Number(given), fits = (low === null || (above ? number > low : number >= low)) && (high === null || number <= high);
    if (typeof given !== "number" && typeof given !== "boolean" || !fits || (odd && number % 2 !== 1))
      throw new EffectError(`value ${shown(place.value)}: expected a number from ${low ?? "any"} to ${high ?? "any"}${odd ? ", odd" : ""}, got ${shown(given)}`);
    block[/** @type {"setFloat32"} */ (KINDS[/** @type {"float"} */ (place.type)])](place.at + 4 * i, number, true);
  });
}

/** @param {any} resource  Bytes of one texel of a picture. */
export const texelBytes = (resource) => resource.stored * TEXELS[/** @type {"uint8"} */ (resource.texel)];

const bits = new DataView(new ArrayBuffer(4));
/** @param {number} value  The bits of the nearest half float, ties to even. */
function toHalf(value) {
  bits.setFloat32(0, value);
  const word = bits.getUint32(0), sign = (word >>> 16) & 0x8000, size = word & 0x7fffffff;
  if (size > 0x7f800000) return sign | 0x7e00;
  if (size >= 0x477ff000) return sign | 0x7c00;
  if (size < 0x38800000) { const scaled = Math.abs(value) * 2 ** 24; return sign | even(scaled); }
  return sign | ((size - 0x38000000 + 0xfff + ((size >>> 13) & 1)) >>> 13);
}
/** @param {number} half */
function fromHalf(half) {
  const power = (half >> 10) & 31, rest = half & 1023, sign = half & 0x8000 ? -1 : 1;
  return power === 31 ? (rest ? NaN : sign * Infinity) : sign * (power ? 2 ** (power - 15) * (1 + rest / 1024) : rest * 2 ** -24);
}
/** @param {number} value  The nearest whole number, halves to even. */
function even(value) {
  const low = Math.floor(value), rest = value - low;
  return rest > 0.5 || (rest === 0.5 && low % 2) ? low + 1 : low;
}

/**
 * Numbers of a caller as the texels of a picture.
 * @param {any} resource @param {Numbers} data @param {Size} size
 */
export function toTexels(resource, data, [width, height]) {
  const { channels, stored, steps, texel } = resource, count = width * height;
  if (data.length !== count * channels) throw new EffectError(`picture ${shown(resource.name)}: expected ${count * channels} numbers (${width} x ${height} x ${channels}), got ${data.length}`);
  const made = texel === "uint8" ? new Uint8Array(count * stored) : texel === "float16" ? new Uint16Array(count * stored) : new Float32Array(count * stored);
  const isFloat = data instanceof Float32Array, most = data.BYTES_PER_ELEMENT === 1 ? 255 : 65535;
  for (let i = 0; i < count; i++) for (let c = 0; c < stored; c++) {
    let value = c < channels ? data[i * channels + c] : isFloat ? 1 : most;
    if (texel === "uint8") { made[i * stored + c] = isFloat ? even(Math.fround(Math.min(Math.max(value, 0) || 0, 1) * steps)) : most === 255 ? value : even(value / 257); continue; }
    if (!isFloat) value = Math.fround(value / most);
    else if (steps) value = Math.fround(even(Math.fround(Math.min(Math.max(value, 0) || 0, 1) * steps)) / steps);
    made[i * stored + c] = texel === "float16" ? toHalf(value) : value;
  }
  return made;
}

/**
 * Texels as values: 0 to 1 for whole numbers.
 * @param {any} resource @param {ArrayBuffer} bytes @param {number} row  Bytes of a row. @param {Size} size
 */
export function toValues(resource, bytes, row, [width, height]) {
  const { channels, stored, texel } = resource, made = new Float32Array(width * height * channels);
  const from = texel === "uint8" ? new Uint8Array(bytes) : texel === "float16" ? new Uint16Array(bytes) : new Float32Array(bytes);
  for (let y = 0, k = 0; y < height; y++) for (let x = 0; x < width; x++) for (let c = 0; c < channels; c++) {
    const number = from[y * row / from.BYTES_PER_ELEMENT + x * stored + c];
    made[k++] = texel === "uint8" ? Math.fround(number / 255) : texel === "float16" ? fromHalf(number) : number;
  }
  return made;
}
