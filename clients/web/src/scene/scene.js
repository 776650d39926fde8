// The scene's pane: objects as the daemon sends them, the vehicle, and the last ping at its place.
import { $, setHidden, setText } from '../dom.js';
import { Camera, drawCompass } from './camera.js';
import { Color, DirectionalLight, DoubleSide, FogExp2, Group, HemisphereLight, Mesh, MeshLambertMaterial, MeshPhongMaterial, Raycaster, Scene as Graph, Vector2, Vector3, WebGLRenderer } from 'three.module.js';
import { fixed } from '../numbers.js';
import { makeFanPlane, makeGrid, makeLines, makePoints, makeTrail, makeVehicle } from './bodies.js';
import { coarsened, readGlb } from './glb.js';

const water = 0x0b2233;
const least_interval_ms = 1000 / 15;
const slow_ms = 60;  // a frame that takes longer is slow
const free_ms = 17;  // the browser reports the end of a frame one of its own frames later
const rest_ms = 100;  // pause after the press of a button or key, so that its effect is painted before the next frame
const click_px = 4;

export class Scene {
  /// `software` is true without a graphics processor. Smooth edges need two thirds of a frame's time there, and clicks wait for
  /// frames.
  constructor(facts, fan, software) {
    this.facts = facts;
    this.fan = fan;
    this.canvas = $('scene');
    const context = this.canvas.getContext('webgl2', { alpha: false, antialias: !software });
    this.missing = !context;
    if (this.missing) return;
    this.renderer = new WebGLRenderer({ canvas: this.canvas, context });
    this.graph = new Graph();
    this.graph.background = new Color(water);
    this.graph.fog = new FogExp2(water, 0.028);
    const sun = new DirectionalLight(0xffffff, 0.75);
    sun.position.set(-4, -6, 10);
    this.grid = makeGrid();
    this.trail = makeTrail();
    this.plane = makeFanPlane();
    this.graph.add(new HemisphereLight(0xcfe6f5, 0x4a4438, 0.62), sun, this.grid, this.trail.line);
    this.camera = new Camera(this.canvas);
    this.frames = new Map();
    this.objects = new Map();
    this.vehicles = new Map();
    this.drawnAt = 0;
    this.interval_ms = least_interval_ms;
    this.coarse = software ? 0.5 : 1;
    this.software = software;
    this.restUntil = 0;
    for (const kind of ['pointerdown', 'pointerup', 'keydown']) document.addEventListener(kind, () => (this.restUntil = performance.now() + rest_ms), true);
    for (const button of document.querySelectorAll('.camera')) button.onclick = () => this.use(button.dataset.camera);
    this.canvas.addEventListener('pointerdown', (event) => (this.pressed = [event.clientX, event.clientY]));
    this.canvas.addEventListener('click', (event) => this.pick(event));
  }

  /// Selects a view. It is drawn at once, because nothing else shows that the button was pressed.
  use(mode) {
    this.restUntil = 0;
    this.camera.use(mode);
    for (const button of document.querySelectorAll('.camera')) button.setAttribute('aria-pressed', String(button.dataset.camera === mode));
  }

  removeObjects() {
    if (this.missing) return;
    for (const id of [...this.objects.keys()]) this.remove(id);
  }

  /// Call it for a new session: it removes the old scene.
  forget() {
    if (this.missing) return;
    this.removeObjects();
    this.lines?.parent?.remove(this.lines);
    this.points?.parent?.remove(this.points);
    this.lines = this.points = null;
    this.trail.clear();
    this.camera.placed = false;
  }

  /// Returns the group of a frame, below that of its parent. "world" and unknown parents are the graph's root.
  frame(name) {
    if (!name || name === 'world') return this.graph;
    if (!this.frames.has(name)) this.frames.set(name, new Group());
    const group = this.frames.get(name);
    const parent = this.frame(this.facts.frames.get(name)?.parent);
    if (group.parent !== parent) parent.add(group);
    return group;
  }

  update({ deletions, entities }) {
    if (this.missing) return;
    for (const deletion of deletions) {
      if (deletion.type === 1) for (const id of [...this.objects.keys()]) this.remove(id);
      else this.remove(deletion.id);
    }
    for (const entity of entities) this.add(entity);
    this.stale = true;
  }

  add(entity) {
    this.remove(entity.id);
    const group = new Group();
    for (const model of entity.models) {
      const { geometry, colour } = readGlb(model.data);
      const paint = { color: new Color(...colour), side: DoubleSide };
      const mesh = this.software ? new Mesh(coarsened(geometry), new MeshLambertMaterial(paint)) : new Mesh(geometry, new MeshPhongMaterial({ ...paint, shininess: 6 }));
      const { position = null, orientation = null } = model.pose ?? {};
      if (position) mesh.position.set(position.x, position.y, position.z);
      if (orientation) mesh.quaternion.set(orientation.x, orientation.y, orientation.z, orientation.w);
      if (model.scale?.x) mesh.scale.set(model.scale.x, model.scale.y, model.scale.z);
      mesh.userData = entity;
      group.add(mesh);
    }
    this.objects.set(entity.id, group);
    this.frame(entity.frame_id).add(group);
  }

  remove(id) {
    const group = this.objects.get(id);
    if (!group) return;
    group.parent?.remove(group);
    for (const mesh of group.children) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.objects.delete(id);
  }

  /// Shows the edges of the beams.
  swath({ entities }) {
    if (this.missing) return;
    for (const entity of entities) {
      if (entity.frame_id !== this.facts.sonar) continue;
      this.lines?.parent?.remove(this.lines);
      this.lines = makeLines(entity.lines);
      this.frame(entity.frame_id).add(this.lines);
    }
    this.stale = true;
  }

  /// Shows the echoes of the last ping in space.
  cloud(message) {
    if (this.missing) return;
    this.points?.parent?.remove(this.points);
    this.points?.geometry.dispose();
    this.points = makePoints(message);
    this.frame(message.frame_id).add(this.points);
    this.stale = true;
  }

  /// Places the frames at the latest poses received.
  place() {
    for (const [name, { translation: t, rotation: r }] of this.facts.frames) {
      const group = this.frame(name);
      if (t) group.position.set(t.x, t.y, t.z);
      if (r) group.quaternion.set(r.x, r.y, r.z, r.w);
    }
    for (const vehicle of this.facts.status?.vehicles ?? []) {
      if (!this.facts.frames.has(vehicle.name)) continue;
      if (!this.vehicles.has(vehicle.name)) {
        const made = makeVehicle();
        this.vehicles.set(vehicle.name, made);
        this.frame(vehicle.name).add(made.group);
      }
      this.vehicles.get(vehicle.name).hollow(vehicle.stale);
    }
    const sonar = this.frame(this.facts.sonar);
    if (sonar !== this.graph && this.plane.mesh.parent !== sonar) sonar.add(this.plane.mesh);
    if (this.points) this.points.visible = this.points.parent === sonar;  // not the points of a sonar that was shown before
    this.graph.updateMatrixWorld();
  }

  /// Draws at most 15 times a second, and only if something moved.
  draw() {
    if (this.missing || document.hidden) return;
    const now = performance.now();
    if (!this.finished(now) || now < this.restUntil) return;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (width < 40 || height < 40 || now - this.drawnAt < this.interval_ms) return;
    const resized = width !== this.width || height !== this.height;
    const news = this.fan.ping !== this.shownPing || this.plane.show(this.fan) || this.facts.frames.size !== this.knownFrames;
    if (!news && !resized && !this.camera.moved && !this.stale) return;
    this.drawnAt = now;
    this.plane.show(this.fan);
    [this.shownPing, this.knownFrames] = [this.fan.ping, this.facts.frames.size];
    [this.stale, this.camera.moved] = [false, false];
    if (resized) {
      [this.width, this.height] = [width, height];
      this.renderer.setPixelRatio(this.coarse * Math.min(2, devicePixelRatio || 1));
      this.renderer.setSize(width, height, false);
    }
    this.place();
    const vehicle = this.frames.get(this.facts.vehicle?.name);
    if (vehicle) this.trail.add(now / 1000, vehicle.position);
    const ahead = vehicle ? new Vector3(1, 0, 0).applyQuaternion(vehicle.quaternion) : new Vector3(1, 0, 0);
    this.camera.update(vehicle?.position ?? null, Math.atan2(ahead.y, ahead.x), width / height);
    this.renderer.render(this.graph, this.camera.camera);
    drawCompass($('compass'), this.camera.view);
    this.caption(vehicle);
    const gl = this.renderer.getContext();
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }

  /// True if the last frame is drawn; never waits for it. On slow machines the scene has half as many pixels, and leaves most of
  /// the time to the rest of the page.
  finished(now) {
    if (!this.fence) return true;
    const gl = this.renderer.getContext();
    if (!gl.isContextLost() && gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return false;
    gl.deleteSync(this.fence);
    this.fence = null;
    const cost_ms = now - this.drawnAt - free_ms;
    this.interval_ms = Math.max(least_interval_ms, 5 * cost_ms);
    if (cost_ms > slow_ms && this.coarse === 1) {
      this.coarse = 0.5;
      this.width = 0;  // 0: the size is set again
    }
    return true;
  }

  caption(vehicle) {
    setText($('pose-name'), this.facts.vehicle?.name ?? 'vehicle');
    const p = vehicle?.position;
    setText($('pose'), p ? `${fixed(p.x, 2)}, ${fixed(p.y, 2)}, ${fixed(p.z, 2)} m` : '–');
  }

  /// Names the object under a click.
  pick(event) {
    if (!this.pressed || Math.hypot(event.clientX - this.pressed[0], event.clientY - this.pressed[1]) > click_px) return;
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector2(((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2);
    const ray = new Raycaster();
    ray.setFromCamera(at, this.camera.camera);
    const hit = ray.intersectObjects([...this.objects.values()], true)[0];
    setHidden($('picked'), !hit);
    if (!hit) return;
    const sonar = this.frames.get(this.facts.sonar);
    const entity = hit.object.userData;
    const material = entity.metadata?.find((m) => m.key === 'material')?.value;
    const distance = sonar && new Vector3().setFromMatrixPosition(sonar.matrixWorld).distanceTo(hit.point);
    const parts = [entity.id, material, distance === undefined ? '' : `${fixed(distance, 1)} m from ${this.facts.sonar}`];
    setText($('picked'), parts.filter(Boolean).join(' · '));
  }
}
