// The colour maps. The build takes their names and anchors from core/image/colour_map.cpp.
import { anchors } from 'generated/colour-maps.js';

export const mapNames = Object.keys(anchors);

const byte = (unit) => Math.round(Math.min(1, Math.max(0, unit)) * 255);

/// Returns the map as 256 x RGBA bytes.
export function colourTable(name) {
  const table = new Uint8Array(1024);
  const stops = anchors[name] ?? anchors.copper;
  for (let i = 0; i < 256; i++) {
    const x = i / 255;
    const upper = Math.max(1, stops.findIndex((a) => x <= a[0]));
    const [a, b] = [stops[upper - 1], stops[upper]];
    const t = (x - a[0]) / (b[0] - a[0]);
    for (let c = 0; c < 3; c++) table[4 * i + c] = byte(a[c + 1] + t * (b[c + 1] - a[c + 1]));
    table[4 * i + 3] = 255;
  }
  return table;
}
