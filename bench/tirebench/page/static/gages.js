// Zero and shunt of one wheel's gages: what they show now, and two steps before anything is written.
import { node, shown } from "./format.js";

const $ = (id) => document.getElementById(id);
let wheel = 0;
let send = () => {};

function disarm() {
  for (const [id, text] of [["zero-set", "Zero ..."], ["shunt-set", "2. Shunt is on: gains ..."]]) {
    $(id).textContent = text;
    $(id).dataset.armed = "";
  }
}

// The first press asks, the second does it.
function confirmed(button, question, action) {
  if (button.dataset.armed) { disarm(); action(); return; }
  disarm();
  button.dataset.armed = "1";
  button.textContent = question;
}

function shunt(on) {
  const text = ["gage-ohm", "shunt-ohm", "gage-factor"].map((id) => $(id).value.trim()).join(" ");
  send({ command: "shunt", wheel, on, text });
}

export function openGages(number) {
  wheel = number;
  disarm();
  $("gages-wheel").textContent = number;
  $("gages-box").showModal();
}

export function drawGages(state) {
  if (!$("gages-box").open) return;
  const now = (state.gages || {})[String(wheel)];
  $("gages-now").replaceChildren(...state.lateral_mm.map((y, i) => {
    const row = document.createElement("tr");
    row.append(node("td", `gage ${i + 1}, y ${y > 0 ? "+" : ""}${y.toFixed(0)} mm`),
      node("td", now ? shown(now.mean[i], 0) : "–"), node("td", now ? shown(now.range[i], 0) : "–"));
    return row;
  }));
}

export function listenGages(sender) {
  send = sender;
  $("zero-set").onclick = () => confirmed($("zero-set"), `Write the zero of wheel ${wheel}?`,
    () => send({ command: "zero", wheel }));
  $("shunt-before").onclick = () => { disarm(); shunt(false); };
  $("shunt-set").onclick = () => confirmed($("shunt-set"), `Write the gains of wheel ${wheel}?`,
    () => shunt(true));
  $("gages-close").onclick = () => $("gages-box").close();
}
