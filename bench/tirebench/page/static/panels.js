// What stands around the estimates: the link of each wheel, alarms, what is in use, the recording.
import { clock, node, shown } from "./format.js";

const NOW = [ // of each wheel: key, heading, digits, and the rule whose alarm marks it
  ["rate_hz", "samples/s", 0, "rate"], ["rate_expected_hz", "expected", 0],
  ["loss_percent", "lost %", 2, "loss"], ["invalid_percent", "turns invalid %", 0, "invalid"],
  ["rssi_dbm", "signal dBm", 0, "signal"], ["temperature_c", "sender °C", 0, "temperature"],
  ["battery_v", "battery V", 2, "battery"], ["tire_pressure_bar", "tire bar", 2, "tire_pressure"],
  ["newest_sample_age_ms", "age ms", 1, "delay"], ["clock_drift_ppm", "clock ppm", 1],
];
const COUNTERS = [ // since the start: key, name, and whether more than none is a loss
  ["frames", "frames good"], ["turns", "turns"], ["invalid_turns", "invalid"],
  ["crc_bad", "CRC bad", 1], ["framing_bad", "framing bad", 1],
  ["lost_frames", "frames lost", 1], ["lost_samples", "samples lost", 1],
  ["duplicates", "doubled", 1], ["out_of_order", "late", 1], ["resets", "resets", 1],
  ["overruns", "overruns", 1], ["reconnects", "replugs", 1], ["skipped_turns", "turns skipped", 1],
  ["saturated_samples", "saturated gage 1..5", 1], ["radio_loss", "radio loss", 1],
  ["low_battery", "low battery", 1],
];

export function buildHealth(table) {
  const head = document.createElement("tr");
  head.append(node("th", ""), ...NOW.map(([, name]) => node("th", name)), node("th", "since the start", "wide"));
  table.querySelector("thead").append(head);
}

export function drawHealth(table, wheels, alarms) {
  const wrong = new Set((alarms ? alarms.active : []).map(({ name, wheel }) => `${wheel} ${name}`));
  const rows = Object.entries(wheels).map(([number, counts]) => {
    const row = document.createElement("tr");
    row.append(node("td", `wheel ${number}`));
    for (const [key, , digits, rule] of NOW) {
      const cell = node("td", shown(counts[key], digits));
      cell.dataset.now = key;
      cell.classList.toggle("lost", wrong.has(`${number} ${rule}`)
        || (key === "battery_v" && Boolean(counts.battery_is_low)));
      row.append(cell);
    }
    const since = node("td", "", "wide");
    for (const [key, name, loss] of COUNTERS) {
      const given = counts[key];
      const total = Array.isArray(given) ? given.reduce((a, b) => a + b, 0) : given;
      const said = node("span", `${name} ${Array.isArray(given) ? given.join(" ") : given}`);
      said.dataset.counter = key;
      said.dataset.count = total;
      said.hidden = !total && key !== "frames";
      said.classList.toggle("lost", Boolean(loss) && total > 0);
      since.append(said, " ");
    }
    row.append(since);
    return row;
  });
  table.querySelector("tbody").replaceChildren(...rows);
}

function minutes(value) {
  if (value === null || value === undefined) return "–";
  return value >= 120 ? `${shown(value / 60, 1)} h` : `${shown(value, value < 10 ? 1 : 0)} min`;
}

function size(bytes) {
  if (bytes === null || bytes === undefined) return "–";
  return bytes >= 1e9 ? `${shown(bytes / 1e9, 1)} GB` : `${shown(bytes / 1e6, 1)} MB`;
}

// Conditions of these wheels with their source: a row each, and one for each wheel where they differ.
function conditionRows(wheels) {
  const found = new Map();
  for (const [number, { in_use: used }] of wheels) {
    for (const [name, { value, unit, source }] of Object.entries(used)) {
      const digits = unit === "km/h" ? 1 : 2;
      const said = unit === "1" ? shown(value, digits) : `${shown(value, digits)} ${unit}`;
      const one = { name, number, text: value === null ? "not known" : said, source, none: value === null };
      found.set(name, [...(found.get(name) || []), one]);
    }
  }
  return [...found.values()].flatMap((all) => {
    const alike = all.every(({ text, source }) => text === all[0].text && source === all[0].source);
    return alike ? [all[0]] : all.map((one) => ({ ...one, label: `${one.name} ${one.number}` }));
  });
}

// The recording, the conditions of a wheel (null: of all) with their source, the last notes.
export function drawUse(list, state, number) {
  const wheels = Object.entries(state.wheels).filter(([n]) => number === null || n === String(number));
  const rows = [];
  const row = (name, text, quiet) => {
    const value = node("dd", text);
    if (quiet) value.append(" ", node("small", quiet));
    value.title = value.textContent;
    rows.push(node("dt", name), value);
    return value;
  };
  const chain = (state.chain || {}).recording || {};
  const { on = false, name = "", bytes = 0 } = state.recording || {};
  const file = chain.file || name;
  row("recording", on ? file : name ? `off (last: ${name})` : "off", on
    ? `${size(chain.bytes ?? bytes)}, ${minutes(chain.minutes)}` : "").dataset.use = "recording";
  if (on && chain.free_bytes !== undefined) {
    row("room", `${size(chain.free_bytes)} free`, chain.minutes_left === null ? ""
      : `for ${minutes(chain.minutes_left)}`).dataset.use = "room";
  }
  for (const { name, label, text, source, none } of conditionRows(wheels)) {
    const cell = row((label || name).replaceAll("_", " "), text, source);
    cell.dataset.use = name;
    cell.classList.toggle("none", none);
  }
  for (const { time, text } of [...(state.notes || [])].reverse().slice(0, 3)) row(clock(1000 * time), text);
  list.replaceChildren(...rows);
}

// Alarms that go on, in words; what the recorder cannot do is one.
export function alarmsOf(state) {
  const { error } = (state.chain || {}).recording || {};
  const found = (state.alarms ? state.alarms.active : []).map(({ text, since }) => ({ text, since }));
  return error ? [{ text: `recording: ${error}`, since: null }, ...found] : found;
}

export function drawAlarms(place, state) {
  const found = state.ended ? [] : alarmsOf(state);
  place.hidden = !found.length;
  place.replaceChildren(...found.map(({ text, since }) => {
    const chip = node("span", text, "alarm");
    if (since) chip.append(" ", node("small", `since ${clock(1000 * since)}`));
    return chip;
  }));
  return found.length;
}

export function drawLimits(body, past, alarms) {
  body.replaceChildren(...alarms.limits.map((rule) => {
    const row = document.createElement("tr");
    const limit = (value, back) => (value === null ? "–" : `${value} (ends at ${Number((value + back).toPrecision(6))})`);
    row.append(node("td", rule.says), node("td", limit(rule.low, rule.hysteresis)),
      node("td", limit(rule.high, -rule.hysteresis)), node("td", rule.unit));
    return row;
  }));
  past.replaceChildren(...alarms.past.map(({ text, since, until }) => node("li",
    `${clock(1000 * since)} .. ${clock(1000 * until)}  ${text}`)));
}
