// Draws the bodies in space with three.js. Without WebGL, shows a line of text instead.
window.orthowearView = (page) => {
  "use strict";
  const { data, meshes, floats, whole, shownFields, valuesOf, largest, largestOfAll, label, inMenu, unitOf, fill, colour, ZONES, colourBar, units } = page;
  const $ = (id) => document.getElementById(id);
  const hasWebGL = (() => { try { const canvas = document.createElement("canvas"); const gl = canvas.getContext("webgl2"); if (gl && gl.getExtension("WEBGL_lose_context")) gl.getExtension("WEBGL_lose_context").loseContext(); return Boolean(gl); } catch { return false; } })();
  if (!hasWebGL) {
    for (const part of document.querySelectorAll("#view .controls, #view .view")) part.style.display = "none";
    $("view-note").textContent = "The 3D view needs WebGL, which is not available here. ParaView opens the same files (.pvd, .vtu).";
    return { resize() {} };
  }
  const box = $("view-box"), GREY = [[0.80, 0.77, 0.68], [0.70, 0.77, 0.84]];
  const surfaces = (data.surfaces || []).map((s) => ({ points: floats(s.points), triangles: whole(s.triangles) }));
  const bodies = (data.bodies || []).map((b) => ({
    ...b, displacement: floats(b.displacement), fields: Object.fromEntries(Object.entries(b.fields).map(([k, v]) => [k, floats(v)])),
  }));
  for (const body of bodies) body.fields.displacement = Float32Array.from({ length: body.displacement.length / 3 }, (_, i) => Math.hypot(...body.displacement.subarray(3 * i, 3 * i + 3)));
  const files = [...new Set([...bodies.map((b) => b.file), ...data.frames.map((f) => f.file)])].sort((a, b) => a - b);
  const frameOf = (file) => data.frames.findIndex((frame) => frame.file === file);
  const named = (file) => { const i = frameOf(file); return i < 0 ? `field file ${file}` : label(data.frames[i]); };
  fill($("view-entry"), files.map((file) => [file, named(file) + (bodies.length && !bodies.some((b) => b.file === file) ? " (frame only)" : "")]));
  const withBodies = files.filter((file) => bodies.some((b) => b.file === file));
  $("view-entry").value = String(withBodies.length ? withBodies[withBodies.length - 1] : files[files.length - 1]);
  const BODY = [["pressure", "Pressure on the bodies", units.stress], ["displacement", "Displacement", units.length], ["von_mises", "von Mises stress", units.stress], ["sigma_tangential", "Largest stress in the surface", units.stress]]
    .filter(([key]) => bodies.some((b) => b.fields[key] && largest(b.fields[key]) > 0));
  fill($("view-field"), [
    ...(data.frames.length ? shownFields.map((f) => [`frame:${f.key}`, inMenu(f)]) : []),
    ...BODY.map(([key, words, unit]) => [`body:${key}`, `${words}, ${unit}`]),
  ]);

  const bounds = (() => {
    const low = [Infinity, Infinity, Infinity], high = low.map((x) => -x);
    for (const points of [...surfaces, ...meshes].map((s) => s.points)) for (let i = 0; i < points.length; i++) { low[i % 3] = Math.min(low[i % 3], points[i]); high[i % 3] = Math.max(high[i % 3], points[i]); }
    return { centre: low.map((x, k) => 0.5 * (x + high[k])), size: Math.max(1e-300, Math.hypot(...low.map((x, k) => high[k] - x))) };
  })();
  const S = 2 / bounds.size, unit = (p, k) => (p - bounds.centre[k]) * S;
  const frameSize = meshes.length ? (() => { const r = [Infinity, -Infinity, Infinity, -Infinity]; const p = meshes[0].plane; for (let i = 0; i < p.length; i += 2) { r[0] = Math.min(r[0], p[i]); r[1] = Math.max(r[1], p[i]); r[2] = Math.min(r[2], p[i + 1]); r[3] = Math.max(r[3], p[i + 1]); } return Math.max(r[1] - r[0], r[3] - r[2]); })() : bounds.size;
  const largestU = Math.max(1e-300, ...bodies.map((b) => largest(b.fields.displacement)));
  const flat = bodies.every((b) => data.frames.some((f) => meshes[f.mesh].points.length === surfaces[b.surface].points.length));
  if (flat) { $("view-relief").value = "50"; $("view-body2").checked = false; $("view-body1").checked = false; }
  // Magnification of displacements for the slider position 0 to 100. At 100, the largest displacement appears as a quarter of the size of the bodies, or of the frame for half-spaces.
  const factor = () => { const s = Number($("view-scale").value) / 100; return s === 0 ? 0 : Number(((0.25 * (flat ? frameSize : bounds.size)) / largestU * s ** 3).toPrecision(2)); };

  // Surfaces that the controls select, as triangles: 9 coordinates and 9 colour values per triangle.
  function pieces() {
    const file = Number($("view-entry").value), [kind, key] = $("view-field").value.split(":");
    const field = shownFields.find((f) => f.key === key), list = [], scale = factor(), lift = (Number($("view-lift").value) / 100) * 0.6;
    const i = frameOf(file);
    const ofBodies = () => Math.max(0, ...bodies.filter((b) => b.fields[key]).map((b) => largest(b.fields[key])));
    const most = kind === "body" ? ofBodies() : i < 0 ? 0 : largestOfAll(field, i);
    for (const body of bodies.filter((b) => b.file === file && $(`view-body${b.body}`).checked)) {
      const { points, triangles } = surfaces[body.surface], values = kind === "body" ? body.fields[key] : null;
      const positions = new Float32Array(3 * triangles.length), colours = new Float32Array(3 * triangles.length);
      for (let t = 0; t < triangles.length; t++) {
        const p = triangles[t], rgb = values ? colour(most > 0 ? values[p] / most : 0).map((c) => c / 255) : GREY[body.body - 1];
        for (let k = 0; k < 3; k++) { positions[3 * t + k] = unit(points[3 * p + k] + scale * body.displacement[3 * p + k], k) + (k === 2 && body.body === 2 ? lift : 0); colours[3 * t + k] = rgb[k]; }
      }
      list.push({ positions, colours, opacity: values ? 1 : 0.45 });
    }
    if (i >= 0 && kind === "frame" && $("view-frame").checked) list.push(framePiece(i, field, most));
    return { list, most, unit: kind === "frame" ? (i < 0 ? "" : unitOf(field, i)) : BODY.find(([k]) => k === key)[2], zones: kind === "frame" && key === "status" };
  }

  // The frame surface, raised along its normals in proportion to the field shown.
  function framePiece(i, field, most) {
    const mesh = meshes[data.frames[i].mesh], values = valuesOf(i, field), n = mesh.points.length / 3;
    const sums = new Float32Array(n), counts = new Float32Array(n), normals = new Float32Array(3 * n), corners = [];
    const at = (p, k) => mesh.points[3 * p + k];
    for (let cell = 0; cell < mesh.offsets.length; cell++) {
      const ring = mesh.connectivity.subarray(cell ? mesh.offsets[cell - 1] : 0, mesh.offsets[cell]);
      for (let j = 1; j + 1 < ring.length; j++) corners.push(ring[0], ring[j], ring[j + 1], cell);
      const [a, b] = [1, 2].map((j) => [0, 1, 2].map((k) => at(ring[j], k) - at(ring[0], k)));
      const normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
      for (const p of ring) { sums[p] += values[cell]; counts[p] += 1; for (let k = 0; k < 3; k++) normals[3 * p + k] += normal[k]; }
    }
    const relief = field.key === "status" || most <= 0 ? 0 : ((Number($("view-relief").value) / 100) * 0.7 * frameSize * S) / most;
    const down = field.key.startsWith("wear") ? -1 : 1, positions = new Float32Array((corners.length / 4) * 9), colours = new Float32Array(positions.length);
    for (let t = 0; t < corners.length / 4; t++) {
      const value = values[corners[4 * t + 3]], rgb = field.key === "status" ? ZONES[value] || ZONES[0] : colour(most > 0 ? value / most : 0);
      for (let c = 0; c < 3; c++) {
        const p = corners[4 * t + c], length = Math.hypot(normals[3 * p], normals[3 * p + 1], normals[3 * p + 2]) || 1;
        for (let k = 0; k < 3; k++) {
          positions[9 * t + 3 * c + k] = unit(at(p, k), k) + (down * relief * sums[p] * normals[3 * p + k]) / (counts[p] * length);
          colours[9 * t + 3 * c + k] = rgb[k] / 255;
        }
      }
    }
    return { positions, colours, opacity: 1, frame: true };
  }

  const START = { turn: -0.75, tilt: 0.55, zoom: 1, at: [0, 0, 0] };
  const frameMiddle = () => {
    const i = frameOf(Number($("view-entry").value)), points = meshes[data.frames[i < 0 ? 0 : i].mesh].points, sum = [0, 0, 0];
    for (let j = 0; j < points.length; j++) sum[j % 3] += (3 * points[j]) / points.length;
    return sum.map(unit);
  };
  const stage = webgl();

  function webgl() {
    const T = window.THREE, renderer = new T.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    const scene = new T.Scene(), camera = new T.PerspectiveCamera(32, 1, 0.01, 100), target = new T.Vector3();
    scene.background = new T.Color(0xfbfcfd);
    scene.add(new T.AmbientLight(0xffffff, 1.9));
    const light = new T.DirectionalLight(0xffffff, 1.6);
    scene.add(light, light.target);
    box.append(renderer.domElement);
    const controls = new T.OrbitControls(camera, renderer.domElement);
    let shown = [], distance = 4;
    const draw = () => { light.position.copy(camera.position).add(new T.Vector3(0.5, 0.2, 1)); renderer.render(scene, camera); };
    controls.addEventListener("change", draw);
    camera.up.set(0, 0, 1);
    const place = (s) => {
      target.set(...s.at);
      camera.position.set(Math.cos(s.turn) * Math.cos(s.tilt), Math.sin(s.turn) * Math.cos(s.tilt), Math.sin(s.tilt)).multiplyScalar(distance / s.zoom).add(target);
      controls.target.copy(target); controls.update(); draw();
    };
    return {
      show(list) {
        for (const mesh of shown) { scene.remove(mesh); mesh.geometry.dispose(); mesh.material.dispose(); }
        shown = list.map((piece) => {
          const geometry = new T.BufferGeometry();
          geometry.setAttribute("position", new T.BufferAttribute(piece.positions, 3));
          const colours = piece.colours.slice();
          for (let i = 0; i < colours.length; i++) colours[i] = colours[i] <= 0.04045 ? colours[i] / 12.92 : ((colours[i] + 0.055) / 1.055) ** 2.4;
          geometry.setAttribute("color", new T.BufferAttribute(colours, 3));
          geometry.computeVertexNormals();
          const look = { vertexColors: true, side: T.DoubleSide, transparent: piece.opacity < 1, opacity: piece.opacity, depthWrite: piece.opacity === 1 };
          if (piece.frame) Object.assign(look, { polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2 });
          const mesh = new T.Mesh(geometry, new T.MeshLambertMaterial(look));
          scene.add(mesh);
          return mesh;
        });
        draw();
      },
      resize() {
        const [w, h] = [box.clientWidth, box.clientHeight];
        if (!w || !h) return;
        renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1)); renderer.setSize(w, h);
        camera.aspect = w / h; distance = (0.85 / Math.sin((16 * Math.PI) / 180)) * Math.max(1, 1 / camera.aspect);
        camera.updateProjectionMatrix(); draw();
      },
      place,
      turn(turn, tilt, zoom) {
        const offset = camera.position.clone().sub(controls.target), r = offset.length();
        const t = Math.atan2(offset.y, offset.x) + turn, e = Math.min(1.55, Math.max(-1.55, Math.asin(offset.z / r) + tilt));
        camera.position.set(Math.cos(t) * Math.cos(e), Math.sin(t) * Math.cos(e), Math.sin(e)).multiplyScalar(r / zoom).add(controls.target);
        controls.update(); draw();
      },
    };
  }

  function refresh() {
    const { list, most, unit: name, zones } = pieces(), bar = $("view-bar"), context = bar.getContext("2d");
    stage.show(list);
    context.clearRect(0, 0, bar.width, bar.height);
    colourBar(context, [6, 50, 34, 560], most, name, zones);
    $("view-scale-out").textContent = String(factor());
    const notes = [];
    if (!bodies.length) notes.push("Only the contact frame is shown: no body surfaces were written, or they are omitted.");
    if (flat && bodies.length) notes.push("Half-spaces are shown by their surface under the frame.");
    notes.push("The rigid-body motion of body 2 is not part of its displacement. Rotate by dragging or with the arrow keys; zoom with the wheel, + and −.");
    $("view-note").textContent = notes.join(" ");
  }
  // If a field of the bodies is chosen while both bodies are hidden, body 1 is shown. Otherwise the view would be empty.
  $("view-field").addEventListener("change", (event) => {
    if (event.target.value.startsWith("body:") && !$("view-body1").checked && !$("view-body2").checked) $("view-body1").checked = true;
    if (event.target.value.startsWith("frame:")) $("view-frame").checked = true;
  });
  for (const id of ["view-entry", "view-field", "view-body1", "view-body2", "view-frame"]) $(id).addEventListener("change", refresh);
  for (const id of ["view-lift", "view-scale", "view-relief"]) $(id).addEventListener("input", refresh);
  $("view-reset").addEventListener("click", () => stage.place(START));
  $("view-near").disabled = !data.frames.length;
  $("view-near").addEventListener("click", () => stage.place({ ...START, zoom: Math.max(1, (0.6 * bounds.size) / frameSize), at: frameMiddle() }));
  box.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: [0.1, 0, 1], ArrowRight: [-0.1, 0, 1], ArrowUp: [0, 0.1, 1], ArrowDown: [0, -0.1, 1], "+": [0, 0, 1.1], "-": [0, 0, 1 / 1.1] }[event.key];
    if (by) { event.preventDefault(); stage.turn(...by); }
  });
  stage.resize(); stage.place(START); refresh();
  return { resize: () => stage.resize() };
};
