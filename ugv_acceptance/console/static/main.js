// The page: one WebSocket, the newest frame drawn once a screen refresh, and a watchdog of its own.
import { $, text } from './dom.js';
import { Countdown, lost, showHeadline } from './headline.js';
import { showStatus } from './status.js';
import { showMargins, showTorques, showInputs, showLoad } from './panels.js';
import { Alerts } from './alerts.js';
import { Views } from './views.js';
import { SafeMap } from './map.js';
import { Strips } from './strips.js';
import { Playback } from './playback.js';
import { Drill } from './drill.js';
import { Sound } from './sound.js';
import { Tell } from './tell.js';
import { follow as followNight } from './night.js';

const SILENCE = 450; // ms without a frame: what is shown may no longer be true; seen within 500
const RETRY = 1000;

const page = { hello: null, frame: null, known: null, knownAt: 0, fresh: false, last: -Infinity, socket: null, asked: 0, waiting: new Map() };
const sound = new Sound();
const countdown = new Countdown();
const alerts = new Alerts(ask);
const tell = new Tell(ask);
const views = new Views();
const map = new SafeMap(ask);
const strips = new Strips();
const playback = new Playback(ask);
const drill = new Drill(ask);
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
  tell.describe(message);
}

const take = {
  hello,
  answer,
  map: (message) => map.take(message),
  frame: (message) => {
    page.frame = message;
    page.fresh = true;
    page.last = performance.now();
    if (message.level !== 'STALE') { page.known = message; page.knownAt = page.last; }
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
function draw() {
  const age = performance.now() - page.last, silent = age > SILENCE;
  if (!page.fresh && !silent) return;
  const { frame, hello } = page, shown = silent ? lost(page, age) : frame;
  showHeadline(shown);
  sound.follow(shown);
  countdown.show(shown, hello?.source !== 'bag');
  if (!hello || !frame) return;
  alerts.show(shown);
  showMargins(frame, hello, silent);
  showTorques(frame, hello, silent);
  if (silent) return;
  page.fresh = false;
  showStatus(frame);
  tell.show(frame);
  showInputs(frame);
  showLoad(frame, hello);
  playback.show(frame);
  drill.show(frame);
  if (frame.level !== 'STALE') {
    views.draw(frame, hello);
    map.draw(frame);
  }
  strips.draw();
  page.painted = frame.number;
  page.paintedAt = Date.now();
}

function everyScreen() {
  draw();
  requestAnimationFrame(everyScreen);
}

$('arm').addEventListener('click', () => sound.toggle());
followNight();
connect();
everyScreen();
// A page in the background is not drawn; its verdict still is looked after.
setInterval(draw, 100);
