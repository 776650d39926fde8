// The page: one connection to the daemon, and the panes that show its data.
import { $, make, setHidden, setText, setClass } from './dom.js';
import { Connection } from './socket/connection.js';
import { Facts } from './facts.js';
import { Fan } from './fan/fan.js';
import { LogPane } from './panels/log.js';
import { Notice } from './panels/notice.js';
import { Refusals } from './panels/refusals.js';
import { Timeline } from './panels/timeline.js';
import { drawConnections, drawHistory } from './panels/connections.js';
import { drawDoctor } from './panels/doctor.js';
import { drawFaults } from './panels/faults.js';
import { drawHead } from './panels/head.js';
import { drawRecordings, toggleRecording } from './panels/recordings.js';
import { drawSettings } from './panels/settings.js';
import { fixed } from './numbers.js';
import { listenToKeys } from './keys.js';
import { makeRemembered } from './remember.js';
import { mapNames } from './fan/colours.js';
import { activeTroubles, titleOf } from './panels/faults.js';

const test = Number(new URLSearchParams(location.search).get('test'));  // for tests: the width of a fan without rings
const look = makeRemembered('look', { theme: '', tab: 'fan' });

const scene_waits_s = 1.5;  // longest wait for the first picture after the connection
const scene_waits_for_pings_s = 10;  // longest wait while a picture is being computed

const facts = new Facts();
const connection = new Connection({
  open(info) {
    facts.opened(info);
    $('name').title = `${info.name} at ${location.host}`;
    setText($('about'), `${info.name} at ${location.host}. Documents: docs/live-view.md of the source tree, /usr/share/doc/sonard of the package.`);
    document.body.classList.toggle('plays', Boolean(facts.recording));
    scene?.forget();
    allEchoesOf = '';
    choose();
  },
  lost() {
    facts.connection = facts.info ? 'lost' : 'connecting';
  },
  needsToken(refused) {
    facts.connection = 'token';
    facts.tokenRefused = refused;
  },
  topics: choose,
  message(topic, value, ns) {
    facts.message(topic, value, ns);
    if (topic === '/scene') scene?.update(value);
    if (topic === '/swath') scene?.swath(value);
    if (topic === `/${facts.sonar}/cloud`) scene?.cloud(value);
    if (topic === '/status') choose();
    if (topic === `/${facts.sonar}/picture` && facts.pictureKind !== chosenKind) choose();
  },
  time: (ns) => facts.setTime(ns),
  parameters: (list) => facts.setParameters(list),
  status({ id, message }) {
    if (id?.startsWith('param:')) refusals.show(id, message, id.slice('param:'.length));
  },
});
connection.open();  // its callbacks run only after this script, so they may use everything below
const refusals = new Refusals();
const fan = new Fan(facts, test);
let scene = null;

const steering = {
  set(name, value, type = facts.parameters.get(name)?.type) {
    refusals.note(`param:${name}`);
    connection.set(name, value, type);
  },
  call(service, request) {
    refusals.note(service);
    return connection.call(service, request).catch((error) => refusals.show(service, error.message));
  },
  start: (name, seconds) => steering.set(name, Number(seconds), 'float64'),
  clear(fault) {
    if (!fault.name.startsWith('view.')) {  // another viewer or program began it, so it is ended by its name
      for (const one of facts.faults)
        if (one.do === fault.do && one.sonar === fault.sonar && (fault.do || one.name === fault.name))
          steering.call('/sonard/end_faults', { name: one.name });
      return;
    }
    const trouble = (fault.do || fault.name).replace(/-/g, '_');
    const name = [`/faults/${fault.sonar}/${trouble}`, `/faults/${trouble}`].find((n) => facts.parameters.has(n));
    if (name) steering.set(name, 0, 'float64');
    else steering.set('/faults/clear_all', true);
  },
};
const notice = new Notice(facts, connection, steering);
const timeline = new Timeline(facts, steering);
const log = new LogPane(facts);

let chosenKind = '';
let allEchoesOf = '';  // the sonar whose cloud shows every echo
/// Subscribes to what is visible: no pictures while the page is hidden.
function choose() {
  if (!facts.sonar) {
    const first = [...connection.byTopic.keys()].find((topic) => /^\/[^/]+\/image$/.test(topic));
    if (first) facts.sonar = first.split('/')[1];
  }
  chosenKind = facts.pictureKind;
  const topics = ['/status', '/doctor', '/faults', '/log'];
  const own = (name) => `/${facts.sonar}/${name}`;
  if (!document.hidden) topics.push(own('geometry'), own('ping'), own('picture'), own(fan.drawn ? 'fan' : 'image'), '/tf');
  if (!document.hidden && scene) topics.push('/scene', '/swath', ...(facts.pictureKind === 'range image' ? [own('cloud')] : []));
  showAllEchoes(own('view/cloud_threshold'));
  facts.judged = connection.byTopic.has('/doctor');
  // The daemon does not name the objects that were removed meanwhile.
  if (!document.hidden && !connection.topics.has('/scene')) scene?.removeObjects();
  connection.want(topics);
}

/// Requests the cloud of all echoes, once per connection and sonar with range images. A recording has no cloud and no settings.
function showAllEchoes(threshold) {
  const able = facts.maySteer && facts.connection === 'open' && !facts.recording;
  const wanted = able && facts.pictureKind === 'range image' ? facts.sonar : '';
  if (wanted && wanted !== allEchoesOf) steering.set(threshold, 0, 'float64');
  allEchoesOf = wanted;
}

// Canvases are drawn only in frame(). After any other task that draws, the browser waits for the graphics, and clicks would wait
// too.
function draw() {
  const now = notice.draw();
  fan.setMood(now ? now.picture : 'fresh');
  drawHead(facts);
  drawConnections(facts);
  drawDoctor(facts, steering);
  drawFaults(facts, steering);
  drawSettings(facts, steering);
  drawRecordings(facts);
  timeline.draw();
  log.draw();
  setText($('fps'), facts.drawn.rate === undefined || !facts.ping ? '–' : `${fixed(facts.drawn.rate, 0)} fps`);
  announce();
}

/// Findings and faults are announced to screen readers, at most once in two seconds.
let announced = '';
let announcedAt = 0;
function announce() {
  const faults = activeTroubles(facts).map((f) => `fault: ${titleOf(f.trouble)}`);
  const findings = (facts.findings ?? []).filter((f) => f.level > 0 && f.check !== 'fault').map((f) => f.text);
  const text = [...faults, ...findings].join('. ');
  if (text === announced || performance.now() - announcedAt < 2000) return;
  [announced, announcedAt] = [text, performance.now()];
  setText($('announce'), text);
}

/// Starts the scene after the first picture, or when no picture is expected. Its script, the graphics, meshes and shaders would delay
/// the first picture, by seconds with a software renderer.
function sceneMayBegin() {
  if (facts.drawnPings > 0) return true;  // the picture was painted before this frame
  if (facts.connection !== 'open' || !facts.status) return false;
  const expected = facts.previews || facts.preview || facts.listened;
  return performance.now() / 1000 - facts.openedAt > (expected ? scene_waits_for_pings_s : scene_waits_s);
}

/// Returns the name of the renderer once the graphics have started; '' if unknown, null without WebGL2.
function startGraphics() {
  return new Promise((done) => {
    const worker = new Worker(document.body.dataset.graphics);
    worker.onmessage = ({ data }) => (done(data), worker.terminate());
    worker.onerror = () => done('');  // no OffscreenCanvas
  });
}

let sceneBegun = false;
async function beginScene() {
  sceneBegun = true;
  const [{ Scene }, renderer] = await Promise.all([import(document.body.dataset.scene), startGraphics()]);
  const software = /swiftshader|llvmpipe|software|basic render/i.test(renderer ?? '');
  if (renderer !== null && !software) fan.useGraphics();
  scene = new Scene(facts, fan, software);
  if (scene.missing) missScene();
  choose();
}

/// Shows the picture in place of the scene, which cannot be drawn; on a phone each pane has the whole screen.
function missScene() {
  setHidden($('no-scene'), false);
  setHidden($('scene'), true);
  facts.noScene = $('no-scene').textContent;
  for (const button of document.querySelectorAll('.camera')) button.disabled = true;
  if (document.body.dataset.max === '0' && innerWidth >= 820) maximise('1');
}

function frame() {
  const begins = !sceneBegun && sceneMayBegin();
  fan.show(facts.ping);
  drawHistory($('history'), facts);
  scene?.draw();
  if (begins) beginScene();
  requestAnimationFrame(frame);
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme || (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark');
}
function toggleTheme() {
  look.theme = document.documentElement.dataset.theme === 'light' ? 'dark' : 'light';
  setTheme(look.theme);
}

function showTab(tab) {
  document.body.dataset.tab = look.tab = tab;
  for (const button of $('tabs').children) {
    if (button.dataset.tab === tab) button.setAttribute('aria-current', 'page');
    else button.removeAttribute('aria-current');
  }
  if (tab === 'log') $('log').scrollTop = $('log').scrollHeight;  // the newest line
}

function toSettings() {
  if (document.body.dataset.max !== '0') maximise('0');
  showTab('clients');
  const field = document.querySelector('#setting-rows :is(input, select):not(:disabled)') ?? $('settings');
  field.focus();
  field.select?.();
}

function maximise(pane) {
  document.body.dataset.max = document.body.dataset.max === pane ? '0' : pane;
  for (const button of document.querySelectorAll('.maximise')) button.setAttribute('aria-pressed', String(button.dataset.pane === document.body.dataset.max));
}

function showMap() {
  $('map').value = fan.mapName;
  requestAnimationFrame(() => $('ramp').getContext('2d').putImageData(new ImageData(new Uint8ClampedArray(fan.map), 256, 1), 0, 0));
}
function showGain() {
  $('gain').value = String(Math.log2(fan.gain));
  setText($('gain-text'), `×${fixed(fan.gain, 1)}`);
}
function changeGain(octaves) {
  fan.setGain(fan.gain * 2 ** octaves);
  showGain();
}
function freeze() {
  const frozen = fan.toggleFreeze();
  $('freeze').setAttribute('aria-pressed', String(frozen));
  setText($('freeze'), frozen ? 'Go on' : 'Freeze');
}

$('map').append(...mapNames.map((name) => make('option', { value: name }, name)));
$('map').onchange = () => (fan.useMap($('map').value), showMap());
$('gain').oninput = () => (fan.setGain(2 ** Number($('gain').value)), showGain());
$('png').onclick = () => fan.save();
$('freeze').onclick = freeze;
$('theme').onclick = toggleTheme;
$('help-button').onclick = () => $('help').showModal();
$('record').onclick = () => toggleRecording(facts, steering.call);
$('skip-settings').onclick = (event) => (event.preventDefault(), toSettings());
$('sonar').onchange = () => (facts.select($('sonar').value), choose());
$('clear-faults').onclick = () => steering.set('/faults/clear_all', true);
for (const button of $('tabs').children) button.onclick = () => showTab(button.dataset.tab);
for (const button of document.querySelectorAll('.maximise')) button.onclick = () => maximise(button.dataset.pane);
document.addEventListener('visibilitychange', choose);
matchMedia('(prefers-color-scheme: light)').addEventListener('change', () => setTheme(look.theme));
listenToKeys([
  [[' '], 'space', 'play or pause the trajectory or the recording', () => timeline.toggle()],
  [['ArrowLeft', 'ArrowRight'], '← →', 'one second back or ahead', (key) => timeline.step(key === 'ArrowLeft' ? -1 : 1)],
  [['c'], 'c', 'next colour map', () => (fan.nextMap(), showMap())],
  [['+', '=', '-'], '+ −', 'a brighter or darker picture', (key) => changeGain(key === '-' ? -0.25 : 0.25)],
  [['f'], 'f', 'hold the picture, or go on', freeze],
  [['s'], 's', 'save the picture as PNG', () => fan.save()],
  [['g'], 'g', 'range rings', () => fan.toggleRings()],
  [['1', '2', '0'], '1 2 0', 'picture alone, scene alone, both', (key) => maximise(key)],
  [['e'], 'e', 'to the faults', () => (showTab('faults'), document.querySelector('#troubles button:not(:disabled)')?.focus())],
  [['r'], 'r', 'to the settings, range first', toSettings],
  [['t'], 't', 'light or dark', toggleTheme],
  [['?'], '?', 'this list; Esc closes it', () => $('help').showModal()],
]);

setTheme(look.theme);
showTab(test ? 'fan' : look.tab);
showMap();
showGain();
setClass($('fan-glass'), 'fresh');
setInterval(draw, 200);
requestAnimationFrame(frame);
if (test) window.sonardTest = { facts, fan, connection, get scene() { return scene; } };
