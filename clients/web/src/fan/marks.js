// Draws range rings, bearings and the lines through the cursor on top of the fan, on a 2D canvas.
import { ringSpacing_m } from './layout.js';
import { short } from '../numbers.js';

const ring = 'rgba(200, 214, 229, 0.32)';
const edge = 'rgba(200, 214, 229, 0.45)';
const text_colour = '#aeb9c4';
const font = '11px system-ui, sans-serif';
const label_gap_px = 30;

const degrees = (radians) => (radians * 180) / Math.PI;
const place = (layout, range_m, azimuth) => [
  layout.apex_x - (range_m / layout.metres_per_pixel) * Math.sin(azimuth),
  layout.apex_y - layout.up * (range_m / layout.metres_per_pixel) * Math.cos(azimuth),
];
/// Adds an arc about the sonar to the path, from one side of the fan to the other.
const arc = (g, layout, range_m, port, starboard) => {
  const ends = layout.up > 0 ? [-Math.PI / 2 - port, -Math.PI / 2 - starboard] : [Math.PI / 2 + starboard, Math.PI / 2 + port];
  g.arc(layout.apex_x, layout.apex_y, range_m / layout.metres_per_pixel, ...ends);
};

/// Formats an angle with starboard positive, as operators read it: "+15°".
export function bearingText(azimuth_rad, digits = 0) {
  const bearing = -degrees(azimuth_rad);
  const text = Math.abs(bearing).toFixed(digits);
  return `${Number(text) === 0 ? '' : bearing < 0 ? '-' : '+'}${text}°`;
}

function bearingStep(aperture_deg) {
  return aperture_deg > 100 ? 30 : aperture_deg > 45 ? 15 : aperture_deg > 25 ? 10 : 5;
}

function drawRings(g, polar, layout, port, starboard) {
  const spacing = ringSpacing_m(polar.range_m);
  const px = spacing / layout.metres_per_pixel;
  const every = Math.max(1, Math.ceil(label_gap_px / px)) * (px * 2 < 90 ? 2 : 1);
  for (let n = 1; n * spacing <= polar.range_m * 1.0001; n++) {
    const outermost = (n + 1) * spacing > polar.range_m * 1.0001;
    g.strokeStyle = outermost ? edge : ring;
    g.beginPath();
    arc(g, layout, n * spacing, port, starboard);
    g.stroke();
    if (n % every || outermost) continue;
    const [x, y] = place(layout, n * spacing, starboard);
    const flat = starboard < -1.2;
    const away = 9 * Math.max(1, layout.scale ?? 1);  // the picture extends half a beam beyond the outermost beam, and may be enlarged
    const outside = layout.up > 0 ? 4 + away : -3 - away;  // below the edge; above it if the fan opens downwards
    g.textAlign = flat ? 'center' : 'left';
    g.fillText(`${short(n * spacing)} m`, x + (flat ? 0 : away * Math.cos(starboard)), y + (flat ? outside : 4 - away * layout.up * Math.sin(starboard)));
  }
}

function drawBearings(g, polar, layout, port, starboard) {
  const step = bearingStep(degrees(port - starboard));
  g.strokeStyle = ring;
  for (const azimuth of [port, starboard]) {
    g.beginPath();
    g.moveTo(layout.apex_x, layout.apex_y);
    g.lineTo(...place(layout, polar.range_m, azimuth));
    g.stroke();
  }
  const marks = [];
  for (let d = Math.ceil(degrees(Math.max(starboard, -3.1)) / step - 1e-6) * step; d <= degrees(port) + 1e-6; d += step) marks.push((d * Math.PI) / 180);
  g.textAlign = 'center';
  for (const azimuth of marks) {
    const tick = 5 * layout.metres_per_pixel;
    g.strokeStyle = edge;
    g.beginPath();
    g.moveTo(...place(layout, polar.range_m, azimuth));
    g.lineTo(...place(layout, polar.range_m + tick, azimuth));
    g.stroke();
    const [x, y] = place(layout, polar.range_m + 2.6 * tick, azimuth);
    g.fillText(bearingText(azimuth), x - 4 * Math.sin(azimuth), y + 3);
  }
}

/// Draws the direction of a scanning sonar's head.
function drawHead(g, polar, layout, head_rad) {
  g.strokeStyle = 'rgba(79, 184, 255, 0.9)';
  g.lineWidth = 2;
  g.beginPath();
  g.moveTo(layout.apex_x, layout.apex_y);
  g.lineTo(...place(layout, polar.range_m, head_rad));
  g.stroke();
  g.lineWidth = 1;
}

/// Marks the place under the cursor with its range and direction.
function drawCursor(g, polar, layout, cursor, port, starboard) {
  g.strokeStyle = 'rgba(79, 184, 255, 0.8)';
  g.beginPath();
  arc(g, layout, cursor.range_m, port, starboard);
  g.moveTo(layout.apex_x, layout.apex_y);
  g.lineTo(...place(layout, polar.range_m, cursor.azimuth_rad));
  g.stroke();
}

function cleared(canvas, layout, ratio) {
  const g = canvas.getContext('2d');
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, layout.width, layout.height);
  g.font = font;
  g.fillStyle = text_colour;
  g.lineWidth = 1;
  return g;
}

/// `canvas` has layout.width x layout.height CSS pixels.
export function drawMarks(canvas, polar, layout, { rings, cursor, ratio, head_rad }) {
  const g = cleared(canvas, layout, ratio);
  const [port, starboard] = [polar.azimuth_rad[0], polar.azimuth_rad.at(-1)];
  if (rings) {
    drawRings(g, polar, layout, port, starboard);
    drawBearings(g, polar, layout, port, starboard);
  }
  if (head_rad !== undefined) drawHead(g, polar, layout, head_rad);
  if (cursor) drawCursor(g, polar, layout, cursor, port, starboard);
}

/// Draws the axes of a rectangle: bearings above and elevations beside a range image, ranges above and times beside a waterfall.
export function drawAxes(canvas, about, { box, width, height }, { rings, ratio }) {
  const g = cleared(canvas, { width, height }, ratio);
  if (!rings) return;
  const line = (part, text, upright) => {
    const [x, y] = [box.left + part * box.width, box.top + part * box.height];
    g.beginPath();
    g.moveTo(upright ? x : box.left, upright ? box.top : y);
    g.lineTo(upright ? x : box.left + box.width, upright ? box.top + box.height : y);
    g.stroke();
    g.textAlign = upright ? 'center' : 'left';
    g.fillText(text, upright ? x : box.left + box.width + 4, upright ? box.top - 5 : y + 4);
  };
  const lines = (low, high, step, text, upright) => {
    for (let v = Math.ceil(Math.min(low, high) / step - 1e-9) * step; v <= Math.max(low, high) + 1e-9; v += step)
      line((v - low) / (high - low), text(v), upright);
  };
  g.strokeStyle = ring;
  if (about.kind === 'waterfall') {
    for (const { part, age_s } of about.time_marks ?? []) line(part, `${short(age_s)} s`, false);
    return lines(about.range_start_m, about.range_m, ringSpacing_m(about.range_m), (v) => `${short(v)} m`, true);
  }
  const [port, elevation] = [degrees(about.port_rad), degrees(about.elevation_rad)];
  lines(-port, -degrees(about.starboard_rad), bearingStep(2 * port), (v) => `${short(v)}°`, true);
  lines(elevation, -elevation, bearingStep(2 * elevation), (v) => `${short(v)}°`, false);
}
