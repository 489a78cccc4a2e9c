// Step 4: the refit while it runs, the fall of the error, and every model that was made.
import { compareModels } from "./compare.js";
import { app, current, failedOf, fitOf, heldOutOf, nameOf, pathOf, plain, progressOf, stepOf, verdictOf, wish } from "./data.js";
import { csvButton, fill, h, number, strength, strengths, unitName } from "./dom.js";
import { Plot, waterfall } from "./plots.js";

const FLAGS = {
  out_of_range: "The fitted strength lies outside the plausible range: another effect may be missing.", not_significant: "The fitted strength does not differ significantly from zero.",
  no_gain: "The effect does not lower the error.",
  heldout_worse: "On a part of the runs that was held out the error rose: there the effect may stand for another one.",
};

// Why there is no verdict of the model yet, or none at all.
function noVerdict(c) {
  const broken = failedOf("compare") || failedOf("diagnose");
  return broken ? h("p", { class: "warn" }, `${broken.title}: ${broken.state}. ${broken.message} `, h("a", { href: `#/suspect/${c.campaign}` }, "What can be done next")) : h("p", { class: "quiet" }, "The verdict of this model is being computed.");
}

// What to do after a verdict.
function ahead(model) {
  const link = (step, text) => h("a", { href: `#/${step}/${app.wanted}` }, text), alike = model.verdict === "indistinguishable";
  if (model.named.length && !alike) return [link("suspect", `Tick ${model.named.length > 1 ? "them" : "it"} in step 3 and press Add`), "."];
  // a model that leaves twice what its own numbers would is not yet fitted to this quantity
  const unfitted = model.refitted !== null && 2 * model.refitted < model.error;
  if (model.verdict === "none" && !unfitted) return ["Nothing more is to be added: ", link("take", "take the model away"), " (step 5), or ", link("suspect", "tick any effect in step 3"), " to see what it does to the error."];
  return [plain(Object.fromEntries(model.lines).next || "", model), " ", link("suspect", "Step 3 shows the suspects"), "."];
}

const unitOf = (told) => ` [${unitName(told.error_unit)}]`;

// What was held out, part by part.
const partOf = ({ condition, value, unit }) => ({ time: `part ${value} of the time`, cell: `part ${value} of the conditions` })[condition] || `${condition.replaceAll("_", " ")} ${number(value, 3)} ${unit || ""}`;
const heldOut = (fit) => h("details", { class: "small" }, h("summary", {}, "Held out, part by part"), h("ul", {}, fit.held_out.map((part) => h("li", {}, `${partOf(part)} (${part.runs ? `${part.runs} runs` : `${part.points} points`}): ${number(part.error_before, 3)} before, ${number(part.error_after, 3)} after`))));

export class Add {
  constructor(go) {
    this.go = go;
    this.running = h("div", {});
    this.fall = h("div", { class: "card" });
    this.strip = h("div", { class: "card" });
    this.plot = new Plot("fit", { height: 170 });
    this.element = h("div", {}, this.running, this.fall, this.strip);
    this.hidden = false;
  }

  leave() { this.plot.remove(); }

  fitting() {
    return (app.campaign?.jobs || []).filter((job) => ["add", "remove", "identify"].includes(job.kind) && ["waiting", "running"].includes(job.state));
  }

  progress() {
    const job = this.fitting().find((one) => one.state === "running"), at = job && progressOf(job.job);
    if (!at || !this.text) return;
    this.text.textContent = stepOf(job);
    if (at.costs.length > 1) this.plot.show({ title: "cost of this fit, step by step: the squares of what is left, weighted by noise and scatter", unit: "cost [1]", x: { title: "step", whole: true, values: at.costs.map((_, i) => i + 1) }, series: [{ name: "cost", values: at.costs, color: "model" }] });
  }

  update() {
    const c = app.campaign;
    if (!c) { fill(this.strip, h("p", {}, "Open a campaign first.")); return; }
    const fitting = this.fitting(), key = fitting.map((job) => job.job + job.state).join();
    if (key !== this.jobsKey) {
      this.jobsKey = key;
      fill(this.running, fitting.map((job) => h("div", { class: "card" }, h("div", { class: "row" },
        h("h2", {}, job.kind === "identify" ? "The base model is fitted" : `${job.kind === "add" ? "Adding" : "Removing"} ${job.effect}${job.then.length ? `, then ${job.then.join(", ")}` : ""}`), job.state === "running" ? (this.text = h("span", { class: "quiet", role: "status" }, stepOf(job))) : h("span", { class: "quiet" }, stepOf(job)), h("span", { class: "room" }),
        h("button", { type: "button", "data-cancel": job.job, onclick: () => wish({ do: "cancel", job: job.job }) }, "Cancel")), job.state === "running" ? this.plot.element : null, h("pre", { class: "small" }, job.command))));
      this.progress();
    }
    this.history(c);
  }

  steps(c, model) {
    return pathOf(c, model).map((one, i, all) => ({
      name: i ? `${one.action === "remove" ? "− " : "+ "}${one.effect}` : "base model", note: one.parent && one.quantity !== c.quantity ? `fitted to ${one.quantity}` : one.fit?.strength === undefined || one.fit.strength === null ? "" : strength(one.fit.strength, 3),
      error: one.error ?? (all[i + 1] && fitOf(c, all[i + 1])?.error_before) ?? null,
      heldout: heldOutOf(c, one),
      floor: fitOf(c, one)?.floor ?? null,
      anew: one.action === "add" ? fitOf(c, one)?.error_refitted ?? null : null,
    }));
  }

  history(c) {
    const now = current(), unit = unitName(now?.error_unit);
    const failed = c.jobs.filter((job) => ["add", "remove"].includes(job.kind) && ["failed", "cancelled", "interrupted"].includes(job.state)).slice(-3);
    const key = JSON.stringify([c.models, c.current, failed.map((j) => j.job), failedOf("compare")?.job, failedOf("diagnose")?.job, this.fitting().length, this.hidden, c.quantity]);
    if (key === this.key) return;
    this.key = key;
    const steps = now ? this.steps(c, now) : [];
    const last = now?.fit && now.parent ? now.fit : null;
    fill(this.fall, h("div", { class: "row" }, h("h2", {}, "The fall of the error"), h("span", { class: "quiet" }, c.quantity), h("span", { class: "room" }),
      csvButton("waterfall", () => [["step", steps.map((s) => s.name)], [`error [${unit}]`, steps.map((s) => s.error)], ["held-out error", steps.map((s) => s.heldout)], ["floor", steps.map((s) => s.floor)], ["numbers fitted anew without the effect", steps.map((s) => s.anew)]])),
    steps.length ? waterfall(steps, unit) : h("p", { class: "quiet" }, "There is no model yet."),
    last ? h("p", { id: "result" }, `${last.effect}: strength ${strengths(last.strength, last.std, last.unit).join("; ")}. Error of ${last.quantity}${unitOf(last)}: ${number(last.error_before, 4)} before, ${last.action === "add" ? `${number(last.error_refitted, 4)} with the numbers fitted anew without the effect, ` : ""}`, h("b", { id: "error-after" }, number(last.error_after, 4)), ` ${last.action === "add" ? "with it" : "without it"}. Held out: ${number(last.heldout_error_before, 4)} before, ${number(last.heldout_error_after, 4)} after.`) : null,
    Object.entries(last?.others || {}).map(([name, one]) => h("p", one.error_after > one.error_before ? { class: "warn" } : {}, `Error of ${name}${unitOf(one)}: ${number(one.error_before, 4)} before, ${number(one.error_after, 4)} after${one.error_after > one.error_before ? `. It rises, because the same brush was fitted to ${last.quantity}: go on from the model before where ${name} matters` : ""}.`)),
    last?.held_out?.length ? heldOut(last) : null,
    last?.flags?.length ? h("p", { class: "warn" }, last.flags.map((flag) => FLAGS[flag] || flag.replaceAll("_", " ")).join(" ")) : null,
    now?.verdict ? h("p", {}, "The verdict with this model: ", h("b", {}, verdictOf(now.verdict, now.error_unit, now.named)), now.named.length ? `: ${now.named.join(", ")}` : "", ". ", ...(this.fitting().length ? [] : ahead(now))) : now ? noVerdict(c) : null,
    failed.map((job) => h("p", { class: job.state === "failed" ? "bad" : "warn" }, `${job.kind} ${job.effect}: ${job.state}. ${job.message} `, h("button", { class: "small", type: "button", onclick: () => wish({ do: "again", job: job.job }) }, "Run again"))));
    const shown = c.models.filter((m) => m.ready && (this.hidden || !m.hidden));
    fill(this.strip, h("div", { class: "row" }, h("h2", {}, "Models"), h("span", { class: "quiet small" }, "Nothing is deleted. Continue from any of them."), h("span", { class: "room" }),
      now?.parent ? h("button", { type: "button", id: "undo", onclick: () => this.look(c.models.find((m) => m.number === now.parent)) }, "Undo: back to the model before") : null,
      h("button", { type: "button", disabled: shown.length < 2, onclick: () => compareModels(c, shown) }, "Compare two"),
      h("label", {}, h("input", { type: "checkbox", checked: this.hidden, onchange: (e) => { this.hidden = e.target.checked; this.history(c); } }), " show hidden ones")),
    h("div", { class: "strip" }, [...shown].sort((a, b) => b.pinned - a.pinned || (a.number < b.number ? -1 : 1)).map((m) => this.card(c, m))));
  }

  card(c, m) {
    const mark = (values) => wish({ do: "mark", campaign: c.campaign, model: m.number, ...values });
    const name = h("input", { value: m.label, placeholder: nameOf(m), "aria-label": `label of model ${m.number}`, size: 16, onchange: () => mark({ label: name.value }) });
    const before = c.models.find((one) => one.number === m.parent);
    return h("div", { class: `model${m.number === c.current ? " current" : ""}${m.hidden ? " hidden-model" : ""}`, "data-model": m.number },
      h("div", { class: "name" }, nameOf(m), m.pinned ? [" ", h("span", { class: "tag" }, "pinned")] : null), h("div", { class: "small quiet" }, before ? `made of: ${nameOf(before)}` : "the start"),
      h("div", {}, `error of ${c.quantity} ${number(m.error)} `, h("span", { class: "quiet" }, unitName(m.error_unit))), name,
      h("div", { class: "row" }, m.number === c.current ? h("span", { class: "tag" }, "shown") : h("button", { class: "small", type: "button", onclick: () => this.look(m) }, "Continue from here"),
        h("button", { class: "small", type: "button", onclick: () => mark({ pinned: !m.pinned }) }, m.pinned ? "Unpin" : "Pin"), h("button", { class: "small", type: "button", onclick: () => mark({ hidden: !m.hidden }) }, m.hidden ? "Show" : "Hide")));
  }

  look(model) { wish({ do: "look", campaign: app.campaign.campaign, model: model.number, quantity: app.campaign.quantity }); }
}
