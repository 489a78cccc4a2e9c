// Step 1: a campaign of the list, a folder, files that are dropped, or the example.
import { app, get, isFinding, shown, stepOf, tell, upload, wish } from "./data.js";
import { dialog, fill, h, hush, number, toast } from "./dom.js";
import { bare, importForm } from "./import.js";
import { confirmEffect, exampleFile } from "./own.js";

// Every file of a drop with its place in the folder that was dropped.
export async function entries(transfer) {
  const out = [];
  async function walk(entry, path) {
    if (entry.isFile) {
      out.push([path + entry.name, await new Promise((done, fail) => entry.file(done, fail))]);
      return;
    }
    const reader = entry.createReader();
    for (;;) {
      const part = await new Promise((done, fail) => reader.readEntries(done, fail));
      if (!part.length) return;
      for (const one of part) await walk(one, `${path}${entry.name}/`);
    }
  }
  for (const one of [...transfer.items].map((item) => item.webkitGetAsEntry()).filter(Boolean)) await walk(one, "");
  return out;
}

let reading = ""; // what is said while files are sent

// Send files to the server, and open what they are: a campaign, an effect, or files to be imported.
export async function receive(files, go) {
  if (!files.length) return;
  try {
    const number = await upload(files, (k) => { reading = `Reading file ${k} of ${files.length}`; tell("progress"); });
    opened(await wish({ do: "dropped", files: number }), go);
  } catch (error) { toast(error.message, true); }
  reading = "";
  tell("progress");
}

function opened(done, go) {
  if (!done) return;
  if (done.campaign) go("open", done.campaign);
  else if (done.effect) confirmEffect(done.effect);
  else if (done.files) importForm(done.files);
}

export class Open {
  constructor(go) {
    this.go = go;
    this.start = h("div", { class: "card" });
    this.recent = h("div", { class: "card" });
    this.facts = h("div", {});
    this.picker = h("input", { type: "file", multiple: true, hidden: true, onchange: (event) => receive([...event.target.files].map((f) => [f.name, f]), this.go) });
    this.folders = h("input", { type: "file", webkitdirectory: true, hidden: true, onchange: (event) => receive([...event.target.files].map((f) => [f.webkitRelativePath, f]), this.go) });
    this.zone = h("div", { class: "drop", tabindex: "0", role: "button", onclick: () => this.picker.click(), onkeydown: (event) => { if (event.key === "Enter" || event.key === " ") this.picker.click(); } },
      "Drop a campaign folder, its zip archive, measured files (MAT, CSV, Parquet, TYDEX, MDF) or an effect file (.py) anywhere on this page, or click here to choose files");
    this.whole = () => h("button", { type: "button", class: "small", "data-whole": 1, onclick: () => this.folders.click() }, "Send a whole folder …");
    this.element = h("div", { class: "two" }, h("div", {}, this.start), h("div", {}, this.facts));
    fill(this.start, h("h2", {}, "Measurements"), h("p", {}, "A campaign is a folder with campaign.toml, runs.csv and the recorded runs. Other files are imported."),
      h("div", { class: "row" },
        this.trial = h("button", { class: "main", type: "button", id: "example", onclick: () => this.example() }, "Try the example"),
        h("button", { type: "button", id: "browse", onclick: () => this.browse("") }, "Choose a folder or file …")),
      h("p", { class: "quiet small" }, "The example measures a virtual tire, on this machine and now, that has a physical effect which the base model lacks. It takes less than a minute on an idle machine."),
      this.zone, this.picker, this.folders, h("p", { class: "small quiet" }, this.whole(), " copies a folder of any place into the session, as dropping it does. An effect of your own begins with the example ", exampleFile(), "."),
      this.progressLine = h("p", { role: "status" }));
    this.shownFor = "";
  }

  async example() {
    const done = await wish({ do: "example" });
    if (done?.campaign) this.go("see", done.campaign);
    else if (done?.job) app.follow = done.job;
  }

  async browse(path) {
    let found;
    try { found = await get("/browse", { path }); } catch (error) { toast(error.message, true); return; }
    hush();
    const open = async (folder) => {
      const done = await wish({ do: "open", path: folder });
      if (done) { document.getElementById("dialog").close(); opened(done, this.go); }
    };
    const typed = h("input", { value: found.path, size: 50, "aria-label": "path of a folder", placeholder: "/path/of/a/folder" });
    dialog("Choose a campaign", h("form", { class: "row", onsubmit: (event) => { event.preventDefault(); this.browse(typed.value.trim()); } }, h("label", {}, "Folder ", typed), h("button", {}, "Go there")),
      found.path ? null : h("p", { class: "quiet small" }, "Folders that the server may read where they are (tirelib studio --root adds others):"),
      h("p", { class: "small quiet" }, "The folder is not among them? ", this.whole()),
      found.path && !found.campaign && !found.folders.some((one) => one.campaign) ? h("p", { class: "warn" }, "This folder is no campaign, and none lies directly in it: a campaign has campaign.toml, runs.csv and the recorded runs.") : null,
      found.campaign ? h("button", { class: "main", type: "button", onclick: () => open(found.path) }, "Open this campaign") : null,
      h("ul", { class: "list scroll" },
        found.path ? h("li", {}, h("button", { class: "link", type: "button", onclick: () => this.browse(found.parent) }, "↑ up")) : null,
        found.folders.map((one) => h("li", {}, h("button", { class: "link", type: "button", onclick: () => (one.campaign ? open(one.path) : this.browse(one.path)) }, one.name), one.campaign ? h("span", { class: "tag" }, "campaign") : null)),
        found.files.map((one) => h("li", {}, h("button", { class: "link", type: "button", onclick: async () => { const done = await wish({ do: "columns", path: one.path }); document.getElementById("dialog").close(); opened(done, this.go); } }, one.name), h("span", { class: "quiet" }, "import"))),
        !found.folders.length && !found.files.length ? h("li", { class: "quiet" }, "This folder holds no folders and no measured files.") : null));
  }

  progress() {
    const job = app.follow && app.home?.jobs.find((one) => one.job === app.follow && ["waiting", "running"].includes(one.state));
    this.trial.disabled = Boolean(job);
    this.progressLine.textContent = reading || (job ? `${job.title}: ${stepOf(job)}` : "");
  }

  update() {
    const home = app.home;
    if (!home) return;
    this.progress();
    // what failed before the same kind of job went well is no news
    const last = (kind) => Math.max(0, ...home.jobs.filter((job) => job.kind === kind && job.state === "done").map((job) => job.job));
    const broken = home.jobs.filter((job) => ["rig", "import"].includes(job.kind) && ["interrupted", "failed", "cancelled"].includes(job.state) && job.job > last(job.kind)).slice(-1);
    this.element.children[app.wanted ? 0 : 1].append(this.recent); // the right half belongs to the campaign that is open
    fill(this.recent, h("h2", {}, "Recent campaigns"),
      home.campaigns.length ? h("ul", { class: "list" }, home.campaigns.map((one) => h("li", {},
        h("button", { class: "link", type: "button", onclick: () => this.go("open", one.campaign) }, one.title), h("span", { class: "quiet small" }, one.there ? one.folder : `${one.folder} is not there`),
        h("span", { class: "room" }), one.busy ? h("span", { class: "tag", title: one.busy }, "at work") : null, h("span", { class: "quiet small" }, `${one.models} ${one.models === 1 ? "model" : "models"}`)))) : h("p", { class: "quiet" }, "None yet."),
      broken.map((job) => h("p", { class: "warn said" }, `${job.title}: ${job.state}. ${bare(job.message)} `, h("button", { class: "small", type: "button", onclick: async () => { if (await wish({ do: "again", job: job.job })) app.follow = null; } }, "Run again"))));
    const c = app.campaign;
    if (!c) { fill(this.facts); this.shownFor = ""; return; }
    const key = JSON.stringify([c.campaign, c.stale, c.check, c.shown, c.measured, c.models.length, c.jobs.map((j) => j.state)]);
    if (key === this.shownFor) return;
    this.shownFor = key;
    this.campaign(c);
  }

  async campaign(c) {
    const findings = h("div", { class: "card" }, h("h2", {}, "Findings"));
    const { check } = c;
    if (!check) findings.append(h("p", { class: "quiet" }, "The campaign is being checked."));
    else if (!check.problems.length) findings.append(h("p", { class: "good" }, "The check found nothing wrong."));
    else {
      findings.append(h("p", {}, check.errors ? h("button", { type: "button", id: "check-again", onclick: () => wish({ do: "open", campaign: c.campaign }) }, "Check again") : null, ` ${check.errors} ${check.errors === 1 ? "error" : "errors"}, ${check.warnings} ${check.warnings === 1 ? "warning" : "warnings"}. ${check.errors ? "No model is fitted before the errors are corrected: mend the files, then check again." : ""}`.trimEnd()),
        h("div", { class: "scroll" }, h("table", {}, h("thead", {}, h("tr", {}, ["", "where", "what was found", "what to do"].map((t) => h("th", {}, t)))),
          h("tbody", {}, check.problems.map((p) => h("tr", {}, h("td", { class: p.severity === "error" ? "bad" : "warn" }, p.severity), h("td", {}, p.where), h("td", {}, `${p.given}. Allowed: ${p.allowed}`), h("td", {}, p.remedy)))))));
    }
    const failed = c.jobs.filter((job) => ["failed", "interrupted", "cancelled"].includes(job.state) && !isFinding(job)).slice(-4);
    const ready = c.models.some((m) => m.ready);
    const seen = ready || c.measured, unfitted = failed.some((job) => job.kind === "identify");
    const next = h("div", { class: "row" }, h("button", { class: "main", type: "button", disabled: !seen, onclick: () => this.go("see") }, ready || !seen ? "See where the model fails" : "See what was measured"),
      ready ? null : h("span", { class: "quiet" }, !check ? "The campaign is being checked." : check.errors ? "There is no model: correct the errors first." : unfitted ? "The base model could not be fitted." : "The base model is being fitted."));
    const troubles = failed.map((job) => h("p", { class: job.state === "failed" ? "bad" : "warn" }, `${job.title}: ${job.state}. ${job.message} `, h("button", { class: "small", type: "button", onclick: () => wish({ do: "again", job: job.job }) }, "Run again")));
    fill(this.facts, h("div", { class: "card" }, h("h2", {}, c.title), h("p", { class: "quiet small" }, c.folder),
      c.stale ? h("p", { class: "warn" }, "The measurements have changed since the models were fitted; the models and their errors belong to the old ones. ", h("button", { class: "small", type: "button", onclick: () => wish({ do: "fit", campaign: c.campaign }) }, "Fit a new base model")) : null, next, troubles), findings);
    const told = await shown().catch(() => null);
    if (!told || app.campaign !== c) return;
    const { header, runs } = told, mean = (r, k) => { const x = r.mean?.[k] ?? r.set_point?.[k]; const step = { slip_ratio: 1000, slip_angle_deg: 100, camber_deg: 100 }[k]; return number(step && Number.isFinite(x) ? Math.round(step * x) / step : x, 4); };
    const columns = [["Fz_N", "load [N]"], ["pressure_bar", "pressure [bar]"], ["speed_kmh", "speed [km/h]"], ["slip_angle_deg", "slip angle [deg]"], ["camber_deg", "camber [deg]"], ["slip_ratio", "slip ratio [1]"]];
    this.facts.append(h("div", { class: "card" }, h("h2", {}, `${runs.length} ${runs.length === 1 ? "run" : "runs"}`),
      h("p", { class: "quiet small" }, `${header.tire?.name ?? ""}; free radius ${number(header.tire?.free_radius_mm, 4)} mm; ${header.gage_lateral_mm?.length ? `gages at ${header.gage_lateral_mm.join(", ")} mm` : "no gages"}; files in axes ${header.file_axes}, shown in ISO 8855. Means of the measurement, else set points.`),
      h("div", { class: "scroll" }, h("table", {}, h("thead", {}, h("tr", {}, h("th", { class: "n" }, "run"), h("th", {}, "kind"), columns.map(([, t]) => h("th", { class: "n" }, t)))),
        h("tbody", {}, runs.map((r) => h("tr", {}, h("td", { class: "n" }, r.run), h("td", {}, r.kind), columns.map(([k]) => h("td", { class: "n" }, mean(r, k))))))))));
  }
}
