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
      choices();
      diagram();
      points();
      state();
      cost(fresh);
      window.explorer.version = fresh.version;
      await new Promise(requestAnimationFrame);
    } catch (error) {
      byId("status").replaceChildren(make("b", "no branch", "bad"), make("span", ` ${error.message}`));
    }
  }
  live.busy = false;
  clearTimeout(live.idle);
  live.idle = setTimeout(() => show(now), REST); // shapes are drawn when the hand rests
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
