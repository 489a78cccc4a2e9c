// The contact from above, as far as five lengths tell: travel is up, left is left.
const SVG = "http://www.w3.org/2000/svg";

function add(svg, kind, attributes, text) {
  const node = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== undefined) node.textContent = text;
  svg.append(node);
}

export function drawShape(svg, lateral, lengths, valid) {
  const known = lengths.map((length) => Number.isFinite(length));
  const width = 240, height = 200, middle = 84;
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.replaceChildren();
  if (!known.some(Boolean)) {
    add(svg, "text", { x: width / 2, y: middle, class: "note" }, "no contact lengths");
    return;
  }
  const reach = Math.max(...lateral.map(Math.abs), 1);
  const longest = Math.max(120, ...lengths.filter(Number.isFinite));
  const scale = Math.min(150 / longest, 96 / reach);
  const spread = scale;
  const x = (y) => width / 2 - spread * y;
  const order = lateral.map((_, i) => i).filter((i) => known[i])
    .sort((a, b) => lateral[b] - lateral[a]);
  const half = (i) => 0.5 * scale * lengths[i];
  const front = order.map((i) => `${x(lateral[i])},${middle - half(i)}`);
  const back = order.map((i) => `${x(lateral[i])},${middle + half(i)}`).reverse();
  add(svg, "line", { x1: 6, x2: width - 6, y1: middle, y2: middle, class: "axis" });
  add(svg, "polygon", {
    points: [...front, ...back].join(" "), class: valid ? "outline" : "outline old",
  });
  lateral.forEach((y, i) => {
    if (known[i]) {
      add(svg, "line", { x1: x(y), x2: x(y), y1: middle - half(i), y2: middle + half(i), class: "gage" });
    }
    add(svg, "text", { x: x(y), y: 178, "data-gage": i + 1 },
      known[i] ? lengths[i].toFixed(0) : "-");
    add(svg, "text", { x: x(y), y: 196, class: "note" }, `${y > 0 ? "+" : ""}${y.toFixed(0)}`);
  });
}
