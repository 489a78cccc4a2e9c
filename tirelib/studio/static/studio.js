// The frame: steps, campaign, quantity, jobs; the view of the step that the address names.
import { active, app, connect, current, inView, isFinding, listen, nameOf, progressOf, refresh, stepOf, tell, UNKNOWN, wish } from "./data.js";
import { h, fill, toast } from "./dom.js";
import { entries, Open, receive } from "./open.js";
import { See } from "./see.js";
import { Suspect } from "./suspect.js";
import { Add } from "./add.js";
import { Take } from "./take.js";

const VIEWS = { open: [Open, "Open"], see: [See, "See"], suspect: [Suspect, "Suspect"], add: [Add, "Add"], take: [Take, "Take away"] };
let view = null;
let step = "";
window.studio = app;

const address = () => {
  const [, name = "open", campaign = ""] = location.hash.split("/");
  return { name: VIEWS[name] ? name : "open", campaign };
};
export const go = (name, campaign = app.wanted || "") => { location.hash = `#/${name}/${campaign}`; };

function route() {
  const { name, campaign } = address();
  if (campaign !== (app.wanted || "")) { app.wanted = campaign; app.campaign = null; app.unknown = false; refresh(); }
  if (name !== step) {
    view?.leave?.();
    step = name;
    view = new VIEWS[name][0](go);
    fill(document.getElementById("main"), view.element);
  }
  draw();
}

function draw() {
  const c = app.campaign, model = inView();
  fill(document.getElementById("steps"), Object.entries(VIEWS).map(([name, [, title]], i) => h("a", {
    href: `#/${name}/${app.wanted || ""}`, "aria-current": name === step ? "step" : null,
    "aria-disabled": name !== "open" && !c ? "true" : null,
  }, h("b", {}, i + 1), title)));
  fill(document.getElementById("where"), c ? `${c.title}${model ? ` · ${nameOf(model)}` : ""}` : app.unknown ? UNKNOWN() : "No campaign is open");
  document.title = c ? `${c.title} – tirelib studio` : "tirelib studio";
  const box = document.getElementById("quantity-box"), select = document.getElementById("quantity");
  box.hidden = !c || c.quantities.length < 2;
  if (c && !box.hidden) { fill(select, c.quantities.map((q) => h("option", { value: q }, q))); select.value = c.quantity; }
  jobs();
  view?.update();
}

function jobs() {
  const shown = active().filter((job) => job.state === "running" || ["add", "remove", "next-test"].includes(job.kind));
  const place = document.getElementById("jobs");
  const key = shown.map((job) => `${job.job}${job.state}`).join();
  if (place.dataset.key !== key) {
    place.dataset.key = key;
    fill(place, shown.map((job) => h("span", { class: "job", "data-job": job.job },
      h("span", {}, job.effect ? `${job.kind} ${job.effect}` : job.title), h("progress", { "aria-label": job.title }), h("span", { class: "quiet small", "data-label": 1 }),
      h("button", { class: "small", type: "button", onclick: () => wish({ do: "cancel", job: job.job }) }, "Cancel"))));
  }
  for (const box of place.children) {
    const job = shown.find((one) => one.job === Number(box.dataset.job)), at = progressOf(job.job), bar = box.querySelector("progress");
    if (at?.total) { bar.max = at.total; bar.value = Math.min(at.done, at.total); } else bar.removeAttribute("value");
    box.querySelector("[data-label]").textContent = stepOf(job);
  }
}

document.getElementById("quantity").addEventListener("change", (event) => {
  const model = current();
  if (model) wish({ do: "look", campaign: app.campaign.campaign, model: model.number, quantity: event.target.value });
});
const theme = (name) => {
  document.documentElement.dataset.theme = name;
  document.getElementById("theme").textContent = name === "dark" ? "Light" : "Dark";
};
theme(localStorage.getItem("theme") || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
document.getElementById("theme").addEventListener("click", () => {
  const name = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  localStorage.setItem("theme", name);
  theme(name);
  window.dispatchEvent(new Event("resize")); // maps are drawn again in the colours of the theme
});

// Files may be dropped anywhere: the browser would leave the page otherwise.
const over = (yes) => document.body.classList.toggle("over", yes);
const onDrag = (kind, what) => document.addEventListener(kind, (event) => {
  if (!event.dataTransfer.types.includes("Files")) return;
  event.preventDefault();
  what(event);
});
for (const kind of ["dragenter", "dragover"]) onDrag(kind, () => over(true));
onDrag("dragleave", (event) => over(Boolean(event.relatedTarget)));
onDrag("drop", async (event) => {
  over(false);
  const files = await entries(event.dataTransfer);
  if (step !== "open") go("open");
  receive(files, go);
});

let first = true;
const begun = Date.now() / 1000, told = new Set(); // what had failed before is no news
listen((what) => {
  if (what === "link") document.body.classList.toggle("lost", !app.connected); // it is seen wherever the page has been scrolled
  if (what === "link") document.getElementById("link").textContent = app.connected ? "connected" : "The server does not answer; nothing is lost. Start tirelib studio again.";
  if (what === "progress") { jobs(); view?.progress?.(); }
  if (what !== "state") return;
  if (first) {
    first = false;
    if (app.home.first && !address().campaign) { go("see", app.home.first); return; }
  }
  for (const job of [...(app.campaign?.jobs || []), ...app.home.jobs]) {
    if (job.state === "failed" && !isFinding(job) && !["columns", "suggest", "import"].includes(job.kind) /* their form tells it */ && job.ended > begun && !told.has(job.job)) { told.add(job.job); toast(`${job.title}: ${job.message}`, true); }
  }
  if (app.follow && app.home) {
    const found = app.home.jobs.find((job) => job.job === app.follow);
    const made = app.home.campaigns.find((one) => one.folder.includes(`/jobs/${String(app.follow).padStart(4, "0")}/`));
    if (made) { app.follow = null; go("see", made.campaign); return; }
    if (found && ["failed", "cancelled"].includes(found.state)) app.follow = null;
  }
  draw();
});
setInterval(() => { if (app.running.length) tell("progress"); }, 1000); // the time goes on between the steps of a job
window.addEventListener("hashchange", route);
connect();
route();
