// Foreign files: the columns that were found and the draft of a map, as a form. Each part is headed as the map calls it, for the messages of the import name these.
import { app, get, listen, wish } from "./data.js";
import { dialog, h, number, toast } from "./dom.js";

const QUANTITIES = ["", "time", "Fz", "Fy", "Fx", "Mz", "Mx", "My", "slip_angle", "camber", "slip_ratio", "pressure", "speed", "omega", "loaded_radius", "effective_radius", "tread_temperature", "tread_inner_temperature", "tread_outer_temperature", "ambient_temperature", "road_temperature", "trigger", "strain_1", "strain_2", "strain_3", "strain_4", "strain_5"];
const AXES = [["", "choose"], ["sae", "SAE J670: Fz negative under load"], ["iso", "ISO 8855: Fz positive, positive slip angle gives negative Fy"], ["adapted_sae", "adapted SAE: positive slip angle gives positive Fy"]];
const KINDS = [["sweep", "one sweep: conditions change all the time"], ["corner", "steady cornering runs"], ["camber", "steady camber runs"], ["free", "steady straight runs"], ["brake", "steady braking runs"], ["drive", "steady driving runs"], ["combined", "steady combined slip"]];
// Set points of steady runs: key of the map, quantity, unit, step to which a mean is rounded, number where nothing was measured.
const POINTS = [["load_N", "Fz", "N", 100, ""], ["pressure_bar", "pressure", "bar", 0.1, ""], ["speed_kmh", "speed", "km/h", 1, ""], ["slip_angle_deg", "slip_angle", "deg", 0.5, 0], ["camber_deg", "camber", "deg", 0.5, 0], ["slip_ratio", "slip_ratio", "1", 0.01, 0]];
const DEFECTS = [["text", "text in a column of numbers", [["missing", "is a missing number"]]], ["missing", "rows with a missing number", [["drop", "leave out"], ["interpolate", "interpolate in time"]]], ["repeated_time", "rows with the same time", [["drop", "keep the first"]]], ["backward_time", "time that goes back", [["drop", "leave out"], ["join", "join the segments"]]]];
const SEPARATORS = [["", "found by itself"], [";", "semicolon"], [",", "comma"], ["\t", "tab"], ["|", "bar"], [" ", "blanks"]];
const DECIMALS = [["", "found by itself"], [",", "comma: 1,5"], [".", "point: 1.5"]];

// Lengths of the tire that a model of its strain needs: key of the map, and what it is.
const LENGTHS = [["ring_radius_m", "ring radius: axle to the belt's neutral line"], ["tread_thickness_m", "tread thickness"], ["belt_width_m", "belt width"], ["innerliner_offset_m", "innerliner with the gages, from the belt's neutral line, inwards negative"]];

const field = (value, label, size = 8) => h("input", { value: value ?? "", size, "aria-label": label });
const select = (options, value, label, change = () => {}) => { const made = h("select", { "aria-label": label, onchange: () => change(made.value) }, options.map(([k, t]) => h("option", { value: k }, t))); made.value = value ?? ""; return made; };
const amount = (text) => (String(text).trim() ? Number(String(text).trim().replace(",", ".")) : NaN);
const part = (title, key, ...content) => h("section", {}, h("h3", {}, title, " ", h("code", { class: "quiet" }, key)), ...content);

// A message of the import without the paths of the session, which the page does not show.
export const bare = (message) => message.replaceAll(/\S*\/(files\/\d+|jobs\/\d+\/out)\//g, "");
const plain = (message, map, channels) => bare(message.replaceAll(/\bchannel (\w+)/g, (all, q) => (channels[q] ? `${all} (column ${channels[q].column})` : all)).replace(/drop these rows or fill them with missing = "drop" or "interpolate" in the map, or map another column/g, "choose what is to be done at \u201crows with a missing number\u201d, or leave the column out").replaceAll(map, "this form").replaceAll("map and file state no unit", "form and file state no unit").replaceAll(", see `tirelib import FILE --list`", "")).replace(/^campaign: not written.*/, "The campaign was not made, because its check would find errors. Correct what follows, or leave the column or the file out.");

// What the campaign check would say of a size in a unit; ends: its ranges by unit, in multiples of a scale.
function unlikely(ends, unit, size, scale = 1) {
  const [low, high] = (ends?.[unit] || []).map((end) => end * scale), told = (x) => `${Number(x.toPrecision(3))}${unit === "1" ? "" : ` ${unit}`}`;
  return size < low || size > high ? `${told(size)}; plausible is ${told(low)} to ${told(high)}. Is the unit right?` : "";
}

// Wait for what the server finds out about the files: columns and a draft of the map, or why not.
function found(files) {
  dialog("Import", h("p", { role: "status" }, "The columns of the files are being read."));
  return new Promise((done) => {
    const look = async () => {
      const form = await get("/import-form", { files }).catch((error) => ({ message: error.message }));
      if (form.message || (form.columns && form.map)) { stop(); done(form); }
    };
    const stop = listen((what) => { if (what === "state") look(); });
    look();
  });
}

// How text tables are read: what is stated here is read again at once, with all that follows from it.
function layout(files, before, again) {
  const csv = before.csv || {}, names = field(csv.names_line, "names_line", 3), units = field(csv.units_line, "units_line", 3);
  const separator = select(SEPARATORS, csv.separator, "separator"), decimal = select(DECIMALS, csv.decimal, "decimal");
  const chosen = Object.fromEntries(DEFECTS.map(([key, text, options]) => [key, select([["", "refuse"], ...options], before[key], text)]));
  const lines = () => ({ ...(amount(names.value) > 0 ? { names_line: amount(names.value) } : {}), ...(amount(units.value) > 0 ? { units_line: amount(units.value) } : {}) });
  const drawn = () => {
    const stated = { ...(separator.value ? { separator: separator.value } : {}), ...(decimal.value ? { decimal: decimal.value } : {}), ...lines() };
    return { ...Object.fromEntries(DEFECTS.map(([key]) => [key, chosen[key].value]).filter(([, v]) => v)), ...(Object.keys(stated).length ? { csv: stated } : {}) };
  };
  const element = h("div", {}, part("How a text table is read", "[csv]", h("div", { class: "row" },
    h("label", {}, "separator ", separator), h("label", {}, "decimal ", decimal), h("label", {}, "names_line ", names), h("label", {}, "units_line ", units))),
  part("Defects of the recording", "", h("div", { class: "row" }, DEFECTS.map(([key, text]) => h("label", {}, h("code", { class: "quiet" }, key), ` ${text} `, chosen[key])))),
  h("button", { type: "button", id: "read-again", onclick: async () => { if (await wish({ do: "read-again", files, map: drawn() })) again(drawn()); } }, "Read the files again"));
  return { element, drawn };
}

// Set points of runs that are no sweep: the mean of the measurement, a number, or a column.
function points(measured, columns, plausible) {
  const rows = POINTS.map(([key, quantity, unit, step, fallback]) => {
    const value = field("", `${key} value`, 6), column = select([["", "choose a column"], ...columns.map((c) => [c.name, c.name])], "", `${key} column`), columnUnit = field(unit, `${key} unit`, 5);
    const how = select([["mean_to", `mean of ${quantity}, rounded to`], ["value", "the same in all runs"], ["column", "a column, constant in a run"]], "", `${key} from`, () => show());
    const show = () => { column.hidden = columnUnit.hidden = how.value !== "column"; value.hidden = how.value === "column"; value.value = how.value === "mean_to" ? step : fallback; };
    return { key, quantity, unit, how, value, column, columnUnit, show, element: h("tr", {}, h("td", {}, key), h("td", {}, how), h("td", {}, value, column, columnUnit)) };
  });
  return {
    element: h("table", {}, h("tbody", {}, rows.map((r) => r.element))),
    update: () => rows.filter((r) => !r.how.dataset.given).forEach((r) => { const how = measured().has(r.quantity) ? "mean_to" : "value"; if (r.how.value !== how) { r.how.value = how; r.show(); } }),
    drawn: (faults) => Object.fromEntries(rows.map((r) => {
      const x = amount(r.value.value);
      if (r.how.value === "column") { if (!r.column.value) faults.push(`[set_points] ${r.key}: choose a column.`); return [r.key, { column: r.column.value, unit: r.columnUnit.value.trim() }]; }
      if (!Number.isFinite(x)) faults.push(`[set_points] ${r.key}: give a number, or map the column of ${r.quantity}.`);
      const fault = r.how.value === "value" && unlikely(plausible[r.quantity], r.unit, Math.abs(x));
      if (fault) faults.push(`[set_points] ${r.key}: ${fault}`);
      return [r.key, r.how.value === "mean_to" ? { mean_to: x } : x];
    })),
  };
}

// A column of the file: its quantity, and a unit that may differ from what the file states.
function columnRow(column, taken, { plausible, units }, radius, change) {
  const [quantity, channel] = taken.get(column.name) || ["", {}];
  const chosen = select([...new Set([...QUANTITIES, quantity])].map((q) => [q, q || "leave out"]), quantity, `quantity of ${column.name}`, () => change());
  const unit = field(channel.unit || column.unit, `unit of ${column.name}`, 7), factor = field(1, `factor of ${column.name}`, 4);
  const wrong = () => Boolean(column.unit) && unit.value.trim() !== column.unit;
  const said = h("div", { class: "small warn" });
  const fault = () => {
    const strain = chosen.value.startsWith("strain_"), found = unlikely(plausible[strain ? "strain" : chosen.value], unit.value.trim(), Math.abs(amount(factor.value)) * (strain ? column.max - column.min : column.middle), chosen.value === "loaded_radius" ? radius() : 1);
    return found && `${strain ? "it spans" : "its middle is"} ${chosen.value === "loaded_radius" ? found.replace(". Is the unit right?", ` at a free radius of ${number(1000 * radius(), 4)} mm.`) : found}`;
  };
  const allowed = () => units[chosen.value.startsWith("strain_") ? "strain" : chosen.value.endsWith("_temperature") ? "temperature" : chosen.value] || [unit.value.trim()];
  // The largest loaded radius in metres, for no tire is larger under load than without.
  const most = () => (chosen.value === "loaded_radius" && plausible.loaded_radius[unit.value.trim()] ? (amount(factor.value) * column.max * plausible.loaded_radius.m[0]) / plausible.loaded_radius[unit.value.trim()][0] : 0);
  const show = () => { said.textContent = [allowed().includes(unit.value.trim()) ? "" : `a unit is needed: ${allowed().join(", ")}`, wrong() ? `instead of ${column.unit} in the file` : "", fault()].filter(Boolean).join("; "); };
  for (const one of [unit, factor]) one.addEventListener("input", show);
  const rule = () => ({ column: column.name, unit: unit.value.trim(), ...(wrong() ? { override_unit: true } : {}), ...(amount(factor.value) !== 1 ? { factor: amount(factor.value) } : {}) });
  return { column: column.name, chosen, rule, fault, most, show, element: h("tr", {}, h("td", {}, column.name), h("td", { class: "n" }, `${number(column.min)} … ${number(column.max)}`), h("td", { class: "n" }, column.missing || ""), h("td", {}, chosen), h("td", {}, unit, said), h("td", {}, factor)) };
}

// What the user has given stays when the files are read again: fields by their labels.
document.addEventListener("change", (event) => { event.target.dataset.given = "1"; });
const fields = () => [...document.querySelectorAll("#dialog [aria-label]")];
const content = (one) => (one.type === "checkbox" ? "checked" : "value");
const given = () => new Map(fields().filter((one) => one.dataset.given).map((one) => [one.getAttribute("aria-label"), one[content(one)]]));
function restore(before) {
  for (const one of fields()) {
    const value = before.get(one.getAttribute("aria-label"));
    if (value === undefined || (one.options && ![...one.options].some((o) => o.value === value))) continue;
    one[content(one)] = value;
    one.dataset.given = "1";
    for (const kind of ["input", "change"]) one.dispatchEvent(new Event(kind));
  }
}

// Faults that are decided on under "How the files are read".
const DECIDED = /\b(missing|text|backward_time) = "/;

export async function importForm(files, read = {}, before = new Map()) {
  const form = await found(files), again = (stated) => importForm(files, stated, given()), how = layout(files, read, again);
  if (!form.columns) {
    const said = h("p", { class: "bad said" }, bare(form.message));
    dialog("Import", form.count > 1 ? [h("p", {}, `None of the ${form.count} files that might be measurements can be read as one. Is this the right folder? A campaign is a folder with campaign.toml, runs.csv and the recorded runs.`), h("details", {}, h("summary", {}, "Why each file was refused, and how it could be read"), said, how.element)]
      : [said, h("p", {}, "State below how the file is to be read, or export it again."), how.element]);
    return;
  }
  const { map, columns, plausible } = form, file = columns.files[0], taken = new Map(Object.entries(map?.channels || {}).map(([q, c]) => [c.column, [q, c]]));
  const name = field(map?.name, "name", 30), radius = field(map?.tire?.free_radius_m ? 1000 * map.tire.free_radius_m : "", "free radius in mm", 6), lateral = field("", "positions of the gages in mm", 26);
  const lengths = LENGTHS.map(([key, text]) => ({ key, input: field(map?.tire?.[key] ? 1000 * map.tire[key] : "", `${key} in mm`), text }));
  const tire = part("Lengths of the tire", `[tire] ${LENGTHS.map(([key]) => key).join(", ")}`, h("p", { class: "small quiet" }, "A model of the strain is fitted with these lengths; a drawing of the tire or a cut through it shows them. Without them the measurement is imported and shown, but no model is fitted to its strain."), h("table", {}, h("tbody", {}, lengths.map((one) => h("tr", {}, h("td", {}, one.text), h("td", {}, h("label", {}, one.input, " mm")))))));
  const axes = select(AXES, map?.axes, "axes"), runColumn = select([["", "each file is a run"], ...file.columns.map((c) => [c.name, c.name])], map?.run_column, "run_column");
  const rows = file.columns.map((column) => columnRow(column, taken, form, () => amount(radius.value) / 1000, () => update()));
  radius.addEventListener("input", () => update());
  const measured = () => new Set(rows.map((r) => r.chosen.value).filter(Boolean)), gages = () => [...measured()].filter((q) => q.startsWith("strain_"));
  const set = points(measured, file.columns, plausible), steady = part("Set points of the runs", "[set_points]", h("p", { class: "small quiet" }, "Runs of the same set points are repeats; the noise is known from them. Round the means so far that repeats agree."), set.element);
  const kind = select(KINDS, map?.kind || "sweep", "kind", () => update()), strain = part("Gages", "[gages] lateral_m", h("label", {}, "Positions across the tire, from strain_1 on, with blanks between ", lateral, " mm"));
  const update = () => { steady.hidden = kind.value === "sweep"; strain.hidden = tire.hidden = !gages().length; set.update(); rows.forEach((row) => row.show()); };
  let reading;
  const said = h("p", { class: "bad said", role: "alert" }), sent = h("details", { hidden: true }, h("summary", {}, "The map that was sent"), h("pre", {}));
  const drawn = (faults) => {
    const channels = {};
    for (const row of rows.filter((r) => r.chosen.value)) {
      if (channels[row.chosen.value]) faults.push(`Two columns are ${row.chosen.value}; leave one out.`);
      channels[row.chosen.value] = row.rule();
      if (row.fault() && row.chosen.value === "loaded_radius") faults.push(`[tire] free_radius_m: column ${row.column} is a loaded radius; ${row.fault()} Correct the free radius (half of the diameter), or the unit of the column.`);
      else if (row.most() > amount(radius.value) / 1000) faults.push(`[tire] free_radius_m: column ${row.column} is a loaded radius of up to ${number(1000 * row.most(), 4)} mm, which the free radius cannot be below. Correct the free radius (half of the diameter), or the unit of the column.`);
      else if (row.fault()) faults.push(`[channels] ${row.chosen.value} (column ${row.column}): ${row.fault()} Mend the unit, or leave the column out.`);
    }
    if (!axes.value) faults.push("Choose the axis system of the files.");
    if (!(amount(radius.value) > 100)) faults.push("Give the free radius of the tire in mm: half of its diameter without load.");
    if (!channels.Fz) faults.push("[channels] Fz: the vertical force is needed, for every model is fitted over load. Choose its column as Fz.");
    for (const one of gages().length ? lengths : []) if (one.input.value.trim() && !Number.isFinite(amount(one.input.value))) faults.push(`[tire] ${one.key}: give a number in mm, or leave it empty.`);
    const places = lateral.value.trim().split(/[\s;]+/).filter(Boolean).map(amount);
    if (gages().length && (places.length !== gages().length || !places.every(Number.isFinite))) faults.push(`[gages] lateral_m: give ${gages().length} positions in mm.`);
    return { format: "tirelib-map/1", axes: axes.value, name: name.value || "imported", kind: kind.value, ...(runColumn.value ? { run_column: runColumn.value } : {}), ...how.drawn(), tire: { ...(map?.tire || {}), free_radius_m: amount(radius.value) / 1000, ...Object.fromEntries(lengths.filter((one) => gages().length && one.input.value.trim()).map((one) => [one.key, amount(one.input.value) / 1000])) },
      ...(gages().length ? { gages: { lateral_m: places.map((x) => x / 1000) } } : {}), ...(kind.value === "sweep" ? {} : { set_points: set.drawn(faults) }), channels };
  };
  const go = async () => {
    const faults = [], made = drawn(faults);
    said.className = "bad said";
    said.textContent = faults.join("\n");
    const done = faults.length ? null : await wish({ do: "import", files, map: made, without: kept.filter(([, box]) => !box.checked).map(([path]) => path) });
    if (!done) return;
    app.follow = done.job;
    said.className = "said";
    said.textContent = "The files are being imported.";
    sent.hidden = false; sent.lastChild.textContent = done.text;
    const stop = listen((what) => {
      if (what !== "state") return;
      const job = app.home.jobs.find((one) => one.job === done.job);
      if (job?.state === "failed") { stop(); said.className = "bad said"; said.textContent = plain(job.message, done.map, made.channels); reading.open ||= DECIDED.test(job.message); }
      if (job?.state === "done") { stop(); document.getElementById("dialog").close(); toast("The campaign was made."); }
    });
  };
  const { names } = form, kept = columns.files.map(({ file: path }, i) => [path, h("input", { type: "checkbox", checked: true, "aria-label": `import ${names[i]}` })]);
  dialog(`Import ${names.length > 3 ? `${names.length} files, ${names[0]} to ${names.at(-1)}` : names.join(", ")}`,
    h("p", {}, "Usual names of columns are recognised; choose the quantity of any other column that belongs to the measurement. The vertical force Fz is needed. Then: choose the axis system and the kind of runs, give the free radius of the tire, and check the units. Leave out what does not belong to the measurement, and columns whose range is impossible (a turn rate or a rolling radius of a broken encoder)."),
    form.message ? h("p", { class: "bad said" }, bare(form.message)) : null,
    columns.unreadable.length ? h("div", { class: "bad", id: "unreadable" }, `${columns.unreadable.length} of ${columns.unreadable.length + columns.files.length} files cannot be read and will be left out; mend them and send the folder again, or go on without them:`, h("ul", {}, columns.unreadable.map((one) => h("li", {}, bare(one.reason))))) : null,
    kept.length > 1 ? h("details", { id: "files" }, h("summary", {}, "Files: untick what is no run"), h("div", { class: "row small" }, kept.map(([, box], i) => h("label", {}, box, ` ${names[i]}`)))) : null,
    part("Campaign", "name, axes, [tire] free_radius_m", h("div", { class: "row" }, h("label", {}, "Name ", name), h("label", {}, "Axes of the files ", axes), h("label", {}, "Free radius ", radius, " mm")), h("p", { class: "small quiet" }, "The free radius is half of the diameter that the inflated tire has without load. By its size a 205/55 R16 has 16 × 25.4 / 2 + 0.55 × 205 = 316 mm, a 16 × 7.5-10 has 16 × 25.4 / 2 = 203 mm. A loaded radius is up to a tenth less.")),
    part("Runs", "kind, run_column", h("div", { class: "row" }, h("label", {}, "Kind ", kind), h("label", {}, "A run is ", runColumn))), steady,
    part("Columns", "[channels]", h("div", { class: "scroll" }, h("table", {}, h("thead", {}, h("tr", {}, ["column", "range", "missing", "quantity", "unit", "factor"].map((t, i) => h("th", { class: i === 1 || i === 2 ? "n" : "" }, t)))), h("tbody", {}, rows.map((r) => r.element)))),
      Object.entries(file.left_out || {}).map(([column, why]) => h("p", { class: "small warn" }, `Left out: ${column}: ${why}`))), strain, tire,
    reading = h("details", { open: Boolean(Object.keys(read).length) || Object.values(file.left_out || {}).some((why) => why.includes("text =")) }, h("summary", {}, "How the files are read"), (file.notes || []).map((note) => h("p", { class: "small quiet" }, note)), how.element),
    sent, h("div", { class: "foot" }, said, h("button", { class: "main", type: "button", id: "import", onclick: go }, "Import")));
  restore(before);
  update();
}
