// The page of `tirebench run`: takes messages from the stream, draws at most once a frame.
import { buildAll, drawAll } from "./all.js";
import { drawn, readColors, shareScale, timeChart, traceChart } from "./charts.js";
import {
  clock, limits, newest, node, QUANTITIES, reasons, scaled, series, shown, WIDTH,
} from "./format.js";
import { drawGages, listenGages, openGages } from "./gages.js";
import { buildHealth, drawAlarms, drawHealth, drawLimits, drawUse } from "./panels.js";
import { drawShape } from "./shape.js";

const $ = (id) => document.getElementById(id);
const WINDOWS = [5, 10, 20, 30, 60, 120, 300];
const KEPT = 6000;

const app = {
  wheels: new Map(), wheel: null, all: false, chosen: false, cards: "", state: null, page: null, lap: null, band: null,
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
    if (app.wheel === null) choose(number, false);
    if (app.wheels.size > 1 && !app.chosen) view(true);
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
      if (app.all) drawAll($("all"), app.wheels, app.state, notLive, app.seconds);
      else drawTimes();
    } else { app.dirty.add("turns"); setTimeout(wake, 60); }
  }
  if (!app.all && (all || dirty.has("lap"))) drawLap();
  if (all || dirty.has("state")) drawState();
}

function current() { return app.wheels.get(app.wheel) || { rows: [], last: null }; }

function drawNumbers() {
  const wheel = current();
  const { last } = wheel;
  for (const { key, digits, factor = 1 } of QUANTITIES) {
    const box = $(`q-${key}`);
    const [value, band, why] = ["value", "pm", "why"].map((name) => box.querySelector(`.${name}`));
    value.textContent = last ? shown(scaled(last[key], factor), digits) : "–";
    value.classList.toggle("none", value.textContent === "–");
    band.textContent = limits(last, key, digits, factor);
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

// Why the numbers on the page are not of this moment; empty if they are.
function notLive(wheel = current()) {
  const state = app.state;
  if (app.away) return `held: no connection since ${clock(app.away)}`;
  if (!state || !wheel.last) return "";
  if (state.lost) return `held: unplugged since ${clock(1000 * state.lost)}`;
  if (state.ended) return "held: the run has ended";
  const age = state.time - wheel.last.came;
  return state.live && age > 2 ? `held: last turn ${age.toFixed(0)} s ago` : "";
}

function drawTimes() {
  const [part, window_] = newest(current().rows, app.seconds);
  QUANTITIES.forEach(({ key, factor = 1 }, index) => {
    const { plot } = $(`q-${key}`).querySelector(".chart");
    plot.window = window_;
    plot.setData(series(part, index, factor));
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
  const [none, charts] = [new Array(720).fill(null), []];
  document.querySelectorAll(".trace .chart").forEach(({ plot }, gage) => {
    const high = mine && band ? column(band, 3600 + 720 * gage) : none;
    const low = mine && band ? column(band, 720 * gage) : none;
    plot.setData([ANGLES, high, low, mine ? column(lap.data, 720 * gage) : none], false);
    charts.push(plot);
  });
  shareScale(charts);
}

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
    ? `Recording ${(((state.chain || {}).recording || recording).bytes / 1e6).toFixed(1)} MB` : "Record";
  record.title = recording.name || "";
  $("marker").disabled = record.disabled || !recording.on;
  state.lateral_mm.forEach((y, i) => {
    const label = document.querySelectorAll(".trace b small")[i];
    label.textContent = `y ${y > 0 ? "+" : ""}${y.toFixed(0)} mm`;
  });
  const parts = [`byte to estimate p99 ${shown(state.latency_p99_ms, 1)} ms`,
    `page: ${page.missed + page.skipped_all + state.left_out} frames dropped`,
    "rates: last 5 s", `${restarts(state, page)} restarts`, `${page.viewers} viewer${page.viewers === 1 ? "" : "s"}`];
  if (state.messages.length) parts.push(`FMU: ${state.messages.at(-1)}`);
  $("system").textContent = parts.join(" · ");
  $("system").title = $("system").textContent;
  drawHealth($("health"), state.wheels, state.alarms);
  drawUse($("use-list"), state, app.all ? null : app.wheel);
  drawGages(state);
  $("gages").disabled = !state.live || Boolean(state.ended) || app.wheel === null;
  const alarms = drawAlarms($("alarms"), state);
  $("alarms-count").textContent = alarms || "";
  $("alarm-list").dataset.count = alarms;
  if ($("alarm-box").open && state.alarms) drawLimits($("limits"), $("past"), state.alarms);
  drawNumbers();
}

// Processes that were started again, the page's own included.
function restarts(state, page) {
  const others = Object.values((state.chain || {}).restarts || {});
  return others.reduce((a, b) => a + b, page.starts - 1);
}

function drawWheels() {
  const numbers = [...app.wheels.keys()];
  if (app.cards !== numbers.join()) {
    app.cards = numbers.join();
    buildAll($("all"), numbers, choose);
    document.querySelectorAll("#all .chart").forEach(({ plot }) => plot.redraw(false));
  }
  const every = node("button", "All ");
  every.type = "button";
  every.dataset.wheel = "all";
  every.setAttribute("aria-pressed", String(app.all));
  every.append(node("kbd", "0"));
  every.onclick = showAll;
  const several = numbers.length > 1 ? [every] : [];
  $("wheels").replaceChildren(...several, ...numbers.map((number, place) => {
    const button = node("button", `Wheel ${number} `);
    button.type = "button";
    button.dataset.wheel = number;
    button.setAttribute("aria-pressed", String(!app.all && number === app.wheel));
    if (place < 9) button.append(node("kbd", String(place + 1)));
    button.onclick = () => choose(number);
    return button;
  }));
}

// ---- what the user does

function view(all) {
  app.all = all;
  document.body.classList.toggle("every", all);
  drawWheels();
  app.dirty.add("all");
  wake();
}

function showAll() {
  app.chosen = true;
  view(true);
}

function choose(number, byUser = true) {
  if (byUser) { app.chosen = true; app.all = false; document.body.classList.remove("every"); }
  if (app.wheel !== number) { app.band = null; app.lap = null; }
  app.wheel = number;
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

function alarmList() {
  if (app.state && app.state.alarms) drawLimits($("limits"), $("past"), app.state.alarms);
  $("alarm-box").showModal();
}

const KEYS = {
  g: () => { if (!$("gages").disabled) { openGages(app.wheel); drawGages(app.state); } },
  r: record, m: marker, d: otherTheme, z: zoom, " ": hold,
  n: () => ($("marker").disabled ? marker() : setMarker("")),
  "+": () => window_(-1), "=": () => window_(-1), "-": () => window_(1),
  0: () => { if (app.wheels.size > 1) showAll(); }, a: alarmList,
  "?": () => $("help-box").showModal(), h: () => $("help-box").showModal(),
};

function build() {
  for (let gage = 1; gage <= 5; gage += 1) {
    const row = document.createElement("div");
    row.className = gage === 5 ? "trace last" : "trace";
    const label = node("b", `gage ${gage} `);
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
    const left = node("div", sign);
    left.className = "name";
    left.append(node("small", `${name}, ± 95 %`), node("small", "ISO 8855"));
    const value = node("div", "–");
    value.className = "value";
    const right = document.createElement("div");
    right.className = "unit";
    const limits = node("small", "± –");
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
  buildHealth($("health"));
}

function listen() {
  $("record").onclick = record;
  $("marker").onclick = marker;
  $("theme").onclick = otherTheme;
  $("help").onclick = KEYS["?"];
  listenGages(send);
  $("gages").onclick = () => KEYS.g();
  $("alarm-list").onclick = alarmList;
  $("alarm-close").onclick = () => $("alarm-box").close();
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
