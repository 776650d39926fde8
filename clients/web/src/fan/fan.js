// The pane of the fan: draws each ping, its marks, and the values under the cursor.
import { $, setClass, setHidden, setText } from '../dom.js';
import { beamTable, drawnLayout, exactLayout, fittedLayout, polarOf, samplesOf, under } from './layout.js';
import { bearingText, drawAxes, drawMarks } from './marks.js';
import { colourTable, mapNames } from './colours.js';
import { LookupPainter } from './lookup.js';
import { drawFlat } from './flat.js';
import { fixed, short, whole } from '../numbers.js';
import { makeFanPainter } from './shader.js';
import { makeRemembered } from '../remember.js';

const background = [13, 17, 23];
const slow_ms = 40;
const very_slow_ms = 80;
const kinds = {  // names of the pictures that sonard draws
  points: 'points as sent',
  sweep: 'sweep',
  'range image': 'range image: near is bright',
  waterfall: 'waterfall: the newest ping on top',
  fan: 'fan',
};
const columns = { sent: ', over the water column', model: ", over the model's own water column" };
const empty_grid = { rows: 500, beams: 2, spacing_m: 0.02, start_m: 0, range_m: 10, azimuth_rad: [Math.PI / 6, -Math.PI / 6] };

export class Fan {
  constructor(facts, exact) {
    this.facts = facts;
    this.exact = exact;  // for tests: width in pixels, with the layout of `sonarctl view --png --no-rings`; else 0
    this.canvas = $('fan');
    this.drawnCanvas = $('drawn');
    this.marks = $('fan-marks');
    this.painter = (exact && makeFanPainter(this.canvas)) || new LookupPainter(this.canvas);
    this.remembered = makeRemembered('fan', { map: 'copper', rings: true });
    this.gain = 1;
    this.rings = !exact && this.remembered.rings;
    this.cost_ms = 0;
    this.quality = 2;  // 2: mean over the footprint; 1: one sample per pixel; 0: also half resolution
    this.useMap(this.remembered.map);
    const observer = new ResizeObserver(() => this.resize());
    for (const id of ['fan-pane', 'fan-top', 'fan-controls']) observer.observe($(id));
    this.marks.addEventListener('pointermove', (event) => this.point(event));
    this.marks.addEventListener('pointerleave', () => this.point(null));
  }

  /// Draws with the graphics processor from now on. Not for a software renderer: LookupPainter, which draws from a table, is many times faster with one.
  useGraphics() {
    const canvas = this.canvas.cloneNode();  // a canvas keeps the kind of its first context
    const painter = this.exact ? null : makeFanPainter(canvas);
    if (!painter) return;
    this.canvas.replaceWith(canvas);
    [this.canvas, this.painter, this.layout] = [canvas, painter, null];
    if (this.polar && this.samples) painter.load(this.ping.image, this.samples, this.table, this.full_scale);
    this.redraw();
  }

  /// True if sonard, not this page, draws the picture: while a recording is played, and if the picture is not a fan of one ping.
  get drawn() {
    return Boolean(this.facts.recording) || this.facts.pictureKind !== 'fan';
  }

  /// The conversion of samples to shades. Older daemons do not send it; their samples are linear.
  get shades() {
    const { gamma, per_mille } = this.facts.pictures.get(this.facts.sonar) ?? {};
    return { gamma: gamma || 1, per_mille: per_mille || 999 };
  }

  useMap(name) {
    this.mapName = mapNames.includes(name) ? name : 'copper';
    this.remembered.map = this.mapName;
    this.map = colourTable(this.mapName);
    this.redraw();
  }
  nextMap() {
    this.useMap(mapNames[(mapNames.indexOf(this.mapName) + 1) % mapNames.length]);
  }
  setGain(gain) {
    this.gain = Math.min(8, Math.max(0.125, gain));
    this.redraw();
  }
  toggleRings() {
    this.rings = !this.rings;
    this.remembered.rings = this.rings;
    this.redraw();
  }
  toggleFreeze() {
    this.frozen = !this.frozen;
    return this.frozen;
  }

  resize() {
    this.layout = null;
    this.redraw();
  }

  /// Shows a ping. The present ping is drawn again only if its shades have become known since. `ping` is null if none was received yet.
  show(ping) {
    const again = ping === this.ping;
    if (this.frozen || (again && (!this.samples || this.per_mille === this.shades.per_mille))) return;
    this.ping = ping;
    if (!ping) {
      this.polar = null;
      return this.redraw();
    }
    if (ping.about) return this.showDrawn(ping);
    this.shape = '';
    const geometry = ping.geometry;
    if (geometry !== this.geometry) {
      this.geometry = geometry;
      this.table = beamTable(geometry.azimuth_rad);
    }
    const before = this.polar;
    this.polar = polarOf(ping.image, geometry);
    if (!this.samples || before?.range_m !== this.polar.range_m || before?.azimuth_rad.length !== this.polar.azimuth_rad.length) this.layout = null;
    this.per_mille = this.shades.per_mille;
    const { samples, full_scale } = samplesOf(ping.image, this.per_mille);
    [this.samples, this.full_scale] = [samples, full_scale];
    this.painter.load(ping.image, samples, this.table, full_scale);
    this.paint();
    if (!again) this.facts.pingDrawn();
  }

  showDrawn({ image, about }) {
    const is_polar = about.starboard_rad !== about.port_rad && about.kind !== 'range image';
    this.polar = is_polar ? { start_m: about.range_start_m, range_m: about.range_m, azimuth_rad: [about.port_rad, about.starboard_rad], beams: 2, up: about.kind === 'points' && about.elevation_rad < 0 ? -1 : 1 } : null;
    this.samples = null;
    const shape = JSON.stringify([image.width, image.height, this.polar]);
    if (shape !== this.shape) this.layout = null;
    this.shape = shape;
    this.paint();
    this.facts.pingDrawn();
  }

  redraw() {
    cancelAnimationFrame(this.asked);
    this.asked = requestAnimationFrame(() => this.paint());
  }

  paint() {
    const pane = $('fan-pane');
    const width = this.exact || pane.clientWidth;
    const height = pane.clientHeight;
    if (width < 40 || height < 40) return;
    const about = this.ping?.about;
    const polar = this.polar ?? empty_grid;
    if (!this.layout) this.arrange(polar, width, height);
    const { layout } = this;  // painting may change this.layout
    const marked = { rings: this.rings, cursor: this.cursor, ratio: this.ratio, head_rad: about?.kind === 'sweep' ? about.head_rad : undefined };
    setHidden(this.drawnCanvas, !about);
    setHidden(this.canvas, Boolean(about) || !this.polar);
    if (about) drawFlat(this.drawnCanvas, this.ping.image, this.map, this.gain);
    else if (this.polar) this.paintPicture();
    const marks = JSON.stringify([marked, layout, polar.range_m, polar.azimuth_rad[0], polar.azimuth_rad.at(-1), about && !this.polar ? about : null]);
    if (marks !== this.markedWith) {  // most pings change none of them
      if (about && !this.polar) drawAxes(this.marks, about, layout, marked);
      else drawMarks(this.marks, polar, layout, marked);
    }
    this.markedWith = marks;
    this.caption();
  }

  arrange(polar, width, height) {
    const margins = { left: 36, right: 46, top: $('fan-top').offsetHeight + 20, bottom: $('fan-controls').offsetHeight + 18 };
    const image = this.ping?.about && this.ping.image;
    this.layout = image ? drawnLayout(image, this.polar, width, height, margins) : this.exact ? exactLayout(polar, width, 4) : fittedLayout(polar, width, height, margins);
    this.ratio = this.exact ? 1 : Math.min(2, devicePixelRatio || 1);
    const scale = this.exact ? 1 : this.quality === 0 ? this.ratio / 2 : this.painter.ratio?.(this.layout, this.ratio) ?? this.ratio;
    this.scale = scale;
    this.markedWith = '';  // the new size clears the marks
    const { box } = this.layout;
    if (box) for (const side of ['left', 'top', 'width', 'height']) this.drawnCanvas.style[side] = `${box[side]}px`;
    for (const [canvas, s] of [[this.canvas, scale], [this.marks, this.ratio]]) {
      canvas.width = Math.round(this.layout.width * s);
      canvas.height = Math.round(this.layout.height * s);
      canvas.style.width = `${this.layout.width}px`;
      canvas.style.height = `${this.layout.height}px`;
    }
  }

  paintPicture() {
    const { layout, scale } = this;
    const scaled = {
      width: layout.width * scale,
      height: this.canvas.height,
      apex_x: layout.apex_x * scale,
      apex_y: layout.apex_y * scale,
      metres_per_pixel: layout.metres_per_pixel / scale,
    };
    const measured = !this.exact && this.painter.finish && ++this.painted % 8 === 0;
    const from = performance.now();
    this.painter.paint(this.polar, scaled, { map: this.map, gain: this.gain, gamma: this.shades.gamma, single: this.quality < 2, outside: background });
    if (!measured) return;
    this.painter.finish();
    this.adapt(performance.now() - from);
  }
  painted = 0;

  /// Reduces the quality on slow machines: first to one sample per pixel, then also to half the resolution (a quarter of the pixels).
  adapt(ms) {
    this.cost_ms = this.cost_ms ? 0.6 * this.cost_ms + 0.4 * ms : ms;
    const worst = this.quality === 2 ? slow_ms : very_slow_ms;
    if (this.cost_ms <= worst || this.quality === 0) return;
    this.quality--;
    this.cost_ms = 0;
    this.layout = null;
  }

  point(event) {
    this.cursor = event && this.polar && this.layout?.apex_x ? under(this.polar, this.layout, event.offsetX, event.offsetY) : null;
    this.redraw();
  }

  caption() {
    const ping = this.ping;
    if (!ping || ping.number) setText($('ping-number'), whole(ping?.number));
    const bits = { mono8: 8, mono16: 16 }[ping?.image.encoding] ?? 32;
    setHidden($('ping-size'), !ping);
    const { kind, column } = ping?.about ?? {};
    const words = kinds[kind] && kinds[kind] + (columns[column] ?? '');
    setText($('ping-size'), words ?? (ping && !ping.about ? `${ping.image.width} × ${ping.image.height} · ${bits} bit` : '–'));
    $('fan-glass').dataset.kind = this.facts.pictureKind;
    const label = words ? `The sonar's picture: ${words}` : "The sonar's picture";
    if (this.drawnCanvas.getAttribute('aria-label') !== label) this.drawnCanvas.setAttribute('aria-label', label);
    const c = this.cursor;
    setHidden($('cursor'), !c);
    if (!c) return;
    const sample = this.samples ? `  sample ${short(this.samples[c.row * this.polar.beams + c.beam], 3)}` : '';
    setText($('cursor'), `${fixed(c.range_m, 2)} m  ${bearingText(c.azimuth_rad, 1)}${sample}`);
  }

  setMood(picture) {
    setClass($('fan-glass'), picture);
  }

  /// Saves the picture and its marks as a PNG file.
  save() {
    if (!this.layout) return;  // nothing drawn yet
    const whole_picture = document.createElement('canvas');
    whole_picture.width = this.marks.width;
    whole_picture.height = this.marks.height;
    const g = whole_picture.getContext('2d');
    const { box } = this.layout;
    const at = this.ping?.about ? [box.left, box.top, box.width, box.height].map((v) => v * this.ratio) : [0, 0, whole_picture.width, whole_picture.height];
    g.drawImage(this.ping?.about ? this.drawnCanvas : this.canvas, ...at);
    g.drawImage(this.marks, 0, 0);
    whole_picture.toBlob((blob) => {
      const link = document.createElement('a');
      link.href = URL.createObjectURL(blob);
      link.download = `${this.facts.sonar || 'sonar'}-${this.ping?.number ?? 'ping'}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }
}
