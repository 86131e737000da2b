(() => {
  "use strict";
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const floats = (text) => new Float32Array(bytes(text));
  const whole = (text) => new Uint32Array(bytes(text));
  document.documentElement.classList.add("js");

  // Colours of the SVG figures, from low to high values; the lightness decreases uniformly.
  const STOPS = [[255, 255, 217], [217, 240, 163], [127, 205, 187], [65, 182, 196], [29, 145, 192], [37, 82, 160], [8, 29, 88]];
  const ZONES = [[245, 245, 245], [0, 114, 178], [240, 180, 90]];
  const ZONE_WORDS = ["open", "stick", "slip"];
  const colour = (share) => {
    const at = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1), below = Math.min(Math.floor(at), STOPS.length - 2);
    return [0, 1, 2].map((k) => Math.round(STOPS[below][k] + (at - below) * (STOPS[below + 1][k] - STOPS[below][k])));
  };
  const css = (rgb) => `rgb(${rgb[0]},${rgb[1]},${rgb[2]})`;
  const short = (x) => {
    if (x === 0) return "0";
    const digits = Math.floor(Math.log10(Math.abs(x)));
    return (digits < -4 || digits > 6 ? x.toExponential(4) : x.toFixed(Math.max(0, 4 - digits))).replace("-", "\u2212");
  };
  const units = data.units || {};
  // Slip is a length. In rolling, slip is given per rolled distance and has no unit.
  const rolls = (frame) => Boolean(data.rolling[data.frames[frame].entry]);
  const rolling = (data.frames || []).map((_, i) => rolls(i));
  const slipWords = !rolling.includes(true) ? "Slip in the increment" : rolling.includes(false) ? "Slip (of rolling per distance)" : "Slip per rolled distance";
  const unitOf = (field, frame) => (field.key.startsWith("slip") && rolls(frame) ? "" : field.unit);

  // Quantities that the maps show, one value per cell.
  const length2 = (a, b) => (i) => Math.hypot(a ? a[i] : 0, b ? b[i] : 0);
  const plain = (name) => (f) => (i) => (f[name] ? f[name][i] : 0);
  const FIELDS = [
    { key: "pressure", words: "Pressure", unit: units.stress, of: plain("pressure") },
    { key: "tangential", words: "Tangential traction", unit: units.stress, of: (f) => length2(f.traction_x, f.traction_y) },
    { key: "slip", words: slipWords, unit: units.length, of: (f) => length2(f.slip_x, f.slip_y) },
    { key: "wear", words: "Wear depth, both bodies", unit: units.length, of: plain("wear") },
    { key: "wear1", words: "Wear depth, body 1", unit: units.length, of: plain("wear1") },
    { key: "wear2", words: "Wear depth, body 2", unit: units.length, of: plain("wear2") },
    { key: "wear_error", words: "Estimated error of the wear depth", unit: units.length, of: plain("wear_error") },
    { key: "gap", words: "Gap", unit: units.length, of: plain("gap") },
    { key: "status", words: "Stick, slip, open", unit: "", of: plain("status") },
  ];
  const PARTS = [
    ["traction_x", "Tangential traction on body 2, x", units.stress], ["traction_y", "Tangential traction on body 2, y", units.stress],
    ["slip_x", "Slip of body 2, x", units.length], ["slip_y", "Slip of body 2, y", units.length],
  ];
  const decoded = new Map();
  const fieldsOf = (frame) => {
    if (!decoded.has(frame)) decoded.set(frame, Object.fromEntries(Object.entries(data.frames[frame].fields).map(([k, v]) => [k, floats(v)])));
    return decoded.get(frame);
  };
  const meshes = (data.meshes || []).map((m) => ({
    plane: floats(m.plane), points: floats(m.points), offsets: whole(m.offsets), connectivity: whole(m.connectivity), curved: m.curved, upright: m.upright,
  }));
  const known = new Map();
  const valuesOf = (frame, field) => {
    const name = `${frame} ${field.key}`;
    if (!known.has(name)) known.set(name, computed(frame, field));
    return known.get(name);
  };
  const computed = (frame, field) => {
    const f = fieldsOf(frame), of = field.of(f);
    // The displacement of a cell without contact is not slip.
    const mask = field.key === "slip" && f.status ? (i) => f.status[i] > 0 : () => true;
    return Float32Array.from({ length: data.frames[frame].n }, (_, i) => (mask(i) ? of(i) : 0));
  };
  const peaks = new WeakMap();
  const largest = (values) => {
    if (!peaks.has(values)) { let most = 0; for (const v of values) if (v > most) most = v; peaks.set(values, most); }
    return peaks.get(values);
  };
  // Largest value of a field over all frames in which the field has the same unit as in `frame`.
  const largestOfAll = (field, frame) => Math.max(0, ...data.frames.map((_, i) => (unitOf(field, i) === unitOf(field, frame) ? largest(valuesOf(i, field)) : 0)));
  const inMenu = (field) => (field.unit && !(field.key === "slip" && rolling.includes(true)) ? `${field.words}, ${field.unit}` : field.words);
  const label = (item) => (item.entry === null ? `field file ${item.file}` : data.entries[item.entry]);
  const fill = (select, options) => {
    select.replaceChildren(...options.map(([value, text]) => new Option(text, value)));
  };
  const cellOf = (mesh, cell) => mesh.connectivity.subarray(cell ? mesh.offsets[cell - 1] : 0, mesh.offsets[cell]);
  const shownFields = FIELDS.filter((field) => field.key === "pressure" || (data.frames || []).some((_, i) => largest(valuesOf(i, field)) > 0))
    .filter((field) => !["wear1", "wear2"].includes(field.key) || (data.frames || []).every((frame) => !frame.fields.wear || (frame.fields.wear1 && frame.fields.wear2)));

  function colourBar(context, [x, y, w, h], most, unit, zones) {
    context.font = "22px Helvetica, Arial, sans-serif";
    context.textAlign = "left";
    if (zones) {
      ZONE_WORDS.forEach((word, i) => {
        context.fillStyle = css(ZONES[i]); context.fillRect(x, y + 44 * i, w, 30); context.strokeStyle = "#667"; context.strokeRect(x, y + 44 * i, w, 30);
        context.fillStyle = "#1d2430"; context.fillText(word, x + w + 10, y + 23 + 44 * i);
      });
      return;
    }
    for (let i = 0; i < h; i++) { context.fillStyle = css(colour(1 - (i + 0.5) / h)); context.fillRect(x, y + i, w, 1.5); }
    context.strokeStyle = "#667"; context.lineWidth = 1; context.strokeRect(x, y, w, h);
    context.fillStyle = "#1d2430"; context.fillText(unit, x, y - 16);
    const power = most > 0 ? Math.floor(Math.log10(most)) : 0, shift = power < -2 || power > 4 ? power : 0;
    for (let i = 0; i <= 4; i++) {
      const value = (most * i) / 4 / 10 ** shift;
      context.fillText(value === 0 ? "0" : String(Number(value.toPrecision(3))), x + w + 8, y + h - (h * i) / 4 + 8);
    }
    if (shift) context.fillText(`× 10${[...String(shift)].map((c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]).join("")}`, x, y + h + 32);
  }

  // Maps.
  const map = $("map-canvas") && (() => {
    const canvas = $("map-canvas"), context = canvas.getContext("2d"), AREA = [110, 40, 900, 900];
    const still = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    let frame = data.frames.length - 1, field = shownFields[0], shape, values, cursor = -1;
    fill($("map-entry"), data.frames.map((item, i) => [i, label(item)]));
    fill($("map-field"), shownFields.map((f) => [f.key, inMenu(f)]));
    $("map-entry").value = String(frame);

    function layout(mesh) {
      let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
      for (let i = 0; i < mesh.plane.length; i += 2) {
        x0 = Math.min(x0, mesh.plane[i]); x1 = Math.max(x1, mesh.plane[i]); y0 = Math.min(y0, mesh.plane[i + 1]); y1 = Math.max(y1, mesh.plane[i + 1]);
      }
      const half = 0.5 * Math.max(x1 - x0, y1 - y0, 1e-300), scale = AREA[2] / (2 * half);
      const [cx, cy] = [0.5 * (x0 + x1), 0.5 * (y0 + y1)];
      const to = (x, y) => [AREA[0] + AREA[2] / 2 + (x - cx) * scale, AREA[1] + AREA[3] / 2 - (y - cy) * scale];
      const from = (px, py) => [cx + (px - AREA[0] - AREA[2] / 2) / scale, cy - (py - AREA[1] - AREA[3] / 2) / scale];
      // Cells sorted into squares of the plane, to find the cell under the pointer.
      const n = Math.max(1, Math.min(128, Math.ceil(Math.sqrt(mesh.offsets.length)))), bins = Array.from({ length: n * n }, () => []);
      const bin = (v, c) => Math.min(n - 1, Math.max(0, Math.floor(((v - c + half) / (2 * half)) * n)));
      for (let cell = 0; cell < mesh.offsets.length; cell++) {
        let [a0, a1, b0, b1] = [n, 0, n, 0];
        for (const p of cellOf(mesh, cell)) {
          const [i, j] = [bin(mesh.plane[2 * p], cx), bin(mesh.plane[2 * p + 1], cy)];
          a0 = Math.min(a0, i); a1 = Math.max(a1, i); b0 = Math.min(b0, j); b1 = Math.max(b1, j);
        }
        for (let i = a0; i <= a1; i++) for (let j = b0; j <= b1; j++) bins[i * n + j].push(cell);
      }
      const inside = (cell, x, y) => {
        const ring = cellOf(mesh, cell);
        let is = false;
        for (let i = 0, j = ring.length - 1; i < ring.length; j = i++) {
          const [xi, yi, xj, yj] = [mesh.plane[2 * ring[i]], mesh.plane[2 * ring[i] + 1], mesh.plane[2 * ring[j]], mesh.plane[2 * ring[j] + 1]];
          if (yi > y !== yj > y && x < ((xj - xi) * (y - yi)) / (yj - yi) + xi) is = !is;
        }
        return is;
      };
      const at = (x, y) => {
        if (Math.abs(x - cx) > half || Math.abs(y - cy) > half) return -1;
        const found = bins[bin(x, cx) * n + bin(y, cy)].find((cell) => inside(cell, x, y));
        return found === undefined ? -1 : found;
      };
      const centre = (cell) => {
        const ring = cellOf(mesh, cell);
        let [x, y] = [0, 0];
        for (const p of ring) { x += mesh.plane[2 * p] / ring.length; y += mesh.plane[2 * p + 1] / ring.length; }
        return [x, y];
      };
      return { mesh, to, from, at, centre, scale, range: [cx - half, cx + half, cy - half, cy + half] };
    }

    function path(cell) {
      context.beginPath();
      cellOf(shape.mesh, cell).forEach((p, i) => {
        const [x, y] = shape.to(shape.mesh.plane[2 * p], shape.mesh.plane[2 * p + 1]);
        if (i) context.lineTo(x, y); else context.moveTo(x, y);
      });
      context.closePath();
    }

    function axes() {
      const [left, top, width, height] = AREA;
      context.font = "22px Helvetica, Arial, sans-serif"; context.fillStyle = "#1d2430"; context.strokeStyle = "#667"; context.lineWidth = 1.5;
      context.strokeRect(left, top, width, height);
      const span = shape.range[1] - shape.range[0], rough = span / 5, power = 10 ** Math.floor(Math.log10(rough));
      const step = [1, 2, 5, 10].find((s) => s * power >= rough) * power, digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
      const text = (v) => (Math.abs(v) < step / 1e6 ? "0" : digits > 5 ? v.toExponential(1) : v.toFixed(digits)).replace("-", "\u2212");
      context.textAlign = "center";
      for (let v = Math.ceil(shape.range[0] / step) * step; v <= shape.range[1] + step * 1e-6; v += step) {
        const x = shape.to(v, 0)[0];
        context.beginPath(); context.moveTo(x, top + height); context.lineTo(x, top + height + 8); context.stroke(); context.fillText(text(v), x, top + height + 32);
      }
      context.textAlign = "right";
      for (let v = Math.ceil(shape.range[2] / step) * step; v <= shape.range[3] + step * 1e-6; v += step) {
        const y = shape.to(0, v)[1];
        context.beginPath(); context.moveTo(left - 8, y); context.lineTo(left, y); context.stroke(); context.fillText(text(v), left - 14, y + 8);
      }
      context.textAlign = "center"; context.fillText(`x, ${units.length}`, left + width / 2, top + height + 64);
      context.save(); context.translate(26, top + height / 2); context.rotate(-Math.PI / 2); context.fillText(`y, ${units.length}`, 0, 0); context.restore();
    }

    function draw() {
      const mesh = meshes[data.frames[frame].mesh], zones = field.key === "status";
      if (!shape || shape.mesh !== mesh) { shape = layout(mesh); if (cursor >= mesh.offsets.length) cursor = -1; }
      values = valuesOf(frame, field);
      const most = $("map-common").checked ? largestOfAll(field, frame) : largest(values);
      context.fillStyle = "#fff"; context.fillRect(0, 0, canvas.width, canvas.height);
      context.lineWidth = 1;
      for (let cell = 0; cell < values.length; cell++) {
        const paint = zones ? css(ZONES[values[cell]] || ZONES[0]) : css(colour(most > 0 ? values[cell] / most : 0));
        path(cell); context.fillStyle = paint; context.strokeStyle = paint; context.fill(); context.stroke();
      }
      axes();
      colourBar(context, [AREA[0] + AREA[2] + 30, 80, 34, 700], most, unitOf(field, frame), zones);
      const notes = ["x and y are the frame's own axes. Tractions act on body 2; on body 1 they are the opposite."];
      if (mesh.curved) notes.push("The frame is curved: the map shows its projection, the 3D view its shape.");
      $("map-note").textContent = notes.join(" ");
      $("map-back").disabled = frame === 0; $("map-on").disabled = frame === data.frames.length - 1;
      still.getContext("2d").drawImage(canvas, 0, 0);
      mark();
    }

    // Redraws the stored picture and marks the cell under the cursor.
    function mark() {
      context.drawImage(still, 0, 0);
      if (cursor >= 0) { path(cursor); context.strokeStyle = "#d55e00"; context.lineWidth = 3; context.stroke(); }
      readout();
    }

    function readout() {
      const box = $("map-readout");
      if (cursor < 0) { box.replaceChildren(Object.assign(document.createElement("p"), { className: "note", textContent: "Point at a cell, or move over the map with the arrow keys, to read its values." })); return; }
      const f = fieldsOf(frame), [x, y] = shape.centre(cursor), table = document.createElement("table");
      const row = (words, text, mark) => {
        const tr = table.insertRow(), th = document.createElement("th"), td = document.createElement("td");
        th.textContent = words; td.textContent = text; th.scope = "row"; if (mark) tr.className = "shown"; if (mark) tr.id = "map-value"; tr.append(th, td);
      };
      row("Cell", String(cursor + 1)); row("Centre x, y", `${short(x)}, ${short(y)} ${units.length}`);
      for (const item of shownFields) {
        const value = valuesOf(frame, item)[cursor];
        row(item.words, item.key === "status" ? ZONE_WORDS[value] || String(value) : `${short(value)} ${unitOf(item, frame)}`, item === field);
      }
      for (const [key, words, unit] of PARTS) if (f[key] && !(key.startsWith("slip") && f.status && f.status[cursor] === 0)) row(words, `${short(f[key][cursor])} ${unitOf({ key, unit }, frame)}`);
      box.replaceChildren(table);
    }

    function select(cell) { if (cell !== cursor) { cursor = cell; mark(); } }
    function tip(px, py) {
      const box = $("map-tip");
      box.hidden = cursor < 0;
      if (cursor < 0) return;
      box.textContent = field.key === "status" ? ZONE_WORDS[values[cursor]] : `${field.words}: ${short(values[cursor])} ${unitOf(field, frame)}`;
      const share = canvas.clientWidth / canvas.width, left = px * share + 14;
      box.style.left = `${Math.max(0, Math.min(left, canvas.clientWidth - box.offsetWidth - 4))}px`;
      box.style.top = `${Math.max(0, py * share - 34)}px`;
    }
    canvas.addEventListener("pointermove", (event) => {
      const share = canvas.width / canvas.clientWidth, [px, py] = [event.offsetX * share, event.offsetY * share];
      select(shape.at(...shape.from(px, py))); tip(px, py);
    });
    canvas.addEventListener("pointerleave", () => { $("map-tip").hidden = true; });
    canvas.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!way) return;
      event.preventDefault();
      let from = cursor < 0 ? [0.5 * (shape.range[0] + shape.range[1]), 0.5 * (shape.range[2] + shape.range[3])] : shape.centre(cursor);
      let next = cursor < 0 ? shape.at(...from) : -1;
      const step = (shape.range[1] - shape.range[0]) / 400;
      for (let k = 1; k <= 400 && next < 0; k++) {
        const found = shape.at(from[0] + way[0] * step * k, from[1] + way[1] * step * k);
        if (found >= 0 && found !== cursor) next = found;
      }
      if (next >= 0) { select(next); tip(...shape.to(...shape.centre(next))); }
    });
    const change = () => { frame = Number($("map-entry").value); field = shownFields.find((f) => f.key === $("map-field").value); $("map-tip").hidden = true; draw(); };
    for (const id of ["map-entry", "map-field", "map-common"]) $(id).addEventListener("change", change);
    const move = (by) => { $("map-entry").value = String(Math.min(data.frames.length - 1, Math.max(0, frame + by))); change(); };
    $("map-back").addEventListener("click", () => move(-1)); $("map-on").addEventListener("click", () => move(1));
    draw();
    // For tests: the screen position of a cell, and the number of cells.
    return { centre: (cell) => { const box = canvas.getBoundingClientRect(), [x, y] = shape.to(...shape.centre(cell)), s = box.width / canvas.width; return [box.left + x * s, box.top + y * s]; }, cells: () => values.length };
  })();

  // Tabs.
  const sections = [...document.querySelectorAll("main > section")], tabs = $("tabs");
  tabs.setAttribute("role", "tablist");
  let view = null;
  const open = (section, focus) => {
    for (const [i, other] of sections.entries()) {
      const is = other === section, tab = tabs.children[i];
      other.classList.toggle("open", is); tab.setAttribute("aria-selected", String(is)); tab.tabIndex = is ? 0 : -1;
      if (is && focus) tab.focus();
    }
    if (section.id === "view" && !view) { section.classList.remove("unseen"); view = window.orthowearView({ data, meshes, floats, whole, shownFields, valuesOf, largest, largestOfAll, label, inMenu, unitOf, fill, colour, ZONES, colourBar, units }); }
    if (section.id === "view") view.resize();
    try { history.replaceState(null, "", `#${section.id}`); } catch { /* Browsers refuse this for pages without an address of their own. */ }
  };
  sections.forEach((section, i) => {
    const tab = Object.assign(document.createElement("button"), { type: "button", textContent: section.dataset.tab, id: `tab-${section.id}` });
    tab.setAttribute("role", "tab"); tab.setAttribute("aria-controls", section.id);
    section.setAttribute("role", "tabpanel"); section.setAttribute("aria-labelledby", tab.id);
    tab.addEventListener("click", () => open(section));
    tab.addEventListener("keydown", (event) => {
      const to = { ArrowRight: i + 1, ArrowLeft: i - 1, Home: 0, End: sections.length - 1 }[event.key];
      if (to !== undefined) { event.preventDefault(); open(sections[(to + sections.length) % sections.length], true); }
    });
    tabs.append(tab);
  });
  if ($("view")) $("view").classList.add("unseen");
  open(sections.find((section) => `#${section.id}` === location.hash) || sections[0]);
  window.addEventListener("resize", () => view && view.resize());
  window.addEventListener("beforeprint", () => view && view.resize());
  window.orthowearReport = { map };
})();
