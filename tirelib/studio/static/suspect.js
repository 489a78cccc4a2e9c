// Step 3: which effect is missing: the verdict in four lines, the effects by part, the trace of each.
import { app, arraysOf, current, documentOf, failedOf, plain, verdictOf, wish } from "./data.js";
import { fill, h, number, strength, strengths, toast, unitName } from "./dom.js";
import { effectPage } from "./effect.js";
import { nextRun } from "./next.js";
import { Plot } from "./plots.js";
import { Field, wait } from "./see.js";
import { isStrain, sliced, unitOf, valueTitle } from "./maps.js";

const TITLES = { missing: "What is missing", sure: "How sure", error: "The error", next: "What to do next" };
const KINDS = ["check", "identify", "compare", "diagnose"];
const ORDER = ["belt", "sidewall", "tread", "contact", "gages", "rig"];

export class Suspect {
  constructor(go) {
    this.go = go; this.ticked = new Set(); this.hovered = ""; this.key = "";
    this.head = h("div", { class: "card" });
    this.list = h("div", { class: "card" });
    this.field = new Field({ height: 260, onRow: () => this.draw() });
    this.plot = new Plot("trace", { height: 230 });
    this.about = h("div", { class: "card" }, this.plot.element);
    this.side = h("div", {}, this.about, this.field.element);
    this.body = h("div", { class: "two wide-left" }, this.list, this.side);
    this.element = h("div", {}, this.head, this.body);
    this.resized = () => this.arrange();
    window.addEventListener("resize", this.resized);
  }

  // The plot and the map end where the list of effects beside them ends.
  arrange() {
    const { plot, list, side, field: { heat } } = this;
    if (this.body.hidden || !this.body.clientWidth) return;
    const drawn = plot.place.clientHeight + heat.canvas.clientHeight;
    const free = side.offsetLeft > list.offsetLeft ? list.offsetHeight - (side.clientHeight - drawn) : 0;
    plot.fixed = Math.max(230, 0.47 * free); heat.fixed = Math.max(260, 0.53 * free);
    heat.draw(); plot.fit();
  }

  leave() { window.removeEventListener("resize", this.resized); this.plot.remove(); this.nextRun?.remove(); this.field.curve.remove(); this.field.rest.remove(); }
  progress() { if (this.body.hidden) wait(this.head, KINDS); }

  async update() {
    const model = current();
    const told = model && (await documentOf(model, "diagnosis").catch(() => null));
    const loaded = model && (await this.field.load(model).catch(() => false));
    if (!told || !loaded) {
      this.key = "";
      wait(this.head, KINDS);
      this.body.hidden = !loaded || !failedOf("diagnose");
      if (!this.body.hidden) this.byHand(model);
      return;
    }
    const key = JSON.stringify([app.campaign.campaign, model.number, app.campaign.quantity, Object.entries(model.documents).filter(([file]) => !file.endsWith("planted.npz")), app.home.effects.length]);
    if (key === this.key) return;
    this.key = key; this.body.hidden = false; this.list.dataset.key = ""; this.told = told; this.model = model; this.hovered = "";
    this.traces = await arraysOf(model, "traces").catch(() => null);
    this.next = await documentOf(model, "next-test").catch(() => null);
    this.ticked = new Set([...this.ticked].filter((name) => told.candidates.some((e) => e.effect === name)));
    this.say();
    this.table();
    this.draw();
    this.arrange();
  }

  // The effects of the catalogue without a verdict: what is ticked is fitted all the same.
  byHand(model) {
    const key = `by hand ${app.campaign.campaign}/${model.number}/${app.campaign.quantity}`, forces = app.campaign.quantity !== "strain";
    if (this.list.dataset.key === key) return;
    const effects = app.home.effects.filter((e) => (e.stage === "brush") === forces && !(model.effects || []).some((own) => own.effect === e.effect)).map((e) => ({ ...e, twins: [] }));
    this.model = model; this.traces = null; this.hovered = "";
    this.told = { candidates: [], dead: [], named: [], byHand: effects };
    this.table();
    this.list.dataset.key = key;
    this.draw();
    this.arrange();
  }

  say() {
    this.nextRun?.remove();
    this.nextRun = this.next && nextRun(this.next, plain(this.next.what || "", this.model), this.field.data);
    const { told, model } = this, alike = told.verdict === "indistinguishable";
    const apart = alike || told.candidates.some((e) => e.twins.length && told.named.includes(e.effect)) || (told.sets || []).length > 1;
    fill(this.head, h("div", { class: "row" }, h("h2", {}, "The verdict"), h("span", { class: "tag alarm", id: "verdict" }, verdictOf(told.verdict, told.error_unit, told.named)),
      told.false_alarm !== undefined && told.false_alarm !== null ? h("span", { class: "quiet small" }, `chance of a false alarm: ${number(100 * told.false_alarm, 2)} %`) : null, h("span", { class: "room" }),
      told.named.length && !alike ? h("button", { type: "button", id: "tick-named", onclick: () => { for (const box of this.list.querySelectorAll("input[data-effect]")) if (told.named.includes(box.dataset.effect) && !box.checked) box.click(); this.button.focus(); } }, told.named.length > 1 ? "Tick what is named" : "Tick it") : null,
      h("button", { type: "button", onclick: () => wish({ do: "next-test", ...this.where() }).then((done) => done && toast("The next run is looked for as soon as a processor is free; it is shown here.")) }, apart ? "What would tell them apart?" : "Which run to measure next?")),
    h("dl", { class: "verdict" }, (model.lines || []).map(([what, said]) => [h("dt", {}, TITLES[what] || what), h("dd", {}, what === "next" && told.named.length && !alike ? [`Tick ${told.named.length > 1 ? "them" : "it"} in the list below and press Add; the new model is then diagnosed by itself. `, h("details", { class: "small quiet" }, h("summary", {}, "By hand"), plain(said, model))] : plain(said, model))])),
    this.nextRun?.element);
  }

  where() { return { campaign: app.campaign.campaign, model: this.model.number, quantity: app.campaign.quantity }; }

  title(name) { return app.home.effects.find((e) => e.effect === name); }

  table() {
    const { told, model } = this, known = new Map(app.home.effects.map((e) => [e.effect, e]));
    const groups = new Map(ORDER.map((part) => [part, []]));
    const put = (row, name) => (groups.get(known.get(name)?.part || "rig") || groups.get("rig")).push(row);
    for (const e of told.candidates) put(this.candidate(e), e.effect);
    for (const e of told.byHand || []) put(h("tr", { "data-name": e.effect }, h("td", {}, this.tick(e)), h("td", { colspan: 5 }, this.named(e), h("div", { class: "small quiet" }, e.title))), e.effect);
    for (const e of model.effects || []) put(this.owned(e), e.effect);
    for (const name of told.dead) put(this.dead(name, (told.dead_reasons || {})[name]), name);
    const points = this.field.data && !isStrain(this.field.data), withP = told.candidates.some((e) => e.p !== undefined && e.p !== null);
    const rank = (part) => Math.min(...groups.get(part).map((r) => Number(r.dataset.rank || 999)), 999);
    fill(this.list, h("div", { class: "row" }, h("h2", {}, "Effects"), h("span", { class: "quiet small" }, told.byHand ? "There is no verdict: tick what you suspect, and the fit tells what it takes away." : `Hover or focus a line: ${points ? "hollow" : "dashed"} is the part of the residual that this effect takes at its fitted strength, beyond what the other numbers of the model take when they are fitted anew. A flat line takes nothing; how much an effect takes, \u201cerror with it\u201d tells. Tick what to add.`), h("span", { class: "room" }),
      this.button = h("button", { class: "main", type: "button", id: "add", onclick: () => this.add() }, "Add")),
    h("div", { class: "scroll tall" }, h("table", {}, h("thead", {}, told.byHand ? null : h("tr", {}, h("th", {}, ""), h("th", {}, "effect"), h("th", { class: "n", title: "how well the measurements agree with the model that has this effect; what falls below the chance of a false alarm is rejected. The smallest value that the table of plain tires can give is marked." }, withP ? "p with it" : "score / threshold"), h("th", { title: "± one standard deviation" }, "strength"), h("th", { class: "n", title: "error with this effect" }, "error with it", h("br"), `[${unitName(told.error_unit)}]`), h("th", { class: "n", title: "chance that a diagnosis of this plan finds the effect at a third of its plausible strength" }, "chance to find", h("br"), "a third of its range"))),
      h("tbody", {}, [...groups.keys()].filter((part) => groups.get(part).length).sort((a, b) => rank(a) - rank(b)).map((part) => [h("tr", { class: "part" }, h("td", { colspan: 6 }, part)), ...groups.get(part).sort((a, b) => Number(a.dataset.rank || 999) - Number(b.dataset.rank || 999))])))));
    this.count();
  }

  tick(e) {
    const box = h("input", { type: "checkbox", "aria-label": `tick ${e.effect}`, "data-effect": e.effect, checked: this.ticked.has(e.effect), onchange: () => { if (box.checked) this.ticked.add(e.effect); else this.ticked.delete(e.effect); this.count(); } });
    return box;
  }

  named(e, fitted = null) { return h("button", { class: "small", type: "button", title: "What it is, its source, what it would look like here", onclick: () => effectPage(e.effect, fitted, this) }, e.effect); }

  candidate(e) {
    const { told } = this, named = told.named.includes(e.effect), alike = told.verdict === "indistinguishable";
    const on = () => this.hover(e.effect);
    return h("tr", { "data-rank": e.rank, "data-name": e.effect, onmouseenter: on, onfocusin: on },
      h("td", {}, this.tick(e)),
      h("td", {}, this.named(e, e), " ", alike && inSets(e.effect, told) ? h("span", { class: "tag alarm" }, "indistinguishable") : named ? h("span", { class: "tag alarm" }, "named") : e.level !== "quiet" ? h("span", { class: "tag" }, e.level) : null,
        h("div", { class: "small quiet" }, this.title(e.effect)?.title || e.title || "", e.twins.length ? ` Looks like ${e.twins.map((t) => `${t.effect} (${number(t.angle_deg, 2)} deg apart)`).join(", ")}.` : "", inSets(e.effect, told))),
      h("td", { class: "n" }, e.p !== undefined && e.p !== null ? [number(e.p, 2), h("div", { class: "small quiet" }, e.p <= told.p_least ? "smallest" : e.p_std ? `± ${number(e.p_std, 1)}` : "")] : number(e.score / e.threshold, 3)),
      h("td", {}, strengths(e.strength, e.std, e.unit).map((one) => h("div", {}, one)), e.in_range ? null : h("div", { class: "small warn" }, `outside the plausible ${(e.range || []).map((x) => number(x)).join(" to ")}`)),
      h("td", { class: "n" }, number(e.error_after)),
      h("td", { class: "n small quiet" }, e.power !== undefined && e.power !== null ? e.power < 0.01 ? "below 1 %" : `${number(100 * e.power, 2)} %` : ""));
  }

  owned(e) {
    const box = h("input", { type: "checkbox", checked: true, "aria-label": `untick ${e.effect}`, "data-owned": e.effect, onchange: async () => { if (!(await this.remove(e.effect))) box.checked = true; } });
    return h("tr", { "data-rank": 0, onmouseenter: () => this.hover("") }, h("td", {}, box), h("td", {}, `${e.effect} `, h("span", { class: "tag" }, "in the model"), h("div", { class: "small quiet" }, this.title(e.effect)?.title || "")), h("td", {}), h("td", {}, strength(e.strength), this.title(e.effect)?.unit === "1" ? "" : ` ${unitName(this.title(e.effect)?.unit)}`),
      h("td", { colspan: 2, class: "small quiet" }, "untick to take it out and fit again"));
  }

  dead(name, why) {
    return h("tr", { class: "dead", "data-rank": 900, "data-name": name, onmouseenter: () => this.hover(name), onfocusin: () => this.hover(name) }, h("td", {}, "–"), h("td", {}, this.named({ effect: name }), h("div", { class: "small" }, this.title(name)?.title || "")), h("td", { colspan: 4, class: "small" }, `This plan cannot show it: ${why || "it changes nothing here"}`));
  }

  count() { this.button.textContent = this.ticked.size ? `Add ${[...this.ticked].join(", ")}` : "Add what is ticked"; this.button.disabled = !this.ticked.size; }

  async add() {
    const done = await wish({ do: "add", ...this.where(), effects: [...this.ticked] });
    if (done) { this.ticked.clear(); this.go("add"); }
  }

  async remove(effect) {
    const done = await wish({ do: "remove", ...this.where(), effect });
    if (done) this.go("add");
    return done;
  }

  hover(name) {
    if (name === this.hovered) return;
    this.hovered = name;
    for (const row of this.list.querySelectorAll("tr[data-name]")) row.setAttribute("aria-selected", row.dataset.name === name);
    this.draw();
  }

  draw() {
    const { data } = this.field;
    if (!data) return;
    const begun = performance.now(), row = this.field.rows[this.field.row], name = this.hovered;
    const trace = name && this.traces?.[`trace_${name}`], fault = name && this.traces?.texts[`fault_${name}`];
    const title = this.told?.byHand ? "the residual; the page of an effect plants it" : !name ? "the residual; hover an effect to see the part that it takes" : fault ? `${name}: ${fault}` : trace ? `the residual, and the part that ${name} takes` : this.told.dead.includes(name) ? `${name}: this plan cannot show it` : this.traces ? `${name}: no trace` : "what each effect takes is being computed";
    const points = !isStrain(data);
    let x, rest, own;
    if (points) {
      const order = row.members.slice().sort((a, b) => data[this.field.slip.key][a] - data[this.field.slip.key][b]);
      x = { title: this.field.slip.title, values: order.map((i) => data[this.field.slip.key][i]) };
      rest = order.map((i) => data.difference[i]); own = trace && order.map((i) => trace[i]);
    } else {
      x = { title: "wheel angle [deg]", values: Array.from(data.angle) };
      rest = sliced(data, "difference", row.index);
      own = trace && trace.subarray(row.index * data.angle.length, (row.index + 1) * data.angle.length);
    }
    this.plot.show({ title: `${title}; ${row.label}`, unit: unitOf(data), y: valueTitle(data), x, series: [{ name: "measured residual, model less measured", values: rest, color: "rest", points }, { name: name ? `what ${name} takes beyond the other numbers` : "what an effect takes beyond the other numbers", values: own || new Array(x.values.length).fill(null), color: "trace", dash: [6, 4], points, hollow: points }] });
    app.drawn = performance.now() - begun; // how long a hover takes, [ms]
    if (this.field.trace?.name !== (trace ? name : undefined)) {
      clearTimeout(this.later);
      this.later = setTimeout(() => this.field.overlay(trace ? { name, values: trace } : null), 60);
    }
  }
}

// In which sets of effects, each of which explains the measurements, an effect is.
function inSets(effect, { sets = [], verdict }) {
  const mine = sets.flatMap((set, i) => (set.includes(effect) ? [{ number: i + 1, others: set.filter((one) => one !== effect) }] : []));
  return mine.map(({ number: k, others }) => ` ${verdict === "indistinguishable" ? `Set ${k} of ${sets.length} that explain the measurements alike${others.length ? `, with ${others.join(", ")}` : ""}` : others.length ? `Together with ${others.join(", ")}` : "Explains the measurements alone"}.`).join("");
}
