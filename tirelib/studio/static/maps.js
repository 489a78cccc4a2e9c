// From arrays to what is drawn: rows of a map, waveforms and curves, numbers by run; of strain and of forces.
import { number } from "./dom.js";

export const CONDITIONS = [["load", "load", "N"], ["pressure", "inflation pressure", "bar"], ["speed", "speed", "km/h"], ["slip_angle", "slip angle", "deg"], ["slip_ratio", "slip ratio", "1"], ["camber", "camber", "deg"], ["temperature", "tread temperature", "degC"], ["order", "time order", "s"]];
export const isStrain = (data) => data.texts.quantity === "strain";
export const unitOf = (data) => (isStrain(data) ? "microstrain" : data.texts.quantity === "Mz" ? "Nm" : "N");
// The axis of what a plot shows, with its unit and, where it has a sign of its own, its axis system.
export const valueTitle = (data) => (isStrain(data) ? "strain [microstrain]" : `${data.texts.quantity}, ISO 8855 [${unitOf(data)}]`);
// Whether a condition has more than one set point; what has no set points varies by more than 3 %.
function varies(data, key) {
  if (!data[key]) return false;
  const level = data[`level_${key}`];
  if (level) return level.some((x) => x !== level[0]);
  const values = data[key].filter(Number.isFinite), [low, high] = [values.reduce((a, b) => Math.min(a, b), Infinity), values.reduce((a, b) => Math.max(a, b), -Infinity)];
  return high - low > 0.03 * Math.max(Math.abs(low), Math.abs(high));
}
export const varying = (data) => CONDITIONS.filter(([key]) => varies(data, key));
export const slipOf = (data) => (data.texts.quantity === "Fx" || (varies(data, "slip_ratio") && !varies(data, "slip_angle")) ? CONDITIONS[4] : CONDITIONS[3]);

// The set point of each run or point, as the comparison numbers them, and the mean of each.
function levels(data, key) {
  const level = data[`level_${key}`] || data[key], sums = new Map();
  level.forEach((number, i) => { const [sum, count] = sums.get(number) || [0, 0]; sums.set(number, [sum + data[key][i], count + 1]); });
  return { level, centres: new Map([...sums].map(([number, [sum, count]]) => [number, sum / count])) };
}

export function sliced(data, name, row) {
  const n = data.shapes[name].at(-1);
  return data[name].subarray(row * n, (row + 1) * n);
}

export function runWords(data, i) {
  const slip = [["slip_angle", "deg"], ["camber", "deg"], ["slip_ratio", "slip"]].filter(([k]) => Math.abs(data[k][i]) > (k === "slip_ratio" ? 0.005 : 0.25)).map(([k, u]) => `${k.replace("_", " ")} ${number(data[k][i], 2)} ${u}`);
  return [`run ${data.run[i]}`, `${number(data.load[i], 4)} N`, `${number(data.pressure[i], 3)} bar`, `${number(data.speed[i], 3)} km/h`, ...slip].join(", ");
}

// Rows of the map of strain: runs in an order; of forces: levels of the conditions, over bins of slip.
export function strainRows(data, by, name) {
  const keys = { load: ["load", "pressure", "speed"], pressure: ["pressure", "load", "speed"], speed: ["speed", "load", "pressure"], order: ["order"] }[by];
  const level = keys.map((key) => (key === "order" ? { level: data.order } : levels(data, key)));
  const index = [...data.run.keys()].sort((a, b) => level.map((l) => l.level[a] - l.level[b]).find((d) => d) || a - b);
  const lead = level[0];
  let last = null;
  return index.map((i) => {
    const mark = by === "order" ? `run ${data.run[i]}` : lead.level[i];
    const tick = mark === last ? "" : by === "order" ? mark : `${number(lead.centres.get(lead.level[i]), 3)} ${CONDITIONS.find(([k]) => k === by)[2]}`;
    last = mark;
    return { index: i, label: runWords(data, i), tick, values: sliced(data, name, i), edges: data.edges && [data.edges[2 * i], data.edges[2 * i + 1]] };
  });
}

// A level in words: as few digits as tell every level to 1 % of the largest, and no 1e-4 for zero.
export function rounded(value, levels) {
  const high = Math.max(...levels.map(Math.abs)), first = 10 ** (Math.floor(Math.log10(high || 1)) - 1), to = (x, step) => Math.round(x / step) * step;
  const step = levels.every((x) => Math.abs(to(x, first) - x) <= 0.01 * high) ? first : first / 10;
  return number(to(value, step), 4);
}

// Round numbers that divide a range.
export function niceTicks(low, high) {
  const rough = (high - low) / 5, power = 10 ** Math.floor(Math.log10(rough || 1)), step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= rough) || power, out = [];
  for (let k = Math.ceil(low / step); k * step <= high * (1 + 1e-9); k += 1) out.push(Number((k * step).toPrecision(6)));
  return out;
}

export const BINS = 36;
export function forceRows(data, by, name) {
  const [slipKey, slipName, slipUnit] = slipOf(data);
  const keys = ["load", "pressure", "camber", "speed", "slip_angle", "slip_ratio"].filter((k) => k !== slipKey).filter((k) => varies(data, k)).sort((a, b) => (b === by) - (a === by));
  const found = keys.map((key) => levels(data, key));
  const low = Math.min(...data[slipKey]), high = Math.max(...data[slipKey]);
  const groups = new Map();
  for (const i of data.run.keys()) {
    const key = found.map((f) => f.level[i]).join();
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(i);
  }
  const order = ([a], [b]) => found.map((f) => f.level[a] - f.level[b]).find((d) => d) || 0;
  const rows = [...groups.values()].sort(order).map((members) => {
    const sum = new Float32Array(BINS), count = new Uint16Array(BINS);
    for (const i of members) { const k = Math.min(BINS - 1, Math.floor((BINS * (data[slipKey][i] - low)) / (high - low || 1))); sum[k] += data[name][i]; count[k] += 1; }
    const said = keys.map((key, j) => { const [, text, unit] = CONDITIONS.find(([k]) => k === key), value = rounded(found[j].centres.get(found[j].level[members[0]]), [...found[j].centres.values()]); return unit === "1" ? `${text} ${value}` : `${value} ${unit}`; });
    return { members, label: said.join(", ") || "all points", tick: said.join(", "), values: sum.map((s, k) => (count[k] ? s / count[k] : NaN)), said };
  });
  return { rows, slip: { key: slipKey, title: `${slipName} [${slipUnit}]`, low, high } };
}

// What a brushed range holds: its rms, its share of the squares.
export function share(data, name, rows, inside, counted) {
  let part = 0, whole = 0, count = 0;
  for (const row of rows) {
    if (counted && row.index !== undefined && !counted[row.index]) continue;
    row.values.forEach((value, k) => { if (!Number.isFinite(value)) return; whole += value * value; if (inside(k)) { part += value * value; count += 1; } });
  }
  return { rms: Math.sqrt(part / Math.max(count, 1)), share: part / (whole || 1), count };
}

export function rms(values) {
  let sum = 0, n = 0;
  for (const x of values) if (Number.isFinite(x)) { sum += x * x; n += 1; }
  return n ? Math.sqrt(sum / n) : NaN;
}
export const mean = (values) => { let sum = 0, n = 0; for (const x of values) if (Number.isFinite(x)) { sum += x; n += 1; } return n ? sum / n : NaN; };
