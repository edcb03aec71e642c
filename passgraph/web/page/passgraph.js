// Runs an exported effect on WebGPU:
//
//     import { load } from "./passgraph.js";
//     const program = await load("effect.json");
//     program.run({ frame: picture }, { strength: 0.5 });
//     program.draw(canvas);
//     const { data, width, height, channels } = await program.read();

import { check, EffectError, HEAD, pack, sizeOf, texelBytes, toTexels, toValues } from "./plan.js";

export { EffectError };
/** @typedef {import("./plan.js").Size} Size */
/** @typedef {import("./plan.js").Raw} Raw */
/** @typedef {HTMLVideoElement|HTMLImageElement|HTMLCanvasElement|OffscreenCanvas|ImageBitmap|ImageData|VideoFrame|Raw} Picture */
/** @typedef {{width: number, height: number, channels: number, data: Float32Array}} Values */
/** @typedef {{x?: number, y?: number, zoom?: number, gain?: number, encode?: boolean}} Look
 *  How to draw: the picture's point at the top left, canvas pixels per pixel, a factor, and linear light to sRGB. */
/** @typedef {{azimuth?: number, elevation?: number, distance?: number}} Pose  Of the camera, relative to the exported
 *  one: radians to the right and up round its target, and a factor of the distance. */

const ROW = 256;
/** Bytes of all pictures of a program, unless `load` is told otherwise. */
const MOST_BYTES = 2 ** 31;
/** Bind groups that a stage keeps: pictures with history take turns. */
const MOST_GROUPS = 64;
/** Of the samplers that filter, in the order of their bindings, which follow that of the nearest one. @type {GPUAddressMode[]} */
const WRAP_MODES = ["clamp-to-edge", "repeat", "mirror-repeat"];

/**
 * A device with the features and limits that an effect needs.
 * @param {any} effect  The document. @returns {Promise<GPUDevice>}
 */
async function openDevice(effect) {
  const adapter = await globalThis.navigator?.gpu?.requestAdapter();
  if (!adapter) throw new EffectError("This browser has no WebGPU device. Use a current Chrome, Edge, Safari or Firefox, over https or localhost.");
  for (const name of effect.features) if (!adapter.features.has(name)) throw new EffectError(`This graphics device lacks the WebGPU feature "${name}", which the effect needs.`);
  return adapter.requestDevice({ label: "passgraph", requiredFeatures: effect.features, requiredLimits: effect.limits });
}

/** @param {URL} url @param {"json"|"arrayBuffer"|"blob"} how */
async function fetched(url, how) {
  const answer = await fetch(url, { cache: "no-cache" });
  if (!answer.ok) throw new EffectError(`${url.pathname}: not found (status ${answer.status})`);
  return answer[how]().catch(() => { throw new EffectError(`${url.pathname}: cannot be read; expected ${how === "json" ? "JSON" : "bytes"}. Export the effect again.`); });
}

/**
 * Load an effect.
 * @param {string|URL} url  Of effect.json; its other files are beside it.
 * @param {GPUDevice} [device]  Left out, one is opened.
 * @param {{keep?: boolean, memory?: number}} [options]  `keep`: every target keeps its content after a run, so that
 *   each can be read; else targets share memory. `memory`: most bytes of all pictures, by default 2 GiB.
 * @returns {Promise<Program>}
 */
export async function load(url, device, options = {}) {
  const place = new URL(url, globalThis.document?.baseURI ?? globalThis.location.href);
  const effect = await fetched(place, "json");
  check(effect);
  const data = await fetched(new URL(effect.data.file, place), "arrayBuffer");
  if (data.byteLength !== effect.data.bytes) throw new EffectError(`${effect.data.file}: expected ${effect.data.bytes} bytes, got ${data.byteLength}. Export the effect again.`);
  const { orbit } = effect, poses = orbit && await fetched(new URL(orbit.file, place), "arrayBuffer");
  if (orbit && poses.byteLength !== orbit.bytes) throw new EffectError(`${orbit.file}: expected ${orbit.bytes} bytes, got ${poses.byteLength}. Export the effect again.`);
  device ??= await openDevice(effect);
  for (const name of effect.features) if (!device.features.has(name)) throw new EffectError(`The device lacks the feature "${name}", which the effect needs; request it.`);
  for (const [name, least] of Object.entries(effect.limits)) if (/** @type {any} */ (device.limits)[name] < least) throw new EffectError(`The device has ${name} ${/** @type {any} */ (device.limits)[name]}, and the effect needs ${least}; request it.`);
  const program = new Program(effect, data, device, options, poses);
  await program.compile();
  for (const [name, input] of Object.entries(effect.inputs)) {
    if (input.picture) program.given[name] = await createImageBitmap(await fetched(new URL(input.picture, place), "blob"), { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  }
  return program;
}

/** An effect on a device. `load` makes it. */
export class Program {
  /** @param {any} effect @param {ArrayBuffer} data @param {GPUDevice} device @param {{keep?: boolean, memory?: number}} options @param {ArrayBuffer} [poses] */
  constructor(effect, data, device, options, poses) {
    this.effect = effect;
    this.data = data;
    this.device = device;
    this.options = options;
    /** Numbers that depend on the camera, pose after pose, and where those of the current one begin: in bytes; -1 for
     *  the exported camera. */
    this.poses = poses;
    this.poseAt = -1;
    /** Completed runs; the effect sees it as the frame's number. */
    this.frame = 0;
    /** The last picture of each input. @type {Record<string, Picture>} */
    this.given = {};
    /** Sizes of the output and of every resource. @type {Size} */
    this.size = effect.size;
    /** @type {Size[]} */
    this.sizes = [];
    /** @type {GPUTexture[]} */
    this.textures = [];
    /** @type {any[]} */
    this.pipelines = [];
    this.isStaticDone = false;
    this.staticKey = "";
    this.movesDue = false;
    /** Resource → number of its texture; history moves them on. @type {number[]} */
    this.places = [];
    /** @type {Record<string, Picture>} */
    this.uploaded = {};
    /** @type {Map<GPUTextureFormat, GPURenderPipeline>} */
    this.shows = new Map();
  }

  /** Names of everything that can be drawn or read: outputs first, then inputs and targets. */
  get targets() {
    const names = Object.keys(this.effect.outputs);
    return [...new Set([...names, ...this.effect.resources.filter((/** @type {any} */ one) => ["input", "target"].includes(one.kind)).map((/** @type {any} */ one) => one.name)])];
  }

  /** Compile the shaders; a mistake in them is an error with the compiler's message. */
  async compile() {
    const { effect, device } = this;
    device.pushErrorScope("validation");
    const modules = effect.modules.map((/** @type {string} */ code) => device.createShaderModule({ code }));
    for (const [i, module] of modules.entries()) {
      const first = (await module.getCompilationInfo()).messages.find((/** @type {GPUCompilationMessage} */ one) => one.type === "error");
      if (first) { await device.popErrorScope(); throw new EffectError(`effect.json: modules[${i}], line ${first.lineNum}: ${first.message}. Export the effect again.`); }
    }
    /** @type {Map<string, GPUBindGroupLayout>} */
    const layouts = new Map();
    const layoutOf = (/** @type {any} */ entries) => {
      const key = JSON.stringify(entries);
      if (!layouts.has(key)) layouts.set(key, device.createBindGroupLayout({ entries }));
      return layouts.get(key);
    };
    try {
      this.pipelines = await Promise.all(effect.pipelines.map(async (/** @type {any} */ one) => {
        const groups = one.layout.map(layoutOf);
        const pipeline = await device.createRenderPipelineAsync({
          ...one, layout: device.createPipelineLayout({ bindGroupLayouts: groups }),
          vertex: { ...one.vertex, module: modules[one.vertex.module] },
          fragment: one.fragment && { ...one.fragment, module: modules[one.fragment.module] },
        });
        return { pipeline, groups };
      }));
      this.nearest = device.createSampler({ minFilter: "nearest", magFilter: "nearest" });
      this.linear = WRAP_MODES.map((mode) => device.createSampler({ minFilter: "linear", magFilter: "linear", addressModeU: mode, addressModeV: mode }));
      this.corners = modules[effect.fullscreen];
      this.meshes = effect.meshes.map((/** @type {any} */ mesh) => ({
        count: mesh.count, indices: this.#buffer(mesh.indices, GPUBufferUsage.INDEX),
        attributes: Object.fromEntries(Object.entries(mesh.attributes).map(([name, part]) => [name, this.#buffer(part, GPUBufferUsage.VERTEX)])),
      }));
      this.steps = effect.steps.map((/** @type {any} */ step) => ({ ...step, stages: (step.stages ?? []).map((/** @type {any} */ stage) => this.#stage(stage)) }));
    } catch (error) {
      throw new EffectError(`effect.json: ${error instanceof Error ? error.message : error}. Export the effect again.`);
    } finally {
      const found = await device.popErrorScope();
      if (found) throw new EffectError(`effect.json: ${found.message}. Export the effect again.`);
    }
  }

  /** @param {any} part @param {number} usage */
  #buffer(part, usage) {
    const buffer = this.device.createBuffer({ size: Math.max(4, Math.ceil(part.bytes / 4) * 4), usage: usage | GPUBufferUsage.COPY_DST });
    this.device.queue.writeBuffer(buffer, 0, this.data, part.at, Math.ceil(part.bytes / 4) * 4);
    return buffer;
  }

  /** @param {any} stage */
  #stage(stage) {
    const block = new Uint8Array(HEAD + stage.constants.bytes);
    block.set(new Uint8Array(this.data, stage.constants.at, stage.constants.bytes), HEAD);
    const buffer = this.device.createBuffer({ size: block.length, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
    return { ...stage, block, view: new DataView(block.buffer), buffer, sent: new Uint8Array(0), groups: new Map() };
  }

  // Pictures

  /** Make the textures for these sizes of inputs. @param {Record<string, Size>} inputs */
  #allocate(inputs) {
    const { effect, device } = this, { keep = false, memory = MOST_BYTES } = this.options;
    const output = effect.resizable && effect.sizeFrom ? inputs[effect.sizeFrom] : effect.size;
    const sizes = effect.resources.map((/** @type {any} */ one) => sizeOf(one.rule, output, inputs));
    const owners = keep ? effect.resources : [...Array(effect.memories).keys()].map((i) => effect.resources.find((/** @type {any} */ one) => one.memory === i));
    const sized = owners.map((/** @type {any} */ one) => one && sizes[effect.resources.indexOf(one)]);
    const side = device.limits.maxTextureDimension2D, flat = sized.filter(Boolean).flat();
    if (Math.max(...flat) > side) throw new EffectError(`The effect needs a picture of ${Math.max(...flat)} pixels a side, and the device takes ${side}; give a smaller picture.`);
    const bytes = owners.reduce((/** @type {number} */ sum, /** @type {any} */ one, /** @type {number} */ i) => sum + (one ? texelBytes(one) * sized[i][0] * sized[i][1] : 0), 0);
    if (bytes > memory) throw new EffectError(`The effect needs ${Math.ceil(bytes / 1e6)} MB for its pictures, and ${Math.floor(memory / 1e6)} MB are allowed; give a smaller picture.`);
    this.#release();
    this.size = output;
    this.sizes = sizes;
    const { TEXTURE_BINDING, COPY_SRC, COPY_DST, RENDER_ATTACHMENT } = GPUTextureUsage;
    this.textures = owners.map((/** @type {any} */ one, /** @type {number} */ i) => one && device.createTexture({
      size: sized[i], format: one.texture, usage: TEXTURE_BINDING | COPY_SRC | COPY_DST | RENDER_ATTACHMENT,
    }));
    const encoder = device.createCommandEncoder();
    owners.forEach((/** @type {any} */ one, /** @type {number} */ i) => {
      if (one && one.stored > one.channels) // what has no alpha reads as opaque
        encoder.beginRenderPass({ colorAttachments: [{ view: this.textures[i].createView(), loadOp: "clear", storeOp: "store", clearValue: [0, 0, 0, 1] }] }).end();
    });
    device.queue.submit([encoder.finish()]);
    this.places = effect.resources.map((/** @type {any} */ one, /** @type {number} */ i) => keep ? i : one.memory);
    this.uploaded = {};
    effect.resources.forEach((/** @type {any} */ one, /** @type {number} */ i) => {
      if (one.kind === "buffer" && one.data) this.#write(i, new Uint8Array(this.data, one.data.at, one.data.bytes));
    });
    for (const input of Object.values(effect.inputs)) if (input.data) this.#write(input.resource, new Uint8Array(this.data, input.data.at, input.data.bytes));
    this.reset();
  }

  /** Begin again: the next run is the first, and history holds what it began with. */
  reset() {
    this.frame = 0;
    this.isStaticDone = this.movesDue = false;
    if (!this.textures.length) return;
    this.effect.resources.forEach((/** @type {any} */ one, /** @type {number} */ i) => {
      if (one.kind !== "history" || one.texture.startsWith("depth")) return;
      const [width, height] = this.sizes[i], filled = new Float32Array(width * height * one.channels);
      if (one.data) return this.#write(i, new Uint8Array(this.data, one.data.at, one.data.bytes));
      for (let k = 0; k < filled.length; k++) filled[k] = one.initial[k % one.channels];
      this.#write(i, toTexels(one, filled, [width, height]));
    });
  }

  /** @param {number} resource @param {Uint8Array|Uint16Array|Float32Array} texels */
  #write(resource, texels) {
    const [width, height] = this.sizes[resource], bytesPerRow = width * texelBytes(this.effect.resources[resource]);
    if (texels.byteLength !== bytesPerRow * height) throw new EffectError(`picture "${this.effect.resources[resource].name}": expected ${bytesPerRow * height} bytes, got ${texels.byteLength}`);
    this.device.queue.writeTexture({ texture: this.#texture(resource) }, /** @type {any} */ (texels), { bytesPerRow }, [width, height]);
  }

  /** @param {number} resource */
  #texture(resource) { return this.textures[this.places[resource]]; }

  /** @param {number} resource */
  #view(resource) {
    return this.#texture(resource).createView(this.effect.resources[resource].texture.startsWith("depth") ? { aspect: "depth-only" } : {});
  }

  /** @param {string} name @param {Picture} picture */
  #upload(name, picture) {
    const { resource, static: isStatic } = this.effect.inputs[name], described = this.effect.resources[resource], size = this.sizes[resource];
    if (isStatic && this.uploaded[name] === picture) return;
    this.uploaded[name] = picture;
    this.isStaticDone &&= !isStatic;
    if (isRaw(picture)) return this.#write(resource, toTexels(described, picture.data, size));
    const [width, height] = sizeOfPicture(picture);
    const source = width === size[0] && height === size[1] ? picture : covering(picture, [width, height], size);
    this.device.queue.copyExternalImageToTexture({ source: /** @type {any} */ (source) }, { texture: this.#texture(resource) }, size);
  }

  // Runs

  /**
   * Choose the nearest pose of the camera, of those that were exported; the next run shows it.
   * @param {Pose} [pose]  What is left out is as exported. @returns {Required<Pose>}  The one that was chosen.
   */
  pose({ azimuth = 0, elevation = 0, distance = 1 } = {}) {
    const { orbit } = this.effect;
    if (!orbit) throw new EffectError("this effect has no poses of a camera; export it with --orbit");
    if (![azimuth, elevation, distance].every(Number.isFinite) || distance <= 0) throw new EffectError(`pose: expected finite numbers and a distance above 0, got azimuth ${azimuth}, elevation ${elevation}, distance ${distance}`);
    const turn = 2 * Math.PI / orbit.azimuths, across = Math.round(azimuth / turn) % orbit.azimuths, column = across < 0 ? across + orbit.azimuths : across;
    const row = nearest(orbit.elevations, (one) => one - elevation), depth = nearest(orbit.distances, (one) => Math.log(one / distance));
    this.poseAt = 4 * orbit.columns * ((column * orbit.elevations.length + row) * orbit.distances.length + depth);
    return { azimuth: column * turn, elevation: orbit.elevations[row], distance: orbit.distances[depth] };
  }

  /** The bytes of a parameter in the current pose. @param {any} place */
  #posed({ column, count }) { return new Uint8Array(/** @type {ArrayBuffer} */ (this.poses), this.poseAt + 4 * column, 4 * count); }

  /**
   * Run once.
   * @param {Record<string, Picture>} [pictures]  Inputs by name; the last one is used where one is left out.
   * @param {Record<string, number|boolean|number[]>} [values]  By name; the default is used where one is left out.
   */
  run(pictures = {}, values = {}) {
    const { effect, device } = this;
    for (const name of Object.keys(pictures)) if (!(name in effect.inputs)) throw new EffectError(`there is no input "${name}"; there are ${Object.keys(effect.inputs).join(", ") || "none"}`);
    const known = effect.parameters.map((/** @type {any} */ one) => one.name);
    for (const name of Object.keys(values)) if (!known.includes(name) && name !== "frame_index") throw new EffectError(`there is no value "${name}"; there are ${known.join(", ") || "none"}`);
    Object.assign(this.given, pictures);
    this.#allocateFor(this.given);
    for (const [name, picture] of Object.entries(this.given)) if (name in pictures || this.uploaded[name] !== picture) this.#upload(name, picture);
    const now = { frame_index: this.frame, ...Object.fromEntries(effect.parameters.map((/** @type {any} */ one) => [one.name, one.default])), ...values, output_size: this.size };
    const posed = this.poseAt < 0 ? [] : this.steps.filter((/** @type {any} */ step) => step.static).flatMap((/** @type {any} */ step) => step.stages.flatMap((/** @type {any} */ stage) => stage.poses ?? []));
    const staticKey = JSON.stringify([effect.staticValues.map((/** @type {string} */ name) => /** @type {any} */ (now)[name]), posed.map((/** @type {any} */ place) => String(this.#posed(place)))]);
    const isStaticDone = this.isStaticDone && staticKey === this.staticKey;
    if (this.movesDue) for (const [to, from] of effect.history) [this.places[to], this.places[from]] = [this.places[from], this.places[to]];
    this.isStaticDone = this.movesDue = false;
    const encoder = device.createCommandEncoder();
    for (const step of this.steps) if (!(step.static && isStaticDone)) this.#encode(step, encoder, now);
    device.queue.submit([encoder.finish()]);
    this.isStaticDone = this.movesDue = true;
    this.staticKey = staticKey;
    this.frame++;
  }

  /** @param {Record<string, Picture>} given */
  #allocateFor(given) {
    const { effect } = this;
    /** @type {Record<string, Size>} */
    const inputs = {};
    for (const [name, { resource, data }] of Object.entries(effect.inputs)) {
      const rule = effect.resources[resource], picture = given[name];
      if (!picture && !data) throw new EffectError(`input "${name}" is missing; run it as program.run({ ${name}: picture })`);
      inputs[name] = effect.resizable && picture && !rule.rule.fixed ? sizeOfPicture(picture) : rule.size;
      if (picture && isRaw(picture) && String(sizeOfPicture(picture)) !== String(inputs[name])) throw new EffectError(`input "${name}": expected ${inputs[name].join(" x ")} pixels, got ${sizeOfPicture(picture).join(" x ")}`);
    }
    const changed = !this.textures.length || Object.entries(effect.inputs).some(([name, { resource }]) => String(this.sizes[resource]) !== String(inputs[name]));
    if (changed) this.#allocate(inputs);
  }

  /** @param {any} step @param {GPUCommandEncoder} encoder @param {any} values */
  #encode(step, encoder, values) {
    if (step.kind === "copy") {
      const [width, height] = this.sizes[step.source];
      return encoder.copyTextureToTexture({ texture: this.#texture(step.source) }, { texture: this.#texture(step.outputs[0]) }, [width, height]);
    }
    const size = this.sizes[step.outputs[0] ?? step.depth], guard = step.kind === "draw" ? this.#guard(size) : 1;
    const { pipeline, groups } = this.pipelines[step.pipeline];
    step.stages.forEach((/** @type {any} */ stage, /** @type {number} */ i) => this.#send(stage, size, i === 0 ? 1 / guard : 1, values));
    /** @type {GPURenderPassDescriptor} */
    const described = { colorAttachments: step.outputs.map((/** @type {number} */ id, /** @type {number} */ i) => {
      const clear = step.clears?.[i];
      return { view: this.#view(id), loadOp: clear ? "clear" : "load", storeOp: "store", clearValue: clear ?? undefined };
    }) };
    if (step.kind === "draw" && step.depth !== null) described.depthStencilAttachment = this.#depth(step);
    const pass = encoder.beginRenderPass(described);
    pass.setPipeline(pipeline);
    step.stages.forEach((/** @type {any} */ stage, /** @type {number} */ i) => pass.setBindGroup(i, this.#group(stage, groups[i])));
    if (step.kind === "pixel") pass.draw(3);
    else this.#draw(step, pass, size, guard);
    pass.end();
  }

  /** @param {any} step @param {GPURenderPassEncoder} pass @param {Size} size @param {number} guard */
  #draw(step, pass, [width, height], guard) {
    const mesh = this.meshes[step.mesh];
    if (!mesh.count) return;
    pass.setViewport(-(guard - 1) * width / 2, -(guard - 1) * height / 2, guard * width, guard * height, 0, 1);
    pass.setStencilReference(step.stencilReference);
    step.attributes.forEach((/** @type {string} */ name, /** @type {number} */ slot) => pass.setVertexBuffer(slot, mesh.attributes[name]));
    pass.setIndexBuffer(mesh.indices, "uint32");
    pass.drawIndexed(mesh.count);
  }

  /** How many times larger than the target the viewport of a draw can be. @param {Size} size */
  #guard(size) { return [8, 4, 2].find((times) => Math.max(...size) * times <= this.device.limits.maxTextureDimension2D) ?? 1; }

  /** @param {any} step @returns {GPURenderPassDepthStencilAttachment} */
  #depth(step) {
    const loadOp = step.depthClear === null ? "load" : "clear", hasStencil = this.effect.resources[step.depth].texture.endsWith("stencil8");
    return {
      view: this.#texture(step.depth).createView(), depthLoadOp: loadOp, depthStoreOp: "store", depthClearValue: step.depthClear ?? 0,
      ...(hasStencil ? { stencilLoadOp: loadOp, stencilStoreOp: "store", stencilClearValue: step.stencilClear } : {}),
    };
  }

  /** Write a stage's parameters where they changed. @param {any} stage @param {Size} size @param {number} guard @param {any} values */
  #send(stage, size, guard, values) {
    stage.view.setInt32(16, size[0], true);
    stage.view.setInt32(20, size[1], true);
    stage.view.setFloat32(24, guard, true);
    for (const place of stage.values) {
      const value = values[place.value];
      if (value === undefined || value === null) throw new EffectError(`value "${place.value}" is missing; run it as program.run({}, { ${place.value}: ... })`);
      pack(stage.view, place, value);
    }
    if (this.poseAt >= 0) for (const place of stage.poses ?? []) stage.block.set(this.#posed(place), place.at);
    if (stage.sent.length === stage.block.length && stage.block.every((/** @type {number} */ byte, /** @type {number} */ i) => byte === stage.sent[i])) return;
    this.device.queue.writeBuffer(stage.buffer, 0, stage.block);
    stage.sent = stage.block.slice();
  }

  /** The bind group of a stage over its images of now. @param {any} stage @param {GPUBindGroupLayout} layout */
  #group(stage, layout) {
    const key = stage.images.map((/** @type {number} */ id) => this.places[id]).join();
    if (!stage.groups.has(key)) {
      if (stage.groups.size >= MOST_GROUPS) stage.groups.clear();
      const entries = [{ binding: 0, resource: { buffer: stage.buffer } }, { binding: 1, resource: this.nearest },
        ...this.linear.map((sampler, k) => ({ binding: 2 + k, resource: sampler })),
        ...stage.images.map((/** @type {number} */ id, /** @type {number} */ k) => ({ binding: 2 + WRAP_MODES.length + k, resource: this.#view(id) }))];
      stage.groups.set(key, this.device.createBindGroup({ layout, entries: /** @type {any} */ (entries) }));
    }
    return stage.groups.get(key);
  }

  // Results

  /** @param {string} [name] */
  #resource(name = Object.keys(this.effect.outputs)[0]) {
    const found = this.effect.outputs[name] ?? this.effect.resources.findIndex((/** @type {any} */ one) => one.name === name);
    if (found < 0) throw new EffectError(`there is no target "${name}"; there are ${this.targets.join(", ")}`);
    if (!this.frame) throw new EffectError("nothing has run yet; call program.run() first");
    return found;
  }

  /**
   * Read a target, by default the first output; with `load(..., { keep: true })` any target, else an output.
   * @param {string} [name] @param {[number, number, number, number]} [part]  x, y, width and height; left out, all of it.
   * @returns {Promise<Values>}
   */
  async read(name, part) {
    const id = this.#resource(name), resource = this.effect.resources[id];
    const [x, y, width, height] = part ?? [0, 0, ...this.sizes[id]], row = Math.ceil(width * texelBytes(resource) / ROW) * ROW;
    const buffer = this.device.createBuffer({ size: row * height, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ });
    const encoder = this.device.createCommandEncoder(), isDepth = resource.texture.startsWith("depth");
    encoder.copyTextureToBuffer({ texture: this.#texture(id), origin: [x, y], aspect: isDepth ? "depth-only" : "all" }, { buffer, bytesPerRow: row }, [width, height]);
    this.device.queue.submit([encoder.finish()]);
    await buffer.mapAsync(GPUMapMode.READ);
    const data = toValues(resource, buffer.getMappedRange(), row, [width, height]);
    buffer.destroy();
    return { width, height, channels: resource.channels, data };
  }

  /** The size of a target. @param {string} [name] @returns {Size} */
  sizeOf(name) { return this.sizes[this.#resource(name)]; }

  /**
   * Draw a target on a canvas, by default the first output, one pixel of it on one of the canvas.
   * @param {HTMLCanvasElement|OffscreenCanvas} canvas @param {string} [name] @param {Look} [look]
   */
  draw(canvas, name, look = {}) {
    const id = this.#resource(name), { device } = this, { channels, texture } = this.effect.resources[id];
    const context = /** @type {GPUCanvasContext} */ (canvas.getContext("webgpu")), format = navigator.gpu.getPreferredCanvasFormat();
    if (!context) throw new EffectError("the canvas has a context of another kind; give one that nothing was drawn on");
    context.configure({ device, format, alphaMode: "premultiplied" });
    let show = this.shows.get(format);
    if (!show) {
      const module = device.createShaderModule({ code: SHOW });
      const entries = [{ binding: 0, visibility: 2, buffer: {} }, { binding: 1, visibility: 2, texture: { sampleType: /** @type {"unfilterable-float"} */ ("unfilterable-float") } }];
      const layout = device.createPipelineLayout({ bindGroupLayouts: [device.createBindGroupLayout({ entries })] });
      show = device.createRenderPipeline({ layout, vertex: { module: this.corners }, fragment: { module, targets: [{ format }] } });
      this.shows.set(format, show);
      this.look = device.createBuffer({ size: 32, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
    }
    const { x = 0, y = 0, zoom = 1, gain = 1, encode = false } = look;
    device.queue.writeBuffer(/** @type {GPUBuffer} */ (this.look), 0, new Float32Array([x, y, 1 / zoom, gain, Number(encode), texture.startsWith("depth") ? 1 : channels, 0, 0]));
    const encoder = device.createCommandEncoder();
    const pass = encoder.beginRenderPass({ colorAttachments: [{ view: context.getCurrentTexture().createView(), loadOp: "clear", storeOp: "store", clearValue: [0, 0, 0, 0] }] });
    pass.setPipeline(show);
    pass.setBindGroup(0, device.createBindGroup({ layout: show.getBindGroupLayout(0), entries: [{ binding: 0, resource: { buffer: /** @type {GPUBuffer} */ (this.look) } }, { binding: 1, resource: this.#view(id) }] }));
    pass.draw(3);
    pass.end();
    device.queue.submit([encoder.finish()]);
  }

  #release() {
    for (const texture of this.textures) texture?.destroy();
    for (const step of this.steps) for (const stage of step.stages) stage.groups.clear();
    this.textures = [];
  }

  /** Free the textures and buffers. */
  destroy() {
    this.#release();
    for (const step of this.steps) for (const stage of step.stages) stage.buffer.destroy();
    for (const mesh of this.meshes) for (const buffer of [mesh.indices, ...Object.values(mesh.attributes)]) buffer.destroy();
  }
}

const SHOW = `struct Look { corner: vec2<f32>, step: f32, gain: f32, encode: f32, channels: f32 }
@group(0) @binding(0) var<uniform> look: Look;
@group(0) @binding(1) var picture: texture_2d<f32>;
@fragment fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
  let at = vec2<i32>(floor(look.corner + place.xy * look.step));
  if (any(at < vec2<i32>(0)) || any(at >= vec2<i32>(textureDimensions(picture)))) { return vec4<f32>(); }
  let texel = textureLoad(picture, at, 0);
  var color = select(texel.rgb, texel.rrr, look.channels < 1.5) * look.gain;
  color = clamp(color, vec3<f32>(), vec3<f32>(1.0));
  if (look.encode > 0.5) { color = select(1.055 * pow(color, vec3<f32>(1.0 / 2.4)) - 0.055, 12.92 * color, color <= vec3<f32>(0.0031308)); }
  let alpha = select(1.0, clamp(texel.a, 0.0, 1.0), look.channels > 3.5);
  return vec4<f32>(color * alpha, alpha);
}`;

/** The place of the number whose distance is least. @param {number[]} numbers @param {(one: number) => number} distance */
const nearest = (numbers, distance) => numbers.reduce((best, one, i) => Math.abs(distance(one)) < Math.abs(distance(numbers[best])) ? i : best, 0);
/** @param {any} picture @returns {picture is Raw} */
const isRaw = (picture) => ArrayBuffer.isView(picture.data) && !(globalThis.ImageData && picture instanceof ImageData);
/** @param {any} picture @returns {Size} */
function sizeOfPicture(picture) {
  const width = picture.videoWidth || picture.displayWidth || picture.naturalWidth || picture.width, height = picture.videoHeight || picture.displayHeight || picture.naturalHeight || picture.height;
  if (!(width > 0 && height > 0)) throw new EffectError("the picture has no pixels yet; wait until it is loaded");
  return [width, height];
}
/** A picture scaled to cover a size, cut at the longer sides. @param {any} picture @param {Size} from @param {Size} to */
function covering(picture, [width, height], to) {
  const canvas = new OffscreenCanvas(...to), context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const scale = Math.max(to[0] / width, to[1] / height);
  if (picture instanceof ImageData) {
    const whole = new OffscreenCanvas(width, height);
    /** @type {OffscreenCanvasRenderingContext2D} */ (whole.getContext("2d")).putImageData(picture, 0, 0);
    picture = whole;
  }
  context.drawImage(picture, (to[0] - width * scale) / 2, (to[1] - height * scale) / 2, width * scale, height * scale);
  return canvas;
}
