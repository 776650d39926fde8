// Converts between a ping's metres and the picture's pixels, and between directions and beams, as core/image/draw_fan.cpp does.

/// Returns the layout of an image from its geometry message: {rows, beams, spacing_m, start_m, range_m, azimuth_rad, full_scale}.
export function polarOf(image, geometry) {
  const spacing_m = geometry.row_spacing_m;
  const start_m = geometry.range_start_m ?? 0;
  return {
    rows: image.height,
    beams: image.width,
    spacing_m,
    start_m,
    range_m: start_m + image.height * spacing_m,
    azimuth_rad: geometry.azimuth_rad,  // in falling order, positive to port
  };
}

/// Returns the layout that `sonarctl view --png` has with that width; margin 4 without rings. `polar.up` -1: the fan opens down.
export function exactLayout(polar, width, margin) {
  const half = Math.max(Math.abs(polar.azimuth_rad[0]), Math.abs(polar.azimuth_rad.at(-1)));
  const metres_per_pixel = Math.max((2 * polar.range_m * Math.sin(Math.min(half, Math.PI / 2))) / (width - 2 * margin), polar.range_m / (4 * width));
  const ahead = polar.range_m / metres_per_pixel;
  const behind = Math.max(0, -Math.cos(half)) * ahead;
  const up = polar.up ?? 1;
  const apex_y = margin + (up > 0 ? ahead : behind);
  return { width, height: Math.ceil(margin + ahead + behind + margin), apex_x: width / 2, apex_y, up, metres_per_pixel };
}

/// Returns the layout of the largest fan that fits between the margins {left, right, top, bottom} of a pane.
export function fittedLayout(polar, width, height, margins) {
  const half = Math.min(Math.PI / 2, Math.max(Math.abs(polar.azimuth_rad[0]), Math.abs(polar.azimuth_rad.at(-1))));
  const wide = width - margins.left - margins.right;
  const tall = height - margins.top - margins.bottom;
  const metres_per_pixel = Math.max((2 * polar.range_m * Math.sin(half)) / Math.max(wide, 40), polar.range_m / Math.max(tall, 40));
  const used = polar.range_m / metres_per_pixel;
  return { width, height, apex_x: margins.left + wide / 2, apex_y: margins.top + tall / 2 + used / 2, up: 1, metres_per_pixel };
}

/// Returns the place between the margins of a picture that sonard has drawn, and its polar layout if it has one.
export function drawnLayout(image, polar, width, height, margins) {
  const scale = Math.min((width - margins.left - margins.right) / image.width, (height - margins.top - margins.bottom) / image.height);
  const box = { width: image.width * scale, height: image.height * scale };
  box.left = margins.left + (width - margins.left - margins.right - box.width) / 2;
  box.top = margins.top + (height - margins.top - margins.bottom - box.height) / 2;
  if (!polar) return { width, height, box };
  const { apex_x, apex_y, up, metres_per_pixel } = exactLayout(polar, image.width, 4);
  return { width, height, box, scale, apex_x: box.left + apex_x * scale, apex_y: box.top + apex_y * scale, up, metres_per_pixel: metres_per_pixel / scale };
}

/// Returns the distance between range rings: 1, 2 or 5 times a power of ten, four to ten rings.
export function ringSpacing_m(range_m) {
  const decade = 10 ** Math.floor(Math.log10(range_m));
  for (const step of [0.1, 0.2, 0.5, 1]) if (range_m / (step * decade) <= 10) return step * decade;
  return 2 * decade;
}

/// Returns the fractional place in the beam table; beam k spans [k - 0.5, k + 0.5]. Outside: below -0.5 or above beams - 0.5.
export function beamAt(azimuth_rad, azimuth) {
  let low = 0;
  let high = azimuth_rad.length;
  while (low < high) {  // the first that is not greater
    const middle = (low + high) >> 1;
    if (azimuth_rad[middle] > azimuth) low = middle + 1;
    else high = middle;
  }
  const right = Math.min(Math.max(low, 1), azimuth_rad.length - 1);
  const a = azimuth_rad[right - 1];
  return right - 1 + (a - azimuth) / (a - azimuth_rad[right]);
}

/// Returns the place under a pixel: {range_m, azimuth_rad, row, beam}, or null outside the fan.
export function under(polar, layout, x, y) {
  const x_m = (x - layout.apex_x) * layout.metres_per_pixel;
  const y_m = layout.up * (layout.apex_y - y) * layout.metres_per_pixel;
  const range_m = Math.hypot(x_m, y_m);
  if (range_m < polar.start_m || range_m >= polar.range_m) return null;
  const azimuth_rad = Math.atan2(-x_m, y_m);
  const beam = Math.round(beamAt(polar.azimuth_rad, azimuth_rad));
  if (beam < 0 || beam >= polar.beams) return null;
  return { range_m, azimuth_rad, row: Math.min(polar.rows - 1, Math.floor((range_m - polar.start_m) / polar.spacing_m)), beam };
}

export const table_entries = 1024;
/// Returns the beams at azimuths in equal steps from `first` to `last` [rad], half a beam beyond the outermost beams' middles.
export function beamTable(azimuth_rad) {
  const n = azimuth_rad.length;
  const first = azimuth_rad[0] + (azimuth_rad[0] - azimuth_rad[1]) / 2;
  const last = azimuth_rad[n - 1] - (azimuth_rad[n - 2] - azimuth_rad[n - 1]) / 2;
  const beams = new Float32Array(table_entries);
  for (let i = 0; i < table_entries; i++) beams[i] = beamAt(azimuth_rad, first + ((last - first) * i) / (table_entries - 1));
  return { first, last, beams };
}

/// Returns the samples of the image as a typed array, and the code that is drawn brightest, as in `sonarctl view`. If samples
/// have more than 8 bits, `per_mille` of a thousand samples do not exceed this code.
export function samplesOf(image, per_mille) {
  const { data, encoding } = image;
  const at = data.byteOffset;
  const count = image.width * image.height;
  if (encoding === 'mono8') return { samples: data, full_scale: 254 };
  if (encoding === 'mono16') {
    const samples = new Uint16Array(data.slice().buffer, 0, count);
    return { samples, full_scale: Math.max(1, brightest(samples, 65536, per_mille, (v) => v)) };
  }
  const samples = new Float32Array(data.buffer.slice(at, at + 4 * count));
  const scale = 65535;
  return { samples, full_scale: Math.max(1, brightest(samples, scale + 1, per_mille, (v) => Math.min(scale, Math.max(0, Math.round(v * scale))))) / scale };
}

function brightest(samples, bins, per_mille, binOf) {
  const histogram = new Uint32Array(bins);
  for (let i = 0; i < samples.length; i++) histogram[binOf(samples[i])]++;
  let left = Math.floor(((samples.length - 1) * per_mille) / 1000);
  for (let v = 0; v < bins; v++) {
    left -= histogram[v];
    if (left < 0) return v;
  }
  return bins - 1;
}
