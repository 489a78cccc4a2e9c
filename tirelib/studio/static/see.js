// Step 2: where the model fails: a map of what is left, the chosen run, and any number over any condition.
import { active, app, arraysOf, current, documentOf, inDegrees, inView, isFinding, measured, pathOf, RMS_LEFT, rmsOf, stepOf, verdictOf, wish } from "./data.js";
import { choose, csvButton, fill, h, number, unitName } from "./dom.js";
import { Heat, limitOf } from "./heat.js";
import { Plot } from "./plots.js";
import { CONDITIONS, forceRows, isStrain, mean, niceTicks, rms, runWords, share, sliced, slipOf, strainRows, unitOf, varying, BINS } from "./maps.js";

const TICKS = [-180, -120, -60, 0, 60, 120, 180];
const VALUES = { difference: "model less measured", white: "residual as the error counts it", measured: "measured" };
// In the name of a line: the errors of the set points are taken out of the residual of strain, and of no curve of measurement and model.
const named = (data, y) => `${VALUES[y]}${isStrain(data) && y === "difference" ? ", errors of the set points taken out" : ""}`;
// Which of them are known: before the first fit only what was measured.
const known = (data) => Object.keys(VALUES).filter((key) => data[key]?.some(Number.isFinite));

// The row that is looked at first: where the model fails most.
const worstOf = (rows) => rows.reduce((best, row, i) => (rms(row.values) > rms(rows[best].values) ? i : best), 0);

// The map with its controls and the plots of the chosen row; the next step shows the same with a trace.
export class Field {
  constructor({ height = 400, onRow = null } = {}) {
    this.by = "load"; this.value = "difference"; this.gage = ""; this.row = null; this.range = null; this.trace = null; this.onRow = onRow;
    this.heat = new Heat("Map of the residual; arrow keys choose a run, with Shift a range", { height, choose: (at) => { this.row = at.row; this.detail(); }, brush: (range) => this.brush(range) });
    this.controls = h("div", { class: "row" });
    this.said = h("p", { class: "small", role: "status" });
    this.element = h("div", { class: "card" }, this.controls, this.heat.element, this.said);
    this.curve = new Plot("curve", { height: 210 });
    this.rest = new Plot("residual", { height: 190, select: (range) => this.brush(range) });
  }

  async load(model) {
    this.model = model;
    const key = `${app.campaign.campaign}/${model.number}/${app.campaign.quantity}/${model.documents[`${app.campaign.quantity}/plots.npz`]}`;
    if (key === this.key) return Boolean(this.data);
    const root = pathOf(app.campaign, model)[0];
    this.first = root === model ? null : await arraysOf(root, "plots").catch(() => null);
    return this.take(key, await arraysOf(model, "plots"));
  }

  // What was measured, while there is no model yet; of another quantity than the one that was chosen it is not shown.
  async loadMeasured() {
    const key = `${app.campaign.campaign}/measured/${app.campaign.measured}`, data = await measured();
    if (current() && data?.texts.quantity !== app.campaign.quantity) return false;
    this.first = null;
    return key === this.key ? Boolean(this.data) : this.take(key, data);
  }

  take(key, data) {
    if (!data) return false;
    const bare = this.data && !this.data.difference; // what was looked at before had no model
    this.key = key; this.data = data; this.trace = null;
    if (bare) this.row = null;
    if (Number(this.gage) >= (data.gages?.length ?? 0)) this.gage = "";
    if (bare || !known(data).includes(this.value)) [this.value] = known(data);
    const orders = this.orders(data).map(([k]) => k);
    if (!orders.includes(this.by)) [this.by] = orders;
    this.build();
    return true;
  }

  // What rows can be sorted by: conditions that vary, without the slip that the map goes over.
  orders(data) {
    if (isStrain(data)) return [["load", "load"], ["pressure", "pressure"], ["speed", "speed"], ["order", "time order"]];
    const [slip] = slipOf(data), found = varying(data).filter(([k]) => k !== slip && !["temperature", "order"].includes(k)).map(([k, text]) => [k, text]);
    return found.length ? found : [["load", "load"]];
  }

  build() {
    const { data } = this, strain = isStrain(data);
    const shown = this.trace ? "difference" : this.value; // a trace has the scale of the residual
    this.unit = shown === "white" ? unitName("noise") : unitOf(data);
    const byGage = !this.trace && strain && data[BY_GAGE[this.value]], gages = strain ? [["", "mean"], ...Array.from(data.gages, (_, g) => [String(g), gageName(data, g)])] : [];
    const shownData = byGage && this.gage !== "" ? { ...data, gage: strided(data, BY_GAGE[this.value], Number(this.gage)), shapes: { ...data.shapes, gage: data.shapes.measured } } : this.trace ? { ...data, trace: this.trace.values, shapes: { ...data.shapes, trace: data.shapes.difference } } : data;
    const name = this.trace ? "trace" : byGage && this.gage !== "" ? "gage" : this.value;
    if (strain) {
      this.rows = strainRows(shownData, this.by, name);
      this.columns = data.angle.length;
      this.x = { title: "wheel angle [deg] (0: under the axle, entry < 0)", low: -180, high: 180, ticks: TICKS };
    } else {
      const found = forceRows(shownData, this.by, name);
      this.rows = found.rows; this.slip = found.slip; this.columns = BINS;
      this.x = { ...found.slip, ticks: niceTicks(found.slip.low, found.slip.high) };
    }
    this.row = Math.min(this.row ?? (data.difference ? worstOf(this.rows) : 0), this.rows.length - 1);
    this.limit = limitOf((this.own || !this.first?.[shown] ? data : this.first)[shown]); // that of the base model, so that a fall is seen
    this.heat.at.row = this.row;
    this.heat.show({ columns: this.columns, rows: this.rows, x: this.x, unit: this.unit, limit: this.limit, say: (r, c) => this.cell(r, c) });
    const title = this.trace ? `What ${this.trace.name} takes of the residual` : this.value === "measured" ? "What was measured" : "What is left";
    const of = strain ? `, ${this.gage === "" || !byGage ? "mean of the gages" : `gage ${gageName(data, this.gage)}`}` : ` of ${data.texts.quantity}`;
    fill(this.controls, h("h2", {}, `${title}${of} [${this.unit}]`), h("span", { class: "room" }),
      choose(this.orders(data), this.by, (by) => this.sort(by), "rows by"),
      choose(known(data).map((k) => [k, VALUES[k]]), this.value, (v) => { this.value = v; this.build(); this.detail(); }, "values"),
      byGage && gages.length > 2 ? choose(gages, this.gage, (gage) => { this.gage = gage; this.build(); this.detail(); }, "gage") : null,
      this.first ? choose([["", "of the base model"], ["1", "of this model"]], this.own ? "1" : "", (own) => { this.own = own; this.build(); this.detail(); }, "colour scale") : null,
      choose([["diverging", "blue and red"], ["cividis", "dark to light"]], this.heat.colors, (c) => { this.heat.colors = c; this.heat.image = null; this.heat.draw(); }, "colours"),
      csvButton("map", () => this.heat.columns(strain ? 0 : 0.5)));
    this.stats();
  }

  // The chosen run stays the chosen one; of forces the rows themselves are other ones.
  sort(by) {
    const { index } = this.rows[this.row];
    this.by = by;
    this.build();
    const at = index === undefined ? -1 : this.rows.findIndex((row) => row.index === index);
    if (at >= 0) { this.row = this.heat.at.row = at; this.heat.draw(); }
    this.detail();
  }

  cell(r, c) {
    const row = this.rows[r], at = this.x.low + ((c + 0.5) * (this.x.high - this.x.low)) / this.columns;
    return `${row.label}; at ${number(at, 3)} ${isStrain(this.data) ? "deg" : "slip"}: ${number(row.values[c])} ${this.unit}`;
  }

  brush(range) { this.range = this.heat.range = range; this.heat.draw(); this.stats(); this.detail(); }

  stats() {
    const { data, range } = this;
    if (!range) { this.said.textContent = `${isStrain(data) ? (data.edges ? "The thin lines are the edges of the model's contact. The errors of the set points (load, pressure, gain and angle of each run) are taken out of the map. " : "") : "Where the map is grey, nothing was measured. "}Drag over the map or the plot (at the keyboard: Shift with the arrow keys) to see the rms of a range and its share of the squares.`; return; }
    const at = (k) => this.x.low + ((k + 0.5) * (this.x.high - this.x.low)) / this.columns;
    const found = share(data, this.value, this.rows, (k) => at(k) >= range[0] && at(k) <= range[1], data.counted);
    fill(this.said, `From ${number(range[0])} to ${number(range[1])}${isStrain(data) || this.slip.key === "slip_angle" ? " deg" : ""}: rms ${number(found.rms)} ${this.unit}, ${number(100 * found.share, 3)} % of the squares, ${found.count} values. `, h("button", { class: "small", type: "button", id: "clear-range", onclick: () => this.brush(null) }, "Clear the range"));
  }

  overlay(trace) { this.trace = trace; this.build(); this.detail(); }

  detail() {
    const { data } = this;
    if (!data || !this.rows.length) return;
    if (this.onRow) this.onRow(this.rows[this.row]);
  }
}

export class See {
  constructor(go) {
    this.go = go; this.x = "angle"; this.y = "difference"; this.gages = false;
    this.field = new Field({ onRow: () => this.plots() });
    this.head = h("div", { class: "card" });
    this.tools = h("div", { class: "row" });
    this.tools2 = h("div", { class: "row" });
    this.side = h("div", {}, h("div", { class: "card" }, this.tools, this.field.curve.element), h("div", { class: "card" }, this.tools2, this.field.rest.element));
    this.body = h("div", { class: "two wide-left" }, this.field.element, this.side);
    this.element = h("div", {}, this.head, this.body);
    this.resized = () => this.arrange();
    window.addEventListener("resize", this.resized);
  }

  leave() { window.removeEventListener("resize", this.resized); this.field.curve.remove(); this.field.rest.remove(); }

  // The map and the two plots fill the window, and are never smaller than on a small one.
  arrange() {
    const { heat, curve, rest, element } = this.field;
    if (this.body.hidden || !this.body.clientWidth) return;
    const beside = this.side.offsetLeft > element.offsetLeft; // on a narrow window they stand below each other
    const free = beside ? window.innerHeight - document.querySelector("footer").offsetHeight - this.body.getBoundingClientRect().top - window.scrollY - 36 : 0;
    const drawn = heat.canvas.clientHeight, plots = curve.place.clientHeight + rest.place.clientHeight;
    heat.fixed = Math.max(400, free - (element.clientHeight - drawn));
    const other = free - (this.side.clientHeight - plots);
    curve.fixed = Math.max(210, 0.52 * other); rest.fixed = Math.max(190, 0.48 * other);
    heat.draw(); curve.fit(); rest.fit();
  }

  async update() {
    const model = inView();
    const compared = model && (await documentOf(model, "comparison").catch(() => null));
    const before = this.fitted;
    this.fitted = Boolean(compared && (await this.field.load(model).catch(() => false)));
    if (this.fitted && before === false) this.y = "difference";
    if (!this.fitted) {
      wait(this.head);
      this.body.hidden = !app.campaign || !(await this.field.loadMeasured().catch(() => false));
      if (!this.body.hidden) this.plots();
      return;
    }
    this.body.hidden = false;
    const c = compared, said = [...c.statements, ...c.messages], none = model.verdict === "none";
    fill(this.head, h("div", { class: "row" },
      h("div", { class: "figures" }, h("div", {}, h("span", { class: "quiet" }, "error of the model"), h("b", { id: "error" }, number(c.error, 4)), h("span", { class: "quiet small" }, unitName(c.error_unit))),
        c.noise ? h("div", {}, h("span", { class: "quiet" }, "noise of the repeats"), h("b", {}, number(c.noise, 3)), h("span", { class: "quiet small" }, unitName(c.unit))) : null,
        h("div", {}, h("span", { class: "quiet" }, RMS_LEFT), h("b", { id: "rms" }, number(c.residual_rms_raw, 3)), h("span", { class: "quiet small" }, rmsOf(c))),
        h("div", {}, h("span", { class: "quiet" }, "verdict"), h("b", {}, verdictOf(model.verdict, c.error_unit, model.named) || (c.verdict === "fits" ? "the model fits" : "not known yet")), h("span", { class: "quiet small" }, !c.noise ? "the noise is not known" : c.verdict === "fits" ? "what is left is noise" : none ? "what is left is noise and the structure of a tire" : "what is left is more than noise"))),
      h("span", { class: "room" }), h("button", { class: "main", type: "button", onclick: () => this.go("suspect") }, "Find what is missing")),
    c.error_unit === "noise" ? h("p", { class: "small quiet" }, c.quantity === "strain" ? "The error is the rms of the residual in multiples of the noise, with the errors of the set points counted as noise: load, pressure, gain and angle of each run may be off by the tolerances of the campaign. So it is smaller than the rms of model less measured divided by the noise, and a model without a fault has the error 1." : "The error is the rms of model less measured in multiples of the noise; a model without a fault has the error 1.") : null,
    said.length ? h("details", {}, h("summary", {}, `${none ? "Where model and measurement differ, though no more than in plain tires" : "Where it fails"}, in words (${said.length})`), h("ul", {}, said.map((s) => h("li", {}, inDegrees(s))))) : null);
    this.plots();
  }

  progress() { if (!this.fitted) wait(this.head); }

  plots() {
    const { field } = this, { data } = field;
    const strain = isStrain(data), has = varying(data), [slipKey] = slipOf(data);
    if (!strain && ["angle", "place", "phase"].includes(this.x)) this.x = slipKey;
    if (strain && !["angle", "place", "phase"].includes(this.x) && !data[this.x]) this.x = "angle";
    fill(this.tools, h("h2", {}, strain ? runWords(data, field.rows[field.row].index) : field.rows[field.row].label), h("span", { class: "room" }),
      strain ? h("label", {}, h("input", { type: "checkbox", checked: this.gages, onchange: (e) => { this.gages = e.target.checked; this.plots(); } }), " each gage") : null);
    const xs = [...(strain ? [["angle", "wheel angle"], ...(data.edges ? [["place", "place in the contact"]] : [])] : []), ...has.map(([k, t]) => [k, t]), ...(strain ? [["phase", "once-per-turn phase"]] : [])];
    const ys = known(data).map((k) => [k, VALUES[k]]);
    if (!known(data).includes(this.y)) [this.y] = known(data);
    if (this.x === "place" && !data.edges) this.x = "angle";
    fill(this.tools2, choose(ys, this.y, (v) => { this.y = v; this.plots(); }, "y"), choose(xs, this.x, (v) => { this.x = v; this.plots(); }, "over"));
    if (strain) this.strainPlots(); else this.forcePlots();
    this.arrange();
  }

  strainPlots() {
    const { field } = this, { data } = field, i = field.rows[field.row].index, along = this.x === "place" ? "place" : "angle";
    const [a, b] = along === "place" ? [data.edges[2 * i], data.edges[2 * i + 1]] : [];
    const xs = along === "place" ? data.angle.map((x) => (2 * x - a - b) / (b - a)) : data.angle;
    const x = { title: along === "place" ? "place in the model's contact [1] (entry −1, exit +1)" : "wheel angle [deg]", values: Array.from(xs), range: along === "place" ? [-3, 3] : undefined };
    const one = (name) => sliced(data, name, i), noise = data.noise?.[0];
    const measured = one("measured"), gages = this.gages ? gageLines(data, i, "measured_by_gage") : [];
    const band = Number.isFinite(noise) ? [{ name: "noise, upper", values: measured.map((v) => v + 2 * noise), color: "measured", width: 0.5, quiet: true }, { name: "noise, lower", values: measured.map((v) => v - 2 * noise), color: "measured", width: 0.5, quiet: true }] : [];
    field.curve.show({ title: `strain, mean of the gages; the model at load, pressure, gain and angle as recorded${band.length ? "; band: ± 2 noise" : ""}`, unit: "microstrain", x, bands: band.length ? [[1, 2, "measured"]] : [], series: [...band, { name: "measured", values: measured, color: "measured" }, ...(data.model ? [{ name: "model", values: one("model"), color: "model", dash: [8, 4] }] : []), ...gages] });
    if (["angle", "place"].includes(this.x)) {
      const lines = this.gages && this.y !== "white" ? gageLines(data, i, this.y === "measured" ? "measured_by_gage" : "by_gage") : [];
      const unit = this.y === "white" ? unitName("noise") : "microstrain";
      field.rest.points = false;
      field.rest.show({ title: `${named(data, this.y)}; this run, mean of the gages`, unit, x, series: [{ name: named(data, this.y), values: one(this.y), color: this.y === "measured" ? "measured" : "rest" }, ...lines] });
      return;
    }
    const inside = (k) => !field.range || (data.angle[k] >= field.range[0] && data.angle[k] <= field.range[1]);
    const part = (run) => sliced(data, this.y, run).filter((_, k) => inside(k));
    const runs = [...data.run.keys()], where = field.range ? "of the chosen range" : "of the whole turn";
    const means = field.range ? runs.map((r) => mean(part(r))) : null, sizes = runs.map((r) => rms(part(r)));
    const phases = this.x === "phase" ? runs.map((r) => phase(sliced(data, this.y, r), data.angle)) : null;
    const values = phases ? phases.map((p) => p.phase) : Array.from(data[this.x]);
    const order = runs.slice().sort((p, q) => values[p] - values[q]);
    const [, title, unit] = CONDITIONS.find(([k]) => k === this.x) || [null, "phase of the once-per-turn part", "deg"];
    const series = phases ? [{ name: "amplitude once per turn", values: order.map((r) => phases[r].size), color: "rest", points: true }]
      : [{ name: "rms", values: order.map((r) => sizes[r]), color: "rest", points: true }, ...(means ? [{ name: "mean", values: order.map((r) => means[r]), color: "model", points: true, hollow: true }] : [])];
    field.rest.points = true;
    field.rest.chosen = (at) => { const run = order[at]; field.row = field.rows.findIndex((r) => r.index === run); field.heat.at.row = field.row; field.heat.draw(); this.plots(); };
    field.rest.show({ title: `${named(data, this.y)}: of each run, ${where}; click a point to choose the run`, unit: this.y === "white" ? unitName("noise") : "microstrain", x: { title: `${title} [${unit}]`, values: order.map((r) => values[r]) }, extra: [["run", order.map((r) => data.run[r])]], series });
  }

  forcePlots() {
    const { field } = this, { data } = field, unit = unitOf(data), name = data.texts.quantity;
    const draw = (plot, members, key, series, title, label) => {
      const order = members.slice().sort((a, b) => data[key][a] - data[key][b]);
      const [, text, u] = CONDITIONS.find(([k]) => k === key);
      plot.points = true;
      plot.show({ title, unit: label, y: `${name}, ISO 8855 [${label}]`, x: { title: `${text} [${u}]`, values: order.map((i) => data[key][i]) }, extra: [["run", order.map((i) => data.run[i])]], series: series.map((s) => ({ ...s, points: true, values: order.map((i) => data[s.from][i]) })) });
    };
    draw(field.curve, field.rows[field.row].members, field.slip.key, [{ name: "measured", from: "measured", color: "measured" }, ...(data.model ? [{ name: "model", from: "model", color: "model", hollow: true }] : [])], data.model ? "measured (filled) and model (hollow) at these conditions" : "measured at these conditions", unit);
    draw(field.rest, [...data.run.keys()], this.x, [{ name: VALUES[this.y], from: this.y, color: "rest" }], "all points", this.y === "white" ? unitName("noise") : unit);
  }
}

const GAGE_DASH = [[1, 3], [5, 3], [12, 4], [8, 3, 1, 3], [14, 3, 4, 3]];
const BY_GAGE = { difference: "by_gage", measured: "measured_by_gage" };
const gageName = (data, g) => `y = ${number(data.gages[g], 3)} mm`;

// The waveforms of one gage in all runs.
function strided(data, name, g) {
  const [runs, gages, n] = data.shapes[name], out = new Float32Array(runs * n);
  for (let i = 0; i < runs; i += 1) out.set(data[name].subarray((i * gages + g) * n, (i * gages + g + 1) * n), i * n);
  return out;
}

function gageLines(data, i, name) {
  const [, gages, n] = data.shapes[name];
  return Array.from({ length: gages }, (_, g) => ({ name: `gage ${gageName(data, g)}`, values: data[name].subarray((i * gages + g) * n, (i * gages + g + 1) * n), color: `gage-${1 + (g % 5)}`, width: 1.7, dash: GAGE_DASH[g % 5] }));
}

function phase(values, angle) {
  let [re, im] = [0, 0];
  values.forEach((v, k) => { re += v * Math.cos((angle[k] * Math.PI) / 180); im += v * Math.sin((angle[k] * Math.PI) / 180); });
  return { phase: (180 / Math.PI) * Math.atan2(im, re), size: (2 / values.length) * Math.hypot(re, im) };
}

let asked = ""; // what was asked for last, so that it is asked for once

// What is computed while there is nothing to be seen, and what has failed.
export function wait(place, kinds = ["check", "identify", "compare"]) {
  const c = app.campaign;
  if (!c) { fill(place, h("p", {}, h("a", { href: "#/open/" }, "Open a campaign first."))); return; }
  const running = active().filter((job) => job.subject.campaign === c.campaign);
  const broken = c.jobs.filter((job) => ["failed", "interrupted", "cancelled"].includes(job.state) && kinds.includes(job.kind) && !isFinding(job)).at(-1);
  const model = current(), idle = model && !running.length && !broken;
  if (idle && asked !== `${c.campaign}/${model.number}/${c.quantity}`) {
    asked = `${c.campaign}/${model.number}/${c.quantity}`;
    wish({ do: "look", campaign: c.campaign, model: model.number, quantity: c.quantity });
  }
  fill(place, h("h2", {}, broken && !running.length ? broken.state === "cancelled" ? "It was cancelled" : "It could not be computed" : c.check?.errors ? "Nothing to be seen yet" : "Being computed"),
    running.length && !model ? h("p", { class: "quiet" }, inView() ? "The base model is fitted, and step 2 shows where it fails. How well each of its numbers is known is being computed; then the search for what is missing begins by itself." : "The campaign is checked while the base model is fitted to it; then they are compared, and the page shows it by itself. That takes some seconds to half a minute on an idle machine, longer beside other work. What was measured needs no model: step 2 shows it as soon as the runs are read.") : null,
    c.check?.errors ? h("p", { class: "bad" }, `The campaign has ${c.check.errors} ${c.check.errors === 1 ? "error" : "errors"}: `, h("a", { href: `#/open/${c.campaign}` }, "step 1 lists them with what to do"), ".") : null,
    broken?.state === "cancelled" && running.length ? h("p", { class: "warn" }, `${broken.title}: cancelled.`) : null,
    running.map((job) => h("p", {}, `${job.title}: ${stepOf(job)}`)),
    model && running.some((job) => job.kind === "diagnose") ? h("p", { class: "quiet" }, "A diagnosis tries the effects of the catalogue, alone and together: half a minute to three minutes on an idle machine for a campaign of 66 runs, longer beside other work. Step 2 can be used meanwhile.") : null,
    !running.length && broken ? [h("p", { class: "bad" }, `${broken.title}: ${broken.state}. ${broken.message} `, h("button", { class: "small", type: "button", onclick: () => wish({ do: "again", job: broken.job }) }, "Run again")), ways(c, model, broken.state === "cancelled")] : null);
}

// What can be done where a step of the way has failed: other quantities, where the model fails, what the fit says.
// What the user has ended has not failed: it is run again, or gone on without.
export function ways(c, model, ended = false) {
  if (!model) return null;
  const base = c.models.find((m) => m.parent === null && m.ready), errors = base?.fit?.force_errors || {}, advice = base?.advice || [];
  const others = c.quantities.filter((q) => q !== c.quantity), told = (q) => (errors[q]?.error ? `, error ${number(errors[q].error)} ${unitName(errors[q].error_unit)}` : "");
  return h("div", { id: "ways" }, h("h3", {}, "What can be done next"),
    h("ul", {},
      others.length ? h("li", {}, "Look at another quantity: ", others.map((q) => h("button", { class: "small", type: "button", "data-quantity": q, onclick: () => wish({ do: "look", campaign: c.campaign, model: model.number, quantity: q }) }, `${q}${told(q)}`))) : null,
      model.documents[`${c.quantity}/plots.npz`] ? h("li", {}, h("a", { href: `#/see/${c.campaign}` }, "See where the model fails"), ended ? "." : ", and in words what a fit as poor as this one may come from: a unit, a sign, another tire, a run that went wrong.") : null,
      ended && model.documents[`${c.quantity}/plots.npz`] ? h("li", {}, "Go on without a verdict: ", h("a", { href: `#/suspect/${c.campaign}` }, "tick an effect that you suspect"), " in step 3 and press Add; the fit tells what it takes away.") : null,
      c.models.length > 1 ? h("li", {}, h("a", { href: `#/add/${c.campaign}` }, "Continue from another model"), " of the history.") : null,
      advice.length && !ended ? h("li", {}, "Do what the fit of the base model says and advises:", h("ul", {}, advice.map((said) => h("li", {}, said)))) : null));
}
