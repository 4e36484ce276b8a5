// The page: one WebSocket, the newest frame drawn once a screen refresh, and a watchdog of its own.
import { $, text, fixed, say } from './dom.js';
import { showVerdict, showTilt, showTorques, showInputs, showLoad } from './panels.js';
import { Alerts } from './alerts.js';
import { Views } from './views.js';
import { SafeMap } from './map.js';
import { Strips } from './strips.js';
import { Playback } from './playback.js';
import { Sound } from './sound.js';

const SILENCE = 450; // ms without a frame: what is shown may no longer be true; seen within 500
const RETRY = 1000;

const page = { hello: null, frame: null, fresh: false, last: -Infinity, socket: null, asked: 0, waiting: new Map() };
const sound = new Sound();
const alerts = new Alerts(ask);
const views = new Views();
const map = new SafeMap(ask);
const strips = new Strips();
const playback = new Playback(ask);
window.console_page = page; // for tests: what is known, nothing to be changed

function ask(values, then) {
  if (!page.socket || page.socket.readyState !== WebSocket.OPEN) return then?.({ ok: false, text: 'not connected' });
  const number = ++page.asked;
  if (then) page.waiting.set(number, then);
  page.socket.send(JSON.stringify({ ...values, number }));
}

function answer(message) {
  const then = page.waiting.get(message.number);
  page.waiting.delete(message.number);
  then?.(message);
}

function hello(message) {
  page.hello = message;
  text($('title'), `${message.robot}: ${message.title}`);
  document.title = `${message.robot} – UGV acceptance console`;
  playback.describe(message);
  map.describe(message);
  alerts.describe(message);
  strips.describe(message);
  $('load-form').hidden = message.source !== 'live' || !message.payload_link;
}

const take = {
  hello,
  answer,
  map: (message) => map.take(message),
  frame: (message) => {
    page.frame = message;
    page.fresh = true;
    page.last = performance.now();
    strips.take(message);
    views.take(message);
    map.follow(message);
  },
};

function connect() {
  const address = new URL('live', location.href);
  address.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
  const token = decodeURIComponent(location.hash.slice(1));
  address.search = token ? `?token=${encodeURIComponent(token)}` : '';
  address.hash = '';
  const socket = new WebSocket(address);
  page.socket = socket;
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    take[message.kind]?.(message);
  };
  socket.onclose = () => setTimeout(connect, RETRY);
}

// Nothing came for too long: whatever the last frame said, there are no data.
const lost = (age) => ({
  level: 'STALE',
  word: 'NO DATA',
  cause: Number.isFinite(age) ? `the console server has sent nothing for ${fixed(age / 1000)} s` : 'no answer from the console server',
  advice: 'stop the robot; check that the console runs and that the network is there',
  left: '',
  alerts: page.frame ? page.frame.alerts : [],
});

function draw() {
  const age = performance.now() - page.last;
  const silent = age > SILENCE;
  if (page.fresh || silent) {
    const shown = silent ? lost(age) : page.frame;
    showVerdict(shown);
    sound.follow(shown);
    if (!silent && page.hello) {
      page.fresh = false;
      const frame = page.frame;
      alerts.show(frame);
      showInputs(frame);
      showLoad(frame, page.hello);
      playback.show(frame);
      if (frame.level !== 'STALE') {
        showTilt(frame, page.hello);
        showTorques(frame, page.hello);
        views.draw(frame, page.hello);
        map.draw(frame);
      }
      strips.draw();
      page.painted = frame.number;
      page.paintedAt = Date.now();
    }
  }
}

function everyScreen() {
  draw();
  requestAnimationFrame(everyScreen);
}

$('arm').addEventListener('click', () => sound.toggle());
$('load-form').addEventListener('submit', (event) => {
  event.preventDefault();
  const [mass_kg, x, y, z] = ['mass', 'x', 'y', 'z'].map((k) => Number($(`load-${k}`).value));
  ask({ do: 'payload', mass_kg, cog_m: [x, y, z] }, say('load-answer'));
});
connect();
everyScreen();
// A page in the background is not drawn; its verdict still is looked after.
setInterval(draw, 100);
