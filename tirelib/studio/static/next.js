// The run to measure next: in words, and drawn over the plan.
import { h, number } from "./dom.js";
import { CONDITIONS } from "./maps.js";
import { Plot } from "./plots.js";

const BEST = 3;
const KEYS = { load: "load_N", pressure: "pressure_bar", speed: "speed_kmh", slip_angle: "slip_angle_deg", camber: "camber_deg", slip_ratio: "slip_ratio" };
const SWEEPS = { slip_angles_deg: ["slip angle", "deg"], slip_ratios: ["slip ratio", ""] };

// A run in words; a slip that is swept is told by its ends.
function words(run) {
  const fixed = CONDITIONS.filter(([key]) => Number.isFinite(run[KEYS[key]])).map(([key, name, unit]) => (["load", "pressure", "speed"].includes(key) ? `${number(run[KEYS[key]])} ${unit}` : `${name} ${number(run[KEYS[key]])}${unit === "1" ? "" : ` ${unit}`}`));
  const swept = Object.entries(SWEEPS).filter(([key]) => run[key]?.length).map(([key, [name, unit]]) => `${name} ${number(Math.min(...run[key]))} to ${number(Math.max(...run[key]))} ${unit}`.trim());
  return [...fixed, ...swept].join(", ");
}

// Each condition that the best runs state, over the first of them.
function panels(list, data) {
  const stated = CONDITIONS.filter(([key]) => data[key] && list.some((run) => Number.isFinite(run[KEYS[key]])));
  const [[x, name, unit] = [], ...others] = stated;
  return others.map(([y, title, own]) => {
    const points = [...Array.from(data[x], (at, i) => [at, data[y][i], null]), ...list.map((run) => [run[KEYS[x]], null, run[KEYS[y]]])].sort((a, b) => a[0] - b[0]);
    const plot = new Plot(`plan-${y}`, { height: 170 });
    queueMicrotask(() => plot.show({
      title: `${title} over ${name}: the plan, and the best next runs`, unit: own, y: `${title} [${own}]`, x: { title: `${name} [${unit}]`, values: points.map((p) => p[0]) },
      series: [{ name: "measured runs", values: points.map((p) => p[1]), color: "measured", points: true }, { name: "best next runs", values: points.map((p) => p[2]), color: "rest", points: true, hollow: true }],
    }));
    return plot;
  });
}

// found: what next-test has written; said: its sentence; data: the plan as the map has it.
export function nextRun(found, said, data) {
  const list = (found.candidates || []).slice(0, BEST), plots = panels(list, data);
  const element = h("div", { id: "next-run" }, h("h3", {}, "The next run"), h("p", {}, said.charAt(0).toUpperCase() + said.slice(1).replaceAll(/ \(`tirelib [^`]*`\)/g, "")),
    list.length ? [h("p", { class: "quiet small" }, "The best runs, best first:"), h("ol", {}, list.map((run) => h("li", {}, words(run)))), h("div", { class: "two" }, plots.map((plot) => plot.element))] : null);
  return { element, remove: () => plots.forEach((plot) => plot.remove()) };
}
