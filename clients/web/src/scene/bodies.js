// Bodies that the page itself adds to the scene: vehicle, trail, the fan's plane with the last ping on it, beam edges, grid.
import {
  BoxGeometry, BufferAttribute, BufferGeometry, ConeGeometry, DataTexture, DoubleSide, EdgesGeometry, FloatType, GridHelper, Group, Line,
  LineBasicMaterial, LineSegments, Mesh, MeshPhongMaterial, GreaterDepth, NearestFilter, Points, PointsMaterial, RGBAFormat, RedFormat, ShaderMaterial, UnsignedByteType, Vector2,
} from 'three.module.js';
import { table_entries } from '../fan/layout.js';

/// Makes a box of the size of a small vehicle, with a cone at the bow; call hollow() while the vehicle has no poses.
export function makeVehicle() {
  const group = new Group();
  const paint = new MeshPhongMaterial({ color: 0xe0a526, shininess: 20 });
  const body = new Mesh(new BoxGeometry(0.62, 0.42, 0.3), paint);
  const mark = new Mesh(new ConeGeometry(0.13, 0.26, 16), new MeshPhongMaterial({ color: 0xd9534f }));
  mark.rotation.z = -Math.PI / 2;  // its tip along x
  mark.position.x = 0.44;
  const edges = new LineSegments(new EdgesGeometry(body.geometry), new LineBasicMaterial({ color: 0xe0a526 }));
  group.add(body, mark, edges);
  return { group, hollow: (yes) => (body.visible = !yes) };
}

/// Makes a line through the positions of the last minute.
export function makeTrail() {
  const most = 900;
  const points = [];  // {t, x, y, z}
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(3 * most), 3));
  geometry.setDrawRange(0, 0);
  const line = new Line(geometry, new LineBasicMaterial({ color: 0xe0a526, transparent: true, opacity: 0.55 }));
  line.frustumCulled = false;
  const add = (t, place) => {
    const last = points.at(-1);
    if (last && Math.hypot(place.x - last.x, place.y - last.y, place.z - last.z) > 5) points.length = 0;  // a jump
    if (last && t - last.t < 0.05) return;
    points.push({ t, x: place.x, y: place.y, z: place.z });
    while (points.length > most || points[0].t < t - 60) points.shift();
    const array = geometry.attributes.position.array;
    points.forEach((p, i) => array.set([p.x, p.y, p.z], 3 * i));
    geometry.attributes.position.needsUpdate = true;
    geometry.setDrawRange(0, points.length);
  };
  return { line, add, clear: () => (points.length = 0) };
}

export function makeGrid() {
  const grid = new GridHelper(60, 60, 0x5b7f94, 0x3c5a6b);
  grid.rotation.x = Math.PI / 2;
  grid.material.transparent = true;
  grid.material.opacity = 0.22;
  grid.material.depthWrite = false;
  return grid;
}

/// Makes the lines of a SceneUpdate's entity. Its points are pairs.
export function makeLines(lines) {
  const points = lines.flatMap((line) => line.points.flatMap((p) => [p.x, p.y, p.z]));
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(points), 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color: 0x4fb8ff, transparent: true, opacity: 0.65 }));
}

/// Makes the points of a PointCloud; each begins with x, y and z.
export function makePoints({ point_stride, data }) {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const places = [];
  for (let at = 0; at + point_stride <= data.byteLength; at += point_stride) for (const byte of [0, 4, 8]) places.push(view.getFloat32(at + byte, true));
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(places), 3));
  const points = new Points(geometry, new PointsMaterial({ color: 0xffc36b, size: 2, sizeAttenuation: false }));
  points.frustumCulled = false;
  return points;
}

const vertex = `
varying vec2 place;
void main() {
  place = position.xy;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;
const fragment = `
uniform sampler2D samples, table, colours;
uniform vec2 azimuths, shape, ranges;
uniform float gain, strength;
varying vec2 place;
void main() {
  float range = length(place);
  float at = (azimuths.x - atan(place.y, place.x)) / (azimuths.x - azimuths.y);
  if (range < ranges.x || range > ranges.y || at < 0.0 || at > 1.0) discard;
  float beam = texture2D(table, vec2((at * ${(table_entries - 1).toFixed(1)} + 0.5) / ${table_entries.toFixed(1)}, 0.5)).r;
  vec2 where = vec2((beam + 0.5) / shape.y, (range - ranges.x) / (ranges.y - ranges.x));
  float value = clamp(texture2D(samples, where).r * gain, 0.0, 1.0);
  gl_FragColor = vec4(texture2D(colours, vec2((value * 255.0 + 0.5) / 256.0, 0.5)).rgb, (0.12 + 0.83 * sqrt(value)) * strength);
}`;

const texture = (array, width, height, format, type) => {
  const made = new DataTexture(array, width, height, format, type);
  made.minFilter = made.magFilter = NearestFilter;
  made.unpackAlignment = 1;
  made.needsUpdate = true;
  return made;
};

/// Makes the sonar's plane: x ahead, y to port. show(fan) takes over the ping, colour map and gain that the fan shows.
export function makeFanPlane() {
  const uniforms = { strength: { value: 1 } };
  for (const name of ['samples', 'table', 'colours', 'azimuths', 'shape', 'ranges', 'gain']) uniforms[name] = { value: null };
  const material = new ShaderMaterial({ uniforms, vertexShader: vertex, fragmentShader: fragment, transparent: true, side: DoubleSide, depthWrite: false });
  const mesh = new Mesh(new BufferGeometry(), material);
  // Parts behind the seabed or an object shine through.
  const hidden = material.clone();
  hidden.uniforms = { ...uniforms, strength: { value: 0.55 } };
  hidden.depthFunc = GreaterDepth;
  const ghost = new Mesh(mesh.geometry, hidden);
  mesh.add(ghost);
  mesh.visible = false;
  mesh.frustumCulled = ghost.frustumCulled = false;
  let shown = {};
  const put = (name, value) => {
    uniforms[name].value?.dispose?.();
    uniforms[name].value = value;
  };

  /// Makes a sector of slices that covers the fan; the shader cuts it exactly.
  const shape = ({ first, last }, reach) => {
    const slices = Math.max(8, Math.ceil((first - last) / 0.1));
    const reached = reach / Math.cos((first - last) / slices / 2);
    const corners = [];
    for (let i = 0; i <= slices; i++) {
      const azimuth = first + ((last - first) * i) / slices;
      corners.push([reached * Math.cos(azimuth), reached * Math.sin(azimuth), 0]);
    }
    const triangles = [];
    for (let i = 0; i < slices; i++) triangles.push(0, 0, 0, ...corners[i], ...corners[i + 1]);
    mesh.geometry.setAttribute('position', new BufferAttribute(new Float32Array(triangles), 3));
  };

  /// Returns true if something changed.
  const show = (fan) => {
    const { ping, polar, table, map, gain } = fan;
    mesh.visible = Boolean(ping && polar && fan.samples);
    if (!mesh.visible) return false;
    const news = ping !== shown.ping || map !== shown.map || gain !== shown.gain;
    if (map !== shown.map) put('colours', texture(map, 256, 1, RGBAFormat, UnsignedByteType));
    if (table !== shown.table || polar.range_m !== shown.range_m) {
      put('table', texture(table.beams, table_entries, 1, RedFormat, FloatType));
      uniforms.azimuths.value = new Vector2(table.first, table.last);
      shape(table, polar.range_m);
    }
    if (ping !== shown.ping) {
      put('samples', texture(bytesOf(fan), polar.beams, polar.rows, RedFormat, UnsignedByteType));
      uniforms.shape.value = new Vector2(polar.rows, polar.beams);
      uniforms.ranges.value = new Vector2(polar.start_m, polar.range_m);
    }
    uniforms.gain.value = gain * (fan.samples instanceof Uint8Array ? 255 / fan.full_scale : 1);
    shown = { ping, map, gain, table, range_m: polar.range_m };
    return news;
  };
  return { mesh, show };
}

/// Returns the samples as bytes: those of more bits are scaled to the brightest.
function bytesOf({ samples, full_scale, shades }) {
  if (samples instanceof Uint8Array) return samples;
  return Uint8Array.from(samples, (v) => 255 * Math.min(1, v / full_scale) ** shades.gamma);
}
