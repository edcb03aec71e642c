// What the page asks about a picture: the lines that make a pixel, and the passes with their code.

export const make = (tag, properties = {}, ...parts) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...parts);
  return element;
};

// The lines that make a pixel; `show` marks texels that it reads.
export function pixelParts(found, show) {
  if (!found.rows) return [make("pre", { textContent: found.text, tabIndex: 0 })];
  const verdicts = found.verdicts.map((text) => make("li", { textContent: text, className: text.includes("outside") ? "wrong" : "" }));
  const reads = found.texels.map((one) => make("button", {
    textContent: `${one.image}: ${one.at.length} texel${one.at.length === 1 ? "" : "s"}${one.target ? ` of ${one.target}` : ""}`,
    disabled: !one.target, onclick: () => show(one),
  }));
  const parts = [make("p", { textContent: [found.title, ...found.parameters].join("  ·  ") }), make("ul", {}, ...verdicts)];
  if (reads.length) parts.push(make("div", { className: "group" }, "Reads ", ...reads));
  const head = ["line", "source", "variable", "reference", ...found.backends].map((text) => make("th", { textContent: text, scope: "col" }));
  const body = make("tbody");
  const first = found.backends.map((_, k) => found.rows.findIndex((row) => row.wrong[k]));
  let before = "";
  found.rows.forEach((row, at) => {
    const place = `${row.line} ${row.source}`, again = place === before;
    before = place;
    const cells = [again ? "" : row.line, again ? "" : row.source, { takes: row.name, trip: `${row.name}, trip`, returns: `returns ${row.name}`, branch: "condition" }[row.kind]];
    const line = make("tr", {}, ...cells.map((text) => make("td", { textContent: text })));
    row.values.forEach((text, k) => line.append(make("td", { textContent: text, className: row.wrong[k - 1] ? "wrong" : k && row.differs && text !== "=" ? "differs" : "" })));
    if (first.includes(at)) { line.className = "first"; line.append(make("td", { textContent: "← first line outside of its bounds" })); }
    body.append(line);
  });
  parts.push(make("table", { className: "lines" }, make("thead", {}, make("tr", {}, ...head)), body));
  return parts;
}

// The plan: its drawing, whose steps can be chosen, and the table of times; `choose` is told a pass.
export function planParts(found, choose) {
  if (!found.svg) return [make("pre", { textContent: found.text })];
  const svg = document.importNode(new DOMParser().parseFromString(found.svg, "image/svg+xml").documentElement, true);
  svg.setAttribute("role", "group");
  svg.setAttribute("aria-label", "the plan: passes, targets and their lifetimes");
  svg.querySelectorAll("[data-pass]").forEach((label) => {
    label.setAttribute("role", "button");
    label.setAttribute("tabindex", 0);
    label.onclick = () => choose(label.dataset.pass);
    label.onkeydown = (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); event.stopPropagation(); choose(label.dataset.pass); } };
  });
  return [make("pre", { textContent: found.text, tabIndex: 0 }), svg];
}

// A pass: its kernel, and the code of each backend.
export function passParts(found) {
  const texts = { kernel: found.text, ...found.code };
  const pre = make("pre", { textContent: found.text, tabIndex: 0 });
  const choice = make("select", { id: "code", ariaLabel: "Source or generated code", onchange: (event) => { pre.textContent = texts[event.target.value]; } });
  choice.append(...Object.keys(texts).map((name) => new Option(name === "kernel" ? "source" : `code on ${name}`, name)));
  return [make("div", { className: "group" }, make("strong", { textContent: found.name }), choice), pre];
}
