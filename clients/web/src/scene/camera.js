// The scene's camera: Orbit (turns about a place), Follow (behind the vehicle, turns with it), Top (north up).
import { PerspectiveCamera, Vector3 } from 'three.module.js';

const closest_m = 0.6;
const farthest_m = 150;
const steepest = 1.5;

const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

export class Camera {
  constructor(canvas) {
    this.camera = new PerspectiveCamera(50, 1, 0.05, 400);
    this.camera.up.set(0, 0, 1);
    this.target = new Vector3(0, 0, -3);
    this.mode = 'orbit';
    this.azimuth = -2.4;  // azimuth of the camera, seen from the target; east = 0, counter-clockwise
    this.elevation = 0.42;
    this.distance = 11;
    this.moved = true;
    this.pointers = new Map();
    canvas.addEventListener('pointerdown', (event) => this.press(canvas, event));
    canvas.addEventListener('pointermove', (event) => this.drag(event));
    for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener('wheel', (event) => (event.preventDefault(), this.zoom(Math.exp(event.deltaY * 0.0012))), { passive: false });
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('keydown', (event) => this.key(event));
  }

  use(mode) {
    this.mode = mode;
    this.pan = undefined;
    if (mode === 'follow') [this.azimuth, this.elevation, this.distance] = [Math.PI, 0.35, 5];  // behind the vehicle
    if (mode === 'top') [this.azimuth, this.elevation, this.distance] = [-Math.PI / 2, steepest + 0.07, 22];
    if (mode === 'orbit') [this.azimuth, this.elevation, this.distance] = [-2.4, 0.42, 11];
    this.moved = true;
  }

  press(canvas, event) {
    canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  drag(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
    if (this.pointers.size === 2) {  // two fingers zoom, and move the view along
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const before = Math.hypot(last.x - other.x, last.y - other.y);
      this.zoom(before / Math.max(1, Math.hypot(event.clientX - other.x, event.clientY - other.y)));
      this.shift(dx / 2, dy / 2);
    } else if (event.buttons === 2 || event.shiftKey) {
      this.shift(dx, dy);
    } else {
      this.turn(dx * 0.007, dy * 0.005);
    }
    [last.x, last.y] = [event.clientX, event.clientY];
  }

  turn(right, down) {
    this.azimuth -= right;
    if (this.mode !== 'top') this.elevation = clamp(this.elevation + down, -0.6, steepest);
    this.moved = true;
  }
  zoom(factor) {
    this.distance = clamp(this.distance * factor, closest_m, farthest_m);
    this.moved = true;
  }
  shift(dx, dy) {
    const scale = this.distance * 0.0016;
    this.pan ??= new Vector3();
    const right = new Vector3().setFromMatrixColumn(this.camera.matrix, 0);
    const up = new Vector3().setFromMatrixColumn(this.camera.matrix, 1);
    this.pan.addScaledVector(right, -dx * scale).addScaledVector(up, dy * scale);
    this.moved = true;
  }

  key(event) {
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    if (turns[event.key]) this.turn(...turns[event.key]);
    else if (event.key === 'PageUp') this.zoom(0.85);
    else if (event.key === 'PageDown') this.zoom(1.18);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /// `place`: position of the vehicle, or null; `heading`: its direction ahead, counter-clockwise from east.
  update(place, heading, aspect) {
    if (place && (this.mode !== 'orbit' || !this.placed)) {
      this.target.copy(place);
      if (this.mode === 'orbit') this.target.multiplyScalar(0.5).setZ(place.z - 1);  // between the vehicle and the origin, 1 m below the vehicle
      this.placed = true;
    }
    const azimuth = this.azimuth + (this.mode === 'follow' ? heading : 0);
    const target = this.pan ? this.target.clone().add(this.pan) : this.target;
    const distance = this.distance * Math.max(1, 1.2 / aspect);  // so narrow panes show the same width
    const flat = distance * Math.cos(this.elevation);
    this.camera.position.set(target.x + flat * Math.cos(azimuth), target.y + flat * Math.sin(azimuth), target.z + distance * Math.sin(this.elevation));
    this.camera.aspect = aspect;
    this.camera.lookAt(target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.view = azimuth + Math.PI;  // direction of the camera, counter-clockwise from east
  }
}

/// Draws north on a small round card; `view`: the direction of the camera.
export function drawCompass(canvas, view) {
  const g = canvas.getContext('2d');
  g.setTransform(2, 0, 0, 2, 0, 0);
  g.clearRect(0, 0, 44, 44);
  g.translate(22, 22);
  g.strokeStyle = 'rgba(200, 214, 229, 0.5)';
  g.beginPath();
  g.arc(0, 0, 20, 0, 2 * Math.PI);
  g.stroke();
  g.rotate(view - Math.PI / 2);
  for (const [way, colour] of [[-1, '#ff7b72'], [1, '#94a1ae']]) {
    g.fillStyle = colour;
    g.beginPath();
    g.moveTo(0, way * 12);
    g.lineTo(4, 0);
    g.lineTo(-4, 0);
    g.fill();
  }
  g.fillStyle = '#e6edf3';
  g.font = '600 9px system-ui, sans-serif';
  g.textAlign = 'center';
  g.fillText('N', 0, -13);
}
