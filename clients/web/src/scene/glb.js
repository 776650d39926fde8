// Reads the GLB files that sonard writes for objects: one mesh with positions, normals and indices, one colour. Axes y up.
import { BufferAttribute, BufferGeometry } from 'three.module.js';

const arrays = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };
const widths = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

/// Returns {geometry, colour: [r, g, b] of 0 to 1}; in the geometry, z is up again.
export function readGlb(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (view.getUint32(0, true) !== 0x46546c67) throw new Error('not a GLB file');
  const size = view.getUint32(12, true);
  const about = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + size)));
  const data = bytes.subarray(28 + size);
  const take = (index) => {
    const accessor = about.accessors[index];
    const part = about.bufferViews[accessor.bufferView];
    const Array = arrays[accessor.componentType];
    const from = data.byteOffset + (part.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
    const count = accessor.count * widths[accessor.type];
    return new Array(data.buffer.slice(from, from + count * Array.BYTES_PER_ELEMENT));
  };
  const turned = (vectors) => {  // the file has (x, z, -y)
    for (let i = 0; i < vectors.length; i += 3) [vectors[i + 1], vectors[i + 2]] = [-vectors[i + 2], vectors[i + 1]];
    return new BufferAttribute(vectors, 3);
  };
  const primitive = about.meshes[0].primitives[0];
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', turned(take(primitive.attributes.POSITION)));
  if (primitive.attributes.NORMAL === undefined) geometry.computeVertexNormals();
  else geometry.setAttribute('normal', turned(take(primitive.attributes.NORMAL)));
  if (primitive.indices !== undefined) geometry.setIndex(new BufferAttribute(take(primitive.indices), 1));
  const colour = about.materials?.[primitive.material]?.pbrMetallicRoughness?.baseColorFactor ?? [0.6, 0.6, 0.6];
  return { geometry, colour: colour.slice(0, 3) };
}

const most_triangles = 20000, fewest_triangles = 2000, most_cells_aside = 1600;

/// Returns a geometry with fewer triangles, for software renderers, whose time for a frame grows with their number. A long thin
/// mesh has smaller cells, because in large ones few of its triangles remain, or none.
export function coarsened(geometry) {
  if (!geometry.index || geometry.index.count < 3 * most_triangles) return geometry;
  geometry.computeBoundingBox();
  for (let cells_aside = Math.sqrt(most_triangles / 2); cells_aside <= most_cells_aside; cells_aside *= 2) {
    const kept = keptIn(cells_aside, geometry);
    if (kept.length < 3 * fewest_triangles) continue;
    geometry.setIndex(kept);
    break;
  }
  return geometry;
}

/// Returns the indices of the triangles that remain if each cell keeps only its first vertex.
function keptIn(cells_aside, { index, attributes, boundingBox: { min, max } }) {
  const places = attributes.position.array;
  const cell = Math.max(max.x - min.x, max.y - min.y, max.z - min.z) / cells_aside;
  const firstOf = new Map();
  const first = new Uint32Array(attributes.position.count);
  for (let i = 0; i < first.length; i++) {
    const [x, y, z] = [0, 1, 2].map((axis) => Math.floor((places[3 * i + axis] - min.getComponent(axis)) / cell));
    const key = (x * 2048 + y) * 2048 + z;
    if (!firstOf.has(key)) firstOf.set(key, i);
    first[i] = firstOf.get(key);
  }
  const kept = [];
  for (let i = 0; i < index.count; i += 3) {
    const [a, b, c] = [first[index.array[i]], first[index.array[i + 1]], first[index.array[i + 2]]];
    if (a !== b && b !== c && c !== a) kept.push(a, b, c);
  }
  return kept;
}
