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

// A line with the pen up where a value is missing. uPlot's own draws on to the next value and hides
// that part, but for a pixel at both ends: a spike of hundreds of newtons where the load has changed.
function broken(plot, index) {
  const [x, y] = [plot.data[0], plot.data[index]];
  const stroke = new Path2D();
  let down = false;
  for (let i = 0; i < x.length; i += 1) {
    if (y[i] == null) { down = false; continue; }
    const [across, up] = [plot.valToPos(x[i], "x", true), plot.valToPos(y[i], "y", true)];
    if (down) stroke.lineTo(across, up); else stroke.moveTo(across, up);
    down = true;
  }
  return { stroke, fill: null, clip: null, band: null, gaps: null, flags: 1 };
}

// Fill shapes between the two limits, inside the chart.
function filled(plot, draw) {
  const { left, top, width, height } = plot.bbox;
  const [path, [x, high, low]] = [new Path2D(), plot.data];
  const place = (value, scale) => Math.round(plot.valToPos(value, scale, true));
  draw(path, x, high, low, place);
  plot.ctx.save();
  plot.ctx.beginPath();
  plot.ctx.rect(left, top, width, height);
  plot.ctx.clip();
  plot.ctx.fillStyle = colors.band;
  plot.ctx.fill(path);
  plot.ctx.restore();
}

// The band along an angle: one shape for each stretch without a hole.
function alongAngle(path, x, high, low, place) {
  for (let start = 0; start < x.length;) {
    if (high[start] == null) { start += 1; continue; }
    let end = start;
    while (end < x.length && high[end] != null) end += 1;
    for (let i = start; i < end; i += 1) path.lineTo(place(x[i], "x"), place(high[i], "y"));
    for (let i = end - 1; i >= start; i -= 1) path.lineTo(place(x[i], "x"), place(low[i], "y"));
    path.closePath();
    path.moveTo(0, 0);
    start = end;
  }
}

// The band of each turn: as long as the turn.
function ofTurns(path, x, high, low, place) {
  const steps = x.map((t, i) => t - x[i - 1]).filter((t) => t > 0).sort((a, b) => a - b);
  const usual = steps.length ? steps[steps.length >> 1] : 0;
  for (let i = 0; i < x.length; i += 1) {
    if (high[i] == null) continue;
    const step = x[i] - x[i - 1];
    const [left, right] = [place(x[i] - (step > 0 && step < 3 * usual ? step : usual), "x"), place(x[i], "x")];
    const [top, bottom] = [place(high[i], "y"), place(low[i], "y")];
    path.rect(left, top, Math.max(right - left, 1), bottom - top);
  }
}

const count = { draw: [() => { drawn.count += 1; }] };
const hooks = (shape) => ({ ...count, drawAxes: [(plot) => filled(plot, shape)] });
const invisible = { paths: () => null, points: { show: false } };

// One scale for all gages: beside the others a dead one is seen to be flat.
const common = steady(20);
let together = [-20, 20];
export function shareScale(plots) {
  const known = plots.flatMap(({ data }) => data.slice(1).flat()).filter((y) => y !== null);
  const ends = known.reduce(([low, high], y) => [Math.min(low, y), Math.max(high, y)], [Infinity, -Infinity]);
  together = known.length ? common(null, ...ends) : together;
  for (const plot of plots) plot.setData(plot.data);
}

export function traceChart(place, last) {
  const plot = new uPlot({
    width: 300, height: 80, legend: { show: false }, hooks: hooks(alongAngle),
    cursor: { sync: { key: "angle" }, points: { show: false }, drag: { setScale: false } },
    padding: [4, 18, last ? 0 : 4, 0],
    scales: { x: { time: false, range: () => [-180, 180] }, y: { range: () => together } },
    axes: [
      axis({ show: last, size: 24, splits: () => place.zoomed
        ? [-40, -20, 0, 20, 40] : [-180, -135, -90, -45, 0, 45, 90, 135, 180],
      values: (_, ticks) => ticks.map((tick) => `${tick}°`) }),
      axis({ size: 56, space: 26 }),
    ],
    series: [{}, invisible, invisible,
      { stroke: () => colors.value, width: 1.6, paths: broken, points: { show: false } }],
  }, [[0, 1], [null, null], [null, null], [null, null]], place);
  plot.scales.x.range = () => (place.zoomed ? [-40, 40] : [-180, 180]);
  return fitted(plot, place);
}

// Time from left to right. The band of a turn is as long as the turn, and a value that may not be
// used has no height: a red dot at the bottom tells when it was.
export function timeChart(place, least, label = "", space = 30) {
  const plot = new uPlot({
    width: 300, height: 100, legend: { show: false }, hooks: hooks(ofTurns),
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
    series: [{}, invisible, invisible,
      { stroke: () => colors.value, width: 2, paths: broken,
        points: { show: true, filter: alone, size: 4, fill: () => colors.value } },
      { stroke: () => colors.bad, width: 0, scale: "mark", paths: () => null,
        points: { show: true, size: 5, fill: () => colors.bad } }],
  }, [[0], [null], [null], [null], [null]], place);
  if (label) {
    const name = document.createElement("b");
    name.textContent = label;
    place.append(name);
  }
  return fitted(plot, place);
}
