// All wheels at once: a card each, with the four quantities, Fz and Fy over time, and the wheel's health.
import { timeChart } from "./charts.js";
import { limits, newest, node, QUANTITIES, reasons, scaled, series, shown } from "./format.js";

const CHARTED = ["Fz", "Fy"];

function card(number, choose) {
  const box = node("article", "", "card");
  box.dataset.wheel = number;
  const top = node("div", "", "head");
  const name = node("button", `Wheel ${number}`);
  name.type = "button";
  name.onclick = () => choose(number);
  top.append(name, node("span", "", "vitals quiet"));
  const values = node("div", "", "values");
  for (const { key, sign, unit } of QUANTITIES) {
    const line = node("div", "", "line");
    line.dataset.key = key;
    line.append(node("span", sign, "sign"), node("span", "–", "value"), node("span", unit, "unit"),
      node("span", "± –", "pm"));
    values.append(line);
  }
  const charts = node("div", "", "charts");
  for (const key of CHARTED) {
    const place = node("div", "", "chart");
    place.dataset.key = key;
    charts.append(place);
  }
  const body = node("div", "", "body");
  body.append(values, charts);
  box.append(top, node("div", "", "why"), body);
  return box;
}

export function buildAll(place, numbers, choose) {
  place.replaceChildren(...numbers.map((number) => card(number, choose)));
  place.dataset.count = numbers.length;
  for (const chart of place.querySelectorAll(".chart")) {
    const { least, sign, unit } = QUANTITIES.find(({ key }) => key === chart.dataset.key);
    timeChart(chart, least, `${sign}, ${unit}; ± 95 %`, 18);
  }
}

export function vitals(counts) {
  const said = [];
  const add = (value, digits, unit) => { if (value !== null && value !== undefined) said.push(`${shown(value, digits)} ${unit}`); };
  add(counts.rate_hz, 0, "samples/s");
  add(counts.loss_percent, 1, "% lost");
  add(counts.rssi_dbm, 0, "dBm");
  add(counts.temperature_c, 0, "°C");
  add(counts.battery_v, 2, "V");
  add(counts.tire_pressure_bar, 2, "bar");
  return said.join(" · ");
}

export function drawAll(place, wheels, state, old, seconds) {
  for (const box of place.children) {
    const number = Number(box.dataset.wheel);
    const wheel = wheels.get(number);
    const { last, rows } = wheel;
    const counts = state ? state.wheels[String(number)] : null;
    box.querySelector(".vitals").textContent = counts ? vitals(counts) : "";
    const held = old(wheel);
    const why = box.querySelector(".why");
    const invalid = last && QUANTITIES.some(({ key }) => !last[`${key}_valid`]);
    why.textContent = invalid ? `invalid: ${reasons(last)}` : held;
    why.classList.toggle("held", !invalid && Boolean(held));
    box.classList.toggle("old", Boolean(held));
    for (const { key, digits, factor = 1 } of QUANTITIES) {
      const line = box.querySelector(`[data-key="${key}"]`);
      line.querySelector(".value").textContent = last ? shown(scaled(last[key], factor), digits) : "–";
      line.querySelector(".value").classList.toggle("none", !last || last[key] === null);
      line.querySelector(".pm").textContent = limits(last, key, digits, factor);
      line.classList.toggle("invalid", Boolean(last) && !last[`${key}_valid`]);
    }
    const [part, window_] = newest(rows, seconds);
    for (const chart of box.querySelectorAll(".chart")) {
      const index = QUANTITIES.findIndex(({ key }) => key === chart.dataset.key);
      chart.plot.window = window_;
      chart.plot.setData(series(part, index, QUANTITIES[index].factor || 1));
    }
  }
}
