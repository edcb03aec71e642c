// Elements that show the lines of a pixel, the plan, and the passes with their code.

export const make = (tag, properties = {}, ...parts) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...parts);
  return element;
};

// Show the kernel's lines for a pixel; `show` marks the texels of an image that they read.
export function pixelParts(lines, show) {
  if (!lines.rows) return [make("pre", { textContent: lines.text, tabIndex: 0 })];
  const verdicts = lines.verdicts.map((text) => make("li", { textContent: text, className: text.includes("outside") ? "wrong" : "" }));
  const reads = lines.texels.map((read) => make("button", {
    textContent: `${read.image}: ${read.at.length} texel${read.at.length === 1 ? "" : "s"}${read.target ? ` of ${read.target}` : ""}`,
    disabled: !read.target, onclick: () => show(read),
  }));
  const parts = [make("p", { textContent: [lines.title, ...lines.parameters].join("  ·  ") }), make("ul", {}, ...verdicts)];
  if (reads.length) parts.push(make("div", { className: "group" }, "Reads ", ...reads));
  const head = ["line", "source", "variable", "reference", ...lines.backends].map((text) => make("th", { textContent: text, scope: "col" }));
  const body = make("tbody");
  const firstWrong = lines.backends.map((_, k) => lines.rows.findIndex((row) => row.wrong[k]));
  let previous = "";
  lines.rows.forEach((row, index) => {
    const source = `${row.line} ${row.source}`, isRepeated = source === previous;
    previous = source;
    const cells = [isRepeated ? "" : row.line, isRepeated ? "" : row.source, { takes: row.name, trip: `${row.name}, trip`, returns: `returns ${row.name}`, branch: "condition" }[row.kind]];
    const line = make("tr", {}, ...cells.map((text) => make("td", { textContent: text })));
    row.values.forEach((text, k) => line.append(make("td", { textContent: text, className: row.wrong[k - 1] ? "wrong" : k && row.differs && text !== "=" ? "differs" : "" })));
    if (firstWrong.includes(index)) { line.className = "first"; line.append(make("td", { textContent: "← first line outside of its bounds" })); }
    body.append(line);
  });
  parts.push(make("table", { className: "lines" }, make("thead", {}, make("tr", {}, ...head)), body));
  return parts;
}

// Show the plan as SVG with selectable steps, and its table of times; `choose` is called with a pass's name.
export function planParts(plan, choose) {
  if (!plan.svg) return [make("pre", { textContent: plan.text })];
  const svg = document.importNode(new DOMParser().parseFromString(plan.svg, "image/svg+xml").documentElement, true);
  svg.setAttribute("role", "group");
  svg.setAttribute("aria-label", "the plan: passes, targets and their lifetimes");
  svg.querySelectorAll("[data-pass]").forEach((label) => {
    label.setAttribute("role", "button");
    label.setAttribute("tabindex", 0);
    label.onclick = () => choose(label.dataset.pass);
    label.onkeydown = (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); event.stopPropagation(); choose(label.dataset.pass); } };
  });
  return [make("pre", { textContent: plan.text, tabIndex: 0 }), svg];
}

// Show the kernel of a pass, and the code that each backend generates.
export function passParts(pass) {
  const texts = { kernel: pass.text, ...pass.code };
  const pre = make("pre", { textContent: pass.text, tabIndex: 0 });
  const choice = make("select", { id: "code", ariaLabel: "Source or generated code", onchange: (event) => { pre.textContent = texts[event.target.value]; } });
  choice.append(...Object.keys(texts).map((name) => new Option(name === "kernel" ? "source" : `code on ${name}`, name)));
  return [make("div", { className: "group" }, make("strong", { textContent: pass.name }), choice), pre];
}
