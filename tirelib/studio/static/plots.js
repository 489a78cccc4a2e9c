// Lines, points and bars with uPlot: one look, units on every axis, data as CSV.
import { csvButton, fill, h, large, number, tall } from "./dom.js";
import { niceTicks } from "./maps.js";

export const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const live = new Set();
new ResizeObserver(() => live.forEach((plot) => plot.fit())).observe(document.documentElement);
new MutationObserver(() => live.forEach((plot) => plot.renew())).observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });

const axis = (label, extra = {}) => ({
  stroke: () => color("quiet"), grid: { stroke: () => color("grid"), width: 1 }, ticks: { stroke: () => color("line"), width: 1 },
  font: `${large() ? 16 : 12}px system-ui, sans-serif`, labelFont: `${large() ? 16 : 12}px system-ui, sans-serif`,
  label, labelSize: large() ? 24 : 18, size: large() ? 76 : 62, ...extra,
});

function svg(kind, attributes, text) {
  const one = document.createElementNS("http://www.w3.org/2000/svg", kind);
  for (const [name, value] of Object.entries(attributes)) one.setAttribute(name, value);
  if (text !== undefined) one.textContent = text;
  return one;
}

// A line of the legend, dashed as in the plot.
function stroke({ color: name, width = 2, dash = [] }) {
  const mark = svg("svg", { width: 44, height: 8, "aria-hidden": true });
  mark.append(svg("line", { x1: 0, x2: 44, y1: 4, y2: 4, stroke: `var(--${name})`, "stroke-width": width, "stroke-dasharray": dash.join(" ") }));
  return mark;
}

// series: [{name, values, color, dash, points, width, fill}], bands: [[upper, lower, color]]
export class Plot {
  constructor(name, { height = 210, select = null, points = false, chosen = null } = {}) {
    this.name = name; this.base = height; this.select = select; this.points = points; this.chosen = chosen;
    this.head = h("span");
    this.place = h("div");
    this.legend = h("div", { class: "legend" });
    this.element = h("div", { class: "plot" }, h("div", { class: "title" }, this.head, csvButton(name, () => this.columns())), this.place, this.legend);
    live.add(this);
  }

  get height() { return this.fixed || tall() * this.base; }

  columns() {
    if (!this.told) return [];
    const { x, series, extra = [] } = this.told;
    return [[x.title, x.values], ...extra, ...series.map((one) => [`${one.name} [${this.told.unit}]`, one.values])];
  }

  show(told) {
    this.told = told;
    this.head.textContent = told.title || "";
    const shape = JSON.stringify([told.series.map((s) => [s.name, s.color, s.dash, s.points]), told.x.title, told.unit, told.y, told.bands]);
    const data = [told.x.values, ...told.series.map((one) => one.values)];
    if (this.plot && shape === this.shape) { this.plot.setData(data); } else { this.shape = shape; this.make(data); }
  }

  make(data) {
    this.plot?.destroy();
    fill(this.legend, this.told.series.filter((one) => !one.quiet).map((one) => { const dot = h("b", {}, one.points ? `${one.hollow ? "○" : "●"} ` : ""); dot.style.color = color(one.color); return h("span", {}, one.points ? dot : [stroke(one), " "], one.name); }));
    const { told } = this;
    this.made = large();
    this.plot = new uPlot({
      width: Math.max(200, this.place.clientWidth || 500), height: this.height, legend: { show: false },
      cursor: { drag: { x: Boolean(this.select), y: false, setScale: false }, points: { show: !this.points }, dataIdx: undefined },
      scales: { x: { time: false, range: told.x.range ? () => told.x.range : undefined } },
      axes: [axis(told.x.title, { size: large() ? 44 : 34, ...(told.x.whole ? { incrs: [1, 2, 5, 10, 20, 50, 100, 200] } : {}) }), axis(told.y || told.unit)],
      bands: (told.bands || []).map(([upper, lower, paint]) => ({ series: [upper, lower], fill: () => `${color(paint)}2e` })),
      series: [{ label: told.x.title }, ...told.series.map((one) => ({
        label: one.name, stroke: () => color(one.color), width: one.width ?? 2, dash: one.dash,
        paths: one.points ? () => null : undefined,
        points: one.points ? { show: true, size: large() ? 11 : 8, width: 2, stroke: () => color(one.color), fill: () => (one.hollow ? color("card") : color(one.color)) } : { show: false },
      }))],
      hooks: {
        setSelect: [(plot) => {
          if (!this.select) return;
          const { left, width } = plot.select;
          this.select(width > 3 ? [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")] : null);
        }],
        ready: [(plot) => plot.over.addEventListener("click", () => { if (this.chosen && plot.cursor.idx !== null && plot.cursor.idx !== undefined) this.chosen(plot.cursor.idx); })],
      },
    }, data, this.place);
  }

  fit() { if (this.plot && this.made !== large()) this.renew(); else if (this.plot && this.place.clientWidth) this.plot.setSize({ width: this.place.clientWidth, height: this.height }); }
  renew() { if (this.plot) this.make([this.told.x.values, ...this.told.series.map((one) => one.values)]); }
  remove() { live.delete(this); this.plot?.destroy(); }
}

// The fall of the error as bars: one for each model, what a fit takes without the effect and what the effect takes beyond it as boxes, held-out errors as diamonds, the floor as a line.
export function waterfall(steps, unit) {
  const width = 760, height = 248, left = 56, bottom = 50, top = 16;
  const every = steps.flatMap((step) => [step.error, step.heldout]).filter(Number.isFinite);
  const high = 1.12 * Math.max(...every, 1e-9), up = (value) => height - bottom - ((height - bottom - top) * value) / high;
  const chart = svg("svg", { viewBox: `0 0 ${width} ${height}`, class: "waterfall", role: "img", "aria-label": `Error by step: ${steps.map((s) => `${s.name} ${number(s.error)}`).join(", ")} ${unit}` });
  for (const value of niceTicks(0, high / 1.12)) {
    chart.append(svg("line", { x1: left, x2: width - 8, y1: up(value), y2: up(value), stroke: "var(--grid)" }), svg("text", { x: left - 6, y: up(value) + 4, "text-anchor": "end", "font-size": 12, fill: "var(--quiet)" }, number(value, 2)));
  }
  const room = (width - left - 8) / Math.max(steps.length, 2);
  steps.forEach((step, i) => {
    const x = left + i * room + 0.15 * room, wide = 0.5 * room;
    if (Number.isFinite(step.error)) {
      const before = i ? steps[i - 1].error : null;
      const box = (high, low, look) => { if (Number.isFinite(high) && high > low) chart.append(svg("rect", { x, y: up(high), width: wide, height: up(low) - up(high), stroke: "var(--quiet)", ...look })); };
      const anew = Number.isFinite(step.anew) ? Math.max(step.anew, step.error) : step.error;
      box(before, anew, { fill: "none", "stroke-dasharray": "4 3" });
      box(Math.min(anew, before ?? anew), step.error, { fill: "var(--soft)" });
      chart.append(svg("rect", { x, y: up(step.error), width: wide, height: up(0) - up(step.error), fill: "var(--model)" }), svg("text", { x: x + wide / 2, y: up(step.error) - 4, "text-anchor": "middle", "font-size": 13, "font-weight": 600, fill: "var(--text)" }, number(step.error)));
    }
    if (Number.isFinite(step.floor)) chart.append(svg("line", { x1: x - 4, x2: x + wide + 4, y1: up(step.floor), y2: up(step.floor), stroke: "var(--text)", "stroke-width": 2, "stroke-dasharray": "2 3" }));
    if (Number.isFinite(step.heldout)) {
      const [cx, cy] = [x + wide + 12, up(step.heldout)];
      chart.append(svg("path", { d: `M${cx} ${cy - 6}l6 6-6 6-6-6z`, fill: "var(--card)", stroke: "var(--rest)", "stroke-width": 2 }), svg("text", { x: cx + 9, y: cy + 4, "font-size": 12, fill: "var(--rest)" }, number(step.heldout)));
    }
    const words = 7 * step.name.length > room ? step.name.split(/(?<=_)/) : [step.name]; // a name that is too wide is broken
    words.forEach((word, k) => chart.append(svg("text", { x: x + wide / 2, y: height - bottom + 16 + 13 * k, "text-anchor": "middle", "font-size": 12, fill: "var(--text)" }, word)));
    chart.append(svg("text", { x: x + wide / 2, y: height - bottom + 19 + 13 * words.length, "text-anchor": "middle", "font-size": 11, fill: "var(--quiet)" }, step.note || ""));
  });
  return h("div", {}, chart, h("p", { class: "small quiet" }, `Error [${unit}]. Bar: on what was fitted. Dashed box: what the fit takes by its numbers alone, without the effect; pale box: what the effect takes beyond that. Diamond: held out, on parts of the measurement that were left out of the fit in turn. Dotted line: what noise and the structure of a tire would leave.`));
}
