// Draws a scene as an outline through its own camera, so that a change of the text is seen at once.

const SVG = "http://www.w3.org/2000/svg";
const NEAR = 1e-3;

/** Fills an <svg> with the outline of a scene; false if the scene has no camera to look through. */
export function drawSketch(svg, scene) {
  const camera = cameraOf(scene);
  svg.replaceChildren();
  if (!camera) return false;
  svg.setAttribute("viewBox", `0 0 ${camera.width} ${camera.height}`);
  svg.setAttribute("preserveAspectRatio", "xMidYMid meet");
  const shapes = [...listOf(scene.objects).flatMap((object) => shapesOf(object, scene, camera)),
                  ...listOf(scene.lights).flatMap((light) => lightShapes(light, camera))];
  shapes.sort((a, b) => b.depth - a.depth);
  for (const shape of shapes) svg.append(pathOf(shape, camera));
  return true;
}

function cameraOf(scene) {
  const { eye, target, up = [0, 1, 0], fov = 40 } = scene?.camera ?? {};
  if (![eye, target, up].every(isPoint) || !(fov > 0 && fov < 180)) return null;
  const width = positive(scene.image?.width, 640);
  const height = positive(scene.image?.height, 480);
  const forward = unit(minus(target, eye));
  const right = unit(cross(forward, up));
  if (![...forward, ...right].every(Number.isFinite)) return null;
  const scale = height / 2 / Math.tan((fov * Math.PI) / 360);
  return { eye, forward, right, above: cross(right, forward), width, height, scale };
}

/** World to camera: right, up, forward. */
function seen(camera, point) {
  const way = minus(point, camera.eye);
  return [dot(way, camera.right), dot(way, camera.above), dot(way, camera.forward)];
}

function project(camera, [x, y, z]) {
  return [camera.width / 2 + (camera.scale * x) / z, camera.height / 2 - (camera.scale * y) / z];
}

function shapesOf(object, scene, camera) {
  const material = scene.materials?.[object?.material];
  const look = lookOf(material);
  if (object?.type === "sphere" && isPoint(object.center) && object.radius > 0) {
    return sphereShape(camera, object.center, object.radius, look);
  }
  if (object?.type === "polygon") return outline(camera, [object.vertices, ...listOf(object.holes)], look);
  if (object?.type === "mesh") return meshShapes(camera, object, look);
  return [];
}

/** The silhouette of a sphere is a circle, seen at an angle. */
function sphereShape(camera, center, radius, look) {
  const c = seen(camera, center);
  const distance = Math.hypot(...c);
  if (distance <= radius || c[2] <= NEAR) return [];
  const sine = radius / distance;
  const axis = unit(c);
  const middle = c.map((value) => value * (1 - sine * sine));
  const side = unit(cross(axis, Math.abs(axis[1]) < 0.9 ? [0, 1, 0] : [1, 0, 0]));
  const other = cross(axis, side);
  const reach = radius * Math.sqrt(1 - sine * sine);
  const points = Array.from({ length: 56 }, (_, i) => {
    const [u, v] = [Math.cos((i * Math.PI) / 28) * reach, Math.sin((i * Math.PI) / 28) * reach];
    return middle.map((value, k) => value + u * side[k] + v * other[k]);
  });
  return finish([points], look, distance - radius);
}

function outline(camera, loops, look) {
  const valid = loops.filter((loop) => Array.isArray(loop) && loop.length >= 3 && loop.every(isPoint));
  const clipped = valid.map((loop) => clip(loop.map((point) => seen(camera, point))));
  const all = clipped.flat();
  if (!all.length) return [];
  return finish(clipped, look, all.reduce((sum, point) => sum + point[2], 0) / all.length);
}

function meshShapes(camera, mesh, look) {
  const positions = listOf(mesh.positions);
  const triangles = listOf(mesh.triangles).slice(0, 2000);
  return triangles.flatMap((triangle) => outline(camera, [listOf(triangle).map((i) => positions[i])], look));
}

function lightShapes(light, camera) {
  const look = { kind: "light", fill: "none" };
  if (light?.type === "quad" && isPoint(light.center) && isPoint(light.towards)) {
    const normal = unit(minus(light.towards, light.center));
    const guess = isPoint(light.edge) ? light.edge : cross([0, 1, 0], normal);
    const u = unit(Math.hypot(...guess) > 1e-6 ? guess : [1, 0, 0]);
    const v = cross(normal, u);
    const [w, h] = listOf(light.size).map((side) => side / 2);
    const corner = (a, b) => light.center.map((value, k) => value + a * w * u[k] + b * h * v[k]);
    const corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
    return [...outline(camera, [corners], look), ...beam(camera, light.center, light.towards)];
  }
  if (light?.type === "point" && isPoint(light.position)) {
    const size = Math.hypot(...minus(light.position, camera.eye)) * 0.012;
    return sphereShape(camera, light.position, size, look);
  }
  return [];
}

/** A dashed line from a lamp to what it faces. */
function beam(camera, from, to) {
  const points = [from, to].map((point) => seen(camera, point));
  if (points.some((point) => point[2] <= NEAR)) return [];
  return [{ loops: [points], look: { kind: "beam", fill: "none" }, depth: 0, open: true }];
}

function finish(loops, look, depth) {
  const whole = loops.filter((loop) => loop.length >= 3 && loop.every((point) => point[2] > NEAR / 2));
  return whole.length ? [{ loops: whole, look, depth }] : [];
}

/** Cuts off what is behind the eye. */
function clip(loop) {
  return loop.flatMap((b, i) => {
    const a = loop.at(i - 1);
    const [aIn, bIn] = [a[2] > NEAR, b[2] > NEAR];
    const t = (NEAR - a[2]) / (b[2] - a[2]);
    const crossing = a.map((value, k) => (k === 2 ? NEAR : value + t * (b[k] - value)));
    if (aIn === bIn) return bIn ? [b] : [];
    return bIn ? [crossing, b] : [crossing];
  });
}

function lookOf(material) {
  if (material?.type === "glass") return { kind: "glass", fill: "none" };
  if (material?.type === "mirror") return { kind: "mirror", fill: "none" };
  const albedo = material?.albedo;
  const color = albedo?.checker ? albedo.checker.colors?.[0] : albedo;
  if (typeof color === "string") return { kind: "diffuse", fill: color };
  if (!isPoint(color)) return { kind: "diffuse", fill: "none" };
  const shown = color.map((value) => Math.round(255 * Math.min(1, Math.max(0, value)) ** (1 / 2.2)));
  return { kind: "diffuse", fill: `rgb(${shown.join(" ")})` };
}

function pathOf({ loops, look, open }, camera) {
  const path = document.createElementNS(SVG, "path");
  const write = (loop) => loop.map((point) => project(camera, point).map((v) => v.toFixed(1)).join(" "));
  path.setAttribute("d", loops.map((loop) => `M${write(loop).join("L")}${open ? "" : "Z"}`).join(""));
  path.setAttribute("class", look.kind);
  path.setAttribute("fill-rule", "evenodd");
  path.setAttribute("vector-effect", "non-scaling-stroke");
  if (look.fill !== "none") path.setAttribute("fill", look.fill);
  return path;
}

const listOf = (value) => (Array.isArray(value) ? value : []);
const positive = (value, otherwise) => (value > 0 ? value : otherwise);
const isPoint = (value) => Array.isArray(value) && value.length === 3 && value.every(Number.isFinite);
const minus = (a, b) => a.map((value, k) => value - b[k]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((value) => value / Math.hypot(...a));
