// The fan on the graphics processor: each pixel is the mean of the samples under its footprint, as in core/image/draw_fan.cpp.
import { table_entries } from './layout.js';

const vertex = `#version 300 es
in vec2 corner;
void main() { gl_Position = vec4(corner, 0.0, 1.0); }`;

// `single`: one sample per pixel, for slow machines. Otherwise rows and beams of large footprints are read with a stride.
const fragment = (single, sampler) => `#version 300 es
precision highp float;
precision highp ${sampler};
uniform ${sampler} samples;
uniform sampler2D table, colours;
uniform vec2 apex, azimuths, shape;  // apex: pixels from bottom left; azimuths: first and last of the table; shape: rows, beams
uniform float metresPerPixel, startM, spacingM, rangeM, beamSpacing, scale, gamma;
uniform vec3 outside;
out vec4 colour;
float sampleAt(int row, int beam) { return float(texelFetch(samples, ivec2(beam, row), 0).r); }
float beamAt(float azimuth) {
  float place = (azimuths.x - azimuth) / (azimuths.x - azimuths.y) * ${(table_entries - 1).toFixed(1)};
  if (place < 0.0 || place > ${(table_entries - 1).toFixed(1)}) return -1.0;
  int below = min(int(place), ${table_entries - 2});
  float a = texelFetch(table, ivec2(below, 0), 0).r, b = texelFetch(table, ivec2(below + 1, 0), 0).r;
  return mix(a, b, place - float(below));
}
vec2 span(float centre, float width, float cells) {
  float low = clamp(centre - width / 2.0, 0.0, cells - 1e-4);
  return vec2(low, clamp(centre + width / 2.0, low + 1e-4, cells));
}
float weight(vec2 span, int cell) { return max(0.0, min(span.y, float(cell) + 1.0) - max(span.x, float(cell))); }
void main() {
  colour = vec4(outside, 1.0);
  vec2 at = (gl_FragCoord.xy - apex) * metresPerPixel;
  float range = length(at);
  if (range < startM || range >= rangeM) return;
  float beam = beamAt(atan(at.x == 0.0 ? 1e-9 : -at.x, at.y));  // software renderers cannot compute atan(0, y)
  if (beam < -0.5 || beam > shape.y - 0.5) return;
  float row = (range - startM) / spacingM;
  ${single ? `
  float value = sampleAt(min(int(row), int(shape.x) - 1), clamp(int(beam + 0.5), 0, int(shape.y) - 1));` : `
  vec2 rows = span(row, max(1.0, metresPerPixel / spacingM), shape.x);
  vec2 beams = span(beam + 0.5, max(1.0, metresPerPixel / max(range, metresPerPixel) / beamSpacing), shape.y);
  int r0 = int(rows.x), r1 = min(int(shape.x) - 1, int(rows.y)), b0 = int(beams.x), b1 = min(int(shape.y) - 1, int(beams.y));
  int rStep = 1 + (r1 - r0) / 6, bStep = 1 + (b1 - b0) / 24;
  float sum = 0.0, weights = 0.0;
  for (int r = r0; r <= r1; r += rStep)
    for (int b = b0; b <= b1; b += bStep) {
      float w = weight(rows, r) * weight(beams, b);
      sum += w * sampleAt(r, b);
      weights += w;
    }
  float value = sum / weights;`}
  value = pow(clamp(value * scale, 0.0, 1.0), gamma);
  float place = value * 255.0;
  int below = min(int(place), 254);
  colour = vec4(mix(texelFetch(colours, ivec2(below, 0), 0).rgb, texelFetch(colours, ivec2(below + 1, 0), 0).rgb, place - float(below)), 1.0);
}`;

function compile(gl, source, type) {
  const shader = gl.createShader(type);
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
  return shader;
}

const formats = (gl) => ({
  mono8: { internal: gl.R8, format: gl.RED, type: gl.UNSIGNED_BYTE, sampler: 'sampler2D', unit: 255 },
  mono16: { internal: gl.R16UI, format: gl.RED_INTEGER, type: gl.UNSIGNED_SHORT, sampler: 'usampler2D', unit: 1 },
  '32FC1': { internal: gl.R32F, format: gl.RED, type: gl.FLOAT, sampler: 'sampler2D', unit: 1 },
});

/// Returns null if the browser has no WebGL2.
export function makeFanPainter(canvas) {
  const gl = canvas.getContext('webgl2', { alpha: false, antialias: false, preserveDrawingBuffer: true });
  return gl && new FanPainter(gl);
}

class FanPainter {
  constructor(gl) {
    this.gl = gl;
    this.prepare();
    gl.canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
    gl.canvas.addEventListener('webglcontextrestored', () => this.prepare());
  }

  prepare() {
    const gl = this.gl;
    this.programs = new Map();
    this.size = '';
    this.azimuths = null;
    this.map = null;
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.textures = ['samples', 'table', 'colours'].map((_, unit) => {
      const texture = gl.createTexture();
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
      for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
      return texture;
    });
  }

  program(single, sampler) {
    const key = `${single} ${sampler}`;
    if (!this.programs.has(key)) {
      const gl = this.gl;
      const program = gl.createProgram();
      gl.attachShader(program, compile(gl, vertex, gl.VERTEX_SHADER));
      gl.attachShader(program, compile(gl, fragment(single, sampler), gl.FRAGMENT_SHADER));
      gl.bindAttribLocation(program, 0, 'corner');
      gl.linkProgram(program);
      gl.useProgram(program);
      const at = (name) => gl.getUniformLocation(program, name);
      ['samples', 'table', 'colours'].forEach((name, unit) => gl.uniform1i(at(name), unit));
      this.programs.set(key, { program, at });
    }
    return this.programs.get(key);
  }

  /// Copies the samples of a new ping into the texture.
  load(image, samples, table, full_scale) {
    const gl = this.gl;
    const format = formats(gl)[image.encoding] ?? formats(gl)['32FC1'];
    gl.activeTexture(gl.TEXTURE0);
    const size = `${image.encoding} ${image.width} ${image.height}`;
    if (size === this.size) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, image.width, image.height, format.format, format.type, samples);
    else gl.texImage2D(gl.TEXTURE_2D, 0, format.internal, image.width, image.height, 0, format.format, format.type, samples);
    this.size = size;
    this.format = format;
    this.full_scale = full_scale;
    if (table !== this.table) {
      gl.activeTexture(gl.TEXTURE1);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, table_entries, 1, 0, gl.RED, gl.FLOAT, table.beams);
      this.table = table;
    }
  }

  /// map: 256 x RGBA bytes.
  paint(polar, layout, { map, gain, gamma, single, outside }) {
    const gl = this.gl;
    if (map !== this.map) {
      gl.activeTexture(gl.TEXTURE2);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, map);
      this.map = map;
    }
    const { program, at } = this.program(single, this.format.sampler);
    gl.useProgram(program);
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    const a = polar.azimuth_rad;
    gl.uniform2f(at('apex'), layout.apex_x, layout.height - layout.apex_y);
    gl.uniform2f(at('azimuths'), this.table.first, this.table.last);
    gl.uniform2f(at('shape'), polar.rows, polar.beams);
    gl.uniform1f(at('metresPerPixel'), layout.metres_per_pixel);
    gl.uniform1f(at('startM'), polar.start_m);
    gl.uniform1f(at('spacingM'), polar.spacing_m);
    gl.uniform1f(at('rangeM'), polar.range_m);
    gl.uniform1f(at('beamSpacing'), (a[0] - a.at(-1)) / (a.length - 1));
    gl.uniform1f(at('scale'), (gain * this.format.unit) / this.full_scale);
    gl.uniform1f(at('gamma'), gamma);
    gl.uniform3fv(at('outside'), outside.map((c) => c / 255));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /// Waits until the picture is drawn, so that the caller can measure how long drawing takes.
  finish() {
    this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, new Uint8Array(4));
  }
}
