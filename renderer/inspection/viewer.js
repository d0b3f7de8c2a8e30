"use strict";
// Draws what the page carries: surfaces of coloured triangles, lines, and rings round findings.
(() => {
const data = JSON.parse(document.getElementById("data").textContent);
const canvas = document.getElementById("canvas"), stage = document.getElementById("stage");
const rings = document.getElementById("rings"), told = document.getElementById("told");
const state = {target: [0, 0, 0], distance: 3, azimuth: 0, elevation: 0, xray: true, clip: null, spot: -1, drawn: 0};
window.sssView = state;

const fail = text => { document.documentElement.dataset.error = text; told.textContent = text; };
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

async function unpack(text, kind) {
  const raw = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new kind(await new Response(stream).arrayBuffer());
}

// ---- the camera: it turns about a target, +y stays up ----

function axes() {
  const {azimuth: a, elevation: e} = state;
  const back = [Math.cos(e) * Math.sin(a), Math.sin(e), Math.cos(e) * Math.cos(a)];
  const right = [Math.cos(a), 0, -Math.sin(a)];
  return {right, up: cross(back, right), back};
}
function aim(view) {
  const length = Math.hypot(...view.back);
  state.target = [...view.target];
  state.distance = view.distance;
  state.elevation = Math.asin(view.back[1] / length);
  state.azimuth = Math.atan2(view.back[0], view.back[2]);
}
function fly(view) {
  const from = {...state, target: [...state.target]};
  aim(view);
  const to = {target: [...state.target], distance: state.distance, azimuth: state.azimuth, elevation: state.elevation};
  to.azimuth = from.azimuth + Math.atan2(Math.sin(to.azimuth - from.azimuth), Math.cos(to.azimuth - from.azimuth));
  const begun = performance.now(), quick = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const step = now => {
    const t = quick ? 1 : Math.min((now - begun) / 450, 1), s = t * t * (3 - 2 * t);
    const mix = (a, b) => a + s * (b - a);
    state.target = to.target.map((value, k) => mix(from.target[k], value));
    state.distance = Math.exp(mix(Math.log(from.distance), Math.log(to.distance)));
    state.azimuth = mix(from.azimuth, to.azimuth);
    state.elevation = mix(from.elevation, to.elevation);
    draw();
    if (t < 1) requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}
const slope = Math.tan(data.view.fov * Math.PI / 360);
function project(point) {
  const {right, up, back} = axes(), p = sub(point, state.target);
  const depth = state.distance - dot(p, back), scale = stage.clientHeight / 2 / slope / depth;
  return [stage.clientWidth / 2 + dot(p, right) * scale, stage.clientHeight / 2 - dot(p, up) * scale, depth, scale];
}

// ---- drawing ----

const gl = canvas.getContext("webgl2", {alpha: false, antialias: true, preserveDrawingBuffer: true});
if (!gl) { fail("This browser has no WebGL 2: the table beside is all there is."); return; }

// positions are taken relative to the target before anything else: close-ups stay sharp
const COMMON = `#version 300 es
precision highp float; precision highp int;
uniform mat3 axes; uniform vec3 target, lens; uniform vec2 limits; uniform int clipAxis;
vec4 place(vec3 p, out vec3 seen) {
  seen = axes * (p - target) - vec3(0, 0, lens.z);
  float far = lens.z + 4.0, near = max(lens.z - 4.0, lens.z * 0.02);
  return vec4(seen.xy * lens.xy, -((far + near) * seen.z + 2.0 * far * near) / (far - near), -seen.z);
}
bool cut(vec3 p) { return clipAxis >= 0 && (p[clipAxis] < limits.x || p[clipAxis] > limits.y); }
`;
const CUT = `#version 300 es
precision highp float; precision highp int;
uniform vec2 limits; uniform int clipAxis;
in vec3 here;
void cut() { if (clipAxis >= 0 && (here[clipAxis] < limits.x || here[clipAxis] > limits.y)) discard; }
`;
const MESH_V = COMMON + `
layout(location = 0) in vec3 p; layout(location = 1) in vec3 c;
uniform int first; out vec3 seen, here; flat out vec3 colour; flat out int face;
void main() { here = p; colour = c; face = first + gl_VertexID / 3; gl_Position = place(p, seen); }`;
const MESH_F = CUT + `
in vec3 seen; flat in vec3 colour; flat in int face;
uniform float alpha; uniform vec3 inside, wall; uniform bool identify; out vec4 result;
void main() {
  cut();
  if (identify) { result = vec4(float(face & 255), float((face >> 8) & 255), float((face >> 16) & 255), 255) / 255.0; return; }
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float light = 0.35 + 0.65 * abs(dot(normal, normalize(seen)));
  vec3 back = distance(colour, wall) < 0.01 ? inside : mix(colour, inside, 0.4);
  result = vec4((gl_FrontFacing ? colour : back) * light, alpha);
}`;
const LINE_V = COMMON + `
layout(location = 0) in vec3 a; layout(location = 1) in vec3 b; layout(location = 2) in vec2 corner;
uniform vec2 pixels; uniform float width; out vec3 here;
void main() {
  vec3 seen; vec4 pa = place(a, seen), pb = place(b, seen);
  here = corner.x < 0.5 ? a : b;
  vec4 p = corner.x < 0.5 ? pa : pb;
  vec2 along = pb.xy / pb.w * pixels - pa.xy / pa.w * pixels;
  vec2 side = length(along) > 0.0 ? normalize(vec2(-along.y, along.x)) : vec2(1, 0);
  p.xy += side * corner.y * width / pixels * p.w;
  p.z -= 0.0006 * p.w;
  gl_Position = p;
}`;
const LINE_F = CUT + `uniform vec4 tint; out vec4 result; void main() { cut(); result = tint; }`;

function program(vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const names = {};
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
    const name = gl.getActiveUniform(made, k).name;
    names[name] = gl.getUniformLocation(made, name);
  }
  return {made, at: names};
}
function attribute(place, array, size, kind, normalized, divisor = 0) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, size, kind, normalized, 0, 0);
  gl.vertexAttribDivisor(place, divisor);
}
let meshes = [], lines = [], meshProgram, lineProgram;

function soup(points, faces, colours, chosen) {
  const place = new Float32Array(9 * chosen.length), colour = new Uint8Array(9 * chosen.length);
  chosen.forEach((face, k) => {
    for (let corner = 0; corner < 3; corner++) {
      const v = 3 * faces[3 * face + corner], at = 9 * k + 3 * corner;
      for (let i = 0; i < 3; i++) { place[at + i] = points[v + i]; colour[at + i] = colours[3 * face + i]; }
    }
  });
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  attribute(0, place, 3, gl.FLOAT, false);
  attribute(1, colour, 3, gl.UNSIGNED_BYTE, true);
  return {array, count: 3 * chosen.length};
}
async function load() {
  meshProgram = program(MESH_V, MESH_F);
  lineProgram = program(LINE_V, LINE_F);
  let first = 1;
  for (const entry of data.surfaces) {
    const points = await unpack(entry.points, Float32Array), faces = await unpack(entry.faces, Uint32Array);
    const colours = await unpack(entry.colours, Uint8Array), shining = await unpack(entry.shining, Uint8Array);
    const every = Uint32Array.from(shining, (_, k) => k);
    const source = await unpack(entry.source, Uint32Array);
    meshes.push({first, source, number: entry.number, all: soup(points, faces, colours, every),
                 glow: soup(points, faces, colours, every.filter(k => shining[k]))});
    first += shining.length;
  }
  for (const entry of data.strokes) {
    const ends = await unpack(entry.ends, Float32Array), count = ends.length / 6;
    const a = new Float32Array(3 * count), b = new Float32Array(3 * count);
    for (let k = 0; k < count; k++) { a.set(ends.subarray(6 * k, 6 * k + 3), 3 * k); b.set(ends.subarray(6 * k + 3, 6 * k + 6), 3 * k); }
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    attribute(0, a, 3, gl.FLOAT, false, 1);
    attribute(1, b, 3, gl.FLOAT, false, 1);
    attribute(2, new Float32Array([0, -1, 0, 1, 1, -1, 1, 1]), 2, gl.FLOAT, false);
    lines.push({array, count, colour: entry.colour, width: entry.width, shining: entry.shining});
  }
  for (const finding of data.findings) finding.set = new Set(await unpack(finding.faces, Uint32Array));
}
function uniforms({made, at}) {
  gl.useProgram(made);
  const {right, up, back} = axes();
  gl.uniformMatrix3fv(at.axes, false, [right[0], up[0], back[0], right[1], up[1], back[1], right[2], up[2], back[2]]);
  gl.uniform3fv(at.target, state.target);
  gl.uniform3f(at.lens, canvas.height / canvas.width / slope, 1 / slope, state.distance);
  gl.uniform1i(at.clipAxis, state.clip ? state.clip.axis : -1);
  gl.uniform2fv(at.limits, state.clip ? state.clip.limits : [0, 0]);
}
function drawMeshes(which, alpha, identify = false) {
  uniforms(meshProgram);
  gl.uniform1f(meshProgram.at.alpha, alpha);
  gl.uniform3fv(meshProgram.at.inside, data.inside.map(value => value / 255));
  gl.uniform3fv(meshProgram.at.wall, data.wall.map(value => value / 255));
  gl.uniform1i(meshProgram.at.identify, identify);
  for (const mesh of meshes) {
    if (!mesh[which].count) continue;
    gl.uniform1i(meshProgram.at.first, mesh.first);
    gl.bindVertexArray(mesh[which].array);
    gl.drawArrays(gl.TRIANGLES, 0, mesh[which].count);
  }
}
function drawLines(alpha, shiningOnly) {
  uniforms(lineProgram);
  gl.uniform2f(lineProgram.at.pixels, canvas.width / 2, canvas.height / 2);
  for (const line of lines) {
    if (shiningOnly && !line.shining) continue;
    gl.uniform1f(lineProgram.at.width, line.width / 2 * devicePixelRatio);
    gl.uniform4f(lineProgram.at.tint, ...line.colour.map(value => value / 255), alpha);
    gl.bindVertexArray(line.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, line.count);
  }
}
function draw() {
  const width = Math.round(stage.clientWidth * devicePixelRatio), height = Math.round(stage.clientHeight * devicePixelRatio);
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  gl.viewport(0, 0, width, height);
  gl.clearColor(...data.background.map(value => value / 255), 1);
  gl.depthMask(true); gl.disable(gl.BLEND); gl.enable(gl.DEPTH_TEST); gl.depthFunc(gl.LEQUAL);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  drawMeshes("all", 1);
  drawLines(1, false);
  if (state.xray) {
    // once more what matters, only where it is hidden
    gl.depthFunc(gl.GREATER); gl.depthMask(false); gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    drawMeshes("glow", 0.6);
    drawLines(0.6, true);
    gl.depthMask(true); gl.disable(gl.BLEND); gl.depthFunc(gl.LEQUAL);
  }
  placeRings();
  state.drawn++;
}

// ---- findings ----

const marks = data.spots.map((spot, k) => {
  const mark = document.createElement("button");
  mark.className = "ring" + (spot.inside ? " inside" : "") + (spot.quiet ? " quiet" : "");
  mark.style.setProperty("--colour", `rgb(${spot.colour})`);
  mark.title = `${spot.code} ${spot.name}`;
  mark.tabIndex = -1;
  mark.addEventListener("click", () => goTo(k));
  rings.append(mark);
  return mark;
});
function placeRings() {
  data.spots.forEach((spot, k) => {
    const [x, y, depth, scale] = project(spot.centre), radius = Math.max(9, 1.15 * spot.radius * scale);
    const shown = depth > 0 && radius < 200 && !isCut(spot.centre);
    marks[k].style.display = shown ? "" : "none";
    if (!shown) return;
    marks[k].style.transform = `translate(${x - radius}px, ${y - radius}px)`;
    marks[k].style.width = marks[k].style.height = `${2 * radius}px`;
    marks[k].classList.toggle("current", k === state.spot);
  });
}
const isCut = p => state.clip !== null && (p[state.clip.axis] < state.clip.limits[0] || p[state.clip.axis] > state.clip.limits[1]);
function goTo(k) {
  const spot = data.spots[k];
  state.spot = k;
  fly(spot.view);
  const finding = data.findings.find(entry => entry.spots.includes(k));
  const place = finding ? finding.spots.indexOf(k) + 1 : 1, places = finding ? finding.spots.length : 1;
  told.textContent = `${spot.code} ${spot.name}: place ${place} of ${places}` + (spot.inside ? ", inside" : "");
  document.querySelectorAll("tr.finding").forEach(row =>
    row.classList.toggle("current", finding !== undefined && Number(row.dataset.finding) === data.findings.indexOf(finding)));
}
function jump(step) {
  if (data.spots.length) goTo((state.spot + step + data.spots.length) % data.spots.length);
}
document.querySelectorAll("tr.finding").forEach(row => {
  const finding = data.findings[Number(row.dataset.finding)];
  const go = () => {
    if (!finding.spots.length) { told.textContent = `${finding.code}: no place to show`; return; }
    goTo(finding.spots[(finding.spots.indexOf(state.spot) + 1) % finding.spots.length]);
  };
  row.addEventListener("click", go);
  row.addEventListener("keydown", event => { if (event.key === "Enter") go(); });
});

// ---- picking a face ----

function pick(x, y) {
  const width = canvas.width, height = canvas.height, px = Math.floor(x * devicePixelRatio), py = height - 1 - Math.floor(y * devicePixelRatio);
  const buffer = gl.createFramebuffer(), colour = gl.createTexture(), depth = gl.createRenderbuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
  gl.bindTexture(gl.TEXTURE_2D, colour);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, colour, 0);
  gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
  gl.enable(gl.SCISSOR_TEST); gl.scissor(px, py, 1, 1);
  gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  drawMeshes("all", 1, true);
  const bytes = new Uint8Array(4);
  gl.readPixels(px, py, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  gl.disable(gl.SCISSOR_TEST); gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(buffer); gl.deleteTexture(colour); gl.deleteRenderbuffer(depth);
  const id = bytes[0] + 256 * bytes[1] + 65536 * bytes[2];
  const mesh = meshes.findLast(entry => entry.first <= id);
  if (id === 0 || !mesh) { told.textContent = ""; return; }
  const face = mesh.source[id - mesh.first];
  if (mesh.number < 0) { told.textContent = "a cap over a hole"; return; }
  const found = data.findings.filter(entry => entry.specimen === mesh.number && entry.set.has(face));
  const name = data.names.length > 1 ? `${data.names[mesh.number]}, ` : "";
  told.textContent = `${name}face ${face}: ` + (found.length ? found.map(entry => `${entry.code} ${entry.name}`).join(", ") : "no finding");
}

// ---- hands ----

let held = null;
canvas.addEventListener("pointerdown", event => {
  held = {x: event.clientX, y: event.clientY, far: 0, pan: event.button === 2 || event.button === 1 || event.shiftKey};
  canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener("pointermove", event => {
  if (!held) return;
  const dx = event.clientX - held.x, dy = event.clientY - held.y;
  held.far += Math.abs(dx) + Math.abs(dy); held.x = event.clientX; held.y = event.clientY;
  if (held.pan) {
    const {right, up} = axes(), unit = 2 * slope * state.distance / stage.clientHeight;
    state.target = state.target.map((value, k) => value - dx * unit * right[k] + dy * unit * up[k]);
  } else {
    state.azimuth -= dx * 0.008;
    state.elevation = Math.max(-1.56, Math.min(1.56, state.elevation + dy * 0.008));
  }
  draw();
});
canvas.addEventListener("pointerup", event => {
  if (held && held.far < 4) { const box = canvas.getBoundingClientRect(); pick(event.clientX - box.left, event.clientY - box.top); draw(); }
  held = null;
});
canvas.addEventListener("contextmenu", event => event.preventDefault());
canvas.addEventListener("wheel", event => {
  event.preventDefault();
  state.distance = Math.max(1e-4, Math.min(20, state.distance * Math.exp(event.deltaY * 0.0012)));
  draw();
}, {passive: false});
document.addEventListener("keydown", event => {
  if (/INPUT|SELECT|TEXTAREA/.test(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey) return;
  const act = {n: () => jump(1), p: () => jump(-1), r: () => { state.spot = -1; fly(data.view); }, x: () => document.getElementById("xray").click()}[event.key];
  if (act) act();
});
document.getElementById("next").addEventListener("click", () => jump(1));
document.getElementById("previous").addEventListener("click", () => jump(-1));
document.getElementById("whole").addEventListener("click", () => { state.spot = -1; fly(data.view); });
document.getElementById("xray").addEventListener("change", event => { state.xray = event.target.checked; draw(); });
const axis = document.getElementById("axis"), limit = document.getElementById("limit");
function reclip() {
  const k = "xyz".indexOf(axis.value);
  limit.disabled = k < 0;
  const [low, high] = data.bounds.map(corner => corner[k]);
  state.clip = k < 0 ? null : {axis: k, limits: [low - 1, low + limit.value / 1000 * (high - low)]};
  draw();
}
axis.addEventListener("change", reclip);
limit.addEventListener("input", reclip);
if (data.clip) state.clip = data.clip;

aim(data.view);
load().then(() => {
  draw();
  new ResizeObserver(draw).observe(stage);
  document.documentElement.dataset.ready = "yes";
}).catch(error => fail(`The view cannot be drawn: ${error.message}`));
})();
