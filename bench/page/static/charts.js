// Charts of uPlot: strain over wheel angle, estimates over time. Colors come from the style sheet.
const uPlot = window.uPlot;
const colors = {};
export const drawn = { count: 0 };

export function readColors() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["value", "band", "bad", "quiet", "grid", "text"]) {
    colors[name] = style.getPropertyValue(`--${name}`).trim();
  }
}

const FONT = '11px system-ui, "DejaVu Sans", sans-serif';

function axis(more) {
  return {
    stroke: () => colors.quiet, font: FONT, gap: 3,
    grid: { stroke: () => colors.grid, width: 1 }, ticks: { show: false }, ...more,
  };
}

function fitted(plot, place) {
  new ResizeObserver(() => {
    const { clientWidth: width, clientHeight: height } = place;
    if (width > 0 && height > 0) plot.setSize({ width, height });
  }).observe(place);
  place.plot = plot;
  return plot;
}

// Grow at once, shrink only when less than half is used: a scale that twitches cannot be read.
function steady(least, extent = (_, min, max) => [min, max]) {
  let low = 0, high = 0;
  return (plot, all, most) => {
    const [min, max] = extent(plot, all, most);
    if (min == null || max == null) return low < high ? [low, high] : [-least, least];
    const pad = Math.max(0.06 * (max - min), 0.5 * (least - (max - min)), 1e-9);
    const bottom = min - pad, top = max + pad;
    if (bottom < low || top > high || high - low > 2 * (top - bottom)) {
      const room = 0.05 * (top - bottom);
      low = bottom - room; high = top + room;
    }
    return [low, high];
  };
}

// What may be used, with half a usual band: one wide band does not flatten all the others.
function usable(plot) {
  const [, high, low, value] = plot.data;
  const known = value.filter((x) => x !== null);
  if (!known.length) return [null, null];
  const halves = high.map((x, i) => (x === null ? null : 0.5 * (x - low[i])))
    .filter((x) => x !== null).sort((a, b) => a - b);
  const half = halves.length ? halves[halves.length >> 1] : 0;
  return [Math.min(...known) - half, Math.max(...known) + half];
}

// A turn between two that may not be used has no line: it gets a dot.
function alone(plot, index) {
  const y = plot.data[index];
  const found = [];
  for (let i = 0; i < y.length; i += 1) {
    if (y[i] != null && y[i - 1] == null && y[i + 1] == null) found.push(i);
  }
  return found;
}

const count = { draw: [() => { drawn.count += 1; }] };
const invisible = { stroke: "transparent", points: { show: false }, spanGaps: false };

export function traceChart(place, last) {
  const plot = new uPlot({
    width: 300, height: 80, legend: { show: false }, hooks: count,
    cursor: { sync: { key: "angle" }, points: { show: false }, drag: { setScale: false } },
    padding: [4, 18, last ? 0 : 4, 0],
    scales: { x: { time: false, range: () => [-180, 180] }, y: { range: steady(20) } },
    axes: [
      axis({ show: last, size: 24, splits: () => place.zoomed
        ? [-40, -20, 0, 20, 40] : [-180, -135, -90, -45, 0, 45, 90, 135, 180],
      values: (_, ticks) => ticks.map((tick) => `${tick}°`) }),
      axis({ size: 56, space: 26 }),
    ],
    series: [{}, invisible, invisible,
      { stroke: () => colors.value, width: 1.6, points: { show: false }, spanGaps: false }],
    bands: [{ series: [1, 2], fill: () => colors.band }],
  }, [[0, 1], [null, null], [null, null], [null, null]], place);
  plot.scales.x.range = () => (place.zoomed ? [-40, 40] : [-180, 180]);
  return fitted(plot, place);
}

// Time from left to right. The band of a turn is as long as the turn, and a value that may not be
// used has no height: a red dot at the bottom tells when it was.
export function timeChart(place, least, label = "", space = 30) {
  const turn = { ...invisible, paths: uPlot.paths.stepped({ align: -1 }) };
  const plot = new uPlot({
    width: 300, height: 100, legend: { show: false }, hooks: count,
    cursor: { sync: { key: "time" }, points: { show: false }, drag: { setScale: false } },
    padding: [6, 18, 0, 0],
    scales: {
      x: { time: false, range: (u) => u.window || [0, 1] },
      y: { range: steady(least, usable) }, mark: { range: () => [0, 1] },
    },
    axes: [
      axis({ size: 22, values: (_, ticks) => ticks.map((tick) => `${tick} s`) }),
      axis({ size: 52, space }),
    ],
    series: [{}, turn, turn,
      { stroke: () => colors.value, width: 2, spanGaps: false,
        points: { show: true, filter: alone, size: 4, fill: () => colors.value } },
      { stroke: () => colors.bad, width: 0, scale: "mark", paths: () => null,
        points: { show: true, size: 5, fill: () => colors.bad } }],
    bands: [{ series: [1, 2], fill: () => colors.band }],
  }, [[0], [null], [null], [null], [null]], place);
  if (label) {
    const name = document.createElement("b");
    name.textContent = label;
    place.append(name);
  }
  return fitted(plot, place);
}
