// The page of `tirebench run`: takes messages from the stream, draws at most once a frame.
import { drawn, readColors, timeChart, traceChart } from "./charts.js";
import { drawShape } from "./shape.js";

const $ = (id) => document.getElementById(id);
const QUANTITIES = [
  { key: "Fz", sign: "Fz", name: "vertical load", unit: "N", digits: 0, least: 200 },
  { key: "alpha", sign: "α", name: "slip angle", unit: "deg", digits: 2, least: 0.5 },
  { key: "kappa", sign: "κ", name: "slip ratio", unit: "%", digits: 2, factor: 100, least: 1 },
  { key: "Fy", sign: "Fy", name: "lateral force", unit: "N", digits: 0, least: 200 },
];
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
  restarted: "the FMU was started again", skipped: "turns were skipped: overload",
};
const COUNTERS = [
  ["frames", "frames good"], ["crc_bad", "CRC bad", 1], ["framing_bad", "framing bad", 1],
  ["lost_frames", "frames lost", 1], ["lost_samples", "samples lost", 1],
  ["duplicates", "doubled", 1], ["out_of_order", "late", 1], ["resets", "resets", 1],
  ["overruns", "overruns", 1], ["reconnects", "replugs", 1],
  ["skipped_turns", "turns skipped", 1],
  ["saturated_samples", "saturated gage 1..5", 1], ["radio_loss", "radio loss", 1],
  ["low_battery", "low battery", 1], ["clock_drift_ppm", "clock, ppm"],
  ["newest_sample_age_ms", "sample age, ms"], ["turns", "turns"],
  ["invalid_turns", "turns invalid"],
];
const WINDOWS = [5, 10, 20, 30, 60, 120, 300];
const KEPT = 6000;
const WIDTH = 2 + 2 * QUANTITIES.length; // columns of a row: time, value and band each, valid

const app = {
  wheels: new Map(), wheel: null, state: null, page: null, lap: null, band: null,
  seconds: 30, hold: false, zoomed: false, socket: null, away: null, answered: null,
  dirty: new Set(["all"]), latency: [], delay: [], messages: 0, bytes: 0, lastTimes: 0, toast: 0,
};
window.tirebench = Object.assign(app, { drawn });

// ---- messages

function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let place = 4 + length;
  header.arrays = header.arrays.map(([kind, ...shape]) => {
    const size = shape.reduce((a, b) => a * b, 1);
    const data = kind === "f8" ? new Float64Array(buffer, place, size)
      : new Float32Array(buffer, place, size);
    place += Math.ceil(data.byteLength / 8) * 8;
    return { data, shape };
  });
  return header;
}

function take(buffer) {
  app.messages += 1;
  app.bytes += buffer.byteLength;
  const message = decode(buffer);
  app.page = message.page;
  for (const [number, { rows, last }] of Object.entries(message.turns || {})) {
    const wheel = wheelOf(Number(number));
    const { data, shape } = message.arrays[rows];
    for (let row = 0; row < shape[0]; row += 1) {
      wheel.rows.push(data.subarray(row * WIDTH, (row + 1) * WIDTH));
    }
    if (wheel.rows.length > 1.2 * KEPT) wheel.rows.splice(0, wheel.rows.length - KEPT);
    wheel.last = last;
    wheel.fresh = true;
    app.dirty.add("turns");
  }
  if (message.lap) {
    const { wheel, trace, band } = message.lap;
    if (app.lap && app.lap.wheel !== wheel) app.band = null;
    app.lap = { ...message.lap, data: message.arrays[trace].data };
    if (band !== undefined) app.band = message.arrays[band].data;
    app.dirty.add("lap");
  }
  if (message.state) {
    app.state = message.state;
    Object.keys(message.state.wheels).forEach((number) => wheelOf(Number(number)));
    app.dirty.add("state");
    answers(message.state.answers || []);
  }
  wake();
}

function wheelOf(number) {
  if (!app.wheels.has(number)) {
    app.wheels.set(number, { rows: [], last: null, fresh: false });
    app.wheels = new Map([...app.wheels].sort(([a], [b]) => a - b));
    if (app.wheel === null) choose(number);
    drawWheels();
  }
  return app.wheels.get(number);
}

function connect() {
  const socket = new WebSocket(`ws://${location.host}/stream`);
  socket.binaryType = "arraybuffer";
  app.socket = socket;
  let greeted = false;
  socket.onmessage = ({ data }) => {
    if (!greeted) { // a new stream tells everything again
      greeted = true;
      app.away = null;
      for (const wheel of app.wheels.values()) wheel.rows = [];
      if (app.wheel !== null) tell();
    }
    take(data);
  };
  socket.onclose = () => {
    app.away = app.away || Date.now();
    app.dirty.add("state");
    wake();
    setTimeout(connect, 1000);
  };
}

function tell() {
  if (app.socket && app.socket.readyState === WebSocket.OPEN) {
    app.socket.send(JSON.stringify({ wheel: app.wheel }));
  }
}

async function send(command) {
  try {
    const response = await fetch("/command", {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(command),
    });
    if (!response.ok) toast((await response.json()).error, false);
  } catch { toast("the page's server does not answer", false); }
}

function answers(list) {
  const newest = list.length ? list[list.length - 1] : null;
  if (app.answered !== null && newest && newest.number > app.answered) toast(newest.text, newest.good);
  app.answered = newest ? newest.number : 0;
}

// ---- drawing

let asked = false;
function wake() {
  if (!asked && !app.hold) { asked = true; requestAnimationFrame(draw); }
}

function draw() {
  asked = false;
  if (app.hold) return;
  const dirty = app.dirty;
  app.dirty = new Set();
  const all = dirty.has("all");
  if (all || dirty.has("turns")) {
    drawNumbers();
    const now = performance.now();
    if (all || now - app.lastTimes > 90) {
      app.lastTimes = now;
      drawTimes();
    } else { app.dirty.add("turns"); setTimeout(wake, 60); }
  }
  if (all || dirty.has("lap")) drawLap();
  if (all || dirty.has("state")) drawState();
}

function current() { return app.wheels.get(app.wheel) || { rows: [], last: null }; }

function shown(value, digits) {
  if (value === null || !Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "\u2212");
}

function scaled(value, factor) { return value === null ? null : factor * value; }

function drawNumbers() {
  const wheel = current();
  const { last } = wheel;
  for (const { key, digits, factor = 1 } of QUANTITIES) {
    const box = $(`q-${key}`);
    const [value, band, why] = ["value", "pm", "why"].map((name) => box.querySelector(`.${name}`));
    value.textContent = last ? shown(scaled(last[key], factor), digits) : "–";
    const std = last ? last[`${key}_std`] : null;
    value.classList.toggle("none", value.textContent === "–");
    band.textContent = std === null ? "± –" : `± ${shown(1.959964 * factor * std, digits)}`;
    const valid = last ? last[`${key}_valid`] : true;
    const old = notLive();
    box.classList.toggle("invalid", !valid);
    box.classList.toggle("held", valid && Boolean(old));
    const note = last && valid && !old && last.flags.length ? `note: ${reasons(last)}` : "";
    box.classList.toggle("noted", Boolean(note));
    why.textContent = valid ? old || note : `invalid: ${reasons(last)}`;
    why.hidden = !why.textContent;
    box.dataset.turn = last ? last.turn : "";
    box.dataset.value = last ? JSON.stringify(last[key]) : "";
  }
  if (last && wheel.fresh) {
    wheel.fresh = false;
    const now = performance.timeOrigin + performance.now();
    app.latency.push(now - 1000 * last.came); // from the bytes that ended the turn, [ms]
    app.delay.push(now - 1000 * last.told); // from the estimate
    for (const list of [app.latency, app.delay]) if (list.length > 2000) list.shift();
  }
  const lateral = app.state ? app.state.lateral_mm : [60, 30, 0, -30, -60];
  const lengths = [1, 2, 3, 4, 5].map((gage) => (last ? last[`contact_length_${gage}_mm`] : null));
  drawShape($("shape"), lateral, lengths.map((x) => (x === null ? NaN : x)), !last || last.valid);
}

function reasons(last) {
  const said = last.flags.map((flag) => REASONS[flag] || flag.replaceAll("_", " "));
  return said.join("; ") || "the estimator says so";
}

// Why the numbers on the page are not of this moment; empty if they are.
function notLive() {
  const state = app.state;
  if (app.away) return `held: no connection since ${clock(app.away)}`;
  if (!state || !current().last) return "";
  if (state.lost) return `held: unplugged since ${clock(1000 * state.lost)}`;
  if (state.ended) return "held: the run has ended";
  const age = state.time - current().last.came;
  return state.live && age > 2 ? `held: last turn ${age.toFixed(0)} s ago` : "";
}

function drawTimes() {
  const { rows } = current();
  const end = rows.length ? rows[rows.length - 1][0] : 0;
  let first = rows.length;
  while (first > 0 && rows[first - 1][0] >= end - app.seconds) first -= 1;
  const part = rows.slice(first);
  const times = part.map((row) => row[0]);
  QUANTITIES.forEach(({ key, factor = 1 }, index) => {
    const [low, high, value, bad] = [[], [], [], []];
    for (const row of part) {
      const [x, half] = [factor * row[1 + 2 * index], factor * row[2 + 2 * index]];
      const good = (row[WIDTH - 1] >> index) & 1 && Number.isFinite(x);
      value.push(good ? x : null);
      low.push(good && half >= 0 ? x - half : null);
      high.push(good && half >= 0 ? x + half : null);
      bad.push(!good && Number.isFinite(x) ? x : null);
    }
    const { plot } = $(`q-${key}`).querySelector(".chart");
    plot.window = [Math.max(0, end - app.seconds), Math.max(end, app.seconds)];
    plot.setData([times, high, low, value, bad]);
  });
}

const ANGLES = Array.from({ length: 720 }, (_, i) => -180 + 0.5 * i);

function column(data, start) {
  const values = new Array(720);
  for (let i = 0; i < 720; i += 1) {
    const x = data[start + i];
    values[i] = Number.isFinite(x) ? x : null;
  }
  return values;
}

function drawLap() {
  const { lap, band } = app;
  const mine = lap && lap.wheel === app.wheel;
  $("lap").textContent = mine
    ? `µε, turn ${lap.turn}${lap.valid ? "" : " (invalid)"}; band of ${lap.laps} turns`
    : "waiting for a whole turn";
  const none = new Array(720).fill(null);
  document.querySelectorAll(".trace .chart").forEach(({ plot }, gage) => {
    const high = mine && band ? column(band, 3600 + 720 * gage) : none;
    const low = mine && band ? column(band, 720 * gage) : none;
    plot.setData([ANGLES, high, low, mine ? column(lap.data, 720 * gage) : none]);
  });
}

function clock(milliseconds) { return new Date(milliseconds).toLocaleTimeString("en-GB"); }

function status() {
  const { state } = app;
  if (app.hold) return ["waiting", "picture held: Space goes on"];
  if (app.away) return ["bad", `no connection since ${clock(app.away)}`];
  if (!state) return ["waiting", "connecting"];
  if (state.lost) return ["bad", `unplugged since ${clock(1000 * state.lost)}`];
  if (state.ended) return ["waiting", `run ended: ${state.ended}`];
  if (!Object.keys(state.wheels).length) return ["waiting", "waiting for the first frame"];
  if (state.live && state.time - state.heard > 1) {
    return ["bad", `silent since ${clock(1000 * state.heard)}`];
  }
  if (!current().last) return ["waiting", "waiting for the first turn"];
  return ["live", state.live ? "live" : "replay"];
}

function drawState() {
  const [kind, text] = status();
  $("status").dataset.kind = kind;
  $("status").textContent = text;
  const { state, page } = app;
  if (!state) return;
  $("link").textContent = [state.link, state.tire, state.fmu].filter(Boolean).join(" · ");
  $("link").title = $("link").textContent;
  document.title = `${text} · tirebench`;
  const recording = state.recording || { possible: false, on: false, bytes: 0, markers: 0 };
  const record = $("record");
  record.disabled = !recording.possible || Boolean(state.ended) || Boolean(app.away);
  record.setAttribute("aria-pressed", String(recording.on));
  record.querySelector("span").textContent = recording.on
    ? `Recording ${(recording.bytes / 1e6).toFixed(1)} MB` : "Record";
  $("marker").disabled = record.disabled || !recording.on;
  state.lateral_mm.forEach((y, i) => {
    const label = document.querySelectorAll(".trace b small")[i];
    label.textContent = `y ${y > 0 ? "+" : ""}${y.toFixed(0)} mm`;
  });
  const parts = [`byte to estimate p99 ${shown(state.latency_p99_ms, 1)} ms`,
    `page: ${page.missed + page.skipped_all + state.left_out} frames dropped`,
    `${restarts(state, page)} restarts`, `${page.viewers} viewer${page.viewers === 1 ? "" : "s"}`];
  if (state.messages.length) parts.push(`FMU: ${state.messages.at(-1)}`);
  $("system").textContent = parts.join(" · ");
  $("system").title = $("system").textContent;
  drawHealth(state.wheels);
  drawNumbers();
}

// Processes that were started again, the page's own included.
function restarts(state, page) {
  const others = Object.values((state.chain || {}).restarts || {});
  return others.reduce((a, b) => a + b, page.starts - 1);
}

function drawHealth(wheels) {
  const rows = Object.entries(wheels).map(([number, counts]) => {
    const row = document.createElement("tr");
    row.append(cell("td", `wheel ${number}`));
    for (const [key, , loss] of COUNTERS) {
      const given = counts[key];
      const total = Array.isArray(given) ? given.reduce((a, b) => a + b, 0) : given;
      const text = Array.isArray(given) ? (total ? given.join(" ") : "0")
        : key.endsWith("ppm") || key.endsWith("ms") ? shown(given, 1) : String(given);
      const entry = cell("td", text);
      entry.dataset.counter = key;
      entry.classList.toggle("lost", Boolean(loss) && total > 0);
      row.append(entry);
    }
    return row;
  });
  document.querySelector("#health tbody").replaceChildren(...rows);
}

function cell(kind, text) {
  const node = document.createElement(kind);
  node.textContent = text;
  return node;
}

function drawWheels() {
  $("wheels").replaceChildren(...[...app.wheels.keys()].map((number, place) => {
    const button = cell("button", `Wheel ${number} `);
    button.type = "button";
    button.dataset.wheel = number;
    button.setAttribute("aria-pressed", String(number === app.wheel));
    if (place < 9) button.append(cell("kbd", String(place + 1)));
    button.onclick = () => choose(number);
    return button;
  }));
}

// ---- what the user does

function choose(number) {
  app.wheel = number;
  app.band = null;
  app.lap = null;
  tell();
  drawWheels();
  app.dirty.add("all");
  wake();
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  $("theme").firstChild.textContent = theme === "dark" ? "Light " : "Dark ";
  readColors();
  document.querySelectorAll(".chart").forEach(({ plot }) => plot && plot.redraw(false));
}

function otherTheme() {
  const theme = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  localStorage.setItem("tirebench-theme", theme);
  setTheme(theme);
}

function toast(text, good) {
  $("toast").textContent = text;
  $("toast").classList.toggle("bad", !good);
  $("toast").hidden = false;
  clearTimeout(app.toast);
  app.toast = setTimeout(() => { $("toast").hidden = true; }, 4000);
}

function record() {
  if ($("record").disabled) return toast("this run cannot record", false);
  return send({ command: "record", on: $("record").getAttribute("aria-pressed") !== "true" });
}

function marker() {
  if ($("marker").disabled) return toast("nothing is being recorded: start a recording first", false);
  $("marker-text").value = "";
  return $("marker-box").showModal();
}

function setMarker(text) {
  $("marker-box").close();
  send({ command: "marker", text: text.slice(0, 200) });
}

function hold() {
  app.hold = !app.hold;
  drawState();
  app.dirty.add("all");
  wake();
}

function zoom() {
  app.zoomed = !app.zoomed;
  document.querySelectorAll(".trace .chart").forEach((place) => { place.zoomed = app.zoomed; });
  drawLap();
}

function window_(step) {
  const place = WINDOWS.indexOf(app.seconds) + step;
  app.seconds = WINDOWS[Math.min(Math.max(place, 0), WINDOWS.length - 1)];
  drawTimes();
}

const KEYS = {
  r: record, m: marker, d: otherTheme, z: zoom, " ": hold,
  n: () => ($("marker").disabled ? marker() : setMarker("")),
  "+": () => window_(-1), "=": () => window_(-1), "-": () => window_(1),
  "?": () => $("help-box").showModal(), h: () => $("help-box").showModal(),
};

function build() {
  for (let gage = 1; gage <= 5; gage += 1) {
    const row = document.createElement("div");
    row.className = gage === 5 ? "trace last" : "trace";
    const label = cell("b", `gage ${gage} `);
    label.append(document.createElement("small"));
    const chart = document.createElement("div");
    chart.className = "chart full";
    row.append(label, chart);
    $("traces").append(row);
    traceChart(chart, gage === 5);
  }
  for (const { key, sign, name, unit, least } of QUANTITIES) {
    const box = document.createElement("article");
    box.className = "quantity";
    box.id = `q-${key}`;
    const top = document.createElement("div");
    top.className = "top";
    const left = cell("div", sign);
    left.className = "name";
    left.append(cell("small", name), cell("small", "ISO 8855"));
    const value = cell("div", "–");
    value.className = "value";
    const right = document.createElement("div");
    right.className = "unit";
    const limits = cell("small", "± –");
    limits.className = "pm";
    right.append(limits, unit);
    top.append(left, value, right);
    const why = document.createElement("div");
    why.className = "why";
    why.hidden = true;
    const chart = document.createElement("div");
    chart.className = "chart";
    box.append(top, why, chart);
    $("numbers").append(box);
    timeChart(chart, least);
  }
  const head = document.createElement("tr");
  head.append(cell("th", ""), ...COUNTERS.map(([, name]) => cell("th", name)));
  document.querySelector("#health thead").append(head);
}

function listen() {
  $("record").onclick = record;
  $("marker").onclick = marker;
  $("theme").onclick = otherTheme;
  $("help").onclick = KEYS["?"];
  $("help-close").onclick = () => $("help-box").close();
  $("marker-set").onclick = () => setMarker($("marker-text").value);
  $("marker-cancel").onclick = () => $("marker-box").close();
  $("marker-text").onkeydown = (event) => {
    event.stopPropagation();
    if (event.key === "Enter") setMarker($("marker-text").value);
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    const wheels = [...app.wheels.keys()];
    const digit = Number(event.key);
    const action = event.key !== " " && digit >= 1 && digit <= wheels.length
      ? () => choose(wheels[digit - 1]) : KEYS[event.key.toLowerCase()];
    if (action) { event.preventDefault(); action(); }
  });
}

build();
listen();
setTheme(localStorage.getItem("tirebench-theme")
  || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
connect();
