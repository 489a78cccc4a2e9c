// Elements, numbers as text, messages, and tables as CSV files.
export function h(kind, attributes = {}, ...children) {
  const made = document.createElement(kind);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "class") made.className = value;
    else if (name === "value") made.value = value;
    else if (name === "checked") made.checked = value;
    else made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.flat(3).filter((one) => one !== null && one !== undefined && one !== false));
  return made;
}

const markOf = (one) => [one.localName, one.id, one.getAttribute("aria-label"), one.getAttribute("href"), one.textContent].join();

// What has the focus keeps it, and what was typed, when the same is drawn anew: nobody at the keyboard is thrown back to the top.
export function fill(place, ...children) {
  const old = place.contains(document.activeElement) && document.activeElement !== place ? document.activeElement : null, mark = old && markOf(old);
  place.replaceChildren(...children.flat(3).filter((one) => one !== null && one !== undefined && one !== false));
  const same = old && [...place.querySelectorAll(old.localName)].find((one) => markOf(one) === mark);
  if (same) {
    if (old.localName === "input" && old.type === "text") same.value = old.value;
    same.focus({ preventScroll: true });
  }
  return place;
}

export function number(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(Number(value))) return "–";
  const x = Number(value);
  if (x === 0) return "0";
  const size = Math.abs(x);
  const text = size >= 1e5 || size < 1e-3 ? x.toExponential(digits - 1) : String(Number(x.toPrecision(digits)));
  return text.replace("e-", "e\u2212").replace("e+", "e").replace(/^-/, "\u2212");
}

export function strength(value, digits = 3) {
  return Array.isArray(value) ? value.map((x) => number(x, digits)).join(", ") : number(value, digits);
}

const UNITS = { noise: "× noise", ustrain: "microstrain" };
export const unitName = (unit) => UNITS[unit] || unit || "";

// On a large screen everything is larger, plots by the height of the window.
export const large = () => window.innerWidth >= 2200;
export const tall = () => (large() ? Math.max(1.8, window.innerHeight / 850) : 1);

// One strength with its standard deviation and unit, or each of several as the equation of the effect numbers them.
export const strengths = (value, std, unit) => [].concat(value).map((one, k, all) => `${all.length > 1 ? `s_${k + 1}: ` : ""}${number(one)} ± ${number([].concat(std)[k], 2)}${unit === "1" ? "" : ` ${unitName(unit)}`}`);

let timer = 0;
const hide = (place) => { if (place.matches(":popover-open")) place.hidePopover(); };
export const hush = () => hide(document.getElementById("toast"));
export function toast(text, bad = false) {
  const place = document.getElementById("toast");
  place.textContent = text;
  place.className = bad ? "bad" : "";
  hide(place);
  place.showPopover(); // above a dialog that is open
  clearTimeout(timer);
  timer = setTimeout(hush, bad ? 12000 : 4000);
}

export function choose(options, value, change, label) {
  const made = h("select", { onchange: () => change(made.value), "aria-label": label || "" },
    options.map(([key, text]) => h("option", { value: key, selected: key === value }, text)));
  made.value = value;
  return label ? h("label", {}, `${label} `, made) : made;
}

export function save(name, data, type = "text/csv") {
  const address = URL.createObjectURL(new Blob([data], { type }));
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

// Columns of equal length: [[name, values], ...].
export function csv(columns) {
  const quoted = (said) => { const x = said.replaceAll("\u2212", "-"); return /[",\n]/.test(x) ? `"${x.replaceAll('"', '""')}"` : x; };
  const cell = (x) => (x === null || x === undefined || (typeof x === "number" && !Number.isFinite(x)) ? "" : quoted(String(x)));
  const rows = [columns.map(([name]) => quoted(name)).join(",")];
  const length = Math.max(0, ...columns.map(([, values]) => values.length));
  for (let i = 0; i < length; i += 1) rows.push(columns.map(([, values]) => cell(values[i])).join(","));
  return rows.join("\r\n") + "\r\n";
}

export const csvButton = (name, columns) =>
  h("button", { class: "small", type: "button", title: "The data of this plot", onclick: () => save(`${name}.csv`, csv(columns())) }, "CSV");

export function dialog(title, ...content) {
  const box = document.getElementById("dialog");
  fill(box, h("div", { class: "row" }, h("h2", {}, title), h("span", { class: "room" }),
    h("button", { type: "button", onclick: () => box.close() }, "Close")), ...content);
  if (!box.open) box.showModal();
  return box;
}
