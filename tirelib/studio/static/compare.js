// Two models side by side: their errors, what each leaves as a map in one scale, and every run.
import { arraysOf, documentOf, heldOutOf, nameOf, RMS_LEFT, rmsOf, verdictOf } from "./data.js";
import { choose, csvButton, dialog, fill, h, number, strength, unitName } from "./dom.js";
import { Heat, limitOf } from "./heat.js";
import { BINS, forceRows, isStrain, niceTicks, strainRows, unitOf } from "./maps.js";

const ANGLES = [-180, -90, 0, 90, 180];

// What a map of a model's residual needs, with the scale that both maps share.
function mapOf(data, limit) {
  const unit = unitOf(data), say = (rows, low, high, columns) => (r, c) => `${rows[r].label}; at ${number(low + ((c + 0.5) * (high - low)) / columns, 3)}: ${number(rows[r].values[c])} ${unit}`;
  if (isStrain(data)) {
    const rows = strainRows(data, "load", "difference"), columns = data.angle.length;
    return { rows, columns, unit, limit, x: { title: "wheel angle [deg]", low: -180, high: 180, ticks: ANGLES }, say: say(rows, -180, 180, columns) };
  }
  const { rows, slip } = forceRows(data, "load", "difference");
  return { rows, columns: BINS, unit, limit, x: { ...slip, ticks: niceTicks(slip.low, slip.high) }, say: say(rows, slip.low, slip.high, BINS) };
}

const LINES = [
  ["error", (_, m) => Number.isFinite(m.error) && `${number(m.error, 4)} ${unitName(m.error_unit)}`],
  [RMS_LEFT, (t) => t && `${number(t.residual_rms_raw)} ${rmsOf(t)}`],
  ["effects", (t) => t && (t.effects.map((e) => `${e.effect} ${strength(e.strength)}`).join("; ") || "none")],
  ["verdict", (_, m) => verdictOf(m.verdict, m.error_unit, m.named)],
  ["held-out error", (_, m, c) => { const error = heldOutOf(c, m); return error && `${number(error, 4)} ${unitName(m.error_unit)}`; }],
];

// Rows of the table of runs (forces: curves): name, error of the left model, of the right one.
function parts(told) {
  const found = new Map();
  told.forEach((t, i) => (t?.runs || t?.curves || []).forEach((part) => {
    const key = part.run !== undefined ? `run ${part.run}` : part.words;
    if (!found.has(key)) found.set(key, [null, null]);
    found.get(key)[i] = part.run !== undefined ? part.error : part.rms_noise ?? part.rms;
  }));
  return [...found.entries()];
}

const change = (x, y) => (x && y ? (y < x ? "▼ lower" : y > x ? "▲ higher" : "the same") : "");

export function compareModels(c, models) {
  const last = models.at(-1).number, right = c.current !== models[0].number ? c.current : last;
  const known = models.filter((m) => m.number < right && m.documents[`${c.quantity}/plots.npz`]); // of several effects at once only the last model is
  const pick = [(known.at(-1) || models[0]).number, right], body = h("div", {});
  const options = models.map((m) => [m.number, `${m.number} ${nameOf(m)}`]);
  const heats = ["left", "right"].map((side) => new Heat(`Map of what the ${side} model leaves`, { height: 240, choose: (at) => { for (const heat of heats.filter((one) => one.map)) { heat.at = { ...at }; heat.say(heat.at); heat.draw(); } } }));
  const draw = async () => {
    const both = pick.map((n) => c.models.find((m) => m.number === n));
    const [told, arrays] = await Promise.all([documentOf, arraysOf].map((of, k) => Promise.all(both.map((m) => of(m, ["comparison", "plots"][k], c.quantity).catch(() => null)))));
    const each = parts(told), limit = Math.max(...arrays.filter(Boolean).map((data) => limitOf(data.difference)));
    fill(body, h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, ""), both.map((m) => h("th", {}, nameOf(m))))), h("tbody", {}, LINES.map(([text, value]) => h("tr", {}, h("td", {}, text), both.map((m, i) => h("td", {}, value(told[i], m, c) || "–")))))),
      h("h3", {}, `What each leaves of ${c.quantity}: model less measured${arrays[0] || arrays[1] ? ` [${unitOf(arrays[0] || arrays[1])}]` : ""}, one scale`),
      h("div", { class: "two" }, both.map((m, i) => h("div", {}, h("div", { class: "row small" }, nameOf(m), h("span", { class: "room" }), arrays[i] ? csvButton(`map-${m.number}`, () => heats[i].columns(isStrain(arrays[i]) ? 0 : 0.5)) : null), arrays[i] ? heats[i].element : h("p", { class: "quiet" }, "It has not been compared yet: continue from it once.")))),
      each.length ? h("h3", {}, `Each ${c.quantity === "strain" ? "run" : "curve"}: error [${unitName((told[0] || told[1]).error_unit)}]`) : null, h("table", {}, h("tbody", {}, each.map(([name, [x, y]]) => h("tr", {}, h("td", {}, name), h("td", { class: "n" }, number(x)), h("td", { class: "n" }, number(y)), h("td", { class: y < x ? "good" : "warn" }, change(x, y)))))));
    arrays.forEach((data, i) => data && heats[i].show(mapOf(data, limit)));
  };
  const side = (i) => choose(options, pick[i], (picked) => { pick[i] = picked; draw(); }, ["left", "right"][i]);
  dialog("Two models side by side", h("div", { class: "row" }, side(0), side(1)), body);
  draw();
}
