// Step 5: model, report, commands, FMU; and effects of one's own.
import { app, current, get, nameOf, wish } from "./data.js";
import { fill, h, save } from "./dom.js";
import { ownEffects, ownKey } from "./own.js";

export class Take {
  constructor(go) { this.go = go; this.element = h("div", {}); this.key = ""; }

  async update() {
    const c = app.campaign, model = current();
    if (!app.home) return;
    if (!c || !model) {
      const key = JSON.stringify(ownKey());
      if (key !== this.key) fill(this.element, h("div", { class: "card" }, h("p", {}, "There is no model to be taken away yet.")), ownEffects());
      this.key = key;
      return;
    }
    const jobs = c.jobs.filter((job) => ["report", "calibrate", "fmu"].includes(job.kind));
    const key = JSON.stringify([c.campaign, model, jobs, ownKey()]);
    if (key === this.key) return;
    this.key = key;
    const about = { campaign: c.campaign, model: model.number };
    const { commands } = await get("/taken", { ...about, what: "commands" }).catch(() => ({ commands: [] }));
    if (key !== this.key) return;
    const file = (what, text) => h("a", { href: `/taken?${new URLSearchParams({ ...about, what })}`, download: true, "data-take": what }, text);
    const working = (kinds) => jobs.find((job) => kinds.includes(job.kind) && ["waiting", "running"].includes(job.state));
    const failed = (kinds) => { const last = jobs.filter((job) => kinds.includes(job.kind)).at(-1); return last?.state === "failed" ? h("p", { class: "bad" }, last.message) : null; };
    const made = (what, name, kinds, text, label) => h("div", { class: "card" }, h("h2", {}, label), h("p", {}, text),
      h("div", { class: "row" }, model.taken.includes(name) ? file(what, `Save ${name === "report" ? "report.html" : name}`) : null, h("button", { type: "button", disabled: Boolean(working(kinds)), onclick: () => wish({ do: "take", ...about, quantity: c.quantity, what }) }, working(kinds) ? "is being made" : model.taken.includes(name) ? "Make it again" : "Make it")), failed(kinds));
    fill(this.element, h("div", { class: "two" },
      h("div", {}, h("div", { class: "card" }, h("h2", {}, `The model: ${nameOf(model)}`), h("p", {}, "The identified tire with its effects, their strengths and the history of what the error did. Every command of tirelib takes it as --model."), file("model", "Save the model (TOML)")),
        made("report", "report", ["report"], "Where this model fails, with maps, waveforms and tables, in one HTML file that needs no network.", "Report"),
        !c.quantities.includes("strain") ? null : made("fmu", "StrainTire.fmu", ["calibrate", "fmu"], "The estimators of load, slip angle, slip ratio and lateral force are calibrated on this campaign (what it can inform) and exported as an FMU for co-simulation.", "FMU of the calibrated estimator")),
      h("div", {}, h("div", { class: "card" }, h("div", { class: "row" }, h("h2", {}, "The same by hand"), h("span", { class: "room" }), h("button", { type: "button", onclick: () => navigator.clipboard.writeText(commands.join("\n")) }, "Copy"), h("button", { type: "button", onclick: () => save("journey.sh", `${commands.join("\n")}\n`, "text/plain") }, "Save")),
        h("p", { class: "quiet" }, "These commands repeat the way to this model, in any folder; files are written into the folder where they are run."), h("pre", { id: "commands" }, commands.join("\n"))),
      ownEffects())));
  }
}
