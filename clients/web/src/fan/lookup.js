// Draws the fan without a graphics processor. A table holds the samples under each pixel, so that a ping takes a few milliseconds.
// All samples under a pixel have the same weight; core/image/draw_fan.cpp gives less weight to those at its edges.
import { table_entries } from './layout.js';

const most_beams = 32;  // beams averaged in one pixel; only pixels at the apex cover more
const fine_shades = 4096;  // with a gamma, dark shades are far apart
const most_pixels = 2e6;  // limit for screens with more than one pixel in a CSS pixel

export class LookupPainter {
  constructor(canvas) {
    this.g = canvas.getContext('2d', { alpha: false });
  }

  /// Returns the number of pixels per CSS pixel with which a picture of this size is drawn quickly.
  ratio({ width, height }, ratio) {
    return width * height * ratio ** 2 < most_pixels ? ratio : 1;
  }

  /// Stores the samples of a new ping.
  load(image, samples, table, full_scale) {
    Object.assign(this, { samples, table, full_scale });
  }

  /// map: 256 x RGBA bytes.
  paint(polar, layout, { map, gain, gamma, outside }) {
    const shape = JSON.stringify([layout, polar.rows, polar.beams, polar.spacing_m, polar.start_m]);
    if (shape !== this.shape || this.table !== this.arranged) {
      this.arrange(polar, layout, outside);
      [this.shape, this.arranged] = [shape, this.table];
    }
    const { samples, pixels, count, where, first, wide, rows } = this;
    const last = gamma === 1 ? 255 : fine_shades - 1;
    const colourOf = new Uint32Array(map.slice().buffer);
    const colours = Uint32Array.from({ length: last + 1 }, (_, i) => colourOf[Math.round(255 * (i / last) ** gamma)]);
    const scales = Float64Array.from({ length: most_beams + 1 }, (_, n) => (last * gain) / this.full_scale / (rows * n));
    for (let i = 0; i < count; i++) {
      const beams = wide[i];
      let sum = 0;
      for (let row = 0, from = first[i]; row < rows; row++, from += polar.beams) for (let at = from; at < from + beams; at++) sum += samples[at];
      pixels[where[i]] = colours[Math.min(last, Math.max(0, Math.round(sum * scales[beams])))];
    }
    this.g.putImageData(this.picture, 0, 0);
  }

  /// Finds the samples of each pixel: a block of `wide` beams and this.rows rows, from the sample `first` on.
  arrange(polar, { width, height, apex_x, apex_y, metres_per_pixel: px_m }, outside) {
    const { first: port, last, beams: beamOf } = this.table;
    const { rows, beams, spacing_m, start_m, range_m, azimuth_rad } = polar;
    const columns = Math.round(width);
    const most = columns * height;
    this.picture = this.g.createImageData(columns, height);
    this.pixels = new Uint32Array(this.picture.data.buffer).fill(new Uint32Array(new Uint8Array([...outside, 255]).buffer)[0]);
    [this.where, this.first, this.wide] = [new Int32Array(most), new Int32Array(most), new Uint8Array(most)];
    this.count = 0;
    this.rows = Math.max(1, Math.min(rows, Math.round(px_m / spacing_m)));
    const beam_rad = (azimuth_rad[0] - azimuth_rad.at(-1)) / (beams - 1);
    for (let y = 0; y < height; y++) {
      const ahead = (apex_y - y - 0.5) * px_m;
      for (let x = 0; x < columns; x++) {
        const starboard = (x + 0.5 - apex_x) * px_m;
        const range = Math.sqrt(ahead * ahead + starboard * starboard);
        if (range < start_m || range >= range_m) continue;
        const place = ((port - Math.atan2(-starboard, ahead)) / (port - last)) * (table_entries - 1);
        if (place < 0 || place > table_entries - 1) continue;
        const below = Math.min(Math.floor(place), table_entries - 2);
        const beam = beamOf[below] + (place - below) * (beamOf[below + 1] - beamOf[below]);
        if (beam < -0.5 || beam > beams - 0.5) continue;
        const wide = Math.max(1, Math.min(beams, most_beams, Math.round(px_m / Math.max(range, px_m) / beam_rad)));
        const from = Math.max(0, Math.min(beams - wide, Math.floor(beam + 0.5 - (wide - 1) / 2)));
        const row = Math.max(0, Math.min(rows - this.rows, Math.floor((range - start_m) / spacing_m - (this.rows - 1) / 2)));
        this.where[this.count] = y * columns + x;
        this.first[this.count] = row * beams + from;
        this.wide[this.count++] = wide;
      }
    }
  }
}
