// A heat map on a canvas: rows of numbers over an axis; a cell is chosen by click or by the arrow keys, a range by dragging or by Shift with them.
import { fill, h, number, tall } from "./dom.js";

const BLUE_RED = [[33, 102, 172], [146, 197, 222], null, [244, 165, 130], [178, 24, 43]];
const CIVIDIS = [[0, 32, 77], [67, 78, 108], [124, 123, 120], [187, 175, 113], [255, 234, 70]];
const BOTTOM = 36, TOP = 6;

function ramp(colors, zero) {
  const stops = colors.map((color) => color || zero);
  const out = new Uint8ClampedArray(4 * 256);
  for (let i = 0; i < 256; i += 1) {
    const at = (i / 255) * (stops.length - 1), k = Math.min(Math.floor(at), stops.length - 2);
    for (let c = 0; c < 3; c += 1) out[4 * i + c] = stops[k][c] + (at - k) * (stops[k + 1][c] - stops[k][c]);
    out[4 * i + 3] = 255;
  }
  return out;
}

const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
function rgb(text) {
  const hex = text.length === 4 ? [...text.slice(1)].map((x) => x + x) : text.slice(1).match(/../g);
  return hex.map((x) => parseInt(x, 16));
}

export function limitOf(values) {
  const sizes = Float32Array.from(values).map(Math.abs).filter(Number.isFinite).sort();
  return sizes.length ? sizes[Math.min(sizes.length - 1, Math.floor(0.995 * sizes.length))] || 1 : 1;
}

// map: {columns, rows: [{label, values, edges}], x: {title, low, high, ticks}, unit, limit, say(row, column)}
export class Heat {
  constructor(label, { choose, hover, brush, height = 380 }) {
    this.canvas = h("canvas", { tabindex: "0", role: "application", "aria-label": label });
    this.tip = h("div", { class: "tip", "aria-live": "polite" });
    this.element = h("div", { class: "heat" }, this.canvas, this.tip);
    this.base = height; this.left = 90; this.choose = choose; this.hover = hover; this.brush = brush;
    this.at = { row: 0, column: 0 }; this.range = null; this.colors = "diverging";
    this.canvas.addEventListener("pointermove", (event) => this.moved(event));
    this.canvas.addEventListener("pointerdown", (event) => this.pressed(event));
    this.canvas.addEventListener("pointerup", (event) => this.released(event));
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.element);
  }

  get height() { return this.fixed || tall() * this.base; }

  show(map) {
    this.map = map;
    this.image = null;
    this.at.row = Math.min(this.at.row, Math.max(0, map.rows.length - 1));
    this.at.column = Math.min(this.at.column, map.columns - 1);
    this.draw();
  }

  // The map as columns of a table: the rows' names, then one for each place across, which is that far into its cell.
  columns(into) {
    const { rows, columns, x } = this.map;
    return [[`row; values in ${this.map.unit} over ${x.title}`, rows.map((row) => row.label)], ...Array.from({ length: columns }, (_, k) => [number(x.low + ((k + into) * (x.high - x.low)) / columns, 5), rows.map((row) => row.values[k])])];
  }

  paint() {
    const { rows, columns, limit } = this.map;
    const colors = this.colors === "cividis" ? ramp(CIVIDIS) : ramp(BLUE_RED, rgb(style("--zero")));
    const image = new ImageData(columns, rows.length);
    rows.forEach((row, r) => {
      const y = rows.length - 1 - r;
      for (let c = 0; c < columns; c += 1) {
        const value = row.values[c], to = 4 * (y * columns + c);
        if (!Number.isFinite(value)) continue;
        const k = Math.max(0, Math.min(255, Math.round(127.5 * (1 + value / limit))));
        image.data.set(colors.subarray(4 * k, 4 * k + 4), to);
      }
    });
    this.image = new OffscreenCanvas(columns, rows.length);
    this.image.getContext("2d").putImageData(image, 0, 0);
    this.ramp = colors;
  }

  draw() {
    const map = this.map;
    if (!map || !this.element.clientWidth) return;
    if (!this.image || this.theme !== document.documentElement.dataset.theme) { this.theme = document.documentElement.dataset.theme; this.paint(); }
    const ratio = devicePixelRatio || 1, width = this.element.clientWidth, height = this.height;
    this.canvas.width = width * ratio; this.canvas.height = height * ratio;
    this.canvas.style.height = `${height}px`;
    const g = this.canvas.getContext("2d");
    g.scale(ratio, ratio);
    g.font = `${width > 1400 ? 16 : 12}px system-ui, sans-serif`;
    const most = number(map.limit, 2);
    const RIGHT = this.right = Math.max(width > 1400 ? 82 : 62, 25 + g.measureText(`\u2212${most}`).width);
    const LEFT = this.left = 14 + Math.min(0.4 * width, Math.max(40, ...map.rows.map((row) => (row.tick ? g.measureText(row.tick).width : 0))));
    const w = width - LEFT - RIGHT, t = height - TOP - BOTTOM, n = map.rows.length;
    this.box = { w, t };
    g.imageSmoothingEnabled = false;
    g.fillStyle = style("--line");  // where there is no value
    g.fillRect(LEFT, TOP, w, t);
    g.drawImage(this.image, LEFT, TOP, w, t);
    g.fillStyle = g.strokeStyle = style("--quiet");
    const up = (row) => TOP + t - ((row + 0.5) * t) / n;
    g.textAlign = "right"; g.textBaseline = "middle";
    let last = Infinity;
    map.rows.forEach((row, r) => { if (row.tick && last - up(r) > 14) { g.fillText(row.tick, LEFT - 6, up(r)); last = up(r); } });
    g.textAlign = "center"; g.textBaseline = "top";
    const across = (x) => LEFT + (w * (x - map.x.low)) / (map.x.high - map.x.low);
    for (const tick of map.x.ticks) { g.fillText(number(tick), across(tick), TOP + t + 4); g.fillRect(across(tick), TOP + t, 1, 3); }
    g.fillText(map.x.title, LEFT + w / 2, TOP + t + 19);
    g.strokeStyle = style("--text"); g.lineWidth = 1;
    for (const side of [0, 1]) {
      g.beginPath();
      map.rows.forEach((row, r) => { if (row.edges) g.lineTo(across(row.edges[side]), up(r)); });
      g.stroke();
    }
    if (this.range) {
      const [a, b] = this.range.map(across);
      g.fillStyle = "rgba(128,128,128,.25)"; g.fillRect(a, TOP, b - a, t);
      g.strokeStyle = style("--accent"); g.strokeRect(a, TOP, b - a, t);
    }
    g.strokeStyle = style("--accent"); g.lineWidth = 2;
    if (n) g.strokeRect(LEFT, up(this.at.row) - t / n / 2, w, Math.max(t / n, 2));
    const bar = t / 256, right = width - RIGHT + 8;
    for (let i = 0; i < 256; i += 1) {
      g.fillStyle = `rgb(${this.ramp[4 * i]},${this.ramp[4 * i + 1]},${this.ramp[4 * i + 2]})`;
      g.fillRect(right, TOP + t - (i + 1) * bar, 10, bar + 1);
    }
    g.fillStyle = style("--quiet"); g.textAlign = "left";
    g.textBaseline = "top"; g.fillText(`+${most}`, right + 13, TOP);
    g.textBaseline = "bottom"; g.fillText(`\u2212${most}`, right + 13, TOP + t);
    g.textBaseline = "middle"; g.fillText("0", right + 13, TOP + t / 2);
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect(), { w, t } = this.box, map = this.map;
    const share = Math.max(0, Math.min(1, (event.clientX - box.left - this.left) / w));
    const row = Math.floor(map.rows.length * (1 - (event.clientY - box.top - TOP) / t));
    return { row: Math.max(0, Math.min(map.rows.length - 1, row)), column: Math.min(map.columns - 1, Math.floor(share * map.columns)), x: map.x.low + share * (map.x.high - map.x.low) };
  }

  say(at) { fill(this.tip, this.map.say(at.row, at.column)); }
  moved(event) {
    if (!this.box) return;
    const at = this.place(event);
    this.say(at);
    if (this.start !== undefined) { this.range = [Math.min(this.start.x, at.x), Math.max(this.start.x, at.x)]; this.draw(); } else if (this.hover) this.hover(at);
  }
  pressed(event) { this.start = this.place(event); this.canvas.setPointerCapture(event.pointerId); }
  released(event) {
    if (this.start === undefined) return;
    const at = this.place(event), far = Math.abs(at.x - this.start.x) > 0.01 * (this.map.x.high - this.map.x.low);
    this.start = undefined;
    if (far && this.brush) { this.brush(this.range); } else {
      this.range = null; this.at = at; if (this.brush) this.brush(null); this.choose(at);
    }
    this.draw();
  }
  key(event) {
    const step = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1], PageUp: [10, 0], PageDown: [-10, 0] }[event.key];
    if (!step || !this.map?.rows.length) return;
    event.preventDefault();
    this.at.row = Math.max(0, Math.min(this.map.rows.length - 1, this.at.row + step[0]));
    const from = this.at.column;
    this.at.column = Math.max(0, Math.min(this.map.columns - 1, from + step[1]));
    this.say(this.at);
    if (event.shiftKey && step[1] && this.brush) {
      if (!this.range) this.from = from;
      const edge = (column) => this.map.x.low + (column * (this.map.x.high - this.map.x.low)) / this.map.columns;
      this.range = [edge(Math.min(this.from, this.at.column)), edge(Math.max(this.from, this.at.column) + 1)];
      this.brush(this.range);
    } else this.choose(this.at);
    this.draw();
  }
}
