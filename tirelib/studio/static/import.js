// Foreign files: the columns that were found and the draft of a map, as a form.
import { app, get, listen, wish } from "./data.js";
import { dialog, h, number, toast } from "./dom.js";

const QUANTITIES = ["", "time", "Fz", "Fy", "Fx", "Mz", "Mx", "My", "slip_angle", "camber", "slip_ratio", "pressure", "speed", "omega", "loaded_radius", "effective_radius", "tread_temperature", "tread_inner_temperature", "tread_outer_temperature", "ambient_temperature", "road_temperature", "trigger", "strain_1", "strain_2", "strain_3", "strain_4", "strain_5"];

export async function importForm(files) {
  dialog("Import", h("p", { role: "status" }, "The columns of the files are being read."));
  const form = await new Promise((done) => {
    const look = async () => {
      const found = await get("/import-form", { files }).catch((error) => ({ message: error.message }));
      if (found.message || (found.columns && found.map)) { stop(); done(found); }
    };
    const stop = listen((what) => { if (what === "state") look(); });
    look();
  });
  if (form.message && !form.columns) { dialog("Import", h("p", { class: "bad" }, form.message)); return; }
  const { map, columns } = form, taken = new Map(Object.entries(map.channels || {}).map(([q, c]) => [c.column, [q, c]]));
  const field = (value, attributes = {}) => h("input", { value: value ?? "", size: 12, ...attributes });
  const name = field(map.name, { size: 30, "aria-label": "name" }), radius = field(map.tire?.free_radius_m ? 1000 * map.tire.free_radius_m : "", { "aria-label": "free radius in mm", inputmode: "decimal" });
  const axes = h("select", { "aria-label": "axes" }, [["", "choose"], ["sae", "SAE J670: Fz negative under load"], ["iso", "ISO 8855: Fz positive, positive slip angle gives negative Fy"], ["adapted_sae", "adapted SAE: positive slip angle gives positive Fy"]].map(([k, t]) => h("option", { value: k }, t)));
  axes.value = map.axes || "";
  const kind = h("select", { "aria-label": "kind" }, [["sweep", "one sweep: conditions change all the time"], ["corner", "steady cornering runs, one a file"], ["free", "steady straight runs, one a file"], ["combined", "steady combined slip, one a file"]].map(([k, t]) => h("option", { value: k }, t)));
  kind.value = map.kind || "sweep";
  const rows = columns.files[0].columns.map((column) => {
    const [quantity, channel] = taken.get(column.name) || ["", {}];
    const select = h("select", { "aria-label": `quantity of ${column.name}` }, [...new Set([...QUANTITIES, quantity])].map((q) => h("option", { value: q }, q || "leave out")));
    select.value = quantity;
    const unit = field(channel.unit ?? column.unit, { size: 7, "aria-label": `unit of ${column.name}` });
    return { column: column.name, select, unit, element: h("tr", {}, h("td", {}, column.name), h("td", { class: "n" }, `${number(column.min)} … ${number(column.max)}`), h("td", { class: "n" }, column.missing || ""), h("td", {}, select), h("td", {}, unit)) };
  });
  const said = h("p", { class: "bad", role: "alert" });
  const go = async () => {
    said.textContent = "";
    const faults = [];
    if (!axes.value) faults.push("Choose the axis system of the files.");
    if (!(Number(radius.value) > 100)) faults.push("Give the free radius of the tire in mm, for instance 316.");
    const channels = {};
    for (const row of rows.filter((r) => r.select.value)) {
      if (channels[row.select.value]) faults.push(`Two columns are ${row.select.value}; leave one out.`);
      channels[row.select.value] = { column: row.column, unit: row.unit.value.trim() };
    }
    if (!Object.keys(channels).length) faults.push("Choose at least one column.");
    if (faults.length) { said.textContent = faults.join(" "); return; }
    const gages = rows.some((r) => r.select.value.startsWith("strain_")) && map.gages ? { gages: map.gages } : {};
    const drawn = { format: "tirelib-map/1", axes: axes.value, name: name.value || "imported", kind: kind.value, ...(map.csv ? { csv: map.csv } : {}), tire: { ...(map.tire || {}), free_radius_m: Number(radius.value) / 1000 }, ...gages, channels };
    const done = await wish({ do: "import", files, map: drawn });
    if (!done) return;
    app.follow = done.job;
    said.className = "";
    said.textContent = "The files are being imported.";
    const stop = listen((what) => {
      if (what !== "state") return;
      const job = app.home.jobs.find((one) => one.job === done.job);
      if (job?.state === "failed") { stop(); said.className = "bad"; said.textContent = job.message; }
      if (job?.state === "done") { stop(); document.getElementById("dialog").close(); toast("The campaign was made."); }
    });
  };
  dialog(`Import ${(form.names || []).join(", ")}`,
    h("p", {}, "The names were recognised where they are usual ones. Check the axis system, the units, and give the free radius of the tire; leave out what does not belong to the measurement, and columns whose range is impossible (a turn rate or a rolling radius of a broken encoder)."),
    h("div", { class: "row" }, h("label", {}, "Axes of the files ", axes), h("label", {}, "Kind ", kind)),
    h("div", { class: "row" }, h("label", {}, "Name ", name), h("label", {}, "Free radius ", radius, " mm")),
    h("div", { class: "scroll" }, h("table", {}, h("thead", {}, h("tr", {}, ["column", "range", "missing", "quantity", "unit in the file"].map((t, i) => h("th", { class: i === 1 || i === 2 ? "n" : "" }, t)))), h("tbody", {}, rows.map((r) => r.element)))),
    said, h("button", { class: "main", type: "button", onclick: go }, "Import"));
}
