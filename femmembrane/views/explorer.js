"use strict";
// The page has a branch as data (explorer_data.py says what is in it). Plotly draws; this file says what, and reacts to hands and keys.
const byId = (id) => document.getElementById(id);
const SECTORS = 48, PER_WAVE = 8, MOST_SECTORS = 960, FRAME = 50, AMPLITUDE = 0.12, OF_A_WAVE = 0.35;
const SNAP = "#c2184e";
const MARKERS = { limit_point: "circle", volume_fold: "square", height_fold: "triangle-up", number_fold: "hexagon",
  branch_point: "diamond", azimuthal_onset: "triangle-down", touch: "triangle-right", release: "triangle-left" };
// the same markers as polygons, for the key below the diagram
const CORNERS = { square: "-4,-4 4,-4 4,4 -4,4", "triangle-up": "0,-5 5,4 -5,4", hexagon: "-5,0 -2.5,-4.4 2.5,-4.4 5,0 2.5,4.4 -2.5,4.4",
  diamond: "0,-6 6,0 0,6 -6,0", "triangle-down": "0,5 5,-4 -5,-4", "triangle-right": "5,0 -4,5 -4,-5", "triangle-left": "-5,0 4,5 4,-5",
  x: "-4,-4 4,4 0,0 4,-4 -4,4 0,0" };
const ZONED = "zone", night = matchMedia("(prefers-color-scheme: dark)"), calm = matchMedia("(prefers-reduced-motion: reduce)");
let data = JSON.parse(byId("data").textContent);
let now = 0, shown = 0, phase = 1, motion = null, playing = null, compared = [];
window.explorer = { ready: false, errors: [] };

const unpacked = async () => {
  const bytes = Uint8Array.from(atob(byId("library").textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(stream).text();
  document.head.append(script);
};
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const ink = (line) => (night.matches ? line.dark : line.color);
const make = (tag, text, kind) => Object.assign(document.createElement(tag), { textContent: text, className: kind || "" });
const column = (name) => data.quantities.findIndex((q) => q.name === name);
const labelled = (name) => (data.quantities[column(name)] || {}).label || name;
const text = (value) => (value === null ? "–" : String(value).replace("-", "−"));
const fill = (select, items, chosen) => {
  select.replaceChildren(...items.map(([value, label]) => new Option(label, value, false, value === chosen)));
};
// the shape of a state: on the page, or asked for where it was computed
const shapeOf = async (k) => {
  if (data.shapes && data.shapes[k]) return data.shapes[k];
  const from = data, found = await window.explorer.ask("shape", { state: k, version: data.version });
  (from.shapes = from.shapes || [])[k] = found;
  return found;
};

// --- the diagram

const quiet = () => ({ bgcolor: "rgba(0,0,0,0)", color: css("--line"), activecolor: css("--ink") });
const below = (space) => ({ orientation: "v", x: 0, y: -space, yanchor: "top", font: { size: 11 } });
const frame = (x, y) => ({
  paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: css("--ink"), size: 12 },
  margin: { l: 62, r: 12, t: 26, b: 46 }, hovermode: "closest", uirevision: x + "|" + y, modebar: quiet(),
  xaxis: { title: { text: x }, gridcolor: css("--line"), zeroline: false },
  yaxis: { title: { text: y }, gridcolor: css("--line"), zeroline: false },
});
const joined = (parts, c) => parts.flatMap((part, k) => (k ? [null, ...part.values[c]] : part.values[c]));
const grouped = (lines) => [...Map.groupBy(lines, (line) => line.label).values()];
function strands(of, x, y, look) {
  return grouped(of).map((same) => ({ type: "scatter", mode: "lines", hoverinfo: "skip", name: same[0].label, x: joined(same, x),
    y: joined(same, y), line: { ...look(same[0]), simplify: false } }));
}
// An onset after which the membrane jumps has a filled marker. Plotly's own legend would be laid out anew at every redraw, which takes as
// long as all the rest: what lines and markers mean stands below the diagram instead.
const markerOf = (s) => ({ symbol: MARKERS[s.kind] || "x", fill: s.after === "subcritical" ? css("--ink") : css("--paper") });
function diagram() {
  const [x, y] = ["across", "up"].map((id) => column(byId(id).value)), states = data.states;
  const own = (line) => ({ color: ink(line), dash: line.dash, width: line.width });
  const traces = [
    ...compared.flatMap((c) => strands(c.lines, x, y, (line) => ({ color: c.color, dash: line.dash, width: line.width }))),
    ...strands(data.bands, x, y, (band) => ({ color: ink(band), width: 10 })),
    ...strands(data.lines, x, y, own),
    ...data.snaps.map((snap) => ({ type: "scatter", mode: "lines+markers", hoverinfo: "skip", name: "snap", x: snap[x], y: snap[y],
      line: { color: SNAP, width: 2 }, marker: { symbol: "arrow", size: [0, 12], angleref: "previous", color: SNAP } })),
  ];
  const points = states.map((s, k) => k).filter((k) => states[k].kind);
  const hover = (k) => `${states[k].name}<br>${data.quantities[x].label}: ${text(states[k].values[x])}<br>` +
    `${data.quantities[y].label}: ${text(states[k].values[y])}`;
  const at = (which, more) => ({ type: "scatter", mode: "markers", x: which.map((k) => states[k].values[x]),
    y: which.map((k) => states[k].values[y]), ...more });
  const told = (which) => ({ customdata: which, hovertext: which.map(hover), hoverinfo: "text" });
  const steps = states.map((s, k) => k).filter((k) => !states[k].kind);
  traces.push(at(steps, { ...told(steps), name: "steps", marker: { size: 6, color: css("--soft"), opacity: 0.55 } }));
  for (const same of Map.groupBy(points, (k) => `${states[k].kind} ${states[k].after}`).values()) {
    const look = markerOf(states[same[0]]);
    traces.push(at(same, { ...told(same), name: states[same[0]].word, marker: { size: 10, symbol: look.symbol, color: look.fill,
      line: { color: css("--ink"), width: 1.6 } } }));
  }
  traces.push({ ...at([shown], {}), name: "shown", hoverinfo: "skip",
    marker: { size: 17, color: "rgba(0,0,0,0)", line: { color: css("--accent"), width: 3 } } });
  const layout = { ...frame(data.quantities[x].label, data.quantities[y].label), showlegend: false };
  Plotly.react("diagram", traces, layout, { responsive: true, displaylogo: false });
  byId("diagram").parentElement.classList.remove("sketched");
  key();
}
const drawing = (tag, look) => {
  const part = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(look)) part.setAttribute(name, value);
  return part;
};
const sample = (line, width) => drawing("line", { x1: 0, y1: 7, x2: 34, y2: 7, stroke: line.color, "stroke-width": width || line.width,
  "stroke-dasharray": line.dash && line.dash !== "solid" ? line.dash : "none" });
const polygon = (look) => {
  const drawn = { transform: "translate(17 7)", fill: look.fill, stroke: css("--ink"), "stroke-width": 1.6 };
  return look.symbol === "circle" ? drawing("circle", { ...drawn, r: 5 }) : drawing("polygon", { ...drawn, points: CORNERS[look.symbol] });
};
function key() {
  const points = [...new Map(data.states.filter((s) => s.kind).map((s) => [s.word, s])).values()];
  const entries = [
    ...compared.map((c) => [c.label, sample({ color: c.color, width: 3 })]),
    ...grouped(data.lines).map(([line]) => [line.label, sample({ color: ink(line), dash: line.dash, width: line.width })]),
    ...grouped(data.bands).map(([band]) => [band.label, sample({ color: ink(band) }, 10)]),
    ...(data.snaps.length ? [["snap", sample({ color: SNAP, width: 2 })]] : []),
    ...points.map((s) => [s.word, polygon(markerOf(s))]),
  ];
  const told = JSON.stringify([night.matches, data.heading, entries.map(([label, part]) => [label, part.outerHTML])]);
  if (byId("key").dataset.told === told) return; // nothing on the page moves while the same things are shown
  byId("key").dataset.told = told;
  byId("key").replaceChildren(...(data.heading ? [make("em", data.heading)] : []), ...entries.map(([label, part]) => {
    const entry = make("span", ""), picture = drawing("svg", { width: 34, height: 14, "aria-hidden": true });
    picture.append(part);
    entry.append(picture, label);
    return entry;
  }));
}
function ring() {
  const plot = byId("diagram"), place = data.states[shown].values, last = plot.data.length - 1;
  Plotly.restyle(plot, { x: [[place[column(byId("across").value)]]], y: [[place[column(byId("up").value)]]] }, [last]);
}

// --- the membrane

const colorscale = () => {
  const n = data.zones.length;
  return data.zones.flatMap((zone, k) => [[k / n, zone.color], [(k + 1) / n, zone.color]]);
};
// so many that short waves are round, and so high that they are waves and no needles
const sectorsOf = (mode) => Math.min(Math.max(SECTORS, PER_WAVE * (mode ? mode.n : 0)), MOST_SECTORS);
const amplitude = (mode) => Math.min(AMPLITUDE * extent(), mode && mode.n ? (OF_A_WAVE * 2 * Math.PI * data.box[0]) / mode.n : Infinity);
function turned(rho, eta, mode, part) {
  const x = [], y = [], z = [], size = part * amplitude(mode), sectors = sectorsOf(mode);
  for (let i = 0; i < rho.length; i++) for (let j = 0; j < sectors; j++) {
    const angle = (2 * Math.PI * j) / sectors, [c, s] = [Math.cos(angle), Math.sin(angle)];
    const wave = mode ? Math.cos(mode.n * angle) : 0, radial = rho[i] + (mode ? size * mode.u[i] * wave : 0);
    const around = mode && mode.c ? size * mode.c[i] * Math.sin(mode.n * angle) : 0;
    x.push(radial * c - around * s); y.push(radial * s + around * c); z.push(eta[i] + (mode ? size * mode.w[i] * wave : 0));
  }
  return { x, y, z };
}
function triangles(count, sectors) {
  const i = [], j = [], k = [];
  for (let a = 0; a < count - 1; a++) for (let b = 0; b < sectors; b++) {
    const c = (b + 1) % sectors, [p, q, r, s] = [a * sectors + b, a * sectors + c, (a + 1) * sectors + c, (a + 1) * sectors + b];
    i.push(p, p); j.push(q, r); k.push(r, s);
  }
  return { i, j, k };
}
const extent = () => Math.max(2 * data.box[0], data.box[2] - data.box[1]);
const range = (name) => {
  const known = (data.shapes || []).filter(Boolean).flatMap((shape) => shape.fields[name] || []).filter((v) => v !== null);
  const low = known.reduce((a, b) => Math.min(a, b), Infinity), high = known.reduce((a, b) => Math.max(a, b), -Infinity);
  return high - low > 0.01 * Math.max(Math.abs(low), Math.abs(high)) ? [low, high] : [low - 0.005 * Math.abs(low || 1), high + 0.005 * Math.abs(high || 1)];
};
const circle = (radius, z, look) => {
  const turn = [...Array(SECTORS + 1).keys()].map((k) => (2 * Math.PI * k) / SECTORS);
  return { type: "scatter3d", mode: "lines", hoverinfo: "skip", showlegend: false, x: turn.map((t) => radius * Math.cos(t)),
    y: turn.map((t) => radius * Math.sin(t)), z: turn.map(() => z), line: { color: css("--ink"), width: 4 }, ...look };
};
function bodies() {
  const red = { line: { color: "#b03060", width: 6 } }, size = 0.11 * extent();
  return data.bodies.flatMap((body) => {
    const parts = body.rho.length === 1 && body.rho[0] === 0
      ? [{ type: "scatter3d", mode: "markers", x: [0], y: [0], z: body.z, marker: { color: "#b03060", size: 7 }, hoverinfo: "text", hovertext: body.label, showlegend: false }]
      : body.rho.length > 1 && body.rho.some((r) => r > 0)
        ? [{ type: "mesh3d", ...turned(body.rho, body.z, null, 0), ...triangles(body.rho.length, SECTORS), color: body.rigid ? "#8a8f94" : "#b03060",
          opacity: 0.45, hoverinfo: "text", hovertext: body.label, showscale: false }]
        : body.rho[0] > 0 ? [circle(body.rho[0], body.z[0], red)]
        : [{ type: "scatter3d", mode: "lines", x: body.rho.map(() => 0), y: body.rho.map(() => 0), z: body.z, hoverinfo: "text", hovertext: body.label, showlegend: false, ...red }];
    const middle = body.z.reduce((a, b) => a + b, 0) / body.z.length;
    if (body.moment) parts.push({ type: "cone", x: [0], y: [0], z: [middle + body.moment * size * 0.6], u: [0], v: [0], w: [body.moment],
      sizemode: "absolute", sizeref: size, showscale: false, hoverinfo: "skip", colorscale: [[0, "#b03060"], [1, "#b03060"]] });
    return parts;
  });
}
let drawn = null, wanted = 0;
async function space() {
  const ask = ++wanted, k = shown, shape = await shapeOf(k);
  if (ask !== wanted) return;
  drawn = shape;
  const name = byId("color").value, mode = chosenMode(shape), edges = [0, shape.rho.length - 1].filter((e) => shape.rho[e] > 1e-6 * data.box[0]);
  const sectors = sectorsOf(mode), cells = triangles(shape.rho.length, sectors), [low, high] = name === ZONED ? [-0.5, data.zones.length - 0.5] : range(name);
  const label = (data.fields.find((f) => f.name === name) || { label: data.zoned }).label;
  const colors = name === ZONED
    ? { intensitymode: "cell", intensity: shape.zone.flatMap((kind) => Array(2 * sectors).fill(kind)), colorscale: colorscale() }
    : { intensitymode: "vertex", intensity: shape.fields[name].flatMap((v) => Array(sectors).fill(v)), colorscale: "Viridis" };
  const ticks = name === ZONED ? { tickvals: data.zones.map((_, n) => n), ticktext: data.zones.map((zone) => zone.label.replace(" wrinkles", "")) } : {};
  const flat = byId("space").clientWidth < 420 ? { orientation: "h", y: -0.02, len: 0.9 } : {};
  const mesh = { type: "mesh3d", ...turned(shape.rho, shape.eta, mode, mode ? phase : 0), ...cells, ...colors, cmin: low, cmax: high,
    hoverinfo: "skip", flatshading: false, lighting: { ambient: 0.65, diffuse: 0.5, specular: 0.05, roughness: 0.9 },
    colorbar: { title: { text: label.replace(/(.{14,}?) /g, "$1<br>"), side: "top", font: { size: 11 } }, thickness: 14, len: 0.75, ...ticks, ...flat } };
  const rest = edges.map((e) => circle(shape.rho[e], shape.eta[e]));
  const hubs = shape.hubs.map(([r, z]) => circle(r, z, { line: { color: css("--soft"), width: 8 } }));
  const [radius, bottom, top] = data.box, spare = mode ? AMPLITUDE * extent() : 0.02 * extent();
  const heights = data.bodies.flatMap((b) => b.z.flatMap((z) => [z - 0.1 * extent(), z + 0.17 * extent()])).concat(bottom - spare, top + spare);
  const width = Math.max(radius, ...data.bodies.flatMap((b) => b.rho)) + spare, unit = data.length ? ` in ${data.length}` : "";
  const axis = (title, limits) => ({ title: { text: title + unit }, range: limits, gridcolor: css("--line"), backgroundcolor: "rgba(0,0,0,0)", nticks: 5 });
  const layout = { paper_bgcolor: "rgba(0,0,0,0)", font: { color: css("--ink"), size: 11 }, margin: { l: 0, r: 0, t: 0, b: 0 },
    modebar: quiet(), uirevision: "camera", scene: { aspectmode: "data", uirevision: "camera", camera: { eye: { x: 0.3, y: -1.05, z: 0.4 }, projection: { type: "orthographic" } },
      xaxis: axis("x", [-width, width]), yaxis: axis("y", [-width, width]), zaxis: axis("z", [Math.min(...heights), Math.max(...heights)]) } };
  await Plotly.react("space", [mesh, ...rest, ...hubs, ...bodies()], layout, { responsive: true, displaylogo: false });
  meridian(shape);
  zones(shape);
  window.explorer.drawn = k;
}
const chosenMode = (shape) => shape.modes[Number(byId("mode").value)];
function modes(shape) {
  const kept = byId("mode").value || "none";
  fill(byId("mode"), [["none", "at rest"], ...shape.modes.map((mode, k) => [String(k), mode.label])], shape.modes[Number(kept)] ? kept : "none");
}
function meridian(shape) {
  const mode = chosenMode(shape), size = amplitude(mode) * phase, rho = shape.rho, eta = shape.eta;
  const line = (r, z, look) => ({ type: "scatter", mode: "lines", hoverinfo: "skip", showlegend: false, x: r, y: z, ...look,
    line: { ...look.line, simplify: false } }); // Plotly leaves out points of thick lines, and what is round gets corners
  const traces = [], seen = new Set();
  for (let a = 0, b; a < shape.zone.length; a = b) {
    for (b = a + 1; b < shape.zone.length && shape.zone[b] === shape.zone[a]; b++);
    const zone = data.zones[shape.zone[a]], part = (v) => v.slice(a, b + 1), taut = zone.kind === "taut";
    for (const side of [1, -1]) traces.push(line(part(rho).map((r) => side * r), part(eta), { name: zone.label,
      showlegend: side > 0 && !taut && !seen.has(zone.kind), line: { color: taut ? css("--accent") : zone.color, width: taut ? 3 : 8 } }));
    seen.add(zone.kind);
  }
  if (mode) for (const side of [1, -1]) {
    const wave = side < 0 && mode.n % 2 ? -1 : 1;
    traces.push(line(rho.map((r, k) => side * (r + wave * size * mode.u[k])), eta.map((z, k) => z + wave * size * mode.w[k]),
      { name: "mode", showlegend: side > 0, line: { color: "#c2184e", width: 1.5, dash: "dash" } }));
  }
  for (const [r, z] of shape.hubs) traces.push(line([-r, r], [z, z], { line: { color: css("--soft"), width: 6 } }));
  for (const body of data.bodies) for (const side of body.rho.some((r) => r > 0) ? [1, -1] : [1])
    traces.push(line(body.rho.map((r) => side * r), body.z, { mode: body.rho.length > 1 ? "lines" : "markers", name: body.label, showlegend: side > 0 && body.label !== "",
      line: { color: body.rigid ? css("--soft") : "#b03060", width: 3 }, marker: { color: "#b03060", size: 9 } }));
  const unit = data.length ? ` in ${data.length}` : "", layout = frame(`radius ρ${unit || " / R₀"}`, `height η${unit || " / R₀"}`);
  const spare = 0.06 * extent(), heights = [data.box[1], data.box[2], ...data.bodies.flatMap((b) => b.z)];
  layout.yaxis = { ...layout.yaxis, scaleanchor: "x", range: [Math.min(...heights) - spare, Math.max(...heights) + spare] };
  layout.xaxis.range = [-data.box[0] - spare, data.box[0] + spare];
  layout.legend = { ...below(0.28), orientation: "h" };
  layout.showlegend = true;
  Plotly.react("meridian", traces, layout, { responsive: true, displaylogo: false });
}
function zones(shape) {
  const table = make("table"), head = table.createTHead().insertRow(), body = table.createTBody();
  for (const name of ["zone", "r from", "to", "ρ from", "to", "part of the area"]) head.append(make("th", name));
  for (const row of shape.zones) {
    const line = body.insertRow();
    for (const value of row) line.append(make("td", text(value), typeof value === "number" ? "number" : ""));
  }
  byId("zoned").textContent = data.zoned;
  byId("zones").replaceChildren(table);
}

// --- one state

const against = (what) => (what.startsWith("axisymmetric") ? ` against axisymmetric perturbations${what.slice(12)}` : ` against ${what}`);
function state() {
  const found = data.states[shown];
  byId("name").textContent = byId("heading").textContent = found.name;
  byId("slider").value = shown;
  byId("numbers").replaceChildren(...data.quantities.flatMap((q, k) => (q.name === "step" ? [] : [make("dt", q.label), make("dd", text(found.values[k]))])));
  const verdicts = found.verdicts.map((v) => {
    const line = make("p", "", "verdict");
    line.append(make("b", v.word, v.word), against(v.against), make("span", v.reason));
    return line;
  });
  byId("verdicts").replaceChildren(...(verdicts.length ? verdicts : [make("p", "Stability was not tested in this run.")]));
  const answers = make("dl");
  answers.append(...found.answers.flatMap(([subject, said]) => [make("dt", subject), make("dd", said)]));
  byId("answers").replaceChildren(answers);
}
async function show(k, pinned = true) {
  shown = Math.min(Math.max(k, 0), data.states.length - 1);
  if (pinned) now = shown;
  state();
  ring();
  modes(await shapeOf(shown));
  await space();
}
function points() {
  const found = data.states.map((s, k) => [s, k]).filter(([s]) => s.kind), [x, y] = data.axes.map(column);
  byId("points").replaceChildren(...found.map(([s, k]) => {
    const button = make("button", `${s.name}: ${[y, x].map((c) => `${data.quantities[c].label.split(" ")[1] || data.quantities[c].label} ${text(Number(s.values[c].toPrecision(5)))}`).join(", ")}`);
    button.onclick = () => show(k);
    return button;
  }));
}
function play() {
  const run = byId("play");
  if (playing) { clearInterval(playing); playing = null; run.textContent = "Play"; run.setAttribute("aria-pressed", "false"); return; }
  if (now >= data.states.length - 1) show(0);
  run.textContent = "Stop";
  run.setAttribute("aria-pressed", "true");
  playing = setInterval(() => (now < data.states.length - 1 ? show(now + 1) : play()), 120);
}
function move() {
  if (motion) { cancelAnimationFrame(motion); motion = null; phase = 1; } else {
    if (byId("mode").value === "none" && byId("mode").options.length > 1) byId("mode").value = "0";
    const start = performance.now();
    let last = 0;
    const tick = (time) => {
      motion = requestAnimationFrame(tick);
      if (time - last < FRAME || !drawn) return;
      last = time;
      phase = Math.cos((2 * Math.PI * (time - start)) / 1500);
      const moved = turned(drawn.rho, drawn.eta, chosenMode(drawn), phase);
      Plotly.restyle("space", { x: [moved.x], y: [moved.y], z: [moved.z] }, [0]);
    };
    motion = requestAnimationFrame(tick);
  }
  byId("motion").setAttribute("aria-pressed", String(Boolean(motion)));
  space();
}
const next = (select) => { select.selectedIndex = (select.selectedIndex + 1) % select.options.length; select.dispatchEvent(new Event("change")); };
const KEYS = {
  ArrowLeft: () => show(now - 1), ArrowRight: () => show(now + 1), Home: () => show(0), End: () => show(data.states.length - 1), " ": play,
  p: () => { const after = data.states.findIndex((s, k) => s.kind && k > now); show(after < 0 ? Math.max(data.states.findIndex((s) => s.kind), 0) : after); },
  c: () => next(byId("color")), m: () => next(byId("mode")),
};
function keys(event) {
  const busy = /^(INPUT|SELECT|TEXTAREA|BUTTON)$/.test(event.target.tagName) && !(event.target.id === "slider" && event.key.length === 1 && event.key !== " ");
  const action = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (busy || !action || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  action();
}
function choices() {
  const quantities = data.quantities.map((q) => [q.name, q.label]);
  const keep = (id, chosen) => (quantities.some(([name]) => name === byId(id).value) ? byId(id).value : chosen);
  fill(byId("across"), quantities, keep("across", data.axes[0]));
  fill(byId("up"), quantities, keep("up", data.axes[1]));
  fill(byId("color"), [...data.fields.map((f) => [f.name, f.label]), [ZONED, "zones"]], byId("color").value || "stretch_2");
  document.body.classList.toggle("single", data.states.length === 1);
  byId("slider").max = data.states.length - 1;
  byId("status").replaceChildren(make("b", data.status, data.good ? "good" : "bad"), ...[data.message, ...data.notes].filter(Boolean).map((n) => make("span", ` ${n}`)));
}
async function start() {
  await unpacked();
  choices();
  diagram();
  points();
  for (const id of ["across", "up"]) byId(id).onchange = diagram;
  for (const id of ["color", "mode"]) byId(id).onchange = space;
  byId("slider").oninput = (event) => show(Number(event.target.value));
  byId("back").onclick = KEYS.ArrowLeft;
  byId("on").onclick = KEYS.ArrowRight;
  byId("play").onclick = play;
  byId("motion").onclick = move;
  document.addEventListener("keydown", keys);
  const plot = byId("diagram"), place = (event) => event.points.map((point) => point.customdata).find(Number.isInteger);
  plot.on("plotly_click", (event) => place(event) !== undefined && show(place(event)));
  plot.on("plotly_hover", (event) => place(event) !== undefined && !playing && show(place(event), false));
  plot.on("plotly_unhover", () => shown !== now && !playing && show(now));
  night.addEventListener("change", () => { diagram(); space(); });
  await show(data.states.length - 1);
  window.explorer.ready = true;
  fit();
}
// in a frame of a notebook: as high as it is, in place of the still picture before it
function fit() {
  let frame = null;
  try { frame = window.frameElement; } catch { /* of another origin */ }
  if (!frame || !frame.dataset.femmembrane) return;
  frame.style.height = `${document.documentElement.scrollHeight + 8}px`;
  if (frame.previousElementSibling) frame.previousElementSibling.hidden = true;
}
start();
