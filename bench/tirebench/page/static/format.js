// How numbers and reasons are written, in one place for all views.
export const QUANTITIES = [
  { key: "Fz", sign: "Fz", name: "vertical load", unit: "N", digits: 0, least: 200 },
  { key: "alpha", sign: "α", name: "slip angle", unit: "deg", digits: 2, least: 0.5 },
  { key: "kappa", sign: "κ", name: "slip ratio", unit: "%", digits: 2, factor: 100, least: 1 },
  { key: "Fy", sign: "Fy", name: "lateral force", unit: "N", digits: 0, least: 200 },
];
export const WIDTH = 2 + 2 * QUANTITIES.length; // columns of a row: time, value and band each, valid

const REASONS = {
  first_turn: "first turn: its period is unknown", gap: "samples are missing",
  bridged: "one or two samples were bridged", spike: "a spike was seen",
  saturated: "a gage is saturated", dead_gage: "a gage is dead",
  period_jump: "the turn rate jumped", trigger_mismatch: "trigger does not fit",
  drift: "a gage drifts", no_speed: "travel speed unknown", reversed: "rolls backward",
  out_of_range: "outside the calibrated range", cut_off: "filter does not suit the turn rate",
  reduced_gages: "one gage is out", too_few_gages: "too few gages",
  no_condition: "pressure or camber unknown", weak_edge: "contact edge not distinct",
  no_contact: "no contact: standstill or dead gages", fault: "the estimator met an error",
  other_tire: "not the strain of the calibrated tire",
  accelerating: "the wheel changes its speed too fast",
  restarted: "the FMU was started again", skipped: "turns were skipped: overload",
};

export function reasons(last) {
  const said = last.flags.map((flag) => REASONS[flag] || flag.replaceAll("_", " "));
  return said.join("; ") || "the estimator says so";
}

export function shown(value, digits) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "\u2212");
}

export function scaled(value, factor) { return value === null ? null : factor * value; }

export function limits(last, key, digits, factor = 1) {
  const std = last ? last[`${key}_std`] : null;
  return std === null ? "± –" : `± ${shown(1.959964 * factor * std, digits)}`;
}

export function clock(milliseconds) { return new Date(milliseconds).toLocaleTimeString("en-GB"); }

export function node(kind, text, name) {
  const made = document.createElement(kind);
  made.textContent = text;
  if (name) made.className = name;
  return made;
}

// What a chart gets: times, band, values that may be used, and where some may not.
export function series(rows, index, factor = 1) {
  const [times, low, high, value, bad] = [[], [], [], [], []];
  for (const row of rows) {
    const [x, half] = [factor * row[1 + 2 * index], factor * row[2 + 2 * index]];
    const good = (row[WIDTH - 1] >> index) & 1 && Number.isFinite(x);
    times.push(row[0]);
    value.push(good ? x : null);
    low.push(good && half >= 0 ? x - half : null);
    high.push(good && half >= 0 ? x + half : null);
    bad.push(!good && Number.isFinite(row[1]) ? 0.03 : null);
  }
  return [times, high, low, value, bad];
}

// The rows of the last seconds, and the window of time that shows them.
export function newest(rows, seconds) {
  const end = rows.length ? rows[rows.length - 1][0] : 0;
  let first = rows.length;
  while (first > 0 && rows[first - 1][0] >= end - seconds) first -= 1;
  return [rows.slice(first), [Math.max(0, end - seconds), Math.max(end, seconds)]];
}
