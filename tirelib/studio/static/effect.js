// The page of an effect: what it is, its equation and source, and the residual in these runs if it alone were missing.
import { app, arraysOf, current, listen, wish } from "./data.js";
import { dialog, h, number } from "./dom.js";
import { isStrain, sliced, unitOf, valueTitle } from "./maps.js";
import { Plot } from "./plots.js";

const SYMBOLS = {
  s: "the strength", s_1: "the first number of the strength", s_2: "the second", s1: "the first number of the strength", s2: "the second",
  k_u: "radial stiffness of the sidewall", k_v: "tangential stiffness of the sidewall", k_t: "radial stiffness of the tread", EI: "bending stiffness of the belt", EA: "stiffness of the belt along itself",
  A: "section of the belt", R: "radius of the belt", R0: "free radius of the tire", Omega: "turn rate of the wheel", Fz: "load", Fz0: "reference load", p0: "reference pressure", c_px: "longitudinal stiffness of the brush", c_py: "lateral stiffness of the brush", mu: "friction",
};
const meaningOf = (equation) => Object.entries(SYMBOLS).filter(([symbol]) => new RegExp(`(?<![\\w'])${symbol}(?![\\w'])`).test(equation)).map(([symbol, said]) => `${symbol}: ${said}`).join("; ");

// The strength that is tried first where none was fitted: half of the larger end of the plausible range.
function halfOf({ components, range: [low, high] }) {
  const half = (Math.abs(high) >= Math.abs(low) ? high : low) / 2;
  return Array.from({ length: components }, (_, k) => (k ? 0 : half));
}

// e: what the diagnosis says of the effect, or null; owner: the step that shows it, with its model, map and fitted traces.
export function effectPage(name, e, owner) {
  const { field, model, traces } = owner, about = owner.title(name);
  if (!about) return;
  const { data } = field, unit = about.unit === "1" ? "" : ` ${about.unit}`;
  const plot = new Plot(`planted-${name}`, { height: 230 }), said = h("p", { class: "small quiet", role: "status" });
  const fitted = [].concat(e ? e.strength : halfOf(about)).map((x) => Number(x.toPrecision(4))).join(", ");
  const input = h("input", { value: fitted, size: 16, "aria-label": "strength" });
  const draw = (trace, strength) => {
    const row = field.rows[field.row];
    said.textContent = `${isStrain(data) ? "Dashed" : "Hollow"}: what ${name} of strength ${strength}${unit} would take of the residual (model less measured), beyond what the other numbers of the model take when they are fitted anew.`;
    if (isStrain(data)) {
      const n = data.angle.length;
      plot.show({ title: row.label, unit: "microstrain", y: valueTitle(data), x: { title: "wheel angle [deg]", values: Array.from(data.angle) }, series: [{ name: "measured residual", values: sliced(data, "difference", row.index), color: "rest" }, { name: `what ${name} takes beyond the other numbers`, values: trace.subarray(row.index * n, (row.index + 1) * n), color: "trace", dash: [6, 4] }] });
      return;
    }
    const { key, title: x } = field.slip, order = [...data.run.keys()].sort((a, b) => data[key][a] - data[key][b]);
    plot.show({ title: "all points", unit: unitOf(data), y: valueTitle(data), x: { title: x, values: order.map((i) => data[key][i]) }, series: [{ name: "measured residual", values: order.map((i) => data.difference[i]), color: "rest", points: true }, { name: `what ${name} takes beyond the other numbers`, values: order.map((i) => trace[i]), color: "trace", points: true, hollow: true }] });
  };
  const file = `${app.campaign.quantity}/planted.npz`;
  let stop = () => {};
  const plant = async () => {
    const numbers = input.value.split(",").map((x) => (x.trim() ? Number(x) : NaN));
    if (numbers.some((x) => !Number.isFinite(x)) || numbers.length !== about.components) {
      said.textContent = about.components > 1 ? `${about.components} numbers with commas between them are needed.` : "One number is needed.";
      return;
    }
    const before = current()?.documents[file], strength = input.value;
    stop();
    said.textContent = "The effect is being planted.";
    stop = listen(async (what) => {
      if (what !== "state") return;
      const last = app.campaign?.jobs.filter((job) => job.kind === "plant").at(-1), now = app.campaign && current();
      if (last && ["failed", "cancelled"].includes(last.state)) { stop(); said.textContent = last.message || "It was cancelled."; return; }
      if (last?.state !== "done" || now?.number !== model.number || now.documents[file] === before) return;
      stop();
      const planted = await arraysOf(now, "planted"), trace = planted[`trace_${name}`];
      if (trace) draw(trace, strength); else said.textContent = planted.texts[`fault_${name}`] || "There is no trace.";
    });
    if (!(await wish({ do: "plant", ...owner.where(), effect: name, strength: numbers }))) stop();
  };
  const box = dialog(name, h("p", {}, about.title), h("p", { class: "small" }, `Acts on: ${about.stage}. Varies with: ${about.varies_with.join(", ") || "nothing"}. Plausible strength: ${about.range.map((x) => number(x)).join(" to ")}${unit}.`),
    h("h3", {}, "Equation"), h("p", {}, about.equation || "The law itself says it:"), h("p", { class: "small quiet" }, meaningOf(about.equation || "")), h("details", {}, h("summary", {}, "The law as it is computed"), h("pre", {}, about.law)),
    h("h3", {}, "Source"), h("p", {}, about.source), h("h3", {}, "What it would look like here"),
    h("div", { class: "row" }, h("label", {}, "strength ", input, unit), h("button", { type: "button", onclick: plant }, "Plant it")), said, plot.element);
  const known = traces?.[`trace_${name}`];
  if (known) draw(known, fitted); else said.textContent = "Give a strength and plant it.";
  box.addEventListener("close", () => { stop(); plot.remove(); }, { once: true });
}
