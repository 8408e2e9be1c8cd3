// The live page: sliders ask the server for the branch anew. A new question waits until the last one is answered and drawn.
const live = { values: {}, elements: data.live.elements, asked: false, busy: false, redraws: [], idle: null };
const REST = 180;
window.explorer.ask = async (what, body) => {
  const answer = await fetch(what, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  const found = await answer.json();
  if (!answer.ok) throw new Error(found.message);
  return found;
};
const question = () => ({ values: live.values, elements: live.elements === null ? null : data.live.choices[live.elements] });
function cost(fresh) {
  const now = performance.now();
  live.redraws = [...live.redraws.filter((t) => now - t < 1000), now];
  const error = fresh.error === null ? "no estimate" : `error ${fresh.error.toExponential(0)}`, size = fresh.mesh ? `${fresh.mesh}: ` : "";
  byId("cost").textContent = `${size}${fresh.milliseconds.toFixed(0)} ms, ${error} in P; ${live.redraws.length} redraws in the last second`;
  window.explorer.redraws = live.redraws.length;
}
async function ask() {
  live.asked = true;
  if (live.busy) return;
  live.busy = true;
  while (live.asked) {
    live.asked = false;
    try {
      const fresh = await window.explorer.ask("branch", question()), share = now / Math.max(data.states.length - 1, 1);
      fresh.live = data.live;
      data = fresh;
      now = shown = Math.round(share * (data.states.length - 1));
      if (!sketch()) diagram();
      cost(fresh);
      await new Promise(requestAnimationFrame);
    } catch (error) {
      byId("status").replaceChildren(make("b", "no branch", "bad"), make("span", ` ${error.message}`));
    }
  }
  live.busy = false;
  clearTimeout(live.idle);
  live.idle = setTimeout(rest, REST);
}
// While a hand moves, the curve alone is drawn, on the axes that are there: a tenth of the work of a diagram. Where it leaves them, or
// would be small on them, the diagram is drawn with axes that fit.
const FILLED = 0.4;
function fits(axis, c) {
  const [a, b] = axis.range, every = data.lines.flatMap((line) => line.values[c]).filter((v) => v !== null);
  const low = every.reduce((u, v) => Math.min(u, v), Infinity), high = every.reduce((u, v) => Math.max(u, v), -Infinity);
  return !axis.autorange || (low >= a && high <= b && high - low > FILLED * (b - a));
}
function sketch() {
  const of = byId("diagram")._fullLayout, [x, y] = ["across", "up"].map((id) => column(byId(id).value));
  if (!of || x < 0 || y < 0 || !fits(of.xaxis, x) || !fits(of.yaxis, y)) return false;
  const at = (values, k) => `${of.xaxis.l2p(values[x][k]).toFixed(1)} ${of.yaxis.l2p(values[y][k]).toFixed(1)}`;
  const path = (line, color, width) => drawing("path", { d: "M" + line.values[x].map((v, k) => (v === null || line.values[y][k] === null ? null
    : at(line.values, k))).filter(Boolean).join("L"), fill: "none", stroke: color, "stroke-width": width, "stroke-dasharray": line.dash && line.dash !== "solid" ? line.dash : "none" });
  const marks = data.states.filter((s) => s.kind).map((s) => {
    const mark = polygon(markerOf(s));
    mark.setAttribute("transform", `translate(${of.xaxis.l2p(s.values[x])} ${of.yaxis.l2p(s.values[y])})`);
    return mark;
  });
  const picture = byId("sketch");
  Object.assign(picture.style, { left: `${of.xaxis._offset}px`, top: `${of.yaxis._offset}px`, width: `${of.xaxis._length}px`, height: `${of.yaxis._length}px` });
  picture.replaceChildren(
    ...compared.flatMap((c) => c.lines.map((line) => path(line, c.color, line.width))),
    ...data.bands.map((band) => path(band, ink(band), 10)), ...data.lines.map((line) => path(line, ink(line), line.width)),
    ...data.snaps.map((snap) => path({ values: snap }, SNAP, 2)), ...marks);
  picture.parentElement.classList.add("sketched");
  return true;
}
// all is shown when the hand rests
async function rest() {
  choices();
  diagram();
  points();
  live.settled = data.version;
  await show(now);
}
function slider(of) {
  const row = make("label"), range = make("input"), exact = make("input");
  const step = (of.high - of.low) / 400;
  Object.assign(range, { type: "range", min: of.low, max: of.high, step, value: of.value, name: of.name });
  Object.assign(exact, { type: "number", step: "any", value: of.value });
  exact.setAttribute("aria-label", `${of.label}, exact`);
  const set = (value, from) => {
    if (!Number.isFinite(value)) return;
    live.values[of.name] = value;
    if (from !== exact) exact.value = Number(value.toPrecision(6));
    if (from !== range) range.value = value;
    ask();
  };
  range.oninput = () => set(Number(range.value), range);
  exact.onchange = () => set(exact.valueAsNumber, exact);
  row.append(make("span", of.label), range, exact);
  return row;
}
function accuracy() {
  const row = make("label"), range = make("input"), count = data.live.choices;
  Object.assign(range, { type: "range", min: 0, max: count.length - 1, step: 1, value: live.elements, name: "accuracy" });
  const shown = make("output", `${count[live.elements]} elements`);
  range.oninput = () => { live.elements = Number(range.value); shown.textContent = `${count[live.elements]} elements`; ask(); };
  row.append(make("span", "accuracy"), range, shown);
  return row;
}
function compare() {
  const colors = ["#56b4e9", "#e69f00", "#009e73", "#a01040", "#8a63a8"], changed = Object.entries(live.values);
  const label = changed.map(([name, value]) => `${name} = ${Number(value.toPrecision(4))}`).join(", ") || "as in the file";
  compared.push({ label, color: colors[compared.length % colors.length], lines: data.lines });
  diagram();
}
async function save(what) {
  const found = await window.explorer.ask("file", { ...question(), name: what });
  const link = Object.assign(make("a"), { href: URL.createObjectURL(new Blob([found.text])), download: what });
  link.click();
  URL.revokeObjectURL(link.href);
}
byId("live").append(...data.live.sliders.map(slider), ...(live.elements === null ? [] : [accuracy()]));
const row = make("div", "", "bar");
const button = (label, action) => Object.assign(make("button", label), { onclick: action });
row.append(button("Add to comparison", compare), button("Clear comparison", () => { compared = []; diagram(); }), button("Save scene", () => save("scene.toml")),
  button("Save table", () => save("branch.csv")), button("Save page", () => save("explore.html")), Object.assign(make("output", "", "cost"), { id: "cost" }));
byId("live").append(row);
cost(data);
