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
function steady(least) {
  let low = 0, high = 0;
  return (plot, min, max) => {
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

export function timeChart(place, least) {
  const plot = new uPlot({
    width: 300, height: 100, legend: { show: false }, hooks: count,
    cursor: { sync: { key: "time" }, points: { show: false }, drag: { setScale: false } },
    padding: [6, 18, 0, 0],
    scales: { x: { time: false, range: (u) => u.window || [0, 1] }, y: { range: steady(least) } },
    axes: [
      axis({ size: 22, values: (_, ticks) => ticks.map((tick) => `${tick} s`) }),
      axis({ size: 52, space: 30 }),
    ],
    series: [{}, invisible, invisible,
      { stroke: () => colors.value, width: 2, points: { show: false }, spanGaps: false },
      { stroke: () => colors.bad, width: 0, paths: () => null,
        points: { show: true, size: 5, fill: () => colors.bad } }],
    bands: [{ series: [1, 2], fill: () => colors.band }],
  }, [[0], [null], [null], [null], [null]], place);
  return fitted(plot, place);
}
