// What the server knows: one state that all views read, documents and arrays by their time stamp.
import { number, toast, unitName } from "./dom.js";

export const app = { home: null, campaign: null, running: [], connected: false };
const listeners = new Set();
export const listen = (what) => { listeners.add(what); return () => listeners.delete(what); };
export const tell = (what) => listeners.forEach((one) => one(what));

async function answer(response) {
  if (response.ok) return response;
  let said = `${response.status}`;
  try { said = (await response.json()).error || said; } catch { said = await response.text().catch(() => said); }
  throw new Error(said);
}

export async function get(path, asked = {}) {
  const query = new URLSearchParams(asked).toString();
  return (await answer(await fetch(query ? `${path}?${query}` : path))).json();
}

export async function wish(what) {
  try {
    const response = await fetch("/do", { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(what) });
    return await (await answer(response)).json();
  } catch (error) {
    toast(error.message, true);
    return null;
  }
}

export async function upload(files, say) {
  let number = "";
  for (const [k, [name, file]] of files.entries()) {
    say(k + 1);
    const query = new URLSearchParams({ name, files: number });
    number = (await (await answer(await fetch(`/upload?${query}`, { method: "POST", body: file }))).json()).files;
  }
  return number;
}

let busy = false;
let again = false;
export async function refresh() {
  if (busy) { again = true; return; }
  busy = true;
  try {
    const name = app.wanted;
    const home = await get("/home"), unknown = Boolean(name) && !home.campaigns.some((one) => one.campaign === name);
    const campaign = name && !unknown ? await get("/campaign", { campaign: name }).catch(() => null) : null;
    app.home = home;
    if (name === app.wanted) { app.campaign = campaign; app.unknown = unknown; }
    tell("state");
  } catch { /* the connection tells it */ }
  busy = false;
  if (again) { again = false; refresh(); }
}

// What is said of an address that names no campaign of the session.
export const UNKNOWN = () => `No campaign here is called ${app.wanted}: choose one of step 1.`;

// The verdicts of a diagnosis in plain words.
const VERDICTS = {
  none: "no effect is missing", named: "one effect is missing", indistinguishable: "several effects explain it alike",
  form_inadequate: "the effect is right, its law is not", unknown: "no effect of the catalogue explains it",
};

const NUMBERS = ["no", "one", "two", "three", "four", "five"];

// Where nothing was measured twice there is no noise, and no effect has been tested.
export function verdictOf(verdict, unit, named = []) {
  if (verdict && unit && unit !== "noise") return "not tested: nothing was measured twice";
  if (verdict === "named" && named.length > 1) return `${NUMBERS[named.length] || named.length} effects are missing`;
  if (verdict === "form_inadequate" && named.length > 1) return "the effects are right, one of their laws is not";
  return VERDICTS[verdict] || verdict;
}

// What a command has said of a model, with the file as step 5 calls it in the place of that of the session, and effects as the page takes them.
export const plain = (said, model) => said.replaceAll(model.file, model.saved_as).replaceAll("--out M2.toml", `--out ${model.next_as}`).replaceAll("(--effects)", "(step 5 has an example)");

// A statement with its wheel angles in degrees, as the plots beside it have them.
export const inDegrees = (said) => said.replace(/from (-?[\d.]+) to (-?[\d.]+) rad\b/g, (_, ...ends) => `from ${ends.slice(0, 2).map((x) => Math.round((180 / Math.PI) * x)).join(" to ")} deg`);

export const current = () => {
  const c = app.campaign;
  return c ? c.models.find((m) => m.number === c.current && m.ready) || null : null;
};

// The same, or a base model that can be seen already while the rest of its fit is computed.
export const inView = () => current() || app.campaign?.models.find((m) => m.number === app.campaign.current && m.documents[`${app.campaign.quantity}/plots.npz`]) || null;

// The models from the base to one.
export function pathOf(c, model) {
  const out = [];
  for (let at = model; at && out.length < 500; at = c.models.find((m) => m.number === at.parent)) out.unshift(at);
  return out;
}

// What was fitted to the quantity that is looked at; a fit to another one tells other errors.
export const fitOf = (c, m) => (m.parent && m.quantity === c.quantity && m.fit?.error_after !== undefined ? m.fit : null);

// The error on what was held out; that of a base model is told by the first fit that begins from it.
export const heldOutOf = (c, m) => fitOf(c, m)?.heldout_error_after ?? c.models.filter((one) => one.parent === m.number).map((one) => fitOf(c, one)?.heldout_error_before).find(Number.isFinite) ?? null;

// The rms beside the error, of which of strain it is not a multiple.
export const RMS_LEFT = "model less measured, rms";
export const rmsOf = (told) => `of ${number(told.measured_rms, 3)} ${unitName(told.unit)}${told.quantity === "strain" ? ", errors of the set points included" : ""}`;

export function nameOf(model) {
  if (model.label) return model.label;
  if (model.action === "identify") return "base model";
  return `${model.action === "remove" ? "without" : "with"} ${model.effect}`;
}

// Jobs of the campaign or of none that wait or run.
export const active = () => [...(app.campaign?.jobs || []), ...(app.home?.jobs || [])]
  .filter((job) => ["waiting", "running"].includes(job.state));
// How long a job has run, and how long it may still take if the last one of its kind in this campaign is a guide.
export function timeOf(job) {
  if (!job.begun || job.state !== "running") return "";
  const words = (x) => (x < 100 ? `${Math.round(x)} s` : `${Math.round(x / 60)} min`), took = Date.now() / 1000 - job.begun;
  const before = (app.campaign?.jobs || []).filter((one) => one.kind === job.kind && one.state === "done").at(-1), left = before ? before.ended - before.begun - took : 0;
  return `${words(Math.max(0, took))} so far${left > 1 ? `, about ${words(left)} left, as last time` : ""}`;
}
export const progressOf = (number) => app.running.find((one) => one.job === number);
// What a job does now and how long it has run. A job makes several fits, and the steps of each would begin anew: those of the job are told.
export function stepOf(job) {
  if (job.state !== "running") return "waits until another job has ended";
  const at = progressOf(job.job);
  const label = at?.label.replace(/(^|, )step .*$/, (_, comma) => `${comma}step ${at.done} of this job`).replace("the base model", job.kind === "add" ? "the base model alone, for the comparison" : "the base model");
  return [label || at?.what || "the program is loading", timeOf(job)].filter(Boolean).join("; ");
}

// What the check tells better: runs that cannot be read, and a base fit that ended with them.
export const isFinding = (job) => ["show", "identify"].includes(job.kind) && (!app.campaign?.check || app.campaign.check.errors > 0);

// The last job of a kind on what is looked at, if it has failed or was ended: the user goes on without its result.
export function failedOf(kind) {
  const c = app.campaign, last = c.jobs.filter((job) => job.kind === kind && job.subject.model === c.current && job.subject.quantity === c.quantity).at(-1);
  return last && ["failed", "cancelled"].includes(last.state) ? last : null;
}

const kept = new Map();
async function once(key, load) {
  if (!kept.has(key)) {
    kept.set(key, load().catch((error) => { kept.delete(key); throw error; }));
    if (kept.size > 60) kept.delete(kept.keys().next().value);
  }
  return kept.get(key);
}

const about = (model, quantity, name) => ({ campaign: app.campaign.campaign, model: model.number, quantity, name });

export function documentOf(model, name, quantity = app.campaign.quantity) {
  const stamp = model.documents[`${quantity}/${name}.json`];
  if (!stamp) return Promise.resolve(null);
  return once(`${app.campaign.campaign}/${model.number}/${quantity}/${name}/${stamp}`, () => get("/document", about(model, quantity, name)));
}

export function shown() {
  const c = app.campaign;
  if (!c?.shown) return Promise.resolve(null);
  return once(`${c.campaign}/show/${c.shown}`, () => get("/document", { campaign: c.campaign, name: "show" }));
}

export function arraysOf(model, name, quantity = app.campaign.quantity) {
  const stamp = model.documents[`${quantity}/${name}.npz`];
  if (!stamp) return Promise.resolve(null);
  return once(`${app.campaign.campaign}/${model.number}/${quantity}/${name}/${stamp}`, async () => {
    const query = new URLSearchParams(about(model, quantity, name));
    return unpack(await (await answer(await fetch(`/arrays?${query}`))).arrayBuffer());
  });
}

// What was measured, which is there before any model.
export function measured() {
  const c = app.campaign;
  if (!c?.measured) return Promise.resolve(null);
  return once(`${c.campaign}/measured/${c.measured}`, async () => unpack(await (await answer(await fetch(`/arrays?${new URLSearchParams({ campaign: c.campaign, name: "measured" })}`))).arrayBuffer()));
}

function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const out = { texts: head.texts, shapes: {} };
  for (const [name, { shape, at }] of Object.entries(head.arrays)) {
    out[name] = new Float32Array(buffer, 4 + length + 4 * at, shape.reduce((a, b) => a * b, 1));
    out.shapes[name] = shape;
  }
  return out;
}

let seen = -1;
export function connect() {
  const socket = new WebSocket(`ws://${location.host}/news`);
  socket.onmessage = (message) => {
    const news = JSON.parse(message.data);
    app.running = news.running;
    if (!app.connected) { app.connected = true; tell("link"); }
    if (news.changed !== seen) { seen = news.changed; refresh(); }
    tell("progress");
  };
  socket.onclose = () => {
    app.connected = false;
    seen = -1;
    tell("link");
    setTimeout(connect, 500);
  };
}
