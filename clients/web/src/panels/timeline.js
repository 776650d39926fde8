// Playback of the vehicle's trajectory: play, pause, seek, speed.
import { $, make, setHidden, setText, showList } from '../dom.js';
import { dash, fixed, short } from '../numbers.js';

const most_seeks_a_second = 5;
const speeds = [0.1, 0.5, 1, 2, 5, 10];

export class Timeline {
  constructor(facts, steering) {
    this.facts = facts;
    this.steering = steering;
    const bar = $('position');
    bar.addEventListener('input', () => this.seek(Number(bar.value)));
    bar.addEventListener('change', () => this.finishSeek());
    $('play').addEventListener('click', () => this.toggle());
    $('speed').addEventListener('change', () => this.set('speed', Number($('speed').value)));
  }

  get trajectory() {
    return this.facts.vehicle?.trajectory ?? null;
  }
  set(name, value) {
    this.steering.set(`/${this.facts.vehicle.name}/trajectory/${name}`, value);
  }
  own(name, otherwise) {
    return this.facts.value(`/${this.facts.vehicle.name}/trajectory/${name}`) ?? otherwise;
  }
  toggle() {
    if (this.trajectory && this.facts.maySteer) this.set('paused', !this.own('paused', this.trajectory.paused));
  }
  step(seconds) {
    if (!this.trajectory || !this.facts.maySteer) return;
    const at = (this.wanted ?? this.position()) + seconds;
    this.seek(Math.min(this.trajectory.duration_s, Math.max(0, at)));
    this.finishSeek();
  }

  /// Sends at most five requests a second while the bar is dragged, and always the last one.
  seek(position_s) {
    this.wanted = position_s;
    this.timer ??= setTimeout(() => {
      this.timer = undefined;
      if (this.wanted !== undefined) this.set('position_s', this.wanted);
    }, 1000 / most_seeks_a_second);
    this.draw();
  }
  finishSeek() {
    clearTimeout(this.timer);
    this.timer = undefined;
    if (this.wanted === undefined) return;
    this.set('position_s', this.wanted);
    this.settling = { from: performance.now() };
  }

  /// The position, continued between the daemon's messages so that the bar moves evenly.
  position() {
    const trajectory = this.trajectory;
    const status_s = trajectory.position_s;
    if (trajectory.paused || this.own('paused', false)) return this.own('position_s', status_s);
    if (status_s !== this.received_s) [this.received_s, this.received_at] = [status_s, performance.now()];
    const since_s = this.facts.realtime ? Math.min(1.5, (performance.now() - this.received_at) / 1000) : 0;
    return Math.min(trajectory.duration_s, status_s + trajectory.speed * since_s);
  }

  draw() {
    const trajectory = this.trajectory;
    setHidden($('timeline'), !trajectory);
    if (!trajectory) return;
    const { facts } = this;
    if (this.settling && performance.now() - this.settling.from > 600) {
      this.settling = undefined;
      this.wanted = undefined;
    }
    const able = facts.maySteer && facts.connection === 'open';
    const paused = this.own('paused', trajectory.paused);
    const play = $('play');
    setText(play, paused ? '▶' : '❚❚');
    const label = paused ? 'Play' : 'Pause';
    if (play.getAttribute('aria-label') !== label) play.setAttribute('aria-label', label);
    play.title = able ? `${label} (space)` : 'this page is read-only';
    setText($('timeline-name'), `${facts.vehicle.name} · ${trajectory.file.replace(/^.*\//, '')}`);
    const bar = $('position');
    if (Number(bar.max) !== trajectory.duration_s) bar.max = trajectory.duration_s;
    const at = this.wanted ?? this.position();
    if (this.wanted === undefined) bar.value = at;
    bar.setAttribute('aria-valuetext', `${fixed(at, 0)} of ${fixed(trajectory.duration_s, 0)} seconds`);
    setText($('position-text'), `${fixed(at, 1)} s`);
    setText($('duration'), trajectory.duration_s > 0 ? `/ ${short(trajectory.duration_s, 1)} s` : dash);
    const speed = this.own('speed', trajectory.speed);
    const choices = [...new Set([...speeds, speed])].sort((a, b) => a - b);
    showList($('speed'), choices, () => choices.map((s) => make('option', { value: String(s) }, `${short(s, 3)}×`)));
    if (document.activeElement !== $('speed')) $('speed').value = String(speed);
    for (const control of [play, bar, $('speed')]) control.disabled = !able;
  }
}
